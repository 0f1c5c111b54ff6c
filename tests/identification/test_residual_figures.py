"""What a residual is tested against, and what noise on the input does, by plain formulas and by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import press
from scipy.special import gammaincc

from smartshoe.identification._experiment import prepare
from smartshoe.identification._noise import _answer, input_noise_bias, noise_sds, output_variance
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._residual_tests import ResidualTest, input_independence, residual_tests, whiteness
from smartshoe.identification._whitening import whitened
from smartshoe.models.first_order import interpolation_taps, simulate
from smartshoe.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def tail(degrees: int, statistic: float) -> float:
    """What of a chi-square lies beyond."""
    return float(gammaincc(degrees / 2.0, statistic / 2.0))


# -- whiteness -----------------------------------------------------------------------------------------------------
def ljung_box(residuals: Sequence[Array], masks: Sequence[Mask], lags: int) -> float:
    """Pair by pair."""
    products, pairs, power, total = np.zeros(lags + 1), np.zeros(lags + 1), 0.0, 0
    for residual, mask in zip(residuals, masks, strict=True):
        power += sum(value**2 for value, there in zip(residual, mask, strict=True) if there)
        total += int(mask.sum())
        for lag in range(1, lags + 1):
            for at in range(lag, residual.size):
                if mask[at] and mask[at - lag]:
                    products[lag] += residual[at] * residual[at - lag]
                    pairs[lag] += 1
    return float(sum((total * products[lag] / power) ** 2 / pairs[lag] for lag in range(1, lags + 1) if pairs[lag]))


@pytest.mark.parametrize(
    ("samples", "lags"), [(3, 1), (4, 1), (7, 1), (8, 2), (41, 10), (79, 19), (80, 20), (84, 20), (130, 20)]
)
@pytest.mark.parametrize("size", [1e-3, 30.0])
def test_as_many_lags_as_a_quarter_of_the_samples_up_to_twenty(samples: int, lags: int, size: float) -> None:
    residual = size * np.random.default_rng(samples).standard_normal(samples)
    found = whiteness([residual], [np.ones(samples, dtype=bool)])
    assert found.degrees == lags
    assert found.statistic == pytest.approx(ljung_box([residual], [np.ones(samples, dtype=bool)], lags))
    assert found.p_value == pytest.approx(tail(lags, found.statistic))


def test_samples_that_turn_each_time_are_not_white() -> None:
    turning = np.array([1.0, -1.0] * 40)
    found = whiteness([turning], [np.ones(80, dtype=bool)])
    assert found.statistic == pytest.approx(sum(80.0 - lag for lag in range(1, 21)))


def test_pairs_with_a_missing_sample_do_not_count_whatever_stands_there() -> None:
    kept = np.array([True, True, False, True, False])
    residual = np.array([0.3, 0.5, 1e6, -0.7, 1e6])
    found = whiteness([residual], [kept])
    # Of one lag one pair is there: (3 x 0.15/0.83)^2.
    assert (found.degrees, found.statistic) == (1, pytest.approx((3.0 * 0.15 / 0.83) ** 2))
    never = np.array([True, False] * 4)
    assert whiteness([np.ones(8)], [never]).statistic == 0.0


def test_a_test_is_told_in_numbers_that_json_has() -> None:
    assert ResidualTest(2.5, 0.25, 7).to_dict() == {"statistic": 2.5, "p_value": 0.25, "degrees": 7}
    assert ResidualTest(np.inf, np.nan, 7).to_dict() == {"statistic": None, "p_value": None, "degrees": 7}


# -- independence of the input ---------------------------------------------------------------------------------------
def rough(samples: int, seed: int, gaps: bool = False) -> Recording:
    """A load of white noise, whose lags are all apart."""
    rng = np.random.default_rng(seed)
    reading = rng.standard_normal(samples)
    if gaps:
        reading[samples // 3 : samples // 3 + 9] = np.nan
    return Recording.from_arrays(
        time_s=0.01 * np.arange(samples), force_n=rng.standard_normal(samples), pressure_mbar=reading, name=f"{seed}"
    )


def leaning(problem: PredictionError, theta: Array, errors: Sequence[Array], factor: int) -> tuple[float, int]:
    """The same by least squares: what delayed inputs explain of the error beyond what the fit's slopes do."""
    lags = sorted({lag // factor for lag in (0, 1, 2, 4, 8, 16, 32, 64, 128, 256)})
    coarse = problem.thinned(factor)
    used, delayed, left = [], [], []
    for index, error in enumerate(errors):
        u, mask = coarse.delayed(theta)[index][0], coarse.masks[index]
        used.append(coarse.error_and_slopes(theta, index)[1][:, mask])
        rows = [np.concatenate([np.full(min(lag, u.size), u[0]), u])[: u.size] for lag in lags]
        delayed.append(np.stack(rows)[:, mask])
        left.append(error[: u.size * factor].reshape(-1, factor).mean(axis=1)[mask])
    slopes, inputs, error = np.concatenate(used, axis=1), np.concatenate(delayed, axis=1), np.concatenate(left)

    def explained(basis: Array) -> float:
        scaled = basis / np.linalg.norm(basis, axis=1)[:, np.newaxis]
        fitted = scaled.T @ np.linalg.lstsq(scaled.T, error, rcond=1e-10)[0]
        return float(fitted @ fitted)

    beyond = explained(np.concatenate([slopes, inputs])) - explained(slopes)
    # The input as it is belongs to the fit: the slopes of its two gains add up to it.
    return beyond / (float(error @ error) / (error.size - problem.size)), len(lags) - 1


@pytest.mark.parametrize(
    ("samples", "factor"), [((1400,), 1), ((2999,), 1), ((3000,), 2), ((4600,), 3), ((1500, 1500), 2), ((1100, 90), 1)]
)
@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_how_a_residual_leans_on_the_input_is_what_least_squares_say(
    samples: tuple[int, ...], factor: int, direction: str
) -> None:
    experiments, _ = prepare([rough(count, 7 + index, gaps=True) for index, count in enumerate(samples)])
    problem = PredictionError(experiments, Settings(direction=direction, delay_s=0.02))  # type: ignore[arg-type]
    theta = np.array([0.7, 0.6, 0.4, *([0.3] * len(samples)), *([1.5] * len(samples))])
    rng = np.random.default_rng(sum(samples))
    errors = [rng.standard_normal(one.time_s.size) for one in experiments]
    found = input_independence(problem, theta, errors)
    statistic, degrees = leaning(problem, theta, errors, factor)
    assert found.degrees == degrees
    assert found.statistic == pytest.approx(statistic, rel=1e-6)
    assert found.p_value == pytest.approx(tail(degrees, statistic), rel=1e-4, abs=1e-300)


def test_a_level_input_has_no_lags_to_lean_on() -> None:
    (experiment,), _ = prepare([rough(600, 3)])
    level = replace(experiment, load_n=np.full(600, 30.0))
    problem = PredictionError([level], Settings(direction="forward", delay_s=0.0))
    noise = np.random.default_rng(1).standard_normal(600)
    found = input_independence(problem, np.array([0.7, 0.6, 0.4, 0.3, 0.0]), [noise])
    assert (found.statistic, found.p_value, found.degrees) == (0.0, 1.0, 0)


def test_both_tests_are_of_what_is_behind_the_whitening_filter_and_of_samples_that_count() -> None:
    (experiment,), _ = prepare([rough(700, 5, gaps=True)])
    options = Settings(direction="forward", delay_s=0.0, noise_ratio=0.4)
    problem, theta = PredictionError([experiment], options), np.array([0.7, 0.6, 0.4, 0.3, 1.5])
    error = np.random.default_rng(2).standard_normal(700)
    white = problem.whitening(theta)
    assert white is not None
    (mask,) = problem.masks
    zeroed = whitened(white, np.where(mask, error, 0.0))
    told = residual_tests(problem, theta, [np.where(mask, error, 1e3)])
    assert told == {
        "whiteness": whiteness([zeroed], [mask]),
        "input_independence": input_independence(problem, theta, [zeroed]),
    }
    plain = PredictionError([experiment], replace(options, noise_ratio=0.0))
    assert residual_tests(plain, theta, [error])["whiteness"] == whiteness([error], [mask])


# -- what noise on the input does ----------------------------------------------------------------------------------
def test_noise_is_measured_by_third_differences_of_recordings_that_count() -> None:
    """Of a signal that turns by 2 a at each sample they are all 8 a, those of white noise sqrt(20) times its sd."""
    (one, other), _ = prepare([rough(300, 1), rough(300, 2)])
    turning = np.where(np.arange(300) % 2, 1.0, -1.0)
    bent = 0.01 * np.arange(300.0) ** 2
    one = replace(one, load_n=3.0 * turning + bent, reading=0.5 * turning - bent)
    unseen = replace(other, load_n=1e3 * other.load_n, reading=1e3 * other.reading, mask=np.zeros(300, dtype=bool))
    size = 8.0 / 0.6744897501960817 / np.sqrt(20.0)
    assert noise_sds([one, unseen]) == pytest.approx((3.0 * size, 0.5 * size), rel=1e-6)


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.3, 0.4, 2.0])
def test_a_converters_step_adds_its_own_noise_also_where_it_hides_what_scatters(noise: float) -> None:
    """A value that is anywhere within a step q is off by q/sqrt(12), however little of it scatters."""
    (one, _), _ = prepare([rough(300, 1), rough(300, 2)])
    step, rng = 0.5, np.random.default_rng(3)
    course = 80.0 * np.abs(np.sin(0.0005 * np.arange(5000.0)))
    read = course + noise * step * rng.standard_normal(5000)
    coarse, fine = (replace(one, load_n=course, reading=values) for values in (step * np.round(read / step), read))
    seen = noise_sds([replace(coarse, mask=np.ones(5000, dtype=bool))])[1]
    exact = noise_sds([replace(fine, mask=np.ones(5000, dtype=bool))])[1]
    assert exact == pytest.approx(noise * step, rel=0.05)
    assert seen == pytest.approx(step * np.hypot(noise, 1.0 / np.sqrt(12.0)), rel=0.07)
    assert seen >= step / np.sqrt(12.0)


