"""Recordings made ready, what an experiment shows and what is proposed next, against what is known beforehand."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from test_diagnosis_parts import MODEL, likelihood_of, recording, sessions_of

from smartshoe import Protocol, Recording
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._arms import arms_of, effect_count, with_another_pole, with_arm
from smartshoe.diagnosis._denoise import _lines, noise_sd, without_noise
from smartshoe.diagnosis._excitation import Excitation, excitation_of
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis._jittered import jitter_s
from smartshoe.diagnosis._laws import _is_stretched
from smartshoe.diagnosis._likelihood import fit
from smartshoe.diagnosis._next_experiment import _channel, _in_place_of, _unseen
from smartshoe.diagnosis._parameters import parameters_of
from smartshoe.diagnosis._procedure import _without
from smartshoe.diagnosis._ranges import ranges_of
from smartshoe.diagnosis._sensitivity import available, nuisance_precision
from smartshoe.diagnosis._session import (
    Scale,
    Session,
    at_full_rate,
    full_scale,
    kernel,
    pastless,
    prepare,
    smoothed,
    thinning,
)
from smartshoe.diagnosis._state import state_at
from smartshoe.errors import NotIdentifiableError
from smartshoe.models.effects import effect
from smartshoe.models.elements import Arm
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.02


def _pressed(load: Array, reading: Array | None = None, step_s: float = STEP_S, **metadata: object) -> Recording:
    """``load`` and ``reading`` in full scales of 800 N and 140 mbar."""
    time_s = step_s * np.arange(load.size)
    shown = 140.0 * (load if reading is None else reading)
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=shown, metadata=metadata)


def _triangles(count: int = 8, period_s: float = 5.0, rest_s: float = 2.0, height: float = 1.0) -> Array:
    rest = np.zeros(round(rest_s / STEP_S))
    up = np.linspace(0.0, height, round(0.5 * period_s / STEP_S), endpoint=False)
    return np.concatenate([rest, *([up, up[::-1], rest] * count)])


def _prepared(*runs: Recording, factor: int = 1, held: list[bool] | None = None) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in runs]
    scale = full_scale(runs, usable, STANDARD)
    return prepare(runs, usable, held, scale, factor, STANDARD), scale


# -- scale --------------------------------------------------------------------------------------------------------
def test_full_scale_is_the_largest_load_and_the_largest_span_of_one_recording() -> None:
    load = _triangles()
    low, high = _pressed(0.5 * load, 0.5 * load + 3.0), _pressed(load, load - 2.0)
    usable = [one.sensor.present for one in (low, high)]
    scale = full_scale([low, high], usable, STANDARD)
    assert scale.load_n == pytest.approx(800.0, rel=0.01)
    assert scale.reading == pytest.approx(140.0, rel=0.01)
    assert (scale.unit, scale.zero) == (MILLIBAR, 0.0)
    falling = full_scale([_pressed(load, 5.0 - load)], usable[:1], STANDARD)
    assert falling.reading == pytest.approx(-140.0, rel=0.01)
    assert falling.share(np.array([-280.0])) == pytest.approx(2.0, rel=0.01)


def test_a_spike_and_what_is_not_usable_count_for_nothing() -> None:
    load = _triangles()
    spiked = load.copy()
    spiked[[100, 900]] = 30.0
    one = _pressed(spiked, spiked)
    assert full_scale([one], [one.sensor.present], STANDARD).load_n == pytest.approx(800.0, rel=0.01)
    half = one.time_s < 12.0
    lower = _pressed(np.where(half, 0.4 * load, load))
    assert full_scale([lower], [np.asarray(half)], STANDARD).load_n == pytest.approx(320.0, rel=0.01)
    nothing = _pressed(0.0 * load, load)
    with pytest.raises(NotIdentifiableError, match="never leaves zero"):
        full_scale([nothing], [nothing.sensor.present], STANDARD)


def test_the_zero_of_a_reading_that_is_no_pressure_is_its_median_at_the_lowest_load() -> None:
    load = _triangles()
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
    factor = thinning([run], Scale(800.0, 140.0, MILLIBAR))
    assert 20 <= 0.8 * ramp_s * rate_hz / factor < 32
    slower = Recording.from_arrays(time_s=2.0 * time_s, force_n=800.0 * load, pressure_mbar=140.0 * load)
    assert thinning([run, slower], Scale(800.0, 140.0, MILLIBAR)) == factor  # that of the fastest


def test_a_long_recording_is_thinned_further_and_a_short_one_not_at_all() -> None:
    scale = Scale(800.0, 140.0, MILLIBAR)
    long = _triangles(400, 2.0, 1.0)
    factor = thinning([_pressed(long)], scale)
    shape = thinning([_pressed(long[:2000])], scale)
    assert factor > shape
    assert long.size / factor < 1.05 * max(12_000, long.size / (6 * shape))
    assert thinning([_pressed(np.linspace(0.0, 1.0, 4))], scale) == 1


# -- sessions -----------------------------------------------------------------------------------------------------
def test_a_session_is_in_shares_of_full_scale_on_its_own_clock() -> None:
    load = _triangles()
    run = _pressed(load, 0.9 * load)
    later = replace(run, time_s=run.time_s + 50.0)
    (session,), scale = _prepared(later)
    at = session.conditions
    assert (at.time_s[0], at.step_s, session.thinned) == (0.0, pytest.approx(STEP_S), 1)
    assert session.reading == pytest.approx(smoothed(0.9 * load * 140.0 / scale.reading, kernel(3), 1), abs=1e-9)
    assert at.load.max() == pytest.approx(1.0, abs=0.03)
    assert session.usable.all()
    assert session.resting == pytest.approx(at.load < STANDARD.standing)
    (thin,), _ = _prepared(later, factor=4)
    assert thin.conditions.step_s == pytest.approx(4 * STEP_S)
    assert thin.conditions.time_s == pytest.approx(at.time_s[::4])
    assert thin.conditions.load == pytest.approx(at.load[::4], abs=0.02)


def test_what_lacks_is_bridged_and_not_used() -> None:
    load = _triangles()
    reading = load.copy()
    lost = slice(700, 760)
    reading[lost] = np.nan
    (session,), _ = _prepared(_pressed(load, reading))
    assert np.isfinite(session.reading).all()
    assert not session.usable[705:755].any()
    assert np.count_nonzero(~session.usable) == pytest.approx(60, abs=6)
    fewer = replace(_pressed(load).load, missing=None)
    assert fewer.present.all()


def test_cycles_are_counted_from_foot_to_foot_and_every_third_is_held_out_across_recordings() -> None:
    load = _triangles(8)
    sessions, _ = _prepared(_pressed(load), _pressed(load))
    for session in sessions:
        rises = np.flatnonzero((session.conditions.load[1:] > 0.06) & (session.conditions.load[:-1] <= 0.06))
        assert session.cycle[rises + 1] == pytest.approx(np.arange(8))
        changes = np.flatnonzero(np.diff(session.cycle))
        assert np.abs(changes - rises[1:]).max() < 12  # it begins as the load leaves the rest
    whole = np.concatenate([sessions[0].cycle, 8 + sessions[1].cycle])
    held = np.concatenate([session.held_out for session in sessions])
    assert held == pytest.approx(whole % 3 == 2)


def test_too_few_cycles_make_parts_of_equal_time() -> None:
    (session,), _ = _prepared(_pressed(_triangles(3)))
    counts = np.bincount(session.cycle)
    assert counts.size >= 10
    assert np.ptp(counts) <= 1
    assert (np.diff(session.cycle) >= 0).all()


def test_at_the_full_rate_cycles_and_what_is_held_out_are_where_they_were() -> None:
    run = _pressed(_triangles(9))
    sessions, scale = _prepared(run, factor=5)
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
    load = _triangles()
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
    (session,), _ = _prepared(run)
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


def test_other_channels_go_along(  # a temperature from its first value on, a neighbour in this unit's full scale
) -> None:
    load = _triangles()
    time_s = STEP_S * np.arange(load.size)
    run = Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load,
        pressure_mbar=140.0 * load,
        pressure_2_mbar=35.0 * load,
        temperature_k=300.0 + 0.1 * time_s,
    )
    (session,), scale = _prepared(run)
    at = session.conditions
    assert at.temperature_k is not None
    assert at.temperature_k[[0, -1]] == pytest.approx([0.0, 0.1 * time_s[-1]], abs=1e-6)
    assert at.neighbour is not None
    assert at.neighbour.max() == pytest.approx(35.0 / abs(scale.reading), rel=0.03)
    (plain,), _ = _prepared(_pressed(load))
    assert (plain.conditions.temperature_k, plain.conditions.neighbour) == (None, None)


def test_an_effect_is_looked_for_where_its_channel_is_logged_throughout() -> None:
    load = _triangles()
    time_s = STEP_S * np.arange(load.size)
    beside = Recording.from_arrays(
        time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * load, pressure_2_mbar=35.0 * load
    )
    alone, both = _prepared(_pressed(load))[0], _prepared(beside)[0]
    assert "cross_talk" not in {one.name for one in available(alone)}
    assert "cross_talk" in {one.name for one in available(both)}
    assert "cross_talk" not in {one.name for one in available([*alone, *both])}
    found = available(alone)
    assert all(one.is_physical and one.shifts is None and not one.is_refinement for one in found)
    assert {"delay", "linear_leak", "dead_band"} <= {one.name for one in found}


@pytest.mark.parametrize(("begun", "share"), [(0.0, 0.1), (0.5, 0.1), (0.5, 0.3)])
def test_what_an_arm_may_remember_is_its_share_of_what_the_unit_may_have_borne(begun: float, share: float) -> None:
    (session,), _ = _prepared(_pressed(begun + (1.0 - begun) * _triangles()))
    model = replace(MODEL, gain=1.5, relaxing_share=share)
    precision = nuisance_precision(session, model, STANDARD)
    held = 1.5 * share * max(float(session.conditions.load[0]), STANDARD.unknown_past)
    assert precision == pytest.approx(np.diag([0.0, held**-2]), rel=1e-6)


def test_a_later_recording_knows_the_load_that_went_before_and_the_one_after_it_all() -> None:
    load = _triangles(6)
    first, second, third = (_pressed(load) for _ in range(3))
    runs = [
        replace(first, name="a"),
        replace(second, name="b", metadata={"continues": "a"}),
        replace(third, name="c", metadata={"continues": "b"}),
    ]
    sessions, _ = _prepared(*runs)
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
        again, _ = _prepared(*(runs[k] for k in order))
        assert [one.conditions.before for one in again] == [before[k] for k in order]
        assert [one.recording.name for one in again] == [runs[k].name for k in order]
        assert [one.index for one in again] == [0, 1, 2]


def test_recordings_that_continue_each_other_are_taken_as_they_are_given() -> None:
    first, second = (_pressed(_triangles(6)) for _ in range(2))
    ring = [replace(first, name=one, metadata={"continues": other}) for one, other in (("a", "b"), ("b", "a"))]
    sessions, _ = _prepared(*ring)
    assert [bool(one.conditions.before) for one in sessions] == [False, True]
    (alone,), _ = _prepared(replace(second, name="a", metadata={"continues": "a"}))
    assert alone.conditions.before == {}


def test_a_recording_that_continues_one_that_is_not_given_says_so() -> None:
    load = _triangles(6)
    first, second = replace(_pressed(load), name="a"), replace(_pressed(load), name="b", metadata={"continues": "a"})
    assert (pastless([second, first]), pastless([second])) == ([], [second])
    said = "b continues a, which is not among the recordings: it is taken as the unit's first after a rest"
    assert any(one.startswith(said) for one in _without([second], 1, {}))
    assert not _without([second, first], 2, {})
    itself = replace(second, name="a")
    assert pastless([itself]) == [itself]


def test_a_load_cells_noise_is_taken_out_and_said() -> None:
    load = _triangles(8, rest_s=4.0)
    noise = 2e-3 * np.random.default_rng(1).standard_normal(load.size)
    noisy, plain = _prepared(_pressed(load + noise, load))[0][0], _prepared(_pressed(load))[0][0]
    assert noisy.quiet.raw == pytest.approx(2e-3, rel=0.1)
    assert noisy.quiet.left < 0.6 * noisy.quiet.raw
    off = noisy.conditions.load - plain.conditions.load
    loaded = plain.conditions.load > 0.1
    assert np.std(off[loaded]) < 0.5 * noisy.quiet.raw
    assert np.std(off[plain.resting]) < 0.7 * np.std(off[loaded])
    assert 0.0 < noisy.conditions.load_noise < noisy.quiet.left


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
    load = _triangles(30, rest_s=1.0)
    sd = 1e-3
    noisy = load + sd * np.random.default_rng(3).standard_normal(load.size)
    quiet, left = without_noise(noisy, STEP_S, sd, STANDARD)
    assert left < 0.7 * sd
    assert np.sqrt(np.mean((quiet - load) ** 2)) == pytest.approx(left, rel=0.25)
    same, none = without_noise(load, STEP_S, 0.0, STANDARD)
    assert same is load
    assert none == 0.0
    assert noise_sd(np.zeros(5), STANDARD) == 0.0


@pytest.mark.parametrize("period_s", [2.0, 5.0, 20.0])
def test_jitter_is_as_long_whatever_the_slope_that_shows_it(period_s: float) -> None:
    rng = np.random.default_rng(5)
    load = _triangles(round(100.0 / period_s), period_s, 0.5 * period_s)
    time_s = STEP_S * np.arange(load.size)
    early = time_s + 0.03 * rng.standard_normal(time_s.size)
    reading = np.interp(early, time_s, load) + 1e-4 * rng.standard_normal(time_s.size)
    assert jitter_s(load, reading, STEP_S) == pytest.approx(0.03, rel=0.25)
    assert jitter_s(np.zeros(load.size), reading, STEP_S) == 0.0


# -- what an experiment shows -------------------------------------------------------------------------------------
def _shown(load: Array, step_s: float = STEP_S) -> Excitation:
    return excitation_of(_prepared(_pressed(load, step_s=step_s))[0], STANDARD)


def _course(*corners: tuple[float, float]) -> Array:
    """A load that goes in a straight line for each (seconds, share)."""
    parts, at = [np.zeros(1)], 0.0
    for seconds, share in corners:
        parts.append(np.linspace(at, share, round(seconds / STEP_S) + 1)[1:])
        at = share
    return np.concatenate(parts)


RISE = ((2.0, 1.0), (2.0, 0.0), (2.0, 0.0))


@pytest.mark.parametrize(
    ("word", "without", "corners"),
    [
        ("rates", RISE * 3, RISE * 2 + ((6.0, 1.0), (6.0, 0.0), (2.0, 0.0)) * 2),
        ("peaks", RISE * 3, RISE * 2 + ((1.0, 0.5), (1.0, 0.0), (2.0, 0.0)) * 2),
        ("steps", RISE * 3, ((2.0, 0.0), (0.2, 1.0), (4.0, 1.0), (0.2, 0.0), (4.0, 0.0)) * 3),
        ("holds", RISE * 3, ((2.0, 1.0), (6.0, 1.0), (2.0, 0.0), (2.0, 0.0)) * 2),
        ("idle", RISE * 3, (*RISE, (90.0, 0.0), *RISE)),
        ("pauses", RISE * 4, (*RISE, (20.0, 0.0), *RISE, *RISE, *RISE)),
        ("repeats", ((2.0, 1.0), (2.0, 0.0), (2.0, 0.0), (9.0, 0.5), (2.0, 0.0), (2.0, 0.0)), RISE * 3),
        ("minor_loops", RISE * 3, (*RISE, (2.0, 1.0), (1.0, 0.5), (1.0, 1.0), (2.0, 0.0), (2.0, 0.0))),
        ("rests", ((2.0, 1.0), (2.0, 0.3)) * 4, RISE * 3),
    ],
)
def test_what_an_experiment_shows(
    word: str, without: tuple[tuple[float, float], ...], corners: tuple[tuple[float, float], ...]
) -> None:
    assert word not in _shown(_course((2.0, without[-1][1]), *without)).present
    assert word in _shown(_course((2.0, corners[-1][1]), *corners)).present


def test_rates_peaks_and_repeats_are_those_of_the_rises() -> None:
    found = _shown(_course((2.0, 0.0), *RISE * 3, *((4.0, 0.5), (4.0, 0.0), (2.0, 0.0)) * 2))
    assert found.rates_per_s == pytest.approx([0.125, 0.5], rel=0.05)
    assert found.peaks == pytest.approx([0.5, 1.0], abs=0.04)
    assert found.repeats == 3
    # A stray first ramp makes no second rate.
    many = _shown(_course((2.0, 0.0), (4.0, 1.0), (2.0, 0.0), (2.0, 0.0), *RISE * 8))
    assert many.rates_per_s == pytest.approx([0.5], rel=0.05)


def test_what_is_lacking_is_said_and_nothing_else() -> None:
    poor = _shown(_course((2.0, 0.3), (2.0, 1.0), (2.0, 0.3)))
    said = " | ".join(poor.limits())
    for words in ("one loading rate only", "no hold longer", "never seen unloaded", "no load cycle is repeated"):
        assert words in said
    rich = Excitation((0.1, 0.5), (0.5, 1.0), 3, frozenset({"holds", "rests", "repeats"}), STANDARD)
    assert rich.limits() == []
    assert len(replace(rich, peaks=(1.0,)).limits()) == 1
    assert "one peak load only" in replace(rich, peaks=(1.0,)).limits()[0]


# -- narrow ranges ------------------------------------------------------------------------------------------------
def _ranges(load: Array, reading: Array) -> Any:
    sessions, scale = _prepared(_pressed(load, reading))
    return ranges_of(sessions, scale, STANDARD)


def test_a_narrow_range_is_told_in_newtons_and_with_its_gain_both_ways() -> None:
    load = 0.7 + 0.2 * _triangles()
    (said,) = _ranges(load, 0.5 * load).says
    low, high = map(float, re.findall(r"\(([\d.]+) to ([\d.]+) N", said)[0])
    assert (low, high) == (pytest.approx(560.0, abs=3.0), pytest.approx(716.0, abs=6.0))
    gain, inverse = float(re.findall(r"by ([\d.]+) mbar/N", said)[0]), float(re.findall(r"\(([\d.]+) N/mbar", said)[0])
    assert gain == pytest.approx(0.5 * 140.0 / 800.0, rel=0.01)
    assert inverse == pytest.approx(800.0 / 70.0, rel=0.01)
    assert "extrapolated" in said
    trap = _ranges(load, 0.1 * load + 2.0)
    assert trap.is_trap
    through = float(re.findall(r"reading over load is ([\d.]+) mbar/N", trap.says[0])[0])
    assert through == pytest.approx(float(np.mean(0.1 * load + 2.0) / np.mean(load)) * 140.0 / 800.0, rel=0.02)


# -- parameters in units ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "values", "parameter", "expected", "unit"),
    [
        ("dead_band", (0.05, 0.2, 0.0), "lost_load", 0.05 * 600.0, "N"),
        ("sensor_nonlinearity", (0.02, 0.0, 0.0), "bow", 0.02 * 1.5 * -200.0, "mbar"),
        ("zero_drift", (1e-4, 0.0, 60.0), "drift_rate", 1e-4 * 1.5 * -200.0, "mbar/s"),
        ("zero_drift", (1e-4, 2e-3, 60.0), "temperature_coefficient", 2e-3 * 1.5 * -200.0, "mbar/K"),
        ("delay", (0.03,), "delay", 0.03, "s"),
    ],
)
def test_shares_of_full_scale_become_newtons_and_the_readings_unit(
    name: str, values: tuple[float, ...], parameter: str, expected: float, unit: str
) -> None:
    """What stands before the chain's gain comes out as many times as large, here of a reading that falls."""
    sessions, _ = _prepared(_pressed(_triangles()))
    conditions = [replace(one.conditions, temperature_k=one.conditions.time_s % 7.0) for one in sessions]
    sessions = [replace(one, conditions=logged) for one, logged in zip(sessions, conditions, strict=True)]
    model = replace(MODEL, gain=1.5).with_part(effect(name), np.array(values))
    found = parameters_of(fit(likelihood_of(sessions), model, 0), name, Scale(600.0, -200.0, MILLIBAR))
    assert set(found) == {one.name for one in effect(name).parameters}
    assert (found[parameter].value, found[parameter].unit) == (pytest.approx(expected), unit)


