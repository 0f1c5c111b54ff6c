"""Activity, summary, indices and standing of windows that are written down, beside numbers worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from windows import BOTH, TIME_S, contacts, foot, series, stride, window

from smartshoe.gait import Contacts, Coverage
from smartshoe.gait._trial import feet_of
from smartshoe.gait._trial_sums import TrialSums
from smartshoe.gait._window import AnalysisWindow, analyse_window
from smartshoe.recording import Recording


def trial_sums(*windows: AnalysisWindow, reference: Any = None) -> TrialSums:
    sums = TrialSums({"left": foot(), "right": foot()}, 1.0, reference)
    for one in windows:
        sums.add(one)
    return sums


def test_a_trial_counts_what_it_is_given() -> None:
    sums = trial_sums()
    assert (sums.moved, sums.was_loaded, sums.standing_s, sums.strides) == (False, False, 0.0, {False: 0, True: 0})
    sums.add_contacts("left", contacts([1.0, 2.0], [1.6, 2.6], [[0.0]] * 3))
    sums.add_contacts("left", contacts([3.0], [3.6], [[0.0]]))
    assert (sums.contacts, sums.floors) == ({"left": 3, "right": 0}, {"left": 4, "right": 0})
    sums.add(window(BOTH, loaded={"left": False, "right": True}))
    assert (sums.was_loaded, sums.moved) == (True, False)
    sums.add(window(BOTH, strides=[stride(1.0), stride(2.0, runs=True), stride(4.0, runs=True, gap=True)]))
    assert (sums.was_loaded, sums.moved, sums.strides) == (True, True, {False: 1, True: 2})
    sums.add(window(BOTH, strides=[stride(9.0)]))
    assert sums.strides == {False: 2, True: 2}


def test_standing_is_counted_within_each_window() -> None:
    spans = [(1.0, 4.0), (5.0, 9.0), (12.0, 15.0)]
    first, second = (window(BOTH, spans=spans, start_s=a, end_s=b) for a, b in ((0.0, 7.0), (7.0, 11.0)))
    assert trial_sums(first).standing_s == pytest.approx(5.0)
    assert trial_sums(first, second).standing_s == pytest.approx(7.0)
    assert trial_sums(first).moved
    assert trial_sums(first).activity() == "standing"
    assert trial_sums(window(BOTH, spans=[(1.0, 1.5)])).moved


@pytest.mark.parametrize(
    ("walks", "runs", "standing_s", "feet", "activity"),
    [
        (9, 1, 0.0, 1, "walking"), (8, 2, 0.0, 1, "mixed"), (1, 9, 0.0, 2, "running"), (6, 0, 1.05, 1, "walking"),
        (6, 0, 1.07, 1, "mixed"), (6, 0, 0.52, 2, "walking"), (6, 0, 0.54, 2, "mixed"), (0, 0, 0.0, 1, "mixed"),
    ],
)  # fmt: skip
def test_an_activity_is_by_the_time_of_each_foot_that_steps(
    walks: int, runs: int, standing_s: float, feet: int, activity: str
) -> None:
    names = ("left", "right")[:feet]
    strides = [stride(0.1 * k, foot=names[k % feet], runs=k >= walks) for k in range(walks + runs)]
    assert trial_sums(window(BOTH, strides=strides, spans=[(1.0, 1.0 + standing_s)])).activity() == activity


def test_the_summary_and_the_indices_are_of_the_main_activity() -> None:
    walks, runs = [stride(0.0), stride(1.0)], [stride(3.0, 0.5, runs=True), stride(4.0, 0.5, runs=True, gap=True)]
    half = np.where(TIME_S < 2.0, 0.25, 0.75)
    made = {"left": series(300.0, abnormality=half), "right": series(300.0)}
    sums = trial_sums(window(made, strides=[*walks, *runs]))
    assert sums.summary()["strides"] == {"left": 2, "right": 0}
    assert sums.indices() == {
        "left": {"sequence_error_percent": None, "deviation_percent": pytest.approx(0.0), "abnormality_percent": 25.0},
        "right": {"sequence_error_percent": None, "deviation_percent": None, "abnormality_percent": None},
    }
    sums.add(window(made, strides=runs[:1]))
    assert sums.summary()["strides"] == {"left": 2, "right": 0}
    assert sums.summary()["stride_time_s"]["left"]["mean"] == pytest.approx(1.0)  # as many of either: walking
    assert sums.indices()["left"]["abnormality_percent"] == pytest.approx(25.0)
    sums.add(window(made, strides=runs[:1]))
    assert sums.summary()["strides"] == {"left": 3, "right": 0}
    assert sums.summary()["stride_time_s"]["left"]["mean"] == pytest.approx(0.5)
    assert sums.indices()["left"]["abnormality_percent"] == pytest.approx(75.0)


def test_each_windows_strides_are_compared_with_the_pattern_up_to_it() -> None:
    def of(load_n: np.ndarray) -> AnalysisWindow:
        return window({"left": series(load_n[:, None]), "right": series(0.0)}, strides=[stride(0.0)])

    flat, rising = np.full(2001, 400.0), 400.0 * TIME_S
    found = trial_sums(of(flat), of(rising)).indices()["left"]["deviation_percent"]
    # The first is its own pattern; the second, from 0 to 1 of its peak, beside the mean of both over its peak.
    part = np.linspace(0.0, 1.0, 101)
    assert found == pytest.approx(0.5 * 100.0 * np.sqrt(np.mean((part - (1.0 + part) / 2.0) ** 2)))
    pattern = {"left": np.full((101, 1), 0.5)}
    against = trial_sums(of(flat), reference=pattern).indices()["left"]["deviation_percent"]
    assert against == pytest.approx(50.0)
    assert trial_sums(of(0.0 * flat)).indices()["left"]["deviation_percent"] is None  # it has no peak to be a share of
    for other in ({"right": pattern["left"]}, {"left": np.full((101, 2), 0.5)}):
        assert trial_sums(of(flat), reference=other).indices()["left"]["deviation_percent"] is None


def test_sequence_errors_are_a_share_of_the_strides_judged() -> None:
    regions = ("heel", "meta1")
    strikes = np.array([0.0, 1.0, 2.0, 3.0])
    onset = np.column_stack([strikes, strikes + np.array([0.1, 0.1, 0.0, 0.1])])
    release = np.column_stack([strikes + 0.3, strikes + 0.6])
    own = Contacts(regions, strikes, strikes + 0.6, onset, release, np.zeros(0), np.zeros((0, 2)))
    made = {"left": series([200.0, 100.0], contacts=own), "right": series(0.0)}
    sums = TrialSums({"left": foot((0.0, 0.0)), "right": foot()}, 1.0)
    for starts in ([0.0, 1.0], [2.0, 3.0]):
        sums.add(window(made, strides=[stride(start_s) for start_s in starts]))
    assert sums.indices()["left"]["sequence_error_percent"] == pytest.approx(25.0)


# -- a window that is analysed -------------------------------------------------------------------------------------
def worn(right_column: str = "right_heel_n") -> dict[str, Any]:
    """20 s of a walk: 0.6 s down in each second, 400 N in the left foot and 300 in the right, half a second apart."""
    loads = [peak_n * ((TIME_S + shift_s) % 1.0 < 0.6) for peak_n, shift_s in ((400.0, 0.3), (300.0, 0.8))]
    made = Recording.from_arrays(time_s=TIME_S, name="walk", left_heel_n=loads[0], **{right_column: loads[1]})
    return feet_of([made], ())[0]


def steps(first_s: float, count: int = 19) -> Contacts:
    strikes = first_s + np.arange(float(count))
    return contacts(strikes.tolist(), (strikes + 0.6).tolist(), regions=("heel",))


STEPS = {"left": steps(0.7), "right": steps(0.2)}


def test_a_window_holds_the_strides_that_begin_in_it_and_the_spans_forces_and_peaks_beside_them() -> None:
    feet, peaks = worn(), {"left": [np.array([900.0])], "right": []}
    whole = analyse_window(feet, STEPS, Coverage(0.8), None)
    assert (whole.start_s, whole.end_s, whole.spans) == (-np.inf, np.inf, ())
    assert whole.loaded == {"left": True, "right": True}
    assert len(whole.strides) == 36
    assert whole.total is not None
    assert whole.total.force_n == pytest.approx(sum(foot.load.sum(axis=1) for foot in feet.values()) / 0.8)
    part = analyse_window(feet, STEPS, Coverage(0.8), 9e3, peaks=peaks, start_s=4.7, end_s=6.7)
    assert [(one.foot, round(one.start_s, 6)) for one in part.strides] == [
        ("left", 4.7), ("right", 5.2), ("left", 5.7), ("right", 6.2),
    ]  # fmt: skip
    assert part.loaded == {"left": False, "right": False}  # for somebody of 9 kN
    # Stances that end from 4.7 s on and before 6.7 s: the left ones at 5.3 and 6.3, the right ones at 4.8 and 5.8 s.
    assert [[float(one[0]) for one in own] for own in peaks.values()] == [[900.0, 400.0, 400.0], [300.0, 300.0]]
    assert (part.series["left"].usual_peak[0], part.series["right"].usual_peak[0]) == (400.0, 300.0)
    assert part.series["left"].force_n == pytest.approx(feet["left"].load.sum(axis=1) / 0.8)


def test_where_one_foot_is_no_force_there_is_no_whole_force() -> None:
    feet = worn("right_heel_mbar")
    found = analyse_window(feet, STEPS, Coverage(), None)
    assert found.total is None
    assert found.loaded == {"left": True, "right": False}
    assert found.series["right"].force_n is None
    assert len(found.strides) == 36
