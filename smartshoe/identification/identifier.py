"""`identify`: one unit's model from one or more experiments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np

from smartshoe.blas import on_one_thread
from smartshoe.errors import InputError, NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification.experiment import Array, Direction, Experiment, prepare
from smartshoe.identification.identification import Identification
from smartshoe.identification.prediction_error import (
    EDGE_SAMPLES,
    LARGEST_DELAY_S,
    PredictionError,
    Settings,
    Structure,
)
from smartshoe.identification.residual_tests import input_independence, whiteness
from smartshoe.identification.solve import Solver, linear_start, solve
from smartshoe.identification.srivc import coarse_delay, srivc
from smartshoe.models import X_OVER_NRT, Parameter
from smartshoe.recording import Recording
from smartshoe.units import Unit

Method = Literal["srivc", "gn", "lm", "trf"]
WORST_RELATIVE_SD = 1.0  # of the pole; beyond it the interval holds every relaxation time
WORST_RELATIVE_GAIN_SD = 0.2
FALLBACK_POLES_RAD_S = (0.01, 0.1, 1.0, 10.0, 100.0)
PERSISTENT_CONDITION = 1e-13


@on_one_thread
def identify(
    recordings: Recording | Sequence[Recording],
    *,
    direction: Direction = "inverse",
    method: Method = "trf",
    structure: Structure = "free",
    offset: float | Literal["estimate"] = "estimate",
    delay: float | Literal["estimate"] = "estimate",
    initial_state: Literal["estimate", "steady"] = "estimate",
    prefilter_rad_s: float = 1.0,
    scale: float | Literal["estimate"] | None = None,
    tolerance: float = 1e-9,
    max_iterations: int = 500,
    strict: bool = True,
) -> Identification:
    """Identify force / reading = (b0 s + b1)/(s + a1) of one unit (Chinimilli 2016, Section V).

    ``direction`` says which signal's error is minimised: "inverse" the load's, as in the paper, "forward" the
    reading's; the parameters are those of equation (13) either way. ``method``: "srivc" alone, or from it "gn",
    "lm", "trf", which share one residual and gradient. ``structure``: "free" fits a1, b0, b1; "grey_box" k1 and k2
    with c = 1. ``offset`` (reading at no load, in the reading's unit, one a recording), ``delay`` (s, reading later
    than load is positive) and ``initial_state`` are estimated, or fixed. ``prefilter_rad_s`` is SRIVC's first
    lambda. ``scale`` is N per reading unit of the paper's force: by default the recordings' ``effective_area_m2``,
    else 1; "estimate" fits it (grey box only). ``tolerance`` is the relative change that ends the iteration.

    Raises `NotIdentifiableError` where the data cannot hold the answer, `NotConvergedError` where the iteration did
    not settle (unless ``strict`` is False), `InputError` and `UsageError` for wrong input.
    """
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    _check_choices(direction, method, structure, initial_state, prefilter_rad_s, tolerance, max_iterations)
    experiments, reading_unit = prepare(several)
    unit = _unit_name(several)
    newtons, scale_note = _scale(several, reading_unit, scale, structure)
    # Three numbers fitted in the grey box are the free form's three, read back with c = 1.
    free_scale = newtons is None
    settings = Settings(
        direction=direction,
        structure="free" if free_scale else structure,
        offset=_fixed("offset", offset),
        delay_s=_fixed("delay", delay),
        steady=initial_state == "steady",
        stiffness=(newtons or 1.0) * X_OVER_NRT,
    )
    if settings.delay_s is not None and abs(settings.delay_s) > LARGEST_DELAY_S:
        raise UsageError(f"delay is {settings.delay_s:g} s: give one within {LARGEST_DELAY_S:g} s")
    problem = PredictionError(experiments, settings)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        theta, iterations, converged = _fit(
            problem, method, prefilter_rad_s=prefilter_rad_s, tolerance=tolerance, max_iterations=max_iterations
        )
        if not np.isfinite(theta).all() or not np.isfinite(problem.residual(theta)).all():
            raise NotIdentifiableError(
                f"{several[0].label}: the fit runs to infinity: record a load that rises and falls at several rates"
            )
    # What the data leave open is the better reason, where a fit did not settle for it.
    found = _conclude(
        problem,
        theta,
        several,
        unit=unit,
        method=method,
        structure=structure,
        reading_unit=reading_unit,
        newtons=newtons,
        notes=[scale_note],
        iterations=iterations,
        converged=converged,
    )
    if strict and not converged:
        raise NotConvergedError(
            f"{several[0].label}: {method} did not settle within {max_iterations} iterations: raise max_iterations,"
            " or choose another method or prefilter_rad_s"
        )
    return found


def _check_choices(
    direction: str, method: str, structure: str, initial_state: str, prefilter: float, tolerance: float, most: int
) -> None:
    for name, value, known in (
        ("direction", direction, get_args(Direction)),
        ("method", method, get_args(Method)),
        ("structure", structure, get_args(Structure)),
        ("initial_state", initial_state, ("estimate", "steady")),
    ):
        if value not in known:
            raise UsageError(f"{name} {value!r} is not known: use one of {', '.join(known)}")
    for name, number in (("prefilter_rad_s", prefilter), ("tolerance", tolerance), ("max_iterations", most)):
        if not (np.isfinite(number) and number > 0):
            raise UsageError(f"{name} is {number:g}: give a positive number")


def _fixed(name: str, value: float | str) -> float | None:
    """None where ``value`` is "estimate", else the number."""
    if value == "estimate":
        return None
    if isinstance(value, str) or not np.isfinite(value):
        raise UsageError(f"{name} is {value!r}: give a finite number or 'estimate'")
    return float(value)


def _unit_name(recordings: Sequence[Recording]) -> str:
    names = {recording.unit for recording in recordings if recording.unit}
    names = names or {recording.sensor.name for recording in recordings}
    if len(names) > 1:
        raise UsageError(f"recordings of different units ({', '.join(sorted(names))}): identify one unit at a time")
    return names.pop()


def _scale(
    recordings: Sequence[Recording], reading_unit: Unit, scale: float | str | None, structure: str
) -> tuple[float | None, str]:
    """N per reading unit of the paper's force (None to estimate it), and where it came from in one sentence."""
    if isinstance(scale, str):
        if scale != "estimate" or structure != "grey_box":
            raise UsageError(f"scale is {scale!r}: give a number, or 'estimate' with structure 'grey_box'")
        return None, "scale was estimated, with c = 1"
    if scale is not None:
        if not (np.isfinite(scale) and scale != 0):
            raise UsageError(f"scale is {scale:g}: give a finite number other than 0")
        return float(scale), "scale was given by the caller"
    areas = {recording.metadata.get("effective_area_m2") for recording in recordings}
    text = areas.pop() if len(areas) == 1 else None
    if text is None or reading_unit.quantity != "pressure":
        return 1.0, "scale is 1: the reading is taken in the paper's force units"
    try:
        area_m2 = float(text)
    except ValueError:
        area_m2 = np.nan
    if not (np.isfinite(area_m2) and area_m2 > 0):
        raise InputError(f"{recordings[0].label}: effective_area_m2 is {text!r}: give a positive number in m2")
    return area_m2 * reading_unit.scale, f"scale follows from effective_area_m2 = {area_m2:g}"


