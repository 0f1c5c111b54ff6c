"""Recordings made ready: scale, sessions, and the noise of the load, against what is known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from courses import STANDARD, STEP_S, prepared, pressed, triangles
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from test_diagnosis_parts import MODEL

from smartshoe import Recording
from smartshoe.diagnosis._averaging import kernel, smoothed
from smartshoe.diagnosis._continuation import without_predecessor
from smartshoe.diagnosis._denoise import _lines, noise_sd, without_noise
from smartshoe.diagnosis._diagnose import _limit_missing_predecessor
from smartshoe.diagnosis._jittered import jitter_s
from smartshoe.diagnosis._scale import Scale, full_scale, thinning
from smartshoe.diagnosis._sensitivity import available_effects, logged_channels, nuisance_precision
from smartshoe.diagnosis._session import Session, at_full_rate, prepare
from smartshoe.errors import NotIdentifiableError
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]


# -- scale --------------------------------------------------------------------------------------------------------
def test_full_scale_is_the_largest_load_and_the_largest_span_of_one_recording() -> None:
    load = triangles()
    low, high = pressed(0.5 * load, 0.5 * load + 3.0), pressed(load, load - 2.0)
    usable = [one.sensor.present for one in (low, high)]
    scale = full_scale([low, high], usable, STANDARD)
    assert scale.load_n == pytest.approx(800.0, rel=0.01)
    assert scale.reading == pytest.approx(140.0, rel=0.01)
    assert (scale.unit, scale.zero) == (MILLIBAR, 0.0)
    falling = full_scale([pressed(load, 5.0 - load)], usable[:1], STANDARD)
    assert falling.reading == pytest.approx(-140.0, rel=0.01)
    assert falling.share(np.array([-280.0])) == pytest.approx(2.0, rel=0.01)


def test_a_spike_and_what_is_not_usable_count_for_nothing() -> None:
    load = triangles()
    spiked = load.copy()
    spiked[[100, 900]] = 30.0
    one = pressed(spiked, spiked)
    assert full_scale([one], [one.sensor.present], STANDARD).load_n == pytest.approx(800.0, rel=0.01)
    half = one.time_s < 12.0
    lower = pressed(np.where(half, 0.4 * load, load))
    assert full_scale([lower], [np.asarray(half)], STANDARD).load_n == pytest.approx(320.0, rel=0.01)
    nothing = pressed(0.0 * load, load)
    with pytest.raises(NotIdentifiableError, match="never leaves zero"):
        full_scale([nothing], [nothing.sensor.present], STANDARD)


def test_the_zero_of_a_reading_that_is_no_pressure_is_its_median_at_the_lowest_load() -> None:
    load = triangles()
    time_s = STEP_S * np.arange(load.size)
    volts = Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_v=1.5 + 0.5 * load)
    scale = full_scale([volts], [volts.sensor.present], STANDARD)
    assert scale.zero == pytest.approx(1.5, abs=0.01)
    assert scale.share(np.array([2.0])) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(("ramp_s", "rate_hz"), [(1.0, 200.0), (2.0, 200.0), (1.0, 400.0)])
def test_samples_are_thinned_to_some_twenty_on_the_fastest_ramp(ramp_s: float, rate_hz: float) -> None:
    time_s = np.arange(0.0, 20.0, 1.0 / rate_hz)
    load = np.abs((time_s / ramp_s + 1.0) % 2.0 - 1.0)
    run = Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * load)
    (factor,) = thinning([run], Scale(800.0, 140.0, MILLIBAR), STANDARD)
    assert 20 <= 0.8 * ramp_s * rate_hz / factor < 32
    slower = Recording.from_arrays(time_s=2.0 * time_s, force_n=800.0 * load, pressure_mbar=140.0 * load)
    assert thinning([run, slower], Scale(800.0, 140.0, MILLIBAR), STANDARD) == [factor, factor]  # that of the fastest


@pytest.mark.parametrize("hold_s", [60.0, 300.0])
def test_quick_steps_between_long_holds_keep_their_shape(hold_s: float) -> None:
    """Dead weights put on and off: ramps of a share of the time that no quantile over time sees."""
    rate_hz, ramp_s = 100.0, 0.5
    corners = np.cumsum([0.0, 5.0, *([ramp_s, hold_s] * 6)])
    time_s = np.arange(0.0, corners[-1], 1.0 / rate_hz)
    load = np.interp(time_s, corners, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.7, 0.7, 0.2, 0.2, 1.0, 1.0, 0.0, 0.0])
    noise = 1e-3 * np.random.default_rng(1).standard_normal(time_s.size)
    run = Recording.from_arrays(time_s=time_s, force_n=800.0 * (load + noise), pressure_mbar=140.0 * load)
    shape = 0.8 * ramp_s * rate_hz / 12.0  # at least half as many samples as usual, and no more than six times fewer
    (factor,) = thinning([run], Scale(800.0, 140.0, MILLIBAR), STANDARD)
    assert 1 <= factor <= 6.0 * shape


def test_a_long_recording_is_thinned_further_and_a_short_one_not_at_all() -> None:
    scale = Scale(800.0, 140.0, MILLIBAR)
    long = triangles(400, 2.0, 1.0)
    (factor,) = thinning([pressed(long)], scale, STANDARD)
    (shape,) = thinning([pressed(long[:2000])], scale, STANDARD)
    assert factor > shape
    assert long.size / factor < 1.05 * max(12_000, long.size / (6 * shape))
    assert thinning([pressed(np.linspace(0.0, 1.0, 4))], scale, STANDARD) == [1]


# -- sessions -----------------------------------------------------------------------------------------------------
def test_a_session_is_in_shares_of_full_scale_on_its_own_clock() -> None:
    load = triangles()
    run = pressed(load, 0.9 * load)
    later = replace(run, time_s=run.time_s + 50.0)
    (session,), scale = prepared(later)
    at = session.conditions
    assert (at.time_s[0], at.step_s, session.thinned) == (0.0, pytest.approx(STEP_S), 1)
    assert session.reading == pytest.approx(smoothed(0.9 * load * 140.0 / scale.reading, kernel(3), 1), abs=1e-9)
    assert at.load.max() == pytest.approx(1.0, abs=0.03)
    assert session.usable.all()
    assert session.resting == pytest.approx(at.load < STANDARD.standing)
    (thin,), _ = prepared(later, factor=4)
    assert thin.conditions.step_s == pytest.approx(4 * STEP_S)
    assert thin.conditions.time_s == pytest.approx(at.time_s[::4])
    assert thin.conditions.load == pytest.approx(at.load[::4], abs=0.02)


def test_what_lacks_is_bridged_and_not_used() -> None:
    load = triangles()
    reading = load.copy()
    lost = slice(700, 760)
    reading[lost] = np.nan
    (session,), _ = prepared(pressed(load, reading))
    assert np.isfinite(session.reading).all()
    assert not session.usable[705:755].any()
    assert np.count_nonzero(~session.usable) == pytest.approx(60, abs=6)
    fewer = replace(pressed(load).load, missing=None)
    assert fewer.present.all()


def test_cycles_are_counted_from_foot_to_foot_and_every_third_is_held_out_across_recordings() -> None:
    load = triangles(8)
    sessions, _ = prepared(pressed(load), pressed(load))
    for session in sessions:
        rises = np.flatnonzero((session.conditions.load[1:] > 0.06) & (session.conditions.load[:-1] <= 0.06))
        assert session.cycle[rises + 1] == pytest.approx(np.arange(8))
        changes = np.flatnonzero(np.diff(session.cycle))
        assert np.abs(changes - rises[1:]).max() < 12  # it begins as the load leaves the rest
    whole = np.concatenate([sessions[0].cycle, 8 + sessions[1].cycle])
    held = np.concatenate([session.held_out for session in sessions])
    assert held == pytest.approx(whole % 3 == 2)


def test_too_few_cycles_make_parts_of_equal_time() -> None:
    (session,), _ = prepared(pressed(triangles(3)))
    counts = np.bincount(session.cycle)
    assert counts.size >= 10
    assert np.ptp(counts) <= 1
    assert (np.diff(session.cycle) >= 0).all()


def test_at_the_full_rate_cycles_and_what_is_held_out_are_where_they_were() -> None:
    run = pressed(triangles(9))
    sessions, scale = prepared(run, factor=5)
    (fine,) = at_full_rate(sessions, [run.sensor.present], scale, STANDARD)
    assert fine.reading == pytest.approx(scale.share(run.sensor.values))
    assert fine.thinned == 1
    thin = sessions[0]
    assert fine.cycle[::5] == pytest.approx(thin.cycle)
    assert fine.held_out[::5] == pytest.approx(thin.held_out)
    edge = int(np.flatnonzero(np.diff(thin.cycle))[2])
    around = fine.cycle[5 * edge : 5 * edge + 6]
    assert list(around) == sorted(around)
    assert np.count_nonzero(np.diff(around)) == 1
    assert 2 <= np.flatnonzero(np.diff(around))[0] + 1 <= 3


def test_uneven_time_stamps_come_to_an_even_grid() -> None:
    rng = np.random.default_rng(2)
    load = triangles()
    even = STEP_S * np.arange(load.size)
    time_s = even + 0.3 * STEP_S * rng.uniform(-1.0, 1.0, load.size)
    time_s[0], time_s[-1] = even[0], even[-1]
    uneven = np.interp(time_s, even, load)
    kept = (even < 14.0) | (even > 14.4)
    run = Recording.from_arrays(
        time_s=time_s[kept],
        force_n=800.0 * uneven[kept],
        pressure_mbar=140.0 * uneven[kept],
        temperature_k=293.0 + time_s[kept],
    )
    (session,), _ = prepared(run)
    at = session.conditions
    assert np.diff(at.time_s) == pytest.approx(np.full(at.time_s.size - 1, at.step_s))
    grid = np.interp(at.time_s, even, smoothed(load, kernel(3), 1))
    near = (at.time_s < 13.9) | (at.time_s > 14.5)
    assert at.load[near] == pytest.approx(grid[near], abs=0.02)
    assert at.temperature_k is not None
    assert at.temperature_k == pytest.approx(at.time_s, abs=0.1)
    # Where no sample is near there is none.
    assert not session.usable[(at.time_s > 14.1) & (at.time_s < 14.3)].any()
    assert session.usable[near].mean() > 0.95


LONG, BRIEF = 22, 18  # steps beside what any sensor's lag takes: 0.44 and 0.36 s


@pytest.mark.parametrize("is_logged", [True, False])
@pytest.mark.parametrize(("count", "is_open"), [(LONG, True), (BRIEF, False)])
@pytest.mark.parametrize("factor", [1, 4])
def test_where_the_load_is_not_known_for_longer_than_a_lag_the_past_is_open_again(
    is_logged: bool, count: int, is_open: bool, factor: int
) -> None:
    """Whether its samples are empty or its rows are not there; at the first sample after it."""
    load, first = triangles(10), 1200
    gone = (np.arange(load.size) >= first) & (np.arange(load.size) < first + count)
    run = pressed(np.where(gone, np.nan, load), load) if is_logged else pressed(load).taken(~gone)
    ((session,), scale) = prepared(run, factor=factor)
    assert len(session.gap_ends) == is_open
    (fine,) = at_full_rate([session], [run.sensor.present], scale, STANDARD)
    assert len(fine.gap_ends) == is_open
    if is_open:
        assert session.gap_ends[0] == pytest.approx((first + count) / factor, abs=1.0)
        assert fine.gap_ends[0] == pytest.approx(first + count, abs=1.0)
        assert session.conditions.time_s[session.gap_ends[0]] == pytest.approx(
            STEP_S * (first + count), abs=factor * STEP_S
        )
        assert not session.usable[session.gap_ends[0] - 2]
    assert replace(session, gap_ends=()).fitted == pytest.approx(session.fitted)  # nothing else is otherwise


def test_a_past_is_open_after_each_gap_of_the_load_and_for_no_other_reason() -> None:
    load = triangles(10)
    at = np.arange(load.size)

    def ends(*gone: tuple[int, int], reading: bool = False) -> tuple[int, ...]:
        lost = np.any([(at >= first) & (at < stop) for first, stop in gone], axis=0)
        shown = np.where(lost, np.nan, load)
        (session,), _ = prepared(pressed(load, shown) if reading else pressed(shown, load))
        return session.gap_ends

    assert ends((500, 500 + LONG), (1500, 1500 + LONG)) == (500 + LONG, 1500 + LONG)
    assert ends((500, 500 + LONG), (1500, 1500 + BRIEF)) == (500 + LONG,)
    assert ends((500, 500 + LONG), reading=True) == ()  # the load is known, and so is what the arm holds
    assert ends((0, LONG)) == ()  # that is how the recording begins
    assert ends((load.size - LONG, load.size)) == ()  # nothing comes after it
    (whole,), _ = prepared(pressed(load))
    assert whole.gap_ends == ()


def test_other_channels_go_along(  # a temperature from its first value on, a neighbour in this unit's full scale
) -> None:
    load = triangles()
    time_s = STEP_S * np.arange(load.size)
    run = Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load,
        pressure_mbar=140.0 * load,
        pressure_2_mbar=35.0 * load,
        temperature_k=300.0 + 0.1 * time_s,
    )
    (session,), scale = prepared(run)
    at = session.conditions
    assert at.temperature_k is not None
    assert at.temperature_k[[0, -1]] == pytest.approx([0.0, 0.1 * time_s[-1]], abs=1e-6)
    assert at.neighbour is not None
    assert at.neighbour.max() == pytest.approx(35.0 / abs(scale.reading), rel=0.03)
    (plain,), _ = prepared(pressed(load))
    assert (plain.conditions.temperature_k, plain.conditions.neighbour) == (None, None)


def test_other_channels_are_bridged_where_samples_are_missing_and_are_none_where_all_are() -> None:
    load = triangles()
    time_s = STEP_S * np.arange(load.size)
    gone = (time_s > 4.0) & (time_s < 5.0)
    missing = np.full(load.size, np.nan)

    def conditions(temperature_k: Array, neighbour_mbar: Array) -> tuple[Session, float]:
        run = Recording.from_arrays(
            time_s=time_s,
            force_n=800.0 * load,
            pressure_mbar=140.0 * load,
            pressure_2_mbar=neighbour_mbar,
            temperature_k=temperature_k,
        )
        (session,), scale = prepared(run)
        return session, abs(scale.reading)

    session, full = conditions(np.where(gone, np.nan, 293.0 + time_s), np.where(gone, np.nan, 20.0 + time_s))
    at = session.conditions
    assert at.temperature_k == pytest.approx(at.time_s, abs=1e-3)
    assert at.neighbour == pytest.approx((20.0 + at.time_s) / full, abs=1e-3)
    assert logged_channels([session]) == {"temperature", "neighbour"}
    none, _ = conditions(missing, missing)
    assert (none.conditions.temperature_k, none.conditions.neighbour) == (None, None)
    assert logged_channels([none]) == set()


def test_temperatures_of_all_recordings_are_on_one_scale() -> None:
    """From where the first begins that has one, whatever is missing; so that rooms of several warmths are told."""
    load = triangles()
    time_s = STEP_S * np.arange(load.size)
    warm_k = 293.0 + 0.05 * time_s
    patchy_k = np.where((time_s > 4.0) & (time_s < 5.0), np.nan, warm_k + 6.0)
    runs = [
        Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * load, **channels)
        for channels in ({}, {"temperature_k": warm_k}, {"temperature_k": patchy_k})
    ]
    (plain, *logged), scale = prepared(*runs)
    assert plain.conditions.temperature_k is None
    fine = at_full_rate([plain, *logged], [np.ones(load.size, dtype=bool)] * 3, scale, STANDARD)
    for one, begins_k in zip([*logged, *fine[1:]], (0.0, 6.0) * 2, strict=True):
        at = one.conditions
        assert at.temperature_k == pytest.approx(begins_k + 0.05 * at.time_s, abs=1e-3)
        assert at.begins_warmer_k == pytest.approx(begins_k)
    assert logged_channels(logged) == {"temperature", "temperatures"}
    assert logged_channels(logged[:1]) == {"temperature"}
    assert logged_channels([plain, *logged]) == set()


def test_an_effect_is_looked_for_where_its_channel_is_logged_throughout() -> None:
    load = triangles()
    time_s = STEP_S * np.arange(load.size)
    beside = Recording.from_arrays(
        time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * load, pressure_2_mbar=35.0 * load
    )
    alone, both = prepared(pressed(load))[0], prepared(beside)[0]
    assert "cross_talk" not in {one.name for one in available_effects(alone, STANDARD)}
    assert "cross_talk" in {one.name for one in available_effects(both, STANDARD)}
    assert "cross_talk" not in {one.name for one in available_effects([*alone, *both], STANDARD)}
    found = available_effects(alone, STANDARD)
    assert all(one.is_physical and one.shifts is None and not one.is_refinement for one in found)
    assert {"delay", "linear_leak", "dead_band"} <= {one.name for one in found}


@pytest.mark.parametrize(("begun", "share"), [(0.0, 0.1), (0.5, 0.1), (0.5, 0.3)])
def test_what_an_arm_may_remember_is_its_share_of_what_the_unit_may_have_borne(begun: float, share: float) -> None:
    (session,), _ = prepared(pressed(begun + (1.0 - begun) * triangles()))
    model = replace(MODEL, gain=1.5, relaxing_share=share)
    precision = nuisance_precision(session, model)
    held = 1.5 * share * max(float(session.conditions.load[0]), STANDARD.unknown_past)
    assert precision == pytest.approx(np.diag([0.0, held**-2]), rel=1e-6)


def test_a_later_recording_knows_the_load_that_went_before_and_the_one_after_it_all() -> None:
    load = triangles(6)
    first, second, third = (pressed(load) for _ in range(3))
    runs = [
        replace(first, name="a"),
        replace(second, name="b", metadata={"continues": "a"}),
        replace(third, name="c", metadata={"continues": "b"}),
    ]
    sessions, _ = prepared(*runs)
    before = [session.conditions.before for session in sessions]
    dose = float(np.trapezoid(load, dx=STEP_S))
    assert before[0] == {}
    for times in (1, 2):
        told = before[times]
        assert told["dose"] == pytest.approx(times * dose, rel=0.02)
        assert told["cycles"] == 6 * times
        assert told["time_s"] == pytest.approx(times * STEP_S * load.size, rel=0.01)
        assert told["largest_load"] == pytest.approx(1.0, abs=0.05)
    # In whatever order they are given.
    for order in ((2, 1, 0), (1, 2, 0), (0, 2, 1)):
        again, _ = prepared(*(runs[k] for k in order))
        assert [one.conditions.before for one in again] == [before[k] for k in order]
        assert [one.recording.name for one in again] == [runs[k].name for k in order]
        assert [one.index for one in again] == [0, 1, 2]


@pytest.mark.parametrize("metadata", [{"continues": "a"}, {}])
def test_the_same_load_cycles_judge_in_whatever_order_recordings_are_given(metadata: dict[str, str]) -> None:
    first, second = (replace(pressed(triangles(cycles)), name=name) for cycles, name in ((7, "a"), (8, "b")))
    second = replace(second, metadata=metadata)

    def judging(*runs: Recording) -> dict[str, list[int]]:
        usable = [one.sensor.present for one in runs]
        scale = full_scale(runs, usable, STANDARD)
        sessions = prepare(runs, usable, None, scale, [1], STANDARD)
        return {one.recording.name: sorted({*one.cycle[one.held_out].tolist()}) for one in sessions}

    # Counted on through both: the third, sixth, ninth, twelfth and fifteenth cycle.
    assert judging(first, second) == judging(second, first) == {"a": [2, 5], "b": [1, 4, 7]}


@pytest.mark.parametrize(("heights", "cycles"), [((1.0, 0.9, 0.8), (7, 7, 7)), ((1.0, 1.0, 1.0), (8, 7, 8))])
def test_the_same_load_cycles_judge_whatever_recordings_are_called(
    heights: tuple[float, ...], cycles: tuple[int, ...]
) -> None:
    noise = np.random.default_rng(5)
    loads = [triangles(count, height=height) for count, height in zip(cycles, heights, strict=True)]
    runs = [pressed(load, load + 1e-3 * noise.standard_normal(load.size)) for load in loads]

    def judging(names: str, order: Sequence[int]) -> list[list[int]]:
        given = [replace(runs[k], name=names[k]) for k in order]
        usable = [one.sensor.present for one in given]
        sessions = prepare(given, usable, None, full_scale(given, usable, STANDARD), [1], STANDARD)
        told = {k: sorted({*one.cycle[one.held_out].tolist()}) for k, one in zip(order, sessions, strict=True)}
        return [told[k] for k in range(3)]

    orders = [*permutations(range(3))]
    expected = judging("abc", orders[0])
    for order in orders:
        for name in ("abc", "bca", "cab", "acb", "aaa"):
            assert judging(name, order) == expected


def test_of_recordings_that_continue_each_other_the_shortest_comes_first() -> None:
    first, second = pressed(triangles(7)), pressed(triangles(6))
    names = (("a", "b"), ("b", "a"))
    ring = [
        replace(run, name=one, metadata={"continues": other})
        for run, (one, other) in zip((first, second), names, strict=True)
    ]
    sessions, _ = prepared(*ring)
    assert [bool(one.conditions.before) for one in sessions] == [True, False]
    (alone,), _ = prepared(replace(second, name="a", metadata={"continues": "a"}))
    assert alone.conditions.before == {}


def test_a_recording_that_continues_one_that_is_not_given_says_so() -> None:
    load = triangles(6)
    first, second = replace(pressed(load), name="a"), replace(pressed(load), name="b", metadata={"continues": "a"})
    assert (without_predecessor([second, first]), without_predecessor([second])) == ([], [second])
    said = "b continues a, which is not among the recordings: it is taken as the unit's first after a rest"
    assert any(one.startswith(said) for one in _limit_missing_predecessor([second], 1, {}))
    assert not _limit_missing_predecessor([second, first], 2, {})
    itself = replace(second, name="a")
    assert without_predecessor([itself]) == [itself]
    why = "which is itself: it is taken as the unit's first after a rest (name the recording before it)"
    assert _limit_missing_predecessor([itself], 1, {}) == [f"a continues a, {why}"]
    assert _limit_missing_predecessor([replace(first, name="before"), itself], 2, {}) == [f"a continues a, {why}"]
    # Another recording of that name is one before it.
    assert _limit_missing_predecessor([first, itself], 2, {}) == []


def test_a_load_cells_noise_is_taken_out_and_said() -> None:
    load = triangles(8, rest_s=4.0)
    noise = 2e-3 * np.random.default_rng(1).standard_normal(load.size)
    noisy, plain = prepared(pressed(load + noise, load))[0][0], prepared(pressed(load))[0][0]
    assert noisy.denoised.raw_sd == pytest.approx(2e-3, rel=0.1)
    assert noisy.denoised.remaining_sd < 0.6 * noisy.denoised.raw_sd
    off = noisy.conditions.load - plain.conditions.load
    loaded = plain.conditions.load > 0.1
    assert np.std(off[loaded]) < 0.5 * noisy.denoised.raw_sd
    assert np.std(off[plain.resting]) < 0.7 * np.std(off[loaded])
    assert 0.0 < noisy.conditions.load_noise < noisy.denoised.remaining_sd


# -- noise of the load --------------------------------------------------------------------------------------------
@given(st.integers(0, 99), st.integers(3, 7))
@settings(max_examples=10)
def test_lines_through_neighbours_are_least_squares(seed: int, half: int) -> None:
    signal = np.random.default_rng(seed).standard_normal(60)
    mean, slope, left, spread = _lines(signal, half)
    k = np.arange(-half, half + 1)
    assert mean.size == slope.size == left.size == signal.size - 2 * half
    for at in (20, 30, 41):
        near, here = signal[at + k], at - half
        fitted = np.polyfit(k, near, 1)
        assert [slope[here], mean[here]] == pytest.approx(fitted, abs=1e-9)
        assert left[here] == pytest.approx(float(np.sum((near - np.polyval(fitted, k)) ** 2)) / (k.size - 2), abs=1e-9)
    assert spread == float(np.sum(k**2))


def test_corners_stay_and_noise_goes_as_far_as_is_said() -> None:
    load = triangles(30, rest_s=1.0)
    sd = 1e-3
    noisy = load + sd * np.random.default_rng(3).standard_normal(load.size)
    quiet, left, _ = without_noise(noisy, STEP_S, sd, STANDARD)
    assert left < 0.7 * sd
    assert np.sqrt(np.mean((quiet - load) ** 2)) == pytest.approx(left, rel=0.25)
    same, none, _ = without_noise(load, STEP_S, 0.0, STANDARD)
    assert same is load
    assert none == 0.0
    assert noise_sd(np.zeros(5), STANDARD) == 0.0


@pytest.mark.parametrize("period_s", [2.0, 5.0, 20.0])
def test_jitter_is_as_long_whatever_the_slope_that_shows_it(period_s: float) -> None:
    rng = np.random.default_rng(5)
    load = triangles(round(100.0 / period_s), period_s, 0.5 * period_s)
    time_s = STEP_S * np.arange(load.size)
    early = time_s + 0.03 * rng.standard_normal(time_s.size)
    reading = np.interp(early, time_s, load) + 1e-4 * rng.standard_normal(time_s.size)
    assert jitter_s(load, reading, STEP_S) == pytest.approx(0.03, rel=0.25)
    assert jitter_s(np.zeros(load.size), reading, STEP_S) == 0.0
