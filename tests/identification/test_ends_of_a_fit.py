"""Where a fit begins and ends: few samples, few iterations, edges, gaps, and noise that its gradient holds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import FIXED, TOE, coefficients, press, pressed

from smartshoe.errors import NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification import fit_coefficients, identify
from smartshoe.identification._cycles import averaged_reading
from smartshoe.identification._experiment import _largest_rises, prepare
from smartshoe.identification._instruments import Instruments, solve_instrumental
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._residual_tests import input_independence
from smartshoe.models.first_order import HALF_WIDTH
from smartshoe.recording import Recording


def shape_of(a1: float, b0: float, b1: float, direction: str) -> np.ndarray:
    """ln alpha, p1, p2 of the coefficients."""
    return np.array([np.log(a1), b0, b1 / a1] if direction == "inverse" else [np.log(b1 / b0), 1 / b0, a1 / b1])


# -- iterations ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("method", ["srivc", "gn", "lm", "trf"])
def test_as_many_iterations_as_it_says_are_enough_and_one_fewer_is_not(method: str) -> None:
    recording = press(load_noise=2.0)
    steps = identify(recording, method=method, **FIXED).iterations
    assert identify(recording, method=method, max_iterations=steps, **FIXED).iterations == steps
    if steps > 1:
        with pytest.raises(NotConvergedError):
            identify(recording, method=method, max_iterations=steps - 1, **FIXED)
    else:
        assert method != "srivc"  # it must see a change to know that there is none


def test_one_step_by_instruments_is_one_and_moves() -> None:
    (experiment,), _ = prepare([press(load_noise=2.0, command=True)])
    problem = PredictionError([experiment], Settings(offset=0.0, free_constant=False, delay_s=0.0, steady=True))
    theta = shape_of(*coefficients(*TOE), "inverse")
    instruments, begun = Instruments(problem, "command"), theta + np.array([0.1, 0.0, 0.0])
    moved, _, _, steps, converged = solve_instrumental(instruments, begun, np.ones(3), tolerance=1e-9, max_iterations=1)
    assert (steps, converged) == (1, False)
    assert np.abs(moved - theta).max() < 0.2 * np.abs(begun - theta).max()


# -- few samples, small numbers --------------------------------------------------------------------------------------
def test_twenty_samples_are_enough_for_a_bank_of_fits() -> None:
    recording = press()
    part = slice(205, 905, 35)
    found = fit_coefficients(recording.sensor.values[part], recording.force_n[part], sample_time_s=0.35)
    assert found.coefficients.shape == (1, 3)
    assert found.sd == pytest.approx(np.sqrt(np.diag(found.covariance[0]))[np.newaxis])


def test_a_noise_below_one_unit_and_a_scale_of_one_are_numbers_like_any_other() -> None:
    recording = press(load_noise=1.0)
    found = identify(recording, reading_noise=0.5, scale=1.0, **FIXED)
    assert found.noise["reading"].value == 0.5
    assert found.scale == 1.0
    with pytest.raises(UsageError, match="scale is 0"):
        identify(recording, scale=0.0)


def test_a_load_without_any_noise_is_the_exact_signal() -> None:
    """What a model of the load calls the output has no variance then: all of the noise is the reading's."""
    found = identify(press(reading_noise=3.0), estimator="errors_in_variables", **FIXED)
    other = identify(press(reading_noise=3.0), direction="forward", **FIXED)
    for name in ("a1", "b0", "b1"):
        own = other.parameters[name]
        assert found.parameters[name].value == pytest.approx(own.value, abs=0.1 * own.sd)
        assert found.parameters[name].sd == pytest.approx(own.sd, rel=0.02)


@given(st.lists(st.floats(-100.0, 100.0), min_size=2, max_size=40))
@settings(max_examples=30)
def test_the_largest_climb_is_from_any_sample_to_a_later_one(values: list[float]) -> None:
    climbs = [later - one for at, one in enumerate(values) for later in values[at:]]
    assert _largest_rises(np.array(values)) == pytest.approx((max(climbs), -min(climbs)))


