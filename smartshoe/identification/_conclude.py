"""Turns a fit into an `Identification`: parameters with intervals, nuisance parameters with error bars, refusals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._estimator import ParameterFit
from smartshoe.identification._experiment import masked
from smartshoe.identification._identification import Identification
from smartshoe.identification._parametrisation import GreyBox
from smartshoe.identification._prediction_error import LARGEST_DELAY_S
from smartshoe.identification._uncertainty import CURVED, Function, profile_interval, t_quantile
from smartshoe.models import X_OVER_NRT, Parameter
from smartshoe.recording import sample_rate_of
from smartshoe.signals.loading import rate_range
from smartshoe.units import Unit

WORST_RELATIVE_SD = 1.0  # of the pole; beyond it the interval includes every relaxation time
WORST_RELATIVE_GAIN_SD = 0.2
NAMES = ("a1", "b0", "b1", "k1", "k2", "c")


@dataclass(frozen=True)
class Choice:
    """The caller's options that the result reports. ``newtons`` is N per reading unit, None where it is estimated."""

    unit: str
    method: str
    structure: str
    reading_unit: Unit
    newtons: float | None
    load_zero_free: bool
    sources: tuple[str, ...]


def conclude(fit: ParameterFit, choice: Choice, where: str) -> Identification:
    """The `Identification` of a fit, with covariances by the delta method or intervals by likelihood profile."""
    problem, theta = fit.problem, fit.theta
    settings, experiments = problem.settings, problem.experiments
    if fit.degrees < 1:
        raise NotIdentifiableError(f"{where}: {problem.count} samples for {problem.size} unknowns: record more")
    notes = list(fit.notes)
    quantile = t_quantile(fit.degrees)
    values, slope, scale = _parameters(fit, choice)
    if not np.isfinite(values).all() or values[0] <= 0:
        raise NotIdentifiableError(
            f"{where}: the fit ends at a1 = {values[0]:.3g}, which is no stable model: check the load's sign and which"
            " column is the reading"
        )
    covariance = slope @ fit.covariance @ slope.T
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    spread = _spread_of_output(fit)
    cost = fit.cost if fit.estimator == "output_error" else _plain_cost(fit)
    _require_determined(where, fit, values, sd, cost / spread if spread > 0 else 0.0)
    intervals = np.stack([values - quantile * sd, values + quantile * sd], axis=1)
    if sd[0] > CURVED * values[0] and fit.evaluation is not None:
        for place in np.flatnonzero(sd > 0):
            function = _function(fit, choice, int(place))
            intervals[place] = profile_interval(problem, theta, fit.evaluation, fit.variance, quantile, function)
        if np.isinf(intervals[0]).all():
            raise _open_relaxation(where, values[0])
        notes.append("the pole is poorly determined: its intervals are those of the likelihood profile")
    unit_text = f"N/{choice.reading_unit.symbol}"
    units = ("1/s", unit_text, f"N/({choice.reading_unit.symbol} s)", "1", "1", "s")
    parameters = {
        name: Parameter(float(value), float(d), (float(low), float(high)), text)
        for name, value, d, (low, high), text in zip(NAMES, values, sd, intervals, units, strict=True)
    }
    output_unit = "N" if settings.direction == "inverse" else choice.reading_unit.symbol
    offsets, load_offsets = _offsets(fit, choice, float(values[2] / values[0]), slope, quantile)
    states = {}
    for index, experiment in enumerate(experiments):
        at = None if problem.state_at is None else problem.state_at + index
        spread_of_state = 0.0 if at is None else np.sqrt(max(fit.covariance[at, at], 0.0))
        states[experiment.name] = Parameter.from_sd(problem.state(theta, index), spread_of_state, output_unit, quantile)
    delay_s, delay_sd = problem.delay_s(theta), 0.0
    if problem.delay_at is not None:
        delay_sd = float(np.sqrt(max(fit.covariance[problem.delay_at, problem.delay_at], 0.0)))
        if abs(delay_s) > 0.98 * LARGEST_DELAY_S:
            notes.append(f"the delay ran to its limit of {LARGEST_DELAY_S:g} s: check that the logs start together")
    if values[2] * scale < 0:
        notes.append(
            "the reading falls as the load rises: a1, b0 and b1 hold as they are, k1 and k2 are springs only where the"
            " reading or the load is turned"
        )
    if values[4] * values[2] * scale < 0:  # spring and gain are both negative for a reading that falls with the load
        which = "negative" if values[4] < 0 else "positive beside a negative gain"
        notes.append(f"k2 is {which}: the reading leads the load, which no standard linear solid does")
    used = [experiment for experiment in experiments if experiment.mask.any()]
    loads = [masked(experiment.load_n, experiment.mask) for experiment in used]
    return Identification(
        unit=choice.unit,
        direction=settings.direction,
        method=choice.method,
        structure=choice.structure,
        estimator=fit.estimator,
        parameters=parameters,
        covariance=covariance,
        offsets=offsets,
        load_offsets=load_offsets,
        delay_s=Parameter.from_sd(delay_s, delay_sd, "s", quantile),
        initial_states=states,
        noise={
            "load": Parameter.from_sd(fit.noise["load"], 0.0, "N"),
            "reading": Parameter.from_sd(fit.noise["reading"], 0.0, choice.reading_unit.symbol),
        },
        fit_percent=100.0 * (1.0 - float(np.sqrt(cost / spread))) if spread > 0 else float("nan"),
        rmse=float(np.sqrt(cost / problem.count)),
        rmse_unit=output_unit,
        iterations=fit.iterations,
        converged=fit.converged,
        sample_rate_hz=float(f"{sample_rate_of(experiments[0].time_s):.6g}"),
        reading_unit=choice.reading_unit,
        scale=scale,
        n_samples=problem.count,
        n_missing=sum(experiment.n_missing for experiment in experiments),
        load_range_n=(min(float(load.min()) for load in loads), max(float(load.max()) for load in loads)),
        rate_range_n_per_s=rate_range((one.time_s, one.load_n) for one in experiments),
        sources=choice.sources,
        remarks=tuple(note for note in notes if note),
        fit=fit,
    )


