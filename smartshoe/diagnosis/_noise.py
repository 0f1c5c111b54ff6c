"""What counts as noise: the residual, with each correlation time counted once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.signals.noise import autocovariance

ROUNDING = 1e-9  # share of full scale: rounding, which remains where nothing else is left
FLOOR = 1e-6  # share of full scale: no sensor is better, and with less noise rounding would decide


def effective_noise_sd(residuals: Sequence[Array], kept: Sequence[Mask]) -> float:
    """Standard deviation of white noise that carries as much information as ``residuals`` (n,) where ``kept``.

    Least squares is the best predictor where the residual is an error of the model. Correlated samples repeat one
    another, so that against a prior each correlation time counts once (Box and Jenkins 1976, variance of a mean of
    correlated samples).
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
