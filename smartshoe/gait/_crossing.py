"""When a load begins and ends: level crossings between samples, extrapolated down to lower levels.

A threshold above the noise is reached late at the onset and left early at the release. Three levels, each twice the one
below, are crossed at t1, t2, t3; a load that rises as (t - t0)^p crosses them in the ratio (t3 - t2)/(t2 - t1) =
2^(1/p), whatever its height. The median of that ratio over strides gives p, and t1 - t0 = (t2 - t1)/(2^(1/p) - 1) is
the delay from the onset to the lowest level. The running median of that delay over neighbouring strides is subtracted
from t1; to find a level between zero and the lowest one, only the part between the two is subtracted.

Near an onset one sampling interval is long: one sample is still on the floor, the next is far above it, and linear
interpolation between them gives too early a crossing. There the same power law, through the next two samples, gives the
time of the crossing.
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array

STEEPEST, FLATTEST = 1.0, 2.5  # range of the power p of an onset
USUAL_POWER = 1.5
NEIGHBOURS = 9
FEWEST = 3


def running_median(values: Array, count: int) -> Array:
    """Running median (m,) over ``count`` neighbours of each of ``values`` (m,), fewer at the ends.

    NaN is ignored; the result is NaN only where all neighbours are NaN.
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

    Returns places (m, l) in samples from the start of the row, interpolated linearly; NaN if the row never reaches
    ``top`` or is above a level from its first sample on.
    """
    rows, width = loads.shape
    if loads.size == 0:  # no contacts, or a rate so low that no sample lies near one
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
    """2^(1/p) of onsets that cross doubling levels at ``places`` (m, 3); ``usual`` if too few cross all three."""
    first, second = places[:, 1] - places[:, 0], places[:, 2] - places[:, 1]
    good = np.isfinite(first) & np.isfinite(second) & (first > 0)
    if np.count_nonzero(good) < FEWEST:
        return usual
    return float(np.clip(np.median(second[good] / first[good]), 2.0 ** (1.0 / FLATTEST), 2.0 ** (1.0 / STEEPEST)))


def level_places(places: Array, ratio: float, share: Array) -> Array:
    """Where (m,) loads cross the level that is ``share`` (m,) of the lowest of three doubling levels; 0 is the onset.

    ``places`` (m, 3) are the crossings of the three levels, ``ratio`` is their `growth`.
    """
    bias = running_median((places[:, 1] - places[:, 0]) / (ratio - 1.0), NEIGHBOURS)
    # (share)^(1/p), where 2^(1/p) is the ratio
    return np.asarray(places[:, 0] - bias * (1.0 - share ** np.log2(ratio)))


def bent_places(loads: Array, level: Array, places: Array, ratio: float) -> Array:
    """Correct the crossings ``places`` (m,) of ``level`` (m,) by rows (m, w) for the curvature of an onset.

    ``places`` come from linear interpolation. They are replaced where the power law of `growth` ``ratio``, laid through
    the two samples above the level, has its onset after the sample below the level.
    """
    row, last = np.arange(places.size), loads.shape[1] - 1
    below = np.floor(np.nan_to_num(places)).astype(np.intp)
    first, second = loads[row, np.minimum(below + 1, last)], loads[row, np.minimum(below + 2, last)]
    grows = (second > first) & (first > level) & (level > 0)
    first, second = np.where(grows, first, 1.0), np.where(grows, second, 2.0)
    since_onset = 1.0 / ((second / first) ** np.log2(ratio) - 1.0)  # samples from the onset to the first one above
    bent = below + 1 - since_onset * (1.0 - (np.maximum(level, 0.0) / first) ** np.log2(ratio))
    return np.where(grows & (since_onset < 1.0), bent, places)
