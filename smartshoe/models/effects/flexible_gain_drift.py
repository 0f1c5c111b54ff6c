"""A gain that settles with the clock in any way: drift without a law."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_clock import settled, settled_so_far, unsettled_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by
from smartshoe.models.effects.gain_drift import LEAST_GAIN


class FlexibleGainDrift(Effect):
    """P (1 + g (1 - exp(-(t/s)^stretch))): fast at first where the stretch is below 1, a straight line where s is long.

    A voltage reference ages exponentially, an oxide grows by the root of time (Deal and Grove 1965), a package warms
    up.
    """

    name, family, stage, place = "flexible_gain_drift", "gain_drift", "sensor", "sensor"
    says = "the gain moves with time, loaded or not, and ever more slowly: peaks grow or shrink"
    parameters = (
        EffectParameter("change", "1", "share of the gain gained once settled", 0.0, -0.5, 0.5, 0.01),
        EffectParameter("time_constant", "s", "mean time of settling", None, 5.0, 1000.0, 60.0),
        EffectParameter("stretch", "1", "exponent of the settling, 1 for a single time constant", None, 0.5, 1.0, 0.2),
    )
    shapes = tuple({"time_constant": tau, "stretch": 1.0} for tau in (30.0, 100.0, 300.0))
    exposed_by = by("repeats", "peaks", "pauses")
    separated_by = {
        "cycle_conditioning": by("pauses", "rates", "temperature"),
        "mullins_softening": by("pauses", "shuffled_loads"),
    }
    is_flexible = is_drift = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal times the gain since the session's start."""
        change, tau, stretch = (float(value) for value in values)
        return signal * (1.0 + change * settled_so_far(conditions, tau, stretch))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Divide by the gain; exact while that stays above a hundredth of its first value."""
        change, tau, stretch = (float(value) for value in values)
        gain = f"1.0 - {c_number(change)} * {unsettled_in_c(tau, stretch)}"
        return Memoryless(
            lambda signal, time_s: signal / np.maximum(1.0 + change * settled(time_s, tau, stretch), LEAST_GAIN),
            f"x /= fmax({gain}, {c_number(LEAST_GAIN)});",
        )
