"""Residual of a reading after refitting a first-order baseline: the measure of an effect's strength.

A simple fit, independent of smartshoe's own: the reading from load, load through one lag, and a constant. It is linear
except for the pole, which is searched on a grid and then refined. The lag's coefficient is not negative, as in a
standard linear solid with a passive arm (eq. 2-4 of Chinimilli 2016: the static gain is the larger one), so that heat
of the gas does not pass for relaxation.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from smartshoe.arrays import Array
from smartshoe.kernels.blas import on_one_thread

SLOWEST, FASTEST = 0.005, 30.0  # 1/s, range of the poles that are tried
GRID = 14
POLE_TOLERANCE = 1e-4  # relative


def lagged(load_n: Array, step_s: float, pole: float) -> Array:
    """``load_n`` (n,) through 1/(s/pole + 1), linear between samples, starting in equilibrium with its first value."""
    z = pole * step_s
    keep, mean = np.exp(-z), -np.expm1(-z) / z
    start = [(1.0 - (1.0 - mean)) * load_n[0]]
    return np.asarray(lfilter([1.0 - mean, mean - keep], [1.0, -keep], load_n, zi=start)[0])


@on_one_thread
def residual(load_n: Array, reading: Array, step_s: float, *, constant: bool = True) -> Array:
    """Residual (n,) of ``reading`` (n,) after the best baseline, in the same unit; NaN where the reading is missing."""
    present = np.isfinite(reading)
    whole = bool(present.all())
    fixed = np.column_stack([load_n, np.ones(load_n.size)] if constant else [load_n])
    y = reading if whole else reading[present]
    fixed = fixed if whole else fixed[present]
    basis, _ = np.linalg.qr(fixed)
    y_left = y - basis @ (basis.T @ y)

    def gained(pole: float) -> tuple[float, Array]:
        column = lagged(load_n, step_s, pole)
        column = column if whole else column[present]
        left = column - basis @ (basis.T @ column)
        size = float(left @ left)
        if size <= 1e-20 * float(column @ column):
            return 0.0, left
        return max(float(left @ y_left), 0.0) ** 2 / size, left

    poles = np.geomspace(SLOWEST, FASTEST, GRID)
    best = int(np.argmax([gained(pole)[0] for pole in poles]))
    low, high = poles[max(best - 1, 0)], poles[min(best + 1, GRID - 1)]
    found = minimize_scalar(
        lambda log_pole: -gained(float(np.exp(log_pole)))[0],
        bounds=(np.log(low), np.log(high)),
        method="bounded",
        options={"xatol": POLE_TOLERANCE},
    )
    best_pole = float(np.exp(found.x))
    left = gained(best_pole)[1]
    size = float(left @ left)
    rest = y_left - left * (max(float(left @ y_left), 0.0) / size) if size > 0 else y_left
    if whole:
        return rest
    out = np.full(reading.size, np.nan)
    out[present] = rest
    return out


def left_over(load_n: Array, reading: Array, step_s: float, *, constant: bool = True) -> float:
    """Root mean square of `residual`, in the reading's unit."""
    rest = residual(load_n, reading, step_s, constant=constant)
    return float(np.sqrt(np.nanmean(rest**2)))
