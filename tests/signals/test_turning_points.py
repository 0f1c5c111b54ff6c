"""The compiled pass over a load finds the turns that a plain one finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.signals.loading import rises_of, turning_points


def plain(loads: list[float], threshold: float) -> list[int]:
    """A zig-zag: a turn is told once the load has left its extreme by more than the threshold."""
    points, direction, low, high = [0], 0, 0, 0
    for k, load in enumerate(loads):
        high = k if load > loads[high] else high
        low = k if load < loads[low] else low
        if direction >= 0 and loads[high] - load > threshold:
            points.append(high)
            direction, low, high = -1, k, k
        elif direction <= 0 and load - loads[low] > threshold:
            points.append(low)
            direction, low, high = 1, k, k
    return [*points, len(loads) - 1]


@given(
    loads=st.lists(st.integers(-5, 5).map(float) | st.floats(-5.0, 5.0), min_size=1, max_size=40),
    threshold=st.sampled_from([0.0, 0.5, 1.0, 3.0]),
)
def test_the_turns_are_those_of_a_plain_pass(loads: list[float], threshold: float) -> None:
    assert turning_points(np.array(loads), threshold) == plain(loads, threshold)


@pytest.mark.parametrize("ripple", [0.0, 0.04])
def test_a_triangle_turns_where_it_was_drawn_whatever_ripples_on_it(ripple: float) -> None:
    corners = [0, 50, 120, 200]
    load = np.interp(np.arange(201), corners, [0.0, 1.0, 0.2, 0.9]) + ripple * (np.arange(201) % 2)
    assert sorted(set(turning_points(load, 0.1))) == pytest.approx(corners, abs=3)  # the first may stand twice


def test_nothing_turns_in_no_sample() -> None:
    assert turning_points(np.zeros(0), 0.1) == [-1]


@given(
    loads=st.lists(st.integers(-5, 5).map(float) | st.floats(-5.0, 5.0), min_size=1, max_size=40),
    threshold=st.sampled_from([0.0, 0.5, 1.0, 3.0]),
)
def test_a_rise_goes_up_by_more_than_what_makes_one_also_at_the_ends(loads: list[float], threshold: float) -> None:
    """And one is found where a load has risen by more and falls again by more, or ends."""
    load = np.array(loads)
    found = rises_of(load, threshold)
    assert all(foot < top and load[top] - load[foot] > threshold for foot, top in found)
    risen = load - np.minimum.accumulate(load)
    falls = load - np.minimum.accumulate(load[::-1])[::-1]
    falls[-1] = np.inf
    assert bool(found) or not np.any((risen > threshold) & (falls > threshold))


@pytest.mark.parametrize(("threshold", "rises"), [(0.1, 1), (0.08, 1), (0.07, 2)])
def test_a_bump_after_a_press_that_falls_by_less_is_no_rise(threshold: float, rises: int) -> None:
    load = np.interp(np.arange(400), [20, 80, 140, 300, 320, 340, 399], [0.0, 1.0, 0.0, 0.0, 0.085, 0.01, 0.02])
    assert len(rises_of(load, threshold)) == rises
