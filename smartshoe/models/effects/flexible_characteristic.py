"""Any monotone curve of the pressure: a sensor's characteristic without a law."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._monotone_curve import bent, slope_weights, straightened
from smartshoe.models.effects.effect import Conditions, Effect, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleCharacteristic(Effect):
    """s(p), a curve as of `flexible_curve`, but of the pressure, after the relaxation."""

    name, family, stage, place = "flexible_characteristic", "static_curve", "sensor", "sensor"
    is_memoryless = True
    says = "the reading bends away from the straight line between zero and full scale, at every rate alike"
    parameters = slope_weights("pressure")
    exposed_by = by("peaks", "low_loads")
    is_flexible = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The reading."""
        return bent(signal, values)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The inverse curve, exact to rounding."""
        return straightened(values)
