"""The extended filter: what went into the chain comes out of its inverse, sample by sample, in any chunks."""

from __future__ import annotations

import re

import numpy as np
import pytest
from chains import BASELINE, DRIFTS, EXACT, INVERTIBLE, LOOPED, chain_of, some_conditions, typical
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Compensator, ExtendedCompensator, extended_calibration, stack
from smartshoe.errors import UsageError
from smartshoe.models.effects import Conditions, catalogue, effect
from smartshoe.models.extended import ExtendedModel

EXACT_TOLERANCE = 1e-9  # of full scale: rounding, multiplied by the steepest part of a curve's inverse
seeds = st.integers(0, 10_000)


def _error(model: ExtendedModel, conditions: Conditions) -> np.ndarray:
    force_n = ExtendedCompensator(model, 1.0 / conditions.step_s).apply(model.reading(conditions))
    return np.asarray(force_n / model.full_scale_load_n - conditions.load)


def test_single_precision_has_steps_of_its_own_and_only_where_it_is_asked_for() -> None:
    filter_ = ExtendedCompensator(chain_of(["play_hysteresis"], 1), 100.0)
    plain, single = filter_.c_steps(), filter_.c_steps(single=True)
    assert plain == tuple((name, inverse.c_step(name)) for name, inverse in filter_.blocks)
    assert single == tuple((name, inverse.c_single(name)) for name, inverse in filter_.blocks)
    assert plain != single


@given(
    gain=st.floats(0.1, 10.0), share=st.floats(0.01, 5.0), rate=st.floats(0.01, 20.0), hz=st.floats(50.0, 1000.0),
    seed=seeds,
)  # fmt: skip
@settings(max_examples=20, deadline=None)
def test_the_baseline_is_undone_exactly(gain: float, share: float, rate: float, hz: float, seed: int) -> None:
    model = ExtendedModel(gain, share, rate, 800.0, 180.0, "mbar")
    error = _error(model, some_conditions(seed, 6, 1.0 / hz))
    assert np.max(np.abs(error)) < EXACT_TOLERANCE


@pytest.mark.parametrize("hz", [1.0, 500.0])
def test_a_spring_alone_is_undone_exactly(hz: float) -> None:
    model = ExtendedModel(0.5, 0.0, 1.0, 800.0, 180.0, "mbar")
    assert np.max(np.abs(_error(model, some_conditions(3, 6, 1.0 / hz)))) < EXACT_TOLERANCE
    assert ExtendedCompensator(model, hz).core.is_exact


@pytest.mark.parametrize("name", EXACT)
@given(seed=seeds)
@settings(max_examples=4, deadline=None)
def test_an_effect_is_undone_exactly(name: str, seed: int) -> None:
    model, conditions = chain_of([name], seed), some_conditions(seed)
    assert np.max(np.abs(model.reading(conditions) - BASELINE.reading(conditions))) > 1e-9
    assert np.max(np.abs(_error(model, conditions))) < EXACT_TOLERANCE


@given(names=st.lists(st.sampled_from(EXACT), min_size=2, max_size=3, unique=True), seed=seeds)
@settings(max_examples=40, deadline=None)
def test_effects_together_are_undone_exactly(names: list[str], seed: int) -> None:
    assert np.max(np.abs(_error(chain_of(names, seed), some_conditions(seed)))) < EXACT_TOLERANCE


@pytest.mark.parametrize("name", LOOPED)
@given(others=st.lists(st.sampled_from(EXACT), max_size=1), seed=seeds)
@settings(max_examples=5, deadline=None)
def test_a_spring_beside_the_arm_is_undone_to_what_happens_between_samples(
    name: str, others: list[str], seed: int
) -> None:
    # There the core takes the spring's load for straight lines, and the spring what it does; the static curve alone
    # leaves 1e-3 and more.
    assert np.max(np.abs(_error(chain_of([name, *others], seed), some_conditions(seed)))) < 1e-7


def _lagged(tau_s: float) -> ExtendedModel:
    one = effect("sensor_lag")
    values = one.start({"second_pole": 0.0})
    values[0] = tau_s
    return BASELINE.with_part(one, values)


