"""The statistics of a study, against published numbers and laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from smartshoe.runs.studies._plan import TrialEntry
from smartshoe.runs.studies._statistics import _icc, agreement_of, difference_of, mean_of, prediction_interval
from smartshoe.runs.studies._swapped import swapped_trials
from smartshoe.runs.studies._trials import TrialFigures
from smartshoe.signals.noise import NORMAL_95

# Shrout and Fleiss 1979, table 2: six targets, four judges.
JUDGED = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], dtype=float)


def test_the_intraclass_correlation_is_that_of_shrout_and_fleiss() -> None:
    found = _icc(JUDGED)
    assert found is not None
    value, (low, high) = found
    assert value == pytest.approx(0.29, abs=0.005)
    # The interval that the R package psych prints for ICC2 of these data.
    assert (low, high) == (pytest.approx(0.019, abs=0.001), pytest.approx(0.76, abs=0.005))


def test_a_mean_and_a_small_difference_have_students_interval() -> None:
    values = np.array([1.0, 2.5, 2.0, 4.0])
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert mean_of(values).ci95 == (pytest.approx(expected.low), pytest.approx(expected.high))
    assert difference_of(values).method == "t"
    assert mean_of(values[:1]).ci95 is None


def test_many_subjects_are_resampled_and_the_same_each_time() -> None:
    values = np.random.default_rng(1).normal(2.0, 1.0, 30)
    found = difference_of(values)
    assert found.method == "bootstrap"
    assert found == difference_of(values)
    student = mean_of(values).ci95
    assert found.ci95 is not None
    assert student is not None
    assert np.allclose(found.ci95, student, atol=0.1)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(7)
    held = 0
    for _ in range(400):
        low, high = difference_of(rng.normal(1.0, 2.0, 6)).ci95 or (0.0, 0.0)
        held += low <= 1.0 <= high
    assert abs(held - 380) < 4 * np.sqrt(400 * 0.95 * 0.05)


@given(st.floats(-100, 100), st.integers(0, 1000))
def test_a_bias_moves_the_limits_and_leaves_their_width(shift: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = [rng.normal(500.0, 30.0, (20, 2)) for _ in range(4)]
    before = agreement_of(pairs)
    after = agreement_of([own + np.array([shift, 0.0]) for own in pairs])
    assert after.bias == pytest.approx(before.bias + shift, abs=1e-9)
    assert after.sd == pytest.approx(before.sd, rel=1e-9)
    assert np.ptp(after.limits) == pytest.approx(2 * NORMAL_95 * before.sd, rel=1e-9)


def test_limits_hold_both_what_varies_within_and_between_trials() -> None:
    rng = np.random.default_rng(3)
    pairs = []
    for _ in range(300):
        own = rng.normal(3.0)  # the trial's bias, sd 1
        pairs.append(np.column_stack([500.0 + own + rng.normal(0.0, 2.0, 10), np.full(10, 500.0)]))
    found = agreement_of(pairs)
    assert found.bias == pytest.approx(3.0, abs=4 * np.sqrt(1.0 + 4.0 / 10) / np.sqrt(300))
    assert found.sd == pytest.approx(np.sqrt(1.0 + 4.0), rel=0.08)


def test_identical_measurements_agree_wholly() -> None:
    pairs = [np.column_stack([values, values]) for values in np.arange(12.0).reshape(4, 3)]
    found = agreement_of(pairs)
    assert (found.bias, found.sd, found.icc) == (0.0, 0.0, 1.0)


def _asymmetric(name: str, percent: float, noise: float) -> TrialFigures:
    rng = np.random.default_rng(len(name))
    figures = {
        f"right_over_left_percent.{figure}": percent * size + noise * rng.normal()
        for figure, size in (("peak", 1.0), ("impulse", 0.8), ("stance_time", -0.5))
    }
    return TrialFigures(TrialEntry(file=name, subject="Anna", condition="shod"), figures=figures)


@pytest.mark.parametrize(("percent", "expected"), [(8.0, ["ccc"]), (1.0, [])])
def test_a_trial_that_mirrors_the_others_is_told(percent: float, expected: list[str]) -> None:
    trials = [
        _asymmetric("a", percent, 0.5),
        _asymmetric("bb", percent, 0.5),
        _asymmetric("ccc", -percent, 0.5),
        _asymmetric("dddd", percent, 0.5),
    ]
    assert [trial.entry.file for trial in swapped_trials(trials)] == expected
    assert swapped_trials(trials[:2]) == []


def test_a_prediction_interval_holds_a_further_subject_as_often_as_it_says() -> None:
    rng = np.random.default_rng(8)
    held = []
    for _ in range(2000):
        values = rng.normal(100.0, 15.0, (6, 1))
        low, high = prediction_interval(values[:5])
        held.append(low[0] < values[5, 0] < high[0])
    assert abs(np.mean(held) - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 2000)
    assert prediction_interval(values[:2]) is None
