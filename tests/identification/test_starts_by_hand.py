"""Where a fit sets out: poles, delays and SRIVC's steps by plain least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import TOE, coefficients, press

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._experiment import prepare
from smartshoe.identification._parametrisation import Shape, coefficients_of
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._srivc import _nuisance, _step, coarse_delay, srivc
from smartshoe.identification._start import _linear, _response, start, theta_at
from smartshoe.models import simulate
from smartshoe.models.first_order import lag
from smartshoe.recording import Recording

Array = NDArray[np.float64]
A1, B0, B1 = coefficients(*TOE)


def _problem(direction: str = "inverse", **options: object) -> PredictionError:
    several = [
        press(offset=4.0, start_s=5.0, load_noise=0.5),
        press(offset=-2.0, start_s=3.0, name="b", rates=(400.0,)),
    ]
    gap = prepare(several)[0]
    gap[1] = replace(gap[1], mask=np.arange(gap[1].mask.size) % 50 != 7)
    return PredictionError(gap, Settings(direction=direction, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("steady", [True, False])
@pytest.mark.parametrize("constant", [True, False])
def test_at_a_pole_the_gains_are_those_of_least_squares(steady: bool, constant: bool) -> None:
    problem = _problem(steady=steady, free_constant=constant, offset=None if constant else 1.0, delay_s=0.0)
    alpha, rows, outputs = 0.4, [], []
    for index, (experiment, u, y) in enumerate(
        zip(problem.experiments, problem.inputs_at(0.012), problem.outputs, strict=True)
    ):
        w = lag(u, alpha, experiment.step)
        own = np.zeros((u.size, 2 + 2 * constant + 2 * (not steady)))
        own[:, 0], own[:, 1] = u - w, w
        if constant:
            own[:, 2 + index] = 1.0
        if not steady:
            own[:, 2 + 2 * constant + index] = np.exp(-alpha * experiment.time_s)
        rows.append(own[experiment.mask])
        outputs.append(y[experiment.mask])
    table, y = np.concatenate(rows), np.concatenate(outputs)
    fitted = np.linalg.lstsq(table, y, rcond=None)[0]
    cost, told, p1, p2 = _linear(problem, alpha, 0.012)
    assert (told, p1, p2) == (alpha, pytest.approx(fitted[0], rel=1e-6), pytest.approx(fitted[1], rel=1e-6))
    assert cost == pytest.approx(float(np.sum((table @ fitted - y) ** 2)), rel=1e-6)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_a_response_is_theta_with_the_delay_inside_its_bounds(direction: str) -> None:
    problem = _problem(direction)
    for delay_s, inside in ((0.2, 0.2), (0.6, 0.4995), (-0.6, -0.4995), (0.4996, 0.4995)):
        theta = _response(problem, 0.3, 1.6, 1.4, delay_s)
        assert theta == pytest.approx([np.log(0.3), 1.6, 1.4, inside, 0.0, 0.0, 0.0, 0.0])
    fixed = _problem(direction, delay_s=0.1)
    assert _response(fixed, 0.3, 1.6, 1.4, 0.2) == pytest.approx([np.log(0.3), 1.6, 1.4, 0.0, 0.0, 0.0, 0.0])


def test_at_a_response_the_linear_unknowns_are_at_their_best_and_the_others_stay() -> None:
    problem = _problem()
    theta = theta_at(problem, 0.3, 1.6, 1.4, 0.01, exact=True)
    assert theta[:4] == pytest.approx([np.log(0.3), 1.6, 1.4, 0.01])
    seen = problem.evaluate(theta)
    scale = np.sqrt(np.diag(seen.normal) * seen.cost)
    assert (seen.gradient / scale)[4:] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(seen.gradient / scale)[:4].max() > 1e-3
    noisy = problem.with_noise_ratio(1.0)
    assert theta_at(noisy, 0.3, 1.6, 1.4, 0.01)[4:] == pytest.approx(0.0)
    fixed = _problem(steady=True, free_constant=False, offset=0.0, delay_s=0.0)
    assert theta_at(fixed, 0.3, 1.6, 1.4, 0.0) == pytest.approx([np.log(0.3), 1.6, 1.4])


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("delay_s", [0.0, -0.3])
def test_a_start_lies_by_the_truth(direction: str, delay_s: float) -> None:
    recording = press(offset=4.0, start_s=5.0, delay_s=delay_s, load_noise=0.2)
    problem = PredictionError(prepare([recording])[0], Settings(direction=direction))  # type: ignore[arg-type]
    theta = start(problem, 1.0)
    assert theta[3] == pytest.approx(delay_s, abs=0.026)
    found = coefficients_of(Shape(float(np.exp(theta[0])), theta[1], theta[2], np.eye(3)), direction)[0]  # type: ignore[arg-type]
    assert found == pytest.approx([A1, B0, B1], rel=0.1)
    # A constant of 4 mbar, or the load of as much; the start has its own coefficient.
    assert theta[4] == pytest.approx(-4.0 * B1 / A1 if direction == "inverse" else 4.0, abs=2.0)
    exact = theta_at(problem, float(np.exp(theta[0])), theta[1], theta[2], theta[3], exact=True)
    assert theta[4:] == pytest.approx(exact[4:], abs=3.0)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("places", [0, 3, -5, 8, -8])
def test_a_coarse_delay_is_one_of_twentieths_of_a_second(direction: str, places: int) -> None:
    recording = press(offset=4.0, delay_s=0.05 * places, load_noise=1.0)
    problem = PredictionError(prepare([recording])[0], Settings(direction=direction))  # type: ignore[arg-type]
    assert coarse_delay(problem, 1.0) == pytest.approx(0.05 * places)
    assert coarse_delay(problem, A1) == pytest.approx(0.05 * places)


@pytest.mark.parametrize("places", [0, 3, -6])
def test_what_a_slow_part_lags_behind_is_no_delay(places: int) -> None:
    """A reading that is the load behind a lag of half a second alone, about a level that is large beside it."""
    time_s = 0.01 * np.arange(6000)
    rng = np.random.default_rng(3)
    load = 500.0 + 3.0 * np.cumsum(rng.standard_normal(7000))
    reading = lag(load, 2.0, 0.01)[500 - 5 * places :][:6000]
    recording = Recording.from_arrays(time_s=time_s, force_n=load[500:6500], pressure_mbar=reading)
    problem = PredictionError(prepare([recording])[0], Settings(direction="forward"))
    assert coarse_delay(problem, 2.0) == pytest.approx(0.05 * places)


@pytest.mark.parametrize(("noise", "is_seen"), [(0.2, True), (1.5, False)])
def test_a_delay_counts_that_takes_half_of_the_error_away(noise: float, is_seen: bool) -> None:
    """Of a white load the delayed one explains all but the noise: a 25th of the power, or two thirds of it."""
    rng = np.random.default_rng(3)
    rough = np.repeat(rng.standard_normal(1400), 5)
    time_s = 0.01 * np.arange(6000)
    reading = rough[485:6485] + noise * rng.standard_normal(6000)
    recording = Recording.from_arrays(time_s=time_s, force_n=rough[500:6500], pressure_mbar=reading)
    problem = PredictionError(prepare([recording])[0], Settings(direction="forward"))
    assert coarse_delay(problem, 2.0) == pytest.approx(0.15 if is_seen else 0.0)
    short = Recording.from_arrays(time_s=time_s[:99], force_n=rough[500:599], pressure_mbar=reading[:99])
    assert coarse_delay(PredictionError(prepare([short])[0], Settings()), 2.0) == 0.0


def test_srivc_finds_the_truth_around_a_gap_and_fills_it_with_its_own_model() -> None:
    problem = _problem(delay_s=0.0)
    alpha, p1, p2, nuisances, steps, settled = srivc(problem, prefilter_rad_s=1.0, tolerance=1e-6, max_iterations=30)
    assert settled
    assert 1 < steps < 15
    assert (alpha, p1, p2 * alpha) == (
        pytest.approx(A1, rel=0.02), pytest.approx(B0, rel=2e-3), pytest.approx(B1, rel=0.02)
    )  # fmt: skip
    assert nuisances.shape == (2, 2)
    assert nuisances[:, 0] == pytest.approx([-4.0 * B1 / A1, 2.0 * B1 / A1], abs=0.5)
    few = srivc(problem, prefilter_rad_s=1.0, tolerance=1e-6, max_iterations=1)
    assert few[4:] == (1, False)


@pytest.mark.parametrize("load", [0.0, np.inf])
def test_an_input_that_excites_nothing_is_refused(load: float) -> None:
    problem = _problem("forward", delay_s=0.0, steady=True, free_constant=False, offset=0.0)
    still = [replace(one, load_n=np.full_like(one.load_n, load)) for one in problem.experiments]
    with np.errstate(all="ignore"), pytest.raises(NotIdentifiableError, match="do not excite the model"):
        srivc(PredictionError(still, problem.settings), prefilter_rad_s=1.0, tolerance=1e-6, max_iterations=5)


@pytest.mark.parametrize("constant", [True, False])
def test_srivc_ends_where_its_model_without_zero_and_start_is_its_own_instrument(constant: bool) -> None:
    problem = _problem(steady=False, free_constant=constant, offset=None if constant else 0.0, delay_s=0.0)
    problem.experiments[1] = replace(problem.experiments[1], mask=np.ones_like(problem.experiments[1].mask))
    alpha, p1, p2, _, _, settled = srivc(problem, prefilter_rad_s=1.0, tolerance=1e-11, max_iterations=60)
    assert settled
    inputs = problem.inputs_at(0.0)
    models = [
        simulate(alpha, p1, p2 * alpha, u, one.time_s) for u, one in zip(inputs, problem.experiments, strict=True)
    ]
    told = _step(problem, inputs, problem.outputs, models, alpha)
    assert told[:3] == pytest.approx([alpha, p1, p2 * alpha], rel=1e-7)


@pytest.mark.parametrize("steady", [True, False])
@pytest.mark.parametrize("constant", [True, False])
def test_a_recordings_own_zero_and_start_are_those_of_least_squares(steady: bool, constant: bool) -> None:
    problem = _problem(steady=steady, free_constant=constant, offset=None if constant else 1.0, delay_s=0.0)
    experiment = problem.experiments[1]
    rest = np.random.default_rng(1).standard_normal(experiment.time_s.size) + np.linspace(
        0.0, 3.0, experiment.time_s.size
    )
    columns = [np.ones_like(rest)] * constant + [np.exp(-0.5 * experiment.time_s)] * (not steady)
    told = _nuisance(problem, 1, 0.5, rest)
    if not columns:
        assert not told.any()
        return
    basis = np.stack(columns, axis=1)
    fitted = np.linalg.lstsq(basis[experiment.mask], rest[experiment.mask], rcond=None)[0]
    assert told == pytest.approx(basis @ fitted, abs=1e-9)
    problem.experiments[1] = replace(experiment, mask=np.zeros(rest.size, dtype=bool))
    assert not _nuisance(problem, 1, 0.5, rest).any()
