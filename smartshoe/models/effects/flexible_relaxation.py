"""A spectrum of relaxation of any form and either sign: the family of relaxations without a law."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, relaxing

RATES_PER_S = np.geomspace(0.01, 30.0, 6)


class FlexibleRelaxation(CoreEffect):
    """At each of six fixed rates a Maxwell arm where the weight is positive, heat of compression where it is negative.

    To first order the reading is p (1 - sum of w s/(s + rate)), of either sign (`relaxing`).
    """

    name, family, stage = "flexible_relaxation", "relaxation", "wall"
    says = "the reading moves on in holds and rests, over several times at once"
    parameters = tuple(
        EffectParameter(
            f"share_{k}", "1", f"what relaxes at {rate:.3g} 1/s, of the load; < 0: falls in holds",
            0.0, -0.2, 3.0, 0.02, prior_sd=0.1,
        )
        for k, rate in enumerate(RATES_PER_S)
    )  # fmt: skip
    exposed_by = by("holds", "rates", "rests")
    is_flexible = True
    is_refinement = True

    def elements(self, values: Array) -> tuple[Element, ...]:
        """An arm or a heat store at each rate."""
        return tuple(relaxing(float(share), float(rate)) for share, rate in zip(values, RATES_PER_S, strict=True))
