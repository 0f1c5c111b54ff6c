"""What stands in a code block of the README, and of the page that goes on from it, is run."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from smartshoe.cli import run_command


def _blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def _tours(page: Path) -> list[str]:
    return [block for block in _blocks(page, "bash") if block.startswith("smartshoe")]


def _run(block: str) -> None:
    for line in block.strip().splitlines():
        words = shlex.split(line)
        assert words[0] == "smartshoe"
        assert run_command(words[1:]) == 0, line


@pytest.fixture
def readme(root: Path) -> Path:
    return root / "README.md"


@pytest.fixture
def tour(root: Path) -> Path:
    return root / "docs" / "tour.md"


@pytest.fixture(autouse=True)
def elsewhere(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of its own with the scenarios."""
    shutil.copytree(root / "scenarios", tmp_path / "scenarios")
    monkeypatch.chdir(tmp_path)


def test_the_two_commands_stand_alone_in_their_blocks(readme: Path) -> None:
    text = readme.read_text(encoding="utf-8")
    for heading in ("Run it", "Test it"):
        section = text.split(f"## {heading}\n")[1].split("\n## ")[0]
        (block,) = re.findall(r"```bash\n(.*?)```", section, re.DOTALL)
        assert len(block.strip().splitlines()) == 1


def test_the_readmes_tour_is_five_lines_of_the_page_that_goes_on(readme: Path, tour: Path) -> None:
    (lines,) = _tours(readme)
    assert len(lines.splitlines()) == 5
    there = _tours(tour)[0].splitlines()
    assert all(any(other.startswith(line) for other in there) for line in lines.splitlines())


def test_the_tour_on_simulated_recordings(readme: Path, tour: Path) -> None:
    _run(_tours(tour)[0])
    for page in (readme, tour):
        for code in _blocks(page, "python"):
            exec(compile(code, page.name, "exec"), {})


@pytest.mark.real_data
def test_the_tour_on_a_real_file(tour: Path, measured: Path) -> None:
    shutil.copy(measured / "pneumatic_actuator_friction_leak" / "friction" / "Circle_3bar.csv", "Circle_3bar.csv")
    _run(_tours(tour)[1])


def test_the_tour_on_a_pair_of_logs(tour: Path) -> None:
    from smartshoe.devices import open_machine
    from smartshoe.files.logs import write
    from smartshoe.files.logs.formats.bluehill import write_bluehill
    from smartshoe.protocol import dynamic_protocol

    with open_machine("sim:instron", unit="left_toe", seed=5) as machine:
        machine.run(dynamic_protocol((200.0, 800.0)))
        bluehill, logger = machine.logs
    write_bluehill(bluehill, Path("Specimen_RawData_1.csv"))
    write(logger, "left_toe.tdms")
    _run(_tours(tour)[2])
