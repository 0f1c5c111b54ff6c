"""Any monotone curve of the load: the family of static curves without a law."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._monotone_curve import bent, slope_weights, straightened
from smartshoe.models.effects.effect import Conditions, Effect, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleCurve(Effect):
    """s(f), rising everywhere, zero at rest and one at full scale; it precedes the relaxation.

    s' is linear between six knots, in proportion to 1 + weight at each (`smartshoe.models.effects._monotone_curve`).
    Equal weights at all knots are the identity, so that a fit needs the weights' prior.
    """

    name, family, stage, place = "flexible_curve", "static_curve", "wall", "wall"
    is_memoryless = True
    says = "the reading against load is bent, in a way that relaxes with the wall"
    parameters = slope_weights("load")
    exposed_by = by("peaks", "low_loads")
    is_flexible = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        return bent(signal, values)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The inverse curve, exact to rounding."""
        return straightened(values)
