"""Estimates the input's noise, and the bias it causes in a fit that takes the input as exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._experiment import Experiment
from smartshoe.identification._prediction_error import EVERY, NONE, NOT_STORED, PredictionError
from smartshoe.identification._solve import solve_normal
from smartshoe.models.first_order import interpolation_gain
from smartshoe.signals.noise import white_noise_sd

MATTERS = 0.1  # of a standard error: a smaller bias does not justify another estimator
DIFFERENCES = 4000  # third differences used, at most
IMPULSE_SAMPLES = 512


def noise_sds(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """Standard deviations of white noise of the load in N and of the reading in its unit, including quantisation."""
    usable = [experiment for experiment in experiments if experiment.mask.any()]
    return _noise_sd([one.load_n for one in usable]), _noise_sd([one.reading for one in usable])


def _noise_sd(signals: Sequence[Array]) -> float:
    """White noise sd of ``signals``, (n,) each, including the quantisation step where values recur.

    The step is the median distance between neighbouring distinct values.
    """
    levels = [np.unique(one) for one in signals]
    steps = [np.diff(own) for one, own in zip(signals, levels, strict=True) if 2 <= own.size <= one.size // 2]
    step = float(np.median(np.concatenate(steps))) if steps else 0.0
    return white_noise_sd(*signals, order=3, most=DIFFERENCES, step=step)


def input_noise_bias(problem: PredictionError, theta: Array, normal: Array, input_sd: float) -> Array:
    """(size,) bias of an output-error estimate of theta due to white noise of ``input_sd`` on the input.

    The noise raises the cost by count sd^2 |G|^2, with G the response from noise to error; the gradient of this,
    divided by ``normal`` (size, size), shifts the minimum (Soderstrom 2007, Automatica 43, 939-958).
    """
    first = problem.experiments[0]
    along, power = _answer(problem, theta)
    push = np.zeros(problem.size)
    push[: problem.shape_size] = problem.shape(theta).slope.T @ along
    delay_s = problem.delay_s(theta)
    gain, gain_slope = interpolation_gain(delay_s, first.time_s, first.step)
    push *= gain
    if problem.delay_at is not None:
        push[problem.delay_at] = 0.5 * gain_slope * power
    return -solve_normal(normal, problem.count * input_sd**2 * push)


def output_variance(problem: PredictionError, theta: Array, variance: float, input_sd: float) -> float:
    """The error's ``variance`` less the part due to the input's noise; at least a thousandth of it."""
    first = problem.experiments[0]
    gain, _ = interpolation_gain(problem.delay_s(theta), first.time_s, first.step)
    return max(variance - input_sd**2 * gain * _answer(problem, theta)[1], 1e-3 * variance)


def _answer(problem: PredictionError, theta: Array) -> tuple[Array, float]:
    """Inner products (3,) of the impulse response with its derivatives over (ln alpha, p1, p2), and its energy."""
    from smartshoe.kernels.first_order import COLUMNS, inner_products

    shape, impulse = problem.shape(theta), np.zeros(IMPULSE_SAMPLES)
    impulse[1] = 1.0
    products, step_s = np.zeros((COLUMNS, COLUMNS)), problem.experiments[0].sample_time_s
    # With an output of zero, the error is the response itself.
    inner_products(
        impulse, NONE, np.zeros_like(impulse), EVERY, step_s, None, 0.0, shape.alpha, shape.p1, shape.p2, 0.0, 0.0,
        NOT_STORED, products,
    )  # fmt: skip
    return products[:3, -1], float(products[-1, -1])
