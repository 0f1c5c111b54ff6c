"""What the sums of a trial are made of, each where its answer is known by hand: moments, spans, shares, floors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.errors import InputError, UsageError
from smartshoe.gait import Contacts, Coverage
from smartshoe.gait._coverage import POINTS, learn_coverage
from smartshoe.gait._force_sums import ForceSums, _FootSums
from smartshoe.gait._strides import MOST_MISSING, Stride, loading_rate
from smartshoe.gait._sums import BlockMeans, Moments, StrideSums, weighted_mean
from smartshoe.gait._total import TotalForce, above_floor, standing_spans, total_of, whole_strides
from smartshoe.gait.indices import POINTS as INDEX_POINTS
from smartshoe.gait.indices import overlaid, pattern
from smartshoe.gait.summary import activity_by_time, both_down, steps_of

RATE_HZ = 200.0
NUMBERS = st.lists(st.floats(-1e3, 1e3), max_size=12)


def stride(start_s: float, lasts_s: float = 1.0, foot: str = "left", gap: bool = False) -> Stride:
    end_s, off_s = start_s + lasts_s, start_s + 0.6 * lasts_s
    return Stride(foot, start_s, end_s, off_s, None, None, 60.0, None, None, None, False, gap)


def contacts(strike_s: list[float], off_s: list[float], floors: Any = ()) -> Contacts:
    once = np.full((len(strike_s), 1), np.nan)
    floor = np.array(floors, dtype=float).reshape(-1, 1)
    return Contacts(("heel",), np.array(strike_s), np.array(off_s), once, once, np.arange(float(len(floor))), floor)


def foot(first_s: float, samples: int, missing: slice | None = None) -> Any:
    gone = np.zeros(samples, dtype=bool)
    gone[missing or slice(0)] = True
    return SimpleNamespace(time_s=first_s + np.arange(samples) / RATE_HZ, missing=gone)


# -- sums --------------------------------------------------------------------------------------------------------
@given(st.lists(NUMBERS, max_size=5))
@settings(max_examples=40)
def test_moments_of_groups_are_those_of_all_together(groups: list[list[float]]) -> None:
    found, every = Moments(), np.concatenate([np.zeros(0), *map(np.array, groups)])
    for group in groups:
        found.add(group)
    assert found.count == every.size
    assert found.mean == pytest.approx(every.mean() if every.size else 0.0, abs=1e-9)
    sd = every.std(ddof=1) if every.size > 1 else 0.0
    assert found.sd == pytest.approx(sd, rel=1e-6, abs=1e-6)


def test_a_spread_is_told_of_two_and_more() -> None:
    spreads = []
    for values in ([], [5.0], [4.0, 6.0], [-1.0, 1.0]):
        one = Moments()
        one.add(values)
        spreads.append(one.spread())
    assert spreads[:2] == [{"mean": None, "cv_percent": None}, {"mean": 5.0, "cv_percent": None}]
    assert spreads[2] == {"mean": 5.0, "cv_percent": pytest.approx(20.0 * np.sqrt(2.0))}
    assert spreads[3] == {"mean": 0.0, "cv_percent": None}


@given(st.lists(NUMBERS, max_size=6), st.integers(1, 7))
@settings(max_examples=40)
def test_means_of_blocks_do_not_know_how_the_samples_came(groups: list[list[float]], size: int) -> None:
    found, every = BlockMeans(size), np.concatenate([np.zeros(0), *map(np.array, groups)])
    for group in groups:
        found.add(np.array(group))
    assert (found.count, found.total) == (every.size, pytest.approx(every.sum(), abs=1e-6))
    whole = every[: every.size // size * size].reshape(-1, size).mean(axis=1)
    assert found.means.count == whole.size
    assert found.means.mean == pytest.approx(whole.mean() if whole.size else 0.0, abs=1e-9)


def test_a_weighted_mean_is_of_what_weighs() -> None:
    assert weighted_mean([(700.0, 3.0), (740.0, 1.0)]) == 710.0
    assert weighted_mean([(700.0, 0.0)]) is weighted_mean([]) is None


@given(st.lists(st.floats(-50.0, 50.0), min_size=4, max_size=20), st.integers(1, 19))
@settings(max_examples=40)
def test_floors_in_parts_are_the_floors_of_the_whole(floors: list[float], cut: int) -> None:
    whole, parts = _FootSums(1), _FootSums(1)
    whole.add_floors(contacts([], [], floors))
    for part in (floors[:cut], [], floors[cut:]):
        parts.add_floors(contacts([], [], part))
    steps = np.diff(floors)
    expected = float(np.sum((steps - steps.mean()) ** 2)) / steps.size / 2.0 / (steps.size + 1)
    assert whole.floor_variance == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert parts.floor_variance == pytest.approx(whole.floor_variance, rel=1e-6, abs=1e-9)
    few = _FootSums(1)
    few.add_floors(contacts([], [], floors[:3]))  # two steps tell no spread
    assert few.floor_variance == 0.0


def test_what_the_floors_leave_open_of_a_weight_grows_as_the_units_bear_less_of_it() -> None:
    floors = [0.0, 3.0, 1.0, 4.0, -1.0]
    alone = _FootSums(1)
    alone.add_floors(contacts([], [], floors))
    for coverage in (1.0, 0.5):
        unit: Any = SimpleNamespace(gain_sd=0.0)
        made: Any = SimpleNamespace(units=(unit,), rate_hz=RATE_HZ, is_force=True)
        sums = ForceSums({"left": made, "right": made}, coverage)
        for name in ("left", "right"):
            sums.add_floors(name, contacts([], [], floors))
        steady = sums._strides[True]
        steady.means.add([700.0, 700.0])
        steady.impulse_n_s, steady.lasting_s = 1400.0, 2.0
        weight = sums.forces(None).body_weight
        assert weight is not None
        assert (weight.value, weight.source) == (700.0, "strides")
        assert weight.sd == pytest.approx(np.sqrt(2.0 * alone.floor_variance) / coverage)


@pytest.mark.parametrize("feet", [("left",), ("left", "right")])
def test_steps_and_asymmetries_are_of_two_shoes(feet: tuple[str, ...]) -> None:
    sums = StrideSums(feet)
    both = {}
    for k, name in enumerate(feet):
        strikes = [0.5 * k + j for j in range(-1, 5)]
        both[name] = contacts(strikes, [strike_s + 0.6 for strike_s in strikes])
    sums.add(both, [stride(0.5 * k + j, foot=name) for k, name in enumerate(feet) for j in range(3)])
    found = sums.summary()
    assert found["cadence_steps_per_min"] == pytest.approx(120.0)
    assert found["strides"] == dict.fromkeys(feet, 3)
    if len(feet) == 1:
        assert found["step_time_s"] == {}
        assert set(found["right_over_left_percent"].values()) == {None}
        assert found["asymmetry_percent"] is found["double_support_percent"] is None
    else:
        assert [found["step_time_s"][name]["mean"] for name in feet] == pytest.approx([0.5, 0.5])
        assert found["right_over_left_percent"]["stance_time"] == pytest.approx(0.0)
        assert found["asymmetry_percent"] == pytest.approx(0.0)  # without forces that of the stances
        assert (found["double_support_percent"], found["flight_percent"]) == (pytest.approx(20.0), 0.0)


# -- the summary -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("walking_s", "running_s", "standing_s", "activity"),
    [
        (85.0, 15.0, 0.0, "walking"), (84.0, 16.0, 0.0, "mixed"), (0.0, 85.0, 15.0, "running"),
        (5.0, 5.0, 90.0, "standing"), (0.0, 0.0, 0.0, "mixed"),
    ],
)  # fmt: skip
def test_an_activity_is_the_trials_that_takes_most_of_its_time(
    walking_s: float, running_s: float, standing_s: float, activity: str
) -> None:
    assert activity_by_time({"walking": walking_s, "running": running_s, "standing": standing_s}) == activity


def test_a_contact_that_began_before_the_record_is_shared_too() -> None:
    strides = [stride(0.0), stride(1.0)]
    own = contacts([0.0, 1.0, 2.0], [0.6, 1.6, 2.6])
    # The other foot is down from the beginning to 0.1 s, from 0.5 to 1.1 s, and from 1.5 s to the end.
    other = contacts([np.nan, 0.5, 1.5], [0.1, 1.1, np.nan])
    assert both_down({"left": own, "right": other}, strides) == pytest.approx((20.0, 0.0))
    assert both_down({"left": own, "right": other}, strides[1:]) == pytest.approx((20.0, 0.0))
    assert both_down({"left": own}, strides) is both_down({"left": own, "right": other}, []) is None


def test_a_step_lasts_from_the_other_foots_strike_within_the_stride() -> None:
    own, other = contacts([0.0, 1.0, 2.0, 7.0], [0.6] * 4), contacts([0.4, 1.45, 4.9], [0.5] * 3)
    strides = [stride(0.0), stride(1.0), stride(2.0, 5.0)]
    found = steps_of({"left": own, "right": other}, strides)
    # Of the third stride the other foot's strike is 2.1 s before its end: no step.
    assert found["left"] == pytest.approx([0.6, 0.55])
    assert found["right"].size == 0
    nobody = contacts([], [])
    assert steps_of({"left": own, "right": nobody}, strides)["left"].size == 0
    assert steps_of({"left": own}, strides) == {}
    # A strike before the stride began is another stride's.
    assert steps_of({"left": own, "right": contacts([-0.5], [0.0])}, strides[:1])["left"].size == 0


# -- the whole force ---------------------------------------------------------------------------------------------
def test_spells_of_standing_reach_from_end_to_end_of_what_both_feet_share() -> None:
    feet = {"left": foot(1.0, 2001), "right": foot(1.5, 1901)}  # 1 to 11 s, 1.5 to 11 s
    down = {"left": True, "right": True}
    none = contacts([], [])
    assert standing_spans(feet, {"left": none, "right": none}, down) == [(1.5, 11.0)]
    whole = contacts([np.nan], [np.nan])
    assert standing_spans(feet, {"left": whole, "right": whole}, down) == [(1.5, 11.0)]
    twice = contacts([np.nan, 6.0], [5.0, np.nan])
    assert standing_spans(feet, {"left": twice, "right": whole}, down) == [(1.5, 5.0), (6.0, 11.0)]
    # Less than two seconds together are none.
    short = contacts([3.5, 9.5], [6.5, 11.0])
    assert standing_spans(feet, {"left": twice, "right": short}, down) == []
    assert standing_spans(feet, {"left": contacts([2.0, 5.0], [4.0, 6.9]), "right": whole}, down) == [(2.0, 4.0)]
    # A foot that bears nothing takes no part.
    assert standing_spans(feet, {"left": twice, "right": none}, {"left": True, "right": False}) == [
        (1.0, 5.0), (6.0, 11.0),
    ]  # fmt: skip
    assert standing_spans(feet, {"left": none, "right": none}, {"left": False, "right": False}) == []


def test_the_whole_force_is_the_sum_over_the_time_that_the_feet_share() -> None:
    feet = {"left": foot(0.0, 200, slice(50, 52)), "right": foot(0.2525, 200, slice(0, 3))}
    forces = {"left": np.arange(200.0), "right": 1000.0 + np.arange(200.0)}
    found = total_of(feet, forces)
    assert found.time_s == pytest.approx(np.arange(51, 200) / RATE_HZ)
    # Half a sample apart: on straight lines between the other's samples.
    assert found.force_n == pytest.approx(np.arange(51.0, 200.0) + 1000.5 + np.arange(149.0))
    assert np.flatnonzero(found.missing).tolist() == [0, 1, 2]


@pytest.mark.parametrize("start", [0, 7])
@pytest.mark.parametrize(("share", "is_whole"), [(MOST_MISSING - 0.006, True), (MOST_MISSING + 0.006, False)])
def test_a_stride_is_whole_where_three_tenths_at_most_are_missing(start: int, share: float, is_whole: bool) -> None:
    time_s = np.arange(start, start + 400) / RATE_HZ
    missing = np.zeros(400, dtype=bool)
    missing[: round(share * 200)] = True
    total = TotalForce(time_s, np.zeros(400), missing)
    inside = stride(float(time_s[0]))
    assert whole_strides(total, [inside]) == [inside] * is_whole
    assert whole_strides(TotalForce(time_s, total.force_n, np.zeros(400, dtype=bool)), [inside]) == [inside]
    last = stride(float(time_s[-1]) - 0.75, 0.75)
    last = replace(last, end_s=float(time_s[-1]))
    assert whole_strides(total, [last]) == [last]  # to the very last sample
    outside = [stride(float(time_s[0]) - 0.001), stride(float(time_s[-1]) - 0.999)]
    assert whole_strides(total, [*outside, stride(float(time_s[210]), 0.5, gap=True)]) == []


def test_a_load_that_is_there_within_a_sample_has_its_rate() -> None:
    stance_n = np.concatenate([[0.0, 600.0], np.linspace(590.0, 0.0, 60)])
    assert loading_rate(stance_n, 200.0) == pytest.approx(600.0 * 200.0)
    assert loading_rate(stance_n[1:], 200.0) is loading_rate(-stance_n, 200.0) is None


def test_a_pattern_does_not_know_the_unit_of_the_loads() -> None:
    mean = np.abs(np.sin(np.linspace(0.0, np.pi, INDEX_POINTS)))[:, None] * np.array([0.6, 0.4])
    for scale in (1e-3, 1.0, 800.0):
        assert pattern(scale * mean) == pytest.approx(mean, rel=1e-3)
    assert pattern(0.0 * mean) is None


def test_strides_laid_over_each_other_are_read_at_each_hundredth() -> None:
    time_s = np.arange(800) / RATE_HZ
    loads = np.column_stack([time_s, time_s**2])
    strides = [stride(0.5), stride(1.5, 1.2)]
    each = overlaid(strides, time_s, loads)
    assert each.shape == (2, INDEX_POINTS, 2)
    assert each[1, :, 0] == pytest.approx(np.linspace(1.5, 2.7, INDEX_POINTS))
    assert overlaid(strides, time_s, loads[:, 1]) == pytest.approx(each[:, :, 1])


def test_loads_stand_on_a_line_from_floor_to_floor() -> None:
    made: Any = SimpleNamespace(time_s=np.array([0.0, 1.0, 2.0, 3.0]), load=np.full((4, 1), 10.0))
    found = above_floor(made, contacts([], [], [2.0, 4.0, 3.0]))
    assert found[:, 0] == pytest.approx([8.0, 6.0, 7.0, 7.0])
    assert above_floor(made, contacts([], []))[:, 0] is not None


# -- coverage ----------------------------------------------------------------------------------------------------
def test_all_of_a_load_is_borne_unless_something_else_is_said() -> None:
    assert Coverage() == Coverage(1.0)
    for share in (0.0, -0.1, 1.01, np.nan):
        with pytest.raises(UsageError, match="coverage is"):
            Coverage(share)
    with pytest.raises(UsageError, match="100 points: give 101"):
        Coverage(0.8, (0.0,) * 100)


@pytest.mark.parametrize("made", [Coverage(0.8), Coverage.midfoot(0.7), Coverage(0.9, (0.1,) * POINTS, 0.25)])
def test_a_coverage_from_its_file_gives_the_same_whole_force_in_a_stance(made: Coverage, tmp_path: Path) -> None:
    made.save(tmp_path / "course.csv")
    again = Coverage.load(tmp_path / "course.csv")
    assert (again.share, again.least_stance_s) == (made.share, made.least_stance_s)
    time_s = np.arange(800) / RATE_HZ
    borne = np.where((time_s >= 1.0) & (time_s < 1.8), 500.0, 0.0)
    steps = contacts([1.0], [1.8])
    assert again.whole(borne, time_s, steps) == pytest.approx(made.whole(borne, time_s, steps), abs=1e-9)


@pytest.mark.parametrize("share", [0.5, 0.8, 1.0])
def test_by_any_course_the_impulse_of_a_stance_is_what_its_units_bear_over_the_share(share: float) -> None:
    time_s = np.arange(2000) / RATE_HZ
    strikes = [1.0, 2.5, 4.0]
    borne = np.zeros(2000)
    for strike_s in strikes:
        inside = (time_s >= strike_s) & (time_s < strike_s + 0.8)
        borne[inside] = 400.0 * np.sin(np.pi * (time_s[inside] - strike_s) / 0.8)
    made = Coverage.midfoot(share)
    found = made.whole(borne, time_s, contacts(strikes, [strike_s + 0.8 for strike_s in strikes]))
    assert found.sum() == pytest.approx(borne.sum() / share, rel=0.01)
    assert (found[borne == 0.0] >= 0.0).all()
    # A stance that is too short for the course, or stands, has the same share throughout.
    for lasts_s in (0.2, 3.0):
        even = made.whole(borne, time_s, contacts([1.0], [1.0 + lasts_s]))
        assert even == pytest.approx(borne / share)


def test_a_stance_cut_by_the_records_ends_lasts_as_long_as_the_others() -> None:
    time_s = np.arange(800) / RATE_HZ
    made = Coverage(0.8, tuple(np.linspace(0.0, 0.5, POINTS)), 0.0)
    borne = np.full(800, 300.0)
    whole = made.whole(borne, time_s, contacts([np.nan, 1.0, 3.5], [0.4, 1.8, np.nan]))
    # At 0.4 s the first one's course is at its end, as at 1.8 s, and at the last sample at five eighths.
    for at_s, share in ((0.395, 0.994), (1.795, 0.994), (1.0, 0.0), (3.5, 0.0), (3.995, 0.619)):
        assert whole[round(at_s * RATE_HZ)] == pytest.approx(300.0 * (1.0 + 0.5 * share), rel=2e-3)
    assert whole[round(2.5 * RATE_HZ)] == pytest.approx(375.0)


def test_a_course_is_learned_from_five_stances_whose_whole_force_is_known() -> None:
    time_s = np.arange(2400) / RATE_HZ
    strikes = [0.5 + 1.5 * k for k in range(7)]
    load, plate = np.zeros((2400, 2)), np.zeros(2400)
    for strike_s in strikes:
        inside = (time_s >= strike_s) & (time_s < strike_s + 0.8)
        part = (time_s[inside] - strike_s) / 0.8
        load[inside] = np.array([300.0, 100.0])
        plate[inside] = 400.0 + 400.0 * 0.5 * part
    steps = contacts([*strikes, 11.5], [*(strike_s + 0.8 for strike_s in strikes), np.nan])
    found: Any = SimpleNamespace(feet={"left": SimpleNamespace(time_s=time_s, load=load, contacts=steps)})
    made = learn_coverage(found, {"left": plate})
    assert made.course == pytest.approx(np.linspace(0.0, 0.5, POINTS), abs=0.005)
    assert made.share == pytest.approx(0.8, rel=0.005)
    plate[: round(3.4 * RATE_HZ)] = np.nan  # two stances without
    assert learn_coverage(found, {"left": plate}).course == pytest.approx(made.course)
    plate[: round(3.6 * RATE_HZ)] = np.nan
    with pytest.raises(InputError, match="known in 4 stances: a course of coverage needs 5"):
        learn_coverage(found, {"left": plate})
