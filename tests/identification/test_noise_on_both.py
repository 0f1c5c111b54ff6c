"""Errors in variables: noise on the input does not bias, whichever way it is allowed for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import FIXED, SIX_RATES, TOE, coefficients, press

from smartshoe.errors import RefusedError, UsageError
from smartshoe.identification import identify
from smartshoe.recording import Recording
from smartshoe.signals.noise import white_noise_sd

A1 = TOE[1]


def many(estimator: str, direction: str, reading_noise: float, load_noise: float = 2.23, runs: int = 24):
    clean = press(rates=SIX_RATES, repeats=2, rest_s=1.0, command=True)
    found = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        noisy = Recording.from_arrays(
            time_s=clean.time_s,
            force_n=clean.force_n + load_noise * rng.standard_normal(len(clean)),
            pressure_mbar=clean.sensor.values + reading_noise * rng.standard_normal(len(clean)),
            command_n=clean.command_n,
        )
        found.append(identify(noisy, direction=direction, estimator=estimator, **FIXED).parameters["a1"])
    return np.array([parameter.value for parameter in found]), np.array([parameter.sd for parameter in found])


@pytest.mark.parametrize(
    ("estimator", "direction"),
    [("errors_in_variables", "inverse"), ("errors_in_variables", "forward"), ("command", "inverse")],
)
def test_two_percent_of_noise_on_the_reading_does_not_bias(estimator: str, direction: str) -> None:
    values, sds = many(estimator, direction, reading_noise=10.0)
    # The mean of 24 is 5 standard errors from the truth once in two million; a plain inverse fit is 25 away.
    assert abs(values.mean() - A1) < 5 * sds.mean() / np.sqrt(values.size)
    # Chi-square of 23 degrees: 0.6 to 1.5 holds all but 1e-3 of the spreads.
    assert 0.6 < values.std(ddof=1) / sds.mean() < 1.5


def test_a_plain_inverse_fit_is_biased_as_foretold_and_warned_of() -> None:
    noisy = press(rates=SIX_RATES, repeats=3, rest_s=0.0, load_noise=2.23, reading_noise=10.4, command=True)
    found = identify(noisy, estimator="output_error", **FIXED)
    assert found.parameters["a1"].value < 0.9 * A1
    warning = next(note for note in found.notes if "noisy as well" in note)
    # The warning's figure is the bias itself: known from theory, -17 % for 2 % of full scale.
    foretold = float(warning.split("move a1 by ")[1].split(" %")[0])
    assert 100 * (found.parameters["a1"].value / A1 - 1) == pytest.approx(foretold, abs=6.0)


def test_auto_stays_with_the_plain_fit_where_the_input_is_exact() -> None:
    found = identify(press(load_noise=2.23))
    assert found.estimator == "output_error"
    assert not any("noisy as well" in note for note in found.notes)


@pytest.mark.parametrize("counts", [0.2, 0.3, 0.4])
def test_counts_that_are_coarse_beside_their_noise_are_noise_themselves(counts: float) -> None:
    """Of 200 counts a span a part of a count hardly shows: a plain fit, which takes them for exact, is far off."""
    clean = press(rates=(31.0, 125.0, 250.0, 500.0), repeats=2, rest_s=10.0)
    count = np.ptp(clean.sensor.values) / 200.0
    read = clean.sensor.values + counts * count * np.random.default_rng(0).standard_normal(len(clean))
    coarse = clean.with_channel(clean.sensor.with_values(count * np.round(read / count)))
    auto, plain = identify(coarse), identify(coarse, estimator="output_error")
    assert (auto.estimator, plain.estimator) == ("errors_in_variables", "output_error")
    off, plainly_off = (abs(one.parameters["a1"].value - A1) / one.parameters["a1"].sd for one in (auto, plain))
    assert off < 3.0  # errors of a grid are not quite white
    assert plainly_off > 10.0


@given(sd=st.floats(0.3, 5.0), wild=st.integers(0, 30), seed=st.integers(0, 1000))
@settings(max_examples=25)
def test_noise_of_parts_of_a_step_is_measured_through_ramps_and_wild_values(sd: float, wild: int, seed: int) -> None:
    """Rounding adds step/sqrt(12) to it (Widrow 1956), and is not white below a third of a step."""
    rng = np.random.default_rng(seed)
    smooth = 100.0 * np.abs(np.linspace(-2.0, 2.0, 6000) % 2.0 - 1.0)
    counts = np.round(smooth + sd * rng.standard_normal(smooth.size))
    counts[rng.choice(counts.size, wild, replace=False)] += 500.0
    truth = np.hypot(sd, 1.0 / np.sqrt(12.0))
    assert white_noise_sd(counts, order=3, step=1.0) == pytest.approx(truth, rel=0.06)


@pytest.mark.parametrize(("command", "chosen"), [(True, "command"), (False, "errors_in_variables")])
def test_auto_allows_for_the_readings_noise_and_says_why(command: bool, chosen: str) -> None:
    found = identify(press(load_noise=2.23, reading_noise=3.0, command=command))
    assert found.estimator == chosen
    assert any("noisy as well" in note for note in found.notes)
    assert abs(found.parameters["a1"].value - A1) < 5 * found.parameters["a1"].sd


@pytest.mark.parametrize(
    ("direction", "noise", "command"),
    [
        ("inverse", {"load_noise": 2.23, "reading_noise": 20.0}, False),
        ("inverse", {"load_noise": 2.23, "reading_noise": 20.0}, True),
        ("forward", {"load_noise": 40.0, "reading_noise": 1.0}, False),
    ],
)
def test_a_loud_input_is_not_smoothed_by_a_delay_and_a_pole_of_its_own(
    direction: str, noise: dict[str, float], command: bool
) -> None:
    """At 4 % of full scale a plain fit ends a tenth of a second away, at fifty times the pole."""
    found = identify(press(**noise, offset=4.0, command=command), direction=direction)
    assert found.estimator == ("command" if command else "errors_in_variables")
    for name, truth in zip(("a1", "b0", "b1"), coefficients(*TOE), strict=True):
        one = found.parameters[name]
        assert abs(one.value - truth) < 4.0 * one.sd
        assert one.sd < 0.3 * one.value
    assert abs(found.delay_s.value) < 0.01


def test_either_direction_gives_one_answer_when_both_are_noisy() -> None:
    noisy = press(load_noise=2.23, reading_noise=2.0)
    inverse, forward = (
        identify(noisy, direction=way, estimator="errors_in_variables") for way in ("inverse", "forward")
    )
    for name in ("a1", "b0", "b1"):
        one, other = inverse.parameters[name], forward.parameters[name]
        assert one.value == pytest.approx(other.value, abs=0.5 * one.sd)


def test_known_variances_are_taken_as_given() -> None:
    noisy = press(load_noise=2.23, reading_noise=3.0)
    found = identify(noisy, estimator="errors_in_variables", reading_noise=3.0, load_noise_n=2.23, **FIXED)
    assert found.noise["reading"].value == 3.0
    assert abs(found.parameters["b0"].value - coefficients(*TOE)[1]) < 5 * found.parameters["b0"].sd


def test_all_methods_end_at_one_optimum_with_noise_on_both() -> None:
    noisy = press(load_noise=2.23, reading_noise=3.0, delay_s=0.003, offset=4.0)
    found = [identify(noisy, method=method, estimator="errors_in_variables") for method in ("gn", "lm", "trf")]
    for other in found[1:]:
        assert other.parameters["a1"].value == pytest.approx(
            found[0].parameters["a1"].value, abs=1e-2 * found[0].parameters["a1"].sd
        )


@pytest.mark.parametrize("sd", [0.02, 1.0])
def test_white_noise_is_measured_through_ramps_and_corners(sd: float) -> None:
    recording = press(rates=SIX_RATES)
    noise = sd * np.random.default_rng(4).standard_normal(len(recording))
    # A median over 4000 dependent differences: 4 % is five standard errors.
    assert white_noise_sd(recording.force_n + noise, order=3) == pytest.approx(sd, rel=0.1)


def test_a_missing_or_useless_command_is_refused() -> None:
    with pytest.raises(RefusedError, match="command_n"):
        identify(press(load_noise=1.0), estimator="command")
    recording = press(load_noise=1.0)
    shuffled = Recording.from_arrays(
        time_s=recording.time_s,
        force_n=recording.force_n,
        pressure_mbar=recording.sensor.values,
        command_n=np.random.default_rng(0).permutation(recording.force_n),
    )
    with pytest.raises(RefusedError, match="does not follow"):
        identify(shuffled, estimator="command")


def test_srivc_takes_no_other_estimator() -> None:
    with pytest.raises(UsageError, match="srivc"):
        identify(press(), method="srivc", estimator="command")
