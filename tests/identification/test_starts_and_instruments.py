"""Where a fit sets out from, what its instruments leave of the error, and where its rounds end."""

from __future__ import annotations

import numpy as np
import pytest
from presses import TOE, coefficients, press

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification import identify
from smartshoe.identification._estimator import _mean_square
from smartshoe.identification._experiment import prepare
from smartshoe.identification._noise import output_variance
from smartshoe.identification._parametrisation import Shape, coefficients_of
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._start import POLES_RAD_S, _linear
from smartshoe.recording import Recording

TIME = np.arange(1000) / 100


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_of_the_poles_that_are_scanned_the_true_one_leaves_least_and_its_gains(direction: str) -> None:
    recording = press(offset=4.0, start_s=5.0)
    problem = PredictionError(prepare([recording])[0], Settings(direction=direction, steady=False))
    a1, b0, b1 = coefficients(*TOE)
    pole = a1 if direction == "inverse" else b1 / b0
    cost, alpha, p1, p2 = _linear(problem, pole, 0.0)
    assert alpha == pole
    # The corners of the 1 kHz plant between two samples leave thousandths.
    assert coefficients_of(Shape(alpha, p1, p2, np.eye(3)), direction)[0] == pytest.approx([a1, b0, b1], rel=2e-3)
    assert cost < min(_linear(problem, float(other), 0.0)[0] for other in POLES_RAD_S)


def test_standard_errors_by_instruments_are_in_proportion_to_the_noise() -> None:
    loud, quiet = (identify(press(load_noise=sd, command=True), estimator="command") for sd in (2.0, 0.02))
    for name in ("a1", "b0", "b1"):
        assert quiet.parameters[name].sd == pytest.approx(0.01 * loud.parameters[name].sd, rel=0.1)


def test_the_ratio_of_the_noises_is_settled() -> None:
    """What the rounds end at is where they would stay: given as known, the noise gives the same fit."""
    noisy = press(load_noise=2.23, reading_noise=20.0, delay_s=0.003, offset=4.0)
    found = identify(noisy, estimator="errors_in_variables")
    fit, reading_sd = found.fit, found.noise["reading"].value
    load_sd = np.sqrt(output_variance(fit.problem, fit.theta, _mean_square(fit.problem, fit.theta), reading_sd))
    told = identify(
        noisy, estimator="errors_in_variables", load_noise_n=float(load_sd), reading_noise=float(reading_sd)
    )
    for name in ("a1", "b0", "b1"):
        own = found.parameters[name]
        assert told.parameters[name].value == pytest.approx(own.value, abs=0.01 * own.sd), name


def test_a_reading_of_noise_alone_is_said_not_to_follow() -> None:
    load = 400 - 400 * np.cos(2 * np.pi * TIME / 5)
    reading = 30 + np.random.default_rng(1).standard_normal(TIME.size)
    recording = Recording.from_arrays(time_s=TIME, force_n=load, pressure_mbar=reading)
    with pytest.raises(NotIdentifiableError, match="reading does not follow the load"):
        identify(recording, direction="forward")


@pytest.mark.parametrize(
    ("rates", "repeats", "seed"),
    [
        ((400.0,), 1, 0),
        pytest.param((100.0, 400.0), 3, 0, marks=pytest.mark.long),
        *(pytest.param((100.0, 400.0), 3, seed, marks=pytest.mark.bank) for seed in range(1, 4)),
    ],
)
def test_a_fit_that_is_no_better_than_the_mean_is_refused_whatever_its_error_bars(
    rates: tuple[float, ...], repeats: int, seed: int
) -> None:
    """With noise allowed for on both signals, that of the reading alone has a gain as sure as it is large."""
    triangles = press(rates=rates, repeats=repeats, load_noise=0.3)
    reading = np.random.default_rng(seed).standard_normal(len(triangles))
    recording = Recording.from_arrays(time_s=triangles.time_s, force_n=triangles.force_n, pressure_mbar=reading)
    with pytest.raises(NotIdentifiableError, match="reading does not follow the load"):
        identify(recording)