def test_an_interval_stays_within_what_is_possible() -> None:
    sessions, _ = sessions_of(recording(seed=1))
    model = MODEL.with_part(effect("linear_leak"), np.array([1e-7]))
    one = parameters_of(fit(likelihood_of(sessions), model, 0), "linear_leak", Scale(800.0, 140.0, MILLIBAR))
    leak = one["leak_rate"]
    assert leak.sd > 1e-7
    assert leak.ci95[0] == 0.0
    assert leak.ci95[1] == pytest.approx(leak.value + 1.96 * leak.sd, rel=1e-3)


# -- arms and laws ------------------------------------------------------------------------------------------------
def test_an_arm_of_an_effect_that_creeps_may_be_the_baselines() -> None:
    model = replace(MODEL, relaxing_share=-0.02).with_part(effect("second_relaxation"), np.array([0.1, 5.0]))
    model = model.with_part(effect("power_law_creep"), np.array([0.01, 0.2])).with_part("delay")
    ((name, arm),) = arms_of(model)
    assert (name, arm.share, arm.rate_per_s) == ("second_relaxation", pytest.approx(0.1), pytest.approx(0.2))
    assert effect_count(model) == 4  # one that falls in the place of a wall's arm is an effect
    assert effect_count(replace(model, relaxing_share=0.02)) == 3
    swapped = with_arm(model, Arm(0.3, 2.0))
    assert (swapped.relaxing_share, swapped.relaxation_rate_per_s) == (0.3, 2.0)
    assert swapped.names == model.names


