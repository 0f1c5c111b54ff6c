"""The compiled pass over a load finds the turns that a plain one finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.signals.loading import turning_points


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
