"""What a fit concludes, number by number: from a theta and a covariance that are given, by formulas done by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import TOE, press
from scipy.special import stdtrit

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._conclude import Choice, _require_determined, conclude
from smartshoe.identification._estimator import ParameterFit
from smartshoe.identification._experiment import Direction, Experiment, prepare
from smartshoe.identification._identification import Identification
from smartshoe.identification._parametrisation import GreyBox
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.models import X_OVER_NRT
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

# ln alpha, p1, p2, the delay, two constants, two states; and the standard deviations of each.
THETA = np.array([np.log(0.25), 1.6, 1.5, 0.1, 12.0, -3.0, 0.7, -0.4])
SD = np.array([0.02, 0.003, 0.005, 1e-4, 0.3, 0.4, 0.05, 0.06])
DEGREES = 7
QUANTILE = float(stdtrit(DEGREES, 0.975))
COST = 5000.0


@pytest.fixture(scope="module")
def pair() -> list[Experiment]:
    return prepare([press(name="a", gap=slice(700, 720)), press(name="b", rates=(200.0,), repeats=1)])[0]


def fitted(
    experiments: list[Experiment],
    theta: Array = THETA,
    sd: Array = SD,
    direction: Direction = "inverse",
    options: dict[str, Any] | None = None,
    **changes: Any,
) -> ParameterFit:
    """A fit that ended at ``theta``, with standard deviations ``sd`` and no correlations."""
    problem = PredictionError(experiments, Settings(direction=direction, **(options or {})), changes.pop("form", None))
    fit = ParameterFit(
        problem=problem, theta=theta, covariance=np.diag(sd**2), variance=4.0, degrees=DEGREES, cost=COST,
        degenerate=False, iterations=3, converged=True, estimator="output_error",
        noise={"load": 2.0, "reading": 0.5}, evaluation=None,
    )  # fmt: skip
    return replace(fit, **changes)


def concluded(fit: ParameterFit, newtons: float | None = 2.0, load_zero_free: bool = False) -> Identification:
    choice = Choice("toe", "trf", "free", MILLIBAR, newtons, load_zero_free, ("a.csv",))
    return conclude(fit, choice, "here")


# -- numbers, by hand ----------------------------------------------------------------------------------------------
def test_coefficients_springs_and_damper_have_the_errors_of_what_they_follow_from(pair: list[Experiment]) -> None:
    """Inverse: a1 = alpha, b0 = p1, b1 = alpha p2; a scale of 2 N per mbar: k1 = (p2/2 - 1)/X, k2 = (p1 - p2)/2X."""
    found, x, sd = concluded(fitted(pair)), X_OVER_NRT, SD
    k2 = 0.1 / (2.0 * x)
    wanted = {
        "a1": (0.25, 0.25 * sd[0]),
        "b0": (1.6, sd[1]),
        "b1": (0.375, np.hypot(0.375 * sd[0], 0.25 * sd[2])),
        "k1": (-0.25 / x, sd[2] / (2.0 * x)),
        "k2": (k2, np.hypot(sd[1], sd[2]) / (2.0 * x)),
        "c": (k2 / 0.25, np.hypot(k2 * sd[0], np.hypot(sd[1], sd[2]) / (2.0 * x)) / 0.25),
    }
    for name, (value, own) in wanted.items():
        one = found.parameters[name]
        assert (one.value, one.sd) == (pytest.approx(value), pytest.approx(own)), name
        assert one.ci95 == pytest.approx((value - QUANTILE * own, value + QUANTILE * own)), name
    assert [one.unit for one in found.parameters.values()] == ["1/s", "N/mbar", "N/(mbar s)", "1", "1", "s"]
    assert found.scale == 2.0
    assert found.covariance[0, 2] == pytest.approx(0.25 * 0.375 * sd[0] ** 2)


def test_a_scale_that_is_estimated_is_the_one_with_which_c_is_1(pair: list[Experiment]) -> None:
    found, x, sd = concluded(fitted(pair), newtons=None), X_OVER_NRT, SD
    scale = 0.1 / (x * 0.25)
    assert found.scale == pytest.approx(scale)
    assert found.parameters["k2"].value == pytest.approx(0.25)
    assert found.parameters["k2"].sd == pytest.approx(0.25 * sd[0])
    assert (found.parameters["c"].value, found.parameters["c"].sd) == (pytest.approx(1.0), 0.0)
    # k1 = (p2/scale - 1)/X = alpha p2/(p1 - p2) - 1/X.
    slopes = 0.25 * np.array([1.5 / 0.1, -1.5 / 0.1**2, 1.6 / 0.1**2])
    assert found.parameters["k1"].value == pytest.approx(0.25 * 15.0 - 1.0 / x)
    assert found.parameters["k1"].sd == pytest.approx(float(np.linalg.norm(slopes * sd[:3])))


def test_zeros_delay_and_states_have_their_own_errors(pair: list[Experiment]) -> None:
    """A constant of 12 N at a static gain of 1.5 N per mbar is a reading of -8 mbar at rest."""
    found = concluded(fitted(pair))
    for name, constant, own, state, state_sd in (("a", 12.0, 0.3, 0.7, 0.05), ("b", -3.0, 0.4, -0.4, 0.06)):
        zero, start = found.offsets[name], found.initial_states[name]
        assert zero.value == pytest.approx(-constant / 1.5)
        assert zero.sd == pytest.approx(np.hypot(own / 1.5, constant / 1.5**2 * SD[2]))
        assert zero.ci95[1] - zero.value == pytest.approx(QUANTILE * zero.sd)
        assert (start.value, start.sd, start.unit) == (state, pytest.approx(state_sd), "N")
        assert start.ci95[1] - start.value == pytest.approx(QUANTILE * start.sd)
        assert (found.load_offsets[name].value, found.load_offsets[name].sd) == (0.0, 0.0)
        assert (zero.unit, found.load_offsets[name].unit) == ("mbar", "N")
    assert (found.delay_s.value, found.delay_s.sd, found.delay_s.unit) == (0.1, pytest.approx(1e-4), "s")
    assert found.delay_s.ci95[1] - 0.1 == pytest.approx(QUANTILE * 1e-4)
    other = concluded(fitted(pair, options={"offset": 0.0}), load_zero_free=True)
    assert (other.load_offsets["a"].value, other.load_offsets["a"].sd) == (12.0, pytest.approx(0.3))
    assert (other.offsets["a"].value, other.offsets["a"].sd) == (0.0, 0.0)


def test_in_the_forward_direction_the_constant_is_the_readings(pair: list[Experiment]) -> None:
    """Forward: b1/b0 = alpha, b0 = 1/p1, a1 = alpha p2/p1."""
    theta = np.array([np.log(0.25), 0.6, 0.5, 0.1, 12.0, -3.0, 0.7, -0.4])
    found = concluded(fitted(pair, theta, direction="forward"))
    assert found.coefficients == pytest.approx((0.25 * 0.5 / 0.6, 1.0 / 0.6, 0.25 / 0.6))
    assert found.parameters["b0"].sd == pytest.approx(SD[1] / 0.6**2)
    assert found.parameters["b1"].sd == pytest.approx(0.25 / 0.6 * np.hypot(SD[0], SD[1] / 0.6))
    assert (found.offsets["a"].value, found.offsets["a"].sd) == (12.0, pytest.approx(0.3))
    assert (found.rmse_unit, found.initial_states["a"].unit) == ("mbar", "mbar")
    other = concluded(fitted(pair, theta, direction="forward", options={"offset": 0.0}), load_zero_free=True)
    load = other.load_offsets["a"]
    assert load.value == pytest.approx(-12.0 / 0.5)
    assert load.sd == pytest.approx(np.hypot(0.3 / 0.5, 12.0 / 0.5**2 * SD[2]))


def test_what_was_given_is_told_without_an_error_bar(pair: list[Experiment]) -> None:
    options = {"offset": 4.0, "load_offset_n": 7.0, "free_constant": False, "delay_s": 0.02, "steady": True}
    found = concluded(fitted(pair, THETA[:3], SD[:3], options=options))
    for one, value in (
        (found.offsets["b"], 4.0),
        (found.load_offsets["b"], 7.0),
        (found.delay_s, 0.02),
        (found.initial_states["b"], 0.0),
        (found.noise["load"], 2.0),
        (found.noise["reading"], 0.5),
    ):
        assert (one.value, one.sd, one.ci95) == (value, 0.0, (value, value))
    assert (found.noise["load"].unit, found.noise["reading"].unit) == ("N", "mbar")


def test_fit_and_error_are_those_of_the_samples_that_count(pair: list[Experiment]) -> None:
    fit = fitted(pair)
    loads = np.concatenate([one.load_n[mask] for one, mask in zip(pair, fit.problem.masks, strict=True)])
    spread = float(np.sum((loads - loads.mean()) ** 2))
    found = concluded(fit)
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - np.sqrt(COST / spread)))
    assert found.rmse == pytest.approx(np.sqrt(COST / loads.size))
    assert (found.n_samples, found.n_missing) == (loads.size, 20)
    assert (found.iterations, found.converged, found.estimator) == (3, True, "output_error")
    assert found.sample_rate_hz == pytest.approx(100.0)
    # What another estimator made least is not the error of the model; that is looked at anew.
    errors = [fit.problem.model_error(THETA, index)[mask] for index, mask in enumerate(fit.problem.masks)]
    plain = sum(float(np.sum(error**2)) for error in errors)
    other = concluded(replace(fit, estimator="errors_in_variables"))
    assert other.rmse == pytest.approx(np.sqrt(plain / loads.size))
    assert other.fit_percent == pytest.approx(100.0 * (1.0 - np.sqrt(plain / spread)))


def test_of_a_load_of_thousandths_the_fit_is_told_as_well_and_of_none_it_is_no_number(pair: list[Experiment]) -> None:
    small = [replace(one, load_n=1e-5 * one.load_n) for one in pair]
    spread = sum(float(np.sum((one.load_n - 0.0) ** 2)) for one in small)
    found = concluded(fitted(small, cost=1e-3 * spread))
    assert 90.0 < found.fit_percent < 97.0
    level = [replace(one, load_n=np.zeros_like(one.load_n)) for one in pair]
    assert np.isnan(concluded(fitted(level)).fit_percent)


# -- what a user must be told ----------------------------------------------------------------------------------------
def _notes(pair: list[Experiment], *, theta: Array = THETA, sd: Array = SD, **changes: Any) -> str:
    return " | ".join(concluded(fitted(pair, theta, sd, **changes)).remarks)


def _with(place: int, value: float, of: Array = THETA) -> Array:
    changed = of.copy()
    changed[place] = value
    return changed


@pytest.mark.parametrize(("delay_s", "is_told"), [(0.1, False), (0.49, False), (0.4901, True), (-0.4901, True)])
def test_a_delay_within_two_hundredths_of_its_limit_is_told(
    pair: list[Experiment], delay_s: float, is_told: bool
) -> None:
    assert ("delay ran to its limit of 0.5 s" in _notes(pair, theta=_with(3, delay_s))) is is_told


@pytest.mark.parametrize(("p1", "is_told"), [(1.49, True), (1.5, False), (1.51, False)])
def test_a_reading_that_leads_is_told(pair: list[Experiment], p1: float, is_told: bool) -> None:
    assert ("k2 is negative" in _notes(pair, theta=_with(1, p1))) is is_told


def test_springs_of_a_reading_that_falls_are_told_to_be_none(pair: list[Experiment]) -> None:
    """The gain's sign is no lead: turned as a whole, the reading lags as it did."""
    upright, turned = _notes(pair), _notes(pair, theta=np.array([np.log(0.25), -1.6, -1.5, 0.1, 12.0, -3.0, 0.7, -0.4]))
    assert ("falls as the load rises" in upright, "falls as the load rises" in turned) == (False, True)
    assert "leads" not in upright + turned