def test_a_rate_that_an_effect_bent_is_found_anew_without_it() -> None:
    truth = replace(MODEL, relaxing_share=0.3, relaxation_rate_per_s=0.3)
    sessions, _ = _prepared(recording(truth, rates=(200, 800)), factor=6)
    likelihood = likelihood_of(sessions)
    bent = replace(truth, relaxing_share=0.02, relaxation_rate_per_s=20.0)
    start = fit(likelihood, bent.with_part(effect("second_relaxation"), np.array([0.3, 2.0])))
    state = state_at(start, sessions, STANDARD)
    found = with_another_pole(state, sessions)
    assert found.fit.model.relaxation_rate_per_s == pytest.approx(0.3, rel=0.05)
    assert found.fit.model.relaxing_share == pytest.approx(0.3, rel=0.05)
    assert found.fit.model.parts == ()


def test_a_shape_at_a_bound_is_stretched() -> None:
    law = effect("dead_band")
    for softness, is_stretched in ((0.2, False), (0.03, True), (1.0, False), (3.0, True)):
        assert _is_stretched(MODEL.with_part(law, np.array([0.05, softness, 0.1])), law) is is_stretched
    for onset, is_stretched in ((0.0, False), (1.5, True)):  # that it sets in at once is no stretch
        assert _is_stretched(MODEL.with_part(law, np.array([0.05, 0.2, onset])), law) is is_stretched
    # A strength at its bound is no shape, nor are another effect's.
    leak = effect("linear_leak")
    assert not _is_stretched(MODEL.with_part(leak, np.array([0.0])), leak)
    below = MODEL.with_part(effect("dead_band"), np.array([0.05, 0.03, 0.0]))
    assert not _is_stretched(below.with_part(leak, np.array([0.01])), leak)


