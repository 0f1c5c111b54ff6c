"""A twin on the simulated machine: the next simulation of a unit no longer gets it wrong, and says what it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simulators.benches.instron import InstronParameters, SimulatedInstron
from simulators.instruments.daq import MyRioParameters
from simulators.instruments.sensing_unit import SensingUnit
from simulators.instruments.sensor import HdiParameters, SimulatedHdiSensor
from simulators.instruments.twin import twin_of
from smartshoe.calibration import Calibration, compensated, extended_calibration
from smartshoe.errors import InputError
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import dynamic_protocol


def _strong(name: str, strength: float) -> np.ndarray:
    """The effect's values with its first parameter, the strength, at ``strength``."""
    values = effect(name).start()
    values[0] = strength
    return values


MODEL = (
    ExtendedModel(1.0, 0.15, 0.3, 800.0, 170.0, "mbar")
    .with_part(effect("play_hysteresis"), _strong("play_hysteresis", 0.02))
    .with_part(effect("linear_leak"), np.array([0.01]))
)
CALIBRATION = extended_calibration(MODEL, unit="left_toe")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    CALIBRATION.save(tmp_path / "unit.json")
    return tmp_path / "unit.json"


def _machine(path: Path) -> SimulatedInstron:
    rng = np.random.default_rng(3)
    ideal = HdiParameters(range_pa=20_000.0, noise_fraction=0.0, lag_s=0.0, bidirectional=True)
    unit = SensingUnit("left_toe", twin_of(path), SimulatedHdiSensor(ideal, rng))
    quiet = InstronParameters(load_noise_n=0.0, extension_noise_m=0.0)
    return SimulatedInstron(unit, rng, quiet, MyRioParameters(bits=16))


def test_the_machine_presses_a_twin_and_its_filter_finds_the_load(file: Path) -> None:
    with _machine(file) as machine:
        recording = machine.run(dynamic_protocol((400.0, 1600.0), rest_s=2.0))
    unit = Calibration.load(file)
    error_n = compensated(recording, unit)["force_estimate"].values - recording.force_n
    plain_n = compensated(recording, replace(unit, extended=None))["force_estimate"].values - recording.force_n
    # 16 bits of both channels, 1 N of corners that fall between samples.
    assert np.sqrt(np.mean(error_n**2)) < 1.5
    assert np.sqrt(np.mean(plain_n**2)) > 4.0
    assert recording["displacement"].values.max() > 0.1


def test_a_twin_is_no_truth_and_says_so(file: Path) -> None:
    assert "unit.json" in twin_of(file).metadata["is_twin"]


def test_a_plain_calibration_has_a_twin_too(tmp_path: Path) -> None:
    replace(CALIBRATION, extended=None).save(tmp_path / "plain.json")
    twin = twin_of(tmp_path / "plain.json")
    pressure_pa = twin.press(np.full(20_000, 400.0), 100.0)
    assert pressure_pa[-1] == pytest.approx(twin.parameters.nominal_pressure_pa(400.0))
    assert twin.deformation[-1] == pytest.approx(pressure_pa[-1] / (pressure_pa[-1] + 101_325.0))


def test_what_is_no_pressure_cannot_be_a_bladder(tmp_path: Path) -> None:
    extended_calibration(replace(MODEL, reading_unit="V")).save(tmp_path / "volts.json")
    with pytest.raises(InputError, match=r"volts\.json.*not a pressure"):
        twin_of(tmp_path / "volts.json")
    with pytest.raises(InputError, match=r"none\.json"):
        twin_of(tmp_path / "none.json")
