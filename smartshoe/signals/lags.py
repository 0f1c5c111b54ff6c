"""First-order lag of a sampled signal."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array


def lagged(signal: Array, step_s: float, tau_s: float) -> Array:
    """``signal`` (n,) through a first-order lag that holds each sample for one step, started in steady state."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step_s / tau_s))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], signal, zi=np.array([keep * signal[0]]))[0])
