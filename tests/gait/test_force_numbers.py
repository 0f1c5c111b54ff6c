"""Body weight, totals and the error to expect, of windows that are written down, beside numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from windows import BOTH, NAN, TIME_S, contacts, foot, series, stride, window

from smartshoe.gait._force_sums import BodyWeight, Forces, ForceSums, _FootSums
from smartshoe.gait._total import TotalForce, standing_spans, total_of, whole_strides
from smartshoe.gait._window import AnalysisWindow, _peaks_of, _usual_peak, is_loaded


def summed(*windows: AnalysisWindow, feet: Any = None, coverage: float = 1.0, floors: Any = (0.0, 0.0)) -> ForceSums:
    feet = {"left": foot(), "right": foot()} if feet is None else feet
    sums = ForceSums(feet, coverage)
    for name in feet:
        sums.add_floors(name, contacts(floors=[[one] * len(feet[name].units) for one in floors]))
    for one in windows:
        sums.add(one)
    return sums


def four(forces: Forces) -> tuple[Any, ...]:
    return forces.body_weight, forces.mean_total_n, forces.standing_total_n, forces.rmse_estimate_n


RISING = 600.0 + 50.0 * TIME_S  # over a stride its mean is that of its middle


# -- weight from strides -------------------------------------------------------------------------------------------
def test_strides_of_the_first_foot_weigh_by_the_time_that_they_last() -> None:
    strides = [stride(0.505), stride(1.505, 2.0), stride(0.905, 1.5, "right")]
    weight = summed(window(BOTH, RISING, strides)).forces(None).body_weight
    # 650.25 N for 1 s and 725.25 N for 2 s; the sd of the mean is half of what the two lie apart.
    assert weight is not None
    assert (weight.value, weight.source) == (pytest.approx(700.25), "strides")
    assert weight.sd == pytest.approx(37.5)
    assert summed(window(BOTH, RISING, strides)).forces(None).mean_total_n == pytest.approx(700.25)
    assert summed(window(BOTH, RISING, strides)).forces(None).standing_total_n is None


def test_of_a_first_foot_without_whole_strides_the_other_ones_weigh() -> None:
    strides = [stride(0.505, gap=True), stride(0.905, 1.5, "right"), stride(-0.1), stride(19.5)]
    weight = summed(window(BOTH, RISING, strides)).forces(None).body_weight
    # One stride has no spread: a twentieth of it.
    assert weight == BodyWeight(pytest.approx(682.75), pytest.approx(0.05 * 682.75), "strides")
    assert summed(window(BOTH, RISING, [stride(0.505)])).forces(None).body_weight == BodyWeight(
        pytest.approx(650.25), pytest.approx(0.05 * 650.25), "strides"
    )
    assert four(summed(window(BOTH, RISING)).forces(None)) == (None, None, None, None)


def test_a_stride_from_the_first_sample_to_the_last_has_all_of_its_impulse() -> None:
    for one, mean_n in ((stride(0.0), 625.0), (stride(19.0), 1575.0), (stride(0.0, 20.0), 1100.0)):
        weight = summed(window(BOTH, RISING, [one])).forces(None).body_weight
        assert weight is not None
        assert weight.value == pytest.approx(mean_n)


def test_windows_add_up() -> None:
    parts = [window(BOTH, RISING, [stride(at)]) for at in (0.5, 1.5, 2.5)]
    weight = summed(*parts).forces(None).body_weight
    assert weight is not None
    assert (weight.value, weight.sd) == (pytest.approx(700.0), pytest.approx(50.0 / np.sqrt(3.0)))


@pytest.mark.parametrize("samples", [0, 1])
def test_a_window_without_a_whole_force_weighs_nothing(samples: int) -> None:
    short = replace(window(BOTH), total=TotalForce(TIME_S[:samples], TIME_S[:samples], np.zeros(samples, dtype=bool)))
    for one in (short, window(BOTH), window({"left": BOTH["left"]}, RISING, [stride(0.5)])):
        assert summed(one).forces(None).body_weight is None
    assert summed(window(BOTH, RISING, [stride(0.5)])).forces(None).body_weight is not None


def test_forces_of_feet_in_other_units_are_not_known() -> None:
    feet = {"left": foot(), "right": foot(is_force=False)}
    forces = summed(window(BOTH, RISING, [stride(0.5)]), feet=feet).forces(700.0)
    assert four(forces) == (None, None, None, None)
    assert summed(window(BOTH, RISING, [stride(0.5)])).forces(710.5).body_weight == BodyWeight(710.5, 0.0, "given")


@pytest.mark.parametrize("start_s", [-3.0, 500.0])
def test_a_weight_does_not_know_when_the_clock_began(start_s: float) -> None:
    time_s, missing = start_s + TIME_S, np.zeros(2001, dtype=bool)
    missing[50:75] = True
    made = {name: series(300.0, TIME_S < 5.0, time_s=time_s) for name in ("left", "right")}
    strides = [stride(start_s + at, 2.0) for at in (0.495, 2.495)]
    spans = [(start_s + 8.0, start_s + 12.0)]
    later = four(summed(window(made, RISING, strides, spans, missing=missing, time_s=time_s)).forces(None))
    # A quarter of a second is missing of 2 s; 675 and 775 N for 4 s, and 1100 N for 3.01 s.
    assert later[1:3] == pytest.approx(((4.0 * 724.75 + 3.01 * 1100.0) / 7.01, 1100.0))
    assert later[0] == BodyWeight(pytest.approx(724.75), pytest.approx(50.0), "strides")


# -- weight from standing ------------------------------------------------------------------------------------------
def test_standing_counts_once_it_has_settled() -> None:
    total_n = np.full(2001, 1e6)
    total_n[550:951] = 740.0  # 5.5 to 9.5 s
    sums = summed(window(BOTH, total_n, spans=[(4.9951, 10.0049)]))
    forces = sums.forces(None)
    # 401 samples are two blocks of two seconds, of one mean.
    assert forces.standing_total_n == forces.mean_total_n == pytest.approx(740.0)
    assert forces.body_weight == BodyWeight(pytest.approx(740.0), 0.0, "standing")
    edges = summed(window(BOTH, np.arange(2001.0), spans=[(2.0, 5.0), (8.0, 10.0)])).forces(None)
    assert edges.standing_total_n == pytest.approx((201 * 350.0 + 101 * 900.0) / 302.0)  # both ends of each spell


def test_a_standing_weight_has_the_sd_of_its_blocks() -> None:
    total_n = np.where(TIME_S < 2.5, 690.0, np.where(TIME_S < 4.5, 720.0, 700.0))
    weight = summed(window(BOTH, total_n, spans=[(0.0, 7.5)])).forces(None).body_weight
    assert weight is not None
    # From 0.5 to 7 s: blocks of 200 samples at 690, 720 and 700 N, and 51 samples more at 700 N.
    assert weight.value == pytest.approx((200 * 690.0 + 200 * 720.0 + 251 * 700.0) / 651.0)
    assert weight.sd == pytest.approx(np.std([690.0, 720.0, 700.0], ddof=1) / np.sqrt(3.0))
    single = summed(window(BOTH, total_n, spans=[(0.0, 3.4)])).forces(None).body_weight
    assert single is not None
    assert single.sd == pytest.approx(0.05 * single.value)


def test_standing_leaves_out_what_is_missing_or_another_windows() -> None:
    total_n, missing = np.full(2001, 700.0), np.zeros(2001, dtype=bool)
    total_n[300:400], missing[300:400] = 0.0, True
    total_n[600:] = 900.0
    one = window(BOTH, total_n, spans=[(1.0, 9.0)], missing=missing, end_s=6.0)
    assert summed(one).forces(None).standing_total_n == pytest.approx(700.0)
    after = window(BOTH, total_n, spans=[(1.0, 9.0)], start_s=6.0)
    # 1.5 to 6 s without a second at 700 N, 6 to 8.5 s at 900 N.
    both = summed(one, after).forces(None)
    assert both.standing_total_n == pytest.approx((350 * 700.0 + 251 * 900.0) / 601.0)


@pytest.mark.parametrize(("until_s", "source"), [(14.98, "strides"), (14.99, "standing"), (15.0, "standing")])
def test_the_weight_is_of_what_lasts_longer(until_s: float, source: str) -> None:
    total_n = np.where(TIME_S < 8.0, 700.0, 740.0)
    # From 10.5 s to half a second before the end: the last but one of the three lasts as long as four strides.
    sums = summed(window(BOTH, total_n, [stride(at) for at in (0.5, 1.5, 2.5, 3.5)], [(10.0, until_s)]))
    forces = sums.forces(None)
    assert forces.body_weight is not None
    assert (forces.body_weight.source, forces.body_weight.value) == (
        source, pytest.approx(700.0 if source == "strides" else 740.0),
    )  # fmt: skip
    standing_s = until_s - 10.99
    assert forces.mean_total_n == pytest.approx((4.0 * 700.0 + standing_s * 740.0) / (4.0 + standing_s))
    assert forces.standing_total_n == pytest.approx(740.0)


# -- the sd of a weight --------------------------------------------------------------------------------------------
STEADY = [stride(0.5), stride(1.5), stride(2.5)]


@pytest.mark.parametrize("coverage", [1.0, 0.8])
def test_the_gains_sds_add_up_over_the_loads_that_the_units_bear(coverage: float) -> None:
    feet = {"left": foot((0.1, 0.2)), "right": foot((0.05, 0.0))}
    made = {"left": series([100.0, 50.0]), "right": series([200.0, 30.0])}
    weight = summed(window(made, 700.0, STEADY), feet=feet, coverage=coverage).forces(None).body_weight
    assert weight == BodyWeight(pytest.approx(700.0), pytest.approx(np.sqrt(300.0) / coverage), "strides")


def test_a_mean_load_is_of_the_windows_own_samples() -> None:
    load = np.where(TIME_S < 10.0, 100.0, 1e6)[:, None]
    made = {"left": series(load), "right": series(0.0)}
    one = window(made, 700.0, STEADY, end_s=10.0)
    weight = summed(one, feet={"left": foot((0.3,)), "right": foot()}).forces(None).body_weight
    assert weight is not None
    assert weight.sd == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("floors", "variance"),
    [
        ([], 0.0), ([5.0], 0.0), ([0.0, 4.0, 0.0], 0.0),  # two steps tell nothing
        # Steps of 4, -4, 4: their mean 4/3, their squares about it 42.67; halved, over three steps and four floors.
        ([0.0, 4.0, 0.0, 4.0], (48.0 - 16.0 / 3.0) / 3.0 / 2.0 / 4.0),
    ],
)  # fmt: skip
def test_the_floors_of_swings_have_a_variance_of_their_mean(floors: list[float], variance: float) -> None:
    sums = _FootSums(1)
    sums.add_floors(contacts(floors=[[one] for one in floors]))
    assert sums.floor_variance == pytest.approx(variance)
    assert sums.last_floor == (floors[-1] if floors else None)
    if floors:
        weight = summed(window(BOTH, 700.0, STEADY), floors=floors, coverage=0.5).forces(None).body_weight
        assert weight is not None
        assert weight.sd == pytest.approx(np.sqrt(2.0 * variance) / 0.5)


def test_a_floor_is_the_sum_of_its_units() -> None:
    sums = _FootSums(2)
    for part in ([[1.0, 2.0], [3.0, 4.0]], [], [[0.0, 3.0], [5.0, 2.0]]):
        sums.add_floors(contacts(floors=part, regions=("toe", "heel")))
    # 3, 7, 3 and 7 N.
    assert (sums.floor_variance, sums.last_floor) == (pytest.approx((48.0 - 16.0 / 3.0) / 24.0), 7.0)


def test_one_shoe_tells_twice_its_mean_and_what_that_assumes() -> None:
    feet, made = {"left": foot((0.1,))}, {"left": series(300.0, state=np.arange(2001) % 2)}
    forces = summed(window(made, 350.0, STEADY, [(10.0, 12.0)]), feet=feet, floors=(0.0, 1.0)).forces(None)
    # 30 N of the gain and a twentieth of 350 N, both twice.
    sd = 2.0 * np.hypot(30.0, 17.5)
    assert forces.body_weight == BodyWeight(pytest.approx(700.0), pytest.approx(sd), "one_shoe")
    assert forces.mean_total_n is forces.standing_total_n is None
    assert forces.rmse_estimate_n is not None


# -- the error to expect -------------------------------------------------------------------------------------------
@pytest.mark.parametrize("coverage", [1.0, 0.8])
def test_the_error_is_of_the_loads_in_swing_and_of_the_gains(coverage: float) -> None:
    load = np.column_stack([np.where(TIME_S < 5.0, 3.0, 200.0), np.where(TIME_S < 5.0, -1.0, 100.0)])
    missing = TIME_S < 1.0
    load[missing] = 5.0
    made = {"left": series(load, TIME_S >= 5.0, missing), "right": series(load, TIME_S >= 5.0, missing)}
    feet = {"left": foot((0.1, 0.2)), "right": foot((0.0, 0.0))}
    one = window(made, 700.0, STEADY, start_s=0.0, end_s=10.0)
    rmse_n = summed(one, feet=feet, coverage=coverage).forces(None).rmse_estimate_n
    # In swing the units sum to 2 N in either foot; the left one's mean squares are of a tenth, 4 and 5 tenths.
    squares = [0.1 * 25.0 + 0.4 * 9.0 + 0.5 * 200.0**2, 0.1 * 25.0 + 0.4 * 1.0 + 0.5 * 100.0**2]
    assert rmse_n == pytest.approx(np.sqrt(4.0 + 4.0 + 0.01 * squares[0] + 0.04 * squares[1]) / coverage)


def test_without_a_swing_no_error_is_told() -> None:
    swings = {"left": series(1.0, 0), "right": series(1.0, 0)}
    stands = {"left": series(1.0, 0), "right": series(1.0, 1)}
    hidden = {"left": series(1.0, 0), "right": series(1.0, 0, True)}
    assert summed(window(swings)).forces(None).rmse_estimate_n == pytest.approx(np.sqrt(2.0))
    for one in (window(stands), window(hidden), window(swings)):
        floors = () if one.series is swings else (0.0,)
        assert summed(one, floors=floors).forces(None).rmse_estimate_n is None


# -- the whole force -----------------------------------------------------------------------------------------------
def test_two_seconds_of_both_feet_are_a_spell_of_standing() -> None:
    feet: Any = {"left": SimpleNamespace(time_s=TIME_S), "right": SimpleNamespace(time_s=TIME_S)}
    down = {"left": True, "right": True}
    for off_s, spans in ((3.0, [(1.0, 3.0)]), (2.999, [])):
        for others in ([0.5], [NAN]):
            both = {"left": contacts([1.0], [off_s]), "right": contacts(others, [NAN])}
            assert standing_spans(feet, both, down) == spans
            assert standing_spans(feet, dict(reversed(both.items())), down) == spans
    many = {"left": contacts([1.0, 8.0], [6.0, 16.0]), "right": contacts([3.5, 12.0], [11.0, NAN])}
    assert standing_spans(feet, many, down) == [(3.5, 6.0), (8.0, 11.0), (12.0, 16.0)]
    assert standing_spans(feet, many | {"right": contacts()}, down) == [(1.0, 6.0), (8.0, 16.0)]


def test_the_feet_are_added_at_the_first_ones_times() -> None:
    ends = {"left": (0.0, 4.0), "right": (1.005, 3.0)}
    feet: Any = {}
    for name, (first_s, last_s) in ends.items():
        time_s = np.arange(first_s, last_s + 1e-6, 0.01)
        feet[name] = SimpleNamespace(time_s=time_s, missing=(time_s > 2.0) & (time_s < 2.012))
    found = total_of(feet, {name: 10.0 * one.time_s for name, one in feet.items()})
    assert found.time_s == pytest.approx(np.arange(101, 300) / 100.0)
    assert found.force_n == pytest.approx(20.0 * found.time_s)
    # The left one lacks 2.01 s, the right one 2.005: each time beside that hangs on it.
    assert found.time_s[found.missing] == pytest.approx([2.0, 2.01])
    feet["left"].missing[:] = feet["right"].missing[:] = False
    assert not total_of(feet, {name: one.time_s for name, one in feet.items()}).missing.any()


def test_a_third_of_a_stride_of_three_samples_is_too_much() -> None:
    total = TotalForce(np.arange(4.0), np.zeros(4), np.array([False, True, False, False]))
    assert whole_strides(total, [stride(0.0, 3.0)]) == []
    assert whole_strides(replace(total, missing=np.zeros(4, dtype=bool)), [stride(0.0, 3.0)]) == [stride(0.0, 3.0)]


@pytest.mark.parametrize(("gone", "is_whole"), [(60, True), (61, False)])
def test_of_a_whole_stride_three_tenths_may_be_missing(gone: int, is_whole: bool) -> None:
    missing = np.zeros(2001, dtype=bool)
    missing[210 : 210 + gone], missing[:100] = True, True
    total = TotalForce(TIME_S, 0.0 * TIME_S, missing)
    one = stride(1.995, 2.0)
    assert whole_strides(total, [one, stride(5.0, gap=True)]) == [one] * is_whole


# -- the window ----------------------------------------------------------------------------------------------------
def test_a_window_has_the_samples_from_its_start_to_before_its_end() -> None:
    one = window(BOTH, start_s=2.0, end_s=3.0)
    given = np.array([1.99, 2.0 - 1.5e-9, 2.0 - 0.5e-9, 2.0, 2.5, 3.0 - 1.5e-9, 3.0 - 0.5e-9, 3.0, 9.0])
    assert one.own(given).tolist() == [False, False, True, True, True, True, False, False, False]
    assert one.contacts == {"left": BOTH["left"].contacts, "right": BOTH["right"].contacts}


@pytest.mark.parametrize(
    ("mean_n", "weight_n", "is_down"),
    [(25.0, None, False), (25.1, None, True), (25.1, 502.0, False), (25.2, 502.0, True), (26.0, 100.0, True)],
)
def test_a_foot_bears_from_25_newtons_or_a_twentieth_of_the_weight(
    mean_n: float, weight_n: float | None, is_down: bool
) -> None:
    load = np.column_stack([0.6 * mean_n * np.array([0.5, 1.5]), 0.4 * mean_n * np.ones(2)])
    assert is_loaded(foot(), load, weight_n) is is_down
    assert is_loaded(foot(is_force=False), 1e6 * load, weight_n) is False


def test_peaks_are_of_the_stances_that_end_in_the_window() -> None:
    load = np.column_stack([TIME_S, 100.0 - TIME_S])
    own = contacts([NAN, 1.0, 3.0, 5.0, 7.0, 19.0, 19.5], [0.5, 2.0, 4.0, 6.0, NAN, 19.999, 30.0])
    found = _peaks_of(TIME_S, load, own, 2.0, 6.0)
    assert np.array(found) == pytest.approx(np.array([[1.99, 99.0], [3.99, 97.0]]))
    rest = _peaks_of(TIME_S, load, own, 6.0, np.inf)
    assert np.array(rest) == pytest.approx(np.array([[5.99, 95.0], [19.99, 81.0], [20.0, 80.5]]))
    assert _peaks_of(TIME_S, load, contacts([1.001], [1.002]), 0.0, 9.0) == []


def test_a_usual_peak_is_the_median_of_the_stances_or_the_largest_load() -> None:
    load = np.array([[5.0, -3.0], [2.0, -1.0]])
    assert _usual_peak([], load).tolist() == [5.0, 0.0]
    peaks = [np.array([1.0, -2.0]), np.array([3.0, 0.5]), np.array([20.0, 0.7])]
    assert _usual_peak(peaks, load).tolist() == [3.0, 0.5]
    assert _usual_peak(peaks[:1], load).tolist() == [1.0, 0.0]