def test_remarks_of_the_fit_are_handed_on_and_empty_ones_are_not(pair: list[Experiment]) -> None:
    assert concluded(fitted(pair, notes=("", "said before"))).remarks == ("said before",)


# -- where an interval is that of the likelihood ---------------------------------------------------------------------
@pytest.mark.parametrize(("relative", "is_profile"), [(0.09, False), (0.11, True), (0.19, True)])
def test_beyond_a_tenth_of_the_pole_intervals_are_those_of_the_likelihood(
    pair: list[Experiment], relative: float, is_profile: bool
) -> None:
    options = {"free_constant": False, "delay_s": 0.0, "steady": True, "offset": 0.0}
    theta, sd = THETA[:3], np.array([relative, 1e-3, 1e-3])
    fit = fitted(pair, theta, sd, options=options)
    seen = fit.problem.evaluate(theta)
    # A likelihood of about the given breadth of ln alpha about theta; of it the interval is lopsided.
    scale = np.linalg.inv(seen.normal)[0, 0]
    fit = replace(fit, evaluation=replace(seen, gradient=np.zeros(3)), variance=relative**2 / scale)
    one = concluded(fit).parameters["a1"]
    even = (one.value - QUANTILE * one.sd, one.value + QUANTILE * one.sd)
    assert one.sd == pytest.approx(0.25 * relative)
    assert (one.ci95 == pytest.approx(even, rel=1e-9)) is not is_profile
    remarks = " ".join(concluded(fit).remarks)
    assert ("intervals are those of the likelihood profile" in remarks) is is_profile
    # Without a likelihood there is no profile, however uncertain the pole.
    assert concluded(replace(fit, evaluation=None)).parameters["a1"].ci95 == pytest.approx(even, rel=1e-12)


