"""Tests of the residual: whiteness, and independence of the input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.identification._experiment import block_means
from smartshoe.identification._prediction_error import PredictionError
from smartshoe.identification._whitening import whitened
from smartshoe.models.parameter import finite_or_none

WHITENESS_LAGS = 20
INPUT_LAGS = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256)
BLOCKS = 1500  # means of samples that the test of input independence uses


@dataclass(frozen=True, slots=True)
class ResidualTest:
    """A chi-square ``statistic`` of ``degrees`` degrees of freedom; ``p_value`` is small where the hypothesis fails."""

    statistic: float
    p_value: float
    degrees: int

    def to_dict(self) -> dict[str, Any]:
        """The test as a JSON object."""
        return {
            "statistic": finite_or_none(self.statistic),
            "p_value": finite_or_none(self.p_value),
            "degrees": self.degrees,
        }


def residual_tests(problem: PredictionError, theta: Array, errors: Sequence[Array]) -> dict[str, ResidualTest]:
    """Tests of whiteness and input independence of the prediction errors (one (n,) per recording) at ``theta``."""
    white = problem.whitening(theta)
    if white is not None:
        errors = [
            whitened(white, np.where(mask, error, 0.0)) for error, mask in zip(errors, problem.masks, strict=True)
        ]
    return {
        "whiteness": whiteness(errors, problem.masks),
        "input_independence": input_independence(problem, theta, errors),
    }


def whiteness(residuals: Sequence[Array], masks: Sequence[Mask]) -> ResidualTest:
    """Ljung-Box over 20 lags, pooled over recordings; pairs with a missing sample do not count."""
    from smartshoe.kernels.residual import lagged_products

    total = sum(int(np.count_nonzero(mask)) for mask in masks)
    lags = min(WHITENESS_LAGS, max(total // 4, 1))
    products, pairs = np.zeros(lags + 1), np.zeros(lags + 1, dtype=int)
    for residual, mask in zip(residuals, masks, strict=True):
        lagged_products(residual if mask.all() else np.where(mask, residual, 0.0), mask, products, pairs)
    correlation = products[1:] / products[0] if products[0] > 0.0 else np.zeros(lags)
    statistic = float(np.sum((correlation * total) ** 2 / np.maximum(pairs[1:], 1)))
    return ResidualTest(statistic, _chi_square_tail(lags, statistic), lags)


def _chi_square_tail(degrees: int, statistic: float) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(degrees, statistic))


def input_independence(problem: PredictionError, theta: Array, errors: Sequence[Array]) -> ResidualTest:
    """Score test of whether the residual still correlates with the input at lags of 0 to 256 samples.

    The part of the delayed inputs that the fit has used (its Jacobian) is projected out, so that under white residuals
    the statistic is chi-square with their rank. Slow dynamics missing from the model show here. It uses means of a few
    samples, which are as white as the samples.
    """
    from smartshoe.kernels.residual import orthogonalise

    total = sum(error.size for error in errors)
    factor = max(total // BLOCKS, 1)
    coarse = problem.thinned(factor)
    lags, size = sorted({lag // factor for lag in INPUT_LAGS}), problem.size
    rows, residuals = [], []
    for index, error in enumerate(errors):
        u, inside = coarse.delayed(theta)[index][0], coarse.masks[index].astype(float)
        row = np.empty((size + len(lags), u.size))
        row[:size] = coarse.model_error_and_slopes(theta, index)[1]
        for delayed, lag in zip(row[size:], lags, strict=True):
            lag = min(lag, u.size)
            delayed[:lag], delayed[lag:] = u[0], u[: u.size - lag]
        row *= inside
        rows.append(row)
        residuals.append(block_means(error, factor) * inside)
    # Columns: the fit's Jacobian, then the delayed inputs.
    both, error = np.concatenate(rows, axis=1), np.concatenate(residuals)
    lagged = both[size:]
    # Differences of neighbouring lags are far less collinear than the lags themselves.
    lagged[1:] -= lagged[:-1].copy()
    orthogonalise(both, size)
    values, vectors = np.linalg.eigh(lagged @ lagged.T)
    usable = values > 1e-9
    degrees = int(np.count_nonzero(usable))
    variance = float(error @ error) / max(coarse.count - size, 1)
    if not degrees or variance == 0.0:
        return ResidualTest(0.0, 1.0, degrees)
    leaning = vectors[:, usable].T @ (lagged @ error)
    statistic = float(np.sum(leaning**2 / values[usable]) / variance)
    return ResidualTest(statistic, _chi_square_tail(degrees, statistic), degrees)
