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
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
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

    def choices(p: EffectParameter) -> list[float]:
        return [p.lower, p.upper, rng.uniform(p.lower, p.upper), *([] if p.null is None else [p.null])]

    return np.array([rng.choice(choices(p)) for p in one.parameters], dtype=float)


def loading(seed: int, count: int = 40) -> Conditions:
    """Straight lines between random loads, a little beyond full scale, from rest."""
    rng = np.random.default_rng(seed)
    loads = rng.uniform(0.0, 1.1, count) * (rng.random(count) < 0.8)
    loads[0] = 0.0
    time_s = np.arange(0.0, 0.5 * (count - 1), STEP_S)
    return Conditions(time_s, np.interp(time_s, 0.5 * np.arange(count), loads), STEP_S)


def test_blocks_stand_apart_from_the_effects_that_may_be_named() -> None:
    assert set(NAMES) == {
        "flexible_curve", "flexible_characteristic", "flexible_relaxation", "flexible_loop", "flexible_set",
        "flexible_asymmetry", "flexible_heat", "flexible_softening", "flexible_gain_drift",
        "flexible_lag", "flexible_thixotropy",
    }  # fmt: skip
    assert not set(NAMES) & set(catalogue())
    assert not any(one.is_flexible for one in catalogue().values())
    families = {one.family for one in catalogue().values()}
    for family, members in blocks().items():
        assert family in families
        assert all(one.family == family and effect(one.name) is one for one in members)


@pytest.mark.parametrize("name", NAMES)
def test_every_weight_has_a_null_inside_its_bounds_and_a_prior(name: str) -> None:
    one = effect(name)
    assert any(parameter.null == 0.0 for parameter in one.parameters)
    for parameter in one.parameters:
        if parameter.null is None:  # of its shape
            assert all(parameter.lower <= shape[parameter.name] <= parameter.upper for shape in one.shapes)
            continue
        assert parameter.lower <= 0.0 < parameter.upper
        assert parameter.prior_sd is None or 0.0 < parameter.prior_sd <= 1.0


@pytest.mark.parametrize("name", [name for name in NAMES if name != "flexible_lag"])  # to first order of the step
@given(seed=seeds)
@settings(max_examples=15)
def test_any_weights_within_the_bounds_are_undone(name: str, seed: int) -> None:
    weights = within_bounds(effect(name), seed)
    if name == "flexible_asymmetry":  # a gain that unloading has more of: two loads give one reading as the load turns
        weights = np.abs(weights)
    at, model = loading(seed), BASELINE.with_part(effect(name), weights)
    force_n = ExtendedCompensator(model, 1.0 / STEP_S).apply(model.reading(at))
    assert np.max(np.abs(force_n / 800.0 - at.load)) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_a_twin_presses_what_the_model_reads(name: str) -> None:
    one = effect(name)
    model = BASELINE.with_part(one, one.begun(sizes=1.0))
    load = loading(4).load
    since_rest = np.concatenate([[0.0], load])  # the twin's clock starts at rest, a step before its first load
    at = Conditions(np.arange(since_rest.size) * STEP_S, since_rest, STEP_S)
    pressure_pa = TwinBladder(model).press(800.0 * load, 1.0 / STEP_S)
    assert pressure_pa == pytest.approx(100.0 * model.reading(at)[1:], abs=1e-6)  # mbar


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


def cycles(count: int, level: float, hold_s: float = 0.0) -> Conditions:
    """``count`` loadings to ``level`` within 1 s and back, ``hold_s`` at the top, 2 s of rest after each."""
    times = np.cumsum(np.tile([1.0, max(hold_s, STEP_S), 1.0, 2.0], count))
    loads = np.tile([level, level, 0.0, 0.0], count)
    time_s = np.arange(0.0, times[-1], STEP_S)
    return Conditions(time_s, np.interp(time_s, np.append(0.0, times), np.append(0.0, loads)), STEP_S)


@pytest.mark.parametrize("exponent", [0.8, 1.0, 2.5])
def test_a_set_by_strokes_counts_loadings_and_no_time(exponent: float) -> None:
    values = np.array([0.01, 1.0, exponent, 3000.0])
    short, long_, twice = (
        float(effect("flexible_set").apply(at.load, at, values)[-1])
        for at in (cycles(3, 0.6), cycles(3, 0.6, 20.0), cycles(6, 0.6))
    )
    assert short == pytest.approx(3 * 0.01 * 0.6**exponent, rel=0.1)  # the play takes some of each loading
    assert long_ == pytest.approx(short, rel=1e-6)
    assert twice == pytest.approx(2.0 * short, rel=0.02)


def test_a_set_by_time_is_that_of_the_permanent_set() -> None:
    at = loading(7)
    by_time = effect("flexible_set").apply(at.load, at, np.array([0.01, 0.0, 1.5, 3000.0]))
    np.testing.assert_allclose(by_time, effect("permanent_set").apply(at.load, at, np.array([1e-3, 1.5])), atol=1e-5)


