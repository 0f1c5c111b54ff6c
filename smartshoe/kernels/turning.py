"""Finds where a load turns; the plain twin is in tests/signals/test_turning_points.py."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def turning_points(load, threshold, points):  # type: ignore[no-untyped-def]
    """Fill ``points`` (n + 1,) with the samples where ``load`` (n,) turns by more than ``threshold``.

    Returns their number. The first one is the first sample; a zig-zag within the threshold is not a turn.
    """
    found, direction, low, high = 1, 0, 0, 0
    points[0] = 0
    lowest = highest = load[0]
    for k in range(load.size):
        now = load[k]
        if now > highest:
            high, highest = k, now
        if now < lowest:
            low, lowest = k, now
        falls, rises = highest - now > threshold, now - lowest > threshold
        if direction >= 0 and falls:
            points[found] = high
        elif direction <= 0 and rises:
            points[found] = low
        else:
            continue
        direction = -1 if direction >= 0 and falls else 1
        found += 1
        low = high = k
        lowest = highest = now
    return found