def _fit(
    problem: PredictionError, method: Method, *, prefilter_rad_s: float, tolerance: float, max_iterations: int
) -> tuple[Array, int, bool]:
    """theta, iterations of the method asked for, and whether it settled."""
    settings = problem.settings

    def start(delay_s: float) -> tuple[Array, int, bool]:
        alpha, p1, p2, iterations, settled = srivc(
            problem.experiments,
            settings,
            prefilter_rad_s=prefilter_rad_s,
            tolerance=max(tolerance, 1e-6) if method != "srivc" else tolerance,
            max_iterations=max_iterations if method == "srivc" else 10,
            delay_s=delay_s,
        )
        starts = [linear_start(problem, alpha, p1, p2, delay_s)]
        if not settled and method != "srivc":
            # Data far from the model can send SRIVC astray: the best of a few poles is a safer start.
            starts += [linear_start(problem, pole, p1, p2, delay_s) for pole in FALLBACK_POLES_RAD_S]
        best = min(starts, key=lambda theta: float(np.sum(problem.residual(theta) ** 2)))
        return best, iterations, settled

    def refine(theta: Array, solver: Solver) -> tuple[Array, int, bool]:
        return solve(problem, theta, solver, tolerance=tolerance, max_iterations=max_iterations)

    nearby_s = coarse_delay(problem.experiments, settings, prefilter_rad_s) if problem.delay_at is not None else 0.0
    theta, iterations, converged = start(nearby_s if settings.delay_s is None else settings.delay_s)
    if method != "srivc":
        theta, iterations, converged = refine(theta, method)
    if problem.delay_at is not None:
        # SRIVC has no delay of its own: it is found by prediction error, then SRIVC runs on the aligned signals.
        aligned = refine(theta, "gn")[0] if method == "srivc" else theta
        # A delay of many samples reaches beyond the edges that were left out at first.
        shortest_s = min(experiment.sample_time_s for experiment in problem.experiments)
        edge = int(np.ceil(abs(problem.delay_s(aligned)[0]) / shortest_s)) + 2
        if edge > EDGE_SAMPLES:
            problem.drop_edges(edge)
            aligned, more, converged = refine(aligned, "gn" if method == "srivc" else method)
            iterations += more
        theta = aligned
        if method == "srivc":
            theta, iterations, converged = start(problem.delay_s(aligned)[0])
    return theta, iterations, converged


