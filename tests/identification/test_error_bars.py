"""Error bars say what they claim: 95 % by Student's t, and a scatter as large as the standard deviation."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from presses import press

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification import identify
from smartshoe.identification._conclude import _require_determined
from smartshoe.identification._uncertainty import profile_interval, t_quantile
from smartshoe.models import Parameter
from smartshoe.recording import Recording


@pytest.mark.parametrize(
    ("degrees", "quantile"),
    [(1, 12.706), (5, 2.5706), (10, 2.2281), (30, 2.0423), (120, 1.9799), (1000, 1.9623), (1001, 1.9623),
     (10**9, 1.95996)],
)  # fmt: skip
def test_the_quantile_is_that_of_the_printed_table(degrees: int, quantile: float) -> None:
    assert t_quantile(degrees) == pytest.approx(quantile, rel=5e-5)


def test_an_interval_from_a_standard_deviation_alone_is_the_normal_laws() -> None:
    assert Parameter.from_sd(10.0, 2.0, "N").ci95 == pytest.approx((10.0 - 3.919928, 10.0 + 3.919928), abs=1e-6)


def test_a_parameter_is_told_in_numbers_that_json_has() -> None:
    told = Parameter.from_sd(10.0, 2.0, "N", 2.0).to_dict()
    assert told == {"value": 10.0, "sd": 2.0, "ci95": [6.0, 14.0], "unit": "N"}
    told = Parameter(10.0, np.nan, (-np.inf, np.inf), "N").to_dict()
    assert told == {"value": 10.0, "sd": None, "ci95": [None, None], "unit": "N"}


# -- the likelihood profile ------------------------------------------------------------------------------------
class _Bent:
    """A cost of (x, y) that is least in a bent valley: (e^x - 1)^2 + 4 (y - 0.3 x^2)^2."""

    lower, upper = np.full(2, -20.0), np.full(2, 20.0)

    def evaluate(self, theta: np.ndarray) -> SimpleNamespace:
        x, y = theta
        residual = np.array([np.exp(x) - 1.0, 2.0 * (y - 0.3 * x**2)])
        slope = np.array([[np.exp(x), 0.0], [-1.2 * x, 2.0]])
        return SimpleNamespace(cost=residual @ residual, gradient=slope.T @ residual, normal=slope.T @ slope)


def _ends(function: Callable[[np.ndarray], tuple[float, np.ndarray]], border: float = 0.5) -> tuple[float, float]:
    problem, least = _Bent(), np.zeros(2)
    seen = problem.evaluate(least)
    return profile_interval(problem, least, seen, border**2 / 4.0, 2.0, function)  # type: ignore[arg-type]


def test_a_profile_ends_where_the_cost_reaches_the_border() -> None:
    assert _ends(lambda at: (at[0], np.array([1.0, 0.0]))) == pytest.approx((np.log(0.5), np.log(1.5)), abs=1e-5)
    around = np.linspace(0.0, 2.0 * np.pi, 100_001)  # the border, where both squares are a quarter together
    y = 0.3 * np.log(1.0 + 0.5 * np.cos(around)) ** 2 + 0.25 * np.sin(around)
    assert _ends(lambda at: (at[1], np.array([0.0, 1.0]))) == pytest.approx((y.min(), y.max()), abs=1e-4)


def test_a_profile_is_the_same_whatever_a_parameter_is_called() -> None:
    low, high = _ends(lambda at: (np.exp(at[0]), np.array([np.exp(at[0]), 0.0])))
    assert (low, high) == pytest.approx((0.5, 1.5), abs=1e-5)


def test_a_profile_whose_border_is_never_reached_is_open_on_that_side() -> None:
    low, high = _ends(lambda at: (at[0], np.array([1.0, 0.0])), border=1.5)  # (e^x - 1)^2 stays below 1 as x falls
    assert low == -np.inf or low < -10.0
    assert high == pytest.approx(np.log(2.5), abs=1e-5)


# -- what is refused -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("left", "degenerate", "gain_sd", "pole_sd", "says"),
    [
        # Of the reading's spread what the fit leaves; the gain is 1 and the pole 0.2 per second.
        (0.6, False, 0.3, 0.01, "does not follow the load"),
        (0.6, True, 0.1, 0.01, "does not follow the load"),
        (0.6, False, 0.1, 0.01, ""),
        (0.4, False, 0.3, 0.01, ""),
        (0.4, True, 0.1, 0.01, "relaxation"),
        (0.4, False, 0.1, 0.3, "relaxation"),
        (0.4, False, 0.1, np.nan, "relaxation"),
    ],
)
def test_what_the_data_leave_open_is_refused_by_its_name(
    left: float, degenerate: bool, gain_sd: float, pole_sd: float, says: str
) -> None:
    fit = SimpleNamespace(
        problem=SimpleNamespace(shape_size=3), theta=np.array([-1.6, 0.2, 1.0]),
        degenerate=degenerate, covariance=np.diag([pole_sd, 0.1, gain_sd]) ** 2,
    )  # fmt: skip
    values, sd = np.array([0.2, 5.0, 1.0]), np.array([pole_sd, 0.5, 0.1])  # a fast gain is as sure as its own size
    with pytest.raises(NotIdentifiableError, match=says) if says else nullcontext():
        _require_determined("here", fit, values, sd, left)  # type: ignore[arg-type]


def _told(found) -> dict[str, Parameter]:  # type: ignore[no-untyped-def]
    """The springs and the nuisances by name."""
    return {
        **{name: found.parameters[name] for name in ("a1", "b0", "b1", "k1", "k2")},
        "offset": found.offsets["triangles"],
        "delay": found.delay_s,
        "state": found.initial_states["triangles"],
    }


def test_the_scatter_of_every_estimate_is_its_standard_deviation_and_its_interval_is_95_percent() -> None:
    clean = press(rates=(200.0, 800.0), repeats=1, offset=3.0, delay_s=0.004)
    rng = np.random.default_rng(8)
    runs = []
    for _ in range(40):
        noisy = Recording.from_arrays(
            time_s=clean.time_s,
            force_n=clean.force_n + 2.23 * rng.standard_normal(len(clean)),
            pressure_mbar=clean.sensor.values,
            name="triangles",
        )
        runs.append(_told(identify(noisy, method="gn", delay="estimate", initial_state="estimate")))
    for name in runs[0]:
        each = [run[name] for run in runs]
        ratio = np.std([one.value for one in each], ddof=1) / np.mean([one.sd for one in each])
        # The sd of 40 values errs by 11 %: four of those.
        assert ratio == pytest.approx(1.0, abs=0.45), name
        for one in each:
            low, high = one.ci95
            assert (high - low) / (2.0 * one.sd) == pytest.approx(1.961, abs=2e-3), name
            assert 0.5 * (low + high) == pytest.approx(one.value, rel=1e-9, abs=1e-12), name
