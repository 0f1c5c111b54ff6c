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
    """Arms with the spectrum c (tau/1 s)^-alpha per decade (Mainardi 2010, ch. 3).

    alpha > 0: the relaxation modulus goes with t^-alpha, and creep slows down. alpha < 0: creep grows from decade to
    decade, as where a step of load is followed by 1 + c t^-alpha (Andrade; Findley). At the lower bound three
    quarters of their stiffness is in the two slowest arms, and over minutes a set or a drift does the same.
    """

    name, family, stage = "power_law_creep", "relaxation", "wall"
    says = "the wall creeps over all times: in holds the reading rises about as much, or more, in each decade of time"
    parameters = (
        EffectParameter(
            "creep_per_decade", "1", "relative creep over the decade about 1 s, small creep", 0.0, 0.0, 2.0, 0.01
        ),
        EffectParameter(
            "exponent",
            "1",
            "alpha: how much less slower times weigh, per decade; < 0: more",
            None,
            -0.5,
            0.8,
            0.2,
            kind_ends="both",
        ),
    )
    shapes = ({"exponent": -0.25}, {"exponent": 0.15}, {"exponent": 0.45})
    exposed_by = by("holds", "rates", "rests")
    separated_by = {
        "bouc_wen_hysteresis": by("rates"),
        "gas_heat": by("holds"),
        "linear_leak": by("holds"),
        "play_hysteresis": by("rates"),
        "second_relaxation": by("steps", "long_hold"),
    }
    of_either_sign = (
        "the sensor relaxes over all times: a held reading moves by about as much, or more, in each decade of time",
        "relative creep over the decade about 1 s, small creep; < 0: the reading falls in holds",
    )

    def elements(self, values: Array) -> tuple[Element, ...]:
        """The ladder's arms."""
        creep, exponent = (float(value) for value in values)
        times = [SHORTEST_S * 10.0 ** (SPACING * k) for k in range(ARMS)]
        return tuple(relaxing(creep * SPACING * tau**-exponent, 1.0 / tau) for tau in times)