@given(seed=seeds, tau_s=st.floats(0.002, 0.0099))
@settings(max_examples=10, deadline=None)
def test_a_lag_is_undone_to_first_order_of_the_step(seed: int, tau_s: float) -> None:
    model, conditions = _lagged(tau_s), some_conditions(seed)
    pressure = BASELINE.simulate(conditions) / BASELINE.gain
    # After a corner of slope change s, y'' = s/tau exp(-t/tau): its difference quotient is late by half a step.
    slope = np.diff(pressure) / conditions.step_s
    change = float(np.max(np.abs(slope[2:] - slope[:-2])))  # a corner lies between samples
    bound = 0.5 * conditions.step_s * change * (1.0 + BASELINE.relaxing_share)
    assert np.max(np.abs(_error(model, conditions))) <= 1.1 * bound


@given(tau_s=st.floats(0.01, 1.0), hz=st.sampled_from([100.0, 1000.0]))
@settings(max_examples=10, deadline=None)
def test_undoing_a_lag_raises_noise_no_more_than_the_bound_and_says_what_lag_is_left(tau_s: float, hz: float) -> None:
    filter_ = ExtendedCompensator(_lagged(tau_s), hz)
    alternating = np.resize([1.0, -1.0], 4000)
    share = filter_.apply(filter_.reading_per_share * alternating) / 800.0
    assert 0.5 * abs(share[-1] - share[-2]) <= 3.0 * (1.0 + BASELINE.relaxing_share)
    time_s = np.arange(int(20.0 * hz)) / hz
    ramp = Conditions(time_s, 0.04 * time_s, 1.0 / hz)
    late_s = -_error(_lagged(tau_s), ramp)[-1] / 0.04
    said = re.search("lag of (.*) ms", filter_.cautions["sensor_lag"])
    assert late_s == pytest.approx(0.0 if said is None else 1e-3 * float(said[1]), rel=0.03, abs=1e-6)
    assert late_s < 0.3 * tau_s


@given(seed=seeds, lost=st.floats(1e-3, 0.05))
@settings(max_examples=8, deadline=None)
def test_an_asymmetry_is_undone_exactly_where_unloading_loses(seed: int, lost: float) -> None:
    one = effect("load_unload_asymmetry")
    values = one.start()
    values[0] = lost
    assert np.max(np.abs(_error(BASELINE.with_part(one, values), some_conditions(seed)))) < EXACT_TOLERANCE


@given(seed=seeds)
@settings(max_examples=10, deadline=None)
def test_conditioning_is_undone_but_where_a_cycle_is_counted(seed: int) -> None:
    model = chain_of(["cycle_conditioning"], seed)
    error = np.abs(_error(model, some_conditions(seed)))
    assert np.mean(error > EXACT_TOLERANCE) < 0.01
    assert np.max(error) < abs(model.parts[0].values[0])


@given(seed=seeds, gain=st.floats(-0.1, 0.2).filter(lambda gain: abs(gain) > 1e-3))
@settings(max_examples=10, deadline=None)
def test_a_gain_with_rate_is_undone_but_for_corners(seed: int, gain: float) -> None:
    model, conditions = BASELINE.with_part(effect("rate_gain"), np.array([gain, 1.0])), some_conditions(seed)
    plain = ExtendedCompensator(BASELINE, 100.0).apply(model.reading(conditions)) / 800.0 - conditions.load
    assert np.sqrt(np.mean(_error(model, conditions) ** 2)) < 0.7 * np.sqrt(np.mean(plain**2))


missing = st.lists(st.integers(0, 399), max_size=30)


@given(
    names=st.lists(st.sampled_from(INVERTIBLE), max_size=3, unique=True),
    seed=seeds, gaps=missing, cuts=st.lists(st.integers(0, 400), max_size=5),
)  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_any_chunking_gives_the_bits_of_apply(names: list[str], seed: int, gaps: list[int], cuts: list[int]) -> None:
    model = chain_of(names, seed)
    readings = model.reading(some_conditions(seed))[:400] + np.random.default_rng(seed).normal(0.0, 0.2, 400)
    readings[gaps] = np.nan
    readings[gaps[:3]] = -np.inf
    filter_ = ExtendedCompensator(model, 100.0)
    whole = filter_.apply(readings)
    parts = [filter_.push(part) for part in np.split(readings, sorted(cuts))]
    assert np.array_equal(np.concatenate(parts), whole)
    assert filter_.missing_count == int(np.count_nonzero(~np.isfinite(readings)))
    filter_.reset()
    assert [filter_.push(float(value)) for value in readings] == whole.tolist()
    assert np.isfinite(whole).all()


