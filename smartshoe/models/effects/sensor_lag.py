"""A sensor that follows the pressure with a first-order lag."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects.effect import Array, Conditions, CStep, Effect, EffectParameter, Inverse


class SensorLag(Effect):
    """tau y' = P - y, exact for a pressure that is a straight line between samples; steady before the first one."""

    name, family, stage, place = "sensor_lag", "timing", "sensor", "sensor"
    says = "the reading comes late and rounds corners: after a step it approaches its end value exponentially"
    parameters = (EffectParameter("time_constant", "s", "time constant of the lag", 0.0, 0.0, 2.0, 0.01),)
    exposed_by = frozenset({"rates", "steps"})
    separated_by = {"delay": "step or multisine", "rate_gain": "rates", "second_relaxation": "step"}

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The lagged signal."""
        from smartshoe.models.first_order import lag

        tau = float(values[0])
        return lag(signal, 1.0 / tau, float(conditions.step_s)) if tau > 0.0 else signal.copy()

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """P = y + tau y', with the slope since the last sample.

        Exact for a steady ramp, to first order of the step elsewhere. The recursion's own inverse would be exact, but
        it rings at half the sampling rate and raises noise thirty times as much.
        """
        return _Lead(float(values[0]) / step_s)


class _Lead(Inverse):
    def __init__(self, steps: float) -> None:
        self.steps = steps
        self.reset()

    def reset(self) -> None:
        self._last: float | None = None

    def push(self, signal: Array, time_s: Array) -> Array:
        if signal.size == 0:
            return signal.copy()
        first = signal[0] if self._last is None else self._last
        self._last = float(signal[-1])
        return signal + self.steps * np.diff(signal, prepend=first)

    def c_step(self, name: str) -> CStep:
        last, begun = f"{name}_last", f"{name}_begun"
        body = f"""{{
    const double lagged = x;
    if (f->{begun} > 0.0) {{
        x += {c_number(self.steps)} * (lagged - f->{last});
    }}
    f->{begun} = 1.0;
    f->{last} = lagged;
}}"""
        return CStep({last: 0.0, begun: 0.0}, body)
