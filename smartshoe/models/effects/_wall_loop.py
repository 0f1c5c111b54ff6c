"""Springs that bend inside the loop of wall and gas, beside the arm that relaxes."""

from __future__ import annotations

import math

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions


def arm_beside(conditions: Conditions) -> tuple[float, float, float, float]:
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
