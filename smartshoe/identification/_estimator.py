"""Chooses which noise the fit allows for, and runs the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._experiment import Direction
from smartshoe.identification._instruments import Instruments, Source, solve_instrumental
from smartshoe.identification._noise import MATTERS, input_noise_bias, noise_sds, output_variance
from smartshoe.identification._parametrisation import FreeForm
from smartshoe.identification._prediction_error import EDGE_SAMPLES, PredictionError
from smartshoe.identification._solve import Evaluation, Minimum, Solver, minimise
from smartshoe.identification._srivc import srivc
from smartshoe.identification._start import COARSE_SAMPLES, start, theta_at
from smartshoe.identification._uncertainty import inverse_normal
from smartshoe.recording import Recording

Estimator = Literal["auto", "output_error", "errors_in_variables", "command", "cycles"]
RATIO_ROUNDS = 4  # alternations of fit and variance; the ratio has little influence
MOST_RATIO = 1e8
WEAK = 4.0  # instruments are weak where their standard errors exceed those of the plain fit by this factor


@dataclass(frozen=True)
class Termination:
    """When a fit ends: at a relative change of theta, or after a number of iterations."""

    tolerance: float
    max_iterations: int


@dataclass(frozen=True, eq=False)
class ParameterFit:
    """The solution theta of ``problem`` with its covariance, and how it was found."""

    problem: PredictionError
    theta: Array
    covariance: Array
    variance: float
    degrees: int
    cost: float
    degenerate: bool
    iterations: int
    converged: bool
    estimator: str
    noise: Mapping[str, float]
    evaluation: Evaluation | None
    notes: tuple[str, ...] = ()


def estimate(
    problem: PredictionError,
    recordings: Sequence[Recording],
    method: str,
    estimator: Estimator,
    noise: Mapping[str, float | None],
    *,
    prefilter_rad_s: float,
    tolerance: float,
    max_iterations: int,
) -> ParameterFit:
    """The fit by the requested ``estimator``; for "auto", by the one that the data call for.

    ``noise`` holds the standard deviations of load (N) and reading, None where they are to be estimated.
    """
    limits = Termination(tolerance, max_iterations)
    fit = _output_error(problem, method, prefilter_rad_s, limits)
    if not np.isfinite(fit.theta).all() or not np.isfinite(fit.cost):
        return fit
    known = _noise(problem, noise)
    fit = replace(fit, noise=known)
    input_sd = known[_input_and_output(problem)[0]]
    chosen = estimator
    if estimator in ("auto", "output_error"):
        concern = _concern(fit, input_sd)
        if estimator == "output_error" or not concern or method == "srivc":
            return replace(fit, notes=(*fit.notes, f"{concern}: choose another estimator")) if concern else fit
        chosen = "command" if _has_command(problem) else "errors_in_variables"
        fit = replace(fit, notes=(*fit.notes, f"{concern}: {_WHY[chosen]}"))
    fit = _with_better_start(fit, prefilter_rad_s)
    if chosen in ("command", "cycles"):
        if estimator != "auto":
            return _instrumental(fit, chosen, recordings, limits)
        instrumental = _instrumental_if_strong(fit, chosen, recordings, limits)
        if instrumental is not None:
            return instrumental
        fit = replace(fit, notes=(*fit.notes[:-1], f"{concern}: {_WHY['errors_in_variables']}"))
    return _errors_in_variables(fit, method, noise, limits)


_WHY = {
    "command": "so the commanded load was taken for the instruments",
    "errors_in_variables": "so the noise of both signals was allowed for (errors in variables)",
}


def _noise(problem: PredictionError, noise: Mapping[str, float | None]) -> dict[str, float]:
    load, reading = noise_sds(problem.experiments)
    known = {"load": noise["load"], "reading": noise["reading"]}
    return {"load": load, "reading": reading} | {name: sd for name, sd in known.items() if sd is not None}


def _output_error(problem: PredictionError, method: str, prefilter_rad_s: float, limits: Termination) -> ParameterFit:
    theta = start(problem, prefilter_rad_s)
    solver = "gn" if method == "srivc" else method
    if method != "srivc" or problem.delay_at is not None:
        found = _minimise(problem, theta, solver, limits)
        iterations, converged = found.iterations, found.converged
        # A delay of many samples reaches beyond the edges left out initially.
        shortest_s = min(experiment.sample_time_s for experiment in problem.experiments)
        edge = int(np.ceil(abs(problem.delay_s(found.theta)) / shortest_s)) + EDGE_SAMPLES
        if problem.delay_at is not None and edge > EDGE_SAMPLES + 1:
            problem.drop_edges(edge)
            found = _minimise(problem, found.theta, solver, limits)
            iterations, converged = iterations + found.iterations, found.converged
        theta, seen = found.theta, found.evaluation
    if method == "srivc":
        # SRIVC does not estimate a delay: it is found by prediction error, then SRIVC runs on the aligned signals.
        delay_s = problem.delay_s(theta)
        alpha, p1, p2, _, iterations, converged = srivc(
            problem,
            prefilter_rad_s=prefilter_rad_s,
            tolerance=limits.tolerance,
            max_iterations=limits.max_iterations,
            delay_s=delay_s,
        )
        theta = theta_at(problem, alpha, p1, p2, delay_s, exact=True)
        seen = problem.evaluate(theta)
    return _settle(problem, theta, seen, iterations, converged, "output_error")


def _minimise(problem: PredictionError, theta: Array, method: str, limits: Termination) -> Minimum:
    return minimise(
        problem, theta, cast(Solver, method), tolerance=limits.tolerance, max_iterations=limits.max_iterations
    )


def _settle(
    problem: PredictionError, theta: Array, seen: Evaluation, iterations: int, converged: bool, estimator: str
) -> ParameterFit:
    degrees = problem.count - problem.size
    inverse, degenerate = inverse_normal(seen.normal)
    variance = seen.cost / max(degrees, 1)
    return ParameterFit(
        problem, theta, variance * inverse, variance, degrees, seen.cost, degenerate, iterations, converged,
        estimator, {}, seen,
    )  # fmt: skip


def _concern(fit: ParameterFit, input_sd: float) -> str:
    """How the input's noise affects the fit, as one clause; '' where it does not matter."""
    if input_sd == 0.0 or fit.degrees < 1 or fit.degenerate or fit.evaluation is None:
        return ""
    problem = fit.problem
    bias = input_noise_bias(problem, fit.theta, fit.evaluation.normal, input_sd)
    values, slope = problem.coefficients(fit.theta)
    shape = slice(0, problem.shape_size)
    moved = slope @ bias[shape]
    sd = np.sqrt(np.maximum(np.diag(slope @ fit.covariance[shape, shape] @ slope.T), 1e-300))
    if np.max(np.abs(moved) / sd) < MATTERS:
        return ""
    return (
        f"the {_input_and_output(problem)[0]} is noisy as well (about {input_sd:.3g}), which would move a1 by"
        f" {100 * moved[0] / values[0]:.2g} % of itself in a fit that takes it for exact"
    )