# -- what to run next ---------------------------------------------------------------------------------------------
def _lacking(*words: str) -> Excitation:
    every = {"rates", "holds", "rests", "minor_loops", "peaks", "pauses", "steps"}
    return Excitation((0.1,), (1.0,), 1, frozenset(every - set(words)), STANDARD)


@pytest.mark.parametrize(
    ("word", "protocol"),
    [
        ("rates", "rates"),
        ("holds", "long_hold"),
        ("rests", "idle"),
        ("minor_loops", "minor_loops"),
        ("peaks", "shuffled_loads"),
        ("pauses", "pauses"),
        ("steps", "steps"),
    ],
)
def test_what_was_never_shown_is_run_next(word: str, protocol: str) -> None:
    found: Any = type("Found", (), {"fit": type("F", (), {"model": MODEL})})
    told = _unseen(found, (), _lacking(word))
    assert told.protocol == protocol
    assert told.steps is not None
    assert (told.steps.name, told.steps.peak_load_n) == (protocol, pytest.approx(800.0, rel=0.06))
    assert f"holds no {word.replace('_', ' ')}" in told.says
    assert _unseen(found, (), _lacking()).protocol == "repeat"
    # It shows what it is run for.
    step_s = 0.01 if word == "steps" else STEP_S
    load = told.steps.load_at(np.arange(0.0, told.steps.duration_s, step_s)) / 800.0
    assert word in _shown(load, step_s).present


