"""What counts as noise: what is left, each stretch over which it is correlated counted once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.signals.noise import autocovariance

ROUNDING = 1e-9  # share of full scale: what it leaves where nothing else is left
FLOOR = 1e-6  # share of full scale: no sensor is better, and less than that of noise leaves rounding to decide


def correlated_sd(residuals: Sequence[Array], kept: Sequence[Mask]) -> float:
    """Standard deviation of the white noise that is worth as much as ``residuals`` (n,) each, where ``kept``, are.

    Least squares is the best predictor where what is left is an error of the model; its samples say the same thing
    again for as long as they are correlated, and so count only once each correlation time beside a prior
    (Box and Jenkins 1976, variance of a mean of correlated samples).
    """
    square, count, repeated = 0.0, 0, 0.0
    for residual, mask in zip(residuals, kept, strict=True):
        if not mask.any():
            continue
        signal = np.where(mask, residual - residual[mask].mean(), 0.0)
        size = int(mask.sum())
        covariance = autocovariance(signal)
        first = np.flatnonzero(covariance <= 0)
        until = int(first[0]) if first.size else signal.size
        square += float(signal @ signal)
        count += size
        repeated += size * float(2.0 * covariance[:until].sum() / max(float(covariance[0]), 1e-300) - 1.0)
    return max(float(np.sqrt(square * max(repeated / max(count, 1), 1.0) / max(count, 1))) + ROUNDING, FLOOR)
