"""Finds the start of the minimisation: SRIVC on means of neighbouring samples, or a scan of poles if that fails."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._parametrisation import Shape, coefficients_of
from smartshoe.identification._prediction_error import PredictionError
from smartshoe.identification._solve import solve_normal
from smartshoe.identification._srivc import coarse_delay, srivc
from smartshoe.models.first_order import lag

COARSE_SAMPLES = 2000
COARSE_ITERATIONS = 10
START_TOLERANCE = 1e-2  # relative, of a coefficient: near enough for a start
POLES_RAD_S = np.geomspace(0.01, 300.0, 19)
RESOLVED = 0.3  # of pole times coarse step: above it, the pole is searched on all samples


def start(problem: PredictionError, prefilter_rad_s: float) -> Array:
    """A theta from which every method finds the optimum."""
    coarse = problem.coarse(COARSE_SAMPLES)
    delay_s = problem.delay_s(np.zeros(problem.size))
    if problem.delay_at is not None:
        delay_s = coarse_delay(coarse, prefilter_rad_s)
    for where in (coarse, problem) if coarse is not problem else (problem,):
        step_s = max(experiment.sample_time_s for experiment in where.experiments)
        alpha, p1, p2, nuisances, _, settled = srivc(
            where,
            prefilter_rad_s=prefilter_rad_s,
            tolerance=START_TOLERANCE,
            max_iterations=COARSE_ITERATIONS,
            delay_s=delay_s,
        )
        if settled and alpha * step_s < RESOLVED and p1 * p2 > 0:
            theta = _response(problem, alpha, p1, p2, delay_s)
            for place, column in ((problem.offset_at, 0), (problem.state_at, -1)):
                if place is not None:
                    theta[place : place + nuisances.shape[0]] = nuisances[:, column]
            return theta
    # SRIVC can fail on data far from the model: the best of a grid of poles is a safe start.
    scanned = [_linear(coarse, pole, delay_s) for pole in POLES_RAD_S]
    if settled:
        scanned.append(_linear(coarse, alpha, delay_s))
    _, alpha, p1, p2 = min(scanned)
    return theta_at(problem, alpha, p1, p2, delay_s)


def theta_at(
    problem: PredictionError, alpha: float, p1: float, p2: float, delay_s: float, *, exact: bool = False
) -> Array:
    """theta at a given response and delay; linear unknowns by least squares, on all samples (``exact``) or on means."""
    theta = _response(problem, alpha, p1, p2, delay_s)
    linear = [index for index in range(problem.shape_size, problem.size) if index != problem.delay_at]
    if linear and problem.settings.noise_ratio == 0.0:
        seen = (problem if exact else problem.coarse(COARSE_SAMPLES)).evaluate(theta)
        theta[linear] -= solve_normal(seen.normal[np.ix_(linear, linear)], seen.gradient[linear])
    return theta


def _response(problem: PredictionError, alpha: float, p1: float, p2: float, delay_s: float) -> Array:
    """theta at a given response and delay, everything else 0."""
    theta = np.zeros(problem.size)
    values = coefficients_of(Shape(alpha, p1, p2, np.eye(3)), problem.settings.direction)[0]
    theta[: problem.shape_size] = problem.form.from_coefficients(*(float(value) for value in values))
    if problem.delay_at is not None:
        low, high = problem.lower[problem.delay_at], problem.upper[problem.delay_at]
        theta[problem.delay_at] = min(max(delay_s, 0.999 * low), 0.999 * high)
    return theta


def _linear(problem: PredictionError, alpha: float, delay_s: float) -> tuple[float, float, float, float]:
    """Cost and (alpha, p1, p2) at a given pole, with the linear unknowns by least squares."""
    count = len(problem.experiments)
    constant, fading = problem.offset_at is not None, problem.state_at is not None
    size = 2 + (constant + fading) * count
    normal, right, power = np.zeros((size, size)), np.zeros(size), 0.0
    for index, (u, y) in enumerate(zip(problem.inputs_at(delay_s), problem.outputs, strict=True)):
        experiment = problem.experiments[index]
        w = lag(u, alpha, experiment.step)
        rows, at = [u - w, w], [0, 1]
        if constant:
            rows.append(np.ones_like(u))
            at.append(2 + index)
        if fading:
            rows.append(np.exp(-alpha * experiment.time_s))
            at.append(size - count + index)
        basis = np.stack(rows)[:, experiment.mask]
        normal[np.ix_(at, at)] += basis @ basis.T
        right[at] += basis @ y[experiment.mask]
        power += float(y[experiment.mask] @ y[experiment.mask])
    solution = solve_normal(normal, right)
    cost = power - 2 * float(solution @ right) + float(solution @ normal @ solution)
    return (cost if np.isfinite(cost) else np.inf), alpha, float(solution[0]), float(solution[1])
