"""How late a reading answers changes of its load, also where it lags by longer than the load stays on one level.

Such a reading is never near its curve, and moves against the load as often as with it. But what is new in it, beyond
what its own past foretells, is due to what was new in the load. So each signal is predicted from its own last few
samples, and the prediction errors (innovations) of both are correlated at all lags. If the two had nothing to do with
each other the innovations would be independent, however slow either signal is (Haugh 1976).
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity._view import View
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.lags import left_by


def answered_s(view: View, width_s: float) -> float | None:
    """How late in s the reading answers its load, to a bin of ``width_s``; None where it is uncertain.

    It is certain where the largest correlation of innovations is beyond chance, and is larger by the factor `clear`
    than all others but the ``few`` beside it. A load that repeats itself has others; a step or two have none beyond
    chance.
    """
    given, time_s = view.thresholds, view.time_s
    bins = int((time_s[-1] - time_s[0]) / width_s)
    if bins < given.least_samples:
        return None
    grid = time_s[0] + (np.arange(bins) + 0.5) * width_s
    innovations = [_innovations(binned(time_s, one.values, grid, width_s), given) for one in (view.load, view.reading)]
    norms = [float(np.linalg.norm(one)) for one in innovations]
    if min(norms) == 0.0:
        return None
    correlations = _correlated(innovations[0] / norms[0], innovations[1] / norms[1])
    lags = np.arange(correlations.size) - correlations.size // 2
    best = int(np.argmax(correlations))
    is_near_best = np.abs(lags - lags[best]) <= given.few
    is_sure = correlations[best] * np.sqrt(innovations[0].size) > largest_of_noise(lags.size, given)
    is_only = correlations[best] > given.clear * float(np.max(correlations[~is_near_best]))
    return float(lags[best]) * width_s if is_sure and is_only else None


def _innovations(values: Array, thresholds: Thresholds) -> Array:
    """(n - few,) errors of predicting each value from the ``few`` before it, by least squares.

    The largest errors are clipped: jumps and single steps would else make up the whole correlation.
    """
    few, shifted = thresholds.few, values - values.mean()
    past = np.stack([shifted[few - 1 - k : shifted.size - 1 - k] for k in range(few)], axis=1)
    errors = left_by(np.column_stack([past, np.ones(len(past))]), shifted[few:])
    clipped = cut_short(errors, thresholds)
    return np.asarray(clipped - clipped.mean())


def cut_short(values: Array, thresholds: Thresholds) -> Array:
    """(n,) ``values`` (n,), clipped at the quantiles beyond which a ``faulty_share`` lies, half at either end."""
    ranks = 0.5 * thresholds.faulty_share * np.array([1.0, -1.0]) + np.array([0.0, 1.0])
    return np.asarray(np.clip(values, *np.quantile(values, ranks)))


def _correlated(load: Array, reading: Array) -> Array:
    """(2 m + 1,) sizes of the correlations at lags -m to m of the reading in samples, m a quarter of n."""
    from scipy.signal import correlate

    most = load.size // 4
    products = correlate(reading, load, mode="full", method="fft")
    return np.abs(products[load.size - 1 - most : load.size + most])


def in_bins(view: View, samples: int) -> tuple[float, Array, Array, Array]:
    """Even bins of ``samples`` at least: their width in s; (b,) their middles in s, load and reading without spikes."""
    count = min(view.thresholds.bins, view.time_s.size // samples)
    width_s = float(view.time_s[-1] - view.time_s[0]) / count
    grid = view.time_s[0] + (np.arange(count) + 0.5) * width_s
    both = (five_point_median(one.values) for one in (view.load, view.reading))
    load, reading = (binned(view.time_s, one, grid, width_s) for one in both)
    return width_s, grid, load, reading


def binned(time_s: Array, values: Array, grid: Array, width_s: float) -> Array:
    """(b,) means of ``values`` (n,) over bins of ``width_s`` around ``grid`` (b,); empty bins are interpolated."""
    place = np.minimum(((time_s - time_s[0]) / width_s).astype(np.intp), grid.size - 1)
    count = np.bincount(place, minlength=grid.size)
    total = np.bincount(place, weights=values, minlength=grid.size)
    filled = count > 0
    return np.interp(grid, grid[filled], total[filled] / count[filled])
