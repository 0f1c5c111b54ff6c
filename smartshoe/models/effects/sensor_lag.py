"""A sensor that follows the pressure late: a port, a package, a filter."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._one_pole import Lead, lagged
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class SensorLag(Effect):
    """Two poles, at (1 - r) tau and r tau: 1/((1 - r) tau s + 1)/(r tau s + 1); with r = 0, tau y' = P - y.

    tau is the time by which a steady ramp comes late. Hardly any lag has one pole, since a port is followed by a
    filter. Exact for a pressure that is a cubic through the four samples around each step, straight lines among them,
    and steady before the first one. Straight lines alone would not do: signals are smoothed before they are thinned,
    and lines between the remaining samples would smooth them again, by a tenth of the effect of a lag below the step.
    """

    name, family, stage, place = "sensor_lag", "timing", "sensor", "sensor"
    says = "the reading comes late and rounds corners: after a step it approaches its end value exponentially"
    parameters = (
        EffectParameter("time_constant", "s", "time by which a steady ramp comes late", 0.0, 0.0, 3.0, 0.01),
        EffectParameter(
            "second_pole", "1", "share of that in a second, faster pole", None, 0.0, 0.45, 0.1, natural="lower"
        ),
    )
    shapes = ({"second_pole": 0.1}, {"second_pole": 0.4})
    exposed_by = by("rates", "steps")
    separated_by = {
        "clock_drift": by("repeats", "steps"),
        "delay": by("steps", "multisine"),
        "rate_gain": by("rates"),
        "second_relaxation": by("steps"),
    }
    is_latency = True
    branch = "lag"

    def late_s(self, values: Array, time_s: float) -> float:
        """The time constants of both poles together."""
        return float(values[0])

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The lagged signal."""
        tau, r = (float(value) for value in values)
        if tau == 0.0:
            return signal.copy()
        step_s = float(conditions.step_s)
        slow = lagged(signal, step_s / ((1.0 - r) * tau))
        if r * tau == 0.0:
            return slow
        # In partial fractions, since between samples only the input of the first pole is known.
        fast = lagged(signal, step_s / (r * tau))
        return slow + (r / (1.0 - 2.0 * r)) * (slow - fast)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """P = y + T y' for either pole, with the slope since the last sample.

        Exact for a steady ramp, to first order in the step elsewhere. The recursion's exact inverse would ring at half
        the sampling rate, and raise noise thirty times as much.
        """
        tau, r = (float(value) for value in values)
        slow = (1.0 - r) * tau / step_s
        return Lead(slow, slow, r * tau / step_s)