def test_each_loose_parameter_has_its_own_profile_and_a_fixed_one_its_value(pair: list[Experiment]) -> None:
    options = {"free_constant": False, "delay_s": 0.0, "steady": True, "offset": 0.0}
    form = GreyBox("inverse", 1.0, {"c": 1.0, "x_over_nrt": X_OVER_NRT}, {})
    theta = np.array(TOE[:2])
    fit = fitted(pair, theta, np.array([0.02, 0.03]), options=options, form=form)
    seen = fit.problem.evaluate(theta)
    fit = replace(fit, evaluation=seen, variance=0.03**2 / np.linalg.inv(seen.normal)[1, 1])
    found = concluded(fit, newtons=1.0)
    assert found.parameters["c"].ci95 == (1.0, 1.0)
    for name in ("a1", "b0", "b1", "k1", "k2"):
        one = found.parameters[name]
        assert 0.0 < one.sd < 1.0
        assert one.ci95 != pytest.approx((one.value - QUANTILE * one.sd, one.value + QUANTILE * one.sd), rel=1e-6), name


# -- what is refused -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("degrees", "is_enough"), [(0, False), (1, True)])
def test_one_sample_more_than_unknowns_is_enough(pair: list[Experiment], degrees: int, is_enough: bool) -> None:
    fit = fitted(pair, degrees=degrees)
    if is_enough:
        one = concluded(fit).parameters["b0"]
        assert one.ci95[1] - one.value == pytest.approx(12.7062 * one.sd, rel=1e-5)
    else:
        with pytest.raises(NotIdentifiableError, match="record more"):
            concluded(fit)


