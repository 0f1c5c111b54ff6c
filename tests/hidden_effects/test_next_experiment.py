"""The loop closed: what the data cannot tell, the proposed experiment does; what was wrong, the twin gets right."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simulators.hidden._scaling import machine_of
from simulators.hidden.recordings import HiddenCase, hide
from simulators.provider import provider
from smartshoe.calibration import Calibration
from smartshoe.diagnosis import Cause, Diagnosis, Thresholds, diagnose
from smartshoe.models.twin import TwinBladder
from smartshoe.protocol import Protocol


def margin(diagnosis: Diagnosis, name: str) -> float:
    """How far the nearest rival of the cause ``name`` is."""
    (cause,) = (cause for cause in diagnosis.causes if cause.name == name)
    return min(rival.margin for rival in cause.rivals)


def of_family(diagnosis: Diagnosis, family: str) -> Cause:
    (cause,) = (cause for cause in diagnosis.causes if cause.effect.family == family)
    return cause


@pytest.mark.parametrize(
    ("name", "percent", "protocol", "seed"),
    [
        pytest.param("delay", 0.4, "rates", 1_000_001, marks=pytest.mark.long),
        ("sensor_lag", 0.3, "rates", 1_000_002),
    ],
)
def test_an_ambiguous_pair_becomes_certain_after_the_proposed_experiment(name, percent, protocol, seed):
    case = hide(
        {name: percent},
        protocol=protocol,
        seed=seed,
        nuisances=0,
        noise_percent_fs=0.3,
        coloured_share=0.2,
        recordings=1,
    )
    first = diagnose(case.recordings, case.hold_out)
    doubtful = of_family(first, "timing")
    # The protocol cannot tell a lag of a few milliseconds from a delay: whichever is named, the other is near.
    assert name in {doubtful.name, *(rival.effect for rival in doubtful.rivals)}
    proposed = first.next_experiment
    assert proposed is not None
    assert proposed.steps is not None
    assert {"delay", "sensor_lag"} <= set(proposed.separates)
    with machine_of(case.options, case.seed) as machine:
        added = machine.run(proposed.steps)
    second = diagnose([*case.recordings, added], case.hold_out)
    assert of_family(second, "timing").name == name
    # No law is exact, so that the other stays among the equivalents; what speaks against it grows.
    assert margin(second, name) > max(
        -2.0 * math.log(Thresholds().false_name), min(abs(rival.margin) for rival in doubtful.rivals)
    )


@pytest.fixture(scope="module")
def unit() -> tuple[HiddenCase, Diagnosis]:
    case = hide({"linear_leak": 1.0}, protocol="rates_and_holds", seed=1_000_004, recordings=2)
    return case, diagnose(case.recordings, case.hold_out)


def test_the_twin_of_a_diagnosed_unit_no_longer_gets_it_wrong(unit, tmp_path):
    case, diagnosis = unit
    path = tmp_path / "unit.json"
    diagnosis.calibration(unit="left_toe").save(path)
    held = case.hold_out[0]
    reading = held.sensor.in_unit(held.sensor.unit)
    twin = TwinBladder(Calibration.load(path).model())
    simulated = held.sensor.unit.from_si(twin.press(held.force_n, held.sample_rate_hz))
    assert diagnosis.baseline is not None
    error = float(np.sqrt(np.mean((simulated - reading) ** 2)))
    noise = 0.01 * case.noise_percent_fs * case.full_scale_mbar
    # What is left is the reading's noise, and nuisances below the materiality threshold.
    assert error < 1.1 * noise
    assert diagnosis.baseline.rmse > 2.5 * noise


def test_a_machine_presses_the_twin_as_it_pressed_the_unit(unit, tmp_path):
    case, diagnosis = unit
    path = tmp_path / "unit.json"
    diagnosis.calibration(unit="left_toe").save(path)
    protocol: Protocol = case.protocols[-1]
    silent = {"sensor": {**case.noise_free_options["sensor"]}, "load_noise_n": 0.0, "daq": {"bits": 24}}
    options = {"unit": case.options["unit"], "bladder": {"twin": str(path)}, **silent}
    with provider.open_machine("instron", options, np.random.default_rng(1)) as machine:
        pressed = machine.run(protocol)
    assert "unit.json" in pressed.metadata["is_twin"]
    truth = case.noise_free[-1]["pressure"].values
    off = float(np.sqrt(np.mean((pressed["pressure"].values - truth) ** 2)))
    assert off < 1e-3 * case.full_scale_mbar
