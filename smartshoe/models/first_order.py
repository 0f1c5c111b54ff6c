"""First-order responses, exact for straight lines between samples (first-order hold), on even and uneven steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.kernels.linear_filter import linear_filter

Steps = float | Array
SMALL = 1e-3
EVEN_TOLERANCE = 1e-3  # of a step: far below the jitter that moves an estimate, above rounded time stamps


def steps(time_s: Array) -> Steps:
    """The step in s where ``time_s`` (n,) is even to 0.1 % of it, else all steps (n - 1,)."""
    step = np.diff(time_s)
    if step.size == 0:
        return 1.0
    mean = float((time_s[-1] - time_s[0]) / step.size)
    return mean if max(step.max() - mean, mean - step.min()) <= EVEN_TOLERANCE * mean else step


def hold_coefficients(x: Any) -> tuple[Any, Any, Any]:
    """E, A, B of ``w_k = E w_{k-1} + A u_k + B u_{k-1}`` for w = alpha/(s + alpha) u under first-order hold.

    ``x`` = alpha times the step, a float or an array. With phi = (1 - E)/x: E = exp(-x), A = 1 - phi, B = phi - E.
    """
    if isinstance(x, float):
        now = 1.0 + math.expm1(-x) / x if x > SMALL else _now_series(x)
        return math.exp(-x), now, -math.expm1(-x) - now
    x = np.asarray(x, dtype=float)
    safe = np.where(x > SMALL, x, 1.0)
    now = np.where(x > SMALL, 1.0 + np.expm1(-safe) / safe, _now_series(x))
    return np.exp(-x), now, -np.expm1(-x) - now


def hold_slopes(x: Any) -> tuple[Any, Any, Any]:
    """Derivatives of `hold_coefficients` with respect to ``x``."""
    if isinstance(x, float):
        decay = math.exp(-x)
        slope = (decay + math.expm1(-x) / x) / x if x > SMALL else _phi_slope_series(x)
        return -decay, -slope, slope + decay
    x = np.asarray(x, dtype=float)
    decay = np.exp(-x)
    safe = np.where(x > SMALL, x, 1.0)
    slope = np.where(x > SMALL, (np.exp(-safe) + np.expm1(-safe) / safe) / safe, _phi_slope_series(x))
    return -decay, -slope, slope + decay


def as_kernels_take(step: Steps) -> tuple[float, Array | None]:
    """``step`` as two arguments: the first step in s, and all of them (n - 1,) where they are uneven, else None.

    numba leaves out the branch of a None before it compiles: most data are even, and never compile the other one.
    """
    return (step, None) if isinstance(step, float) else (float(step[0]), step)


def _now_series(x: Any) -> Any:
    # 1 - phi loses digits for small x; its series does not.
    return x * (1 / 2 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))


def _phi_slope_series(x: Any) -> Any:
    return -1 / 2 + x * (1 / 3 - x * (1 / 8 - x * (1 / 30 - x / 144)))


@cache
def _compiled() -> Callable[..., None]:
    from numba import njit

    def recursion(decay, drive, out):  # type: ignore[no-untyped-def]
        for k in range(1, out.size):
            out[k] = decay[k - 1] * out[k - 1] + drive[k - 1]

    compiled: Callable[..., None] = njit(recursion)
    return compiled


def _recur(start: float, decay: Array, drive: Array) -> Array:
    out = np.empty(drive.size + 1)
    out[0] = start
    if drive.size < 2000:  # compiling costs more than a short plain loop
        for k in range(drive.size):
            out[k + 1] = decay[k] * out[k] + drive[k]
    else:
        _compiled()(decay, drive, out)
    return out


def lag(u: Array, alpha: float, step: Steps) -> Array:
    """w (n,) = alpha/(s + alpha) u, started in the steady state of u[0]; ``alpha`` in 1/s, ``step`` from `steps`."""
    if isinstance(step, float):
        decay, now, before = (float(value) for value in hold_coefficients(alpha * step))
        return linear_filter([now, before], [1.0, -decay], u, [u[0] - now * u[0]])[0]
    decay, now, before = hold_coefficients(alpha * step)
    return _recur(float(u[0]), decay, now * u[1:] + before * u[:-1])


def lag_and_slope(u: Array, alpha: float, step: Steps) -> tuple[Array, Array]:
    """`lag` and its derivative with respect to ``alpha``, both (n,)."""
    w = lag(u, alpha, step)
    d_decay, d_now, d_before = hold_slopes(alpha * step)
    drive = step * (d_decay * w[:-1] + d_now * u[1:] + d_before * u[:-1])
    if isinstance(step, float):
        full = np.concatenate([[0.0], drive])
        return w, linear_filter([1.0], [1.0, -float(np.exp(-alpha * step))], full)[0]
    return w, _recur(0.0, np.exp(-alpha * step), drive)


def simulate(
    a1: float, b0: float, b1: float, u: Array, time_s: Array, start: Literal["steady", "rest"] = "steady"
) -> Array:
    """y (n,) of (b0 s + b1)/(s + a1) driven by ``u`` (n,), straight lines between samples; Chinimilli 2016 (13).

    ``start``: "steady" in the steady state of u[0], "rest" as if u had been 0 before. Exact for any steps.
    """
    if not a1 > 0.0:
        raise UsageError(f"a1 is {a1:g}: the pole must be stable, give a1 above 0")
    u = np.asarray(u, dtype=float)
    time = np.asarray(time_s, dtype=float)
    if u.size == 0:
        return np.zeros(0)
    w = lag(u, a1, steps(time))
    y: Array = b0 * (u - w) + (b1 / a1) * w
    if start == "rest":
        y = y + (b0 - b1 / a1) * u[0] * np.exp(-a1 * (time - time[0]))
    return y


HALF_WIDTH = 8  # neighbours on either side: all-pass up to nine tenths of the Nyquist frequency


def interpolation_taps(fraction: float) -> tuple[Array, Array]:
    """Weights (16,) of the neighbours -7 ... 8 for a value at ``fraction`` (0 to 1) past a sample, and their slopes.

    A sinc behind a raised-cosine window, mended to pass constants and ramps as they are. Interpolation over few
    neighbours would smooth the noise, by an amount that depends on the fraction, and a fit would take that for a
    delay.
    """
    x = fraction - np.arange(1 - HALF_WIDTH, HALF_WIDTH + 1)
    angle = np.pi * x
    safe = np.where(np.abs(x) > 1e-4, x, 1.0)
    near = np.abs(x) <= 1e-4
    sinc = np.where(near, 1 - angle**2 / 6, np.sin(angle) / (np.pi * safe))
    sinc_slope = np.where(near, -np.pi * angle / 3, (np.cos(angle) - np.sin(angle) / (np.pi * safe)) / safe)
    window = 0.5 + 0.5 * np.cos(angle / HALF_WIDTH)
    window_slope = -0.5 * np.pi / HALF_WIDTH * np.sin(angle / HALF_WIDTH)
    taps, slopes = sinc * window, sinc_slope * window + sinc * window_slope
    total = taps.sum()
    taps, slopes = taps / total, (slopes - taps * slopes.sum() / total) / total
    places = np.arange(1.0 - HALF_WIDTH, HALF_WIDTH + 1.0)
    missing, missing_slope = fraction - places @ taps, 1.0 - places @ slopes
    nearest = slice(HALF_WIDTH - 1, HALF_WIDTH + 1)
    taps[nearest] += np.array([-missing, missing])
    slopes[nearest] += np.array([-missing_slope, missing_slope])
    return taps, slopes


def interpolation_gain(shift_s: float, time_s: Array, step: Steps) -> tuple[float, float]:
    """The share of white noise's power that `shifted` lets through, and its derivative with respect to the shift."""
    if isinstance(step, float):
        from smartshoe.kernels.shift import NEIGHBOURS, fill_taps

        taps, slopes = np.empty(NEIGHBOURS), np.empty(NEIGHBOURS)
        fill_taps(shift_s / step - math.floor(shift_s / step), taps, slopes)
        return float(taps @ taps), float(2.0 * taps @ slopes) / step
    some = time_s[: 2000 + 2]
    at = np.clip(some[:-1] + shift_s, some[0], some[-1])
    k = np.clip(np.searchsorted(some, at, side="right") - 1, 0, some.size - 2)
    f, h = (at - some[k]) / step[k], step[k]
    # The four weights of the cubic that has the neighbours' mean slopes (Catmull and Rom 1974), on even steps.
    taps = 0.5 * np.stack([f * (-1 + f * (2 - f)), 2 + f**2 * (3 * f - 5), f * (1 + f * (4 - 3 * f)), f**2 * (f - 1)])
    slopes = 0.5 * np.stack([-1 + f * (4 - 3 * f), f * (9 * f - 10), 1 + f * (8 - 9 * f), f * (3 * f - 2)])
    return float(np.mean(np.sum(taps**2, axis=0))), float(np.mean(np.sum(2 * taps * slopes, axis=0) / h))


def shifted(u: Array, time_s: Array, step: Steps, shift_s: float) -> tuple[Array, Array]:
    """u(t + shift) (n,) and its derivative with respect to the shift.

    `interpolation_taps` on even steps; cubic Hermite on uneven ones. Either passes through the samples and has no
    kinks, so that a delay can be found by its gradient. Beyond the ends the end values hold.
    """
    n = u.size
    if isinstance(step, float):
        from smartshoe.kernels.shift import shift

        value, slope = np.empty(n), np.empty(n)
        shift(u, shift_s / step, 1.0 / step, value, slope)
        return value, slope
    gradient = np.gradient(u, time_s)
    at = np.clip(time_s + shift_s, time_s[0], time_s[-1])
    k = np.clip(np.searchsorted(time_s, at, side="right") - 1, 0, n - 2)
    h = step[k]
    f_ = (at - time_s[k]) / h
    rise = u[k + 1] - u[k]
    first, last = h * gradient[k], h * gradient[k + 1]
    third, second = first + last - 2 * rise, 3 * rise - 2 * first - last
    return u[k] + f_ * (first + f_ * (second + f_ * third)), (first + f_ * (2 * second + 3 * f_ * third)) / h