@pytest.mark.parametrize(("back", "is_enough"), [(0.15, True), (0.05, False)])
def test_a_tenth_of_the_load_must_be_travelled_both_ways(back: float, is_enough: bool) -> None:
    load = np.concatenate([np.linspace(0.0, 800.0, 400), np.linspace(800.0, 800.0 * (1.0 - back), 100)])
    recording = Recording.from_arrays(time_s=0.01 * np.arange(500), force_n=load, pressure_mbar=0.5 * load)
    if is_enough:
        assert prepare([recording])[0][0].mask.all()
    else:
        with pytest.raises(NotIdentifiableError, match="never falls again"):
            prepare([recording])


@pytest.mark.parametrize(("off", "is_even"), [(0.03, True), (0.07, False)])
def test_rows_count_as_skipped_where_the_others_lie_within_a_twentieth_of_their_places(
    off: float, is_even: bool
) -> None:
    time_s = np.delete(0.01 * np.arange(500), [200, 201])
    time_s[100] += off * 0.01
    load = 400.0 * np.sin(time_s) ** 2
    (experiment,), _ = prepare([Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.5 * load)])
    assert isinstance(experiment.step, float) is is_even


# -- edges, delays, gaps ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_every_way_to_undo_a_delay_is_one(direction: str) -> None:
    (experiment,), _ = prepare([press(gap=slice(0, 3))])
    problem = PredictionError([experiment], Settings(direction=direction))
    theta = np.array([0.0, 1.0, 1.0, 0.034, 0.0, 0.0])
    ((shifted, _),) = problem.delayed(theta)
    assert problem.inputs_at(0.034)[0] == pytest.approx(shifted)
    # What a delay's interpolation cannot reach does not count, at either end, nor does what is missing.
    (mask,) = problem.masks
    assert np.flatnonzero(~mask).tolist() == [*range(HALF_WIDTH), *range(mask.size - HALF_WIDTH, mask.size)]


def test_what_a_long_delay_moves_beyond_the_ends_does_not_count() -> None:
    found = identify(press(load_noise=1.0, delay_s=0.2), initial_state="steady")
    assert found.delay_s.value == pytest.approx(0.2, abs=0.005)
    (mask,) = found.fit.problem.masks
    assert not mask[: 20 + HALF_WIDTH].any()
    assert not mask[-20 - HALF_WIDTH :].any()
    assert mask[21 + HALF_WIDTH : -21 - HALF_WIDTH].all()


def test_a_small_problem_is_its_own_coarse_one() -> None:
    problem = PredictionError(prepare([press()])[0], Settings())
    assert problem.coarse(problem.count) is problem
    thinned = PredictionError(prepare([press()])[0], Settings()).coarse(problem.count // 4)
    assert 3 * thinned.count < problem.count


def test_the_mean_of_other_repeats_is_of_those_that_were_seen() -> None:
    whole = press(repeats=3, rates=(400.0,), rest_s=3.0)
    # Of three repeats the first lacks half a second, then the first and the second.
    starts = [int(np.argmin(np.abs(whole.force_n[at : at + 200] - 400.0))) + at for at in (200, 900, 1600)]
    reading = 0.01 * whole.sensor.values  # small ones, beside which nothing put in their place would be lost

    def lacking(*numbers: int) -> np.ndarray:
        values = reading.copy()
        for number in numbers:
            values[starts[number] - 25 : starts[number] + 25] = np.nan
        gappy = Recording.from_arrays(time_s=whole.time_s, force_n=whole.force_n, pressure_mbar=values)
        return averaged_reading([gappy])[0]

    third = slice(starts[2] - 20, starts[2] + 20)
    plain = lacking()
    assert np.isfinite(plain[third]).all()
    second_alone = lacking(0)[third]
    assert second_alone == pytest.approx(plain[third], rel=0.02)
    assert np.isnan(lacking(0, 1)[third]).all()


@pytest.mark.parametrize("samples", [1400, 3200, 4700])
def test_whatever_the_number_of_samples_noise_leans_on_no_input_and_a_slow_part_does(samples: int) -> None:
    time_s = 0.01 * np.arange(samples)
    load = 400.0 + 100.0 * np.sin(np.outer(time_s, [0.31, 1.3, 4.0, 9.0])).sum(axis=1)
    problem = PredictionError(
        prepare([Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=load)])[0],
        Settings(direction="forward", delay_s=0.0),
    )
    theta = np.array([0.5, 0.6, 0.4, 0.0, 0.0])
    noise = np.random.default_rng(samples).standard_normal(samples)
    assert input_independence(problem, theta, [noise]).p_value > 1e-3
    assert input_independence(problem, theta, [noise + 2e-3 * np.gradient(load, 0.01)]).p_value < 1e-6


