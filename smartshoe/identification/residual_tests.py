"""What the residual still holds: whiteness, and independence of the input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.identification.experiment import Array, block_means
from smartshoe.identification.prediction_error import PredictionError
from smartshoe.identification.whitening import whitened
from smartshoe.models.parameter import finite_or_none

Mask = NDArray[np.bool_]
WHITENESS_LAGS = 20
INPUT_LAGS = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256)
BLOCKS = 1500  # means of samples that the input's test looks at


@dataclass(frozen=True, slots=True)
class ResidualTest:
    """A chi-square ``statistic`` of ``degrees`` degrees of freedom and its ``p_value``: small where the law fails."""

    statistic: float
    p_value: float
    degrees: int

    def to_dict(self) -> dict[str, Any]:
        """The contract's object."""
        return {
            "statistic": finite_or_none(self.statistic),
            "p_value": finite_or_none(self.p_value),
            "degrees": self.degrees,
        }


def residual_tests(problem: PredictionError, theta: Array, errors: Sequence[Array]) -> dict[str, ResidualTest]:
    """Whiteness and input independence of the prediction error ``errors`` (one (n,) a recording) at ``theta``."""
    white = problem.whitening(theta)
    if white is not None:
        errors = [whitened(white, np.where(kept, error, 0.0)) for error, kept in zip(errors, problem.kept, strict=True)]
    return {
        "whiteness": whiteness(errors, problem.kept),
        "input_independence": input_independence(problem, theta, errors),
    }


def whiteness(residuals: Sequence[Array], kept: Sequence[Mask]) -> ResidualTest:
    """Ljung-Box over 20 lags, pooled over recordings; pairs with a missing sample do not count."""
    filled = [
        residual if mask.all() else np.where(mask, residual, 0.0)
        for residual, mask in zip(residuals, kept, strict=True)
    ]
    power = sum(float(residual @ residual) for residual in filled)
    total = sum(int(np.count_nonzero(mask)) for mask in kept)
    lags = min(WHITENESS_LAGS, max(total // 4, 1))
    statistic = 0.0
    for lag in range(1, lags + 1):
        product = sum(float(residual[lag:] @ residual[:-lag]) for residual in filled)
        pairs = sum(
            max(mask.size - lag, 0) if mask.all() else int(np.count_nonzero(mask[lag:] & mask[:-lag])) for mask in kept
        )
        if pairs and power > 0.0:
            statistic += (product / power * total) ** 2 / pairs
    return ResidualTest(statistic, _chi_square_tail(lags, statistic), lags)


def _chi_square_tail(degrees: int, statistic: float) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(degrees, statistic))


def input_independence(problem: PredictionError, theta: Array, errors: Sequence[Array]) -> ResidualTest:
    """Score test: does the residual still lean on the input at lags 0 to 256 samples?

    The delayed inputs are cleared of what the fit has already used (its Jacobian), so the statistic is chi-square with
    their rank under white residuals. A slow dynamic left out shows here. Looked at in means of a few samples, which
    are as white as the samples.
    """
    total = sum(error.size for error in errors)
    factor = max(total // BLOCKS, 1)
    coarse = problem.thinned(factor)
    rows, residuals, fitted = [], [], []
    lags = sorted({lag // factor for lag in INPUT_LAGS})
    for index, error in enumerate(errors):
        mask = coarse.kept[index]
        u = coarse.delayed(theta)[index][0]
        if factor > 1:
            error = block_means(error, factor)
        delayed = np.empty((len(lags), u.size))
        for row, lag in zip(delayed, lags, strict=True):
            lag = min(lag, u.size)
            row[:lag], row[lag:] = u[0], u[: u.size - lag]
        rows.append(delayed[:, mask])
        residuals.append(error[mask])
        fitted.append(coarse.error_and_slopes(theta, index)[1][:, mask])
    lagged, error, used = np.concatenate(rows, axis=1), np.concatenate(residuals), np.concatenate(fitted, axis=1)
    # Differences of neighbouring lags are far less collinear than the lags themselves.
    lagged[1:] = np.diff(lagged, axis=0)
    norm = np.sqrt(np.einsum("ij,ij->i", used, used))
    used /= np.where(norm > 0, norm, 1.0)[:, np.newaxis]
    before = np.sqrt(np.einsum("ij,ij->i", lagged, lagged))
    lagged /= np.where(before > 0, before, 1.0)[:, np.newaxis]
    gram = used @ used.T
    for _ in range(2):  # once more, since the first pass loses digits
        lagged -= np.linalg.lstsq(gram, used @ lagged.T, rcond=1e-13)[0].T @ used
    values, vectors = np.linalg.eigh(lagged @ lagged.T)
    usable = values > 1e-9
    degrees = int(np.count_nonzero(usable))
    variance = float(error @ error) / max(error.size - used.shape[0], 1)
    if not degrees or variance == 0.0:
        return ResidualTest(0.0, 1.0, degrees)
    leaning = vectors[:, usable].T @ (lagged @ error)
    statistic = float(np.sum(leaning**2 / values[usable]) / variance)
    return ResidualTest(statistic, _chi_square_tail(degrees, statistic), degrees)
