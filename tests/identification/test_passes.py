"""The compiled passes against their slow twins, the solvers against each other and the bank against identify."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import FIXED, coefficients, press
from scipy.optimize import least_squares

from smartshoe.errors import InputError, UsageError
from smartshoe.identification import fit_coefficients, identify
from smartshoe.identification._experiment import prepare
from smartshoe.identification._parametrisation import GREY_FIXED, FreeForm, GreyBox
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._residual_tests import residual_tests
from smartshoe.identification._solve import Evaluation, minimise
from smartshoe.identification._uncertainty import inverse_normal
from smartshoe.recording import Recording


@given(
    alpha=st.floats(0.02, 60.0), p1=st.floats(-3.0, 3.0), p2=st.floats(0.2, 3.0), delay_s=st.floats(-0.1, 0.1),
    constant=st.floats(-20, 20), state=st.floats(-20, 20), even=st.booleans(), gaps=st.booleans(),
    direction=st.sampled_from(["inverse", "forward"]), structure=st.sampled_from(["free", "grey_box"]),
    nuisances=st.tuples(st.booleans(), st.booleans(), st.booleans()), samples=st.integers(60, 900),
)  # fmt: skip
@settings(max_examples=60)
def test_the_pass_gives_what_the_stored_residual_gives(
    alpha, p1, p2, delay_s, constant, state, even, gaps, direction, structure, nuisances, samples
) -> None:
    rng = np.random.default_rng(samples)
    steps = np.full(samples, 0.01) if even else rng.uniform(0.004, 0.03, samples)
    load = 400 - 400 * np.cos(12 * np.cumsum(steps)) + rng.standard_normal(samples)
    reading = 0.6 * load + rng.standard_normal(samples)
    if gaps:
        reading[20:27] = np.nan
    recordings = [
        Recording.from_arrays(time_s=np.cumsum(steps), force_n=load, pressure_mbar=reading, name=name) for name in "ab"
    ]
    free_constant, free_state, free_delay = nuisances
    settings_ = Settings(
        direction=direction,
        offset=None if free_constant else 1.5,
        free_constant=free_constant,
        delay_s=None if free_delay else delay_s,
        steady=not free_state,
    )
    form = FreeForm(direction) if structure == "free" else GreyBox(direction, 1.3, GREY_FIXED, {})
    problem = PredictionError(prepare(recordings)[0], settings_, form)
    shape = [np.log(alpha), p1, p2] if structure == "free" else [p2, alpha]
    theta = np.array(
        shape + [delay_s] * free_delay + [constant, -constant] * free_constant + [state, -state] * free_state
    )
    seen = problem.evaluate(theta)
    residual, jacobian = problem.residual_and_jacobian(theta)
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian)) + 1e-30
    assert seen.count == residual.size
    assert seen.cost == pytest.approx(residual @ residual, rel=1e-9)
    assert seen.normal / np.outer(scale, scale) == pytest.approx(
        jacobian.T @ jacobian / np.outer(scale, scale), abs=1e-9
    )
    assert seen.gradient / scale == pytest.approx(jacobian.T @ residual / scale, abs=1e-8 * np.sqrt(seen.cost))
    for level in (problem, problem.thinned(3)):  # whose time does not begin at 0
        error, slopes = level.error_and_slopes(theta, 1)
        stored_error, stored_slopes = level.model_error_and_slopes(theta, 1)
        size = np.max(np.abs(slopes), axis=1, keepdims=True) + 1e-30
        np.testing.assert_allclose(stored_slopes / size, slopes / size, rtol=0, atol=1e-9)
        np.testing.assert_allclose(stored_error, error, rtol=0, atol=1e-9 * np.max(np.abs(error)))
        np.testing.assert_allclose(level.model_error(theta, 1), error, rtol=0, atol=1e-9 * np.max(np.abs(error)))


class _Rosenbrock:
    """Residuals 10 (x1 - x0^2) and 1 - x0: a curved valley, minimum 0 at (1, 1) unless a bound is in the way."""

    size = 2

    def __init__(self, lower: float = -np.inf, upper: float = np.inf) -> None:
        self.lower, self.upper = np.array([lower, -np.inf]), np.array([upper, np.inf])

    @staticmethod
    def residual(x: np.ndarray) -> np.ndarray:
        return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])

    @staticmethod
    def jacobian(x: np.ndarray) -> np.ndarray:
        return np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])

    def evaluate(self, x: np.ndarray) -> Evaluation:
        e, j = self.residual(x), self.jacobian(x)
        return Evaluation(float(e @ e), j.T @ e, j.T @ j, 2)


@pytest.mark.parametrize("method", ["gn", "lm", "trf"])
@pytest.mark.parametrize("bounds", [(-np.inf, np.inf), (-np.inf, 0.5), (-2.0, 0.25)])
def test_the_solvers_find_scipys_optimum(method: str, bounds: tuple[float, float]) -> None:
    problem = _Rosenbrock(*bounds)
    found = minimise(problem, np.array([-1.2, 1.0]), method, tolerance=1e-12, max_iterations=500)
    reference = least_squares(
        problem.residual, [-1.2, 1.0], problem.jacobian, bounds=(problem.lower, problem.upper), xtol=1e-14, ftol=1e-14
    )
    assert found.converged
    assert found.theta == pytest.approx(reference.x, abs=1e-5)


def test_scipys_optimum_of_the_papers_problem_is_ours() -> None:
    recording = press(load_noise=2.23)
    problem = PredictionError(prepare([recording])[0], Settings())
    found = identify(recording, estimator="output_error")
    theta = found.fit.theta
    reference = least_squares(problem.residual, theta * 1.05, problem.jacobian, x_scale="jac", xtol=1e-15, ftol=1e-15)
    sd = np.sqrt(np.diag(found.fit.covariance))
    assert (theta - reference.x) / sd == pytest.approx(0.0, abs=1e-3)


def test_a_residual_of_nothing_is_white_and_leans_on_no_input() -> None:
    """Of a recording that its model follows exactly the tests have nothing to say, and no number that is none."""
    recording = press()
    problem = PredictionError(prepare([recording])[0], Settings())
    theta = identify(recording).fit.theta
    for test in residual_tests(problem, theta, [np.zeros(len(recording))]).values():
        assert (test.statistic, test.p_value) == (0.0, 1.0)
        assert test.degrees > 0
    # The tests judge what stands out, not how large it is.
    noise = np.random.default_rng(2).standard_normal(len(recording))
    for one, other in zip(*(residual_tests(problem, theta, [by * noise]).values() for by in (1e-6, 1e3)), strict=True):
        assert one.statistic == pytest.approx(other.statistic, rel=1e-6)
        assert 1e-3 < one.p_value <= 1.0


@given(st.integers(1, 6), st.integers(0, 999), st.floats(1e-9, 1e9))
@settings(max_examples=20)
def test_covariances_are_inverses_in_any_units_and_what_no_data_holds_is_told(
    size: int, seed: int, unit: float
) -> None:
    rng = np.random.default_rng(seed)
    slopes = rng.standard_normal((40, size)) * unit ** rng.uniform(-1.0, 1.0, size)
    inverse, is_singular = inverse_normal(slopes.T @ slopes)
    assert not is_singular
    scale = np.sqrt(np.einsum("ij,ij->j", slopes, slopes))
    np.testing.assert_allclose(
        inverse * np.outer(scale, scale), np.linalg.inv((slopes / scale).T @ (slopes / scale)), rtol=1e-6, atol=1e-9
    )
    # A column that the others give, or that is nothing, is held by no data; what is left stays finite.
    for column in (slopes @ rng.uniform(0.5, 1.5, size) / unit, np.zeros(40)):
        wide = np.column_stack([slopes, column])
        again, is_singular = inverse_normal(wide.T @ wide)
        assert is_singular
        assert np.isfinite(again).all()


def test_a_bank_of_fits_is_identify_many_times() -> None:
    from smartshoe.kernels.coefficients import fit_coefficients as compiled

    clean = press()
    rng = np.random.default_rng(7)
    loads = clean.force_n + 2.0 * rng.standard_normal((5, len(clean)))
    many = fit_coefficients(clean.sensor.values, loads, sample_time_s=0.01)
    threads = fit_coefficients(clean.sensor.values, loads, sample_time_s=0.01, workers=2)
    assert (many.coefficients == threads.coefficients).all()
    assert not clean.force_n.flags.writeable
    frozen, own = (
        fit_coefficients(clean.sensor.values, load, sample_time_s=0.01) for load in (clean.force_n, loads[0])
    )
    assert frozen.converged.all()
    assert own.coefficients[0] == pytest.approx(many.coefficients[0], rel=1e-12)
    assert len(compiled.signatures) == 1  # what cannot be written to is not compiled anew
    for row, load in enumerate(loads):
        single = identify(
            Recording.from_arrays(time_s=clean.time_s, force_n=load, pressure_mbar=clean.sensor.values),
            estimator="output_error",
            **FIXED,
        )
        assert many.converged[row]
        assert many.coefficients[row] == pytest.approx(single.coefficients, rel=1e-6)
        assert many.covariance[row] == pytest.approx(single.covariance[:3, :3], rel=1e-3)
        assert many.rmse[row] == pytest.approx(single.rmse, rel=1e-9)


@given(k1=st.floats(0.3, 4.0), k2=st.floats(0.02, 3.0), c=st.floats(0.3, 3.0))
@settings(max_examples=15)
def test_a_bank_finds_any_solid(k1: float, k2: float, c: float) -> None:
    recording = press((k1, k2, c))
    found = fit_coefficients(recording.sensor.values, recording.force_n, sample_time_s=0.01)
    # The corners of the 1 kHz plant between two samples leave a thousandth of a newton, not the fit.
    assert found.coefficients[0] == pytest.approx(coefficients(k1, k2, c), rel=2e-3)


@pytest.mark.parametrize(
    ("inputs", "outputs", "error"),
    [
        (np.ones((2, 30)), np.ones((3, 30)), InputError),
        (np.ones(30), np.full(30, np.nan), InputError),
        (np.ones(10), np.ones(10), InputError),
    ],
)
def test_a_bank_names_what_does_not_pair(inputs: np.ndarray, outputs: np.ndarray, error: type[Exception]) -> None:
    with pytest.raises(error):
        fit_coefficients(inputs, outputs, sample_time_s=0.01)
    with pytest.raises(UsageError):
        fit_coefficients(np.ones(30), np.ones(30), sample_time_s=-1.0)


def test_left_out_samples_do_not_count_but_are_foretold() -> None:
    recording = press(load_noise=1.0)
    counted = recording.time_s < 20.0
    found = identify(recording, counted={"triangles": counted}, **FIXED)
    assert found.n_samples == np.count_nonzero(counted)
    assert found.errors["triangles"].size == len(recording)
    assert np.isnan(found.residuals["triangles"][~counted]).all()
    assert np.sqrt(np.mean(found.errors["triangles"][~counted] ** 2)) == pytest.approx(1.0, rel=0.2)
    with pytest.raises(UsageError, match="nobody"):
        identify(recording, counted={"nobody": counted})


def test_a_loose_pole_gets_the_profile_of_its_likelihood() -> None:
    """One short press: the interval of a1 is lopsided, and at its ends the cost has risen by t^2 variances."""
    recording = press(load_noise=8.0, rates=(800.0,), repeats=1, rest_s=3.0)
    found = identify(recording, **FIXED)
    a1 = found.parameters["a1"]
    assert a1.sd > 0.1 * a1.value
    low, high = a1.ci95
    assert high - a1.value != pytest.approx(a1.value - low, rel=1e-3)
    residual = found.fit.problem.residual
    for end in (low, high):
        # The cost with a1 held at the end and everything else free again, by scipy.
        at = least_squares(
            lambda rest, end=end: residual(np.array([np.log(end), *rest])), found.fit.theta[1:], xtol=1e-12
        )
        assert 2 * at.cost - found.fit.cost == pytest.approx(1.96**2 * found.fit.variance, rel=0.05)


def test_rows_that_a_logger_skipped_are_samples_that_do_not_count() -> None:
    whole = press(load_noise=1.0, offset=3.0, delay_s=0.004)
    skipped = np.random.default_rng(3).random(len(whole)) < 0.1
    skipped[[0, -1]] = False
    fewer = whole.taken(~skipped)
    marked = Recording.from_arrays(
        time_s=whole.time_s,
        force_n=np.where(skipped, np.nan, whole.force_n),
        pressure_mbar=np.where(skipped, np.nan, whole.sensor.values),
        name="triangles",
    )
    left_out, missing = identify(fewer), identify(marked)
    for name in ("a1", "b0", "b1"):
        assert left_out.parameters[name].value == pytest.approx(missing.parameters[name].value, rel=1e-6)
    assert left_out.errors["triangles"].size == len(fewer)
    assert left_out.n_missing == 0
