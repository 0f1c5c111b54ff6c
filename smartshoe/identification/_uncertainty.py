"""Covariance of the estimate, and likelihood-profile intervals where the covariance is too coarse an approximation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._prediction_error import PredictionError
from smartshoe.identification._solve import Evaluation, solve_normal
from smartshoe.signals.noise import NORMAL_95

PERSISTENT_CONDITION = 1e-13
CURVED = 0.1  # sd of ln alpha beyond which the linear approximation is too coarse for an interval
PROFILE_ITERATIONS = 30

Function = Callable[[Array], tuple[float, Array]]
"""A scalar of theta (size,) with its gradient (size,)."""


def inverse_normal(normal: Array) -> tuple[Array, bool]:
    """(J'J)^-1 and whether J'J is singular within rounding."""
    norms = np.sqrt(np.maximum(np.diag(normal), 0.0))
    scale = np.where(norms > 0.0, norms, 1.0)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    floor = PERSISTENT_CONDITION * values[-1]
    inverse: Array = (vectors / np.maximum(values, floor)) @ vectors.T / np.outer(scale, scale)
    return inverse, not bool(values[0] > floor)


def t_quantile(degrees: int) -> float:
    """The 97.5 % quantile of Student's t."""
    if degrees > 1000:  # expansion in 1/degrees (Abramowitz and Stegun 26.7.5), avoiding the import of scipy.stats
        z = NORMAL_95
        return z + (z**3 + z) / (4 * degrees)
    from scipy.special import stdtrit

    return float(stdtrit(degrees, 0.975))


def profile_interval(
    problem: PredictionError, theta: Array, seen: Evaluation, variance: float, quantile: float, function: Function
) -> tuple[float, float]:
    """The lowest and highest value of ``function`` in the region cost <= least cost + quantile^2 variance.

    The likelihood-profile interval (Venzon and Moolgavkar 1988, Applied Statistics 37, 87-94). It is found by repeating
    the largest step that the local quadratic allows until the region's border is reached. An end is infinite where the
    border is not reached. Where the search went beyond the border without converging to it, as for a delay, whose cost
    is not smooth between samples, the furthest point is used, so that the interval is too wide rather than too narrow.
    """
    ends = [
        _profile_end(problem, theta, seen, seen.cost + quantile**2 * variance, function, sign) for sign in (-1.0, 1.0)
    ]
    return ends[0], ends[1]


def _profile_end(
    problem: PredictionError, theta: Array, seen: Evaluation, ceiling: float, function: Function, sign: float
) -> float:
    at, now = theta, seen
    allowed, furthest_beyond = ceiling - seen.cost, -np.inf
    for _ in range(PROFILE_ITERATIONS):
        value, gradient = function(at)
        centre = solve_normal(now.normal, now.gradient)
        along = solve_normal(now.normal, gradient)
        left = ceiling - (now.cost - float(now.gradient @ centre))
        reach = np.sqrt(max(left, 0.0) / max(float(gradient @ along), 1e-300))
        step = -centre + sign * reach * along
        longest = abs(float(step[0]))
        if longest > 0.5:  # of ln alpha: the quadratic is not reliable further away
            step = step * (0.5 / longest)
        following = np.clip(at + step, problem.lower, problem.upper)
        seen_there = problem.evaluate(following)
        if not np.isfinite(seen_there.cost):
            return sign * np.inf
        moved = abs(function(following)[0] - value)
        at, now = following, seen_there
        if now.cost > ceiling:
            furthest_beyond = max(furthest_beyond, sign * function(at)[0])
        if moved <= 1e-6 * abs(value) or (
            moved <= 1e-3 * abs(function(at)[0] - function(theta)[0]) and abs(now.cost - ceiling) < 0.01 * allowed
        ):
            return function(at)[0]
    return sign * (furthest_beyond if furthest_beyond >= sign * function(at)[0] else np.inf)
