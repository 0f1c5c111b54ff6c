"""How noisy the input is, and what that does to a fit that takes it for exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._experiment import Experiment
from smartshoe.identification._prediction_error import EVERY, NONE, NOT_STORED, PredictionError
from smartshoe.identification._solve import solve_normal
from smartshoe.models.first_order import interpolation_gain
from smartshoe.signals.noise import white_noise_sd

MATTERS = 0.1  # of a standard error: a smaller bias is not worth another estimator
DIFFERENCES = 4000  # third differences looked at
IMPULSE_SAMPLES = 512


def noise_sds(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """White noise of the load in N and of the reading in its unit, a converter's step included."""
    usable = [experiment for experiment in experiments if experiment.mask.any()]
    return _noise_sd([one.load_n for one in usable]), _noise_sd([one.reading for one in usable])


def _noise_sd(signals: Sequence[Array]) -> float:
    """Of ``signals`` (n,); where values come back they are levels, a step the usual distance between neighbours."""
    levels = [np.unique(one) for one in signals]
    steps = [np.diff(own) for one, own in zip(signals, levels, strict=True) if 2 <= own.size <= one.size // 2]
    step = float(np.median(np.concatenate(steps))) if steps else 0.0
    return white_noise_sd(*signals, order=3, most=DIFFERENCES, step=step)


def input_noise_bias(problem: PredictionError, theta: Array, normal: Array, input_sd: float) -> Array:
    """(size,) what white noise of ``input_sd`` on the input adds to an output-error estimate of theta.

    The cost grows by count sd^2 |G|^2, with G from noise to error; its gradient, taken through ``normal`` (size,
    size), moves the minimum (Soderstrom 2007, Automatica 43, 939-958).
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
    """What of the error's ``variance`` the input's noise does not account for; never below a thousandth of it."""
    first = problem.experiments[0]
    gain, _ = interpolation_gain(problem.delay_s(theta), first.time_s, first.step)
    return max(variance - input_sd**2 * gain * _answer(problem, theta)[1], 1e-3 * variance)


def _answer(problem: PredictionError, theta: Array) -> tuple[Array, float]:
    """The response to a unit impulse: its products (3,) with its own derivatives over (ln alpha, p1, p2), its power."""
    from smartshoe.kernels.first_order import COLUMNS, inner_products

    shape, impulse = problem.shape(theta), np.zeros(IMPULSE_SAMPLES)
    impulse[1] = 1.0
    products, step_s = np.zeros((COLUMNS, COLUMNS)), problem.experiments[0].sample_time_s
    # Without an output to compare with, the error is the response.
    inner_products(
        impulse, NONE, np.zeros_like(impulse), EVERY, step_s, None, 0.0, shape.alpha, shape.p1, shape.p2, 0.0, 0.0,
        NOT_STORED, products,
    )  # fmt: skip
    return products[:3, -1], float(products[-1, -1])
