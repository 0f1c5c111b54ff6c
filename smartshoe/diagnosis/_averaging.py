"""The zero-phase average that load and reading pass before they are thinned: a Hann window."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array

LEAST_WINDOW = 3  # samples on either side of the average, a resolution: half and twice changed no name in two cases


def kernel(factor: int) -> Array:
    """Weights of a Hann window over two thinned steps: a zero-phase average of sum one."""
    if factor <= 1:
        return np.ones(1)
    window = np.hanning(2 * factor + 1)[1:-1]
    return np.asarray(window / window.sum())


def thinning_weights(factor: int, size: int) -> Array:
    """The weights by which a recording of ``size`` samples is averaged before it is thinned by ``factor``.

    At least so wide that noise of the load is smoothed alike in reading and simulation, whatever the thinning.
    """
    return kernel(min(max(factor, LEAST_WINDOW), size))


def smoothed(signal: Array, weights: Array, factor: int) -> Array:
    """(m,) ``signal`` (n,) averaged and thinned; ends are mirrored through their end points, which keeps the slope."""
    half = weights.size // 2
    if not half:
        return np.array(signal[::factor], dtype=float)
    return np.convolve(np.pad(signal, half, "reflect", reflect_type="odd"), weights, "valid")[::factor]
