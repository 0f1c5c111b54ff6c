"""The scenarios that are found wherever smartshoe is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

import smartshoe
from smartshoe.errors import InputError, ScenarioError
from smartshoe.files.shipped import shipped
from smartshoe.runs.scenario import load, run, simulate


def test_a_shipped_scenario_is_found_from_an_empty_folder(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _, source = load("scenarios/calibration.toml")
    assert source.text == (root / "scenarios" / "calibration.toml").read_text(encoding="utf-8")


def test_ones_own_file_of_that_name_comes_first_and_no_other_is_guessed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("calibration.toml", "other/calibration.toml", "scenarios/nothing.toml"):
        with pytest.raises(ScenarioError, match="does not exist"):
            load(name)
    Path("scenarios").mkdir()
    Path("scenarios/calibration.toml").write_text("title =", encoding="utf-8")
    with pytest.raises(ScenarioError, match="not valid TOML"):
        load("scenarios/calibration.toml")


def test_the_template_for_measured_files_says_what_it_lacks_and_runs_beside_simulated_ones(tmp_path: Path) -> None:
    template = shipped("scenarios/replay.toml")
    assert template is not None
    copied = tmp_path / "replay.toml"
    copied.write_bytes(template.read_bytes())
    scenario, source = load(copied)
    with pytest.raises(InputError, match=r"left_toe_static.csv does not exist: copy .* smartshoe simulate"):
        run(scenario, source)
    four, text = load("scenarios/calibration.toml")
    one = four.model_copy(update={"unit": tuple(unit for unit in four.unit if unit.name == "left_toe")})
    for name, recording in simulate(one, text)["left_toe"].items():
        smartshoe.write(recording, tmp_path / f"left_toe_{name}.csv")
    (unit,) = run(scenario, source).units
    assert (unit.fitted, unit.judged) == (("left_toe_static", "left_toe_dynamic"), ("left_toe_check",))
