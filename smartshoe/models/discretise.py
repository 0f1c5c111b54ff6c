"""Difference equations of (b0 s + b1)/(s + a1): bilinear, zero-order hold, first-order hold, at any rate."""

from __future__ import annotations

from typing import Literal

import numpy as np

from smartshoe.arrays import Array, require_positive
from smartshoe.errors import UsageError
from smartshoe.models.first_order import hold_coefficients

Hold = Literal["bilinear", "zoh", "foh"]


def discretise(
    a1: float, b0: float, b1: float, sample_rate_hz: float, method: Hold = "bilinear"
) -> tuple[Array, Array]:
    """Numerator (2,) and denominator (2,), monic, in falling powers of z, of (b0 s + b1)/(s + a1).

    ``bilinear`` is what the paper runs at 100 Hz (Chinimilli 2016, Section V); ``zoh`` and ``foh`` are exact for
    stairs and for straight lines between samples. ``a1`` in 1/s, above 0.
    """
    sample_rate_hz = require_positive(sample_rate_hz, "sample_rate_hz")
    if not (a1 > 0 and np.isfinite([a1, b0, b1]).all()):
        raise UsageError(f"a1 = {a1:g}, b0 = {b0:g}, b1 = {b1:g} is no stable filter: a1 must be above 0, all finite")
    if method == "bilinear":
        w = 2.0 * sample_rate_hz
        return np.array([b0 * w + b1, b1 - b0 * w]) / (w + a1), np.array([1.0, (a1 - w) / (a1 + w)])
    x = a1 / sample_rate_hz
    gain = b1 / a1 - b0
    if method == "zoh":
        decay = float(np.exp(-x))
        return np.array([b0, -gain * np.expm1(-x) - decay * b0]), np.array([1.0, -decay])
    if method == "foh":
        decay, now, before = (float(value) for value in hold_coefficients(x))
        return np.array([b0 + gain * now, gain * before - decay * b0]), np.array([1.0, -decay])
    raise UsageError(f"method {method!r} is not known: use bilinear, zoh or foh")


def run_plainly(numerator: Array, denominator: Array, u: Array) -> Array:
    """y (n,) of the difference equation for ``u`` (n,), from steady state at u[0]; a loop as written on paper.

    The slow twin that tests hold the fast paths against.
    """
    gain = (numerator[0] + numerator[1]) / (1.0 + denominator[1])
    y = np.empty(len(u))
    u_before, y_before = u[0], gain * u[0]
    for k, u_now in enumerate(u):
        y_before = numerator[0] * u_now + numerator[1] * u_before - denominator[1] * y_before
        u_before = u_now
        y[k] = y_before
    return y
