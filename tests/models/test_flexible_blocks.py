"""Flexible blocks: found apart from the effects, free in shape, never so free that they cannot be undone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.arrays import Array
from smartshoe.calibration import ExtendedCompensator
from smartshoe.models.core import Core, plain
from smartshoe.models.effects import Conditions, Effect, blocks, catalogue, effect
from smartshoe.models.effects._monotone_curve import KNOTS
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.effects.flexible_loop import HALF_WIDTHS
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.twin import TwinBladder

BLOCKS = tuple(one for family in blocks().values() for one in family)
NAMES = tuple(one.name for one in BLOCKS)
CURVES = ("flexible_curve", "flexible_characteristic")
BASELINE = ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
STEP_S = 0.02
seeds = st.integers(0, 10_000)


def within_bounds(one: Effect, seed: int) -> Array:
    """Any weights that a fit may try, bounds included."""
    rng = np.random.default_rng(seed)
    drawn = [rng.choice([p.lower, p.upper, rng.uniform(p.lower, p.upper), p.null]) for p in one.parameters]
    return np.array(drawn, dtype=float)


def loading(seed: int, count: int = 40) -> Conditions:
    """Straight lines between random loads, a little beyond full scale, from rest."""
    rng = np.random.default_rng(seed)
    loads = rng.uniform(0.0, 1.1, count) * (rng.random(count) < 0.8)
    loads[0] = 0.0
    time_s = np.arange(0.0, 0.5 * (count - 1), STEP_S)
    return Conditions(time_s, np.interp(time_s, 0.5 * np.arange(count), loads), STEP_S)


def test_blocks_stand_apart_from_the_effects_that_may_be_named() -> None:
    assert set(NAMES) == {"flexible_curve", "flexible_characteristic", "flexible_relaxation", "flexible_loop"}
    assert not set(NAMES) & set(catalogue())
    assert not any(one.is_flexible for one in catalogue().values())
    families = {one.family for one in catalogue().values()}
    for family, members in blocks().items():
        assert family in families
        assert all(one.family == family and effect(one.name) is one for one in members)


@pytest.mark.parametrize("name", NAMES)
def test_every_weight_has_a_null_inside_its_bounds_and_a_prior(name: str) -> None:
    for parameter in effect(name).parameters:
        assert parameter.null == 0.0
        assert parameter.lower < 0.0 < parameter.upper
        assert parameter.prior_sd is not None
        assert 0.0 < parameter.prior_sd <= 1.0


@pytest.mark.parametrize("name", NAMES)
@given(seed=seeds)
@settings(max_examples=15)
def test_any_weights_within_the_bounds_are_undone(name: str, seed: int) -> None:
    at, model = loading(seed), BASELINE.with_part(effect(name), within_bounds(effect(name), seed))
    force_n = ExtendedCompensator(model, 1.0 / STEP_S).apply(model.reading(at))
    assert np.max(np.abs(force_n / 800.0 - at.load)) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_a_twin_presses_what_the_model_reads(name: str) -> None:
    one = effect(name)
    model = BASELINE.with_part(one, np.array([p.size for p in one.parameters]))
    at = loading(4)
    pressure_pa = TwinBladder(model).press(800.0 * at.load, 1.0 / STEP_S)
    assert pressure_pa == pytest.approx(100.0 * model.reading(at), abs=1e-6)  # mbar


@pytest.mark.parametrize("name", CURVES)
@given(seed=seeds)
@settings(max_examples=25)
def test_a_curve_rises_between_fixed_ends_with_the_slope_that_its_weights_say(name: str, seed: int) -> None:
    weights = within_bounds(effect(name), seed)
    load = np.linspace(-0.2, 1.2, 1401)
    out = effect(name).apply(load, Conditions(load + 0.2, load, 1e-3), weights)
    assert np.all(np.diff(out) > 0.0)
    assert np.interp([0.0, 1.0], load, out) == pytest.approx([0.0, 1.0], abs=1e-12)
    # The slow way: the slope, straight between the knots, summed up by the trapezoidal rule on a fine grid.
    fine = np.unique(np.concatenate([np.linspace(0.0, 1.0, 20_001), KNOTS]))
    slope = np.interp(fine, KNOTS, 1.0 + weights)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(fine))])
    inside = (load >= 0.0) & (load <= 1.0)
    np.testing.assert_allclose(out[inside], np.interp(load[inside], fine, summed / summed[-1]), rtol=0, atol=1e-6)
    assert np.diff(out[:199]) == pytest.approx(1e-3 * slope[0] / summed[-1])
    assert np.diff(out[-199:]) == pytest.approx(1e-3 * slope[-1] / summed[-1])


def scale_of(kind: str, load: Array) -> Array:
    """What the friction is even over: the load, or a logarithm of it, in proportion to load + 0.2."""
    return load if kind == "even" else np.sign(load) * np.log(1.0 + np.abs(load) / 0.2) / np.log(6.0)


def one_bank(kind: str, seed: int) -> tuple[Array, Array]:
    """Drawn weights of one operator, and all of the block's, the other's null."""
    weights = within_bounds(effect("flexible_loop"), seed)[: HALF_WIDTHS.size]
    null = np.zeros_like(weights)
    return weights, np.concatenate([weights, null] if kind == "even" else [null, weights])


KINDS = ("even", "growing")


@pytest.mark.parametrize("kind", KINDS)
@given(seed=seeds)
@settings(max_examples=15)
def test_a_loop_loses_the_shares_of_slope_that_its_weights_say_after_each_reversal(kind: str, seed: int) -> None:
    weights, values = one_bank(kind, seed)
    x = np.concatenate([np.linspace(0.0, 1.0, 1001), np.linspace(1.0, 0.1, 901)[1:]])
    load = x if kind == "even" else 0.2 * (6.0**x - 1.0)
    at = Conditions(STEP_S * np.arange(load.size), load, STEP_S)
    slope = np.diff(scale_of(kind, effect("flexible_loop").apply(load, at, values))) / np.diff(x)
    past = np.concatenate([np.arange(1000), np.arange(900)]) * 1e-3 + 5e-4  # the reversal, at the middle of each step
    ranges = np.searchsorted(2.0 * HALF_WIDTHS, past)
    clear = np.min(np.abs(past[:, None] - 2.0 * HALF_WIDTHS), axis=1) > 1e-3
    assert slope[clear] == pytest.approx(1.0 - np.append(weights, 0.0)[ranges[clear]], abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=seeds)
@settings(max_examples=8)
def test_a_loop_is_the_sum_of_its_plays(kind: str, seed: int) -> None:
    at = loading(seed)
    weights, values = one_bank(kind, seed)
    x = scale_of(kind, at.load)
    friction = []
    for width in HALF_WIDTHS:
        place, along = width, []
        for load in x:
            place = min(max(place, load - width), load + width)
            along.append(load - place + width)
        friction.append(along)
    expected = x - weights @ np.diff(np.array(friction), axis=0, prepend=0.0)
    out = effect("flexible_loop").apply(at.load, at, values)
    assert scale_of(kind, out) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_loop_closes_without_load_and_holds_still_against_noise(kind: str) -> None:
    one, null, lost = effect("flexible_loop"), np.zeros(HALF_WIDTHS.size), np.full(HALF_WIDTHS.size, 0.3)
    values = np.concatenate([lost, null] if kind == "even" else [null, lost])
    load = np.interp(np.arange(400), [0, 100, 200, 300, 399], [0.0, 1.0, 0.0, 0.5, 0.0])
    out = one.apply(load, Conditions(STEP_S * np.arange(400), load, STEP_S), values)
    assert out[[0, 200, 399]] == pytest.approx(0.0, abs=1e-12)
    assert np.all(out[101:200] > out[99:0:-1])  # unloading above loading, at the same load
    noisy = 0.5 + 0.004 * np.random.default_rng(1).standard_normal(5000)
    hold = Conditions(STEP_S * np.arange(5000), noisy, STEP_S, load_noise=0.004)
    moved = scale_of(kind, one.apply(noisy, hold, values)) - 0.7 * scale_of(kind, noisy)  # within every reversal
    assert np.ptp(moved[1000:]) < 1e-9


def test_friction_that_grows_with_load_makes_wider_loops_at_higher_loads() -> None:
    one, count = effect("flexible_loop"), HALF_WIDTHS.size

    def height(kind: str, low: float) -> float:
        lost = np.zeros((2, count))
        lost[KINDS.index(kind), :2] = 0.3
        load = np.interp(np.arange(500), [0, 100, 200, 300, 400, 499], [0, low + 0.3, low, low + 0.3, low, low])
        out = one.apply(load, Conditions(STEP_S * np.arange(500), load, STEP_S), lost.ravel())
        return float(out[350] - out[250])  # at the middle of the load, down and up

    assert height("even", 0.0) > 0.01
    assert height("even", 0.7) == pytest.approx(height("even", 0.0), rel=1e-9)
    assert height("growing", 0.7) > 1.5 * height("growing", 0.0)


@given(seed=seeds, share=st.floats(1e-3, 5.0), rate_per_s=st.floats(0.01, 50.0))
@settings(max_examples=25)
def test_a_relaxation_of_any_signs_is_a_passive_network(seed: int, share: float, rate_per_s: float) -> None:
    one = effect("flexible_relaxation")
    assert isinstance(one, CoreEffect)
    core = Core([Arm(share, rate_per_s), *one.elements(within_bounds(one, seed))])
    poles = np.linalg.eigvals(core.matrix)
    zeros = np.linalg.eigvals(core.matrix - np.outer(core.drive, core.read) / core.direct)
    for roots in (poles, zeros):
        assert np.max(np.abs(roots.imag)) < 1e-6 * np.max(np.abs(roots))
        assert np.max(roots.real) < 0.0
    at = loading(seed)
    np.testing.assert_allclose(core.simulate(at.load, STEP_S), plain(core, at.load, STEP_S), rtol=0, atol=1e-7)


def test_a_relaxation_creeps_up_where_its_weights_are_positive_and_down_alike_where_negative() -> None:
    one = effect("flexible_relaxation")
    load = np.append(0.0, np.ones(2000))
    at = Conditions(STEP_S * np.arange(load.size), load, STEP_S)
    for k in range(6):
        weights = np.zeros(6)
        weights[k] = 1e-4
        up, down = (one.apply(load, at, sign * weights) - load for sign in (1.0, -1.0))
        assert up[1] < 0.0
        assert np.all(np.diff(up[1:]) >= -1e-12)
        assert down == pytest.approx(-up, abs=1e-7)  # second order of the weight