@pytest.mark.parametrize(
    ("channel", "pair", "logged"),
    [
        ("temperature", ("gain_drift", "cycle_conditioning"), {"temperature_k": 300.0}),
        ("displacement", ("contact_area", "gas_compression"), {"displacement_mm": 1.0}),
    ],
)
def test_a_channel_that_tells_two_apart_is_asked_for_unless_it_is_logged(
    channel: str, pair: tuple[str, str], logged: dict[str, float]
) -> None:
    load = _triangles()
    plain, _ = _prepared(_pressed(load))
    assert _channel(*pair, plain) == channel
    assert _channel("delay", "sensor_lag", plain) is None
    columns = {name: value + 0.0 * load for name, value in logged.items()}
    more = Recording.from_arrays(
        time_s=STEP_S * np.arange(load.size), force_n=800.0 * load, pressure_mbar=140.0 * load, **columns
    )
    assert _channel(*pair, _prepared(more)[0]) is None


def test_a_rival_is_fitted_in_the_place_of_an_effect() -> None:
    truth = MODEL.with_part(effect("sensor_lag"), np.array([0.05, 0.0]))
    sessions, _ = sessions_of(recording(truth))
    likelihood = likelihood_of(sessions)
    found: Any = type("Found", (), {"fit": fit(likelihood, truth), "likelihood": likelihood})
    rival = _in_place_of(found, "sensor_lag", "delay")
    assert rival.model.names == ("delay",)
    assert rival.model.parts[0].values[0] == pytest.approx(0.05, rel=0.2)  # late by as much


