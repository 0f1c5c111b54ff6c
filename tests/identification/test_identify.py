"""Identification: right within its own error bars, by every method, with nothing of the world taken as ideal."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import FIXED, SIX_RATES, TOE, coefficients, press

from smartshoe.errors import NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification import identify
from smartshoe.identification._experiment import prepare
from smartshoe.identification._parametrisation import GREY_FIXED, FreeForm, GreyBox
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.recording import Recording

METHODS = ("srivc", "gn", "lm", "trf")


@given(
    k1=st.floats(0.5, 3.0), k2=st.floats(0.1, 2.0), c=st.floats(0.5, 2.0),
    direction=st.sampled_from(["inverse", "forward"]), seed=st.integers(0, 10_000),
)  # fmt: skip
@settings(max_examples=12, deadline=None)
def test_drawn_parameters_come_back_within_five_sd(k1: float, k2: float, c: float, direction: str, seed: int) -> None:
    noise = {"load_noise": 2.23} if direction == "inverse" else {"reading_noise": 2.23}
    found = identify(press((k1, k2, c), seed=seed, **noise), direction=direction)
    for name, truth in zip(("k1", "k2", "c"), (k1, k2, c), strict=True):
        parameter = found.parameters[name]
        assert abs(parameter.value - truth) < 5 * parameter.sd, name


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("structure", ["free", "grey_box"])
def test_all_prediction_error_methods_end_at_one_optimum(direction: str, structure: str) -> None:
    recording = press(load_noise=2.23, reading_noise=0.5, offset=4.0, delay_s=0.004)
    found = [identify(recording, direction=direction, structure=structure, method=m) for m in METHODS[1:]]
    for other in found[1:]:
        assert other.coefficients == pytest.approx(found[0].coefficients, rel=1e-6)
        assert other.fit_percent == pytest.approx(found[0].fit_percent, rel=1e-9)


def test_srivc_is_as_good_as_its_error_bars() -> None:
    found = identify(press(load_noise=2.23), method="srivc")
    for name, truth in zip(("a1", "b0", "b1"), coefficients(*TOE), strict=True):
        assert abs(found.parameters[name].value - truth) < 5 * found.parameters[name].sd


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("structure", ["free", "grey_box"])
@pytest.mark.parametrize("noise_ratio", [0.0, 0.3])
def test_the_gradient_is_the_difference_quotient(direction: str, structure: str, noise_ratio: float) -> None:
    experiments, _ = prepare([press(load_noise=1.0, offset=3.0), press(load_noise=1.0, seed=1, name="more")])
    form = FreeForm(direction) if structure == "free" else GreyBox(direction, 1.1, GREY_FIXED, {})
    settings_ = Settings(direction=direction, noise_ratio=noise_ratio)
    problem = PredictionError(experiments, settings_, form)
    theta = np.array([-1.3, 1.5, 1.4] if structure == "free" else [1.2, 0.3])
    theta = np.concatenate([theta, [0.003, 2.0, -1.0, 3.0, 5.0]])
    jacobian = problem.jacobian(theta).copy()
    for index in range(theta.size):
        change = np.zeros(theta.size)
        change[index] = 1e-6
        quotient = (problem.residual(theta + change) - problem.residual(theta - change)) / 2e-6
        np.testing.assert_allclose(
            jacobian[:, index], quotient, rtol=0, atol=1e-5 * max(np.max(np.abs(quotient)), 1e-3)
        )


def test_the_papers_triangles_reach_the_known_error_bars() -> None:
    recording = press(load_noise=2.23, rates=SIX_RATES, repeats=3, rest_s=0.0)
    found = identify(recording, **FIXED)
    relative = [100 * found.parameters[name].sd / found.parameters[name].value for name in ("a1", "b0", "b1")]
    assert relative == pytest.approx([0.378, 0.0099, 0.379], rel=0.03)
    grey = identify(recording, structure="grey_box", **FIXED)
    assert 100 * grey.parameters["k1"].sd / grey.parameters["k1"].value == pytest.approx(0.0106, rel=0.04)
    assert 100 * grey.parameters["k2"].sd / grey.parameters["k2"].value == pytest.approx(0.194, rel=0.04)
    assert grey.parameters["c"].value == 1.0
    assert grey.parameters["c"].sd == 0.0


def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    truths = coefficients(*TOE)
    clean = press(rates=(200.0, 800.0), repeats=1)
    rng = np.random.default_rng(5)
    runs, hits = 100, np.zeros(3)
    for _ in range(runs):
        noisy = Recording.from_arrays(
            time_s=clean.time_s,
            force_n=clean.force_n + 2.23 * rng.standard_normal(len(clean)),
            pressure_mbar=clean.sensor.values,
        )
        found = identify(noisy, method="gn")
        bounds = [found.parameters[name].ci95 for name in ("a1", "b0", "b1")]
        hits += [low <= truth <= high for truth, (low, high) in zip(truths, bounds, strict=True)]
    # Binomial(100, 0.95): 86 to 100 holds all but 3e-4 of the cases.
    assert (hits >= 86).all(), hits


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_offset_half_a_sample_of_delay_and_a_start_in_mid_ramp_do_not_bias(direction: str) -> None:
    noise = {"load_noise": 0.5} if direction == "inverse" else {"reading_noise": 0.5}
    found = identify(press(offset=8.0, delay_s=0.005, start_s=5.0, **noise), direction=direction)
    assert abs(found.parameters["a1"].value - TOE[1]) < 4 * found.parameters["a1"].sd
    assert found.delay_s.value == pytest.approx(0.005, abs=2e-4)
    assert found.offsets["triangles"].value == pytest.approx(8.0, abs=5 * found.offsets["triangles"].sd + 0.05)


@pytest.mark.parametrize("delay_s", [-0.3, 0.2])
def test_logs_that_are_tenths_of_a_second_apart_are_aligned(delay_s: float) -> None:
    found = identify(press(load_noise=1.0, delay_s=delay_s))
    assert found.delay_s.value == pytest.approx(delay_s, abs=1e-3)


def test_a_gap_neither_spreads_nor_biases() -> None:
    found = identify(press(load_noise=1.0, gap=slice(1400, 1460)))
    assert found.n_missing == 60
    assert np.isfinite(found.covariance).all()
    assert abs(found.parameters["b0"].value - coefficients(*TOE)[1]) < 5 * found.parameters["b0"].sd


def test_several_recordings_have_each_their_own_zero() -> None:
    found = identify([press(load_noise=1.0, offset=2.0), press(load_noise=1.0, offset=6.0, seed=1)])
    assert list(found.offsets) == ["triangles", "triangles (2)"]
    assert [zero.value for zero in found.offsets.values()] == pytest.approx([2.0, 6.0], abs=0.5)


def test_a_static_load_comes_out_without_bias() -> None:
    found = identify(press(load_noise=0.5, offset=3.0))
    static = coefficients(*TOE)[2] / coefficients(*TOE)[0]
    force_n = found.compensator().apply(np.full(200, 3.0 + 500.0 / static))
    assert force_n == pytest.approx(500.0, abs=1.0)


def test_effective_area_scales_to_the_papers_units() -> None:
    plain = press(load_noise=1.0)
    area_m2 = 2.5e-4  # 0.025 N per mbar
    scaled = Recording.from_arrays(
        time_s=plain.time_s,
        force_n=plain.force_n,
        pressure_mbar=plain.sensor.values / (area_m2 * 100),
        metadata={"effective_area_m2": str(area_m2)},
    )
    found, reference = identify(scaled), identify(plain)
    assert found.scale == pytest.approx(0.025)
    for name in ("k1", "k2", "c"):
        assert found.parameters[name].value == pytest.approx(reference.parameters[name].value, rel=1e-4)
    grey = identify(scaled, structure="grey_box", scale="estimate")
    assert grey.scale == pytest.approx(0.025, rel=0.1)


def test_to_dict_has_the_contracts_keys_and_no_nan() -> None:
    found = identify(press(load_noise=1.0), method="lm")
    written = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    keys = (
        "schema unit direction method parameters offsets delay_s correlation fit_percent rmse iterations converged"
        " residual_tests discrete"
    )
    assert list(written)[:14] == keys.split()
    assert written["unit"] == "left_toe"
    assert list(written["parameters"]) == ["a1", "b0", "b1", "k1", "k2", "c"] == written["correlation"]["names"]
    assert written["parameters"]["b0"]["unit"] == "N/mbar"
    assert written["discrete"]["sample_rate_hz"] == 100
    assert found.calibration().compensator().offset == found.offset


def test_residual_tests_tell_white_from_coloured() -> None:
    white = identify(press(load_noise=2.0))
    assert white.residual_tests["whiteness"].p_value > 1e-3
    assert white.residual_tests["input_independence"].p_value > 1e-3
    clean = press()
    squared = Recording.from_arrays(
        time_s=clean.time_s,
        force_n=clean.force_n + 1e-4 * clean.force_n**2 + np.random.default_rng(0).standard_normal(len(clean)),
        pressure_mbar=clean.sensor.values,
    )
    bent = identify(squared)
    assert bent.residual_tests["whiteness"].p_value < 1e-6
    assert any("not white" in note for note in bent.notes)


TIME = np.arange(1000) / 100
HUMP = 800 * np.sin(np.pi * TIME / 10)


@pytest.mark.parametrize(
    ("force_n", "pressure", "says"),
    [
        (np.full(1000, 5.0), HUMP, "load is constant"),
        (HUMP, np.full(1000, 5.0), "reading is constant"),
        (80 * TIME, 50 * TIME, "no return"),
        (HUMP, np.where(TIME < 0.1, HUMP, np.nan), "samples"),
        (
            400 + np.random.default_rng(0).standard_normal(1000),
            np.random.default_rng(1).standard_normal(1000),
            "follow",
        ),
        (HUMP + np.random.default_rng(2).standard_normal(1000), HUMP, "relaxation"),
    ],
)
def test_data_that_cannot_hold_the_answer_are_refused(force_n: np.ndarray, pressure: np.ndarray, says: str) -> None:
    recording = Recording.from_arrays(time_s=TIME, force_n=force_n, pressure_mbar=pressure)
    with pytest.raises(NotIdentifiableError, match=says):
        identify(recording)


def test_an_unsettled_fit_is_refused_unless_asked_for() -> None:
    recording = press(load_noise=2.0, offset=5.0, delay_s=0.02)
    with pytest.raises(NotConvergedError, match="1 iterations"):
        identify(recording, method="gn", max_iterations=1)
    assert not identify(recording, method="gn", max_iterations=1, strict=False).converged


@pytest.mark.parametrize(
    "wrong", [{"method": "ols"}, {"direction": "up"}, {"delay": 3.0}, {"scale": "estimate"}, {"prefilter_rad_s": -1.0}]
)
def test_wrong_choices_are_named(wrong: dict[str, object]) -> None:
    with pytest.raises(UsageError, match=next(iter(wrong))):
        identify(press(), **wrong)


def test_the_calibrated_rates_are_the_triangles_however_short_the_fast_ones() -> None:
    found = identify(press(load_noise=0.05, rates=SIX_RATES))
    assert found.rate_range_n_per_s == pytest.approx((min(SIX_RATES), max(SIX_RATES)), rel=0.05)
