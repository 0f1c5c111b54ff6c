"""The folder of a diagnosis: what a run writes there, and what it takes away of an earlier one."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnoses_made import case

from smartshoe.report.diagnosis.folder import publish_diagnosis


def _files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("later", ["refused", "adequate"])
def test_nothing_of_an_earlier_diagnosis_stays_beside_the_new_page_and_every_file_of_the_users_does(
    tmp_path: Path, later: str
) -> None:
    publish_diagnosis(tmp_path, case("two causes"), "toe", {}, ["svg", "png"])
    protocol = (tmp_path / "minor_loops.toml").read_text(encoding="utf-8")
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".svg", ".png"}
    own = {
        "figures/mine.svg": "<svg/>",
        "a_copy.toml": protocol,
        "pasted.toml": f'{protocol}[[unit]]\nname = "left_toe"\n',
        "steps.toml": '[protocol.steps]\nkind = "segments"\ncorners = [[0, 0], [1, 1]]\n',
        "broken.toml": "[",
        "notes.txt": "mine",
    }
    for name, text in own.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    taken_away = publish_diagnosis(tmp_path, case(later), "heel", {}).taken_away
    assert [path.name for path in taken_away if path.parent == tmp_path] == ["minor_loops.toml"]
    assert {path.suffix for path in taken_away if path.parent != tmp_path} == {".svg", ".png"}
    assert _files(tmp_path) == {"diagnosis.html", "diagnosis.json", *own}
    assert {name: (tmp_path / name).read_text(encoding="utf-8") for name in own} == own


def test_of_figures_in_a_used_folder_those_of_this_run_stay(tmp_path: Path) -> None:
    publish_diagnosis(tmp_path, case("two causes"), "toe", {}, ["svg"])
    first = {path.stem for path in (tmp_path / "figures").iterdir()}
    publish_diagnosis(tmp_path, case("two causes"), "toe", {}, ["pdf"])
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {f"{name}.pdf" for name in first}
    publish_diagnosis(tmp_path, case("two causes"), "toe", {})
    assert _files(tmp_path) == {"diagnosis.html", "diagnosis.json", "minor_loops.toml"}