# -- protocols ----------------------------------------------------------------------------------------------------
def _holds(protocol: Protocol, kind: str = "hold") -> list[tuple[float, float]]:
    found, at = [], 0.0
    for segment in protocol.segments:
        if segment.kind == kind or (kind == "hold" and segment.load_n == at > 0.0):
            found.append((segment.load_n, segment.duration_s))
        at = segment.load_n
    return found


def _peaks(protocol: Protocol) -> list[float]:
    loads = [0.0, *(segment.load_n for segment in protocol.segments if segment.kind == "ramp"), 0.0]
    return [b for a, b, c in zip(loads, loads[1:], loads[2:], strict=False) if a < b > c]


def _rates(protocol: Protocol) -> set[float]:
    """Of all ramps, full scales of 800 N a second."""
    found, at = set(), 0.0
    for segment in protocol.segments:
        if segment.kind == "ramp":
            found.add(round(abs(segment.load_n - at) / segment.duration_s / 800.0, 6))
        at = segment.load_n
    return found


def test_protocols_are_what_they_say() -> None:
    made = {name: make(800.0) for name, make in EXPERIMENTS.items()}
    assert _holds(made["long_hold"]) == [(600.0, 300.0)]
    assert max(seconds for _, seconds in _holds(made["long_hold"], "rest")) == 300.0
    assert _holds(made["holds_at_several_loads"]) == [(200.0, 90.0), (800.0, 90.0), (400.0, 90.0), (600.0, 90.0)]
    assert [s for _, s in _holds(made["holds_at_several_loads"], "rest") if s > 3.0] == [30.0] * 4
    assert _peaks(made["idle"]) == [800.0] * 6
    assert max(seconds for _, seconds in _holds(made["idle"], "rest")) == 600.0
    assert [s for _, s in _holds(made["pauses"], "rest") if s != 2.0] == [5.0, 120.0, 20.0, 300.0, 5.0]
    assert _peaks(made["pauses"]) == [800.0] * 15
    assert {seconds for _, seconds in _holds(made["steps"])} == {4.0}
    assert _rates(made["rates"]) == {0.0625, 0.125, 0.25, 0.5, 1.0}
    assert _peaks(made["rates"]) == [800.0] * 15
    assert _rates(made["minor_loops"]) == {0.1, 0.4}
    assert len(_rates(made["shuffled_loads"])) == 1
    assert _rates(made["long_hold"]) == {0.25, round(1 / 3, 6)}


def test_a_protocol_goes_with_its_load() -> None:
    """The same in time, and so many times the load."""
    for make in EXPERIMENTS.values():
        one, two = make(400.0), make(800.0)
        assert [s.duration_s for s in one.segments] == pytest.approx([s.duration_s for s in two.segments])
        assert [2.0 * s.load_n for s in one.segments] == pytest.approx([s.load_n for s in two.segments])
