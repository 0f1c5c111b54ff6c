"""Recordings made ready: windows, scales, thinning, cycles and the load's noise, by written-out sums and at bounds."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from courses import course
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm

from smartshoe import Recording
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._averaging import kernel, smoothed
from smartshoe.diagnosis._continuation import history_after
from smartshoe.diagnosis._denoise import _lines, noise_sd, without_noise
from smartshoe.diagnosis._load_cycles import cycles_of, have_later_cycles, load_cycles
from smartshoe.diagnosis._prepared import prepared
from smartshoe.diagnosis._rest import begins_unloaded, with_level_rests
from smartshoe.diagnosis._scale import Scale, at_lowest_load, fitted_lengths, full_scale, thinning
from smartshoe.diagnosis._session import Session, at_full_rate, prepare
from smartshoe.errors import NotIdentifiableError
from smartshoe.integrity import examine
from smartshoe.models.effects import Conditions
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.02
SCALE = Scale(800.0, 140.0, MILLIBAR)


def _run(load: Array, reading: Array | None = None, step_s: float = STEP_S, **more: Any) -> Recording:
    """Shares of 800 N and 140 mbar."""
    shown = 140.0 * (load if reading is None else reading)
    return Recording.from_arrays(
        time_s=step_s * np.arange(load.size), force_n=800.0 * load, pressure_mbar=shown, **more
    )


# -- windows ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("factor", [1, 2, 3, 7])
def test_a_window_is_hanns_over_two_thinned_steps(factor: int) -> None:
    places = [k / factor for k in range(1 - factor, factor)]
    assert kernel(factor) == pytest.approx([(0.5 + 0.5 * math.cos(math.pi * at)) / factor for at in places])
    assert list(kernel(0)) == [1.0]


@pytest.mark.parametrize(("reach", "factor"), [(1, 1), (2, 1), (3, 4), (5, 5)])
def test_an_average_is_of_a_signal_turned_about_its_end_points(reach: int, factor: int) -> None:
    signal = np.random.default_rng(reach).standard_normal(23)

    def at(k: int) -> float:
        if k < 0:
            return float(2.0 * signal[0] - signal[-k])
        if k > 22:
            return float(2.0 * signal[22] - signal[44 - k])
        return float(signal[k])

    weights = kernel(reach)
    half = (weights.size - 1) // 2
    expected = [sum(weights[half + d] * at(k + d) for d in range(-half, half + 1)) for k in range(0, 23, factor)]
    assert smoothed(signal, weights, factor) == pytest.approx(expected)
    assert smoothed(signal, weights, factor).dtype == float


# -- scales -----------------------------------------------------------------------------------------------------------
def test_the_lowest_load_is_within_what_stands_still() -> None:
    load = np.concatenate([np.full(50, 100.0), np.full(50, 116.0), np.full(50, 116.1), np.full(50, 900.0)])
    assert list(np.flatnonzero(at_lowest_load(load, STANDARD))) == list(range(100))  # 100 + 0.02 times 800
    spiked = np.concatenate([load, load, load, load, load, load, [-5000.0]])
    assert np.count_nonzero(at_lowest_load(spiked, STANDARD)) == 601


def test_full_scale_is_of_percentiles_and_its_sign_the_slopes() -> None:
    load, reading = np.arange(1001.0), np.concatenate([[-50.0], np.linspace(10.0, 110.0, 999), [500.0]])
    one = Recording.from_arrays(time_s=0.01 * np.arange(1001.0), force_n=load, pressure_mbar=reading)
    every = np.ones(1001, dtype=bool)
    found = full_scale([one], [every], STANDARD)
    assert found.load_n == pytest.approx(999.0)
    assert found.reading == pytest.approx(100.0)
    assert (found.zero, found.unit.symbol) == (0.0, "mbar")
    pulled = full_scale([replace_load(one, -load)], [every], STANDARD)
    assert (pulled.load_n, pulled.reading) == (pytest.approx(999.0), pytest.approx(-100.0))
    # Where load and reading have nothing in common it counts as rising; of several each is taken about its own mean.
    even = np.cos(np.linspace(0.0, 2.0 * np.pi, 1001))
    level = Recording.from_arrays(time_s=one.time_s, force_n=load, pressure_mbar=even)
    assert full_scale([level], [every], STANDARD).reading > 0.0
    high = Recording.from_arrays(time_s=one.time_s, force_n=load - 500.0, pressure_mbar=5000.0 + 0.1 * reading)
    pair = full_scale([one, high], [every, every], STANDARD)
    assert (pair.load_n, pair.reading) == (pytest.approx(999.0), pytest.approx(100.0))
    falling = Recording.from_arrays(time_s=one.time_s, force_n=load + 5e3, pressure_mbar=5e4 - 2.0 * reading)
    assert full_scale([one, falling], [every, every], STANDARD).reading == pytest.approx(-200.0)
    assert full_scale([one, falling], [every, ~every], STANDARD).reading == pytest.approx(100.0)


def replace_load(one: Recording, load_n: Array) -> Recording:
    return Recording.from_arrays(time_s=one.time_s, force_n=load_n, pressure_mbar=one.sensor.values)


@pytest.mark.parametrize(("load", "reading"), [(0.0, 1.0), (1.0, 0.0)])
def test_without_a_load_or_a_reading_that_moves_there_is_no_scale(load: float, reading: float) -> None:
    way = np.linspace(0.0, 1.0, 200)
    one = _run(load * way, reading * way)
    with pytest.raises(NotIdentifiableError, match="never leaves zero"):
        full_scale([one], [np.ones(200, dtype=bool)], STANDARD)
    with pytest.raises(NotIdentifiableError, match="never leaves zero"):
        full_scale([_run(way)], [np.zeros(200, dtype=bool)], STANDARD)


def test_a_share_is_of_what_is_beyond_the_zero() -> None:
    volts = replace(SCALE, reading=-4.0, zero=1.0)
    assert list(volts.share(np.array([1.0, 5.0, -1.0]))) == [0.0, -1.0, 0.5]


# -- thinning ---------------------------------------------------------------------------------------------------------
def test_the_fastest_ramp_keeps_so_many_samples() -> None:
    """A ramp over a whole full scale in t: 0.8 t from 10 to 90 %, of which a twenty-fourth is a step."""
    for ramp_s, factor in ((2.41, 4), (2.99, 4), (3.01, 5), (0.5, 1), (0.61, 1), (1.21, 2)):
        steps = round(ramp_s / STEP_S * 1e3) / 1e3
        load = np.minimum(np.arange(800) / steps, 1.0)
        assert thinning([_run(load)], SCALE, STANDARD) == [factor]
    # Of more than one that of the fastest; of one of a few samples none is taken away.
    slow, fast = (_run(np.minimum(np.arange(800) / n, 1.0)) for n in (300, 100))
    assert thinning([slow, fast], SCALE, STANDARD) == 2 * thinning([fast], SCALE, STANDARD) == [3, 3]
    # Of a fiftieth of a second in a sample a window is two; of a load that never moves the whole of 9.6 s is one.
    assert thinning([slow, _run(np.linspace(0.0, 1.0, 4))], SCALE, STANDARD) == [1, 1]
    assert thinning([_run(np.linspace(0.0, 1.0, 5))], SCALE, STANDARD) == [1]
    assert thinning([_run(np.full(481, 0.5), np.linspace(0.0, 1.0, 481))], SCALE, STANDARD) == [20]
    falling = _run(1.0 - np.minimum(np.arange(800) / 155.0, 1.0))
    assert thinning([falling], SCALE, STANDARD) == [5]


@pytest.mark.parametrize(("count", "factor"), [(12_000, 1), (12_001, 2), (60_001, 6), (100_000, 6)])
def test_long_records_are_thinned_to_twelve_thousand_samples_by_six_at_most(count: int, factor: int) -> None:
    load = np.resize(course((40, 1.0), (40, 0.0)), count)
    assert thinning([_run(load)], SCALE, STANDARD) == [factor]
    half = count // 2
    assert thinning([_run(load[:half]), _run(load[half:])], SCALE, STANDARD) == [factor, factor]


@pytest.mark.parametrize(("samples", "factor"), [(3, 6), (6, 1), (10, 2), (15, 3), (40, 6)])
def test_of_a_ramp_of_few_samples_a_sixth_part_of_what_keeps_its_shape_stays(samples: int, factor: int) -> None:
    """Four samples from 10 to 90 % of it, where the logger saw as many: here of some 45,000."""
    load = np.resize(course((samples, 1.0), (samples, 0.0)), 45_000 // samples * samples)
    most = -(-load.size // 12_000)
    assert thinning([_run(load)], SCALE, STANDARD) == [min(factor, most)]


@given(st.lists(st.tuples(st.integers(1, 100_000), st.integers(1, 6)), min_size=1, max_size=6))
def test_of_long_recordings_as_much_is_fitted_of_each_and_short_ones_stay_whole(made: list[tuple[int, int]]) -> None:
    """Together no more than 72,000 samples as they are thinned; thinned further, quick loads are told as a delay."""
    runs: list[Any] = [range(count) for count, _ in made]
    factors = [factor for _, factor in made]
    lengths = fitted_lengths(runs, factors)
    left = [length / factor for length, factor in zip(lengths, factors, strict=True)]
    cut = [one for one, length, run in zip(left, lengths, runs, strict=True) if length < len(run)]
    assert all(0 < length <= len(run) for length, run in zip(lengths, runs, strict=True))
    assert sum(left) <= 72_000 + len(made)
    assert not cut or (sum(left) >= 72_000 - 1e-6 and max(left) <= min(cut) + 1.0)


@pytest.mark.parametrize("low", [0.9, 0.5, 0.1, 0.0])
def test_a_ramp_keeps_its_samples_whatever_part_of_the_full_scale_it_spans(low: float) -> None:
    """Triangles of 8 s at 100 Hz: 3.2 s from 10 to 90 % of what they span, 13 samples of it to a step."""
    time_s = np.arange(0.0, 80.0, 0.01)
    part = low + (1.0 - low) * np.abs((time_s / 4.0 + 1.0) % 2.0 - 1.0)
    pressed = _run(part, step_s=0.01)
    assert thinning([pressed], SCALE, STANDARD) == [13]
    # A load that stands still beside it has no ramp, however its noise slopes.
    still = _run(0.5 + 1e-3 * (1.0 - low) * np.random.default_rng(1).standard_normal(8000), step_s=0.01)
    assert thinning([pressed, still], SCALE, STANDARD) == [13, 13]


def test_a_recording_that_may_lose_twice_as_many_is_thinned_by_its_own_ramps() -> None:
    """Of 60,000 samples: down to four on a step of 10, though a slow recording beside it may lose four of five."""
    steps, slow = (_run(np.resize(course((n, 1.0), (n, 0.0)), 30_000)) for n in (10, 60))
    assert thinning([steps], SCALE, STANDARD) == [2]
    assert thinning([steps, slow], SCALE, STANDARD) == thinning([slow, steps], SCALE, STANDARD)[::-1] == [2, 5]
    for n, factor in ((15, 2), (20, 4)):  # of less than twice as many more there is no need
        other = _run(np.resize(course((n, 1.0), (n, 0.0)), 30_000))
        assert thinning([steps, other], SCALE, STANDARD) == [2, factor]
    every = [np.ones(30_000, dtype=bool)] * 3
    sessions = prepare([steps, slow, slow], every, [False, False, True], SCALE, [2, 5], STANDARD)
    assert [one.thinned for one in sessions] == [2, 5, 2]


def test_what_is_held_out_thins_nothing() -> None:
    """Fast or long, it is seen at the rate that what is fitted asks for."""
    slow, fast = (course(*((n, 1.0), (n, 0.0)) * 8) for n in (100, 8))
    fitted = _run(slow, name="a")
    for held in (_run(slow, name="b"), _run(fast, name="c"), _run(np.tile(slow, 60), name="d")):
        given = prepared([fitted, held], 1, examine([fitted, held], STANDARD), STANDARD)
        assert [one.thinned for one in given.sessions] == [3, 3]


# -- the load's rests and cycles --------------------------------------------------------------------------------------
def test_a_unit_begins_unloaded_where_its_gauge_reads_a_quarter_of_a_still_load() -> None:
    """Over the first four tenths of a second, twenty samples."""

    def told(load: Any, reading: Any) -> bool:
        return begins_unloaded(np.asarray(load, dtype=float), np.asarray(reading, dtype=float), STEP_S, STANDARD)

    load, later = np.full(40, 0.4), np.concatenate([np.full(20, 0.4), np.full(20, 0.9)])
    for sign in (1.0, -1.0):
        assert told(load, np.full(40, sign * 0.0999))
        assert not told(load, np.full(40, sign * 0.1001))
    assert not told(load, np.full(40, 0.1))
    assert told(-load, np.full(40, 0.0999))
    assert told(later, np.concatenate([np.zeros(20), np.full(20, 0.9)]))
    swaying = load.copy()
    swaying[5] += STANDARD.standing
    assert not told(swaying, 0.0 * load)
    swaying[5] -= 1e-6
    assert told(swaying, 0.0 * load)
    # A unit is pressed only: it began loaded where load and reading fall clearly below that later, but for a spike.
    for by, is_tare in ((0.99 * STANDARD.standing, True), (1.01 * STANDARD.standing, False)):
        falling = np.concatenate([np.zeros(20), np.full(20, -by)])
        assert told(0.4 + 2.0 * falling, falling) == told(0.4 + falling, 2.0 * falling) == is_tare
        assert told(0.4 + 2.0 * falling, 0.0 * falling)
        assert told(0.0 * falling + 0.4, 2.0 * falling)
    spiky = np.zeros(400)
    spiky[100:103] = -1.0
    assert told(0.4 + spiky, spiky)
    # Of slow logs a single sample.
    assert begins_unloaded(np.array([0.4, 0.9]), np.array([0.0, 0.9]), 5.0, STANDARD)


def test_each_rest_is_levelled_but_for_what_is_beyond_the_noise() -> None:
    rng = np.random.default_rng(3)
    load = np.concatenate([0.01 * rng.standard_normal(12), np.full(5, 0.8), 0.02 + 0.01 * rng.standard_normal(20)])
    load[30] = -0.2
    found = with_level_rests(load, 0.1, 0.03)
    first, last = load[:12], load[17:]
    near = np.abs(first - np.median(first)) < 0.03
    assert near.sum() > 10
    assert found[:12][near] == pytest.approx(np.full(near.sum(), first[near].mean()))
    inside = np.abs(last - np.median(last)) < 0.03
    assert found[17:][inside] == pytest.approx(np.full(inside.sum(), last[inside].mean()))
    assert found[30] == -0.2
    assert list(found[12:17]) == [0.8] * 5
    for count, is_levelled in ((10, False), (11, True)):
        few = np.concatenate([np.ones(3), np.resize([0.0, 0.01], count), np.ones(3)])
        assert bool(np.ptp(with_level_rests(few, 0.1, 0.5)[3:-3]) == 0.0) is is_levelled
    assert list(with_level_rests(np.array([0.1] * 20), 0.1, 0.5)) == [0.1] * 20


def _conditions(load: Array, step_s: float = STEP_S, before: Any = None) -> Conditions:
    return Conditions(step_s * np.arange(load.size), load, step_s, before=before or {})


def test_a_cycle_begins_with_the_last_sample_of_the_rest_before_its_rise() -> None:
    rise = ((10, 0.0), (20, 1.0), (20, 0.0))
    cycle = cycles_of(_conditions(course(*rise * 6)), STANDARD)
    # Rests end at 10, 60, 110, ...; the foot is left once a quarter of what makes a cycle (0.02 of 0.05 a step) is.
    assert list(np.flatnonzero(np.diff(cycle)) + 1) == [60, 110, 160, 210, 260]
    assert (cycle[0], cycle[-1]) == (0, 5)
    slowly = ((10, 0.0), (200, 1.0), (20, 0.0))  # 0.005 a step: four steps more within a quarter of 0.08
    later = cycles_of(_conditions(course(*slowly * 6)), STANDARD)
    assert list(np.flatnonzero(np.diff(later)) + 1) == [244 + 230 * k for k in range(5)]
    # A ripple of less than that is none; of a load that moves by little it is as much of its own span.
    rippled = course(*rise * 6) + 0.07 * np.resize([0.0, 1.0], 301)
    assert cycles_of(_conditions(rippled), STANDARD)[-1] == 5
    small = cycles_of(_conditions(0.7 + 0.05 * course(*rise * 6)), STANDARD)
    assert list(small) == list(cycle)
    large = cycles_of(_conditions(1.5 * course(*rise * 6)), STANDARD)
    assert large[-1] == 5
    # Beyond full scale it is of full scale: a dip of 0.0975 is more than 0.08, though less than 0.08 of 1.5.
    dipped = ((10, 0.0), (20, 1.0), (5, 0.935), (5, 1.0), (20, 0.0))
    assert cycles_of(_conditions(1.5 * course(*dipped * 6)), STANDARD)[-1] == 11


@pytest.mark.parametrize(("rises", "count"), [(5, 12), (6, 6)])
def test_fewer_than_six_cycles_make_twelve_parts_of_the_time(rises: int, count: int) -> None:
    load = course(*((10, 0.0), (20, 1.0), (20, 0.0)) * rises)
    cycle = cycles_of(_conditions(load), STANDARD)
    assert int(cycle[-1]) + 1 == count
    if count == 12:
        assert list(cycle) == [k * 12 // load.size for k in range(load.size)]
    six = replace(STANDARD, held_out_every=4)
    assert int(cycles_of(_conditions(load), six)[-1]) + 1 == 16


def test_what_a_recording_leaves_behind_adds_to_what_was_before() -> None:
    load = course((10, 0.0), (20, 0.9), (20, -0.1), (20, 0.5), (20, 0.0))
    dose = sum(0.5 * STEP_S * (max(a, 0.0) + max(b, 0.0)) for a, b in itertools.pairwise(load))
    first = dict(history_after(_conditions(load), STANDARD).sums)
    way = 0.5 * float(np.sum(np.abs(np.diff(load))))
    # A reversal shows in full but for twice the play's half width, which is no noise.
    assert first.pop("way") == pytest.approx(way, abs=4 * LEAST_DEAD_ZONE)
    assert first == pytest.approx({"largest_load": 0.9, "cycles": 2.0, "time_s": 90 * STEP_S, "dose": dose})
    before = {"largest_load": 0.95, "cycles": 7.0, "way": 3.0, "time_s": 30.0, "dose": 4.0}
    later = dict(history_after(_conditions(load, before=before), STANDARD).sums)
    assert later.pop("way") == pytest.approx(3.0 + way, abs=4 * LEAST_DEAD_ZONE)
    expected = {"largest_load": 0.95, "cycles": 9.0, "time_s": 30.0 + 90 * STEP_S, "dose": 4.0 + dose}
    assert later == pytest.approx(expected)
    lower = history_after(_conditions(load, before={**before, "largest_load": 0.3}), STANDARD).sums
    assert lower["largest_load"] == pytest.approx(0.9)


def test_a_recording_that_continues_others_knows_their_loads_at_its_own_step() -> None:
    ramp = 0.01 * np.arange(30)
    loads = [ramp, ramp + 0.3, ramp + 0.6]
    names = [("a", {}), ("b", {"continues": "a"}), ("c", {"continues": "b"})]
    runs = [replace(_run(load), name=name, metadata=more) for load, (name, more) in zip(loads, names, strict=True)]
    for factors in ([1, 1, 1], [2, 1, 2]):
        usable = [one.sensor.present for one in runs]
        sessions = prepare(runs, usable, [False] * 3, Scale(800.0, 140.0, MILLIBAR), factors, STANDARD)
        assert [one.conditions.earlier.size * one.thinned for one in sessions] == [0, 30, 60]
        last, step = sessions[2].conditions, factors[2]
        assert last.earlier[-10:] == pytest.approx(0.6 - 0.01 * step * np.arange(10, 0, -1), abs=0.01 * step)
        fine = at_full_rate(sessions, usable, Scale(800.0, 140.0, MILLIBAR), STANDARD)[2].conditions
        assert fine.earlier == pytest.approx(0.01 * np.arange(60), abs=0.01 * step)


# -- sessions ---------------------------------------------------------------------------------------------------------
def _sessions(*runs: Recording, factor: int = 1, usable: Any = None, held: Any = None) -> list[Session]:
    kept = [np.ones(len(one), dtype=bool) for one in runs] if usable is None else usable
    return prepare(runs, kept, held, SCALE, [factor], STANDARD)


PRESSES = course(*((40, 0.0), (60, 1.0), (60, 0.0)) * 7)


@pytest.mark.parametrize(("rest", "cycles"), [(0.0, 2), (0.01, 1), (0.07, 1)])
def test_a_bump_after_a_press_is_a_load_cycle_where_it_rises_and_falls(rest: float, cycles: int) -> None:
    """Up by 0.085 and down by as much; not where it comes down by less than 0.08."""
    sessions = _sessions(_run(course((40, 0.0), (120, 1.0), (120, 0.0), (100, 0.0), (40, 0.085), (40, rest))))
    assert load_cycles(sessions, STANDARD) == cycles
    assert have_later_cycles(sessions, STANDARD) is (cycles > 1)
    assert history_after(sessions[0].conditions, STANDARD).sums["cycles"] == cycles


def test_of_two_channels_in_the_readings_unit_the_first_is_the_neighbour_but_no_reference() -> None:
    more = {"pressure_2_mbar": 14.0 + 0.0 * PRESSES, "pressure_3_mbar": 28.0 + 0.0 * PRESSES}
    (both,) = _sessions(_run(PRESSES, **more))
    assert both.conditions.neighbour == pytest.approx(np.full(PRESSES.size, 0.1))
    (none,) = _sessions(_run(PRESSES, displacement_mm=PRESSES))
    assert none.conditions.neighbour is None


def test_at_the_full_rate_each_sample_is_of_the_nearest_thinned_one() -> None:
    run = _run(PRESSES)
    sessions = _sessions(run, factor=4)
    (fine,) = at_full_rate(sessions, [np.ones(PRESSES.size, dtype=bool)], SCALE, STANDARD)
    nearest = [min((k + 2) // 4, sessions[0].cycle.size - 1) for k in range(PRESSES.size)]
    assert list(fine.cycle) == list(sessions[0].cycle[nearest])
    assert list(fine.held_out) == list(sessions[0].held_out[nearest])
    assert fine.denoised is sessions[0].denoised
    assert fine.conditions.step_s == pytest.approx(STEP_S)


def test_a_window_is_of_three_samples_at_least_and_of_what_is_thinned() -> None:
    for factor, reach in ((1, 3), (3, 3), (5, 5)):
        (one,) = _sessions(_run(PRESSES), factor=factor)
        assert one.reading == pytest.approx(smoothed(PRESSES, kernel(reach), factor))


def test_what_lacks_in_more_than_three_tenths_of_a_window_is_not_used() -> None:
    lacking = np.ones(PRESSES.size, dtype=bool)
    lacking[[100, 300, 301]] = False
    (one,) = _sessions(_run(PRESSES), usable=[lacking])
    weights = kernel(3)  # a third in the middle, a quarter and a twelfth beside it
    lost = np.convolve(~lacking, weights, "same") >= 0.3
    assert list(np.flatnonzero(~one.usable)) == list(np.flatnonzero(lost))
    assert 2 <= np.count_nonzero(lost) <= 6


def test_held_out_recordings_are_held_out_whole() -> None:
    first, second = _sessions(_run(PRESSES), _run(PRESSES), held=[True, False])
    assert (first.held_out.all(), second.held_out.any()) == (True, False)
    assert (first.index, second.index) == (0, 1)


# -- the load's noise -------------------------------------------------------------------------------------------------
def test_noise_is_the_mean_square_of_third_differences_that_noise_reaches() -> None:
    rng = np.random.default_rng(1)
    signal = rng.standard_normal(400) + np.linspace(0.0, 50.0, 400)
    signal[200] += 300.0
    third = [abs(signal[k + 3] - 3.0 * signal[k + 2] + 3.0 * signal[k + 1] - signal[k]) for k in range(397)]
    scale = float(np.median(third)) / 0.674489750196
    most = norm.isf(0.5 * STANDARD.false_alarm / 397.0) * scale
    inside = [one**2 for one in third if one <= most]
    assert len(inside) == 393
    assert noise_sd(signal, STANDARD) == pytest.approx(math.sqrt(sum(inside) / 393.0 / 20.0))
    assert noise_sd(signal[:9], STANDARD) == 0.0
    assert noise_sd(signal[:10], STANDARD) > 0.0


def _best_line(load: Array, step_s: float, sd: float) -> tuple[Array, float]:
    """The line of the least leverage of nine whose rest is noise, sample by sample."""
    variance, best = np.ones(load.size), load.copy()
    for share in (1.0, 0.5, 0.25):
        half = max(round(share * 0.1 / step_s), 3)
        for first in (-half, -2 * half, 0):
            k = np.arange(first, first + 2 * half + 1)
            bound = sd**2 * (1.0 + norm.isf(0.5 * STANDARD.false_alarm) * math.sqrt(2.0 / (k.size - 2)))
            design = np.column_stack([np.ones(k.size), k])
            leverage = float(np.linalg.inv(design.T @ design)[0, 0])
            for at in range(load.size):
                if at + first < 0 or at + k[-1] >= load.size:
                    continue
                near = load[at + k]
                fitted = np.linalg.lstsq(design, near, rcond=None)[0]
                left = float(np.sum((near - design @ fitted) ** 2)) / (k.size - 2)
                if left <= bound and leverage < variance[at]:
                    best[at], variance[at] = fitted[0], leverage
    return best, sd * math.sqrt(float(variance.mean()))


@pytest.mark.parametrize("step_s", [0.004, 0.02, 0.1])
def test_each_sample_is_of_the_longest_line_that_leaves_noise(step_s: float) -> None:
    load = 3.0 + course((30, 0.0), (25, 1.0), (20, 1.0), (25, 0.0), (20, 0.0))
    noisy = load + 0.003 * np.random.default_rng(4).standard_normal(load.size)
    found, expected = without_noise(noisy, step_s, 0.003, STANDARD), _best_line(noisy, step_s, 0.003)
    assert found[0] == pytest.approx(expected[0], abs=1e-9)
    assert found[1] == pytest.approx(expected[1])


@pytest.mark.parametrize("half", [100, 200, 1000])
def test_lines_through_many_neighbours_are_those_of_plain_sums(half: int) -> None:
    """At 10 kHz a tenth of a second either way is a thousand samples."""
    signal = course((900, 0.0), (1500, 1.0), (700, 1.0)) - 0.4 + 1e-4 * np.random.default_rng(5).standard_normal(3101)
    mean, slope, left, spread = _lines(signal, half)
    k = np.arange(-half, half + 1.0)
    windows = np.lib.stride_tricks.sliding_window_view(signal, k.size)
    assert mean == pytest.approx(windows.mean(axis=1), abs=1e-13)
    assert spread == pytest.approx(float(k @ k))
    assert slope == pytest.approx(windows @ k / spread, abs=1e-15)
    rest = windows - windows.mean(axis=1, keepdims=True) - np.outer(windows @ k / spread, k)
    assert left == pytest.approx(np.sum(rest**2, axis=1) / (k.size - 2), abs=1e-13)


def test_a_short_load_is_left_as_it_is() -> None:
    load = 1.0 + 0.01 * np.random.default_rng(2).standard_normal(100)
    assert without_noise(load[:99], STEP_S, 0.01, STANDARD)[1] == 0.01
    assert without_noise(load[:99], STEP_S, 0.01, STANDARD)[0] == pytest.approx(load[:99])
    assert without_noise(load, STEP_S, 0.01, STANDARD)[1] < 0.01
