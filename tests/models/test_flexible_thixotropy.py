"""The block of a gain that motion moves and rest brings back, against its differential equation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from smartshoe.arrays import Array
from smartshoe.models.effects import Conditions, effect

BLOCK = effect("flexible_thixotropy")
STEP_S = 0.05


def _conditions(load: Array) -> Conditions:
    return Conditions(np.arange(load.size) * STEP_S, load, STEP_S)


def _slow_twin(load: Array, per_loading: float, recovery_s: float) -> Array:
    """The differential equation, knot by knot, with the load straight between the samples."""
    broken = np.zeros(load.size)
    for k in range(1, load.size):
        speed = abs(load[k] - load[k - 1]) / STEP_S

        def moved(_: float, b: Array, speed: float = speed) -> Array:
            return (1.0 - b) * 0.5 * per_loading * speed - b / recovery_s

        broken[k] = solve_ivp(moved, (0.0, STEP_S), [broken[k - 1]], rtol=1e-10, atol=1e-12).y[0, -1]
    return broken


@given(
    knots=st.lists(st.floats(0.1, 1.0), min_size=3, max_size=6),
    gained=st.sampled_from([-0.3, 0.02, 0.3]),
    per_loading=st.floats(0.1, 5.0),
    recovery_s=st.floats(5.0, 100.0),
)
@settings(max_examples=12)
def test_it_follows_its_differential_equation(
    knots: list[float], gained: float, per_loading: float, recovery_s: float
) -> None:
    corners = np.repeat([0.0, *knots], 2)  # each level is held for a while
    load = np.interp(np.arange(20 * corners.size) / 20.0, np.arange(corners.size), corners)
    # A play of 0.001 stands between the load and the way that counts, so that loads start a little late.
    through_play = np.zeros(load.size)
    for k in range(1, load.size):
        through_play[k] = min(max(through_play[k - 1], load[k] - 1e-3), load[k] + 1e-3)
    out = BLOCK.apply(load, _conditions(load), np.array([gained, per_loading, recovery_s]))
    assert out == pytest.approx(load * (1.0 + gained * _slow_twin(through_play, per_loading, recovery_s)), abs=1e-8)


def test_what_many_loadings_broke_is_built_up_at_rest() -> None:
    worked = 1.0 - np.abs((np.arange(2400) * STEP_S) % 2.0 - 1.0)  # a loading to full scale and back in two seconds
    rested = np.concatenate([worked, np.zeros(400), np.linspace(0.0, 1.0, 21)])
    tau = 10.0
    gain = BLOCK.apply(np.ones(rested.size), _conditions(rested), np.array([0.1, 0.5, tau])) - 1.0
    steady = 0.1 * 0.25 / (0.25 + 1.0 / tau)  # half of w a second against 1/T
    assert gain[2399] == pytest.approx(steady, rel=0.01)
    assert gain[2799] == pytest.approx(steady * math.exp(-20.0 / tau), rel=0.03)


def test_a_recording_that_continues_another_begins_as_broken_as_that_ended() -> None:
    load = np.abs((np.arange(1200) * STEP_S) % 2.0 - 1.0)
    values = np.array([0.1, 0.5, 10.0])
    whole = BLOCK.apply(load, _conditions(load), values)
    later = Conditions(np.arange(600, 1200) * STEP_S, load[600:], STEP_S, earlier=load[:600])
    assert BLOCK.apply(load[600:], later, values) == pytest.approx(whole[600:], abs=1e-12)


def test_how_far_it_is_from_a_law_is_what_a_minute_of_rest_brings_back() -> None:
    assert BLOCK.departs_by(np.array([0.1, 1.0, 5.0])) > 0.99
    assert BLOCK.departs_by(np.array([0.1, 1.0, 100.0])) == pytest.approx(0.451, abs=1e-3)
