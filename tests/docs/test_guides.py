"""What stands in a code block of a guide is run, in a folder with the README's recordings."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

import smartshoe
from smartshoe.cli import run_command

ROOT = Path(__file__).resolve().parents[2]
GUIDES = sorted(
    path.name
    for path in (ROOT / "docs").glob("*.md")
    if path.name != "tour.md"  # has tests of its own, in test_readme.py
    and re.search(r"```(python\n|bash\nsmartshoe )", path.read_text(encoding="utf-8"))
)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("guides")
    assert (
        run_command(["simulate", str(ROOT / "scenarios" / "calibration.toml"), "--out", str(folder / "recordings")])
        == 0
    )
    return folder / "recordings"


@pytest.mark.parametrize("guide", GUIDES)
def test_the_guides_blocks_run(guide: str, recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(recordings, tmp_path / "recordings")
    shutil.copytree(ROOT / "scenarios", tmp_path / "scenarios")
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / guide).read_text(encoding="utf-8")
    for language, block in re.findall(r"```(python|bash)\n(.*?)```", text, re.DOTALL):
        if language == "python":
            exec(compile(block, guide, "exec"), {})
            continue
        for line in block.strip().splitlines():
            words = shlex.split(line)
            if words[0] == "smartshoe":
                assert run_command(words[1:]) == 0, line


@pytest.mark.parametrize("header", ["time_s,force_n,pressure_mbar", "Time (s);Load (N);P (mbar)"])
def test_the_effective_area_is_declared_as_the_guide_shows(header: str, tmp_path: Path) -> None:
    """In a plain table and in another's CSV."""
    guide = (ROOT / "docs" / "identification.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```text\n(# effective_area_m2.*?)```", guide, re.DOTALL)
    above, ours, *rows = shown.splitlines()
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join([above, header, *(row.replace(",", ";" if ";" in header else ",") for row in rows)]) + "\n",
        encoding="utf-8",
    )
    assert ours == "time_s,force_n,pressure_mbar"
    found = smartshoe.read(path)
    assert found.positive("effective_area_m2", "m2") == 0.004
    assert found.force_n.tolist() == [0.6, 0.9]