@pytest.mark.parametrize("name", INVERTIBLE)
def test_readings_far_beyond_full_scale_give_finite_forces(name: str) -> None:
    one = effect(name)
    strongest = np.array([
        value if parameter.null is None or parameter.channel else parameter.upper
        for parameter, value in zip(one.parameters, typical(one, 1), strict=True)
    ])  # fmt: skip
    readings = np.random.default_rng(2).uniform(-2000.0, 2000.0, 300)
    readings[[50, 51]] = 1e9, -1e9
    for values in (typical(one, 2), strongest):
        assert np.isfinite(ExtendedCompensator(BASELINE.with_part(one, values), 100.0).apply(readings)).all()


def test_a_missing_reading_repeats_the_last_one_and_time_goes_on() -> None:
    model = BASELINE.with_part(effect("zero_drift"), np.array([1e-3, 0.0, 60.0, 1.0]))
    readings = np.full(500, 90.0)
    gappy = readings.copy()
    gappy[[3, 4, 5, 200]] = np.nan
    filter_ = ExtendedCompensator(model, 100.0)
    assert np.array_equal(filter_.apply(gappy), filter_.apply(readings))
    assert filter_.apply(np.array([np.nan, np.inf, 90.0]))[:2].tolist() == [0.0, 0.0]
    later = ExtendedCompensator(model, 100.0, started_s=1.0).apply(readings)
    np.testing.assert_allclose(filter_.apply(np.append([np.nan] * 100, readings))[100:], later, rtol=1e-12)


@given(names=st.lists(st.sampled_from(["play_hysteresis", "contact_area", "gas_heat", "sensor_lag"]), unique=True))
@settings(max_examples=8, deadline=None)
def test_a_held_reading_has_no_transient(names: list[str]) -> None:
    force_n = ExtendedCompensator(chain_of(names, 1), 100.0).apply(np.full(1000, 60.0))
    assert np.ptp(force_n) < 1e-9 * force_n[0]


@given(seed=seeds, on_s=st.floats(0.0, 3600.0))
@settings(max_examples=10, deadline=None)
def test_drifts_go_on_from_the_time_that_a_unit_has_been_on(seed: int, on_s: float) -> None:
    model = chain_of(["warm_up", "zero_drift"], seed)
    fresh = some_conditions(seed)
    conditions = Conditions(fresh.time_s, fresh.load, fresh.step_s, before={"time_s": on_s})
    force_n = ExtendedCompensator(model, 100.0, started_s=on_s).apply(model.reading(conditions))
    assert np.max(np.abs(force_n / 800.0 - fresh.load)) < EXACT_TOLERANCE


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("delay", "cannot be moved to another time"),
        ("clock_drift", "cannot be moved to another time"),
        ("cross_talk", "neighbour"),
        ("coloured_noise", "noise"),
        ("hum", "noise"),
        ("quantisation", "noise"),
    ],
)
def test_what_cannot_be_undone_is_passed_over_and_said(name: str, why: str) -> None:
    model = chain_of([name, "zero_offset"], 3)
    filter_ = ExtendedCompensator(model, 100.0)
    assert why in filter_.not_inverted[name]
    assert list(filter_.not_inverted) == [name]
    readings = np.linspace(0.0, 100.0, 50)
    assert np.array_equal(filter_.apply(readings), ExtendedCompensator(model.without(name), 100.0).apply(readings))


@pytest.mark.parametrize(("lost", "is_undone"), [(0.1, True), (0.5, True), (0.51, False), (1.0, False)])
def test_what_is_clipped_stays_and_what_is_bent_is_undone(lost: float, is_undone: bool) -> None:
    model = BASELINE.with_part("saturation", [lost, 0.6, 0.01, 0.0])
    filter_ = ExtendedCompensator(model, 100.0)
    assert dict(filter_.not_inverted) == ({} if is_undone else {"saturation": "what was clipped is lost"})
    off = np.max(np.abs(_error(model, some_conditions(7))))
    assert off < EXACT_TOLERANCE if is_undone else off > 0.05


def test_a_drift_with_the_temperature_is_passed_over_and_said() -> None:
    gain = effect("gain_drift")
    warmed = np.array([1e-3 if one.name == "temperature_coefficient" else value
                       for one, value in zip(gain.parameters, gain.start(), strict=True)])  # fmt: skip
    for part in ((effect("zero_drift"), np.array([1e-5, 1e-3, 60.0, 1.0])), (gain, warmed)):
        filter_ = ExtendedCompensator(BASELINE.with_part(*part), 100.0)
        assert "another channel (temperature), which" in filter_.not_inverted[part[0].name]


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_every_effect_is_undone_or_said_to_remain(name: str) -> None:
    one = effect(name)
    filter_ = ExtendedCompensator(BASELINE.with_part(one, typical(one, 5)), 100.0)
    in_chain = name in dict(filter_.blocks) or one.place == "core"
    assert in_chain != (name in filter_.not_inverted)