def test_what_hardens_grows_by_less_each_time_and_by_half_where_it_has_slowed_to_a_half() -> None:
    at = cycles(8, 1.0)
    ends = np.flatnonzero((at.load[1:] == 0.0) & (at.load[:-1] > 0.0)) + 1
    for name, of in (("flexible_set", lambda out: out), ("flexible_softening", None)):
        out = effect(name).apply(at.load, at, np.array([0.01, 1.0, 1.0, 4.0]))
        if of is None:  # a gain: seen at the peaks
            peaks = np.flatnonzero((at.load == 1.0) & np.append(at.load[1:] < 1.0, False))
            grown = out[peaks] - 1.0
        else:
            grown = out[ends]
        by = np.diff(np.append(0.0, grown))
        assert np.all(np.diff(by) < 0.0)
        assert by[0] == pytest.approx(0.01 * 4.0 * np.log(5.0 / 4.0), rel=0.05)
        assert by[4] / by[0] == pytest.approx(0.55, abs=0.05)


def test_noise_of_a_load_is_no_stroke() -> None:
    rng = np.random.default_rng(3)
    load = 0.5 + 0.002 * rng.standard_normal(20_000)
    at = Conditions(STEP_S * np.arange(load.size), load, STEP_S, 0.002)
    moved = effect("flexible_set").apply(load, at, np.array([0.01, 1.0, 1.0, 300.0])) - load
    assert np.max(np.abs(moved)) < 1e-4


def test_a_sense_that_never_fades_is_that_of_the_law() -> None:
    at = loading(5)
    out = effect("flexible_asymmetry").apply(at.load, at, np.array([0.02, 0.005, 1e9]))
    law = effect("load_unload_asymmetry").apply(at.load, at, np.array([0.02, 0.005]))
    np.testing.assert_allclose(out[1:], law[1:], atol=1e-3)  # one begins at rest, the other loading
    np.testing.assert_allclose(out[at.load.size // 2 :], law[at.load.size // 2 :], atol=1e-8)


@given(rate=st.floats(0.01, 2.0), turn=st.floats(0.003, 0.05), memory_s=st.floats(0.1, 3.0))
@settings(max_examples=25)
def test_on_a_ramp_the_sense_goes_by_the_rate_and_it_fades_in_a_hold(rate: float, turn: float, memory_s: float) -> None:
    time_s = np.linspace(0.0, 1.0 / rate + 20.0 * memory_s, 20_001)
    load = np.minimum(rate * time_s, 1.0)
    at = Conditions(time_s, load, float(time_s[1]))
    out = effect("flexible_asymmetry").apply(load, at, np.array([0.1, turn, memory_s]))
    top = int(np.argmax(load >= 1.0)) - 1
    sense = 1.0 - 2.0 * (1.0 - out / np.maximum(load, 1e-9)) / 0.1
    settled = 1.0 - np.exp(-(rate / turn + 1.0 / memory_s) / rate)
    assert sense[top] == pytest.approx(settled * rate / (rate + turn / memory_s), abs=0.02)
    assert sense[-1] == pytest.approx(0.0, abs=1e-3)


def test_heat_that_leaves_in_one_time_is_that_of_the_law() -> None:
    at = loading(6)
    one = effect("flexible_heat").apply(at.load, at, np.array([0.05, 2.0, 0.0, 8.0]))
    np.testing.assert_allclose(one, effect("gas_heat").apply(at.load, at, np.array([0.05, 2.0, 0.0])), atol=1e-10)
    slowly = effect("flexible_heat").apply(at.load, at, np.array([0.05, 16.0, 0.9, 8.0]))
    assert np.max(np.abs(slowly - one)) < 0.3 * np.max(np.abs(one - at.load))  # nine tenths leave at 2 1/s too


def at_rest_or_loaded(hours: float = 0.1) -> Conditions:
    time_s = np.arange(0.0, 3600.0 * hours, 0.5)
    return Conditions(time_s, 0.5 + 0.5 * np.sin(time_s), 0.5)


def test_a_gain_that_drifts_at_its_own_pace_is_a_line_at_first_and_settles_at_its_change() -> None:
    at = at_rest_or_loaded()
    gain = effect("flexible_gain_drift").apply(at.load, at, np.array([0.1, 1000.0, 1.0])) / at.load
    assert gain[0] == pytest.approx(1.0, abs=1e-12)
    assert gain == pytest.approx(1.0 - 0.1 * np.expm1(-at.time_s / 1000.0), abs=1e-12)
    settled = effect("flexible_gain_drift").apply(at.load, at, np.array([-0.2, 5.0, 0.8])) / at.load
    assert settled[-1] == pytest.approx(0.8, abs=1e-6)


@given(change=st.floats(-0.3, 0.3), tau_s=st.floats(20.0, 500.0))
def test_at_a_stretch_of_one_half_a_drift_goes_by_the_root_of_time(change: float, tau_s: float) -> None:
    at = at_rest_or_loaded()
    early = at.time_s < 1e-3 * tau_s
    moved = effect("flexible_gain_drift").apply(np.ones_like(at.load), at, np.array([change, tau_s, 0.5])) - 1.0
    by_root = change * np.sqrt(2.0 * at.time_s / tau_s)  # the mean time of settling is twice s
    assert moved[early] == pytest.approx(by_root[early], rel=0.05)
