"""Springs that bend inside the loop of wall and gas, beside the arm that relaxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.models.effects.effect import Conditions

ArmGiven = tuple[float, float, float, float]
Given = Callable[[Conditions, Array], tuple[tuple[float, ...], ArmGiven]]
"""The amounts that a spring's kernel takes, and its arm, for conditions and values."""


def arm_beside(conditions: Conditions) -> ArmGiven:
    """kappa of the arm that relaxes, and how its q goes on from sample to sample; an arm of nothing outside a model."""
    from smartshoe.models.first_order import hold_coefficients

    share, rate_per_s = conditions.relaxing or (0.0, 0.0)
    decay, now, before = (float(value) for value in hold_coefficients(rate_per_s * float(conditions.step_s)))
    return share, decay, now, before


def most_beside(share: float) -> float:
    """By how much more than its own a spring may deform beside an arm of ``share``, over its own.

    An arm that pushes, as a creeping unit's does, leaves a tenth of the spring's stiffness, at least; else a fit would
    come upon numbers without bounds.
    """
    return max(-0.9 / share - 1.0, 0.0) if share < 0.0 else math.inf


def relaxed(deformation: Array, conditions: Conditions) -> Array:
    """Load (n,) of the arm that relaxes, kappa (u - q), under a deformation (n,) in straight lines."""
    from smartshoe.models.first_order import lag

    share, rate_per_s = conditions.relaxing or (0.0, 0.0)
    force: Array = share * (deformation - lag(deformation, rate_per_s, float(conditions.step_s)))
    return force


@dataclass(frozen=True, eq=False)
class SpringNearby:
    """A spring beside the arm close to where it is known (`smartshoe.models.effects.effect.Nearby`).

    ``signal``, ``out``, ``u``, ``q`` (n,) there, its k ``amounts`` and its ``arm``; ``by_load``, ``by_most``,
    ``grows`` (n,) and ``by_amounts`` (k, n) as in `smartshoe.kernels.wall_loop.softened_about`.
    """

    signal: Array
    out: Array
    u: Array
    q: Array
    by_load: Array
    by_most: Array
    grows: Mask
    by_amounts: Array
    amounts: tuple[float, ...]
    arm: ArmGiven
    given: Given

    @classmethod
    def of_record(cls, signal: Array, out: Array, conditions: Conditions, values: Array, given: Given) -> SpringNearby:
        """With the deformation that gave ``out``; how it moves is for the spring to fill in."""
        from smartshoe.kernels.wall_loop import recovered

        amounts, arm = given(conditions, values)
        n, u, q = signal.size, np.empty(signal.size), np.empty(signal.size)
        recovered(out, *arm, u, q)
        return cls(
            np.ascontiguousarray(signal), out, u, q, np.empty(n), np.zeros(n), np.zeros(n, dtype=bool),
            np.empty((len(amounts), n)), amounts, arm, given,
        )  # fmt: skip

    def __call__(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The output (n,) to first order."""
        from smartshoe.kernels.wall_loop import spring_along

        amounts, arm = self.given(conditions, values)
        change = np.empty(signal.size)
        forced = np.subtract(amounts, self.amounts) @ self.by_amounts
        decay, now, before = (b - a for a, b in zip(self.arm[1:], arm[1:], strict=True))
        known = self.u, self.q, self.by_load, self.by_most, self.grows, *self.arm
        spring_along(signal - self.signal, forced, *known, arm[0] - self.arm[0], decay, now, before, change)
        return self.out + change