SHAPE = np.array([np.log(3.0), 0.9, 1.3])


def impulse_response(shape: Array) -> Array:
    impulse = np.zeros(511)
    impulse[0] = 1.0
    alpha = float(np.exp(shape[0]))
    before = np.concatenate([[0.0], impulse])
    return simulate(alpha, shape[1], shape[2] * alpha, before, 0.01 * np.arange(512), "rest")


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("delay_s", [0.0, 0.0037])
@pytest.mark.parametrize("is_estimated", [True, False])
def test_noise_on_the_input_passes_by_the_interpolation_and_the_response(
    direction: str, delay_s: float, is_estimated: bool
) -> None:
    experiments, _ = prepare([press()])
    options = Settings(direction=direction, delay_s=None if is_estimated else delay_s)  # type: ignore[arg-type]
    problem = PredictionError(experiments, options)
    theta = np.concatenate([SHAPE, [delay_s] * is_estimated, [2.0, 1.0]])
    answer = impulse_response(SHAPE)
    power = float(answer @ answer)
    along, told = _answer(problem, theta)
    assert told == pytest.approx(power, rel=1e-9)
    slopes = [(impulse_response(SHAPE + move) - impulse_response(SHAPE - move)) / 2e-6 for move in 1e-6 * np.eye(3)]
    pushed = np.array([float(answer @ slope) for slope in slopes])
    assert along == pytest.approx(pushed, rel=1e-5)
    # Of white noise between two samples the weights' squares are left, whichever of the two is the nearer.
    taps, tap_slopes = interpolation_taps(delay_s / 0.01)
    gain, gain_slope = float(taps @ taps), float(2.0 * taps @ tap_slopes) / 0.01
    assert output_variance(problem, theta, 4.0, 0.7) == pytest.approx(4.0 - 0.49 * gain * power, rel=1e-9)
    assert output_variance(problem, theta, 4.0, 1e3) == pytest.approx(4e-3)
    push = np.zeros(problem.size)
    push[:3] = gain * pushed
    if is_estimated:
        push[3] = 0.5 * gain_slope * power
    normal = np.diag(np.arange(1.0, problem.size + 1.0)) + 0.1
    wanted = -np.linalg.solve(normal, problem.count * 0.49 * push)
    assert input_noise_bias(problem, theta, normal, 0.7) == pytest.approx(wanted, rel=1e-4, abs=1e-9)
