"""The folder of a diagnosis: what a run writes there, and what it takes away of an earlier one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from diagnoses_made import case

from smartshoe.report.diagnosis.folder import publish_diagnosis


def _files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A diagnosis with its figures in two formats."""
    folder = tmp_path_factory.mktemp("published")
    publish_diagnosis(folder, case("two causes"), "toe", {}, ["svg", "png"])
    return folder


@pytest.fixture
def used(published: Path, tmp_path: Path) -> Path:
    """A folder that such a diagnosis was published in."""
    return Path(shutil.copytree(published, tmp_path / "used"))


@pytest.mark.parametrize("later", ["refused", "adequate"])
def test_nothing_of_an_earlier_diagnosis_stays_beside_the_new_page_and_every_file_of_the_users_does(
    used: Path, later: str
) -> None:
    protocol = (used / "minor_loops.toml").read_text(encoding="utf-8")
    assert {path.suffix for path in (used / "figures").iterdir()} == {".svg", ".png"}
    own = {
        "figures/mine.svg": "<svg/>",
        "a_copy.toml": protocol,
        "pasted.toml": f'{protocol}[[unit]]\nname = "left_toe"\n',
        "steps.toml": '[protocol.steps]\nkind = "segments"\ncorners = [[0, 0], [1, 1]]\n',
        "broken.toml": "[",
        "notes.txt": "mine",
    }
    for name, text in own.items():
        (used / name).write_text(text, encoding="utf-8")
    taken_away = publish_diagnosis(used, case(later), "heel", {}).taken_away
    assert [path.name for path in taken_away if path.parent == used] == ["minor_loops.toml"]
    assert {path.suffix for path in taken_away if path.parent != used} == {".svg", ".png"}
    assert _files(used) == {"diagnosis.html", "diagnosis.json", *own}
    assert {name: (used / name).read_text(encoding="utf-8") for name in own} == own


def test_of_figures_in_a_used_folder_those_of_this_run_stay(used: Path) -> None:
    first = {path.stem for path in (used / "figures").iterdir()}
    publish_diagnosis(used, case("two causes"), "toe", {}, ["pdf"])
    assert {path.name for path in (used / "figures").iterdir()} == {f"{name}.pdf" for name in first}
    publish_diagnosis(used, case("two causes"), "toe", {})
    assert _files(used) == {"diagnosis.html", "diagnosis.json", "minor_loops.toml"}