def _conclude(
    problem: PredictionError,
    theta: Array,
    recordings: Sequence[Recording],
    *,
    unit: str,
    method: Method,
    structure: str,
    reading_unit: Unit,
    newtons: float | None,
    notes: list[str],
    iterations: int,
    converged: bool,
) -> Identification:
    """Parameters with covariance (delta method), fit and residual tests at ``theta``."""
    settings, experiments = problem.settings, problem.experiments
    residual, jacobian = problem.residual(theta), problem.jacobian(theta)
    where = recordings[0].label
    degrees = residual.size - problem.size
    if degrees < 1:
        raise NotIdentifiableError(f"{where}: {residual.size} samples for {problem.size} unknowns: record more")
    theta_covariance, degenerate = _covariance(jacobian, float(residual @ residual) / degrees)
    quantile = _t_quantile(degrees)
    coefficients, to_coefficients = problem.coefficients(theta)
    solid, to_solid, scale = _solid(coefficients, newtons)
    shape = slice(0, problem.shape_size)
    to_all = np.vstack([to_coefficients, to_solid @ to_coefficients])
    values = np.concatenate([coefficients, solid])
    fixed_c = structure == "grey_box"
    if fixed_c:
        values[5], to_all[5] = 1.0, 0.0
    covariance = to_all @ theta_covariance[shape, shape] @ to_all.T
    if not np.isfinite(values).all() or coefficients[0] <= 0:
        raise NotIdentifiableError(
            f"{where}: the fit ends at a1 = {coefficients[0]:.3g}, which is no stable model: check the load's sign and"
            " which column is the reading"
        )
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    static_gain = coefficients[2] / coefficients[0]
    _require_determined(where, problem, theta, theta_covariance, degenerate, static_gain)
    unit_text = f"N/{reading_unit.symbol}"
    units = ("1/s", unit_text, f"N/({reading_unit.symbol} s)", "1", "1", "s")
    parameters = {
        name: Parameter.from_sd(value, deviation, text, quantile)
        for name, value, deviation, text in zip(("a1", "b0", "b1", "k1", "k2", "c"), values, sd, units, strict=True)
    }
    names = [experiment.name for experiment in experiments]

    output_unit = "N" if settings.direction == "inverse" else reading_unit.symbol
    offsets, states = {}, {}
    for index, name in enumerate(names):
        zero, slope = problem.offset(theta, index)
        spread = np.sqrt(max(float(slope @ theta_covariance @ slope), 0.0))
        offsets[name] = Parameter.from_sd(zero, spread, reading_unit.symbol, quantile)
        at = None if problem.state_at is None else problem.state_at + index
        states[name] = (
            Parameter.from_sd(0.0, 0.0, output_unit)
            if at is None
            else Parameter.from_sd(theta[at], np.sqrt(max(theta_covariance[at, at], 0.0)), output_unit, quantile)
        )
    delay_s, delay_slope = problem.delay_s(theta)
    delay_sd = 0.0
    if problem.delay_at is not None:
        delay_sd = abs(delay_slope) * float(np.sqrt(max(theta_covariance[problem.delay_at, problem.delay_at], 0.0)))
        if abs(delay_s) > 0.98 * LARGEST_DELAY_S:
            notes.append(f"the delay ran to its limit of {LARGEST_DELAY_S:g} s: check that the logs start together")
    if values[4] < 0:
        notes.append("k2 is negative: the reading leads the load, which no standard linear solid does")
    errors = [problem.model_error(theta, index) for index in range(len(experiments))]
    outputs = [experiment.signals(settings.direction)[1] for experiment in experiments]
    inputs = [experiment.signals(settings.direction)[0] for experiment in experiments]
    kept = problem.kept
    tests = {
        "whiteness": whiteness(errors, kept),
        "input_independence": input_independence(inputs, errors, kept, jacobian),
    }
    if tests["whiteness"].p_value < 0.01:
        notes.append("the residual is not white: the error bars hold for white noise only and are too small here")
    loads = [experiment.load_n[experiment.kept] for experiment in experiments if experiment.kept.any()]
    return Identification(
        unit=unit,
        direction=settings.direction,
        method=method,
        structure=structure,
        parameters=parameters,
        covariance=covariance,
        offsets=offsets,
        delay_s=Parameter.from_sd(delay_s, delay_sd, "s", quantile),
        initial_states=states,
        fit_percent=_fit_percent(outputs, errors, kept),
        fit_percent_by_recording={
            name: _fit_percent([y], [error], [mask])
            for name, y, error, mask in zip(names, outputs, errors, kept, strict=True)
        },
        rmse=float(np.sqrt(np.mean(residual**2))),
        rmse_unit=output_unit,
        iterations=iterations,
        converged=converged,
        residual_tests=tests,
        sample_rate_hz=_rounded_rate(experiments),
        reading_unit=reading_unit,
        scale=scale,
        n_samples=int(residual.size),
        n_missing=sum(experiment.n_missing for experiment in experiments),
        load_range_n=(min(float(load.min()) for load in loads), max(float(load.max()) for load in loads)),
        rate_range_n_per_s=_rate_range(experiments),
        residuals={name: np.where(mask, -error, np.nan) for name, error, mask in zip(names, errors, kept, strict=True)},
        sources=tuple(recording.source or recording.name for recording in recordings),
        notes=tuple(note for note in notes if note),
    )


