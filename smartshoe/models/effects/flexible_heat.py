"""Heat of compression that leaves with two time constants: through the wall next to the air, and as that wall cools."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, Heat


class FlexibleHeat(CoreEffect):
    """Two heat stores, so that the overshoot after a ramp falls fast at first and then slowly.

    A wall of finite heat capacity warms with the air, and both then cool together (Carslaw and Jaeger 1959, 1.9). A
    flow that slows down as the air cools acts in the same way.
    """

    name, family, stage = "flexible_heat", "gas_heat", "gas"
    says = "the air warms when compressed and cools in seconds: the reading overshoots after a ramp and then falls"
    parameters = (
        EffectParameter("share", "1", "adiabatic over isothermal pressure rise, less 1", 0.0, 0.0, 0.4, 0.02),
        EffectParameter(
            "cooling_rate", "1/s", "one over the time in which the first heat leaves", None, 0.2, 20.0, 1.5
        ),
        EffectParameter("slow_share", "1", "share of the heat that leaves slowly", None, 0.0, 0.9, 0.4),
        EffectParameter("slower", "1", "by how much slowly", None, 2.0, 30.0, 8.0),
    )
    shapes = tuple({"cooling_rate": rate, "slow_share": 0.4, "slower": 8.0} for rate in (0.6, 2.5, 10.0))
    exposed_by = by("holds", "rates", "rests", "steps")
    is_flexible = True

    def elements(self, values: Array) -> tuple[Element, ...]:
        """The fast heat store and the slow one."""
        share, rate, slow_share, slower = (float(value) for value in values)
        return Heat(share * (1.0 - slow_share), rate), Heat(share * slow_share, rate / slower)
