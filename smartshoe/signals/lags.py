"""First-order lags of a sampled signal, regressors made of them, and what least squares on such leave of a signal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array


def lagged(signal: Array, step_s: float, tau_s: float) -> Array:
    """``signal`` (n,) through a first-order lag that holds each sample for one step, started in steady state."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step_s / tau_s))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], signal, zi=np.array([keep * signal[0]]))[0])


def share_regressors(share: Array, step_s: float, time_constants_s: Sequence[float] | Array) -> Array:
    """(n, 3 + k) a ``share`` (n,) of the load's span, its square and cube, and it behind k first-order lags."""
    lags = [lagged(share, step_s, float(tau_s)) for tau_s in time_constants_s]
    return np.stack([share, share**2, share**3, *lags], axis=1)


def left_by(columns: Array, values: Array) -> Array:
    """What the least-squares fit of ``columns`` (n, k), of any scales, leaves of ``values``, (n,) or several (n, m)."""
    scaled = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
    return np.asarray(values - scaled @ np.linalg.lstsq(scaled, values, rcond=None)[0])
