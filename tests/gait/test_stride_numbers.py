"""Strides, phases and sequence of contacts that are written down, beside numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from smartshoe.gait import Contacts
from smartshoe.gait._events import Event, events_of
from smartshoe.gait._strides import Stride, loading_rate, strides_of, with_runs
from smartshoe.gait.indices import deviations, overlaid, pattern, sequence_errors
from smartshoe.gait.phases import PHASES, crisp
from smartshoe.gait.summary import activity_by_time, asymmetry, both_down, of_main_activity, steps_of

NAN = float("nan")
RATE_HZ = 100.0


def contacts(
    strike_s: list[float],
    off_s: list[float],
    onset_s: Any = None,
    release_s: Any = None,
    regions: tuple[str, ...] = ("heel", "meta1"),
) -> Contacts:
    unseen = np.full((len(strike_s), len(regions)), NAN)
    onset, release = (unseen if given is None else np.array(given, dtype=float) for given in (onset_s, release_s))
    return Contacts(
        regions, np.array(strike_s), np.array(off_s), onset, release, np.zeros(0), np.zeros((0, len(regions)))
    )


def stride(start_s: float, lasts_s: float = 1.0, foot: str = "left", percent: float = 60.0, **more: Any) -> Stride:
    off_s = start_s + 0.01 * percent * lasts_s
    made = Stride(foot, start_s, start_s + lasts_s, off_s, None, None, percent, None, None, None, False, False)
    return replace(made, **more)


def samples(seconds: float) -> np.ndarray:
    return np.arange(round(seconds * RATE_HZ)) / RATE_HZ + 1e-6


NOTHING_GONE = np.zeros(1200, dtype=bool)


# -- strides -------------------------------------------------------------------------------------------------------
def test_a_stride_reaches_from_strike_to_strike_with_what_is_known_of_it() -> None:
    strikes, offs = [1.0, 2.0, 5.5, 9.001, 10.0], [1.6, 2.7, 6.0, NAN, 10.5]
    onset = [[1.0, 1.1], [2.0, NAN], [5.5, 5.6], [9.001, 9.1], [10.0, 10.1]]
    release = [[1.4, 1.6], [2.9, 2.7], [5.9, 6.0], [NAN, NAN], [10.4, 10.5]]
    own = contacts(strikes, offs, onset, release)
    time_s = samples(12.0)
    force_n = np.where((time_s > 1.0) & (time_s < 1.6), 500.0 + 100.0 * (time_s > 1.3), 0.0)
    found = strides_of("right", own, time_s, force_n, NOTHING_GONE)
    # The third lasts 3.501 s, of the fourth the toe off is not seen, and the last contact has none after it.
    assert [(one.start_s, one.end_s, one.toe_off_s) for one in found] == [(1.0, 2.0, 1.6), (2.0, 5.5, 2.7)]
    first, second = found
    assert (first.foot_flat_s, first.heel_off_s) == (1.1, 1.4)
    assert (second.foot_flat_s, second.heel_off_s) == (None, None)
    assert [one.stance_percent for one in found] == pytest.approx([60.0, 20.0])
    assert [one.time_s for one in found] == pytest.approx([1.0, 3.5])
    assert (first.peak_n, second.peak_n) == (600.0, 0.0)
    # 60 samples of a hundredth of a second, the first 30 at 500 N.
    assert (first.impulse_n_s, second.impulse_n_s) == (pytest.approx(330.0), 0.0)
    assert first.loading_rate_n_per_s is second.loading_rate_n_per_s is None  # there with its first sample
    assert {(one.foot, one.runs, one.gap) for one in found} == {("right", False, False)}
    assert first.to_dict() == {
        "foot": "right", "start_s": 1.0, "end_s": 2.0, "toe_off_s": 1.6, "foot_flat_s": 1.1, "heel_off_s": 1.4,
        "stance_percent": first.stance_percent, "peak_n": 600.0, "impulse_n_s": first.impulse_n_s,
        "loading_rate_n_per_s": None, "runs": False, "gap": False,
    }  # fmt: skip


def test_strides_do_not_know_when_the_clock_began() -> None:
    missing, force_n = NOTHING_GONE.copy(), np.sin(np.arange(1200))
    missing[110:119] = True
    plain, later = [], []
    for found, at in ((plain, 0.0), (later, 500.0)):
        own = contacts([at + 1.0, at + 2.0], [at + 1.6, at + 2.6])
        found += strides_of("left", own, at + samples(12.0), force_n, missing)
    assert (later[0].start_s, later[0].gap) == (plain[0].start_s + 500.0, False)
    for name in ("stance_percent", "peak_n", "impulse_n_s", "loading_rate_n_per_s"):
        assert getattr(later[0], name) == pytest.approx(getattr(plain[0], name))


def test_a_stride_needs_two_contacts_and_one_without_forces_has_none() -> None:
    time_s = samples(12.0)
    for count in (0, 1):
        assert strides_of("left", contacts([1.0][:count], [1.6][:count]), time_s, None, NOTHING_GONE) == []
    (found,) = strides_of("left", contacts([1.0, 2.0], [1.6, 2.6]), time_s, None, NOTHING_GONE)
    assert (found.peak_n, found.impulse_n_s, found.loading_rate_n_per_s) == (None, None, None)
    # A contact that began before the record is no start, and one between two samples has no force.
    assert strides_of("left", contacts([NAN, 2.0], [1.6, 2.6]), time_s, time_s, NOTHING_GONE) == []
    (found,) = strides_of("left", contacts([1.001, 2.0], [1.009, 2.6]), time_s, time_s, NOTHING_GONE)
    assert (found.peak_n, found.impulse_n_s, found.loading_rate_n_per_s) == (None, None, None)
    (found,) = strides_of("left", contacts([1.001, 2.0], [1.011, 2.6]), time_s, time_s, NOTHING_GONE)
    assert (found.peak_n, found.impulse_n_s) == (pytest.approx(1.010001), pytest.approx(0.01010001))


@pytest.mark.parametrize(
    ("gone", "gap"),
    [
        ([(210, 220)], False), ([(210, 221)], True), ([(190, 211)], False), ([(190, 212)], True),
        ([(291, 330)], False), ([(290, 330)], True), ([(0, 201)], False), ([(300, 400)], False),
        ([(210, 220), (240, 250), (270, 280)], False), ([(210, 220), (240, 250), (270, 281)], True),
        ([(210, 220), (240, 250), (270, 280), (285, 286)], True), ([(100, 400)], True), ([(110, 180)], False),
    ],
)  # fmt: skip
def test_samples_are_missed_in_one_piece_or_by_their_share(gone: list[tuple[int, int]], gap: bool) -> None:
    missing = NOTHING_GONE.copy()
    for first, after in gone:
        missing[first:after] = True
    # Samples 201 to 300 lie in the stride: more than 10 in a row are too many, as are more than 30 in all.
    own = contacts([2.005, 3.005], [2.6, 3.6])
    (found,) = strides_of("left", own, samples(12.0), None, missing)
    assert found.gap == gap


@pytest.mark.parametrize(("count", "gap"), [(30, False), (31, True)])
def test_what_a_stride_misses_is_counted_from_its_first_sample(count: int, gap: bool) -> None:
    missing = NOTHING_GONE.copy()
    missing[: 2 * count : 2] = True
    (found,) = strides_of("left", contacts([0.0, 1.0], [0.6, 1.6]), samples(12.0), None, missing)
    assert found.gap == gap


@pytest.mark.parametrize(
    ("left", "right", "right_start_s", "runs"),
    [
        (49.9, 49.9, 0.5, True), (50.0, 50.0, 0.5, False), (40.0, 59.9, 0.5, True), (40.0, 60.0, 0.5, False),
        (40.0, 60.0, 1.0, True), (40.0, 60.0, 0.999, False), (60.0, 40.0, 1.0, False), (40.0, 60.0, -0.999, False),
    ],
)  # fmt: skip
def test_a_stride_runs_where_it_and_the_nearest_of_the_other_foot_are_down_less_than_half(
    left: float, right: float, right_start_s: float, runs: bool
) -> None:
    far = stride(-10.0, foot="right", percent=99.0)
    given = [far, stride(10.0 + right_start_s, foot="right", percent=right), stride(10.0, percent=left)]
    found = with_runs(given)
    assert [one.start_s for one in found] == sorted(one.start_s for one in given)
    (own,) = [one for one in found if one.foot == "left"]
    assert own.runs == runs
    assert replace(own, runs=False) == given[2]


def test_of_two_strides_of_the_other_foot_the_nearest_counts() -> None:
    starts = [("left", 10.0, 40.0), ("right", 10.4, 70.0), ("right", 9.5, 30.0)]
    given = [stride(start_s, foot=foot, percent=percent) for foot, start_s, percent in starts]
    assert [one.runs for one in with_runs(given) if one.foot == "left"] == [False]
    assert with_runs([]) == []
    assert [one.foot for one in with_runs([stride(0.0, foot="right"), stride(0.0)])] == ["left", "right"]


@pytest.mark.parametrize(
    ("stance_n", "rate"),
    [
        # From a fifth to four fifths of the peak in so many samples of a hundredth of a second.
        ([0.0, 500.0, 0.0, 0.0], 500.0 / 0.01), ([0.0, 250.0, 500.0, 0.0, 0.0, 0.0], 250.0 / 0.01),
        ([0.0, 600.0], 600.0 / 0.01), ([0.0, 300.0, 400.0], 300.0 / 0.01),
        # The peak of the second half is the push off.
        ([0.0, 100.0, 200.0, 900.0, 900.0, 900.0], 100.0 / 0.01),
        # Above a fifth at once: from the first sample; 480 N are passed at 0.6 of the first step.
        ([300.0, 600.0, 0.0, 0.0], 0.6 * 600.0 / 0.006),
        # 100 N at 0.5 of the first step, 400 N at 0.5 of the third: two steps.
        ([0.0, 200.0, 300.0, 500.0, 0.0, 0.0, 0.0, 0.0], 300.0 / 0.02),
        # A load that stays at a fifth, or at four fifths: from when it came to it.
        ([0.0, 100.0, 100.0, 500.0, 0.0, 0.0, 0.0, 0.0], 300.0 / 0.0175),
        ([0.0, 400.0, 400.0, 500.0, 0.0, 0.0, 0.0, 0.0], 300.0 / 0.0075),
        ([500.0, 600.0, 0.0, 0.0], None), ([0.0, 0.0, 0.0, 0.0], None), ([-5.0, -1.0, -4.0, -4.0], None),
        ([-1.0, 0.0, -1.0, -1.0], None), ([600.0], None), ([600.0, 500.0, 400.0, 300.0], None),
    ],
)  # fmt: skip
def test_a_loading_rate_is_the_slope_between_two_shares_of_the_first_peak(
    stance_n: list[float], rate: float | None
) -> None:
    assert loading_rate(np.array(stance_n), RATE_HZ) == (None if rate is None else pytest.approx(rate))


# -- phases and sequence -------------------------------------------------------------------------------------------
def phases_at(own: Contacts, at: list[float], first_s: float = 0.0) -> str:
    states = crisp(own, np.array([first_s, *at]))
    return "".join(PHASES[state][0] for state in states[1:])


def test_a_stance_is_cut_at_its_events() -> None:
    own = contacts([1.0, 2.0], [1.6, 2.6], [[1.0, 1.1], [2.0, 2.2]], [[1.4, 1.6], [2.3, 2.6]])
    at = [0.5, 0.999, 1.0, 1.099, 1.1, 1.399, 1.4, 1.599, 1.6, 1.999, 2.0, 2.199, 2.2, 2.299, 2.3, 2.599, 2.6, 9.0]
    assert phases_at(own, at) == "sshhffppsshhffppss"
    assert crisp(own, np.array(at)).dtype == np.int8


def test_a_stance_cut_by_the_record_or_without_an_event_has_what_is_seen_of_it() -> None:
    # It began before the record; it lies flat from its strike, and does not push; it lasts beyond the record.
    own = contacts(
        [NAN, 1.0, 2.0], [0.6, 1.6, NAN], [[NAN, NAN], [1.0, NAN], [2.0, NAN]], [[0.4, 0.6], [1.8, 1.6], [NAN, NAN]]
    )
    at = [0.1, 0.39, 0.4, 0.59, 0.6, 1.0, 1.59, 1.6, 2.0, 50.0]
    assert phases_at(own, at) == "ffppsffshh"
    assert [PHASES[state] for state in crisp(own, np.array([-5.0, 0.2]))] == [
        "flat",
        "flat",
    ]  # from its first sample on
    flat = contacts([2.0], [NAN], [[2.0, 2.2]], [[NAN, NAN]])
    assert phases_at(flat, [1.9, 2.0, 2.2, 50.0]) == "shff"


def test_events_out_of_order_give_way_to_the_later_one() -> None:
    # Heel off, at 1.2 s, before the foot is flat, at 1.3 s: it never is.
    own = contacts([1.0], [1.6], [[1.0, 1.3]], [[1.2, 1.6]])
    assert phases_at(own, [1.0, 1.19, 1.2, 1.3, 1.59, 1.6]) == "hhppps"


def test_events_are_those_that_were_seen_in_order_of_time_and_foot() -> None:
    left = contacts([1.0, 2.0], [1.6, NAN], [[1.0, 1.1], [2.0, NAN]], [[1.4, 1.6], [NAN, NAN]])
    right = contacts([1.6], [2.0])
    assert events_of({"right": right, "left": left}) == [
        Event(1.0, "left", "heel_strike"), Event(1.1, "left", "foot_flat"), Event(1.4, "left", "heel_off"),
        Event(1.6, "left", "toe_off"), Event(1.6, "right", "heel_strike"), Event(2.0, "left", "heel_strike"),
        Event(2.0, "right", "toe_off"),
    ]  # fmt: skip


def test_a_sequence_is_judged_in_every_stride() -> None:
    starts = [float(k) for k in range(6)]
    onset = [[k, k + 0.1] for k in starts]
    release = [[k + 0.3, k + 0.6] for k in starts]
    onset[1][1], release[2][0], release[3][0], release[4][0] = 1.0, NAN, 3.1, 4.6
    own = contacts([*starts, NAN], [*(k + 0.6 for k in starts), 9.0], [*onset, [NAN, NAN]], [*release, [NAN, NAN]])
    strides = [stride(start_s) for start_s in starts]
    # Metatarsal with the heel; no heel off; heel off as it lies flat; heel off with the toe.
    assert [sequence_errors(own, [one])[0] for one in strides] == [0, 1, 1, 1, 1, 0]
    assert sequence_errors(own, strides) == (4, 6)
    assert sequence_errors(own, []) == (0, 0)
    assert sequence_errors(own, [replace(strides[0], toe_off_s=0.3)]) == (1, 1)
    for regions, judged in ((("heel", "meta4"), 6), (("heel", "toe"), 0), (("toe", "meta1"), 0)):
        assert sequence_errors(replace(own, regions=regions), strides)[1] == judged


# -- overlaid strides ----------------------------------------------------------------------------------------------
def test_a_stride_is_read_at_its_101_hundredths() -> None:
    time_s = samples(4.0) - 1e-6
    (found,) = overlaid([stride(1.0, 2.0)], time_s, time_s[:, None] * np.array([1.0, -2.0]))
    assert found.shape == (101, 2)
    assert found[:, 0] == pytest.approx(1.0 + 0.02 * np.arange(101))
    assert found[:, 1] == pytest.approx(-2.0 - 0.04 * np.arange(101))
    assert overlaid([stride(1.0, 2.0)], time_s, time_s)[0] == pytest.approx(found[:, 0])
    assert overlaid([], time_s, time_s).shape == (0, 101)


def test_a_pattern_is_the_mean_over_its_largest_whole_load() -> None:
    mean = np.zeros((101, 2))
    mean[40], mean[60] = (300.0, 200.0), (100.0, 300.0)
    found = pattern(mean)
    assert found is not None
    assert (found[40].tolist(), found[60].tolist()) == ([0.6, 0.4], [0.2, 0.6])
    assert pattern(-mean) is pattern(0.0 * mean) is None


def test_a_distance_is_over_all_units_and_hundredths_of_the_foots_mean_peak() -> None:
    reference = np.zeros((101, 2))
    reference[50] = (0.6, 0.4)
    each = np.zeros((2, 101, 2))
    each[0, 50], each[1, 50] = (600.0, 400.0), (480.0, 320.0)
    # The mean peak is 900 N: one of the two is 1/9 of it above the pattern, the other 1/9 below.
    away = np.array([600.0 / 900.0 - 0.6, 400.0 / 900.0 - 0.4, 480.0 / 900.0 - 0.6, 320.0 / 900.0 - 0.4]) ** 2
    expected = 100.0 * np.sqrt([away[:2].sum() / 202.0, away[2:].sum() / 202.0])
    for scale in (1e-6, 1.0):
        assert deviations(scale * each, reference) == pytest.approx(expected)
    assert deviations(0.0 * each, reference).tolist() == deviations(-each, reference).tolist() == [0.0, 0.0]


# -- the summary ---------------------------------------------------------------------------------------------------
def test_the_main_activity_is_that_of_more_strides_without_gaps() -> None:
    walk, run, gap = stride(0.0), stride(1.0, runs=True), stride(2.0, runs=True, gap=True)
    assert of_main_activity([walk, run, gap]) == [walk]
    assert of_main_activity([walk, run, replace(run, start_s=1.5)]) == [run, replace(run, start_s=1.5)]
    assert of_main_activity([gap]) == []
    assert activity_by_time({"walking": 8.5, "running": 1.5}) == "walking"
    assert activity_by_time({"walking": 8.49, "running": 1.51}) == "mixed"
    assert activity_by_time({"walking": 0.0, "running": 0.0, "standing": 1e-9}) == "standing"


def test_an_asymmetry_is_taken_over_the_mean() -> None:
    assert asymmetry(80.0, 120.0) == 40.0
    assert asymmetry(120.0, 80.0) == -40.0
    assert asymmetry(-1.0, 1.0) == 0.0
    assert asymmetry(0.2, 0.6) == pytest.approx(100.0)


def test_a_step_is_less_than_two_seconds_and_begins_within_the_stride() -> None:
    strides = [stride(0.0, 3.0), stride(3.0, 3.0), stride(6.0, 3.0), stride(9.0, 3.0), stride(12.0, 1.5)]
    own = contacts([0.0, 3.0, 6.0, 9.0, 12.0, 13.5], [1.0] * 6)
    other = contacts([NAN, 1.001, 3.0, 4.0, 5.5, 8.99, 12.0], [1.0] * 7)
    found = steps_of({"left": own, "right": other}, strides)
    # To 3 s from 1.001; to 6 s from the last before it; to 9 s from 8.99; of the last two none begins within them.
    assert found["left"] == pytest.approx([1.999, 0.5, 0.01])
    assert found["right"].size == 0
    assert steps_of({"left": own, "right": contacts([1.0], [1.5])}, strides)["left"].size == 0  # two seconds
    back = steps_of({"right": own, "left": other}, [replace(one, foot="right") for one in strides])
    assert back["right"] == pytest.approx(found["left"])


def test_a_stride_meets_up_to_three_contacts_of_the_other_foot() -> None:
    own = [stride(0.0)]  # down to 0.6 s
    other = contacts([-0.5, 0.2, 0.55, 0.9], [0.1, 0.3, 0.7, 1.5])
    # Both: 0.1 + 0.1 + 0.05 s. Of the fourth contact's tenth nothing is known: it is met by the next stride.
    down = 0.1 + 0.1 + 0.15
    both, neither = both_down({"left": contacts([0.0], [0.6]), "right": other}, own) or (NAN, NAN)
    assert both == pytest.approx(25.0)
    assert neither == pytest.approx(100.0 * (1.0 - 0.6 - down + 0.25))
    first = both_down({"left": contacts([0.0], [0.6]), "right": contacts([0.2], [0.3])}, own)
    assert first == pytest.approx((10.0, 40.0))
    last = both_down({"left": contacts([0.0], [0.6]), "right": contacts([-0.5], [0.0])}, own)
    assert last == pytest.approx((0.0, 40.0))


def test_double_support_is_the_mean_over_the_strides_of_both_feet() -> None:
    feet = {"left": contacts([0.0], [0.6]), "right": contacts([0.5], [1.0])}
    given = [stride(0.0), stride(0.5, 2.0, "right", 25.0)]
    # Of 1 s a tenth is both's, of 2 s a twentieth; neither: nothing of the first, 1.5 s of the second.
    assert both_down(feet, given) == pytest.approx((7.5, 37.5))
    assert both_down(feet, given[:1]) == pytest.approx((10.0, 0.0))
    assert both_down({"left": feet["left"], "right": contacts([], [])}, given[:1]) is None
    assert both_down({"left": feet["left"]}, given[:1]) is None
    assert both_down(feet, []) is None


@pytest.mark.parametrize(("shared_s", "percent"), [(1.5e-9, 1.5e-7), (0.5e-9, 0.0)])
def test_what_is_shared_by_rounding_alone_is_none(shared_s: float, percent: float) -> None:
    feet = {"left": contacts([0.0], [0.6]), "right": contacts([0.6 - shared_s], [1.0])}
    both, neither = both_down(feet, [stride(0.0)]) or (NAN, NAN)
    assert both == pytest.approx(percent, rel=1e-3)
    assert neither == 0.0