@pytest.mark.parametrize("place", [1, 2])
def test_a_gain_that_is_no_number_is_no_stable_model(pair: list[Experiment], place: int) -> None:
    with np.errstate(all="ignore"), pytest.raises(NotIdentifiableError, match="no stable model"):
        concluded(fitted(pair, _with(place, np.nan)))


def test_a_pole_below_nothing_is_no_stable_model_and_a_gain_below_nothing_is_one(pair: list[Experiment]) -> None:
    turned = np.array([np.log(0.25), 0.6, -0.5, 0.1, 12.0, -3.0, 0.7, -0.4])
    with pytest.raises(NotIdentifiableError, match=r"a1 = -0\.208"):
        concluded(fitted(pair, turned, direction="forward"))
    assert concluded(fitted(pair, _with(1, -1.6))).parameters["b0"].value == -1.6


@pytest.mark.parametrize(
    ("left", "degenerate", "gain_sd", "pole_sd", "says"),
    [
        # At each bound: half of the spread, a fifth of the gain, the pole itself.
        (0.5, True, 0.1, 0.01, "relaxation"),
        (0.501, True, 0.1, 0.01, "does not follow"),
        (0.6, False, 0.4, 0.01, ""),
        (0.6, False, 0.401, 0.01, "does not follow"),
        (0.999, False, 0.1, 0.01, ""),
        (1.0, False, 0.1, 0.01, "does not follow"),
        (0.4, False, 0.1, 0.25, ""),
        (0.4, False, 0.1, 0.251, "relaxation"),
    ],
)
def test_what_is_left_open_is_refused_beyond_its_bound(
    left: float, degenerate: bool, gain_sd: float, pole_sd: float, says: str
) -> None:
    covariance = np.diag([pole_sd, 5.0, gain_sd, 7.0]) ** 2
    fit = SimpleNamespace(
        problem=SimpleNamespace(shape_size=3), theta=np.array([-1.6, 30.0, -2.0, 40.0]),
        degenerate=degenerate, covariance=covariance,
    )  # fmt: skip
    values, sd = np.array([0.25, 3.0, 1.0, 0.0]), np.array([pole_sd, 0.5, 0.1, 9.0])
    if says:
        with pytest.raises(NotIdentifiableError, match=says):
            _require_determined("here", fit, values, sd, left)  # type: ignore[arg-type]
    else:
        _require_determined("here", fit, values, sd, left)  # type: ignore[arg-type]


