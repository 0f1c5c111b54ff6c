"""First-order lags of a sampled signal, one or two in a row, and their inverse on a stream."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects.effect import CStep, Inverse

NODES = np.array([-2.0, -1.0, 0.0, 1.0])  # samples that the cubic from -1 to 0 passes through
CUBICS = np.linalg.inv(np.vander(NODES, increasing=True))  # (power, node): the polynomial of each sample's value
POINTS, WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(12))  # on -1/2 ... 1/2
POWERS = (POINTS - 0.5) ** np.arange(4)[:, None]  # (power, point): of s between -1 and 0


def _weights(x: float) -> Array:
    """(4,) weights of the samples at `NODES` in the integral of x exp(x s) u(s) over s from -1 to 0, u a cubic."""
    if x < 2.0:
        moments = np.sum(WEIGHTS * x * np.exp(x * POWERS[1]) * POWERS, axis=1)
    else:
        decay, moments = math.exp(-x), np.empty(4)
        moments[0] = 1.0 - decay
        for i in range(1, 4):
            moments[i] = -((-1.0) ** i) * decay - i / x * moments[i - 1]
    return np.asarray(moments @ CUBICS)


def lagged(u: Array, x: float) -> Array:
    """w (n,) of w' = (u - w) x for ``u`` (n,), time in steps, from w = u before the first sample."""
    from smartshoe.kernels.linear_filter import linear_filter

    if u.size < 2:
        return u.copy()
    decay = math.exp(-x)
    return linear_filter([1.0], [1.0, -decay], _drive(u, x), [decay * u[0]])[0]


def lagged_by_direction(u: Array, rising: float, falling: float) -> Array:
    """`lagged`, with x = ``rising`` while u lies above w, and x = ``falling`` while it lies below."""
    from smartshoe.kernels import sensing

    if u.size < 2:
        return u.copy()
    rise, fall = _drive(u, rising), _drive(u, falling)
    return np.asarray(sensing.lagged_by_direction(u[0], rise, math.exp(-rising), fall, math.exp(-falling)))


def _drive(u: Array, x: float) -> Array:
    """(n,) what each step adds to w, beside exp(-x) times its last value."""
    padded = np.concatenate([[u[0], u[0]], u, [2.0 * u[-1] - u[-2]]])
    drive: Array = np.convolve(padded, _weights(x)[::-1], "valid")
    drive[0] = (1.0 - math.exp(-x)) * u[0]
    return drive


class Lead(Inverse):
    """Two leads in a row, the inverse of two lags; their times are in steps.

    The first one's time is ``rising`` or ``falling``, as the signal rises or falls; the second one's is ``fast``.
    """

    def __init__(self, rising: float, falling: float, fast: float) -> None:
        self.rising, self.falling, self.fast = rising, falling, fast
        self.reset()

    def reset(self) -> None:
        self._last: tuple[float, float] | None = None

    def push(self, signal: Array, time_s: Array) -> Array:
        if signal.size == 0:
            return signal.copy()
        first, second = self._last or (float(signal[0]), float(signal[0]))
        moved = np.diff(signal, prepend=first)
        between = signal + np.where(moved > 0.0, self.rising, self.falling) * moved
        self._last = float(signal[-1]), float(between[-1])
        return between + self.fast * np.diff(between, prepend=second)

    def c_step(self, name: str) -> CStep:
        first, second, begun = f"{name}_first", f"{name}_second", f"{name}_begun"
        slow = f"x += {c_number(self.rising)} * (x - f->{first});"
        if self.falling != self.rising:
            falling = f"x += {c_number(self.falling)} * (x - f->{first});"
            slow = f"if (x > f->{first}) {{ {slow} }} else {{ {falling} }}"
        body = f"""{{
    const double lagged = x;
    if (f->{begun} <= 0.0) {{
        f->{first} = x;
        f->{second} = x;
        f->{begun} = 1.0;
    }}
    {slow}
    f->{first} = lagged;
    {{
        const double between = x;
        x += {c_number(self.fast)} * (x - f->{second});
        f->{second} = between;
    }}
}}"""
        return CStep({first: 0.0, second: 0.0, begun: 0.0}, body)
