"""Air that leaves through a narrow passage: laminar, in proportion to the pressure."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, Leak


class LinearLeak(CoreEffect):
    """w' = lambda P, x = xd - w: the deformation x of the air is that of the wall less what left.

    The wall yields to what left, so that in a hold the reading falls at (1 - 1/N) lambda, N = 1 + k1 x0^2/(nRT).
    """

    name, family, stage = "linear_leak", "leak", "gas"
    says = "air leaves in proportion to the pressure: the reading falls in holds and lies below zero afterwards"
    parameters = (
        EffectParameter(
            "leak_rate",
            "1/s",
            "share of the air's deformation lost a second; a held reading falls at 1 - 1/N of it, at 0.375 for the N of"
            " 1.6 that is assumed where no effective area is declared",
            0.0,
            0.0,
            5.0,
            1e-3,
        ),
    )
    exposed_by = by("holds", "rests")
    separated_by = {
        "gas_heat": by("long_hold"),
        "orifice_leak": by("holds", "peaks"),
        "permanent_set": by("rests"),
        "power_law_creep": by("holds"),
        "second_relaxation": by("holds"),
        "warm_up": by("idle"),
        "zero_drift": by("idle", "long_hold", "temperature"),
    }
    is_leak = True

    def falling_at(self, rate_per_s: float, wall_ratio: float) -> Array:
        """The leak rate for that fall: of the air that leaves, the part 1 - 1/N is seen."""
        (rate,) = self.parameters
        return np.array([min(rate_per_s / (1.0 - 1.0 / wall_ratio), rate.upper)])

    def elements(self, values: Array) -> tuple[Element, ...]:
        """The leak."""
        return (Leak(float(values[0])),)
