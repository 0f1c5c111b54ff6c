"""How noisy the input is, and what that does to a fit that takes it for exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.identification.experiment import Array, Experiment
from smartshoe.identification.prediction_error import PredictionError
from smartshoe.models.first_order import interpolation_gain, lag, lag_and_slope

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
        at = np.arange(0, signal.size - 3, share)
        thirds.append(signal[at + 3] - 3.0 * signal[at + 2] + 3.0 * signal[at + 1] - signal[at])
    if not thirds:
        return 0.0
    third = np.abs(np.concatenate(thirds))
    return float(np.median(third)) / (NORMAL_QUARTILE * float(np.sqrt(THIRD_DIFFERENCE_POWER)))


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
    shape, step_s = problem.shape(theta), first.sample_time_s
    impulse = np.zeros(IMPULSE_SAMPLES)
    impulse[1] = 1.0
    w, w_slope = lag_and_slope(impulse, shape.alpha, step_s)
    response = shape.p1 * (impulse - w) + shape.p2 * w
    own = np.stack([shape.alpha * (shape.p2 - shape.p1) * w_slope, impulse - w, w])
    push = np.zeros(problem.size)
    push[: problem.shape_size] = shape.slope.T @ (own @ response)
    delay_s = problem.delay_s(theta)
    gain, gain_slope = interpolation_gain(delay_s, first.time_s, first.step)
    push *= gain
    if problem.delay_at is not None:
        push[problem.delay_at] = 0.5 * gain_slope * float(response @ response)
    from smartshoe.identification.solve import solve_normal

    return -solve_normal(normal, problem.count * input_sd**2 * push)


def output_variance(problem: PredictionError, theta: Array, variance: float, input_sd: float) -> float:
    """What of the error's ``variance`` the input's noise does not account for; never below a thousandth of it."""
    first = problem.experiments[0]
    shape, step_s = problem.shape(theta), first.sample_time_s
    impulse = np.zeros(IMPULSE_SAMPLES)
    impulse[1] = 1.0
    w = lag(impulse, shape.alpha, step_s)
    response = shape.p1 * (impulse - w) + shape.p2 * w
    gain, _ = interpolation_gain(problem.delay_s(theta), first.time_s, first.step)
    return max(variance - input_sd**2 * gain * float(response @ response), 1e-3 * variance)