def test_a_fit_without_a_static_gain_follows_no_load(pair: list[Experiment]) -> None:
    fit = SimpleNamespace(
        problem=SimpleNamespace(shape_size=3),
        theta=np.zeros(3),
        degenerate=False,
        covariance=np.zeros((3, 3)),
    )
    with pytest.raises(NotIdentifiableError, match="does not follow"):
        _require_determined("here", fit, np.array([0.2, 3.0, 0.0]), np.zeros(3), 0.0)  # type: ignore[arg-type]


def test_what_conclude_finds_left_open_it_refuses(pair: list[Experiment]) -> None:
    with pytest.raises(NotIdentifiableError, match="relaxation"):
        concluded(fitted(pair, degenerate=True))


# -- errors that depend on each other ------------------------------------------------------------------------------
def _tied(sd: Array) -> Array:
    """A covariance of the given spreads in which each pair correlates, with alternate signs."""
    sign = np.where(np.arange(sd.size) % 2, -1.0, 1.0)
    return np.outer(sd, sd) * (0.6 * np.outer(sign, sign) + 0.4 * np.eye(sd.size))


def _spread(slopes: dict[int, float], covariance: Array) -> float:
    """The standard deviation of what moves with theta as ``slopes`` say, by place."""
    along = np.zeros(len(covariance))
    along[list(slopes)] = list(slopes.values())
    return float(np.sqrt(along @ covariance @ along))


def test_correlations_of_the_fit_are_carried_to_what_is_told(pair: list[Experiment]) -> None:
    covariance, x = _tied(SD), X_OVER_NRT
    found = concluded(fitted(pair, covariance=covariance))
    half = 0.5 / x
    wanted = {
        "b1": {0: 0.375, 2: 0.25},
        "k2": {1: half, 2: -half},
        "c": {0: -0.1 * half / 0.25, 1: half / 0.25, 2: -half / 0.25},
    }
    for name, slopes in wanted.items():
        assert found.parameters[name].sd == pytest.approx(_spread(slopes, covariance)), name
    zero = _spread({4: -1.0 / 1.5, 2: 12.0 / 1.5**2}, covariance)
    assert found.offsets["a"].sd == pytest.approx(zero)
    free = concluded(fitted(pair, covariance=covariance), newtons=None)
    slopes = {0: 0.25 * 15.0, 1: -0.25 * 150.0, 2: 0.25 * 160.0}
    assert free.parameters["k1"].sd == pytest.approx(_spread(slopes, covariance))
    assert free.parameters["k2"].sd == pytest.approx(0.25 * SD[0])
    theta = np.array([np.log(0.25), 0.6, 0.5, 0.1, 12.0, -3.0, 0.7, -0.4])
    fit = fitted(pair, theta, direction="forward", options={"offset": 0.0}, covariance=covariance)
    load = concluded(fit, load_zero_free=True).load_offsets["a"]
    assert load.sd == pytest.approx(_spread({4: -1.0 / 0.5, 2: 12.0 / 0.5**2}, covariance))


def test_a_summary_has_six_digits_of_a_number_and_two_of_its_error(pair: list[Experiment]) -> None:
    theta, sd = _with(0, np.log(0.251234567)), _with(0, 0.02345678, SD)
    found = concluded(fitted(pair, theta, sd))
    table = found._summary_table()
    rows = {row[0]: row[1:] for row in table.rows}
    one = found.parameters["a1"]
    assert rows["a1"] == ["0.251235", "0.0059", f"{one.ci95[0]:.6g}", f"{one.ci95[1]:.6g}", "1/s"]
    assert list(rows) == ["a1", "b0", "b1", "k1", "k2", "c", "delay", "offset (a)", "offset (b)"]
    assert rows["delay"][:2] == ["0.1", "0.0001"]
