"""A reading that is logged late, or early, against the load."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter


class Delay(Effect):
    """y(t - delta), fractions of a sample allowed; delta < 0 where the load is the late one.

    Band-limited (16 neighbours), so that noise is not smoothed by an amount that depends on the fraction. The end
    values hold beyond the ends. There is no streaming inverse: it would need the future.
    """

    name, family, stage, place = "delay", "timing", "logger", "logger"
    says = "the reading is late against the load by a constant time, its corners as sharp as before"
    parameters = (EffectParameter("delay", "s", "time by which the reading is late", 0.0, -3.0, 3.0, 0.01),)
    exposed_by = frozenset({"rates", "steps"})
    separated_by = {"sensor_lag": "step or multisine", "clock_drift": "sync pulse at both ends"}

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The delayed signal."""
        from smartshoe.kernels.shift import weighted_neighbours
        from smartshoe.models.first_order import HALF_WIDTH, interpolation_taps

        if values[0] == 0.0:
            return signal.copy()
        place = -float(values[0]) / conditions.step_s
        whole = int(np.floor(place))
        late = np.empty(signal.size)
        weighted_neighbours(np.array(signal), whole + 1 - HALF_WIDTH, interpolation_taps(place - whole)[0], late)
        return late