def _covariance(jacobian: Array, variance: float) -> tuple[Array, bool]:
    """variance (J'J)^-1, and whether J'J is singular within rounding."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    degenerate = bool(not scale.all() or not np.isfinite(scale).all())
    scale = np.where(scale > 0, scale, 1.0)
    scaled = jacobian / scale
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    degenerate = degenerate or bool(values[0] < PERSISTENT_CONDITION * values[-1])
    inverse = (vectors / np.maximum(values, PERSISTENT_CONDITION * values[-1])) @ vectors.T
    result: Array = variance * inverse / np.outer(scale, scale)
    return result, degenerate


def _require_determined(
    where: str, problem: PredictionError, theta: Array, covariance: Array, degenerate: bool, static_gain: float
) -> None:
    """Refuse what the data leave open: a gain or a pole whose error bar is as large as itself."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    gain_at = problem.shape_size - 1
    outputs = [
        experiment.signals(problem.settings.direction)[1][kept]
        for experiment, kept in zip(problem.experiments, problem.kept, strict=True)
    ]
    left = float(np.sum(problem.residual(theta) ** 2)) / sum(float(np.sum((y - y.mean()) ** 2)) for y in outputs)
    unexplained = left > 0.5 and (degenerate or sd[gain_at] > WORST_RELATIVE_GAIN_SD * abs(theta[gain_at]))
    if unexplained or static_gain == 0.0:
        raise NotIdentifiableError(
            f"{where}: the reading does not follow the load, so that no gain can be found: record a load that rises and"
            " falls well above the noise"
        )
    if degenerate or sd[0] > WORST_RELATIVE_SD:
        raise NotIdentifiableError(
            f"{where}: the relaxation (a1 = {np.exp(theta[0]):.3g} 1/s) cannot be told from these data:"
            " record more triangles, at several rates, with rests between"
        )


