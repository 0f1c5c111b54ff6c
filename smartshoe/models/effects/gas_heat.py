"""Heat of compression that leaves the enclosed air through the wall."""

from __future__ import annotations

from smartshoe.models.effects.effect import Array, CoreEffect, EffectParameter, Element, Heat


class GasHeat(CoreEffect):
    """theta' = -theta/tau + Gamma u': the gas is stiffer when fast, by gamma - 1 <= 0.4 of the isothermal rise."""

    name, family, stage = "gas_heat", "gas_heat", "gas"
    says = "the air warms when compressed and cools in seconds: the reading overshoots after a ramp and then falls"
    parameters = (
        EffectParameter("share", "1", "adiabatic over isothermal pressure rise, less 1", 0.0, 0.0, 0.4, 0.02),
        EffectParameter("cooling_rate", "1/s", "one over the time in which the heat leaves", None, 0.2, 20.0, 1.0),
    )
    shapes = tuple({"cooling_rate": rate} for rate in (0.4, 1.5, 6.0))
    exposed_by = frozenset({"holds", "rates", "rests", "steps"})
    separated_by = {"second_relaxation": "sign: relaxation makes the reading rise in holds", "linear_leak": "long_hold"}

    def elements(self, values: Array) -> tuple[Element, ...]:
        """One heat store."""
        return (Heat(float(values[0]), float(values[1])),)
