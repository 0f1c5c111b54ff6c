"""Creep over many decades of time, as in rubber: a ladder of relaxing arms."""

from __future__ import annotations

import math

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, relaxing

SHORTEST_S, LONGEST_S, ARMS = 0.02, 2000.0, 9
SPACING = math.log10(LONGEST_S / SHORTEST_S) / (ARMS - 1)  # decades


class PowerLawCreep(CoreEffect):
    """Arms with the spectrum c (tau/1 s)^-alpha per decade: relaxation modulus ~ t^-alpha (Mainardi 2010, ch. 3)."""

    name, family, stage = "power_law_creep", "relaxation", "wall"
    says = "the wall creeps over all times alike: in holds the reading rises by the same amount in each decade of time"
    parameters = (
        EffectParameter(
            "creep_per_decade", "1", "relative creep over the decade about 1 s, small creep", 0.0, 0.0, 2.0, 0.01
        ),
        EffectParameter(
            "exponent",
            "1",
            "alpha: how much slower times weigh less, per decade",
            None,
            0.02,
            0.8,
            0.2,
            kind_ends="upper",
            farthest=-0.5,
        ),
    )
    shapes = ({"exponent": 0.15}, {"exponent": 0.45})
    exposed_by = by("holds", "rates", "rests")
    separated_by = {
        "bouc_wen_hysteresis": by("rates"),
        "gas_heat": by("holds"),
        "linear_leak": by("holds"),
        "play_hysteresis": by("rates"),
        "second_relaxation": by("steps", "long_hold"),
    }
    of_either_sign = (
        "the sensor relaxes over all times alike: a held reading moves by the same amount in each decade of time",
        "relative creep over the decade about 1 s, small creep; < 0: the reading falls in holds",
    )

    def elements(self, values: Array) -> tuple[Element, ...]:
        """The ladder's arms."""
        creep, exponent = (float(value) for value in values)
        times = [SHORTEST_S * 10.0 ** (SPACING * k) for k in range(ARMS)]
        return tuple(relaxing(creep * SPACING * tau**-exponent, 1.0 / tau) for tau in times)
