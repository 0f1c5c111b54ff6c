"""When a reading answers what its load does anew: how late what neither foretells of itself is in the other.

A reading that lags by as long as its load stays on one level is never near its curve, and moves against the load as
often as with it. But what it does next, beyond what it did before, is what the load did just then. So both are whitened
(each is foretold by its own last few samples), and the innovations are correlated: of a reading and a load that have
nothing to do with one another these are independent, whatever slow course each has (Haugh 1976).
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise


def answered_s(time_s: Array, load: Array, reading: Array, width_s: float, thresholds: Thresholds) -> float | None:
    """How late a ``reading`` (n,) answers its ``load`` (n,), in bins of ``width_s``; None where that is not certain.

    It answers where one correlation of innovations is beyond chance, and no other is half as large (`clear`) but the
    ``few`` beside it: of a load that repeats itself there are others, and a step or two tell nothing.
    """
    given = thresholds
    bins = int((time_s[-1] - time_s[0]) / width_s)
    if bins < given.least_samples:
        return None
    grid = time_s[0] + (np.arange(bins) + 0.5) * width_s
    new = [_innovations(binned(time_s, one, grid, width_s), given) for one in (load, reading)]
    sizes = [float(np.linalg.norm(one)) for one in new]
    if min(sizes) == 0.0:
        return None
    together = _correlated(new[0] / sizes[0], new[1] / sizes[1])
    late = np.arange(together.size) - together.size // 2
    best = int(np.argmax(together))
    beside = np.abs(late - late[best]) <= given.few
    is_sure = together[best] * np.sqrt(new[0].size) > largest_of_noise(late.size, given)
    is_only = together[best] > given.clear * float(np.max(together[~beside]))
    return float(late[best]) * width_s if is_sure and is_only else None


def _innovations(values: Array, thresholds: Thresholds) -> Array:
    """(n - few,) what the ``few`` values before each foretell of it in a straight line, taken off.

    The largest are cut short, which jumps are, and single steps: they would be all that is correlated.
    """
    few, shifted = thresholds.few, values - values.mean()
    before = np.stack([shifted[few - 1 - k : shifted.size - 1 - k] for k in range(few)], axis=1)
    before = np.concatenate([before, np.ones((before.shape[0], 1))], axis=1)
    new = shifted[few:] - before @ np.linalg.lstsq(before, shifted[few:], rcond=None)[0]
    cut = cut_short(new, thresholds)
    return np.asarray(cut - cut.mean())


def cut_short(values: Array, thresholds: Thresholds) -> Array:
    """(n,) ``values``, of which the largest and the smallest, a ``faulty_share`` together, are no farther out."""
    ends = 0.5 * thresholds.faulty_share * np.array([1.0, -1.0]) + np.array([0.0, 1.0])
    return np.asarray(np.clip(values, *np.quantile(values, ends)))


def _correlated(load: Array, reading: Array) -> Array:
    """(2 m + 1,) sizes of the correlations at lags -m..m of the reading, m a quarter of the samples."""
    from scipy.signal import correlate

    most = load.size // 4
    products = correlate(reading, load, mode="full", method="fft")
    return np.abs(products[load.size - 1 - most : load.size + most])


def binned(time_s: Array, values: Array, grid: Array, width_s: float) -> Array:
    """Means over bins, empty ones interpolated."""
    place = np.minimum(((time_s - time_s[0]) / width_s).astype(np.intp), grid.size - 1)
    count = np.bincount(place, minlength=grid.size)
    total = np.bincount(place, weights=values, minlength=grid.size)
    filled = count > 0
    return np.interp(grid, grid[filled], total[filled] / count[filled])
