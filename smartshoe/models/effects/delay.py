"""A reading that is logged late, or early, against the load."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter
from smartshoe.models.effects.exposure import by


class Delay(Effect):
    """y(t - delta), delta any fraction of samples; delta < 0 where the load is the late one.

    Interpolated by a band-limited kernel over 16 neighbours: over few, noise would be smoothed by an amount that
    depends on the fraction. Beyond the ends the end values hold. A streaming inverse would need the future, so there is
    none.
    """

    name, family, stage, place = "delay", "timing", "logger", "logger"
    says = "the reading is late by a constant time (early where it is below zero), its corners as sharp as the load's"
    parameters = (EffectParameter("delay", "s", "time by which the reading is late", 0.0, -3.0, 3.0, 0.01),)
    exposed_by = by("rates", "steps")
    separated_by = {
        "clock_drift": by("repeats", "steps"),
        "sensor_lag": by("steps", "multisine"),
    }
    is_latency = True
    between_clocks = "lag"
    branch = "delay"
    why_not_undone = "a stream of readings cannot be moved to another time: shift whole recordings instead"

    def late_s(self, values: Array, time_s: float) -> float:
        """The delay, at any time."""
        return float(values[0])

    def delay_s(self, values: Array) -> float:
        """The delay."""
        return self.late_s(values, 0.0)

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The delayed signal (n,)."""
        from smartshoe.kernels.shift import shift

        if values[0] == 0.0:
            return signal.copy()
        late, slope = np.empty(signal.size), np.empty(signal.size)
        shift(np.array(signal), -float(values[0]) / conditions.step_s, 1.0, late, slope)
        return late
