"""A lag that depends on the direction, as behind a valve, a flap or a meniscus that opens one way."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._one_pole import Lead, lagged_by_direction
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleLag(Effect):
    """tau (1 + d) y' = P - y while y rises, tau (1 - d) y' = P - y while it falls.

    No law of timing does so: a filter and a transport are as late one way as the other. Such a law follows nearly as
    well where d is small. In a single load cycle a lag by direction cannot be told from one that changes with time.
    """

    name, family, stage, place = "flexible_lag", "timing", "sensor", "sensor"
    says = "the reading is later one way than the other"
    parameters = (
        EffectParameter("time_constant", "s", "mean of the times by which rise and fall are late", 0.0, 0.0, 3.0, 0.01),
        EffectParameter(
            "direction", "1", "share by which a rise is later than that, and a fall earlier", None, -0.95, 0.95, 0.1,
            natural="both",
        ),
    )  # fmt: skip
    shapes = ({"direction": -0.8}, {"direction": 0.8})
    exposed_by = by("repeats")
    is_flexible = True
    branch = "lag"
    is_steep_undone = True
    why_unnamed = "comes later one way than the other, as through a passage that opens one way"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The lagged signal."""
        tau, direction = (float(value) for value in values)
        if tau == 0.0:
            return signal.copy()
        step_s = float(conditions.step_s)
        return lagged_by_direction(signal, step_s / ((1.0 + direction) * tau), step_s / ((1.0 - direction) * tau))

    def departs_by(self, values: Array) -> float:
        """The share by which rises and falls differ from the mean lag."""
        return abs(float(values[1]))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """P = y + T y', with T by the sign of the slope since the last sample; exact for steady ramps."""
        tau, direction = (float(value) for value in values)
        return Lead((1.0 + direction) * tau / step_s, (1.0 - direction) * tau / step_s)
