"""Protocols as a machine runs them, corner by corner, and what rises of a load tell of rates, peaks and repeats."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from courses import course
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._excitation import (
    Excitation,
    _distinct,
    _distinct_rates,
    _held,
    _rises,
    excitation_of,
    rested,
)
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis._session import DenoisedLoad, Session
from smartshoe.models.effects import Conditions, effect

Array = NDArray[np.float64]

STANDARD = Thresholds()
Step = tuple[str, float, float]  # kind, load in N, duration in s


def _made(name: str, peak_n: float = 800.0) -> list[Step]:
    return [(one.kind, one.load_n, one.duration_s) for one in EXPERIMENTS[name](peak_n).segments]


def _like(steps: list[Step]) -> list[Any]:
    return [(kind, pytest.approx(load_n), pytest.approx(duration_s)) for kind, load_n, duration_s in steps]


def _triangle(load_n: float, ramp_s: float, rest_s: float) -> list[Step]:
    return [("ramp", load_n, ramp_s), ("ramp", 0.0, ramp_s), ("rest", 0.0, rest_s)]


def _press(load_n: float, ramp_s: float, hold_s: float, rest_s: float) -> list[Step]:
    return [
        ("rest", 0.0, 3.0), ("ramp", load_n, ramp_s), ("hold", load_n, hold_s), ("ramp", 0.0, ramp_s),
        ("rest", 0.0, rest_s),
    ]  # fmt: skip


# -- protocols --------------------------------------------------------------------------------------------------------
def test_holds_are_as_long_and_at_such_loads() -> None:
    """A ramp to the whole load takes four seconds; a triangle to it three each way."""
    assert _made("long_hold") == _like([*_press(600.0, 3.0, 300.0, 300.0), *_triangle(800.0, 3.0, 4.0)])
    several = [
        *_press(200.0, 1.0, 90.0, 30.0), *_press(800.0, 4.0, 90.0, 30.0), *_press(400.0, 2.0, 90.0, 30.0),
        *_press(600.0, 3.0, 90.0, 30.0),
    ]  # fmt: skip
    assert _made("holds_at_several_loads") == _like(several)


def test_rests_are_as_long_between_triangles() -> None:
    three = _triangle(800.0, 3.0, 4.0) * 3
    assert _made("idle") == _like([*three, ("rest", 0.0, 600.0), *three])
    paused: list[Step] = []
    for pause_s in (5.0, 120.0, 20.0, 300.0, 5.0):
        paused += [*_triangle(800.0, 3.0, 2.0) * 3, ("rest", 0.0, pause_s)]
    assert _made("pauses") == _like(paused)


def test_steps_go_to_each_load_at_once_and_hold_it_four_seconds() -> None:
    loads = [400.0, 0.0, 800.0, 200.0, 600.0, 0.0, 800.0, 400.0, 0.0, 600.0, 200.0, 0.0]
    stepped: list[Step] = [("rest", 0.0, 3.0)]
    for load_n in loads:
        stepped += [("ramp", load_n, 0.1), ("hold", load_n, 4.0)]
    assert _made("steps") == _like(stepped)


def test_loops_lie_within_loops_at_two_rates() -> None:
    turns = [800.0, 160.0, 640.0, 320.0, 560.0, 400.0, 520.0, 80.0, 360.0, 200.0, 720.0, 0.0]
    looped: list[Step] = [("rest", 0.0, 3.0)]
    for rate_n_per_s in (80.0, 320.0):
        ways = np.abs(np.diff([0.0, *turns]))
        looped += [("ramp", n, way / rate_n_per_s) for n, way in zip(turns, ways, strict=True)]
        looped.append(("rest", 0.0, 5.0))
    assert _made("minor_loops") == _like(looped)


def test_shuffled_loads_are_reached_at_one_rate() -> None:
    loads = [200, 400, 200, 600, 400, 800, 200, 600, 400, 800, 80, 400, 200, 800, 600, 80]
    shuffled: list[Step] = [("rest", 0.0, 3.0)]
    for load_n in loads:
        shuffled += _triangle(float(load_n), 3.0 * load_n / 800.0, 3.0)
    assert _made("shuffled_loads") == _like(shuffled)


def test_triangles_at_five_rates_are_run_three_times_each() -> None:
    ramps = [(n, s) for kind, n, s in _made("rates") if kind == "ramp"]
    expected = [(load_n, 1.0 / rate) for rate in (0.0625, 0.125, 0.25, 0.5, 1.0) for load_n in (800.0, 0.0) * 3]
    assert ramps == [(pytest.approx(n), pytest.approx(s)) for n, s in expected]


def test_a_multisine_is_that_of_its_frequencies_and_phases() -> None:
    """Schroeder (1970): phases pi k (k - 1) / N of N sines; here from 0.02 to 2 Hz, eight and a half to an octave."""
    made = _made("multisine")
    waves = []
    for count in range(1200):
        at_s = 0.1 * count
        waves.append(
            sum(
                math.cos(2.0 * math.pi * 0.02 * 10.0 ** (0.2 * (k - 1)) * at_s + math.pi * k * (k - 1) / 11.0)
                for k in range(1, 12)
            )
        )
    loads = [800.0 * (0.5 + 0.45 * wave / max(abs(one) for one in waves)) for wave in waves]
    assert made[:2] == _like([("rest", 0.0, 3.0), ("ramp", loads[0], 2.0)])
    assert made[2:-2] == _like([("ramp", load_n, 0.1) for load_n in loads[1:]])
    assert made[-2:] == _like([("ramp", 0.0, 2.0), ("rest", 0.0, 5.0)])


def test_these_are_all_in_their_order() -> None:
    expected = ["steps", "multisine", "minor_loops", "shuffled_loads", "rates", "holds_at_several_loads", "long_hold",
                "pauses", "idle"]  # fmt: skip
    assert list(EXPERIMENTS) == expected
    assert [EXPERIMENTS[name](1.0).name for name in EXPERIMENTS] == expected


# -- rises ------------------------------------------------------------------------------------------------------------
def _session(load: Array, step_s: float = 0.1, thinned: int = 3, resting: Any = None, held_out: bool = False) -> Any:
    at_rest = np.abs(load) < STANDARD.standing if resting is None else resting
    held, every = np.full(load.size, held_out), np.ones(load.size, dtype=bool)
    at = Conditions(step_s * np.arange(load.size), load, step_s)
    told: Any = SimpleNamespace(name="", metadata={})
    return Session(
        told,
        0,
        at,
        load,
        every,
        held,
        np.zeros(load.size, dtype=np.intp),
        at_rest,
        thinned,
        DenoisedLoad(load, 0.0, 0.0, np.ones(load.size)),
    )


def test_a_rise_is_told_by_its_middle_half() -> None:
    """Slow at first and last, fast between a quarter and three quarters."""
    load = course((10, 0.0), (20, 0.18), (12, 0.62), (30, 0.8), (20, 0.0), (10, 0.0))
    (rise,) = _rises(_session(load), STANDARD)
    # The first at 0.2 or more is the first of the twelve, the first at 0.6 or more the last of them.
    assert rise.samples == 11
    assert rise.rate == pytest.approx(0.5 * 0.8 / 1.1)
    assert rise.peak == pytest.approx(0.8)
    assert not rise.is_minor
    finer = _rises(_session(load, step_s=0.05), STANDARD)
    assert next(finer).rate == pytest.approx(2.0 * rise.rate)


def test_a_step_within_a_sample_took_half_of_one() -> None:
    load = np.repeat([0.0, 1.0, 0.0], 20)
    (rise,) = _rises(_session(load), STANDARD)
    assert (rise.samples, rise.rate) == (0, pytest.approx(0.5 / 0.05))
    # Where nothing was thinned a sample more or less would make another rate of four or fewer.
    for steps, is_told in ((6, False), (7, True)):  # three and four from a quarter to three quarters
        ramp = course((20, 0.0), (steps, 1.0), (20, 1.0), (20, 0.0), (20, 0.0))
        (thinned,) = _rises(_session(ramp), STANDARD)
        assert thinned.samples == steps // 2 + steps % 2
        (whole,) = _rises(_session(ramp, thinned=1), STANDARD)
        assert (thinned.is_rated, whole.is_rated, whole.peak) == (
            True,
            is_told,
            pytest.approx(1.0),
        )  # a peak all the same
        assert len(_shown(_session(ramp, thinned=1)).rates_per_s) == is_told


def test_samples_that_a_loads_window_makes_one_are_counted_as_one() -> None:
    """A window is of three samples at least: so finely sampled, ramps of two thirds more make no other rate."""
    load = course((20, 0.0), (24, 1.0), (20, 0.0), (24, 1.0), (20, 0.0), (40, 1.0), (20, 0.0), (40, 1.0), (20, 0.0))
    for thinned, times, count in ((1, 1.0 / 3.0, 1), (2, 2.0 / 3.0, 2), (3, 1.0, 2), (9, 1.0, 2)):
        session = _session(load, thinned=thinned)
        assert [rise.samples for rise in _rises(session, STANDARD)] == pytest.approx(
            [12 * times] * 2 + [20 * times] * 2
        )
        assert len(_shown(session).rates_per_s) == count
    slower = _session(course((20, 0.0), (24, 1.0), (20, 0.0), (72, 1.0), (20, 0.0)), thinned=1)
    assert len(_shown(slower).rates_per_s) == 2


@pytest.mark.parametrize(("height", "is_told"), [(0.079, False), (0.081, True)])
def test_a_rise_is_what_makes_a_load_cycle(height: float, is_told: bool) -> None:
    """0.08 of the span, in a load that goes to one beside it."""
    load = course((10, 0.0), (20, 1.0), (20, 0.0), (20, height), (20, 0.0), (10, 0.0))
    assert len(list(_rises(_session(load), STANDARD))) == 1 + is_told
    # Of a load that moves by little the span is its own; of one that goes beyond the full scale it is that.
    assert len(list(_rises(_session(0.1 * load + 0.5), STANDARD))) == 1 + is_told
    tall = course((10, 0.0), (20, 3.0), (20, 0.0), (20, height), (20, 0.0), (10, 0.0))
    assert len(list(_rises(_session(tall), STANDARD))) == 1 + is_told


@pytest.mark.parametrize(("foot", "is_minor"), [(0.155, False), (0.165, True)])
def test_a_minor_loop_begins_clear_of_the_least_load(foot: float, is_minor: bool) -> None:
    load = course((10, 0.0), (20, 1.0), (20, foot), (20, 0.9), (20, 0.0), (10, 0.0))
    assert [one.is_minor for one in _rises(_session(load - 0.3), STANDARD)] == [False, is_minor]


def test_a_rise_that_ends_at_no_load_bears_none() -> None:
    load = course((10, 0.0), (20, 1.0), (20, 0.0), (10, 0.0))
    assert list(_rises(_session(load - 1.0), STANDARD)) == []
    assert len(list(_rises(_session(load - 0.999), STANDARD))) == 1
    assert list(_rises(_session(np.full(50, 0.3)), STANDARD)) == []


# -- rates and peaks --------------------------------------------------------------------------------------------------
def test_numbers_that_are_alike_are_one() -> None:
    assert _distinct([1.0, 1.2501, 0.5, 1.25], 0.25) == [0.5, 1.0, 1.2501]
    assert _distinct([], 0.25) == []


def test_rates_of_long_ramps_differ_by_more_than_that_share() -> None:
    many = 10_000
    assert _distinct_rates([(1.0, many), (1.249, many)], 0.25) == [1.0]
    assert _distinct_rates([(1.251, many), (1.0, many)], 0.25) == [1.0, 1.251]
    assert _distinct_rates([], 0.25) == []


@pytest.mark.parametrize(("strays", "count"), [((0.2,), 1), ((0.2, 0.2), 2), ((0.1, 0.2), 3)])
def test_one_stray_ramp_makes_no_second_rate_and_several_do(strays: tuple[float, ...], count: int) -> None:
    """A walk beside a few slow ramps outvoted them, and "one loading rate only" was said of both."""
    many = [(1.0, 10_000)] * 20
    assert len(_distinct_rates([*many, *((rate, 10_000) for rate in strays)], 0.25)) == count
    assert len(_distinct_rates([*many[:2], *((rate, 10_000) for rate in strays)], 0.25)) == len({*strays}) + 1


RAMPS = st.lists(st.tuples(st.floats(0.01, 10.0), st.floats(1.0, 1000.0)), min_size=1, max_size=12)


@given(ramps=RAMPS, scale=st.sampled_from([2.0**-10, 0.5, 4.0, 2.0**20]), order=st.randoms(use_true_random=False))
def test_rates_are_the_same_in_any_order_and_any_unit_of_time(
    ramps: list[tuple[float, float]], scale: float, order: Any
) -> None:
    found = _distinct_rates(ramps, 0.25)
    assert set(found) <= {rate for rate, _ in ramps}
    assert all(later > 1.25 * earlier for earlier, later in pairwise(sorted(found)))
    shuffled = order.sample(ramps, len(ramps))
    assert _distinct_rates(shuffled, 0.25) == found
    assert _distinct_rates([(scale * rate, samples) for rate, samples in ramps], 0.25) == [scale * one for one in found]


@given(
    steps=st.lists(st.floats(1.3, 10.0), min_size=1, max_size=5), repeats=st.integers(2, 5), ends=st.floats(1.0, 2.0),
    short=st.lists(st.floats(0.01, 100.0), max_size=4),
)  # fmt: skip
def test_rates_of_long_ramps_are_all_found_and_ramps_of_a_sample_or_two_hide_none(
    steps: list[float], repeats: int, ends: float, short: list[float]
) -> None:
    rates = list(np.cumprod(steps))
    found = _distinct_rates([(rate, 1000.0) for rate in rates] * repeats + [(one, 2.0) for one in short], 0.25, ends)
    assert all(any(one == pytest.approx(rate, rel=0.25) for one in found) for rate in rates)


def test_rates_of_short_ramps_differ_by_more_than_two_samples_at_either_end() -> None:
    """A ramp of ten lasted eight to twelve: up to ten eighths of the rate; one of twenty down to twenty of 22."""
    reach = 10.0 / 8.0
    for by, count in ((0.999, 1), (1.001, 2)):
        rate = by * reach * 22.0 / 20.0
        assert len(_distinct_rates([(1.0, 10), (rate, 20)], 0.25)) == count
    # One of two samples and less may have been as quick as can be; of none as of one.
    assert _distinct_rates([(1.0, 2), (2.0 / 0.1, 10**6)], 0.25) == [1.0]
    assert len(_distinct_rates([(1.0, 2), (2.001 / 0.1, 10**6)], 0.25)) == 2
    assert len(_distinct_rates([(1.0, 0), (10.001, 10**6)], 0.25)) == 2
    assert len(_distinct_rates([(1.0, 0), (9.999, 10**6)], 0.25)) == 1
    assert len(_distinct_rates([(1.0, 10**6), (3.001, 0)], 0.25)) == 2
    assert len(_distinct_rates([(1.0, 10**6), (2.999, 0)], 0.25)) == 1
    # Those of a few samples, which may be of any rate, tie no others together, and are no strays beside them.
    quick = [(0.06, 40), (0.25, 10), (0.5, 5), (1.1, 2), (1.25, 2)]
    assert _distinct_rates([*quick * 3, *[(1.2, 1)] * 20], 0.25) == [0.06, 0.25, 0.5]


def test_ramps_sampled_finely_are_open_by_their_windows_and_by_less_than_one_more() -> None:
    """Of ramps of 4 1/3 and 1 1/3 windows: three times as fast is another rate, where samples are thirds of windows."""
    slow, fast = (0.6, 13.0 / 3.0), (1.9, 4.0 / 3.0)
    assert _distinct_rates([slow, fast], 0.25, 4.0 / 3.0) == [0.6, 1.9]
    assert _distinct_rates([slow, (1.7, 4.0 / 3.0)], 0.25, 4.0 / 3.0) == [0.6]
    assert _distinct_rates([slow, fast], 0.25) == [0.6]


def test_a_stray_ramp_makes_no_second_rate() -> None:
    one, other = (1.0, 1000), (2.0, 1000)
    assert _distinct_rates([one, other, other, other], 0.25) == [2.0]  # three quarters of all
    assert _distinct_rates([one, one, one, other], 0.25) == [1.0]
    assert _distinct_rates([one, one, other, other, other], 0.25) == [1.0, 2.0]


# -- what an experiment shows -----------------------------------------------------------------------------------------
def _shown(*sessions: Any, thresholds: Thresholds = STANDARD) -> Excitation:
    return excitation_of(sessions, thresholds)


def test_a_hold_bears_more_than_a_cycle_leaves_and_stands_still() -> None:
    load = np.concatenate([np.full(40, 0.079), np.full(30, 0.081), np.full(20, 1.0)])
    load.flags.writeable = False
    session = _session(load, step_s=1.0)
    still = _held(session, STANDARD)
    assert not still[:39].any()
    assert still[42:68].all()
    session.conditions.cache["rate_per_s"] = np.where(np.arange(90) < 80, STANDARD.still_per_s, 0.0)
    assert list(np.flatnonzero(_held(session, STANDARD))) == list(range(80, 90))
    session.resting[85:] = True
    assert list(np.flatnonzero(_held(session, STANDARD))) == list(range(80, 85))


def _with(runs: list[tuple[bool, int]], step_s: float = 0.1) -> Any:
    """Rests (True) and holds at 0.5 (False), so many samples each."""
    resting = np.concatenate([np.full(count, one) for one, count in runs])
    session = _session(np.where(resting, 0.0, 0.5), step_s, resting=resting)
    session.conditions.cache["rate_per_s"] = np.zeros(resting.size)
    return session


@pytest.mark.parametrize(
    ("word", "below", "at"),
    [
        ("holds", [(True, 2), (False, 29)], [(True, 2), (False, 30)]),  # 3 s
        ("rests", [(True, 3), (False, 5)], [(True, 4), (False, 5)]),  # 0.4 s
        ("idle", [(True, 599), (False, 5)], [(True, 600), (False, 5)]),  # 60 s
        # Of the rests within the record the longest more than twice the shortest, or than what has settled.
        ("pauses", [(True, 90), (False, 2), (True, 10), (False, 2), (True, 20), (False, 2), (True, 90)],
         [(True, 90), (False, 2), (True, 10), (False, 2), (True, 21), (False, 2), (True, 90)]),
        ("pauses", [(True, 90), (False, 2), (True, 1), (False, 2), (True, 8), (False, 2), (True, 90)],
         [(True, 90), (False, 2), (True, 1), (False, 2), (True, 9), (False, 2), (True, 90)]),
    ],
)  # fmt: skip
def test_times_are_at_least_as_long_as_said(word: str, below: list[Any], at: list[Any]) -> None:
    assert word not in _shown(_with(below)).present
    assert word in _shown(_with(at)).present
    # Any recording may show it.
    assert word in _shown(_with(below), _with(at)).present


def test_a_pause_lies_between_loads_and_not_where_a_recording_begins_or_ends() -> None:
    within = [(True, 10), (False, 2), (True, 40)]
    for ends, is_shown in (([(False, 2)], True), ([(True, 90), (False, 2)], True)):
        assert ("pauses" in _shown(_with([*ends, *within, *ends[::-1]])).present) is is_shown
    assert "pauses" not in _shown(_with([*within, (False, 2)])).present  # one, of 4 s
    assert "pauses" not in _shown(_with([(True, 50)])).present


def test_a_load_that_only_passes_through_nothing_is_no_rest() -> None:
    passing = _with([(False, 5), (True, 30), (False, 5)])
    passing.conditions.cache["rate_per_s"][:] = STANDARD.still_per_s
    assert "rests" not in _shown(passing).present
    passing.conditions.cache["rate_per_s"][:] = 0.99 * STANDARD.still_per_s
    assert "rests" in _shown(passing).present


def test_a_recording_of_one_load_cycle_shows_a_memory_only_by_what_it_holds_beside() -> None:
    once, twice = [_rising((0.1, 1.0))], [_rising((0.1, 1.0), (0.1, 1.0))]
    # A set that stays and an arm that relaxes slowly end such a cycle alike; a curve is seen along any.
    for name, in_once, in_held in (("permanent_set", False, True), ("zero_drift", False, False),
                                   ("play_hysteresis", True, True), ("delay", True, True), ("cross_talk", True, True),
                                   ("sensor_nonlinearity", True, True)):  # fmt: skip
        for sessions, is_shown in ((once, in_once), (twice, True)):
            found = replace(_shown(*sessions), present=frozenset())
            assert found.shows(effect(name)) is is_shown
        assert replace(_shown(*once), present=frozenset({"holds", "peaks"})).shows(effect(name)) is in_held
    # Peaks of several single cycles show no memory.
    assert not replace(_shown(*once), present=frozenset({"peaks"})).shows(effect("orifice_leak"))
    assert not _shown(*once, *once).is_cycled
    assert _shown(*once, *twice).is_cycled


def _rising(*rises: tuple[float, float]) -> Any:
    """Rises at such rates to such peaks, long rests between them."""
    corners: list[tuple[int, float]] = [(20, 0.0)]
    for rate, peak in rises:
        corners += [(max(round(peak / rate / 0.1), 1), peak), (20, 0.0), (20, 0.0)]
    return _session(course(*corners))


def test_steps_low_loads_and_repeats() -> None:
    # So fast that an echo's time takes a quarter of the load.
    assert "steps" not in _shown(_rising((2.4, 0.96))).present
    assert "steps" in _shown(_rising((4.0, 1.0))).present
    assert "low_loads" not in _shown(_rising((0.1, 1.0), (0.1, 0.26))).present
    assert "low_loads" in _shown(_rising((0.1, 1.0), (0.1, 0.2495))).present
    for rises, repeats in (([(0.1, 1.0)], 1), ([(0.1, 1.0)] * 2, 2), ([(0.1, 1.0), (0.1, 0.5)], 1),
                           ([(0.1, 1.0), (0.3, 1.0)], 1), ([], 0)):  # fmt: skip
        found = _shown(_rising(*rises))
        assert ("repeats" in found.present) is (repeats > 1)
    # Across recordings too.
    assert "repeats" in _shown(_rising((0.1, 1.0)), _rising((0.1, 1.0))).present
    # Of a few percent of full scale beside the whole.
    low = _shown(_rising((0.05, 0.1), (0.05, 0.2), (0.1, 0.2), (0.1, 1.0)))
    assert {"low_loads", "peaks", "rates", "repeats"} - low.present == {"repeats"}
    assert len(low.peaks) == 3


def test_a_recording_that_is_held_out_shows_nothing() -> None:
    fitted = _rising((0.1, 1.0), (0.1, 1.0), (0.3, 0.5))
    held = [_with([(False, 30), (True, 600)]), _rising(*[(1.0, 0.2)] * 9)]
    assert _shown(fitted, *held).peaks != _shown(fitted).peaks
    for one in held:
        one.held_out[:] = True
    alone, beside = _shown(fitted), _shown(fitted, *held)
    assert (beside.rates_per_s, beside.peaks) == (alone.rates_per_s, alone.peaks)
    assert beside.present == alone.present
    assert "rates" in beside.present


def test_where_nothing_that_is_held_out_can_be_used_that_is_said() -> None:
    fitted, held = _rising((0.1, 1.0)), _session(np.zeros(9), held_out=True)
    lost = replace(held, usable=~held.usable)
    for sessions, is_judged in (([fitted, held], True), ([fitted, lost, held], True), ([fitted, lost], False)):
        assert excitation_of(sessions, STANDARD).is_judged is is_judged


@given(rate=st.floats(0.02, 0.2), times=st.floats(1.0, 1.5), of_peak=st.booleans())
@settings(max_examples=30)
def test_a_repeat_is_of_a_rate_and_a_peak_that_are_alike_wherever_they_lie(
    rate: float, times: float, of_peak: bool
) -> None:
    """By up to a quarter; ramps are of whole samples here."""
    rises = [(rate, 0.6), (rate, 0.6 * times) if of_peak else (rate * times, 0.6)]
    session = _rising(*rises)
    one, other = _rises(session, STANDARD)
    apart = max(other.peak / one.peak, other.rate / one.rate, one.rate / other.rate)
    assume(abs(apart - 1.25) > 1e-9)
    assert ("repeats" in _shown(session).present) is (apart < 1.25)


def test_a_load_that_moves_by_chance_has_neither_holds_nor_one_rate() -> None:
    """A valve that is turned at every sample, nine seconds apart: few rises last long enough for a rate."""
    steps = np.random.default_rng(2).normal(0.0, 0.06, 300)
    session = _session(0.5 + np.convolve(steps, 0.8 ** np.arange(40))[:300], step_s=9.0, thinned=1)
    shown = _shown(session)
    assert "holds" not in shown.present
    assert not shown.is_held
    assert "one loading rate only" not in " ".join(shown.limits())
    # A weight that is put on for half a minute, logged as slowly, is held.
    weights = np.repeat(np.tile([0.0, 0.8], 20), 6)
    assert "holds" in _shown(_session(weights, step_s=9.0, thinned=1)).present


def test_each_thing_that_lacks_has_its_sentence() -> None:
    every = frozenset({"holds", "rests", "repeats"})
    rich = Excitation((0.1, 0.5), (0.5, 1.0), every, STANDARD)
    for changes, words in (
        ({"rates_per_s": (0.1,)}, "one loading rate only: nothing can be said of rate dependence, nor can viscous"),
        (
            {"rates_per_s": (0.1,), "is_held": True},
            "one loading rate only: of rate dependence no more can be said than how a ramp differs from a hold, nor",
        ),
        (
            {"rates_per_s": (0.1,), "are_rated": False},
            "are over within too few samples to tell one loading rate from another: nothing can be said of rate",
        ),
        (
            {"present": every - {"holds"}},
            "no hold longer than 3 s under load: slow creep is not seen, and the law of a leak",
        ),
        ({"present": every - {"rests"}}, "never seen at rest without load"),
        ({"present": every - {"rests"}, "is_unread_at_rest": True}, "no reading of the unit at rest without load can"),
        ({"present": every - {"repeats"}}, "no load cycle is repeated"),
        ({"peaks": (1.0,)}, "one peak load only"),
    ):
        (said,) = replace(rich, **changes).limits()  # type: ignore[arg-type]
        assert words in said
    (said,) = replace(
        rich, present=every - {"holds"} | {"peaks", "shuffled_loads"}
    ).limits()  # peaks tell the laws of leaks apart
    assert said.endswith("slow creep is not seen")
    assert len(replace(rich, rates_per_s=(0.1,), peaks=(1.0,)).limits()) == 2
    (said,) = replace(rich, is_judged=False).limits()
    assert "how good a simulation is on data it was not fitted to is not known" in said
    # Without any rise the rate is said alone, and is none.
    (said,) = replace(rich, rates_per_s=(), peaks=()).limits()
    assert "no rise of the load of which the rate is seen: nothing can be said of rate dependence" in said


def test_what_single_load_cycles_hold_tells_nothing_that_asks_for_later_ones() -> None:
    found = replace(_shown(_rising((0.1, 1.0))), present=frozenset({"shuffled_loads", "steps", "repeats"}))
    assert replace(found, is_cycled=True).tells_apart == found.present
    assert replace(found, is_cycled=False).tells_apart == {"steps"}


@pytest.mark.parametrize("last", [0.4, 0.55])
def test_a_rise_that_the_recordings_end_cuts_off_has_no_peak_that_falls_with_time(last: float) -> None:
    """Two alike and a part of a third: nothing goes with the clock; two whole ones of which the second is lower do."""
    corners = np.array([0.0, 1.0, 0.0, 1.0, 0.0, last])
    cut = _session(np.interp(np.arange(0.0, 100.0), 20.0 * np.arange(6), corners), 0.1)
    assert not excitation_of([cut], STANDARD).goes_with_the_clock
    whole = _session(np.interp(np.arange(0.0, 120.0), 20.0 * np.arange(7), [*corners[:-1], 0.55, 0.0]), 0.1)
    assert excitation_of([whole], STANDARD).goes_with_the_clock


@given(hz=st.floats(3.0, 20.0), size=st.floats(0.002, 0.008), phase=st.floats(0.0, 6.3))
@settings(max_examples=20)
def test_hum_on_the_load_hides_no_hold_and_no_rest(hz: float, size: float, phase: float) -> None:
    time_s = 0.02 * np.arange(1500)
    ramps = np.interp(time_s, [0.0, 8.0, 10.0, 20.0, 22.0, 30.0], [0.0, 0.0, 0.8, 0.8, 0.0, 0.0])
    load = ramps + size * np.sin(2.0 * np.pi * hz * time_s + phase)
    session = _session(load, 0.02, resting=ramps < 0.01)
    held, at_rest = _held(session, STANDARD), rested(session, STANDARD)
    assert held[(time_s > 12.0) & (time_s < 18.0)].all()
    assert at_rest[(time_s > 2.0) & (time_s < 6.0)].all()
    assert not held[(time_s > 8.5) & (time_s < 9.5)].any()
