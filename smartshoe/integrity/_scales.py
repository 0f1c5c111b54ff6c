"""Scales that faults do not move: local noise, grid step, corners. All are medians of something."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.noise import NORMAL_QUARTILE

SECOND_DIFFERENCE = math.sqrt(6.0)  # standard deviation of white noise's, over the noise's own
ROUNDING = float(np.sqrt(np.finfo(float).eps))  # of a number: what differs by less differs by rounding


def five_point_median(values: Array) -> Array:
    """(n,) running median of five; the ends repeat."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, 5, mode="nearest"))


def local_scale(deviation: Array, thresholds: Thresholds, step: float = 0.0) -> Array:
    """(n,) root mean square of ``deviation`` near each sample, large ones cut short: largest of three blocks.

    The largest, so that the sample at the foot of a noisy stretch is judged by that stretch. What is beyond ``clear``
    standard deviations, by the median, and one grid ``step`` counts as that much.
    """
    n, block = deviation.size, thresholds.local // 2
    if n == 0:
        return np.zeros(0)
    blocks = max(1, n // block)
    size = np.abs(deviation[: blocks * block]) if n >= block else np.abs(deviation)
    size = size.reshape(blocks, -1)
    limit = thresholds.clear / NORMAL_QUARTILE * np.median(size, axis=1, keepdims=True) + step
    body = np.sqrt(np.mean(np.minimum(size, limit) ** 2, axis=1)) / _cut_short(thresholds.clear)
    wide = body.copy()
    wide[1:] = np.maximum(wide[1:], body[:-1])
    wide[:-1] = np.maximum(wide[:-1], body[1:])
    return np.asarray(wide[np.minimum(np.arange(n) // block, blocks - 1)])


def _cut_short(deviations: float) -> float:
    """Root mean square of a standard normal deviate that counts as ``deviations`` at most."""
    beyond = math.erfc(deviations / math.sqrt(2.0))
    density = math.exp(-0.5 * deviations**2) / math.sqrt(2.0 * math.pi)
    return math.sqrt(1.0 - beyond - 2.0 * deviations * density + deviations**2 * beyond)


def white_noise(values: Array, thresholds: Thresholds, step: float) -> Array:
    """(n,) local standard deviation of white noise, from second differences."""
    second = np.zeros(values.size)
    if values.size > 2:
        second[1:-1] = (values[2:] - 2.0 * values[1:-1] + values[:-2]) / SECOND_DIFFERENCE
    return local_scale(second, thresholds, step)


def turns(second: Array) -> tuple[Mask, Mask]:
    """(n - 1,) each: where ``second`` differences (n,) change sign, as white noise's mostly do; where they keep it."""
    product = second[1:] * second[:-1]
    return product < 0.0, product > 0.0


def slope_change(values: Array, noise: Array, near: int, largest: float) -> Array:
    """(n,) the largest change of increment (per sample) within ``near`` samples, less ``largest`` times the noise.

    A corner between straight lines counts in full, a sharp step by its own second difference.
    """
    from scipy.ndimage import maximum_filter1d

    n = values.size
    padded = np.concatenate([np.full(near, values[0]), values, np.full(near, values[-1])])
    wide = np.abs(padded[2 * near :] - 2.0 * values + padded[:n]) / near
    wide = np.maximum(wide - largest * SECOND_DIFFERENCE * noise / near, 0.0)
    sharp = np.zeros(n)
    sharp[1:-1] = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    sharp = np.maximum(sharp - largest * SECOND_DIFFERENCE * noise, 0.0)
    return maximum_filter1d(np.maximum(wide, sharp), 2 * near + 1, mode="nearest")


def own_corner(values: Array, near: int) -> Array:
    """(n,) change of slope (per sample) from the ``near`` samples before each to those after, itself left out.

    So a spike is judged by its neighbours' lines, and the tip of a triangle by its own two flanks.
    """
    reach = max(near, 4)  # two increments on either side
    n = values.size
    padded = np.concatenate([np.full(reach, values[0]), values, np.full(reach, values[-1])])
    after = padded[2 * reach : 2 * reach + n] - padded[reach + 2 : reach + 2 + n]
    before = padded[reach - 2 : reach - 2 + n] - padded[:n]
    return np.asarray(np.abs(after - before) / (reach - 2))


def grid_step(levels: Array, count: Index, thresholds: Thresholds) -> float:
    """The step of the grid on which values lie; 0 where there is none that can be found.

    ``levels`` (l,) are the values that occur, increasing, ``count`` (l,) how often. Values that occur once are left
    out where most occur often: a spike need not lie on the grid.
    """
    often = count > 1
    if often.sum() >= 3 and count[often].sum() > (1.0 - thresholds.same) * count.sum():
        levels = levels[often]
    if levels.size < 3:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUNDING * np.max(np.abs(levels))]  # two readings of one level that differ by rounding
    if gaps.size < 2:
        return 0.0
    # One step is a gap that occurs often, and the largest of which the others are multiples; values off the grid
    # have made some gaps what they are.
    place, number = np.unique(np.rint(np.log(gaps) / thresholds.standing).astype(np.int64), return_counts=True)
    often_enough = number >= min(thresholds.few, int(number.max()))
    common = number >= thresholds.same * number.max()
    offered = np.concatenate([place[often_enough][: thresholds.local], place[common][: thresholds.local]])
    some = gaps[:: max(1, gaps.size // thresholds.bins)]
    within = 0.5 * thresholds.same
    steps = [_refined(some, float(np.exp(thresholds.standing * one)), within) for one in np.unique(offered)[::-1]]
    # A ramp without noise takes every tenth step, say: what fits all gaps comes before what fits most.
    shares = [np.count_nonzero(_fits(some, step, within)) / some.size if step > 0.0 else 0.0 for step in steps]
    nearly_all, most = 1.0 - thresholds.standing, 1.0 - thresholds.same
    for least in (
        (nearly_all,) if gaps.size < thresholds.local else (nearly_all, most)
    ):  # three gaps of ten fit any step
        for step, share in zip(steps, shares, strict=True):
            if share > least:
                return step
    return 0.0


def _fits(gaps: Array, step: float, within: float) -> Mask:
    """(g,) which gaps are multiples of ``step``, one at least, ``within`` a share of it."""
    multiple = np.rint(gaps / step)
    return (multiple >= 1.0) & (np.abs(gaps / step - multiple) < within)


def _refined(gaps: Array, step: float, within: float) -> float:
    """The step by the gaps that are its multiples, 0 where none is."""
    near = gaps[_fits(gaps, step, within)]
    if not near.size:
        return 0.0
    sizes = np.sort(near / np.rint(near / step))
    # np.median of a few dozen gaps, for each of a hundred steps of each recording, takes five times as long.
    return 0.5 * float(sizes[(sizes.size - 1) // 2] + sizes[sizes.size // 2])
