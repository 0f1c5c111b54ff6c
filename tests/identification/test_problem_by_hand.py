"""The prediction error with noise on both, its coarse copies and what is told of a fit: by laws and by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import TOE, coefficients, press

from smartshoe.errors import InputError, RefusedError, UsageError
from smartshoe.identification import fit_coefficients, identify
from smartshoe.identification._experiment import Experiment, prepare
from smartshoe.identification._identification import Identification, fit_percent
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.identification._residual_tests import ResidualTest
from smartshoe.identification._whitening import whiten
from smartshoe.models.first_order import simulate

Array = NDArray[np.float64]
A1, B0, B1 = coefficients(*TOE)
THETA = {"inverse": [np.log(A1), B0, B1 / A1], "forward": [np.log(B1 / B0), 1.0 / B0, A1 / B1]}


# -- noise on both ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("delay_s", [0.0, 0.004])
def test_noise_alone_gives_the_gradient_the_products_that_are_foretold(direction: str, delay_s: float) -> None:
    """Of an input of noise of variance r and an output of noise of variance 1, over forty thousand samples."""
    ratio, count, rng = 0.3, 40_000, np.random.default_rng(5)
    u, y = np.sqrt(ratio) * rng.standard_normal(count), rng.standard_normal(count)
    load, reading = (y, u) if direction == "inverse" else (u, y)
    noise = Experiment("noise", 0.01 * np.arange(count), 0.01, load, reading, np.ones(count, dtype=bool), 0)
    options = Settings(direction=direction, noise_ratio=ratio, free_constant=False, offset=0.0, steady=True)  # type: ignore[arg-type]
    problem = PredictionError([noise], options)
    theta = np.array([np.log(2.0), *THETA[direction][1:], delay_s])
    jacobian = problem.jacobian(theta)[500:]
    seen, told = jacobian.T @ jacobian / len(jacobian), problem._noise_of_gradient(theta)
    scale = np.sqrt(np.diag(seen))
    # A product of dependent samples, thousands of them free: some hundredths.
    assert told / np.outer(scale, scale) == pytest.approx(seen / np.outer(scale, scale), abs=0.06)
    assert problem.residual(theta)[500:].var() == pytest.approx(1.0, abs=0.04)


@pytest.fixture(scope="module")
def noisy() -> Experiment:
    (experiment,), _ = prepare([press(load_noise=2.0, reading_noise=1.0, gap=slice(700, 760))])
    return experiment


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_what_noise_adds_to_the_gradients_products_is_taken_off_the_curvature(
    noisy: Experiment, direction: str
) -> None:
    options = Settings(direction=direction, noise_ratio=0.01, delay_s=0.0)  # type: ignore[arg-type]
    problem, theta = PredictionError([noisy], options), np.array([*THETA[direction], 1.0, 2.0])
    residual, jacobian = problem.residual(theta), problem.jacobian(theta)
    seen = problem.evaluate(theta)
    assert seen.cost == pytest.approx(float(residual @ residual))
    assert seen.gradient == pytest.approx(jacobian.T @ residual)
    assert seen.count == residual.size
    products = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(products))
    left = products - seen.cost * problem._noise_of_gradient(theta)
    assert seen.normal / np.outer(scale, scale) == pytest.approx(left / np.outer(scale, scale), abs=1e-9)


def test_of_noise_alone_a_hundredth_of_the_products_is_left_as_curvature() -> None:
    """Where chance has more in the products than what is foretold, so that a step is still of some length."""
    count, rng = 4000, np.random.default_rng(2)
    u, y = np.sqrt(0.3) * rng.standard_normal(count), rng.standard_normal(count)
    noise = Experiment("noise", 0.01 * np.arange(count), 0.01, y, u, np.ones(count, dtype=bool), 0)
    options = Settings(noise_ratio=0.3, free_constant=False, offset=0.0, steady=True)
    problem, theta = PredictionError([noise], options), np.array([np.log(2.0), *THETA["inverse"][1:], 0.0])
    jacobian = problem.jacobian(theta)
    seen = problem.evaluate(theta)
    products = jacobian.T @ jacobian
    root = np.linalg.inv(np.linalg.cholesky(products))
    shares = np.linalg.eigvalsh(root @ (seen.cost * problem._noise_of_gradient(theta)) @ root.T)
    left = np.linalg.eigvalsh(root @ seen.normal @ root.T)
    assert shares.max() > 0.99
    assert left == pytest.approx(np.sort(np.maximum(1.0 - shares, 0.01)), rel=1e-6)


@pytest.mark.parametrize(("samples", "dropped"), [(32, 0), (33, 8), (60, 8)])
def test_of_a_short_recording_the_ends_count(samples: int, dropped: int) -> None:
    time_s = 0.01 * np.arange(samples)
    short = Experiment("short", time_s, 0.01, np.sin(time_s), np.cos(time_s), np.ones(samples, dtype=bool), 0)
    (mask,) = PredictionError([short], Settings()).masks
    assert np.flatnonzero(mask).tolist() == list(range(dropped, samples - dropped))
    assert PredictionError([short], Settings(delay_s=0.01)).count == samples


def test_what_stands_at_a_missing_sample_does_not_matter_behind_the_filter(noisy: Experiment) -> None:
    theta = np.array([*THETA["inverse"], 1.0, 2.0])
    options = Settings(noise_ratio=0.4, delay_s=0.0)
    problem = PredictionError([noisy], options)
    white = problem.whitening(theta)
    assert white is not None
    (mask,) = problem.masks
    error, slopes = problem.error_and_slopes(theta, 0)
    wanted, wanted_slopes = whiten(white, np.where(mask, error, 0.0), np.where(mask, slopes, 0.0))
    residual, jacobian = problem.residual_and_jacobian(theta)
    assert residual == pytest.approx(wanted[mask])
    assert jacobian == pytest.approx(wanted_slopes[:, mask].T)
    other = replace(noisy, load_n=np.where(mask, noisy.load_n, 900.0))
    assert PredictionError([other], options).residual(theta) == pytest.approx(residual, abs=1e-9)


# -- coarse copies -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("share", "of"), [(1.0, 1), (0.51, 1), (0.49, 2), (0.3, 3), (0.18, 5), (0.01, 5)])
def test_a_coarse_copy_is_of_means_no_longer_than_a_twentieth_of_a_second(
    noisy: Experiment, share: float, of: int
) -> None:
    problem = PredictionError([noisy], Settings(delay_s=0.0))
    total = noisy.time_s.size
    coarse = problem.coarse(int(share * total))
    assert coarse.experiments[0].time_s.size == total // of
    assert (coarse is problem) is (of == 1)
    assert problem.coarse(1) is coarse  # it is made once
    slow = replace(noisy, time_s=20.0 * noisy.time_s, step=0.2)
    lone = PredictionError([slow], Settings(delay_s=0.0))
    assert lone.coarse(10) is lone


def test_a_thinned_copy_counts_whole_blocks_and_keeps_what_is_too_short(noisy: Experiment) -> None:
    short = replace(
        noisy, name="b", time_s=noisy.time_s[:9], load_n=noisy.load_n[:9], reading=noisy.reading[:9],
        mask=np.arange(9) > 2,
    )  # fmt: skip
    problem = PredictionError([noisy, short], Settings(delay_s=0.0))
    thinned = problem.thinned(5)
    assert thinned.experiments[1].time_s.size == 9
    assert thinned.masks[1].tolist() == (np.arange(9) > 2).tolist()
    assert np.flatnonzero(~thinned.masks[0]).tolist() == list(range(140, 152))
    assert problem.thinned(1) is problem


# -- what is told ------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def found() -> dict[str, Identification]:
    recording = press(load_noise=1.0, reading_noise=0.3, offset=4.0, load_offset=7.0, name="a")
    known: dict[str, Any] = {"offset": 4.0, "load_offset_n": 7.0, "delay": 0.0, "initial_state": "steady"}
    ways: tuple[Any, ...] = ("inverse", "forward")
    return {way: identify(recording, direction=way, estimator="output_error", **known) for way in ways}


def test_what_is_foretold_has_the_zeros_that_were_given(found: dict[str, Identification]) -> None:
    recording = press(load_noise=1.0, reading_noise=0.3, offset=4.0, load_offset=7.0, name="a")
    a1, b0, b1 = found["inverse"].coefficients
    load = simulate(a1, b0, b1, recording.sensor.values - 4.0, recording.time_s) + 7.0
    assert found["inverse"].predicted("a") == pytest.approx(load, abs=1e-6)
    assert found["inverse"].predicted(recording) == pytest.approx(load, abs=1e-6)
    a1, b0, b1 = found["forward"].coefficients
    reading = simulate(b1 / b0, 1.0 / b0, a1 / b0, recording.force_n - 7.0, recording.time_s) + 4.0
    assert found["forward"].predicted("a") == pytest.approx(reading, abs=1e-6)
    for wrong, says in ((3, "type int"), ("b", "not of this fit"), (recording.between(0.0, 5.0), "samples")):
        with pytest.raises(UsageError, match=says):
            found["inverse"].predicted(wrong)  # type: ignore[arg-type]


def test_a_share_of_what_varies_is_told_for_small_numbers_too_and_for_none_it_is_no_number() -> None:
    y = np.array([0.0, 2.0, 4.0, 2.0])
    assert fit_percent(1e-3 * y, 0.25e-3 * (y - y.mean())) == pytest.approx(75.0)
    assert np.isnan(fit_percent(np.zeros(0), np.zeros(0)))
    assert np.isnan(fit_percent(np.full(3, 7.0), np.ones(3)))


@pytest.mark.parametrize(("p_value", "is_told"), [(0.0099, True), (0.0101, False)])
def test_a_residual_is_said_not_to_be_white_below_one_percent(
    found: dict[str, Identification], p_value: float, is_told: bool
) -> None:
    one = replace(found["inverse"])
    one.__dict__["residual_tests"] = {"whiteness": ResidualTest(9.0, p_value, 20)}
    assert any("not white" in note for note in one.notes) is is_told
    assert one.notes[: len(one.remarks)] == one.remarks


def test_a_filter_is_of_a_hundred_hertz_and_a_grey_box_has_no_consistency(found: dict[str, Identification]) -> None:
    one = found["inverse"]
    assert one.compensator().sample_rate_hz == 100.0
    assert one.compensator(50.0).sample_rate_hz == 50.0
    assert one.discrete(25.0)[0] != pytest.approx(one.discrete()[0])
    grey = replace(one, structure="grey_box")
    with pytest.raises(RefusedError, match="free fit"):
        _ = grey.consistency
    assert grey.to_dict()["consistency"] is None
    wide = replace(one, covariance=1e8 * one.covariance)
    assert wide.correlation == pytest.approx(one.correlation)
    fixed = one.covariance.copy()
    fixed[2], fixed[:, 2] = 0.0, 0.0
    assert replace(one, covariance=fixed).correlation[2].tolist() == [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]


# -- a bank of fits ------------------------------------------------------------------------------------------------
def test_a_bank_has_the_variance_of_its_residual_over_its_degrees() -> None:
    recording = press(load_noise=2.0)
    part = slice(205, 905, 35)
    u, y = recording.sensor.values[part], recording.force_n[part]
    fits = fit_coefficients(u, y, sample_time_s=0.35)
    problem = PredictionError(
        [Experiment("bank", 0.35 * np.arange(u.size), 0.35, y, u, np.ones(u.size, dtype=bool), 0)],
        Settings(free_constant=False, offset=0.0, delay_s=0.0, steady=True),
    )
    a1, b0, b1 = fits.coefficients[0]
    theta = np.array([np.log(a1), b0, b1 / a1])
    residual, jacobian = problem.residual(theta), problem.jacobian(theta)
    cost = float(residual @ residual)
    slope = problem.coefficients(theta)[1]
    wanted = cost / (u.size - 3) * slope @ np.linalg.inv(jacobian.T @ jacobian) @ slope.T
    assert fits.rmse == pytest.approx([np.sqrt(cost / u.size)])
    assert fits.covariance[0] == pytest.approx(wanted, rel=1e-4)
    assert fits.sd[0] == pytest.approx(np.sqrt(np.diag(wanted)), rel=1e-4)


def test_a_bank_pairs_one_row_with_many_and_refuses_what_does_not_pair() -> None:
    recording = press(load_noise=1.0)
    u, y = recording.sensor.values[::5], recording.force_n[::5]
    once = fit_coefficients(u, y, sample_time_s=0.05).coefficients[0]
    for inputs, outputs in ((u, np.stack([y, y])), (np.stack([u, u]), y), (np.stack([u, u]), np.stack([y, y]))):
        for workers in (1, 2):
            many = fit_coefficients(inputs, outputs, sample_time_s=0.05, workers=workers).coefficients
            assert many == pytest.approx(np.stack([once, once]), rel=1e-9)
    twice = np.stack([u, u])
    for inputs, outputs in (
        (twice, np.stack([y, y, y])), (u[:-1], y), (u[:19], y[:19]), (u, np.where(y > 0.0, y, np.nan)),
        (np.where(u > 1.0, u, np.inf), y),
    ):  # fmt: skip
        with pytest.raises(InputError):
            fit_coefficients(inputs, outputs, sample_time_s=0.05)
    for step_s, pole in ((0.0, 1.0), (np.inf, 1.0), (np.nan, 1.0), (0.05, 0.0), (0.05, np.nan), (0.05, np.inf)):
        with pytest.raises(UsageError, match="give positive numbers"):
            fit_coefficients(u, y, sample_time_s=step_s, prefilter_rad_s=pole)
    slower = fit_coefficients(u, y, sample_time_s=2.0, prefilter_rad_s=0.5).coefficients[0]
    assert slower == pytest.approx([once[0] / 40.0, once[1], once[2] / 40.0], rel=1e-3)
