"""The linear network of wall and gas: limits, signs, and its slow twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from smartshoe.models.core import Core, plain
from smartshoe.models.elements import Arm, Heat, Leak
from smartshoe.models.first_order import simulate

STEP_S = 0.05
shares = st.floats(0.001, 2.0)
rates = st.floats(0.01, 15.0)
elements = st.lists(
    st.one_of(
        st.builds(Arm, shares, rates),
        st.builds(Heat, st.floats(0.001, 0.4), rates),
        st.builds(Leak, st.floats(1e-6, 1.0)),
    ),
    min_size=1,
    max_size=6,
)


def load(seed: int, n: int = 400) -> np.ndarray:
    """Straight lines between corners that are drawn, from zero."""
    rng = np.random.default_rng(seed)
    corners = np.concatenate([[0.0], rng.uniform(0.0, 1.0, 8)])
    return np.interp(np.linspace(0, 8, n), np.arange(9), corners)


@given(elements, st.integers(0, 1000), st.floats(1.1, 3.0))
@settings(max_examples=60, deadline=None)
def test_modes_agree_with_the_matrix_exponential(parts: list, seed: int, ratio: float) -> None:
    core = Core(parts, ratio)
    assert_allclose(core.simulate(load(seed), STEP_S), plain(core, load(seed), STEP_S), atol=1e-8)


@given(shares, rates, st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_one_arm_is_the_papers_model(share: float, rate: float, seed: int) -> None:
    f = load(seed)
    time_s = STEP_S * np.arange(f.size)
    # p/f = (s + a)/((1 + kappa) s + a), Chinimilli 2016 (13) turned round.
    expected = simulate(rate / (1 + share), 1 / (1 + share), rate / (1 + share), f, time_s, start="steady")
    assert_allclose(Core([Arm(share, rate)]).simulate(f, STEP_S), expected, atol=1e-9)


@given(st.lists(st.builds(Arm, shares, rates), min_size=1, max_size=4), st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_a_held_load_ends_at_its_own_pressure_and_creeps_up_to_it(arms: list, seed: int) -> None:
    f = np.concatenate([np.linspace(0, 1, 20), np.ones(200_000)])
    p = Core(arms).simulate(f, STEP_S)
    assert p[-1] == pytest.approx(1.0, abs=1e-3)
    assert np.all(np.diff(p[20:]) >= -1e-12)


def test_heat_makes_the_pressure_fall_after_a_ramp() -> None:
    f = np.concatenate([np.linspace(0, 1, 20), np.ones(400)])
    p = Core([Heat(0.2, 1.0)]).simulate(f, STEP_S)
    assert p[19] > 1.03
    assert np.all(np.diff(p[20:]) < 1e-12)


def test_a_leak_lowers_holds_and_leaves_less_than_nothing_after_them() -> None:
    f = np.concatenate([np.linspace(0, 1, 20), np.ones(400), np.linspace(1, 0, 20), np.zeros(20)])
    p = Core([Leak(0.02)], 1.6).simulate(f, STEP_S)
    assert np.all(np.diff(p[20:420]) < 0)
    assert p[445] < 0


@given(st.floats(0.001, 0.3), st.floats(1.1, 3.0))
@settings(max_examples=20, deadline=None)
def test_a_leak_under_a_held_load_decays_at_its_rate_less_the_walls_share(rate: float, ratio: float) -> None:
    # omega' = lambda p, p = f - omega (1 - 1/N): the wall gives back 1/N of what is lost.
    p = Core([Leak(rate)], ratio).simulate(np.concatenate([[0.0], np.ones(100)]), STEP_S)
    decay = np.log(p[20] / p[80]) / (60 * STEP_S)
    assert decay == pytest.approx(rate * (1 - 1 / ratio), rel=1e-6)


@given(elements, st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_halving_the_step_changes_nothing_for_straight_lines(parts: list, seed: int) -> None:
    coarse = load(seed, 401)
    fine = np.interp(np.arange(801) / 2, np.arange(401), coarse)
    core = Core(parts)
    assert_allclose(core.simulate(fine, STEP_S / 2)[::2], core.simulate(coarse, STEP_S), atol=1e-8)