def _solid(coefficients: Array, newtons: float | None) -> tuple[Array, Array, float]:
    """(k1, k2, c), their Jacobian (3, 3) over (a1, b0, b1), and the scale; newtons None: c = 1 and scale free."""
    a1, b0, b1 = (float(value) for value in coefficients)
    static = b1 / a1
    static_slope = np.array([-static / a1, 0.0, 1 / a1])
    difference = b0 - static
    difference_slope = np.array([0.0, 1.0, 0.0]) - static_slope
    if newtons is None:
        scale = difference / (X_OVER_NRT * a1)
        scale_slope = difference_slope / (X_OVER_NRT * a1) - np.array([scale / a1, 0.0, 0.0])
    else:
        scale, scale_slope = newtons, np.zeros(3)
    k1 = (static / scale - 1) / X_OVER_NRT
    k1_slope = (static_slope - static / scale * scale_slope) / (scale * X_OVER_NRT)
    k2 = difference / (scale * X_OVER_NRT)
    k2_slope = (difference_slope - difference / scale * scale_slope) / (scale * X_OVER_NRT)
    c_slope = k2_slope / a1 - np.array([k2 / a1**2, 0.0, 0.0])
    return np.array([k1, k2, k2 / a1]), np.stack([k1_slope, k2_slope, c_slope]), scale


def _t_quantile(degrees: int) -> float:
    from scipy.stats import t

    return float(t.ppf(0.975, degrees))


def _fit_percent(outputs: Sequence[Array], errors: Sequence[Array], kept: Sequence[Any]) -> float:
    """100 (1 - ||y - model||/||y - mean y||), as MATLAB's compare has it."""
    y = np.concatenate([output[mask] for output, mask in zip(outputs, kept, strict=True)])
    error = np.concatenate([value[mask] for value, mask in zip(errors, kept, strict=True)])
    spread = float(np.linalg.norm(y - y.mean())) if y.size else 0.0
    return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0 else float("nan")


def _rounded_rate(experiments: Sequence[Experiment]) -> float:
    """The first recording's rate, free of the rounding in its time stamps."""
    return float(f"{1.0 / experiments[0].sample_time_s:.6g}")


def _rate_range(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """Slowest and fastest loading in N/s: 5th and 95th percentile of rising slopes, over tenths of a second."""
    slopes = []
    for experiment in experiments:
        stride = max(round(0.1 / experiment.sample_time_s), 1)
        rise = np.diff(experiment.load_n[::stride]) / np.diff(experiment.time_s[::stride])
        slopes.append(rise)
    slope = np.concatenate(slopes)
    rising = slope[slope > 0.02 * max(float(np.max(slope, initial=0.0)), 1e-12)]
    if not rising.size:
        return 0.0, 0.0
    low, high = np.percentile(rising, [5, 95])
    return float(low), float(high)
