"""Non-linear least squares on the one residual: Gauss-Newton here, Levenberg-Marquardt and trust region from SciPy."""

from __future__ import annotations

from typing import Literal

import numpy as np

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification.experiment import Array
from smartshoe.identification.prediction_error import LARGEST_DELAY_S, PredictionError

Solver = Literal["gn", "lm", "trf"]


def linear_start(problem: PredictionError, alpha: float, p1: float, p2: float, delay_s: float) -> Array:
    """theta at a given pole and delay, all that enters linearly by least squares (the grey box keeps its gains)."""
    settings = problem.settings
    theta = np.zeros(problem.size)
    if problem.delay_at is not None:
        theta[problem.delay_at] = LARGEST_DELAY_S * np.arcsin(delay_s / LARGEST_DELAY_S)
    linear = [index for index in range(1, problem.size) if index != problem.delay_at]
    if settings.structure == "free":
        theta[0] = np.log(alpha)
    else:
        linear = linear[1:]
        pole, gain = (alpha, p2) if settings.direction == "inverse" else (abs(alpha * p2 / p1), 1 / p2)
        theta[:2] = np.log(pole), gain
    if linear:
        change = _solve_normal(problem.jacobian(theta)[:, linear], problem.residual(theta))
        theta[linear] -= change
    return theta


def _solve_normal(jacobian: Array, residual: Array) -> Array:
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    change: Array = np.linalg.lstsq(scaled.T @ scaled, scaled.T @ residual, rcond=1e-15)[0] / scale
    return change


def gauss_newton(
    problem: PredictionError, theta: Array, *, tolerance: float, max_iterations: int
) -> tuple[Array, int, bool]:
    """Damped Gauss-Newton: the full step, halved until the error no longer grows (Chinimilli 2016, Section V)."""
    cost = float(problem.residual(theta) @ problem.residual(theta))
    for iteration in range(1, max_iterations + 1):
        residual, jacobian = problem.residual(theta), problem.jacobian(theta)
        step = _solve_normal(jacobian, residual)
        # The step in units of each parameter's own standard error does not depend on anybody's choice of units.
        promised = float(np.sum((jacobian @ step) ** 2))
        fraction = 1.0
        for _ in range(40):
            trial = theta - fraction * step
            trial_residual = problem.residual(trial)
            trial_cost = float(trial_residual @ trial_residual)
            if trial_cost <= cost:
                break
            fraction /= 2
        else:
            # No descent is left within rounding: this is the optimum if little was promised.
            return theta, iteration, promised <= 1e-9 * cost + 1e-20 * max(cost, 1.0)
        theta, before, cost = trial, cost, trial_cost
        settled = np.max(np.abs(fraction * step) / (np.abs(theta) + 1e-3 * np.max(np.abs(theta[:3])))) < tolerance
        if settled or before - cost <= 1e-13 * before:
            return theta, iteration, True
    return theta, max_iterations, False


def solve(
    problem: PredictionError, theta: Array, method: Solver, *, tolerance: float, max_iterations: int
) -> tuple[Array, int, bool]:
    """The minimum from ``theta``, the number of iterations, and whether it settled; raises on numerical failure."""
    if method == "gn":
        try:
            return gauss_newton(problem, theta, tolerance=tolerance, max_iterations=max_iterations)
        except np.linalg.LinAlgError as error:
            raise NotIdentifiableError(f"the normal equations have no solution ({error})") from error
    from scipy.optimize import least_squares

    try:
        found = least_squares(
            problem.residual,
            theta,
            problem.jacobian,
            method=method,
            x_scale="jac",
            ftol=1e-13,
            xtol=tolerance,
            gtol=1e-14,
            max_nfev=max_iterations,
        )
    except (np.linalg.LinAlgError, ValueError) as error:
        raise NotIdentifiableError(
            f"the fit has no finite solution ({error}): record a load that rises and falls at several rates"
        ) from error
    return np.asarray(found.x), int(found.njev or found.nfev), found.status > 0
