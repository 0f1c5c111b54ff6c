"""What the residual still holds: whiteness, and independence of the input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.identification.experiment import Array
from smartshoe.models.parameter import finite_or_none

Mask = NDArray[np.bool_]
WHITENESS_LAGS = 20
INPUT_LAGS = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256)


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


def whiteness(residuals: Sequence[Array], kept: Sequence[Mask]) -> ResidualTest:
    """Ljung-Box over 20 lags, pooled over recordings; pairs with a missing sample do not count."""
    from scipy.stats import chi2

    filled = [np.where(mask, residual, 0.0) for residual, mask in zip(residuals, kept, strict=True)]
    power = sum(float(residual @ residual) for residual in filled)
    total = sum(int(np.count_nonzero(mask)) for mask in kept)
    lags = min(WHITENESS_LAGS, max(total // 4, 1))
    statistic = 0.0
    for lag in range(1, lags + 1):
        product = sum(float(residual[lag:] @ residual[:-lag]) for residual in filled)
        pairs = sum(int(np.count_nonzero(mask[lag:] & mask[:-lag])) for mask in kept)
        if pairs and power > 0.0:
            statistic += (product / power * total) ** 2 / pairs
    return ResidualTest(statistic, float(chi2.sf(statistic, lags)), lags)


def input_independence(
    inputs: Sequence[Array], residuals: Sequence[Array], kept: Sequence[Mask], jacobian: Array
) -> ResidualTest:
    """Score test: does the residual still lean on the input at lags 0 to 256 samples?

    The delayed inputs are cleared of what the fit has already used (the columns of ``jacobian``), so the statistic is
    chi-square with their rank under white residuals. A slow dynamic left out shows here.
    """
    from scipy.stats import chi2

    rows, errors = [], []
    for u, residual, mask in zip(inputs, residuals, kept, strict=True):
        delayed = [
            np.concatenate([np.full(min(lag, u.size), u[0]), u[: u.size - min(lag, u.size)]]) for lag in INPUT_LAGS
        ]
        rows.append(np.stack(delayed, axis=1)[mask])
        errors.append(residual[mask])
    lagged, error = np.concatenate(rows), np.concatenate(errors)
    # Differences of neighbouring lags are far less collinear than the lags themselves.
    lagged = np.concatenate([lagged[:, :1], np.diff(lagged, axis=1)], axis=1)
    norm = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    fitted = jacobian / np.where(norm > 0, norm, 1.0)
    before = np.sqrt(np.einsum("ij,ij->j", lagged, lagged))
    lagged = lagged / np.where(before > 0, before, 1.0)
    gram = fitted.T @ fitted
    for _ in range(2):  # once more, since the first pass loses digits
        lagged = lagged - fitted @ np.linalg.lstsq(gram, fitted.T @ lagged, rcond=1e-13)[0]
    values, vectors = np.linalg.eigh(lagged.T @ lagged)
    usable = values > 1e-9
    degrees = int(np.count_nonzero(usable))
    variance = float(error @ error) / max(error.size - jacobian.shape[1], 1)
    if not degrees or variance == 0.0:
        return ResidualTest(0.0, 1.0, degrees)
    leaning = vectors[:, usable].T @ (lagged.T @ error)
    statistic = float(np.sum(leaning**2 / values[usable]) / variance)
    return ResidualTest(statistic, float(chi2.sf(statistic, degrees)), degrees)