def _has_command(problem: PredictionError) -> bool:
    for experiment in problem.experiments:
        command_n = experiment.command_n
        if command_n is None or not np.isfinite(command_n).all() or np.ptp(command_n) == 0.0:
            return False
        if np.corrcoef(command_n, experiment.load_n)[0, 1] < 0.9:
            return False
    return True


def _with_better_start(fit: ParameterFit, prefilter_rad_s: float) -> ParameterFit:
    """The plain ``fit``, or that of the other direction where it is likelier with noise on both signals.

    A fit that takes a noisy input as exact smooths it: its optimum is a delay of tenths of a second with a matching
    pole, from which maximum likelihood does not recover. In the other direction that noise is on the output.
    """
    problem = fit.problem
    direction: Direction = "forward" if problem.settings.direction == "inverse" else "inverse"
    turned = PredictionError(problem.experiments, replace(problem.settings, direction=direction), None, problem.masks)
    try:
        found = minimise(turned, start(turned, prefilter_rad_s), "trf", tolerance=1e-6, max_iterations=100).theta
    except NotIdentifiableError:
        return fit
    ln_alpha, p1, p2 = FreeForm(problem.settings.direction).from_coefficients(*turned.coefficients(found)[0])
    if not np.isfinite([ln_alpha, p1, p2]).all():
        return fit
    theta = theta_at(problem, float(np.exp(ln_alpha)), float(p1), float(p2), turned.delay_s(found), exact=True)
    input_sd, output_sd = (fit.noise[signal] for signal in _input_and_output(problem))
    noisy = problem.with_noise_ratio(_noise_ratio(input_sd, output_sd**2))
    if not noisy.evaluate(theta).cost < noisy.evaluate(fit.theta).cost:
        return fit
    better = _settle(problem, theta, problem.evaluate(theta), fit.iterations, fit.converged, fit.estimator)
    return replace(better, noise=fit.noise, notes=fit.notes)


