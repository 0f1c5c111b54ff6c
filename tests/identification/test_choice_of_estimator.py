"""Which noise a fit allows for: each condition of the choice at its bound, and what a fit brings along from it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import FIXED, TOE, coefficients, press

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification import identify
from smartshoe.identification._estimator import (
    MOST_RATIO,
    ParameterFit,
    Termination,
    _concern,
    _has_command,
    _instrumental,
    _is_weak,
    _mean_square,
    _minimise,
    _noise,
    _noise_ratio,
    _output_error,
    _settle,
)
from smartshoe.identification._experiment import Direction, Experiment, prepare
from smartshoe.identification._instruments import Instruments, solve_instrumental
from smartshoe.identification._noise import input_noise_bias, noise_sds
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._start import start
from smartshoe.models.first_order import HALF_WIDTH

Array = NDArray[np.float64]

PLAIN = Settings(offset=0.0, free_constant=False, delay_s=0.0, steady=True)
A1, B0, B1 = coefficients(*TOE)
THETA = {"inverse": np.array([np.log(A1), B0, B1 / A1]), "forward": np.array([np.log(B1 / B0), 1.0 / B0, A1 / B1])}
LIMITS = Termination(1e-9, 50)


@pytest.fixture(scope="module")
def pressed() -> Experiment:
    (experiment,), _ = prepare([press(load_noise=2.0, reading_noise=1.0, command=True, rates=(400.0, 800.0))])
    return experiment


def settled(experiment: Experiment, direction: Direction = "inverse", **changes: Any) -> ParameterFit:
    problem = PredictionError([experiment], replace(PLAIN, direction=direction))
    theta = THETA[direction]
    fit = _settle(problem, theta, problem.evaluate(theta), 3, True, "output_error")
    return replace(fit, **changes)


# -- what a fit is ---------------------------------------------------------------------------------------------------
def test_a_fit_has_the_variance_of_what_it_leaves_and_the_covariance_of_its_slopes(pressed: Experiment) -> None:
    few = replace(pressed, mask=(np.arange(pressed.mask.size) % 150 == 20) & pressed.mask)
    fit = settled(few)
    problem = fit.problem
    error = problem.residual(fit.theta)
    jacobian = problem.jacobian(fit.theta)
    assert error.size < 20
    assert fit.degrees == error.size - 3
    assert fit.variance == pytest.approx(float(error @ error) / (error.size - 3))
    assert fit.covariance == pytest.approx(fit.variance * np.linalg.inv(jacobian.T @ jacobian), rel=1e-6)
    assert (fit.cost, fit.degenerate) == (pytest.approx(float(error @ error)), False)
    assert _mean_square(problem, fit.theta) == pytest.approx(fit.variance)
    assert (fit.iterations, fit.converged, fit.estimator) == (3, True, "output_error")


def test_a_noise_that_is_given_is_taken_and_the_other_measured(pressed: Experiment) -> None:
    problem = PredictionError([pressed], PLAIN)
    load, reading = noise_sds([pressed])
    assert load != pytest.approx(reading, rel=0.1)
    assert _noise(problem, {"load": None, "reading": None}) == {"load": load, "reading": reading}
    assert _noise(problem, {"load": 0.0, "reading": None}) == {"load": 0.0, "reading": reading}
    assert _noise(problem, {"load": None, "reading": 9.0}) == {"load": load, "reading": 9.0}
    assert _noise(problem, {"load": 8.0, "reading": 0.0}) == {"load": 8.0, "reading": 0.0}


# -- whether the input's noise matters -------------------------------------------------------------------------------
@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_bias_matters_from_a_tenth_of_an_error_of_any_coefficient_on(
    pressed: Experiment, direction: Direction, which: int
) -> None:
    fit = settled(pressed, direction)
    assert fit.evaluation is not None
    bias = input_noise_bias(fit.problem, fit.theta, fit.evaluation.normal, 1.0)
    _, slope = fit.problem.coefficients(fit.theta)
    moved = slope @ bias
    for times, matters in ((9.0, True), (11.0, False)):
        sds = np.abs(moved) * 1e4
        sds[which] = times * abs(moved[which])
        inverse = np.linalg.inv(slope)
        concern = _concern(replace(fit, covariance=inverse @ np.diag(sds**2) @ inverse.T), 1.0)
        assert bool(concern) is matters
        if matters:
            name = "reading" if direction == "inverse" else "load"
            assert f"the {name} is noisy as well (about 1), which would move a1 by" in concern
            assert f" {100.0 * moved[0] / (A1):.2g} % of itself" in concern


def test_where_there_is_no_noise_no_curvature_or_no_error_bar_nothing_is_said(pressed: Experiment) -> None:
    fit = settled(pressed)
    tight = replace(fit, covariance=1e-6 * fit.covariance)
    assert _concern(tight, 1.0)
    assert _concern(replace(tight, degrees=1), 1.0)
    assert not _concern(tight, 0.0)
    assert not _concern(replace(tight, degrees=0), 1.0)
    assert not _concern(replace(tight, degenerate=True), 1.0)
    assert not _concern(replace(tight, evaluation=None), 1.0)


@pytest.mark.parametrize(
    ("input_sd", "output_variance", "ratio"),
    [(2.0, 4.0, 1.0), (3.0, 0.5, 18.0), (0.5, 8.0, 0.03125), (1.0, 0.0, MOST_RATIO), (3.0, 1e-8, MOST_RATIO),
     (3.0, 9.1e-8, 9.0 / 9.1e-8), (0.0, 2.0, 0.0)],
)  # fmt: skip
def test_the_ratio_of_two_noises_is_that_of_their_variances_up_to_a_hundred_million(
    input_sd: float, output_variance: float, ratio: float
) -> None:
    assert _noise_ratio(input_sd, output_variance) == pytest.approx(ratio)


# -- whether there is a command --------------------------------------------------------------------------------------
def test_a_command_is_there_where_every_recording_has_one_that_moves_with_its_load(pressed: Experiment) -> None:
    command_n = pressed.command_n
    assert command_n is not None
    gap = command_n.copy()
    gap[5] = np.nan
    for other, is_there in (
        (None, False),
        (gap, False),
        (np.full_like(command_n, 3.0), False),
        (np.random.default_rng(1).permutation(command_n), False),
        (-command_n, False),
        (command_n / np.ptp(command_n), True),
        (command_n, True),
    ):
        several = [pressed, replace(pressed, command_n=other)]
        assert bool(_has_command(PredictionError(several, PLAIN))) is is_there
    for share, is_there in ((0.50, False), (0.47, True)):
        load = pressed.load_n - pressed.load_n.mean()
        noise = np.random.default_rng(2).standard_normal(load.size)
        noise -= noise.mean()
        noise -= noise @ load / (load @ load) * load
        mixed = load + share * noise * np.linalg.norm(load) / np.linalg.norm(noise)
        # 1/sqrt(1 + share^2): 0.894 and 0.905.
        assert bool(_has_command(PredictionError([replace(pressed, command_n=mixed)], PLAIN))) is is_there


def test_where_a_delay_held_far_off_leaves_no_instruments_the_noise_of_both_signals_is_allowed_for() -> None:
    recording = press(load_noise=0.3, reading_noise=0.3, command=True, rates=(50.0, 200.0, 800.0))
    assert identify(recording).estimator == "command"
    found = identify(recording, delay=0.1)
    assert (found.estimator, found.delay_s.value) == ("errors_in_variables", 0.1)
    with pytest.raises(NotIdentifiableError, match=r"^triangles: the instruments do not determine the model"):
        identify(recording, delay=0.1, estimator="command")


@pytest.mark.parametrize(("times", "is_weak"), [(3.9, False), (4.0, False), (4.1, True)])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_instruments_are_weak_that_leave_any_of_three_four_times_as_uncertain(
    pressed: Experiment, times: float, is_weak: bool, which: int
) -> None:
    fit = replace(settled(pressed), covariance=np.diag([0.5, 0.25, 2.0, 1.0]) ** 2)
    own = np.array([0.5, 0.25, 2.0, 100.0])  # of a nuisance it does not matter
    own[which] *= times
    assert _is_weak(replace(fit, covariance=np.diag(own) ** 2), fit) is is_weak


# -- steps, edges and costs ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("delay_s", "more"), [(0.006, 0), (0.016, 2), (0.203, 21)])
def test_a_delay_of_more_than_a_sample_leaves_as_many_out_at_the_ends_and_fits_again(delay_s: float, more: int) -> None:
    recording = press(load_noise=0.05, delay_s=delay_s)
    problem = PredictionError(prepare([recording])[0], Settings())
    begun = start(problem, 1.0)
    first = _minimise(problem, begun, "trf", LIMITS)
    steps = first.iterations
    if more:
        problem.drop_edges(HALF_WIDTH + more)
        steps += _minimise(problem, first.theta, "trf", LIMITS).iterations
    fit = _output_error(PredictionError(prepare([recording])[0], Settings()), "trf", 1.0, LIMITS)
    (mask,) = fit.problem.masks
    assert np.flatnonzero(mask)[[0, -1]].tolist() == [HALF_WIDTH + more, mask.size - HALF_WIDTH - more - 1]
    assert fit.iterations == steps
    assert fit.converged


def test_a_delay_that_is_given_leaves_no_ends_out() -> None:
    problem = PredictionError(prepare([press(load_noise=0.05, delay_s=0.05)])[0], Settings(delay_s=0.05))
    assert _output_error(problem, "trf", 1.0, LIMITS).problem.masks[0].all()


def test_srivc_says_its_own_steps_and_what_enters_linearly_is_at_its_best() -> None:
    problem = PredictionError(prepare([press(load_noise=1.0, offset=4.0)])[0], Settings(delay_s=0.0))
    fit = _output_error(problem, "srivc", 1.0, LIMITS)
    assert fit.converged
    assert fit.iterations > 1
    seen = problem.evaluate(fit.theta)
    # Constant and state are linear: their slope is nothing, to rounding.
    scale = np.sqrt(np.diag(seen.normal) * seen.cost)
    assert (seen.gradient / scale)[3:] == pytest.approx(0.0, abs=1e-9)


def test_a_fit_by_instruments_brings_their_samples_variance_and_steps(pressed: Experiment) -> None:
    assert pressed.command_n is not None
    gap = pressed.command_n.copy()
    gap[100:130] = np.nan
    problem = PredictionError([replace(pressed, command_n=gap)], PLAIN)
    theta = THETA["inverse"] + 0.01
    fit = replace(_settle(problem, theta, problem.evaluate(theta), 5, True, "output_error"), noise={"load": 1.0})
    found = _instrumental(fit, "command", [], LIMITS)
    sd = np.sqrt(np.diag(fit.covariance))
    root, covariance, variance, steps, converged = solve_instrumental(
        Instruments(problem, "command"), theta, sd, tolerance=1e-9, max_iterations=50
    )
    assert found.theta == pytest.approx(root)
    assert found.covariance == pytest.approx(covariance)
    assert (found.variance, found.cost) == (pytest.approx(variance), pytest.approx(variance * fit.degrees))
    assert (found.iterations, found.converged, found.estimator) == (5 + steps, converged, "command")
    assert np.flatnonzero(~found.problem.masks[0]).tolist() == list(range(100, 130))
    assert (found.problem.settings.noise_ratio, found.evaluation) == (0.0, None)


def test_noise_on_both_takes_more_steps_than_the_plain_fit_that_it_begins_with() -> None:
    noisy = press(load_noise=2.0, reading_noise=3.0)
    plain = identify(noisy, estimator="output_error", **FIXED)
    for told in ({}, {"load_noise_n": 2.0, "reading_noise": 3.0}):
        both = identify(noisy, estimator="errors_in_variables", **FIXED, **told)
        assert both.iterations > plain.iterations >= 1
    ratio = both.fit.problem.settings.noise_ratio
    assert ratio == pytest.approx(9.0 / 4.0)
    # The covariance of an estimate from equations whose slopes are noisy as well (Soderstrom 2007).
    fit = both.fit
    jacobian = fit.problem.jacobian(fit.theta)
    inverse = np.linalg.inv(fit.problem.evaluate(fit.theta).normal)
    wanted = fit.variance * inverse @ (jacobian.T @ jacobian) @ inverse
    assert np.sqrt(np.diag(fit.covariance)) == pytest.approx(np.sqrt(np.diag(wanted)), rel=1e-3)
