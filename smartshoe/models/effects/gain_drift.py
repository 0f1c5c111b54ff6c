"""A gain that wanders with the clock or the temperature."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects._sensor_clock import drift
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter, Inverse


class GainDrift(Effect):
    """P exp(g t), close to P (1 + g t) and never of the other sign; with the temperature logged, P exp(g t + g_T dT).

    g_T is inert without a temperature that moves, g where the temperature is a straight line in time.
    """

    name, family, stage, place = "gain_drift", "gain_drift", "sensor", "sensor"
    says = "the gain moves steadily with time (with the temperature, where it is logged): peaks grow or shrink"
    parameters = (
        EffectParameter("drift_rate", "1/s", "share of the gain gained a second", 0.0, -1e-2, 1e-2, 1e-5),
        EffectParameter("temperature_coefficient", "1/K", "share of the gain gained a kelvin", 0.0, -0.1, 0.1, 1e-3),
    )
    exposed_by = frozenset({"repeats", "peaks", "pauses"})
    separated_by = {
        "cycle_conditioning": "pauses", "mullins_softening": "pauses", "zero_drift": "rests",
    }  # fmt: skip

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal times the gain since the session's start."""
        return signal * np.exp(drift(conditions, values))

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """Divide by the gain; exact. None with a temperature coefficient: a stream carries no temperature."""
        rate, coefficient = (float(value) for value in values)
        if coefficient != 0.0:
            return None
        return Memoryless(lambda signal, time_s: signal * np.exp(-rate * time_s), f"x *= exp(-({c_number(rate)} * t));")
