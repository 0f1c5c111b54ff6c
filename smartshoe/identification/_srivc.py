"""SRIVC: the simplified refined instrumental variable method for continuous time (Chinimilli 2016, Section V).

Young and Jakeman 1980, Int. J. Control 31, 741-764; Garnier and Wang 2008, ch. 4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._prediction_error import EVERY, LARGEST_DELAY_S, PredictionError
from smartshoe.models.first_order import as_kernels_take

COARSE_STEP_S = 0.05  # step of the grid on which the delay is searched first


def srivc(
    problem: PredictionError, *, prefilter_rad_s: float, tolerance: float, max_iterations: int, delay_s: float = 0.0
) -> tuple[float, float, float, Array, int, bool]:
    """alpha, p1, p2 (see `prediction_error`), nuisance parameters, iterations, and whether they reached ``tolerance``.

    The nuisance parameters (recordings, 0 to 2) are offset and initial state, as far as free, in this order.

    It starts with least squares on y' = -alpha y + beta0 u' + beta1 u behind the state-variable filter 1/(s + lambda),
    lambda = ``prefilter_rad_s``; then the filter and the instrument (the auxiliary model's output) are updated
    repeatedly. A constant and a decaying exponential per recording represent its offset and initial state. Missing
    outputs are replaced by the auxiliary model's. An unstable pole is reflected into the left half plane.
    """
    from smartshoe.kernels.first_order import respond

    inputs, measured = problem.inputs_at(delay_s), problem.outputs
    outputs, auxiliary = list(measured), list(measured)
    longest_s = max(float(experiment.time_s[-1]) for experiment in problem.experiments)
    slowest, pole = 1e-3 / longest_s, prefilter_rad_s
    p1 = p2 = 0.0
    for iteration in range(max_iterations + 1):
        solution = _step(problem, inputs, outputs, auxiliary, pole)
        alpha = max(abs(float(solution[0])), slowest)
        before, (pole, p1, p2) = (pole, p1, p2), (alpha, float(solution[1]), float(solution[2]) / alpha)
        change = max(abs(new - old) / max(abs(new), 1e-300) for new, old in zip((pole, p1, p2), before, strict=True))
        if iteration and change < tolerance:
            return pole, p1, p2, solution[3:].reshape(len(inputs), -1), iteration, True
        auxiliary, outputs = [], []
        for index, (u, y) in enumerate(zip(inputs, measured, strict=True)):
            experiment = problem.experiments[index]
            # Offset and initial state are their own instruments: the auxiliary model needs neither.
            model = np.empty(u.size)
            respond(u, *as_kernels_take(experiment.step), 0.0, pole, p1, p2, 0.0, 0.0, model)
            auxiliary.append(model)
            if not experiment.mask.all():
                y = np.where(experiment.mask, y, model + _nuisance(problem, index, alpha, y - model))
            outputs.append(y)
    return pole, p1, p2, solution[3:].reshape(len(inputs), -1), max_iterations, False


def _step(
    problem: PredictionError,
    inputs: Sequence[Array],
    outputs: Sequence[Array],
    instruments: Sequence[Array],
    pole: float,
) -> Array:
    """One instrumental-variable solution (alpha, beta0, beta1, nuisance parameters)."""
    from smartshoe.kernels.first_order import COLUMNS
    from smartshoe.kernels.srivc import INSTRUMENT, REGRESSOR, TARGET, instrument_products

    own = [3] * (problem.offset_at is not None) + [4] * (problem.state_at is not None)
    size = 3 + len(own) * len(inputs)
    normal, right = np.zeros((size, size)), np.zeros(size)
    for index, experiment in enumerate(problem.experiments):
        products = np.zeros((COLUMNS, COLUMNS))
        instrument_products(
            inputs[index],
            outputs[index],
            instruments[index],
            EVERY if experiment.mask.all() else experiment.mask,
            *as_kernels_take(experiment.step),
            pole,
            products,
        )
        mine = products[[INSTRUMENT, 1, 2, *own]][:, [REGRESSOR, 1, 2, *own, TARGET]]
        at = slice(3 + len(own) * index, 3 + len(own) * (index + 1))
        normal[:3, :3] += mine[:3, :3]
        normal[:3, at], normal[at, :3], normal[at, at] = mine[:3, 3:-1], mine[3:, :3], mine[3:, 3:-1]
        right[:3] += mine[:3, -1]
        right[at] = mine[3:, -1]
    scale = np.sqrt(np.abs(normal.diagonal()))
    if not np.isfinite(normal).all() or not scale.all():
        raise NotIdentifiableError(
            "the recordings do not excite the model: record a load that rises and falls at several rates"
        )
    solution: Array = np.linalg.lstsq(normal / (scale[:, np.newaxis] * scale), right / scale, rcond=1e-14)[0] / scale
    return solution


def _nuisance(problem: PredictionError, index: int, alpha: float, rest: Array) -> Array:
    """Offset and initial state of one recording, by least squares on the model's residual."""
    experiment = problem.experiments[index]
    columns = []
    if problem.offset_at is not None:
        columns.append(np.ones_like(rest))
    if problem.state_at is not None:
        columns.append(np.exp(-alpha * experiment.time_s))
    mask = experiment.mask
    if not columns or not mask.any():
        return np.zeros_like(rest)
    basis = np.stack(columns)
    inside, target = basis[:, mask], rest[mask]
    fitted: Array = np.linalg.lstsq(inside @ inside.T, inside @ target, rcond=None)[0] @ basis
    return fitted


def coarse_delay(problem: PredictionError, pole: float) -> float:
    """The delay in s on a grid of 0.05 s, near enough to start a gradient method.

    Least squares of the output on the delayed input, its low-passed part and a constant.
    """
    from smartshoe.kernels.first_order import respond
    from smartshoe.kernels.srivc import delayed_products

    steps = [experiment.sample_time_s for experiment in problem.experiments]
    reach = int(0.9 * LARGEST_DELAY_S / COARSE_STEP_S)
    costs = np.zeros(2 * reach + 1)
    grid_s = 0.0
    for index, (u, y) in enumerate(zip(problem.inputs_at(0.0), problem.outputs, strict=True)):
        experiment = problem.experiments[index]
        stride = max(round(COARSE_STEP_S / steps[index]), 1)
        edge = reach * stride
        inside = np.where(experiment.mask, 1.0, 0.0)[edge : y.size - edge]
        count = float(inside.sum())
        if count < 10:
            continue
        grid_s = grid_s or stride * steps[index]
        target = y[edge : y.size - edge]
        target = (target - float(target @ inside) / count) * inside
        w = np.empty(u.size)
        respond(u, *as_kernels_take(experiment.step), 0.0, pole, 0.0, 1.0, 0.0, 0.0, w)
        sums = np.empty((costs.size, 7))
        delayed_products(u, w, target, inside, stride, sums)
        of_u, of_w, uu, uw, ww, uy, wy = sums.T
        uu, uw, ww = uu - of_u**2 / count, uw - of_u * of_w / count, ww - of_w**2 / count
        determinant = np.maximum(uu * ww - uw**2, 1e-9 * uu * ww + 1e-300)
        costs += float(target @ target) - (uy**2 * ww - 2 * uy * wy * uw + wy**2 * uu) / determinant
    if grid_s == 0.0 or costs.min() >= 0.5 * costs[reach]:
        return 0.0
    best = int(np.argmin(costs)) - reach
    # In the inverse direction the input, a reading, is shifted forwards to compensate its delay.
    sign = 1.0 if problem.settings.direction == "inverse" else -1.0
    return sign * best * grid_s
