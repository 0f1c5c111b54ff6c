"""A scenario whose bladder is a unit's own calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smartshoe.calibration import compensated, extended_calibration
from smartshoe.devices import open_machine
from smartshoe.errors import InputError, SmartShoeError
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import dynamic_protocol
from smartshoe.runs.scenario import load, simulate

SCENARIO = """
title = "a twin"
seed = 5
[protocol.dynamic]
rates_n_per_s = [400.0, 1600.0]
repeats = 2
rest_s = 2.0
[[unit]]
name = "left_toe"
bladder = {twin = "unit.json"}
sensor = {range_mbar = 200.0, noise_percent = 0.0}
"""


def _leaking() -> ExtendedModel:
    model = ExtendedModel(1.0, 0.15, 0.3, 800.0, 170.0, "mbar")
    for name, strength in (("linear_leak", 0.02), ("zero_offset", -0.02)):
        values = effect(name).start()
        values[0] = strength
        model = model.with_part(effect(name), values)
    return model


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    extended_calibration(_leaking(), unit="left_toe").save(tmp_path / "unit.json")
    (tmp_path / "twin.toml").write_text(SCENARIO)
    return tmp_path / "twin.toml"


def test_the_next_simulation_of_a_unit_is_its_own(
    scenario: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))  # the file is beside the scenario
    recording = simulate(*load(scenario))["left_toe"]["dynamic"]
    assert "unit.json" in recording.metadata["is_twin"]
    assert recording.sensor.values[:20].mean() == pytest.approx(-3.4, abs=0.2)  # below zero, as the unit reads
    error_n = compensated(recording, extended_calibration(_leaking()))["force_estimate"].values - recording.force_n
    # 12 bits of both channels: 0.05 mbar and 0.24 N; 0.3 N of the load cell.
    assert np.sqrt(np.mean(error_n**2)) < 2.5


def test_a_missing_file_or_a_mixed_bladder_is_refused(scenario: Path) -> None:
    (scenario.parent / "unit.json").unlink()
    with pytest.raises(InputError, match=r"unit\.json"):
        simulate(*load(scenario))
    scenario.write_text(SCENARIO.replace('{twin = "unit.json"}', '{twin = "unit.json", k1 = 2.0}'))
    with pytest.raises(SmartShoeError, match=r"line 10, key unit\.0\.bladder"):
        simulate(*load(scenario))


def test_a_bladder_from_physics_is_no_twin() -> None:
    with open_machine("sim:instron", seed=1) as machine:
        recording = machine.run(dynamic_protocol((1600.0,), repeats=1, rest_s=1.0))
    assert "is_twin" not in recording.metadata