def test_an_effect_at_null_is_no_block_at_all() -> None:
    for name in EXACT:
        filter_ = ExtendedCompensator(BASELINE.with_part(effect(name)), 100.0)
        assert [block for block, _ in filter_.blocks] == ["core"]
        assert not filter_.not_inverted
        assert not filter_.cautions


@given(hz=st.floats(0.2, 5.0), share=st.floats(5.0, 50.0), rate=st.floats(5.0, 50.0))
@settings(max_examples=30, deadline=None)
def test_a_coarse_sampling_does_not_make_noise_ring(hz: float, share: float, rate: float) -> None:
    filter_ = ExtendedCompensator(ExtendedModel(1.0, share, rate, 1.0, 1.0, "mbar"), hz)
    impulse = np.zeros(2000)
    impulse[1] = 1.0
    answer = filter_.apply(impulse)
    assert ("baseline" in filter_.cautions) != filter_.core.is_exact
    # The network's own inverse amplifies at most 1 + share times, at high frequency; the exact recursion somewhat more.
    gain = np.abs(np.fft.rfft(answer)).max()
    assert gain <= (1.0 if not filter_.core.is_exact else 3.0) * (1.0 + share) * (1.0 + 1e-9)
    assert np.max(np.abs(answer[-100:])) < 1e-6


def test_the_bilinear_form_takes_over_where_the_exact_one_would_ring() -> None:
    assert not ExtendedCompensator(ExtendedModel(1.0, 50.0, 50.0, 1.0, 1.0, "mbar"), 1.0).core.is_exact
    assert ExtendedCompensator(BASELINE, 100.0).core.is_exact