def _errors_in_variables(
    fit: ParameterFit, method: str, noise: Mapping[str, float | None], limits: Termination
) -> ParameterFit:
    problem = fit.problem
    input_, output_ = _input_and_output(problem)
    input_sd, output_sd = fit.noise[input_], noise[output_]
    theta, iterations, converged = fit.theta.copy(), 0, fit.converged
    # Means of neighbours first: they have less noise, above all in the gradient with respect to the delay.
    for level in [problem.coarse(COARSE_SAMPLES), problem]:
        factor = problem.count / max(level.count, 1)
        for _ in range(1 if output_sd else RATIO_ROUNDS):
            # Error that the input's noise does not explain is counted as the output's, model errors included:
            # counting it as input noise would overcorrect.
            variance = factor * _mean_square(level, theta)
            output = output_sd**2 if output_sd else output_variance(problem, theta, variance, input_sd)
            level, before = level.with_noise_ratio(_noise_ratio(input_sd, output)), theta
            found = _minimise(level, theta, method, limits)
            iterations, converged = iterations + found.iterations, found.converged
            moved = float(np.max(np.abs(found.theta - before) / (np.sqrt(np.diag(fit.covariance)) + 1e-300)))
            theta = found.theta
            if moved < 1e-3:
                break
    problem = level
    settled = _settle(problem, theta, found.evaluation, fit.iterations + iterations, converged, "errors_in_variables")
    # Noise in the gradient adds to the spread of the estimate, but not to the curvature.
    jacobian = problem.jacobian(theta)
    inverse_of_signal = settled.covariance / settled.variance
    covariance = settled.variance * inverse_of_signal @ (jacobian.T @ jacobian) @ inverse_of_signal
    return replace(settled, covariance=covariance, noise=fit.noise, notes=fit.notes)


def _input_and_output(problem: PredictionError) -> tuple[str, str]:
    """The keys of the input and the output in ``noise``."""
    return ("reading", "load") if problem.settings.direction == "inverse" else ("load", "reading")


def _noise_ratio(input_sd: float, output_variance: float) -> float:
    return min(input_sd**2 / output_variance, MOST_RATIO) if output_variance > 0 else MOST_RATIO


def _is_weak(instrumental: ParameterFit, fit: ParameterFit) -> bool:
    """Whether the instruments leave the response several times less certain than the plain fit does."""
    shape = fit.problem.shape_size
    return bool(np.any(np.diag(instrumental.covariance)[:shape] > WEAK**2 * np.diag(fit.covariance)[:shape]))


def _mean_square(problem: PredictionError, theta: Array) -> float:
    errors = [problem.model_error(theta, index)[mask] for index, mask in enumerate(problem.masks)]
    return sum(float(error @ error) for error in errors) / max(problem.count - problem.size, 1)


def _instrumental_if_strong(
    fit: ParameterFit, source: Source, recordings: Sequence[Recording], limits: Termination
) -> ParameterFit | None:
    """The fit by instruments; None where they are too weak, as when the delay is fixed far from the true one."""
    try:
        found = _instrumental(fit, source, recordings, limits)
    except NotIdentifiableError:
        return None
    return found if found.converged and not _is_weak(found, fit) else None


def _instrumental(
    fit: ParameterFit, source: Source, recordings: Sequence[Recording], limits: Termination
) -> ParameterFit:
    readings = None
    if source == "cycles":
        from smartshoe.identification._cycles import averaged_reading

        readings = [np.asarray(values, dtype=float) for values in averaged_reading(recordings)]
    instruments = Instruments(fit.problem, source, readings)
    theta, covariance, variance, iterations, converged = solve_instrumental(
        instruments,
        fit.theta,
        np.sqrt(np.diag(fit.covariance)),
        tolerance=limits.tolerance,
        max_iterations=limits.max_iterations,
    )
    problem = fit.problem.with_noise_ratio(0.0)
    problem.masks = instruments.usable
    return replace(
        fit,
        problem=problem,
        theta=theta,
        covariance=covariance,
        variance=variance,
        cost=variance * fit.degrees,
        iterations=fit.iterations + iterations,
        converged=converged,
        estimator=source,
        evaluation=None,
    )
