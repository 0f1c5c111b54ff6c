"""Heat of compression that leaves the enclosed air through the wall."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, Heat

FASTER_MODES = ((0.131, 5.269), (0.177, 12.95))  # (4/j_2^2, (j_2/j_1)^2), and the remaining share, (j_3/j_1)^2


class GasHeat(CoreEffect):
    """theta' = -theta/tau + Gamma u': the gas is stiffer when fast, by gamma - 1 <= 0.4 of the isothermal rise.

    ``spread`` 0 is one time constant, 1 conduction through a cylinder of air, whose series has the shares 4/j_n^2 and
    rates j_n^2, j_n the zeros of the Bessel function J0 (Carslaw and Jaeger 1959, 7.6); the third stands for the rest.
    """

    name, family, stage = "gas_heat", "gas_heat", "gas"
    says = "the air warms when compressed and cools in seconds: the reading overshoots after a ramp and then falls"
    parameters = (
        EffectParameter("share", "1", "adiabatic over isothermal pressure rise, less 1", 0.0, 0.0, 0.4, 0.02),
        EffectParameter("cooling_rate", "1/s", "one over the time in which the heat leaves", None, 0.2, 20.0, 1.0),
        EffectParameter(
            "spread", "1", "0: one time constant, 1: conduction in a cylinder", None, 0.0, 1.0, 0.5, natural="both"
        ),
    )
    shapes = tuple({"cooling_rate": rate, "spread": 0.5} for rate in (0.4, 1.5, 6.0))
    exposed_by = by("holds", "rates", "rests", "steps")
    separated_by = {
        "linear_leak": by("long_hold"),
        "power_law_creep": by("holds"),
        "rate_gain": by("holds"),
        "second_relaxation": by("holds"),
    }

    def elements(self, values: Array) -> tuple[Element, ...]:
        """One heat store for each term of the series."""
        share, rate, spread = (float(value) for value in values)
        faster = [(share * spread * part, rate * ratio) for part, ratio in FASTER_MODES]
        return (Heat(share - sum(part for part, _ in faster), rate), *(Heat(*mode) for mode in faster))
