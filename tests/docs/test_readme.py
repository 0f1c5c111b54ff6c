"""What stands in a code block of the README is run."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from smartshoe.cli import run_command


def _blocks(root: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (root / "README.md").read_text(encoding="utf-8"), re.DOTALL)


def _run(block: str) -> None:
    for line in block.strip().splitlines():
        words = shlex.split(line)
        assert words[0] == "smartshoe"
        assert run_command(words[1:]) == 0, line


@pytest.fixture
def tour(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    shutil.copytree(root / "scenarios", tmp_path / "scenarios")
    monkeypatch.chdir(tmp_path)
    return [block for block in _blocks(root, "bash") if block.startswith("smartshoe")]


def test_the_two_commands_stand_alone_in_their_blocks(root: Path) -> None:
    text = (root / "README.md").read_text(encoding="utf-8")
    for heading in ("Run it", "Test it"):
        section = text.split(f"## {heading}\n")[1].split("\n## ")[0]
        (block,) = re.findall(r"```bash\n(.*?)```", section, re.DOTALL)
        assert len(block.strip().splitlines()) == 1


def test_the_tour_on_simulated_recordings(tour: list[str], root: Path) -> None:
    _run(tour[0])
    for code in _blocks(root, "python"):
        exec(compile(code, "README.md", "exec"), {})


@pytest.mark.real_data
def test_the_tour_on_a_real_file(tour: list[str], measured: Path) -> None:
    shutil.copy(measured / "pneumatic_actuator_friction_leak" / "friction" / "Circle_3bar.csv", "Circle_3bar.csv")
    _run(tour[1])


def test_the_tour_on_a_pair_of_logs(tour: list[str]) -> None:
    from smartshoe.devices import open_machine
    from smartshoe.logs import write
    from smartshoe.logs.formats.bluehill import write_bluehill
    from smartshoe.protocol import dynamic_protocol

    with open_machine("sim:instron", unit="left_toe", seed=5) as machine:
        machine.run(dynamic_protocol((200.0, 800.0)))
        bluehill, logger = machine.logs
    write_bluehill(bluehill, Path("Specimen_RawData_1.csv"))
    write(logger, "left_toe.tdms")
    _run(tour[2])
