"""Figures of merit of a force estimate against the reference load."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.signals.noise import NORMAL_95


def rmse(error: Array) -> float:
    """Root mean square of ``error`` (n,), in its unit."""
    return float(np.sqrt(np.mean(error**2)))


def improvement_percent(before: float, after: float) -> float | None:
    """P% of Chinimilli 2016, Section VI: 100 (before - after)/before; None where ``before`` is 0."""
    return 100.0 * (before - after) / before if before > 0 else None


def best_static(reading: Array, load_n: Array) -> tuple[float, float]:
    """Gain and offset (N per reading unit, N) of the least-squares line from reading to load."""
    design = np.column_stack([reading, np.ones_like(reading)])
    (gain, offset), *_ = np.linalg.lstsq(design, load_n, rcond=None)
    return float(gain), float(offset)


def loop_area(load_n: Array, estimate_n: Array) -> float:
    """Area in N^2 enclosed by the closed path (load, estimate), by the shoelace formula; never negative."""
    return float(0.5 * abs(np.dot(load_n, np.roll(estimate_n, -1)) - np.dot(estimate_n, np.roll(load_n, -1))))


def loop_width(load_up: Array, estimate_up: Array, load_down: Array, estimate_down: Array) -> float | None:
    """Largest difference in N between loading and unloading estimate at equal load.

    None where the loads do not overlap. Both branches are averaged in bins of load, so that noise of single samples
    does not determine the result.
    """
    low = max(load_up.min(), load_down.min())
    high = min(load_up.max(), load_down.max())
    if high <= low:
        return None
    edges = np.linspace(low, high, 21)

    def branch(load: Array, estimate: Array) -> Array:
        which = np.digitize(load, edges)
        counts = np.bincount(which, minlength=edges.size + 1)[1 : edges.size]
        # The mean error, not the mean estimate, so that the samples' position in a bin does not matter.
        sums = np.bincount(which, weights=estimate - load, minlength=edges.size + 1)[1 : edges.size]
        return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)

    difference = np.abs(branch(load_up, estimate_up) - branch(load_down, estimate_down))
    return float(np.nanmax(difference)) if np.isfinite(difference).any() else None


def delay_s(load_n: Array, estimate_n: Array, sample_time_s: float) -> float | None:
    """Time in s by which the estimate lags the load: least squares of the estimate on load, its slope and a constant.

    This is the first-order expansion of a shift, valid while the delay is short compared with the ramps; gain and
    offset have terms of their own, so that they do not pass for a delay. None where the load does not move, where the
    estimate does not follow it (the 95 % interval of its gain includes 0), and where the delay would exceed the record.
    """
    slope = np.gradient(load_n, sample_time_s)
    design = np.column_stack([load_n, slope, np.ones_like(load_n)])
    scale = np.abs(design).max(axis=0)
    if scale[1] == 0.0 or scale[0] == 0.0:
        return None
    columns = design / scale
    found, _, rank, _ = np.linalg.lstsq(columns, estimate_n, rcond=None)
    if rank < 3 or load_n.size <= 3:
        return None
    error = estimate_n - columns @ found
    variance = float(error @ error) / (load_n.size - 3)
    # The pseudo-inverse, since the normal matrix has the square of the columns' condition number.
    gain_sd = float(np.sqrt(variance) * np.linalg.norm(np.linalg.pinv(columns)[0]))
    if abs(found[0]) <= NORMAL_95 * gain_sd:
        return None
    delay = float(-(found[1] / scale[1]) / (found[0] / scale[0]))
    return delay if abs(delay) < load_n.size * sample_time_s else None
