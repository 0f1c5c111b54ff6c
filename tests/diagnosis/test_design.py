"""What a protocol can tell before anything is measured, against what is known of each pair."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from smartshoe import dynamic_protocol, static_protocol
from smartshoe.cli import run_command
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis.design import Design, design
from smartshoe.errors import UsageError

CURVES = {"contact_area", "gas_compression", "sensor_nonlinearity", "wall_hardening"}


@pytest.fixture(scope="module")
def triangles() -> Design:
    return design([dynamic_protocol((100, 200, 400, 800))])


def test_no_waveform_tells_the_static_curves_apart(triangles: Design) -> None:
    for name in CURVES:
        assert set(triangles.cannot_be_told(name)) >= CURVES - {name}


def test_triangles_alone_leave_a_leak_a_set_and_a_drift_open_and_holds_tell_a_creep(triangles: Design) -> None:
    assert {"permanent_set", "zero_drift"} <= set(triangles.cannot_be_told("linear_leak"))
    both = design([dynamic_protocol((100, 200, 400, 800)), static_protocol()])
    assert len(both.cannot_be_told("clock_drift")) < len(triangles.cannot_be_told("clock_drift"))


def test_minor_loops_tell_friction_from_a_gain_by_direction(triangles: Design) -> None:
    loops = design([EXPERIMENTS["minor_loops"](800.0)])
    name, other = "load_unload_asymmetry", "play_hysteresis"
    place = triangles.names.index(name), triangles.names.index(other)
    assert loops.unlike[place] > 1.3 * triangles.unlike[place]


def test_less_noise_and_larger_effects_leave_no_more_open() -> None:
    protocol = [dynamic_protocol((200, 800))]
    noisy, quiet = (design(protocol, noise_percent=noise) for noise in (1.0, 0.02))
    for name in noisy.names:
        assert set(quiet.cannot_be_told(name)) <= set(noisy.cannot_be_told(name))
    assert np.all(quiet.least <= noisy.least)


def test_a_design_asks_for_a_protocol_and_for_positive_numbers() -> None:
    with pytest.raises(UsageError, match="needs a protocol"):
        design([])
    with pytest.raises(UsageError, match="noise_percent"):
        design([dynamic_protocol((200,))], noise_percent=0.0)


def test_the_command_asks_a_scenario_and_no_file(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = str(root / "scenarios" / "calibration.toml")
    assert run_command(["diagnose", "--design", scenario, "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["schema"] == "smartshoe.design/1"
    assert {one["effect"] for one in told["effects"]} >= CURVES
    assert run_command(["diagnose", "x.csv", "--design", scenario]) == 2
    assert run_command(["diagnose"]) == 2
