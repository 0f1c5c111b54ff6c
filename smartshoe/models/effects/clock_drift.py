"""Two clocks of different rates: the reading's delay grows with time."""

from __future__ import annotations

from functools import cache

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_clock import running_time_s
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter
from smartshoe.models.effects.exposure import by

FRACTIONS = 512  # of a sample; interpolating weights between them is 2e-6 off at a signal's highest tones


@cache
def _weights() -> Array:
    """(fractions, 16) weights by which neighbours give the value at each fraction of a sample."""
    from smartshoe.models.first_order import interpolation_taps

    return np.array([interpolation_taps(k / FRACTIONS)[0] for k in range(FRACTIONS + 1)])


class ClockDrift(Effect):
    """y(t - epsilon t): epsilon > 0 where the reading falls behind the load; band-limited as `delay` is."""

    name, family, stage, place = "clock_drift", "timing", "logger", "logger"
    says = "the reading falls behind the load more and more, or runs ahead of it: two clocks of different rates"
    parameters = (
        EffectParameter("clock_rate_error", "1", "seconds lost by the reading's log a second", 0.0, -0.01, 0.01, 1e-4),
    )
    exposed_by = by("rates", "repeats")
    separated_by = {
        "delay": by("repeats", "steps"),
        "sensor_lag": by("repeats", "steps"),
    }
    is_latency = is_drift = True
    between_clocks = "rate"
    branch = "rates of two clocks"
    why_not_undone = "a stream of readings cannot be moved to another time: shift whole recordings instead"

    def late_s(self, values: Array, time_s: float) -> float:
        """The time lost since the recording's beginning."""
        return float(values[0]) * time_s

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal (n,) as the other clock logs it."""
        from smartshoe.kernels.sensing import at_places

        if values[0] == 0.0:
            return signal.copy()
        late_samples = float(values[0]) / conditions.step_s * running_time_s(conditions)
        moved = np.empty(signal.size)
        at_places(np.array(signal), late_samples, _weights(), moved)
        return moved
