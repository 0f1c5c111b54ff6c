"""The scenarios that are found wherever smartshoe is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from smartshoe.errors import ScenarioError
from smartshoe.runs.scenario import load


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
