"""Errors in variables: a filter that makes the prediction error white although the input is noisy too.

With white noise of variance ratio r on the input, the error G u - y has the spectrum 1 + r |G|^2 (times the output's
variance). For first-order G this is a ratio of first-order polynomials: one pole to cancel, one zero to place. Least
squares behind that filter is maximum likelihood for known variances (Soderstrom 2007, Automatica 43, 939-958; Pintelon
and Schoukens 2012, ch. 9), and consistent since the filter's gain falls as G grows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._parametrisation import Shape
from smartshoe.kernels.linear_filter import linear_filter
from smartshoe.models.first_order import hold_coefficients, hold_slopes


@dataclass(frozen=True, eq=False)
class Whitening:
    """r_k = (e_k - pole e_(k-1))/deviation + zero r_(k-1), with the derivatives (k,) of all three over theta."""

    pole: float
    zero: float
    deviation: float
    pole_slope: Array
    zero_slope: Array
    deviation_slope: Array


def whitening(shape: Shape, slope: Array, step_s: float, ratio: float, ratio_slope: Array) -> Whitening:
    """The filter for a given response; ``slope`` (3, k) of (ln alpha, p1, p2) and ``ratio_slope`` (k,) over theta.

    1 + ratio |G|^2 = deviation^2 |1 - zero/z|^2/|1 - pole/z|^2: its values at z = 1 and z = -1 give both unknowns
    without subtracting nearly equal numbers.
    """
    x = shape.alpha * step_s
    pole, now, before = (float(value) for value in hold_coefficients(x))
    d_pole, d_now, d_before = (x * float(value) * slope[0] for value in hold_slopes(x))
    drop, d_drop = shape.p2 - shape.p1, slope[2] - slope[1]
    direct, d_direct = shape.p1 + drop * now, slope[1] + d_drop * now + drop * d_now
    later = -shape.p1 * pole + drop * before
    d_later = -slope[1] * pole - shape.p1 * d_pole + d_drop * before + drop * d_before
    low = np.sqrt((1 - pole) ** 2 + ratio * (direct + later) ** 2)
    high = np.sqrt((1 + pole) ** 2 + ratio * (direct - later) ** 2)
    d_low = (
        -(1 - pole) * d_pole
        + ratio * (direct + later) * (d_direct + d_later)
        + 0.5 * ratio_slope * (direct + later) ** 2
    ) / low
    d_high = (
        (1 + pole) * d_pole
        + ratio * (direct - later) * (d_direct - d_later)
        + 0.5 * ratio_slope * (direct - later) ** 2
    ) / high
    deviation, d_deviation = 0.5 * (low + high), 0.5 * (d_low + d_high)
    zero = (high - low) / (high + low)
    d_zero = (d_high - d_low) / (2 * deviation) - zero * d_deviation / deviation
    return Whitening(pole, zero, float(deviation), d_pole, d_zero, d_deviation)


def whitened(white: Whitening, error: Array) -> Array:
    """``error`` (n,) passed through the filter, starting from rest."""
    return linear_filter(np.array([1.0, -white.pole]) / white.deviation, [1.0, -white.zero], error)[0]


def whiten(white: Whitening, error: Array, jacobian: Array) -> tuple[Array, Array]:
    """``error`` (n,) and its derivatives ``jacobian`` (k, n) passed through the filter, starting from rest."""
    poles = [1.0, -white.zero]
    before = np.concatenate([[0.0], error[:-1]])
    innovation = (error - white.pole * before) / white.deviation
    residual = linear_filter([1.0], poles, innovation)[0]
    residual_before = np.concatenate([[0.0], residual[:-1]])
    drive = jacobian / white.deviation
    drive[:, 1:] -= white.pole / white.deviation * jacobian[:, :-1]
    drive -= np.outer(white.deviation_slope / white.deviation, innovation)
    drive -= np.outer(white.pole_slope / white.deviation, before)
    drive += np.outer(white.zero_slope, residual_before)
    return residual, np.stack([linear_filter([1.0], poles, row)[0] for row in drive])
