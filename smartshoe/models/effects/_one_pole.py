"""Lags of a sampled signal, by one pole or by a pair that swings, and their inverse on a stream."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects.effect import CStep, Inverse

NODES = np.array([-2.0, -1.0, 0.0, 1.0])  # samples that the cubic from -1 to 0 passes through
CUBICS = np.linalg.inv(np.vander(NODES, increasing=True))  # (power, node): the polynomial of each sample's value
POINTS, WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(12))  # on -1/2 ... 1/2
POWERS = (POINTS - 0.5) ** np.arange(4)[:, None]  # (power, point): of s between -1 and 0


def _weights(x: complex, decay: complex) -> NDArray[Any]:
    """(4,) weights of the samples at `NODES` in the integral of x exp(x s) u(s) over s from -1 to 0, u a cubic.

    ``decay`` is exp(-x); the weights are real where x is.
    """
    if abs(x) < 2.0:
        moments: NDArray[Any] = np.sum(WEIGHTS * x * np.exp(x * POWERS[1]) * POWERS, axis=1)
    else:
        moments = np.empty(4, dtype=type(x))
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
    return linear_filter([1.0], [1.0, -decay], _drive(u, x, decay), [decay * u[0]])[0]


def lagged_by_pair(u: Array, x: complex) -> Array:
    """y (n,) of the poles -x and its conjugate, in 1/steps, for ``u`` (n,); u = y before the first sample.

    In partial fractions the one is the conjugate of the other, so that one complex recursion gives both:
    y = Re w + Re T/Im T Im w with w' = (u - w) x and T = 1/x.
    """
    from smartshoe.kernels import sensing

    if u.size < 2:
        return u.copy()
    decay = cmath.exp(-x)
    return np.asarray(sensing.lagged_by_pair(u[0], _drive(u, x, decay), decay, -x.real / x.imag))


def lagged_by_direction(u: Array, rising: float, falling: float) -> Array:
    """`lagged`, with x = ``rising`` while u lies above w, and x = ``falling`` while it lies below."""
    from smartshoe.kernels import sensing

    if u.size < 2:
        return u.copy()
    keep_rising, keep_falling = math.exp(-rising), math.exp(-falling)
    rise, fall = _drive(u, rising, keep_rising), _drive(u, falling, keep_falling)
    return np.asarray(sensing.lagged_by_direction(u[0], rise, keep_rising, fall, keep_falling))


def _drive(u: Array, x: complex, decay: complex) -> NDArray[Any]:
    """(n,) what each step adds to w, beside ``decay`` = exp(-x) times its last value."""
    from smartshoe.kernels import sensing

    return np.asarray(sensing.driven(np.ascontiguousarray(u), _weights(x, decay), (1.0 - decay) * u[0]))


class Lead(Inverse):
    """x = y + T (Dy + turning D(Dy)), D the difference to the last sample: the inverse of a lag of one or two poles.

    T is ``rising`` or ``falling``, as the signal rises or falls. Both times are in steps; two leads T1 and T2 in a row
    have T = T1 + T2 and turning = T1 T2/T.
    """

    def __init__(self, rising: float, falling: float, turning: float = 0.0) -> None:
        self.rising, self.falling, self.turning = rising, falling, turning
        self.reset()

    def reset(self) -> None:
        self._last: tuple[float, float] | None = None  # the signal, and by how much it had moved

    def push(self, signal: Array, time_s: Array) -> Array:
        if signal.size == 0:
            return signal.copy()
        before, moved_before = self._last or (float(signal[0]), 0.0)
        moved = np.diff(signal, prepend=before)
        lead = np.where(moved > 0.0, self.rising, self.falling)
        self._last = float(signal[-1]), float(moved[-1])
        return np.asarray(signal + lead * (moved + self.turning * np.diff(moved, prepend=moved_before)))

    def c_step(self, name: str) -> CStep:
        last, moved, begun = f"{name}_last", f"{name}_moved", f"{name}_begun"
        states = {last: 0.0, begun: 0.0}
        lead, turn, keep, forget = c_number(self.rising), "moved", "", ""
        if self.falling != self.rising:
            lead = f"(moved > 0.0 ? {lead} : {c_number(self.falling)})"
        if self.turning != 0.0:
            states[moved] = 0.0
            turn = f"(moved + {c_number(self.turning)} * (moved - f->{moved}))"
            keep, forget = f"\n    f->{moved} = moved;", f"\n        f->{moved} = 0.0;"
        body = f"""{{
    double moved;
    if (f->{begun} <= 0.0) {{
        f->{last} = x;{forget}
        f->{begun} = 1.0;
    }}
    moved = x - f->{last};
    f->{last} = x;
    x += {lead} * {turn};{keep}
}}"""
        return CStep(states, body)
