"""A sensor that follows the pressure late: a port, a package, a filter, a tube with its cavity."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._one_pole import Lead, lagged, lagged_by_pair
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

EQUAL = 0.5  # the `second_pole` at which both poles are as fast
NEAR = 3e-5  # least distance from it: below, the partial fractions would lose digits, and what is lost of q is 1e-9
FASTEST = 1e12  # a lag of fewer parts of a step is below rounding


class SensorLag(Effect):
    """Two poles, 1/(1 + tau s + q tau^2 s^2).

    tau is the time by which a steady ramp comes late. Up to r = 1/2 (``second_pole``) the poles are real, (1 - r) tau
    and r tau, so that q = r (1 - r); with r = 0, tau y' = P - y. Hardly any lag has one pole, since a port is followed
    by a filter. From there on they are a pair, q = 1/4 + (r - 1/2)^2, of damping ratio 1/(2 sqrt q): r = 1 is a
    Butterworth filter, as stands before a sampler, and a tube with its cavity lies above. Both q have a slope of zero
    at 1/2. r ends at 2, a damping ratio of 0.32, where a step is overshot by a third: what swings farther is no lag but
    a resonance, of which the first peaks would be taken for those of the load.

    Exact for a pressure that is a cubic through the four samples around each step, straight lines among them, and
    steady before the first one. Straight lines alone would not do: signals are smoothed before they are thinned, and
    lines between the remaining samples would smooth them again, by a tenth of the effect of a lag below the step.
    """

    name, family, stage, place = "sensor_lag", "timing", "sensor", "sensor"
    says = "the reading comes late and rounds corners: after a step it settles exponentially, or swings in once"
    parameters = (
        EffectParameter("time_constant", "s", "time by which a steady ramp comes late", 0.0, 0.0, 3.0, 0.01),
        EffectParameter(
            "second_pole", "1",
            "share of that in a second, faster pole; above 0.5 the two are a pair that overshoots (1: Butterworth)",
            None, 0.0, 2.0, 0.1, natural="lower",
        ),
    )  # fmt: skip
    shapes = ({"second_pole": 0.1}, {"second_pole": 0.4})  # a fit finds the pair from 0.4
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
        """The time by which a ramp is late, whatever the second pole."""
        return float(values[0])

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The lagged signal."""
        tau, r = (float(value) for value in values)
        if tau == 0.0:
            return signal.copy()
        step_s = float(conditions.step_s)
        if r > EQUAL:
            return lagged_by_pair(signal, min(step_s / tau, FASTEST) / complex(0.5, max(r - EQUAL, NEAR)))
        r = min(r, EQUAL - NEAR)
        slow = lagged(signal, step_s / ((1.0 - r) * tau))
        if r * tau == 0.0:
            return slow
        # In partial fractions, since between samples only the input of the first pole is known.
        fast = lagged(signal, step_s / (r * tau))
        return slow + (r / (1.0 - 2.0 * r)) * (slow - fast)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """P = y + tau y' + q tau^2 y'', q no more than 1/4, with the slopes since the last samples.

        For real poles that is a lead for each, exact for a steady ramp and to first order in the step elsewhere. The
        recursion's exact inverse would ring at half the sampling rate, and raise noise thirty times as much. Of a pair
        the swing is left: all of y'' raises noise so far that, smoothed to what a compensator allows, the force is
        later than the reading (8.2 N for 7.2 N of a tube with a damping ratio of 0.4, 4.1 N as it is here).
        """
        tau, r = (float(value) for value in values)
        r = min(r, EQUAL)
        return Lead(tau / step_s, tau / step_s, r * (1.0 - r) * tau / step_s)
