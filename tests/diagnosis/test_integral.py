"""A reading that is what the load adds up to is no unit's: it is said, and nothing is named for certain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_diagnosis_parts import sessions_of
from told_columns import session_under, some_load

from simulators.other_sensors import OTHER_SENSORS
from smartshoe import Recording, diagnose
from smartshoe.arrays import Array
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._integral import limit_integral
from smartshoe.signals.lags import lagged

STANDARD = Thresholds()
SIZE = 600


@given(
    seed=st.integers(0, 99),
    direct=st.floats(0.0, 1.0),
    integral=st.floats(0.0, 1.0),
    offset=st.floats(-3.0, 3.0),
    drift=st.floats(-3.0, 3.0),
)
@settings(max_examples=60, deadline=None)
def test_the_larger_share_decides_whatever_offset_and_drift_each_recording_has(
    seed: int, direct: float, integral: float, offset: float, drift: float
) -> None:
    """Both shares have a standard deviation of one beside a line in time, and are nearly independent."""
    sessions, line = [], np.column_stack([np.ones(SIZE), np.linspace(-1.0, 1.0, SIZE)])
    for k in range(2):
        load = some_load(SIZE, 2 * seed + k)
        columns = np.column_stack([load, np.cumsum(load - load.mean())])
        columns -= line @ np.linalg.lstsq(line, columns, rcond=None)[0]
        reading = columns @ (np.array([direct, -integral]) / np.std(columns, axis=0)) + line @ [k * offset, drift]
        sessions.append(session_under(load, reading, seed))
    if integral > 3.0 * direct + 0.05:
        (said,) = limit_integral(sessions, STANDARD)
        assert "no effect of a pressed unit does" in said
    elif integral < direct:
        assert not limit_integral(sessions, STANDARD)


@pytest.mark.parametrize("samples", [1.0, 10.0, 30.0])
@pytest.mark.parametrize("share", [-0.5, 0.5, 1.0])
def test_what_creeps_falls_or_lags_within_a_cycle_is_no_integral(share: float, samples: float) -> None:
    load = some_load(SIZE, 7)  # 20 points on 600 samples
    reading = load + share * lagged(load, 1.0, samples)
    assert not limit_integral([session_under(load, reading)], STANDARD)


@pytest.mark.parametrize("bow", [0.0, 0.02])
@pytest.mark.parametrize("rest", [0, SIZE // 10])
def test_one_ramp_tells_no_integral_from_a_curve(rest: int, bow: float) -> None:
    """Unloading alone: the integral of a line is its square."""
    load = np.concatenate([np.full(rest, 1.0), np.linspace(1.0, 0.0, SIZE)])
    noise = 1e-3 * np.random.default_rng(0).standard_normal(load.size)
    assert not limit_integral([session_under(load, load + bow * load * (1.0 - load) + noise)], STANDARD)


@pytest.mark.parametrize("late_s", [0.1, 0.25, 0.4, 0.8])
def test_steps_that_are_late_by_a_quarter_of_a_stride_are_no_integral(late_s: float) -> None:
    """A walk of 28 s after and before a rest: its fundamental is late by a quarter of a period, the walk is not."""

    def walk(at_s: Array) -> Array:
        stride = at_s % 1.1 / 1.1
        step = np.where(stride < 0.6, np.sin(np.pi * stride / 0.6), 0.0)
        return np.asarray(step * (at_s > 2.0) * (at_s < 30.0))

    time_s = np.arange(0.0, 32.0, 0.01)
    assert not limit_integral([session_under(walk(time_s), walk(time_s - late_s))], STANDARD)


@pytest.mark.parametrize("name", OTHER_SENSORS)
def test_no_sensor_of_a_load_is_its_integral(name: str) -> None:
    fitted, _ = OTHER_SENSORS[name].recordings(0)
    assert not limit_integral(sessions_of(*fitted)[0], STANDARD)


def _damper(friction_n: float, viscous: float, spring: float, seed: int) -> Recording:
    """A table moves a damper to and fro; its force, with a preload, is the load, and its position the reading."""
    time_s, turn = np.arange(0.0, 12.0, 0.01), 2.0 * np.pi * 0.8
    position, speed = 10.0 * np.sin(turn * time_s), 10.0 * turn * np.cos(turn * time_s)
    force = viscous * speed + friction_n * np.tanh(speed / 8.0) + spring * position
    rng = np.random.default_rng(seed)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=force - force.min() + 5.0 + 0.3 * rng.standard_normal(time_s.size),
        pressure_mm=position + 0.05 * rng.standard_normal(time_s.size),
        name="damper",
    )


@pytest.mark.long
@pytest.mark.parametrize("friction_n", [20.0, *(pytest.param(one, marks=pytest.mark.bank) for one in (0.0, 70.0))])
def test_the_position_of_a_damper_is_told_and_nothing_is_named_for_certain(friction_n: float) -> None:
    told = diagnose([_damper(friction_n, 0.6 if friction_n else 2.0, 2.0, 1)])
    assert sum("a position does that a force moves against a damper" in said for said in told.limits) == 1
    assert all(cause.confidence <= 0.5 for cause in told.causes)
    assert told.verdict == "partly_explained"
