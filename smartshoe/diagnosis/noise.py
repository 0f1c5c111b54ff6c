"""The noise of a reading as a long autoregression, from what no effect's sensitivity can reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
ORDER = 16


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """e_k = sum of coefficients_i e_(k-i) + sd times white noise of variance one; ``coefficients`` (order,)."""

    coefficients: Array
    sd: float

    def whitened(self, rows: Array) -> Array:
        """``rows`` (n,) or (n, p) through the inverse of the noise's filter."""
        taps = np.concatenate([[1.0], -self.coefficients]) / self.sd
        return np.asarray(lfilter(taps, [1.0], rows, axis=0))

    def counted(self, kept: Mask) -> Mask:
        """(n,) samples that count once whitened: the first ones lack their past."""
        out = kept.copy()
        out[: self.coefficients.size] = False
        return out


def white(sd: float) -> NoiseModel:
    """No memory."""
    return NoiseModel(np.zeros(1), sd)


def correlated(residuals: Sequence[Array], kept: Sequence[Mask]) -> NoiseModel:
    """White noise as strong as ``residuals`` (n,) each, where ``kept``, are over one correlation time.

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
        power = np.abs(np.fft.rfft(signal, 2 * signal.size)) ** 2
        covariance = np.fft.irfft(power)[: signal.size]
        first = np.flatnonzero(covariance <= 0)
        until = int(first[0]) if first.size else signal.size
        square += float(signal @ signal)
        count += size
        repeated += size * float(2.0 * covariance[:until].sum() / max(float(covariance[0]), 1e-300) - 1.0)
    return white(float(np.sqrt(square * max(repeated / max(count, 1), 1.0) / max(count, 1))) + 1e-9)


def autoregression(
    residuals: Sequence[Array],
    kept: Sequence[Mask],
    order: int = ORDER,
    floor: float = 1e-9,
    white_share: float = 0.0,
) -> NoiseModel:
    """Yule-Walker over all sessions: ``residuals`` (n,) each, where ``kept``.

    Biased autocovariances of the masked signals keep the filter stable. ``white_share`` of the variance is taken for
    white noise on top.
    """
    total = np.zeros(order + 1)
    count = 0
    for residual, mask in zip(residuals, kept, strict=True):
        signal = np.where(mask, residual, 0.0)
        count += int(mask.sum())
        for lag in range(order + 1):
            total[lag] += signal[lag:] @ signal[: signal.size - lag]
    covariance = total / max(count, 1)
    if covariance[0] <= floor**2:
        return white(floor)
    covariance[0] = covariance[0] * (1 + 1e-6 + white_share) + floor**2
    coefficients = solve_toeplitz(covariance[:-1], covariance[1:])
    variance = float(covariance[0] - coefficients @ covariance[1:])
    return NoiseModel(coefficients, float(np.sqrt(max(variance, floor**2))))
