"""One of several recordings whose reading is late by a tenth of a second is told by what the others foretell of it."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.hidden.recordings import HiddenCase, hide
from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._aligned import Aligned, aligned
from smartshoe.integrity import Integrity, OneClock, examine
from smartshoe.integrity._clocks import UNSEEN, Lags, align, from_two_clocks
from smartshoe.integrity._examination import _view
from smartshoe.integrity._own_clocks import Alone, Clocks, clocks_of
from smartshoe.integrity._relative_lags import NO_LAG, increments_of, own_clock, own_lags_s, refined_clock
from smartshoe.integrity._view import UNKNOWN_ENDS
from smartshoe.signals.lags import lagged

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.01


def _run(
    late_s: float, seed: int, *, sign: float = 1.0, noise: float = 0.1, rate: float = 0.0, cycles: int = 20
) -> Recording:
    """Ramps of several rates; a third of the reading follows slowly. It is late by ``late_s``, and ``rate`` s a s."""
    rng = np.random.default_rng(seed)
    lasts_s = np.repeat(rng.uniform(0.3, 3.0, cycles), 2)
    corners_s = np.concatenate([[0.0, 2.0], 2.0 + np.cumsum(lasts_s)])
    loads = np.concatenate([[0.0, 0.0], np.ravel([[height, 0.0] for height in rng.uniform(0.5, 1.0, cycles)])])
    time_s = np.arange(0.0, corners_s[-1] + 2.0, STEP_S)
    load = np.interp(time_s, corners_s, loads)
    read = np.interp(time_s - late_s - rate * time_s, corners_s, loads)
    keep = np.exp(-STEP_S / 2.0)
    read = 0.7 * read + 0.3 * lfilter([1.0 - keep], [1.0, -keep], read)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load,
        pressure_mbar=sign * 100.0 * read + noise * rng.standard_normal(load.size),
        name=f"run_{seed}",
    )


def _lags_s(
    *runs: Recording,
    lags: tuple[Lags, ...] | None = None,
    told_s: dict[int, float] | None = None,
    fitted: int | None = None,
    shared: OneClock | None = None,
) -> dict[int, float]:
    count = len(runs) if fitted is None else fitted
    compared = increments_of(runs, [one.sensor.present for one in runs], count, STANDARD)
    fitted_ones = {place: run for place, run in compared.items() if place < count}
    found = own_lags_s(fitted_ones, lags or (UNSEEN,) * len(runs), STANDARD, told_s or {}, shared)
    for place, run in compared.items():
        if place >= count and fitted_ones:
            by = own_clock(run, [*fitted_ones.values()], STANDARD, 0.0, NO_LAG, None)
            found |= {} if by is None else {place: by.before_s}
    return found


@pytest.mark.parametrize("late_s", [-0.15, -0.1, 0.1, 0.15])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_one_that_is_late_is_told_by_how_much(late_s: float, sign: float) -> None:
    runs = [_run(late_s if seed == 2 else 0.0, seed, sign=sign) for seed in range(4)]
    assert _lags_s(*runs) == {2: pytest.approx(late_s, abs=0.01)}


def test_two_that_are_late_are_told_each() -> None:
    runs = [_run(lag_s, seed) for seed, lag_s in enumerate((0.0, 0.12, 0.0, 0.0, -0.12, 0.0))]
    assert _lags_s(*runs) == {1: pytest.approx(0.12, abs=0.03), 4: pytest.approx(-0.12, abs=0.03)}


def test_of_two_recordings_it_is_the_one_with_the_longer_lag_of_its_own() -> None:
    runs = _run(0.1, 1), _run(0.0, 2)
    for lags, found in (((0.02, 0.01), {0: 0.1}), ((0.01, 0.02), {1: -0.1})):
        own = tuple(Lags(np.ones(1), np.array([one])) for one in lags)
        assert _lags_s(*runs, lags=own) == {place: pytest.approx(lag, abs=0.01) for place, lag in found.items()}


def test_what_all_recordings_share_and_what_a_logger_delays_is_of_no_clock() -> None:
    assert _lags_s(_run(0.1, 1), _run(0.1, 2)) == {}
    assert _lags_s(_run(0.0, 1), _run(0.03, 2)) == {}
    assert _lags_s(_run(0.1, 1)) == {}
    assert _lags_s(_run(0.0, 1), _run(0.1, 2).taken(slice(0, 50))) == {}


def _ends_softly(share: Array) -> Array:
    return np.asarray(share / (1.0 + np.abs(share / 0.92) ** 30) ** (1.0 / 30.0))


def _begins_late(share: Array) -> Array:
    return np.asarray(np.maximum(share - 0.06, 0.0) ** 1.3)


def _bent(corners_s: list[float], loads: list[float], curve: Callable[[Array], Array], name: str) -> Recording:
    """A line between corners at 500 Hz, of which a third follows within a tenth of a second, behind a curve."""
    time_s = np.arange(0.0, corners_s[-1] + 1.0, 0.002)
    load = np.interp(time_s, corners_s, loads)
    keep = np.exp(-0.002 / 0.1)
    read = 100.0 * curve(0.7 * load + 0.3 * lfilter([1.0 - keep], [1.0, -keep], load))
    noisy = read + 0.02 * np.random.default_rng(len(name)).standard_normal(load.size)
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=noisy, name=name)


@pytest.mark.parametrize("curve", [_ends_softly, _begins_late])
def test_two_recordings_of_a_bent_unit_have_one_clock(curve: Callable[[Array], Array]) -> None:
    """What slow ramps foretell of quick steps is late where a curve bends: one unit follows both best without a lag."""
    lasts_s = np.repeat([5.0, 2.5], 6)
    ramps = _bent([0.0, 1.0, *(1.0 + np.cumsum(lasts_s))], [0.0, 0.0, *[1.0, 0.0] * 6], curve, "ramps")
    levels = np.repeat([0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0], 2)
    steps = _bent([0.0, 1.0, *(1.0 + np.cumsum([0.1, 2.0] * 8))], [0.0, 0.0, *levels], curve, "steps")
    assert _lags_s(ramps, steps) == {}


def test_loads_of_a_few_percent_about_one_that_stands_tell_as_much() -> None:
    runs = [_run(lag_s, seed) for seed, lag_s in ((1, 0.0), (2, 0.1), (3, 0.0))]
    small = [one.with_channel(one.load.with_values(800.0 + 0.02 * one.load.values)) for one in runs]
    assert _lags_s(*small) == {1: pytest.approx(0.1, abs=0.01)}
    still = [one.with_channel(one.load.with_values(np.full(len(one), 5.0))) for one in runs]
    assert _lags_s(*still) == {}


def test_nor_is_a_lag_that_does_not_foretell_far_better() -> None:
    """Noise hides it."""
    assert _lags_s(_run(0.0, 1, noise=20.0), _run(0.1, 2, noise=20.0)) == {}


def _late(recording: Recording, by_s: float) -> Recording:
    time_s, sensor = recording.time_s, recording.sensor
    return recording.with_channel(sensor.with_values(np.interp(time_s - by_s, time_s, sensor.with_nan())))


def test_lags_of_one_pair_of_clocks_that_part_are_not_those_of_one_recording() -> None:
    """The longer a recording, the later it is: moved by a lag of its own it is foretold no better than by the clock."""
    rate = 0.002
    runs = [_run(0.0, seed, rate=rate, cycles=cycles) for seed, cycles in enumerate((30, 6, 6, 6))]
    assert _lags_s(*runs) == {0: pytest.approx(0.064, abs=0.01)}
    assert _lags_s(*runs, shared=OneClock(0.0, rate)) == {}
    late = [_run(0.15 if seed == 2 else 0.0, seed) for seed in range(4)]
    assert list(_lags_s(*late, shared=OneClock(0.0, rate))) == [2]


@cache
def _sound(protocol: str) -> HiddenCase:
    return hide({}, protocol=protocol, seed=12, recordings=2)


@pytest.mark.parametrize("protocol", ["rates", "walking", "holds", "staircase", "shuffled", "step", "minor_loops"])
@pytest.mark.parametrize("by_s", [0.0, 0.1, pytest.param(-0.1, marks=pytest.mark.long)])
def test_sound_units_are_told_two_clocks_where_there_are_two(protocol: str, by_s: float) -> None:
    case = _sound(protocol)
    found = examine([case.recordings[0], _late(case.recordings[1], by_s), *case.hold_out], STANDARD)
    assert found.clock_offset_s == pytest.approx((0.0, by_s, 0.0), abs=0.02)
    told = [(fault.kind, fault.recording) for fault in found.faults if fault.kind == "two_clocks"]
    assert told == ([("two_clocks", 1)] if by_s else [])


@pytest.mark.parametrize("protocol", [pytest.param("walking", marks=pytest.mark.long), "staircase"])
def test_a_sound_unit_of_which_one_recording_is_late_is_as_good_as_another(protocol: str) -> None:
    case = _sound(protocol)
    found = diagnose([_late(case.recordings[0], 0.1), case.recordings[1]], case.hold_out)
    assert (found.verdict, found.causes) == ("adequate", ())
    (said,) = [fault.says for fault in found.data_faults if fault.kind == "two_clocks"]
    assert "the reading is 0.10 s late, more than in the other recordings" in said
    assert ": the reading lags the load by 0.09" in found.limits[0]
    assert "was shifted to the load's clock before anything else" in found.limits[0]


@pytest.mark.parametrize("late_s", [-1.0, -0.3, 0.3, 1.0])
def test_a_lag_that_a_recording_tells_alone_is_refined_by_what_the_others_foretell(late_s: float) -> None:
    """What it tells alone is longer by what its unit relaxes."""
    found = examine([_run(late_s if seed == 2 else 0.0, seed) for seed in range(3)], STANDARD)
    assert found.clock_offset_s == pytest.approx((0.0, 0.0, late_s), abs=0.003)
    assert found.one_clock is None
    (fault,) = found.faults
    assert (fault.kind, fault.recording) == ("two_clocks", 2)
    assert "more than in the other recordings" in fault.says


def test_of_several_that_tell_lags_each_is_refined_by_those_that_are_in_time() -> None:
    found = examine([_run(lag_s, seed) for seed, lag_s in enumerate((0.3, 0.0, -0.6, 0.15, 0.0))], STANDARD)
    assert found.clock_offset_s == pytest.approx((0.3, 0.0, -0.6, 0.15, 0.0), abs=0.01)


def test_where_all_tell_lags_the_shortest_is_taken_as_told_and_the_others_lie_beside_it() -> None:
    found = examine([_run(lag_s, seed) for seed, lag_s in enumerate((1.2, 0.3, -0.7))], STANDARD)
    first, shortest, last = found.clock_offset_s
    assert (first - shortest, shortest, last - shortest) == pytest.approx((0.9, 0.3, -1.0), abs=0.1)
    off = {
        k: lag for k, lag in _lags_s(*found.recordings, told_s=dict(enumerate((1.25, 0.3, -0.65)))).items() if k != 1
    }
    assert off == {0: pytest.approx(1.2, abs=0.01), 2: pytest.approx(-0.7, abs=0.01)}


# -- what is held out -------------------------------------------------------------------------------------------------
@cache
def _three(late_s: float) -> tuple[list[Recording], Integrity]:
    """Three that are late by as much, and what is found of them alone."""
    fitted = [_run(late_s, seed) for seed in range(3)]
    return fitted, examine(fitted, STANDARD)


@pytest.mark.parametrize("late_s", [0.0, 0.5])
@pytest.mark.parametrize(
    "beside_s", [-0.5, 0.0, 0.1, 0.15, *(pytest.param(beside_s, marks=pytest.mark.long) for beside_s in (0.5, 2.0))]
)
def test_what_is_held_out_decides_nothing_of_the_clocks_of_those_that_are_fitted(
    late_s: float, beside_s: float
) -> None:
    fitted, alone = _three(late_s)
    found = examine([*fitted, _run(late_s + beside_s, 7)], STANDARD, 3)
    assert (found.one_clock, found.clock_offset_s[:3]) == (alone.one_clock, alone.clock_offset_s)
    is_other = abs(beside_s) > 0.1 or (
        beside_s != 0.0 and late_s == 0.0
    )  # less than a quarter of a clock's lag is none
    assert found.others == (frozenset([3]) if is_other else frozenset())
    ready = aligned(found.recordings, found)
    assert [one.name for one, _ in ready.parts] == (["delay"] if late_s else [])
    assert ready.moved == found.others
    if found.others:
        (said,) = [one for one in ready.says if "those of the fitted recordings" in one]
        borne_s = float(ready.parts[0][1][0]) if late_s else 0.0
        by_s = float(re.findall(r" by ([0-9.]+) s", said)[0]) * (1.0 if " lags " in said else -1.0)
        assert borne_s + by_s == pytest.approx(late_s + beside_s + borne_s - late_s, abs=0.005)
        assert any(fault.kind == "two_clocks" and fault.recording == 3 for fault in found.faults)


def test_what_is_held_out_does_not_tell_of_two_fitted_recordings_which_is_late() -> None:
    fitted = [_run(0.1, 1), _run(0.0, 2)]
    judging = [_run(lag_s, seed) for seed, lag_s in ((3, 0.1), (4, 0.1))]
    alone, found = examine(fitted, STANDARD), examine([*fitted, *judging], STANDARD, 2)
    assert found.clock_offset_s[:2] == alone.clock_offset_s
    assert _lags_s(_run(0.0, 1), _run(0.1, 2), fitted=1) == {1: pytest.approx(0.1, abs=0.01)}


@pytest.mark.parametrize("late_s", [0.0, 0.5])
@pytest.mark.parametrize("is_short", [False, True])
def test_one_that_judges_and_drifts_by_itself_is_moved_by_what_it_tells(late_s: float, is_short: bool) -> None:
    """By what the fitted ones foretell about what it tells alone; where they foretell nothing, by that as it is."""
    runs = [_run(late_s, seed) for seed in range(2)] + [_run(0.1, 5, rate=0.01)]
    middle_s = 0.1 + 0.005 * runs[2].duration_s
    at_s = np.array([5.0, 15.0, 40.0])
    alone = [Alone(late_s, 0.0, Lags(at_s, np.full(3, late_s)))] * 2
    alone += [Alone(middle_s + 0.02, 0.009, Lags(at_s, 0.1 + 0.01 * at_s))]
    usable = [np.arange(len(one)) < (50 if one is runs[2] and is_short else len(one)) for one in runs]
    found = clocks_of(runs, usable, alone, 2, STANDARD)
    assert (found.shared, found.others) == (OneClock(late_s, 0.0), frozenset([2]))
    if is_short:
        assert (found.offsets_s, found.rates) == ((late_s, late_s, middle_s + 0.02), (0.0, 0.0, 0.009))
        assert found.own == {}
    else:
        assert found.offsets_s == (late_s, late_s, pytest.approx(middle_s, abs=0.006))
        assert found.rates == (0.0, 0.0, pytest.approx(0.01, rel=0.02))
    ready = _ready(runs, found, usable)
    assert ready.moved == {2}
    assert f"{abs(found.offsets_s[2] - late_s):.3g} s " in ready.says[0]
    assert f"by {found.rates[2]:.2g} s " in ready.says[0]


@pytest.mark.parametrize(
    ("offsets_s", "shared", "shift_s", "of_fitted"),
    [
        ((0.0, 0.0, 0.0), None, 0.02, True),
        ((0.03, 0.01, 0.015), None, 0.035, False),  # each is moved to its own load
        ((0.5, 0.5, 0.5), OneClock(0.5, 0.0), 0.02, True),  # a model bears what all share
        ((0.0, 0.0, 0.0), OneClock(0.5, 0.0), 0.02, True),  # too little to be told
    ],
)
def test_one_that_judges_is_moved_by_its_lag_relative_to_the_fitted_ones(
    offsets_s: tuple[float, ...], shared: OneClock | None, shift_s: float, of_fitted: bool
) -> None:
    runs = [_run(0.0, seed) for seed in range(3)]
    masks = tuple(np.ones(len(one), dtype=bool) for one in runs)
    before = Integrity(tuple(runs), (), masks, offsets_s, (0.0,) * 3, shared, ())
    after = before.with_judged_lags({2: 0.02})
    assert after.clock_offset_s[:2] == before.clock_offset_s[:2]
    assert after.one_clock == before.one_clock
    ready = aligned(runs, after)
    said = ready.says[-1]
    assert 2 in ready.moved
    assert f"by {shift_s:g} s" in said
    assert ("those of the fitted recordings" in said) == of_fitted
    again = aligned(runs, after.with_judged_lags({2: -0.03}))  # on top of the first
    assert f"by {abs(shift_s - 0.03):g} s" in again.says[-1]


def _ready(runs: list[Recording], found: Clocks, usable: list[NDArray[np.bool_]] | None = None) -> Aligned:
    masks = usable or [np.ones(len(one), dtype=bool) for one in runs]
    return aligned(
        runs, Integrity(tuple(runs), (), tuple(masks), found.offsets_s, found.rates, found.shared, (), found.others)
    )


def _clocks(runs: list[Recording], count: int) -> Clocks:
    """As `examine` finds them, with the rates."""
    alone = []
    for one in runs:
        view = _view(one, STANDARD, UNKNOWN_ENDS)
        assert view is not None
        view, seen = align(view)
        alone.append(Alone(view.offset_s, view.rate, seen))
    return clocks_of(runs, [one.sensor.present for one in runs], alone, count, STANDARD)


@pytest.mark.parametrize("rate", [0.003, -0.003, 0.0005, -0.0005])
@pytest.mark.parametrize("late_s", [0.0, 0.3])
@pytest.mark.parametrize("count", [1, 2])
def test_one_that_judges_and_is_in_time_does_not_go_by_clocks_of_the_fitted_that_part(
    rate: float, late_s: float, count: int
) -> None:
    """It is made as late as they are, moment by moment, so that the model that bears their clock reads it right."""
    fitted = [_run(late_s, seed, rate=rate, cycles=60) for seed in range(count)]
    runs = [*fitted, _run(0.0, 7, cycles=50)]
    found = _clocks(runs, count)
    assert found.others == {count}
    assert found.shared == OneClock(pytest.approx(late_s, abs=0.05), pytest.approx(rate, abs=5e-5))
    assert found.rates[count] == pytest.approx(0.0, abs=5e-5)
    ready = _ready(runs, found)
    moved, usable = ready.recordings[count], ready.usable[count]
    as_they = _run(late_s, 7, rate=rate, cycles=50)
    assert np.std((moved.sensor.values - as_they.sensor.values)[usable]) < 0.5
    assert np.std(runs[count].sensor.values - as_they.sensor.values) > 1.0


@pytest.mark.parametrize("rate", [0.003, 0.0005])
def test_one_that_judges_and_parts_as_the_fitted_do_goes_by_their_clock(rate: float) -> None:
    runs = [_run(0.0, seed, rate=rate, cycles=60) for seed in range(3)]
    found = _clocks(runs, 2)
    assert (found.others, found.own) == (frozenset(), {})


@pytest.mark.parametrize("rate", [0.003, -0.0006])
def test_one_that_judges_and_parts_slowly_from_its_load_is_told_by_how_much(rate: float) -> None:
    """By a tenth of a second in three minutes, too little to be told alone."""
    runs = [*(_run(0.0, seed, cycles=60) for seed in range(2)), _run(0.0, 7, rate=rate, cycles=50)]
    found = _clocks(runs, 2)
    assert found.others == {2}
    assert found.rates == (0.0, 0.0, pytest.approx(rate, rel=0.03))
    assert found.offsets_s[2] == pytest.approx(0.5 * rate * runs[2].duration_s, abs=0.003)
    assert "s at the end" in from_two_clocks(runs[2], found.own[2], "").says


def test_a_rate_is_told_in_the_place_of_a_delay_only_where_one_unit_follows_far_better_by_it() -> None:
    at_s = np.array([120.0, 150.0, 180.0])
    for rate in (0.003, 0.0):
        run = _run(0.4 - 150.0 * rate, 3, rate=rate, cycles=60)
        seen = [Lags(at_s, 0.4 + 0.9 * rate * (at_s - 150.0))]
        compared = [*increments_of([run], [run.sensor.present], 1, STANDARD).values()]
        plain = OneClock(0.4, 0.0)
        found = refined_clock(plain, seen, compared, STANDARD)
        assert found == (OneClock(pytest.approx(-0.05, abs=0.02), pytest.approx(0.003, rel=0.02)) if rate else plain)
        assert refined_clock(plain, seen, [], STANDARD) == plain


@pytest.mark.parametrize("knee", [0.06, 0.1])
def test_steps_that_judge_ramps_of_a_bent_unit_are_in_time(knee: float) -> None:
    """Nor is what is judged moved by a lag by which one unit follows all of them no better."""
    lasts_s, levels = np.repeat([5.0, 2.5], 6), np.repeat([0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0], 2)

    def curve(share: Array) -> Array:
        return np.asarray(np.maximum(share - knee, 0.0))

    ramps = _bent([0.0, 1.0, *(1.0 + np.cumsum(lasts_s))], [0.0, 0.0, *[1.0, 0.0] * 6], curve, "ramps")
    steps = _bent([0.0, 1.0, *(1.0 + np.cumsum([0.1, 2.0] * 8))], [0.0, 0.0, *levels], curve, "steps")
    assert examine([ramps, steps], STANDARD, 1).others == frozenset()


def test_one_that_judges_and_tells_a_lag_goes_by_the_fitted_ones_clock_where_its_own_is_no_better() -> None:
    """What a unit relaxes by is no lag of a clock: the fitted ones tell 0.66 s, and it tells 0.56 s of as many."""
    case = hide({"second_relaxation": 2.0}, protocol="rates", seed=43, recordings=2)
    late = [_late(one, 0.5) for one in (*case.recordings, *case.hold_out)]
    assert examine(late[2:], STANDARD).clock_offset_s[0] > 0.3
    found = examine(late, STANDARD, 2)
    assert found.others == frozenset()
    assert aligned(found.recordings, found).moved == frozenset()


# -- long ones --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("lasts_s", [2.0, 8.0, 30.0])
def test_beside_a_day_a_few_seconds_tell_nothing_of_moments(lasts_s: float) -> None:
    time_s = np.arange(0.0, 86400.0)
    load = 400.0 * (1.0 - np.cos(2.0 * np.pi * time_s / 1800.0))
    day = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.1 * load, name="day")
    short = _run(0.1, 1).taken(slice(0, round(lasts_s / STEP_S)))
    assert _lags_s(day, short) == {}
    assert _lags_s(short, day) == {}
    # One that judges is asked by its beginning.
    assert set(_lags_s(_run(0.0, 2), day, fitted=1)) <= {1}


def test_a_day_without_samples_in_a_recording_is_no_matter() -> None:
    run = _run(0.0, 1)
    gap = Recording.from_arrays(
        time_s=np.where(np.arange(len(run)) < len(run) // 2, run.time_s, run.time_s + 2e5),
        force_n=run.force_n,
        pressure_mbar=run.sensor.values,
        name="gap",
    )
    assert _lags_s(gap, _run(0.0, 2), _run(0.0, 3)) == {}


# -- large numbers ----------------------------------------------------------------------------------------------------
def _one_late() -> list[Recording]:
    return [_run(lag_s, seed) for seed, lag_s in ((1, 0.0), (2, 0.1), (3, 0.0))]


@cache
def _usual_lags_s(last: int | None) -> tuple[float, ...]:
    """Of those up to the ``last`` sample of each, in the usual units."""
    return examine([one.taken(slice(0, last)) for one in _one_late()], STANDARD).clock_offset_s


@pytest.mark.parametrize("size", [1e-60, 1e60])
@pytest.mark.parametrize("of_load", [False, True])
@pytest.mark.filterwarnings("error")
def test_numbers_of_any_size_tell_the_same(size: float, of_load: bool) -> None:
    large = []
    for one in _one_late():
        channel = one.load if of_load else one.sensor
        large.append(one.with_channel(channel.with_values(size * channel.values)))
    for last in (None, 300):
        found = examine([one.taken(slice(0, last)) for one in large], STANDARD)
        assert found.refusals == ()
        assert found.clock_offset_s == pytest.approx(_usual_lags_s(last), abs=1e-6)


@pytest.mark.filterwarnings("error")
def test_a_reading_of_large_numbers_is_as_good_as_another() -> None:
    runs = [_run(0.0, seed) for seed in (1, 2)]
    large = [one.with_channel(one.sensor.with_values(1e60 * one.sensor.values)) for one in runs]
    plain, found = diagnose(runs), diagnose(large)
    assert found.verdict == plain.verdict
    assert [one.name for one in found.causes] == [one.name for one in plain.causes]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e80, 1e150])
def test_numbers_whose_squares_are_none_are_refused(size: float) -> None:
    run = _run(0.0, 1)
    (said,) = examine([run.with_channel(run.sensor.with_values(size * run.sensor.values))], STANDARD).refusals
    assert "which are no measurements: give another unit" in said


def _late_unit(seed: int, name: str) -> Recording:
    """A random load of 150 s, and what follows it four samples late, lags, and wanders."""
    rng = np.random.default_rng(seed)
    drawn = lfilter([1.0], [1.0, -np.exp(-1.0 / 8.0)], rng.standard_normal(420))[200:]
    drawn = lfilter([0.5], [1.0, -0.5], drawn)
    load_n = 30.0 + 10.0 * drawn / np.std(drawn)
    late = np.concatenate([np.full(4, load_n[0]), load_n[:-4]])
    wander = 0.12 * np.cumsum(rng.standard_normal(late.size)) + 0.05 * rng.standard_normal(late.size)
    time_s = 0.7 * np.arange(load_n.size)
    return Recording.from_arrays(
        time_s=time_s, force_n=load_n, pressure_mbar=0.4 * lagged(late, 1.0, 3.0) + wander, name=name
    )


@pytest.mark.parametrize("seed", [0, 6, 23, 54, 55])
def test_a_lag_that_only_one_that_judges_tells_is_the_units_where_the_fitted_one_has_it_too(seed: int) -> None:
    """The edges of the fitted one show that lag as well, though not for certain: one logger made both."""
    fitted, judging = _late_unit(2 * seed, "fitted"), _late_unit(2 * seed + 1, "judging")
    assert examine([judging]).clock_offset_s[0] == pytest.approx(4.0, abs=0.4)
    found = examine([fitted, judging], count=1)
    assert (found.clock_offset_s, found.clock_rate, found.others) == ((0.0, 0.0), (0.0, 0.0), frozenset())
    assert [fault.kind for fault in found.faults] == []
    # One that is late by another two seconds is told to be.
    later = _late(judging, 2.1)
    assert examine([fitted, later], count=1).clock_offset_s[1] > 1.0


def _stiffened(corners: list[tuple[float, float]], name: str) -> Recording:
    """A unit that reads a few percent more while its load is fast (asinh of the rate), by one clock."""
    time_s = np.arange(0.0, corners[-1][0], STEP_S)
    load = np.interp(time_s, *zip(*corners, strict=True))
    felt = load * (1.0 + 0.02 * np.arcsinh(np.abs(np.gradient(load, STEP_S)) / 0.05) / np.arcsinh(20.0))
    keep = np.exp(-STEP_S / 2.0)
    read = 0.8 * felt + 0.2 * (lfilter([1.0 - keep], [1.0, -keep], felt - felt[0]) + felt[0])
    read += 5e-4 * np.random.default_rng(len(name)).standard_normal(load.size)
    return Recording.from_arrays(time_s=time_s, force_n=30.0 * load, pressure_v=0.5 + 3.2 * read, name=name)


def _stairs(start: float, levels: tuple[float, ...]) -> list[tuple[float, float]]:
    corners, at_s = [(0.0, start), (3.0, start)], 3.0
    for level in (*levels, start):
        corners += [(at_s + 0.5, level), (at_s + 10.5, level)]
        at_s += 10.5
    return corners


@pytest.mark.parametrize("start", [0.4, 0.5])
def test_two_edges_tell_no_line_of_lags(start: float) -> None:
    """A line goes through any two, and a short staircase has no more each way: it was moved by 4 ms a second."""
    waves = [(0.0, 0.3), *((3.0 + 3.0 * k, 0.9 if k % 2 else 0.3) for k in range(16))]
    fitted = [_stiffened(_stairs(0.5, (0.8, 0.4, 1.0, 0.3, 0.6)), "stairs"), _stiffened(waves, "waves")]
    short = _stiffened(_stairs(start, (0.9, 0.5)), "short")
    found = examine([*fitted, short], STANDARD, 2)
    assert found.clock_rate[2] == 0.0
    assert not [one for one in found.faults if one.kind == "two_clocks"]
