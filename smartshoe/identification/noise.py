"""How noisy the input is, and what that does to a fit that takes it for exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification.experiment import Experiment
from smartshoe.identification.prediction_error import EVERY, NOT_STORED, PredictionError
from smartshoe.identification.solve import solve_normal
from smartshoe.models.first_order import interpolation_gain

MATTERS = 0.1  # of a standard error: a smaller bias is not worth another estimator
DIFFERENCES = 4000  # third differences looked at
THIRD_DIFFERENCE_POWER = 20.0  # 1 + 9 + 9 + 1
NORMAL_QUARTILE = 0.6744897501960817
IMPULSE_SAMPLES = 512


def white_noise_sd(signals: Sequence[Array]) -> float:
    """Standard deviation of the white noise on smooth signals, from the median of their third differences.

    Straight lines and slow curves leave nothing in a third difference; corners are few and do not move a median. A
    noise below a converter's step is not seen (the median is 0): what a step leaves is the step's own, step/sqrt(12).
    """
    thirds = []
    share = max(sum(signal.size for signal in signals) // DIFFERENCES, 1)
    for signal in signals:
        if signal.size < 8:
            continue
        now, size = signal[::share], -(-(signal.size - 3) // share)
        first, second, third = (signal[lead::share][:size] for lead in (1, 2, 3))
        thirds.append(third - 3.0 * second + 3.0 * first - now[:size])
    if not thirds:
        return 0.0
    size = sum(third.size for third in thirds)
    # A median by one partition: no experiment holds NaN, for which numpy's would look.
    middle = np.partition(np.abs(np.concatenate(thirds)), size // 2)
    median = middle[size // 2] if size % 2 else 0.5 * (middle[size // 2] + middle[: size // 2].max())
    return float(median) / (NORMAL_QUARTILE * float(np.sqrt(THIRD_DIFFERENCE_POWER)))


def noise_sds(experiments: Sequence[Experiment]) -> tuple[float, float]:
    """White noise of the load in N and of the reading in its unit."""
    usable = [experiment for experiment in experiments if experiment.kept.any()]
    return (
        white_noise_sd([experiment.load_n for experiment in usable]),
        white_noise_sd([experiment.reading for experiment in usable]),
    )


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

    shape, impulse, none = problem.shape(theta), np.zeros(IMPULSE_SAMPLES), np.zeros(0)
    impulse[1] = 1.0
    products, step = np.zeros((COLUMNS, COLUMNS)), np.array([problem.experiments[0].sample_time_s])
    # Without an output to compare with, the error is the response.
    inner_products(
        impulse, none, np.zeros_like(impulse), EVERY, step, 0.0, shape.alpha, shape.p1, shape.p2, 0.0, 0.0, NOT_STORED,
        products,
    )  # fmt: skip
    return products[:3, -1], float(products[-1, -1])
