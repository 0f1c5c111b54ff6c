"""SRIVC: the simplified refined instrumental variable method for continuous time (Chinimilli 2016, Section V)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification.experiment import Array, Experiment
from smartshoe.identification.prediction_error import LARGEST_DELAY_S, Settings
from smartshoe.models.first_order import lag, shifted, steps


def _signals(experiment: Experiment, settings: Settings, delay_s: float) -> tuple[Array, Array]:
    """Input and output with the fixed offset and the delay taken out."""
    u, y = experiment.signals(settings.direction)
    sign = 1.0 if settings.direction == "inverse" else -1.0
    zero = settings.offset or 0.0
    if settings.direction == "inverse":
        u = u - zero
    else:
        y = y - zero
    if delay_s:
        u = shifted(u, experiment.time_s, experiment.step, sign * delay_s)[0]
    return u, y


def srivc(
    experiments: Sequence[Experiment],
    settings: Settings,
    *,
    prefilter_rad_s: float,
    tolerance: float,
    max_iterations: int,
    delay_s: float = 0.0,
) -> tuple[float, float, float, int, bool]:
    """alpha, p1, p2 (see `prediction_error`), iterations and whether they settled to ``tolerance``.

    Least squares on y' = -alpha y + beta0 u' + beta1 u behind the state-variable filter 1/(s + lambda), lambda =
    ``prefilter_rad_s``; then the filter and the instrument (the auxiliary model's output) are renewed. A constant
    and a decaying exponential for each recording stand for its offset and initial state. Missing outputs are filled
    with the auxiliary model's. An unstable pole is reflected into the left half plane.
    """
    pairs = [_signals(experiment, settings, delay_s) for experiment in experiments]
    outputs = [y for _, y in pairs]
    auxiliary: list[Array] = outputs
    longest_s = max(float(experiment.time_s[-1]) for experiment in experiments)
    slowest, pole = 1e-3 / longest_s, prefilter_rad_s
    estimate = np.array([pole, 0.0, 0.0])
    for iteration in range(max_iterations + 1):
        solution = _step(experiments, [u for u, _ in pairs], outputs, auxiliary, settings, pole)
        alpha = max(abs(float(solution[0])), slowest)
        renewed = np.array([alpha, solution[1], solution[2] / alpha])
        change = float(np.max(np.abs(renewed - estimate) / np.maximum(np.abs(renewed), 1e-300)))
        estimate, pole = renewed, alpha
        if iteration and change < tolerance:
            return float(estimate[0]), float(estimate[1]), float(estimate[2]), iteration, True
        auxiliary, outputs = [], []
        for experiment, (u, y) in zip(experiments, pairs, strict=True):
            w = lag(u, alpha, experiment.step)
            model = estimate[1] * (u - w) + estimate[2] * w
            full = model + _nuisance(experiment, settings, alpha, y - model)
            auxiliary.append(full)
            outputs.append(y if experiment.kept.all() else np.where(experiment.kept, y, full))
    return float(estimate[0]), float(estimate[1]), float(estimate[2]), max_iterations, False


def _step(
    experiments: Sequence[Experiment],
    inputs: Sequence[Array],
    outputs: Sequence[Array],
    instruments: Sequence[Array],
    settings: Settings,
    pole: float,
) -> Array:
    """One instrumental-variable solution (alpha, beta0, beta1, nuisances)."""
    count = len(experiments)
    columns = (settings.offset is None) + (not settings.steady)
    size = 3 + columns * count
    normal, right = np.zeros((size, size)), np.zeros(size)
    for index, experiment in enumerate(experiments):
        u, y, x = inputs[index], outputs[index], instruments[index]
        u_slow, y_slow = lag(u, pole, experiment.step), lag(y, pole, experiment.step)
        x_slow = y_slow if x is y else lag(x, pole, experiment.step)
        shared = [u - u_slow, u_slow / pole]
        at = list(range(3))
        if settings.offset is None:
            shared.append(np.ones_like(u))
            at.append(3 + index)
        if not settings.steady:
            shared.append(np.exp(-pole * experiment.time_s))
            at.append(size - count + index)
        kept = slice(None) if experiment.kept.all() else experiment.kept
        rest = np.stack(shared)[:, kept]
        regressors = np.vstack([-y_slow[kept] / pole, rest])
        instrument = np.vstack([-x_slow[kept] / pole, rest])
        normal[np.ix_(at, at)] += instrument @ regressors.T
        right[at] += instrument @ (y - y_slow)[kept]
    scale = np.sqrt(np.abs(np.diag(normal)))
    if not np.isfinite(normal).all() or not scale.all():
        raise NotIdentifiableError(
            "the recordings do not excite the model: record a load that rises and falls at several rates"
        )
    solution: Array = np.linalg.lstsq(normal / np.outer(scale, scale), right / scale, rcond=1e-14)[0] / scale
    return solution


def _nuisance(experiment: Experiment, settings: Settings, alpha: float, rest: Array) -> Array:
    """Offset and initial state of one recording, by least squares on what the model leaves."""
    columns = []
    if settings.offset is None:
        columns.append(np.ones_like(rest))
    if not settings.steady:
        columns.append(np.exp(-alpha * experiment.time_s))
    if not columns:
        return np.zeros_like(rest)
    basis = np.stack(columns, axis=1)
    kept = experiment.kept
    fitted: Array = basis @ np.linalg.lstsq(basis[kept].T @ basis[kept], basis[kept].T @ rest[kept], rcond=None)[0]
    return fitted


def coarse_delay(experiments: Sequence[Experiment], settings: Settings, prefilter_rad_s: float) -> float:
    """The delay in s, on a grid of a tenth of the limit, from which a gradient finds the right one.

    Least squares of the output on the delayed input and its slow part alone: enough to tell tenths of a second.
    """
    most = 4000  # samples a recording: the grid is coarse, and so may the signals be
    costs = []
    grid = np.linspace(-0.9, 0.9, 19) * LARGEST_DELAY_S
    for delay_s in grid:
        cost = 0.0
        for experiment in experiments:
            u, y = experiment.signals(settings.direction)
            stride = max(1, -(-u.size // most))
            at = (1.0 if settings.direction == "inverse" else -1.0) * delay_s
            time_s = experiment.time_s[::stride]
            delayed = np.interp(time_s + at, time_s, u[::stride])
            slow = lag(delayed, prefilter_rad_s, steps(time_s))
            basis = np.stack([delayed, slow, np.ones_like(slow)], axis=1)
            kept = experiment.kept[::stride] & (time_s > LARGEST_DELAY_S) & (time_s < time_s[-1] - LARGEST_DELAY_S)
            if np.count_nonzero(kept) < 10:
                continue
            target, basis = y[::stride][kept], basis[kept]
            fitted = basis @ np.linalg.lstsq(basis.T @ basis, basis.T @ target, rcond=None)[0]
            cost += float(np.sum((target - fitted) ** 2))
        costs.append(cost)
    return float(grid[int(np.argmin(costs))]) if min(costs) < 0.5 * costs[len(costs) // 2] else 0.0