def _parameters(fit: ParameterFit, choice: Choice, theta: Array | None = None) -> tuple[Array, Array, float]:
    """(a1, b0, b1, k1, k2, c), their derivative (6, size) over theta, and the scale."""
    problem = fit.problem
    theta = fit.theta if theta is None else theta
    coefficients, to_coefficients = problem.coefficients(theta)
    form = problem.form
    if isinstance(form, GreyBox):
        solid, to_solid = form.solid(theta[: problem.shape_size])
        scale = form.scale
    else:
        solid, by_coefficients, scale = solid_of(coefficients, choice.newtons)
        to_solid = by_coefficients @ to_coefficients
    slope = np.zeros((6, problem.size))
    slope[:3, : problem.shape_size], slope[3:, : problem.shape_size] = to_coefficients, to_solid
    return np.concatenate([coefficients, solid]), slope, scale


def _function(fit: ParameterFit, choice: Choice, index: int) -> Function:
    def parameter(theta: Array) -> tuple[float, Array]:
        values, slope, _ = _parameters(fit, choice, theta)
        return float(values[index]), slope[index]

    return parameter


def solid_of(coefficients: Array, newtons: float | None) -> tuple[Array, Array, float]:
    """(k1, k2, c), their Jacobian (3, 3) over (a1, b0, b1), and the scale.

    Where ``newtons`` (N per reading unit) is None, c is 1 and the scale is free.
    """
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
    if newtons is None:
        return np.array([k1, k2, 1.0]), np.stack([k1_slope, k2_slope, np.zeros(3)]), scale
    return np.array([k1, k2, k2 / a1]), np.stack([k1_slope, k2_slope, c_slope]), scale


