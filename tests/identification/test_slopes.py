"""Derivatives are those that differences show, and spectra those of the responses: the ground of every error bar."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from presses import TOE, coefficients, press

from smartshoe.identification import identify
from smartshoe.identification._conclude import Choice, _offsets, _parameters, solid_of
from smartshoe.identification._noise import _answer, input_noise_bias
from smartshoe.identification._parametrisation import FreeForm, GreyBox, Shape, coefficients_of
from smartshoe.identification._residual_tests import whiteness
from smartshoe.identification._whitening import Whitening, whiten, whitened, whitening
from smartshoe.models.first_order import interpolation_gain, simulate
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]


def differences(function: Callable[[Array], Array], at: Array, share: float = 1e-6) -> Array:
    """The derivative (..., k) of ``function`` at ``at`` (k,) by central differences."""
    steps = share * np.maximum(np.abs(at), 1e-3)
    columns = []
    for index, step in enumerate(steps):
        ahead, behind = at.copy(), at.copy()
        ahead[index] += step
        behind[index] -= step
        columns.append((np.asarray(function(ahead)) - np.asarray(function(behind))) / (2.0 * step))
    return np.stack(columns, axis=-1)


# -- the filter behind which noise on both is white ---------------------------------------------------------------
STEP_S = 0.01
# ln alpha, p1, p2, and the ratio of the noises' variances.
RESPONSES = st.tuples(st.floats(-0.5, 3.0), st.floats(-3.0, 3.0), st.floats(0.3, 12.0), st.floats(1e-3, 10.0)).map(
    np.array
)


def _white(theta: Array) -> Whitening:
    shape = Shape(float(np.exp(theta[0])), float(theta[1]), float(theta[2]), np.eye(3))
    return whitening(shape, np.eye(3, 4), STEP_S, float(theta[3]), np.array([0.0, 0.0, 0.0, 1.0]))


@settings(max_examples=20)
@given(RESPONSES)
def test_the_whitening_filter_has_the_spectrum_of_the_error(theta: Array) -> None:
    white, alpha = _white(theta), float(np.exp(theta[0]))
    count = round(40.0 / alpha / STEP_S) + 20
    impulse = np.zeros(count)
    impulse[1] = 1.0
    answer = simulate(alpha, theta[1], theta[2] * alpha, impulse, STEP_S * np.arange(count), "rest")
    for turn in (0.0, 0.1, 1.0, 2.5, np.pi):
        z = np.exp(-1j * turn)
        power = np.abs(np.sum(answer * z ** np.arange(count))) ** 2
        shown = white.deviation**2 * abs(1.0 - white.zero * z) ** 2 / abs(1.0 - white.pole * z) ** 2
        assert shown == pytest.approx(1.0 + theta[3] * power, rel=1e-6)
    assert abs(white.zero) < 1.0


@settings(max_examples=20)
@given(RESPONSES)
def test_the_whitening_filters_slopes_are_those_of_differences(theta: Array) -> None:
    white = _white(theta)
    wanted = differences(lambda at: np.array([_white(at).pole, _white(at).zero, _white(at).deviation]), theta)
    size = 1.0 + np.abs(wanted)
    for row, own in enumerate((white.pole_slope, white.zero_slope, white.deviation_slope)):
        assert np.abs(own - wanted[row]).max() < 1e-5 * size[row].max()


def test_a_whitened_error_moves_as_its_slopes_say() -> None:
    rng = np.random.default_rng(3)
    theta, plain, jacobian = np.array([0.5, 1.2, 4.0, 0.7]), rng.standard_normal(60), rng.standard_normal((4, 60))

    def error(at: Array) -> Array:
        return plain + (at - theta) @ jacobian

    found, slopes = whiten(_white(theta), error(theta), jacobian)
    assert found == pytest.approx(whitened(_white(theta), plain), abs=1e-12)
    wanted = differences(lambda at: whitened(_white(at), error(at)), theta)
    assert np.abs(slopes.T - wanted).max() < 1e-6


def test_noise_on_both_is_white_behind_the_filter() -> None:
    rng, count, theta = np.random.default_rng(4), 20_000, np.array([1.0, 0.5, 3.0, 0.25])
    alpha = float(np.exp(theta[0]))
    noise = np.sqrt(theta[3]) * rng.standard_normal(count)
    error = simulate(alpha, theta[1], theta[2] * alpha, noise, STEP_S * np.arange(count)) - rng.standard_normal(count)
    white = whitened(_white(theta), error)[500:]
    assert white.var() == pytest.approx(1.0, abs=0.05)  # of 19,500: an sd of 0.01
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.03


# -- from theta to what is told -----------------------------------------------------------------------------------
@pytest.mark.parametrize("newtons", [None, 1.3])
def test_the_solid_of_the_coefficients_is_the_one_that_made_them(newtons: float | None) -> None:
    scale = 2.5 if newtons is None else newtons
    k1, k2, c = TOE if newtons is None else (TOE[0], TOE[1], 0.7)
    a1, b0, b1 = coefficients(k1, k2, c)
    at = np.array([a1, scale * b0, scale * b1])
    solid, slope, found = solid_of(at, newtons)
    assert solid == pytest.approx([k1, k2, c])
    assert found == pytest.approx(scale)
    assert slope == pytest.approx(differences(lambda other: solid_of(other, newtons)[0], at), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_coefficients_move_as_their_slopes_say(direction: str) -> None:
    form = FreeForm(direction)  # type: ignore[arg-type]
    theta = form.from_coefficients(*coefficients(*TOE))
    values, slope = coefficients_of(form.shape(theta), direction)  # type: ignore[arg-type]
    assert values == pytest.approx(coefficients(*TOE))
    assert slope == pytest.approx(differences(lambda at: form.coefficients(at)[0], theta), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("fixed", [{"c": 1.0}, {"x_over_nrt": 0.4}, {"k1": 1.2}])
def test_a_grey_boxs_shape_and_coefficients_move_as_their_slopes_say(direction: str, fixed: dict[str, float]) -> None:
    form = GreyBox(direction, 1.7, fixed, {})  # type: ignore[arg-type]
    theta = np.array([{"k1": 1.341, "k2": 0.215, "c": 0.8, "x_over_nrt": 0.38}[name] for name in form.names])
    values, slope = form.coefficients(theta)
    assert slope == pytest.approx(differences(lambda at: form.coefficients(at)[0], theta), rel=1e-6, abs=1e-8)
    if "c" not in fixed:
        assert form.coefficients(form.from_coefficients(*values))[0] == pytest.approx(values)

    def shape(at: Array) -> Array:
        found = form.shape(at)
        return np.array([np.log(found.alpha), found.p1, found.p2])

    assert form.shape(theta).slope == pytest.approx(differences(shape, theta), rel=1e-6, abs=1e-8)


@pytest.fixture(scope="module")
def found():  # type: ignore[no-untyped-def]
    """Two recordings fitted together, each direction: constants and states of their own."""
    both = [press(load_noise=2.0, reading_noise=0.3, offset=3.0, rates=(200.0, 800.0), repeats=1, name="first")]
    both += [press(load_noise=2.0, reading_noise=0.3, offset=5.0, rates=(400.0,), repeats=1, seed=1, name="second")]
    ways = ("inverse", "forward")
    return {
        way: identify(both, direction=way, estimator="output_error", initial_state="estimate", delay="estimate")
        for way in ways
    }


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("load_zero_free", [False, True])
def test_zeros_and_their_errors_are_carried_from_the_fit(found, direction: str, load_zero_free: bool) -> None:  # type: ignore[no-untyped-def]
    fit = found[direction].fit
    choice = Choice("toe", "gn", "free", MILLIBAR, None, load_zero_free, ())

    def zeros(theta: Array):  # type: ignore[no-untyped-def]
        values, slope, _ = _parameters(replace(fit, theta=theta), choice)
        return _offsets(replace(fit, theta=theta), choice, float(values[2] / values[0]), slope, 1.96)

    told = zeros(fit.theta)[load_zero_free]
    moves = differences(lambda at: np.array([one.value for one in zeros(at)[load_zero_free].values()]), fit.theta)
    wanted = np.sqrt(np.einsum("ij,jk,ik->i", moves, fit.covariance, moves))
    assert [one.sd for one in told.values()] == pytest.approx(wanted, rel=1e-4)
    # A reading of 3 and 5 mbar at rest is a load of minus as much times the static gain.
    gain = coefficients(*TOE)[2] / coefficients(*TOE)[0]
    true = [-3.0 * gain, -5.0 * gain] if load_zero_free else [3.0, 5.0]
    for one, value in zip(told.values(), true, strict=True):
        assert abs(one.value - value) < 4.0 * one.sd
    assert all(one.value == 0.0 == one.sd for one in zeros(fit.theta)[not load_zero_free].values())


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_each_recordings_state_has_its_own_error(found, direction: str) -> None:  # type: ignore[no-untyped-def]
    fit = found[direction].fit
    for index, one in enumerate(found[direction].initial_states.values()):
        move = differences(lambda at, own=index: np.array([fit.problem.state(at, own)]), fit.theta)[0]
        assert one.value == pytest.approx(fit.problem.state(fit.theta, index))
        assert one.sd == pytest.approx(np.sqrt(move @ fit.covariance @ move), rel=1e-6)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_every_told_parameter_moves_as_its_slope_says(found, direction: str) -> None:  # type: ignore[no-untyped-def]
    fit = found[direction].fit
    for newtons in (None, 1.1):
        choice = Choice("toe", "gn", "free", MILLIBAR, newtons, False, ())
        values, slope, _ = _parameters(fit, choice)
        wanted = differences(lambda at, own=choice: _parameters(fit, own, at)[0], fit.theta)
        assert slope == pytest.approx(wanted, rel=1e-4, abs=1e-5 * np.abs(values).max())


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_the_bias_of_noise_on_the_input_is_the_slope_of_the_power_that_it_adds(found, direction: str) -> None:  # type: ignore[no-untyped-def]
    fit = found[direction].fit
    problem, theta, normal = fit.problem, fit.theta, fit.evaluation.normal
    first = problem.experiments[0]

    def power(at: Array) -> Array:
        gain = interpolation_gain(problem.delay_s(at), first.time_s, first.step)[0]
        return np.array([gain * _answer(problem, at)[1]])

    push = 0.5 * problem.count * 0.3**2 * differences(power, theta, 1e-5)[0]
    assert input_noise_bias(problem, theta, normal, 0.3) == pytest.approx(
        -np.linalg.solve(normal, push), rel=1e-3, abs=1e-9
    )


# -- what the residual still holds -----------------------------------------------------------------------------
def test_whiteness_is_ljung_and_boxs_statistic_of_the_pairs_that_are_there() -> None:
    rng = np.random.default_rng(6)
    series = [rng.standard_normal(400), rng.standard_normal(300)]
    kept = [rng.random(400) > 0.1, np.ones(300, dtype=bool)]
    total = sum(int(mask.sum()) for mask in kept)
    zeroed = [np.where(mask, one, 0.0) for one, mask in zip(series, kept, strict=True)]
    power, wanted = sum(float(one @ one) for one in zeroed), 0.0
    for lag in range(1, 21):
        pairs = sum(int((mask[lag:] & mask[:-lag]).sum()) for mask in kept)
        product = sum(float(one[lag:] @ one[:-lag]) for one in zeroed)
        wanted += (total * product / power) ** 2 / pairs
    found = whiteness(series, kept)
    assert found.statistic == pytest.approx(wanted)
    assert found.degrees == 20
    assert 1e-3 < found.p_value < 1.0 - 1e-3


def test_white_residuals_lean_on_the_input_as_often_as_chance_has_it_and_a_slow_one_does_always() -> None:
    told = [identify(press(load_noise=2.0, seed=seed)).residual_tests["input_independence"] for seed in range(12)]
    p_values = np.array([test.p_value for test in told])
    # Uniform: of twelve the mean is 0.5 with an sd of 0.08, and one below 0.002 comes once in forty runs.
    assert 0.2 < p_values.mean() < 0.8
    assert p_values.min() > 2e-3
    assert {test.degrees for test in told} == {7}  # of ten lags, those that means of some samples tell apart
    clean = press()
    creeping = replace_load(clean, 0.1 * simulate(0.05, 0.0, 0.05, clean.force_n, clean.time_s))
    assert identify(creeping).residual_tests["input_independence"].p_value < 1e-6


def replace_load(clean, more_n: Array):  # type: ignore[no-untyped-def]
    """The recording with ``more_n`` (n,) and white noise of 2 N on its load."""
    noise = 2.0 * np.random.default_rng(0).standard_normal(len(clean))
    return type(clean).from_arrays(
        time_s=clean.time_s, force_n=clean.force_n + more_n + noise, pressure_mbar=clean.sensor.values
    )
