"""When a load begins and ends: level crossings between samples, and the way down from a crossing to a lower level.

A threshold that noise cannot meet is met late at the onset and early at the release. Three levels, each twice the one
below, are crossed at t1, t2, t3; a load that rises as (t - t0)^p crosses them in the ratio (t3 - t2)/(t2 - t1) =
2^(1/p), whatever its height. The median of that ratio over strides gives p, and t1 - t0 = (t2 - t1)/(2^(1/p) - 1) is
how late the lowest level is against zero load. Its running median over neighbouring strides, or what a lower level
leaves of it, is taken off.

A sample is long against an onset: of two samples the first is still on the floor, the next far above it, and a straight
line between them is early. There the same power law through the next two samples says when the level is crossed.
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array

STEEPEST, FLATTEST = 1.0, 2.5  # the powers p that an onset may have
USUAL_POWER = 1.5
NEIGHBOURS = 9
FEWEST = 3


def running_median(values: Array, count: int) -> Array:
    """Median (m,) of each value (m,) with its ``count`` nearest in order, shorter at the ends; NaN is left out.

    NaN only where all of them are NaN.
    """
    if values.size == 0:
        return values.copy()
    half = count // 2
    padded = np.concatenate([np.full(half, np.nan), values, np.full(half, np.nan)])
    windows = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)
    there = np.count_nonzero(np.isfinite(windows), axis=1)
    row = np.arange(values.size)
    low, high = np.maximum(there - 1, 0) // 2, there // 2
    high = np.minimum(high, np.maximum(there - 1, 0))
    return np.asarray(np.where(there > 0, 0.5 * (windows[row, low] + windows[row, high]), np.nan))


def rise_places(loads: Array, levels: Array, top: Array) -> Array:
    """Where each row of ``loads`` (m, w) last crosses ``levels`` (m, l) upwards before it first reaches ``top`` (m,).

    In samples from the row's first, by straight lines between samples; NaN where the row never reaches ``top`` or is
    above a level from its first sample on.
    """
    rows, width = loads.shape
    if loads.size == 0:  # no row, or a rate so low that no sample lies by a contact
        return np.full(levels.shape, np.nan)
    above = loads >= top[:, None]
    reached = above.any(axis=1)
    at_top = np.where(reached, above.argmax(axis=1), width - 1)
    before = np.arange(width)[None, :] <= at_top[:, None]
    places = np.full(levels.shape, np.nan)
    row = np.arange(rows)
    for column in range(levels.shape[1]):
        level = levels[:, column]
        below = (loads < level[:, None]) & before
        last = width - 1 - below[:, ::-1].argmax(axis=1)
        found = reached & below.any(axis=1) & (last < width - 1)
        last = np.where(found, last, 0)
        low, high = loads[row, last], loads[row, np.minimum(last + 1, width - 1)]
        step = np.where(high > low, high - low, 1.0)
        places[:, column] = np.where(found, last + (level - low) / step, np.nan)
    return places


def growth(places: Array, usual: float) -> float:
    """2^(1/p) of onsets that cross doubling levels at ``places`` (m, 3); ``usual`` where too few cross all three."""
    first, second = places[:, 1] - places[:, 0], places[:, 2] - places[:, 1]
    good = np.isfinite(first) & np.isfinite(second) & (first > 0)
    if np.count_nonzero(good) < FEWEST:
        return usual
    return float(np.clip(np.median(second[good] / first[good]), 2.0 ** (1.0 / FLATTEST), 2.0 ** (1.0 / STEEPEST)))


def level_places(places: Array, ratio: float, share: Array) -> Array:
    """Where (m,) loads cross ``share`` (m,) of the lowest of doubling levels, 0 their onset, by their `growth`.

    ``places`` (m, 3) are the crossings of the three levels.
    """
    bias = running_median((places[:, 1] - places[:, 0]) / (ratio - 1.0), NEIGHBOURS)
    # (share)^(1/p), and 2^(1/p) is the ratio.
    return np.asarray(places[:, 0] - bias * (1.0 - share ** np.log2(ratio)))


def bent_places(loads: Array, level: Array, places: Array, ratio: float) -> Array:
    """``places`` (m,), where rows (m, w) cross ``level`` (m,) by straight lines, by their `growth` where that is surer.

    It is where the power law through the two samples above the level begins after the sample below it.
    """
    row, last = np.arange(places.size), loads.shape[1] - 1
    below = np.floor(np.nan_to_num(places)).astype(np.intp)
    first, second = loads[row, np.minimum(below + 1, last)], loads[row, np.minimum(below + 2, last)]
    grows = (second > first) & (first > level) & (level > 0)
    first, second = np.where(grows, first, 1.0), np.where(grows, second, 2.0)
    since_onset = 1.0 / ((second / first) ** np.log2(ratio) - 1.0)  # of the first sample above, in samples
    bent = below + 1 - since_onset * (1.0 - (np.maximum(level, 0.0) / first) ** np.log2(ratio))
    return np.where(grows & (since_onset < 1.0), bent, places)
