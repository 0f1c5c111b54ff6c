"""Tests whether the paper's two-parameter form (c = 1) agrees with three free coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.errors import UsageError
from smartshoe.models import X_OVER_NRT
from smartshoe.models.parameter import finite_or_none


@dataclass(frozen=True, slots=True)
class ConsistencyTest:
    """A chi-square ``statistic`` of one degree of freedom: how strongly the gains and the pole contradict the given c.

    ``k2_from_gains`` = (b0 - b1/a1)/(scale X) and ``k2_from_pole`` = a1 c are equal where the form holds.
    """

    statistic: float
    p_value: float
    k2_from_gains: float
    k2_from_pole: float

    @property
    def consistent(self) -> bool:
        """Whether the form is not rejected at the 1 % level."""
        return self.p_value >= 0.01

    @property
    def says(self) -> str:
        """The result as one sentence."""
        verdict = "agree" if self.consistent else "do not agree"
        return (
            f"k2 from the gains ({self.k2_from_gains:.4g}) and from the pole ({self.k2_from_pole:.4g}) {verdict}"
            f" (chi-square {self.statistic:.3g}, p = {self.p_value:.2g})"
        )

    def to_dict(self) -> dict[str, Any]:
        """The test as plain numbers for JSON."""
        return {
            "statistic": finite_or_none(self.statistic),
            "p_value": finite_or_none(self.p_value),
            "degrees": 1,
            "k2_from_gains": finite_or_none(self.k2_from_gains),
            "k2_from_pole": finite_or_none(self.k2_from_pole),
            "says": self.says,
        }


def consistency_test(
    coefficients: ArrayLike,
    covariance: ArrayLike,
    *,
    scale: float = 1.0,
    c: float = 1.0,
    x_over_nrt: float = X_OVER_NRT,
) -> ConsistencyTest:
    """Wald test of b0 - b1/a1 = scale X c a1: Chinimilli 2016 (3), (4), (14) leave two unknowns for a1, b0 and b1.

    ``coefficients`` (3,) a1 in 1/s, b0 and b1; ``covariance`` (3, 3) of them; ``scale`` N per reading unit.
    """
    a1, b0, b1 = (float(value) for value in np.asarray(coefficients, dtype=float))
    matrix = np.asarray(covariance, dtype=float)
    if matrix.shape != (3, 3) or a1 <= 0:
        raise UsageError(f"a1 = {a1:g} with a covariance of shape {matrix.shape}: give a1 above 0 and (3, 3)")
    stiffness = scale * x_over_nrt
    gap = b0 - b1 / a1 - stiffness * c * a1
    slope = np.array([b1 / a1**2 - stiffness * c, 1.0, -1.0 / a1])
    variance = float(slope @ matrix @ slope)
    statistic = gap**2 / variance if variance > 0 else (np.inf if gap else 0.0)
    from scipy.special import chdtrc

    return ConsistencyTest(float(statistic), float(chdtrc(1, statistic)), (b0 - b1 / a1) / stiffness, a1 * c)