@given(share=st.floats(40.0, 100.0), rate=st.floats(12.0, 35.0), seed=seeds)
@settings(max_examples=10)
def test_the_bilinear_form_is_the_papers_filter(share: float, rate: float, seed: int) -> None:
    coarse = ExtendedCompensator(ExtendedModel(1.0, share, rate, 1.0, 1.0, "mbar"), 1.0)
    assert not coarse.core.is_exact
    readings = np.random.default_rng(seed).standard_normal(40)
    paper = Compensator(rate, 1.0 + share, rate, sample_rate_hz=1.0)  # equation (13) with kappa and a of one arm
    np.testing.assert_allclose(coarse.apply(readings), paper.apply(readings), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", DRIFTS)
def test_what_goes_on_with_the_clock_says_how_far_it_goes_within_an_hour(name: str) -> None:
    model = BASELINE.with_part(effect(name), effect(name).begun())
    filter_ = ExtendedCompensator(model, 1.0)
    said = re.search(r"an hour later it moves a full-scale force by (\S+) %", filter_.cautions[name])
    assert said is not None
    force_n = filter_.apply(np.full(3601, filter_.reading_per_share))
    moved = 100.0 * (force_n[-1] - force_n[0]) / model.full_scale_load_n
    assert float(said[1].replace("−", "-")) == pytest.approx(moved, rel=0.05)
    assert not ExtendedCompensator(BASELINE.with_part(effect("contact_area"), [0.1, 0.5])).cautions


@pytest.mark.parametrize("name", DRIFTS)
def test_a_drift_that_is_held_is_undone_as_its_twin_simulates_it(name: str) -> None:
    model = BASELINE.with_part(effect(name), effect(name).begun()).held_after(4.0, ())
    conditions = some_conditions(3)
    assert conditions.time_s[-1] > 20.0
    assert np.max(np.abs(_error(model, conditions))) < EXACT_TOLERANCE
    filter_ = ExtendedCompensator(model, 1.0)
    force_n = filter_.apply(np.full(3601, filter_.reading_per_share))
    assert np.ptp(force_n[200:]) < 1e-6 < abs(force_n[-1] - force_n[0])  # once the wall has followed
    moved = 100.0 * (force_n[-1] - force_n[0]) / model.full_scale_load_n
    said = re.search(r"until 4 s, .* where it moves a full-scale force by (\S+) %", filter_.cautions[name])
    assert said is not None
    assert float(said[1].replace("−", "-")) == pytest.approx(moved, rel=0.05)


def test_a_drift_that_is_held_after_hours_is_told_as_it_is_by_then() -> None:
    """Of logs by the hour: what it does within the first hour is next to nothing of it."""
    steady = BASELINE.with_part("zero_drift", [1e-6, 0.0, 0.0, 1.0])
    by_hour, by_day = (ExtendedCompensator(steady.held_after(3600.0 * k, ()), 1.0) for k in (1, 24))
    share = by_hour.moved_by_the_clock["zero_drift"]
    assert by_day.moved_by_the_clock["zero_drift"] == pytest.approx(24.0 * share, rel=1e-9)
    late = ExtendedCompensator(steady.held_after(60.0, ()), 1.0, started_s=100.0)  # held before the first reading
    assert not late.moved_by_the_clock
    assert not late.cautions


def test_what_is_held_is_a_drift_and_stays_held() -> None:
    model = chain_of(["zero_drift", "gain_drift", "linear_leak"], 1)
    held = model.held_after(4.0, ("gain_drift",))
    assert {part.name: part.until_s for part in held.at(held.theta).parts} == {
        "zero_drift": 4.0, "gain_drift": np.inf, "linear_leak": np.inf,
    }  # fmt: skip
    assert model.held_as(held).part("zero_drift").until_s == 4.0
    assert model.held_after(4.0, ("gain_drift", "zero_drift")) is model
    carried_on = Conditions(np.arange(5.0), np.zeros(5), 1.0, before={"time_s": 2.0})
    assert carried_on.until(4.0).time_s.tolist() == [0.0, 1.0, 2.0, 2.0, 2.0]
    assert carried_on.until(6.0) is carried_on


def test_a_leak_says_that_an_error_of_zero_grows() -> None:
    model = BASELINE.with_part(effect("linear_leak"), np.array([0.01]))
    filter_ = ExtendedCompensator(model, 100.0)
    assert "zero" in filter_.cautions["linear_leak"]
    zero = 1e-3  # of full scale
    force_n = filter_.apply(np.append(0.0, np.full(10_000, zero * filter_.reading_per_share)))
    # f = p + omega (1 - 1/N) with omega' = leak rate p, once the wall has relaxed.
    per_s = (force_n[-1] - force_n[-5001]) / 50.0
    assert per_s == pytest.approx(800.0 * zero * 0.01 * (1.0 - 1.0 / model.wall_ratio), rel=1e-6)


def test_the_extended_filter_agrees_with_the_papers_where_the_load_is_slow() -> None:
    calibration = extended_calibration(BASELINE)
    plain = Compensator(calibration.a1, calibration.b0, calibration.b1)
    readings = 90.0 - 90.0 * np.cos(np.arange(3000) / 300.0)
    difference_n = ExtendedCompensator(BASELINE, 100.0).apply(readings) - plain.apply(readings)
    # Bilinear against straight lines: second order of the step over the relaxation time.
    assert np.max(np.abs(difference_n)) < 1e-3


@given(seed=seeds, ticks=st.integers(1, 60), cut=st.integers(0, 60))
@settings(max_examples=15, deadline=None)
def test_a_bank_holds_plain_and_extended_filters(seed: int, ticks: int, cut: int) -> None:
    rng = np.random.default_rng(seed)
    filters = [
        Compensator(0.2, 1.6, 0.3, offset=1.0),
        ExtendedCompensator(chain_of(["play_hysteresis", "zero_drift"], seed), 100.0),
        Compensator(0.4, 1.6, 0.3),
        ExtendedCompensator(chain_of(["linear_leak"], seed), 100.0),
    ]
    readings = rng.normal(60.0, 20.0, (ticks, 4))
    readings[rng.random(readings.shape) < 0.1] = np.nan
    singles = np.stack([filter_.apply(readings[:, k]) for k, filter_ in enumerate(filters)], axis=1)
    bank = stack(filters)
    assert np.array_equal(np.concatenate([bank.push(readings[:cut]), bank.push(readings[cut:])]), singles)
    bank.reset()
    buffer = np.empty(4)
    for tick, expected in zip(readings, singles, strict=True):
        buffer[:] = tick
        assert bank.push(buffer, out=buffer) is buffer  # in place
        assert np.array_equal(buffer, expected)
    assert bank.missing_count == tuple(np.count_nonzero(~np.isfinite(readings), axis=0))


@pytest.mark.parametrize("wrong", [{"sample_rate_hz": 0.0}, {"sample_rate_hz": np.inf}, {"started_s": -1.0}])
def test_a_senseless_rate_or_time_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError, match=next(iter(wrong))):
        ExtendedCompensator(BASELINE, **{"sample_rate_hz": 100.0, **wrong})