# -- noise on both signals -------------------------------------------------------------------------------------------
@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_the_curvature_of_a_noisy_problem_is_that_of_its_signals(direction: str) -> None:
    """The noise in the gradient adds to its products, not to what the data tell."""
    load_sd, reading_sd = 4.0, 6.0
    clean, noisy = (
        prepare([press(load_noise=load, reading_noise=reading)])[0]
        for load, reading in ((0.0, 0.0), (load_sd, reading_sd))
    )
    ratio = (reading_sd / load_sd) ** (2 if direction == "inverse" else -2)
    options = Settings(direction=direction, noise_ratio=ratio)
    theta = np.array([*shape_of(*coefficients(*TOE), direction), 0.0, 0.0, 0.0])
    jacobian = PredictionError(clean, options).jacobian(theta)
    expected = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(expected))
    seen = PredictionError(noisy, options).evaluate(theta)
    assert seen.normal / np.outer(scale, scale) == pytest.approx(expected / np.outer(scale, scale), abs=0.1)
    full = PredictionError(noisy, options).jacobian(theta)
    assert np.diag(full.T @ full)[3] > 2.0 * expected[3, 3]  # of the delay far more noise than signal


# -- what a user must be told ----------------------------------------------------------------------------------------
@pytest.mark.parametrize(("delay_s", "is_told"), [(-0.6, True), (0.2, False)])
def test_a_delay_that_ran_to_its_limit_is_told(delay_s: float, is_told: bool) -> None:
    found = identify(press(load_noise=1.0, delay_s=delay_s), initial_state="steady")
    assert any("delay ran to its limit" in note for note in found.notes) is is_told
    if is_told:
        assert found.delay_s.value == pytest.approx(-0.5)


@pytest.mark.parametrize(("a1", "b1", "leads"), [(1.0, 2.0, True), (2.0, 1.0, False)])
def test_a_reading_that_leads_its_load_is_told(a1: float, b1: float, leads: bool) -> None:
    """The filter (s + b1)/(s + a1) of the reading gives the load: a solid's is larger at high frequency."""
    clean = press()
    reading = pressed(([1.0, a1], [1.0, b1]), clean.force_n, 0.01)
    found = identify(Recording.from_arrays(time_s=clean.time_s, force_n=clean.force_n, pressure_mbar=reading), **FIXED)
    assert found.parameters["a1"].value == pytest.approx(a1, rel=0.01)
    assert (found.parameters["k2"].value < 0.0) is leads
    assert any("k2 is negative" in note for note in found.notes) is leads


def test_a_reading_that_turns_as_it_settles_is_no_stable_model() -> None:
    clean = press()
    slow = pressed(([0.5], [1.0, 0.5]), clean.force_n, 0.01)
    reading = clean.force_n - 1.4 * slow
    upside_down = Recording.from_arrays(time_s=clean.time_s, force_n=clean.force_n, pressure_mbar=reading)
    with pytest.raises(NotIdentifiableError, match="no stable model"):
        identify(upside_down, direction="forward", **FIXED)
