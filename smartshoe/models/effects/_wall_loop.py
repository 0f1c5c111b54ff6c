"""What springs share that bend inside the loop of wall and gas, beside the relaxing arm."""

from __future__ import annotations

import math

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions


def arm_beside(conditions: Conditions) -> tuple[float, float, float, float]:
    """The relaxing arm's kappa, and the recursion of its q: decay, now, before. Without effect outside a model."""
    from smartshoe.models.first_order import hold_coefficients

    share, rate_per_s = conditions.relaxing or (0.0, 0.0)
    decay, now, before = (float(value) for value in hold_coefficients(rate_per_s * float(conditions.step_s)))
    return share, decay, now, before


def most_beside(share: float) -> float:
    """How much more a spring beside an arm of ``share`` may deform than alone, at most, over its deformation alone.

    An arm that pushes, as that of a creeping unit, must leave a tenth of the spring's stiffness; a fit would else come
    upon numbers without bounds.
    """
    return max(-0.9 / share - 1.0, 0.0) if share < 0.0 else math.inf


def relaxed(deformation: Array, conditions: Conditions) -> Array:
    """The load (n,) that the relaxing arm bears, kappa (u - q), under a ``deformation`` (n,) in straight lines."""
    from smartshoe.models.first_order import lag

    share, rate_per_s = conditions.relaxing or (0.0, 0.0)
    force: Array = share * (deformation - lag(deformation, rate_per_s, float(conditions.step_s)))
    return force
