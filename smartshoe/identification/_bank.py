"""Fits the three coefficients of many experiments at once: Monte-Carlo studies, bootstraps, fleets of units."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Index, Mask
from smartshoe.errors import InputError, UsageError

THIN_SAMPLES = 1000
COARSEST_STEP_S = 0.05


@dataclass(frozen=True, eq=False)
class CoefficientFits:
    """Results of m fits, one row each.

    ``coefficients`` (m, 3) a1, b0, b1, their ``covariance`` (m, 3, 3), ``rmse`` (m,), the number of ``passes`` (m,)
    over the data, and whether the fit ``converged`` (m,); NaN where SRIVC found no start.
    """

    coefficients: Array
    covariance: Array
    rmse: Array
    passes: Index
    converged: Mask

    @property
    def sd(self) -> Array:
        """(m, 3) standard deviations of the coefficients."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))


def fit_coefficients(
    inputs: ArrayLike, outputs: ArrayLike, *, sample_time_s: float, prefilter_rad_s: float = 1.0, workers: int = 1
) -> CoefficientFits:
    """a1, b0, b1 of output = (b0 s + b1)/(s + a1) input, Chinimilli 2016 (13), of many experiments of one length.

    ``inputs`` and ``outputs`` are (m, n) or (n,); one of them may have a single row shared by all. Nothing else is
    estimated: no offset, no delay, and the steady state before the first sample is assumed (`identify` does more).
    Gauss-Newton from SRIVC, compiled, on ``workers`` threads (-1: one per core). Raises `InputError` for missing
    samples or shapes that do not match.
    """
    # A recording's signals are read-only arrays, for which numba would compile every pass of the fit again.
    u, y = (np.atleast_2d(np.require(values, float, ["C", "W"])) for values in (inputs, outputs))
    if not (np.isfinite(sample_time_s) and sample_time_s > 0 and np.isfinite(prefilter_rad_s) and prefilter_rad_s > 0):
        raise UsageError(
            f"sample_time_s is {sample_time_s:g}, prefilter_rad_s {prefilter_rad_s:g}: give positive numbers"
        )
    if u.shape[1] != y.shape[1] or (u.shape[0] != y.shape[0] and 1 not in (u.shape[0], y.shape[0])) or y.shape[1] < 20:
        raise InputError(f"inputs {u.shape} and outputs {y.shape} do not pair: give rows of one length, 20 at least")
    if not (np.isfinite(u).all() and np.isfinite(y).all()):
        raise InputError("inputs or outputs hold samples that are not finite: use identify, which leaves them out")
    from joblib import Parallel, delayed

    from smartshoe.kernels.coefficients import fit_coefficients as fit

    count, size = max(u.shape[0], y.shape[0]), u.shape[1]
    factor = max(min(size // THIN_SAMPLES, int(COARSEST_STEP_S / sample_time_s)), 1)
    theta, normal = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    cost, passes, converged = np.empty(count), np.zeros(count, dtype=np.intp), np.zeros(count, dtype=bool)

    def rows(first: int, last: int) -> None:
        for row in range(first, last):
            cost[row], passes[row], converged[row] = fit(
                u[row % u.shape[0]],
                y[row % y.shape[0]],
                float(sample_time_s),
                float(prefilter_rad_s),
                factor,
                theta[row],
                normal[row],
            )

    if workers == 1:
        rows(0, count)
    else:
        edges = np.linspace(0, count, 4 * 16 + 1).astype(int)
        Parallel(n_jobs=workers, prefer="threads")(
            delayed(rows)(int(first), int(last)) for first, last in pairwise(edges)
        )
    alpha, p1, p2 = np.exp(theta[:, 0]), theta[:, 1], theta[:, 2]
    slope = np.zeros((count, 3, 3))
    slope[:, 0, 0], slope[:, 1, 1] = alpha, 1.0
    slope[:, 2, 0], slope[:, 2, 2] = p2 * alpha, alpha
    variance = cost / (size - 3)
    inverse = np.linalg.pinv(np.where(np.isfinite(normal), normal, 0.0), hermitian=True)
    covariance = variance[:, np.newaxis, np.newaxis] * slope @ inverse @ np.swapaxes(slope, 1, 2)
    return CoefficientFits(
        np.stack([alpha, p1, p2 * alpha], axis=1), covariance, np.sqrt(cost / size), passes, converged
    )