def _offsets(
    fit: ParameterFit, choice: Choice, static: float, slope: Array, quantile: float
) -> tuple[dict[str, Parameter], dict[str, Parameter]]:
    """For each recording, the reading at no load and the load cell's zero.

    The single free constant represents both. In the inverse direction it is the load's zero, and minus the static gain
    times the reading's; in the forward direction it is the reading's, and minus the load's over the static gain.
    """
    problem, settings = fit.problem, fit.problem.settings
    inverse = settings.direction == "inverse"
    reading_fixed = Parameter.from_sd(settings.offset or 0.0, 0.0, choice.reading_unit.symbol)
    load_fixed = Parameter.from_sd(settings.load_offset_n, 0.0, "N")
    # The static gain b1/a1 as a function of theta, to convert the constant through it.
    a1 = float(problem.coefficients(fit.theta)[0][0])
    gain_slope = (slope[2] - static * slope[0]) / a1
    readings, loads = {}, {}
    for index, experiment in enumerate(problem.experiments):
        readings[experiment.name], loads[experiment.name] = reading_fixed, load_fixed
        if problem.offset_at is None:
            continue
        own = np.zeros(problem.size)
        own[problem.offset_at + index] = 1.0
        constant = problem.constant(fit.theta, index)
        if inverse == choice.load_zero_free:
            value, gradient = constant, own
        elif inverse:
            value, gradient = -constant / static, -own / static + constant / static**2 * gain_slope
        else:
            value, gradient = -constant * static, -own * static - constant * gain_slope
        sd = float(np.sqrt(max(float(gradient @ fit.covariance @ gradient), 0.0)))
        if choice.load_zero_free:
            loads[experiment.name] = Parameter.from_sd(value, sd, "N", quantile)
        else:
            readings[experiment.name] = Parameter.from_sd(value, sd, choice.reading_unit.symbol, quantile)
    return readings, loads


def _spread_of_output(fit: ParameterFit) -> float:
    """Sum of squares of the output about its mean, over all counted samples."""
    outputs = [masked(y, mask) for y, mask in zip(fit.problem.outputs, fit.problem.masks, strict=True)]
    count = sum(output.size for output in outputs)
    mean = sum(float(output.sum()) for output in outputs) / count
    deviations = [output - mean for output in outputs]
    return sum(float(np.dot(one, one)) for one in deviations)


def _plain_cost(fit: ParameterFit) -> float:
    errors = [fit.problem.model_error(fit.theta, index)[mask] for index, mask in enumerate(fit.problem.masks)]
    return sum(float(error @ error) for error in errors)


def _require_determined(where: str, fit: ParameterFit, values: Array, sd: Array, left: float) -> None:
    """Raise `NotIdentifiableError` where gain or pole are as uncertain as they are large, or the fit explains nothing.

    ``left``: the model's squared error over the output's variance; from 1 on the fit is no better than a constant.
    """
    gain_sd = float(np.sqrt(max(fit.covariance[fit.problem.shape_size - 1, fit.problem.shape_size - 1], 0.0)))
    loose = gain_sd > WORST_RELATIVE_GAIN_SD * abs(fit.theta[fit.problem.shape_size - 1])
    if values[2] == 0.0 or left >= 1.0 or (left > 0.5 and (fit.degenerate or loose)):
        raise NotIdentifiableError(
            f"{where}: the reading does not follow the load, so that no gain can be found: record a load that rises and"
            " falls well above the noise"
        )
    if fit.degenerate or not np.isfinite(sd).all() or sd[0] > WORST_RELATIVE_SD * values[0]:
        raise _open_relaxation(where, values[0])


def _open_relaxation(where: str, a1: float) -> NotIdentifiableError:
    return NotIdentifiableError(
        f"{where}: the relaxation (a1 = {a1:.3g} 1/s) cannot be determined from these data:"
        " record more triangles, at several rates, with rests between"
    )
