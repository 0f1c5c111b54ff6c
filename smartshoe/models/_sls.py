"""The bladder as a standard linear solid (SLS), in the paper's parameters (Chinimilli 2016, Section IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import UsageError

AMOUNT_OF_GAS_MOL = 4.2075e-9
GAS_CONSTANT_J_PER_MOL_K = 8.3145
TEMPERATURE_K = 300.0
TUBE_DIAMETER_M = 2e-3
X_OVER_NRT = TUBE_DIAMETER_M**2 / (AMOUNT_OF_GAS_MOL * GAS_CONSTANT_J_PER_MOL_K * TEMPERATURE_K)
"""x0^2/(nRT), written X here: 0.38113 with the paper's n, R, T and x0 (Section IV)."""


@dataclass(frozen=True, slots=True)
class StandardLinearSolid:
    """Spring ``k1`` in parallel with a series spring ``k2`` and damper ``c``.

    force / reading = (b0 s + b1)/(s + a1), Chinimilli 2016 equations (2), (13), (14); ``x_over_nrt`` is X =
    x0^2/(nRT). The three constants are known up to a common scale only, which is why the paper sets c = 1.
    """

    k1: float
    k2: float
    c: float = 1.0
    x_over_nrt: float = X_OVER_NRT

    def __post_init__(self) -> None:
        if self.c == 0.0 or not np.isfinite([self.k1, self.k2, self.c, self.x_over_nrt]).all():
            raise UsageError(
                f"SLS k1={self.k1:g}, k2={self.k2:g}, c={self.c:g} is no solid: give finite numbers and c other than 0"
            )

    @property
    def a1(self) -> float:
        """a1* = a1/a2 = k2/c in 1/s (equations 3, 14): one over the relaxation time c/k2."""
        return self.k2 / self.c

    @property
    def b0(self) -> float:
        """b0* = b2/a2 = 1 + (k1 + k2) X (equations 4, 14): the gain at high frequency."""
        return 1.0 + (self.k1 + self.k2) * self.x_over_nrt

    @property
    def b1(self) -> float:
        """b1* = b1/a2 = (k2/c)(1 + k1 X) in 1/s (equations 4, 14)."""
        return self.a1 * (1.0 + self.k1 * self.x_over_nrt)

    @property
    def static_gain(self) -> float:
        """Force per reading of a load that lasts: b1/a1 = 1 + k1 X."""
        return 1.0 + self.k1 * self.x_over_nrt

    @classmethod
    def from_coefficients(
        cls, a1: float, b0: float, b1: float, scale: float = 1.0, x_over_nrt: float = X_OVER_NRT
    ) -> StandardLinearSolid:
        """The solid whose equation (13) is ``scale`` times (b0 s + b1)/(s + a1).

        ``scale`` is newtons of the paper's force per unit of reading (an effective area for a pressure). k1 =
        (b1/(a1 scale) - 1)/X, k2 = (b0 - b1/a1)/(scale X), c = k2/a1: (3), (4), (14) solved for k1, k2, c.
        """
        if a1 == 0.0 or scale == 0.0:
            raise UsageError(f"a1 = {a1:g} and scale = {scale:g} have no solid: both must differ from 0")
        k2 = (b0 - b1 / a1) / (scale * x_over_nrt)
        return cls((b1 / (a1 * scale) - 1.0) / x_over_nrt, k2, k2 / a1, x_over_nrt)

    def wall_force(self, time_s: ArrayLike, deformation: ArrayLike) -> Array:
        """Force (n,) of the solid alone under ``deformation`` (n,), straight lines between samples, at rest before.

        The bracket of equation (2), k1 + k2 c s/(k2 + c s).
        """
        from smartshoe.models.first_order import lag, steps

        x = np.asarray(deformation, dtype=float)
        return self.k1 * x + self.k2 * (x - lag(x, self.a1, steps(np.asarray(time_s, dtype=float))))

    def dissipated_energy(self, time_s: ArrayLike, deformation: ArrayLike) -> float:
        """Energy that the solid turns into heat: integral of its force over ``deformation`` less what its springs keep.

        Exact for straight lines between samples up to the trapezoid's error in the damper's power c v^2, which is
        never negative.
        """
        time = np.asarray(time_s, dtype=float)
        x = np.asarray(deformation, dtype=float)
        force = self.wall_force(time, x)
        spring = (force - self.k1 * x) / self.k2 if self.k2 else np.zeros_like(x)
        # The damper sees the same force as spring k2; its velocity is that force over c.
        power = (self.k2 * spring) ** 2 / self.c
        return float(np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(time)))
