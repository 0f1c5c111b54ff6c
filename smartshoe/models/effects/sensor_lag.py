"""A sensor that follows the pressure late: a port, a package, a filter."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects.effect import Conditions, CStep, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class SensorLag(Effect):
    """Two poles, at (1 - r) tau and r tau: 1/((1 - r) tau s + 1)/(r tau s + 1); with r = 0, tau y' = P - y.

    tau is the time by which a steady ramp comes late. Hardly any lag has one pole: a port is followed by a filter.
    Exact for a pressure that is a cubic through the four samples around each step, straight lines among them; steady
    before the first one. Signals are smoothed before they are thinned: straight lines between what is left would
    smooth them once more, and at a lag below the step that is a tenth of what the lag does.
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

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The lagged signal."""
        tau, r = (float(value) for value in values)
        if tau == 0.0:
            return signal.copy()
        step_s = float(conditions.step_s)
        slow = _lagged(signal, step_s / ((1.0 - r) * tau))
        if r * tau == 0.0:
            return slow
        # In partial fractions, since only what goes into the first pole is known between samples.
        fast = _lagged(signal, step_s / (r * tau))
        return slow + (r / (1.0 - 2.0 * r)) * (slow - fast)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """P = y + T y' for either pole, with the slope since the last sample.

        Exact for a steady ramp, to first order of the step elsewhere. The recursion's own inverse would be exact, but
        it rings at half the sampling rate and raises noise thirty times as much.
        """
        tau, r = (float(value) for value in values)
        return _Lead((1.0 - r) * tau / step_s, r * tau / step_s)


NODES = np.array([-2.0, -1.0, 0.0, 1.0])  # samples that the cubic from -1 to 0 passes through
CUBICS = np.linalg.inv(np.vander(NODES, increasing=True))  # (power, node): the polynomial of each sample's value
POINTS, WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(12))  # on -1/2 ... 1/2
POWERS = (POINTS - 0.5) ** np.arange(4)[:, None]  # (power, point): of s between -1 and 0


def _weights(x: float) -> Array:
    """(4,) of the samples at `NODES` in w(0) = exp(-x) w(-1) + integral of x exp(x s) u(s) from -1 to 0."""
    if x < 2.0:
        moments = np.sum(WEIGHTS * x * np.exp(x * POWERS[1]) * POWERS, axis=1)
    else:
        decay, moments = math.exp(-x), np.empty(4)
        moments[0] = 1.0 - decay
        for i in range(1, 4):
            moments[i] = -((-1.0) ** i) * decay - i / x * moments[i - 1]
    return np.asarray(moments @ CUBICS)


def _lagged(u: Array, x: float) -> Array:
    """w (n,) of w' = (u - w) x, the step being 1, from w = u before the first sample."""
    from smartshoe.kernels.linear_filter import linear_filter

    if u.size < 2:
        return u.copy()
    padded = np.concatenate([[u[0], u[0]], u, [2.0 * u[-1] - u[-2]]])
    drive = np.convolve(padded, _weights(x)[::-1], "valid")
    decay = math.exp(-x)
    drive[0] = (1.0 - decay) * u[0]
    return linear_filter([1.0], [1.0, -decay], drive, [decay * u[0]])[0]


class _Lead(Inverse):
    """Two leads in a row, their times in steps."""

    def __init__(self, slow: float, fast: float) -> None:
        self.slow, self.fast = slow, fast
        self.reset()

    def reset(self) -> None:
        self._last: tuple[float, float] | None = None

    def push(self, signal: Array, time_s: Array) -> Array:
        if signal.size == 0:
            return signal.copy()
        first, second = self._last or (float(signal[0]), float(signal[0]))
        between = signal + self.slow * np.diff(signal, prepend=first)
        self._last = float(signal[-1]), float(between[-1])
        return between + self.fast * np.diff(between, prepend=second)

    def c_step(self, name: str) -> CStep:
        first, second, begun = f"{name}_first", f"{name}_second", f"{name}_begun"
        body = f"""{{
    const double lagged = x;
    if (f->{begun} <= 0.0) {{
        f->{first} = x;
        f->{second} = x;
        f->{begun} = 1.0;
    }}
    x += {c_number(self.slow)} * (x - f->{first});
    f->{first} = lagged;
    {{
        const double between = x;
        x += {c_number(self.fast)} * (x - f->{second});
        f->{second} = between;
    }}
}}"""
        return CStep({first: 0.0, second: 0.0, begun: 0.0}, body)
