"""Scales that faults do not move, since they rest on medians: local noise, the grid's step, corners."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.noise import NORMAL_QUARTILE

SECOND_DIFFERENCE = math.sqrt(6.0)  # standard deviation of a second difference of white noise, over the noise's
ROUNDING = float(np.sqrt(np.finfo(float).eps))  # share of a number: smaller differences are by rounding


def five_point_median(values: Array) -> Array:
    """(n,) running median of five ``values``; the first and the last are repeated beyond the ends."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, 5, mode="nearest"))


def local_scale(deviation: Array, thresholds: Thresholds, step: float = 0.0) -> Array:
    """(n,) root mean square of ``deviation`` (n,) near each sample: the largest of its block's and the two neighbours'.

    The largest, so that a sample at the foot of a noisy stretch is judged by that stretch. Deviations are clipped at
    ``clear`` standard deviations, by the block's median, and one grid ``step``; the result allows for that.
    """
    n, block = deviation.size, thresholds.local // 2
    if n == 0:
        return np.zeros(0)
    blocks = max(1, n // block)
    size = np.abs(deviation[: blocks * block]) if n >= block else np.abs(deviation)
    size = size.reshape(blocks, -1)
    limit = thresholds.clear / NORMAL_QUARTILE * np.median(size, axis=1, keepdims=True) + step
    by_block = np.sqrt(np.mean(np.minimum(size, limit) ** 2, axis=1)) / _clipped_rms(thresholds.clear)
    largest = by_block.copy()
    largest[1:] = np.maximum(largest[1:], by_block[:-1])
    largest[:-1] = np.maximum(largest[:-1], by_block[1:])
    return np.asarray(largest[np.minimum(np.arange(n) // block, blocks - 1)])


def _clipped_rms(deviations: float) -> float:
    """Root mean square of a standard normal deviate whose size is clipped at ``deviations``."""
    beyond = math.erfc(deviations / math.sqrt(2.0))
    density = math.exp(-0.5 * deviations**2) / math.sqrt(2.0 * math.pi)
    return math.sqrt(1.0 - beyond - 2.0 * deviations * density + deviations**2 * beyond)


def white_noise(values: Array, thresholds: Thresholds, step: float) -> Array:
    """(n,) local standard deviation of white noise on ``values`` (n,) with a grid ``step``, from second differences."""
    second = np.zeros(values.size)
    if values.size > 2:
        second[1:-1] = (values[2:] - 2.0 * values[1:-1] + values[:-2]) / SECOND_DIFFERENCE
    return local_scale(second, thresholds, step)


def turns(second: Array) -> tuple[Mask, Mask]:
    """(n - 1,) each: where ``second`` differences (n,) change sign, and where they keep it.

    Those of white noise mostly change it, those of a curve keep it.
    """
    product = second[1:] * second[:-1]
    return product < 0.0, product > 0.0


def is_turning(values: Array) -> bool:
    """Whether second differences of ``values`` (n,) change sign more often than they keep it, as of noise."""
    turned, stayed = turns(np.diff(values, 2))
    return bool(turned.sum() > stayed.sum())


def slope_change(values: Array, noise: Array, near: int, largest: float) -> Array:
    """(n,) the largest change of slope within ``near`` samples, per sample, less ``largest`` times the ``noise`` (n,).

    A corner between straight lines counts in full, a sharp step by its own second difference.
    """
    from scipy.ndimage import maximum_filter1d

    n = values.size
    padded = np.pad(values, near, "edge")
    over_near = np.abs(padded[2 * near :] - 2.0 * values + padded[:n]) / near
    over_near = np.maximum(over_near - largest * SECOND_DIFFERENCE * noise / near, 0.0)
    at_once = np.zeros(n)
    at_once[1:-1] = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    at_once = np.maximum(at_once - largest * SECOND_DIFFERENCE * noise, 0.0)
    return maximum_filter1d(np.maximum(over_near, at_once), 2 * near + 1, mode="nearest")


def own_corner(values: Array, near: int) -> Array:
    """(n,) change of slope, per sample, from the ``near`` samples before each sample to those after, itself left out.

    So a spike is judged by the lines of its neighbours, and the tip of a triangle by its two flanks.
    """
    reach = max(near, 4)  # two increments on either side
    n = values.size
    padded = np.pad(values, reach, "edge")
    after = padded[2 * reach : 2 * reach + n] - padded[reach + 2 : reach + 2 + n]
    before = padded[reach - 2 : reach - 2 + n] - padded[:n]
    return np.asarray(np.abs(after - before) / (reach - 2))


def grid_step(levels: Array, count: Index, thresholds: Thresholds) -> float:
    """The step of the grid on which values lie; 0 where none is found.

    1. ``levels`` (l,) are the values that occur, increasing, ``count`` (l,) how often. Values that occur once are left
       out where most occur more often: a spike need not lie on the grid.
    2. The step is the largest of the common gaps between levels, of which the other gaps are multiples. Each candidate
       is refined by the gaps that are its multiples.
    3. Nearly all gaps must be multiples, or else most. A ramp without noise may take every tenth step only, so that a
       step that fits nearly all gaps comes first.
    """
    recurs = count > 1
    if recurs.sum() >= 3 and count[recurs].sum() > (1.0 - thresholds.same) * count.sum():
        levels = levels[recurs]
    if levels.size < 3:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUNDING * np.max(np.abs(levels))]  # two readings of one level that differ by rounding
    if gaps.size < 2:
        return 0.0
    # Gaps of about one size are counted together. Values off the grid have made some gaps what they are.
    size_class, number = np.unique(np.rint(np.log(gaps) / thresholds.standing).astype(np.int64), return_counts=True)
    often_enough = number >= min(thresholds.few, int(number.max()))
    common = number >= thresholds.same * number.max()
    candidates = np.concatenate([size_class[often_enough][: thresholds.local], size_class[common][: thresholds.local]])
    sampled = gaps[:: max(1, gaps.size // thresholds.bins)]
    within = 0.5 * thresholds.same
    steps = [_refined(sampled, float(np.exp(thresholds.standing * one)), within) for one in np.unique(candidates)[::-1]]
    shares = [np.count_nonzero(_fits(sampled, step, within)) / sampled.size if step > 0.0 else 0.0 for step in steps]
    nearly_all, most = 1.0 - thresholds.standing, 1.0 - thresholds.same
    # Of few gaps most may be multiples of a step by chance.
    for needed in (nearly_all,) if gaps.size < thresholds.local else (nearly_all, most):
        for step, share in zip(steps, shares, strict=True):
            if share > needed:
                return step
    return 0.0


def _fits(gaps: Array, step: float, within: float) -> Mask:
    """(g,) which ``gaps`` (g,) are multiples of ``step``, one at least, to a share ``within`` of it."""
    multiple = np.rint(gaps / step)
    return (multiple >= 1.0) & (np.abs(gaps / step - multiple) < within)


def _refined(gaps: Array, step: float, within: float) -> float:
    """The median step by the ``gaps`` that are multiples of a ``step``; 0 where none is."""
    near = gaps[_fits(gaps, step, within)]
    if not near.size:
        return 0.0
    sizes = np.sort(near / np.rint(near / step))
    # Sorting is five times as fast as np.median on a few dozen gaps, and there are a hundred steps to a recording.
    return 0.5 * float(sizes[(sizes.size - 1) // 2] + sizes[sizes.size // 2])
