"""A sensor or an amplifier that runs out of range."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter
from smartshoe.models.effects.exposure import by

RAIL_KNEE = 5e-4  # of full scale: below a sensor's noise, but smooth enough for derivatives


def _above(pressure: Array, level: float, knee: float) -> Array:
    """max(pressure - level, 0) (n,), rounded over about ``knee`` on either side of the level; 0 at pressure 0."""
    over, rest = pressure - level, np.exp(-level / knee)
    tail: Array = knee * (np.log1p(np.exp(-np.abs(over) / knee)) - np.log1p(rest))
    return np.maximum(over, 0.0) + tail


class Saturation(Effect):
    """P - s above(P): of the slope above the level, 1 - s is left (s = 1: the output stands still).

    And max(P, 0) with the weight ``rail``, for a sensor whose membrane does not follow a pressure below zero. What was
    clipped is lost: there is no inverse. The block comes after the sensor's zero and gain, as rails do. With a level
    far below the top or a wide knee it would be a curve like any other: the bounds leave those to other blocks.
    """

    name, family, stage, place = "saturation", "saturation", "sensor", "logger"
    branch = "end of range"
    is_memoryless = True
    imitates = "static_curve"  # without ties at a rail it is a curve among curves
    says = "readings flatten near the largest one (or at zero) however the load goes on"
    parameters = (
        EffectParameter(
            "slope_lost", "1", "share of the slope lost above the level", 0.0, 0.0, 1.0, 0.1, natural="both"
        ),
        EffectParameter("level", "FS_reading", "reading where it begins", None, 0.55, 1.5, 0.1, kind_ends="lower"),
        EffectParameter(
            "knee", "FS_reading", "half width of the transition", None, 1e-3, 0.08, 0.01, kind_ends="upper"
        ),
        EffectParameter("rail", "1", "share lost of a pressure below zero", 0.0, 0.0, 1.0, 0.1, natural="both"),
    )
    shapes = tuple(
        {"level": level, "knee": knee}
        for level, knee in ((0.65, 0.01), (0.8, 0.01), (0.9, 0.01), (0.97, 0.01), (0.9, 0.05))
    )
    exposed_by = by("peaks")
    separated_by = {
        "contact_area": by("peaks"),
        "sensor_nonlinearity": by("peaks"),
        "wall_hardening": by("peaks"),
    }
    clips = True
    why_not_undone = "what was clipped is lost"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The clipped reading (n,)."""
        lost, level, knee, rail = (float(value) for value in values)
        clipped = signal - lost * _above(signal, level, knee)
        if rail != 0.0:
            below = np.maximum(-signal, 0.0)
            inside = np.minimum(below, 2.0 * RAIL_KNEE)
            clipped += rail * (inside * inside / (4.0 * RAIL_KNEE) + below - inside)
        return clipped
