"""The search for the end of a likelihood interval, step by step, on courses whose every step is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import stdtrit

from smartshoe.identification._solve import Evaluation
from smartshoe.identification._uncertainty import (
    PROFILE_ITERATIONS,
    _profile_end,
    inverse_normal,
    profile_interval,
    t_quantile,
)

Array = NDArray[np.float64]

LEAST_COST, VARIANCE, QUANTILE = 10.0, 0.25, 4.0
ALLOWED = QUANTILE**2 * VARIANCE  # 4: the border's cost lies so much above the least
START = 5.0  # what the function is at the least cost


@dataclass
class _Course:
    """What is seen of a cost of (x, other) along a course: at each look how far below the border, and the next step.

    Without a gradient of the cost the border is sqrt(left/stiffness) away, so that the stiffness says how far.
    """

    looks: Sequence[tuple[float, float]]  # by look: cost left to the border, and the step that the quadratic allows
    upper: float = 100.0
    seen_at: list[Array] = field(default_factory=list)

    @property
    def lower(self) -> Array:
        return np.full(2, -100.0)

    def __post_init__(self) -> None:
        self.upper_bounds = np.array([self.upper, 100.0])

    def look(self, number: int) -> Evaluation:
        left, step = self.looks[min(number, len(self.looks) - 1)]
        normal = np.diag([left / step**2, 1.0])
        return Evaluation(LEAST_COST + ALLOWED - left, np.zeros(2), normal, 100)

    def evaluate(self, theta: Array) -> Evaluation:
        self.seen_at.append(theta.copy())
        return self.look(len(self.seen_at))


class _Problem:
    """The course as the search takes a problem."""

    def __init__(self, course: _Course) -> None:
        self.lower, self.upper, self.evaluate = course.lower, course.upper_bounds, course.evaluate


def _first(theta: Array) -> tuple[float, Array]:
    return START + float(theta[0]), np.array([1.0, 0.0])


def _searched(course: _Course) -> tuple[float, float]:
    """The interval of x + 5."""
    return profile_interval(
        _Problem(course),  # type: ignore[arg-type]
        np.zeros(2),
        course.look(0),
        VARIANCE,
        QUANTILE,
        _first,
    )


def _upwards(looks: Sequence[tuple[float, float]], upper: float = 100.0) -> tuple[float, list[float]]:
    """The upper end, and where x was looked at on the way there."""
    course = _Course(looks, upper)
    problem = _Problem(course)
    end = _profile_end(problem, np.zeros(2), course.look(0), LEAST_COST + ALLOWED, _first, 1.0)  # type: ignore[arg-type]
    return end, [float(at[0]) for at in course.seen_at]


NEAR, FAR = 0.005 * ALLOWED, 0.03 * ALLOWED  # of the border: within a hundredth of what is allowed, and not


def test_the_border_is_the_least_cost_and_the_quantiles_square_of_the_variance() -> None:
    """Of a parabola the first step ends there: 4 below the border at a stiffness of 100 are 0.2 away."""
    end, looks = _upwards([(ALLOWED, 0.2), (NEAR, 1e-7), (NEAR, 1e-9)])
    assert looks[0] == pytest.approx(0.2)
    assert end == pytest.approx(START + 0.2, abs=1e-6)
    assert _searched(_Course([(ALLOWED, 0.2), (NEAR, 1e-7)])) == pytest.approx((START - 0.2, START + 0.2), abs=1e-6)


def test_no_step_is_longer_than_half_a_unit_of_the_logarithm() -> None:
    _, looks = _upwards([(ALLOWED, 0.8), (ALLOWED, 0.45), (ALLOWED, 3.0), (NEAR, 1e-7)])
    assert looks[:3] == pytest.approx([0.5, 0.95, 1.45])


def test_it_ends_where_a_step_on_the_border_is_a_thousandth_of_the_way() -> None:
    # After 2 units of way a step of 0.0019 is short enough where the cost is that of the border ...
    way = [(ALLOWED, 0.5)] * 4
    end, looks = _upwards([*way, (NEAR, 0.0019), (NEAR, 0.0001)])
    assert end == pytest.approx(START + 2.0019, abs=1e-9)
    assert len(looks) == 5
    # ... one of 0.0021 is not, nor is the shorter one a hundredth and more of what is allowed away from it.
    end, _ = _upwards([*way, (NEAR, 0.0021), (NEAR, 0.0001)])
    assert end == pytest.approx(START + 2.0022, abs=1e-9)
    end, _ = _upwards([*way, (FAR, 0.0019), (0.015 * ALLOWED, 0.0003), (NEAR, 0.0001)])
    assert end == pytest.approx(START + 2.0022, abs=1e-9)
    # Beyond the border it is the same distance; a long step ends nothing.
    end, _ = _upwards([*way, (NEAR, 0.4), (NEAR, 0.002), (NEAR, 0.0001)])
    assert end == pytest.approx(START + 2.402, abs=1e-9)


def test_it_ends_anywhere_where_a_step_is_a_millionth_of_the_number() -> None:
    way = [(ALLOWED, 0.5)] * 2
    end, _ = _upwards([*way, (FAR, 9e-6), (FAR, 5e-6), (FAR, 1e-6)])
    assert end == pytest.approx(START + 1.000014, abs=1e-9)  # a millionth of 6 is 6e-6
    end, _ = _upwards([*way, (FAR, 5e-6), (FAR, 4e-6)])
    assert end == pytest.approx(START + 1.000005, abs=1e-9)


def test_a_bound_in_the_way_is_the_end() -> None:
    end, looks = _upwards([(ALLOWED, 0.3)], upper=0.7)
    assert end == pytest.approx(START + 0.7)
    assert looks == pytest.approx([0.3, 0.6, 0.7, 0.7])


def test_where_the_quadratic_lies_above_the_border_its_centre_is_the_step() -> None:
    """Beyond the border, with nothing below it in sight, the way leads back to the least that is seen."""

    class _Back:
        lower, upper = np.full(2, -9.0), np.full(2, 9.0)

        def __init__(self) -> None:
            self.seen_at: list[float] = []

        def evaluate(self, theta: Array) -> Evaluation:
            self.seen_at.append(float(theta[0]))
            beyond = LEAST_COST + 2.0 * ALLOWED
            slope = 0.3 if len(self.seen_at) == 1 else 0.0
            return Evaluation(beyond, np.array([slope, 0.0]), np.eye(2), 100)

    course, first = _Back(), Evaluation(LEAST_COST, np.zeros(2), np.diag([ALLOWED / 0.4**2, 1.0]), 100)
    low, high = profile_interval(course, np.zeros(2), first, VARIANCE, QUANTILE, _first)  # type: ignore[arg-type]
    assert course.seen_at[:3] == pytest.approx([-0.4, -0.7, -0.7])
    assert low == pytest.approx(START - 0.7)
    assert np.isfinite(high)


def test_of_a_parabola_it_ends_on_the_border_from_wherever_it_sets_out() -> None:
    """From beside the least as well: N^-1 holds how far the border of (t - m)'N(t - m) lies to either side of m."""
    normal, middle = np.array([[4.0, 1.0], [1.0, 9.0]]), np.array([0.04, -0.02])

    class _Parabola:
        lower, upper = np.full(2, -9.0), np.full(2, 9.0)

        def evaluate(self, theta: Array) -> Evaluation:
            off = theta - middle
            return Evaluation(LEAST_COST + float(off @ normal @ off), normal @ off, normal, 100)

    problem = _Parabola()
    begun = problem.evaluate(np.zeros(2))
    ends = profile_interval(problem, np.zeros(2), begun, VARIANCE / 40.0, QUANTILE, _first)  # type: ignore[arg-type]
    border = begun.cost - LEAST_COST + ALLOWED / 40.0
    away = np.sqrt(border * np.linalg.inv(normal)[0, 0])
    assert ends == pytest.approx((START + 0.04 - away, START + 0.04 + away), rel=1e-12)


@pytest.mark.parametrize("cost", [np.inf, np.nan])
def test_a_cost_that_is_none_leaves_the_interval_open(cost: float) -> None:
    class _Cliff:
        lower, upper = np.full(2, -9.0), np.full(2, 9.0)

        def evaluate(self, theta: Array) -> Evaluation:
            return Evaluation(cost, np.zeros(2), np.eye(2), 100)

    first = Evaluation(LEAST_COST, np.zeros(2), np.eye(2), 100)
    ends = profile_interval(_Cliff(), np.zeros(2), first, VARIANCE, QUANTILE, _first)  # type: ignore[arg-type]
    assert ends == (-np.inf, np.inf)


def test_a_border_that_is_never_reached_leaves_the_interval_open() -> None:
    course = _Course([(ALLOWED, 0.4)])
    assert _searched(course) == (-np.inf, np.inf)
    assert len(course.seen_at) == 2 * PROFILE_ITERATIONS


# -- the covariance, and the quantile --------------------------------------------------------------------------------
def test_what_is_small_beside_the_rest_is_not_singular_for_that() -> None:
    inverse, is_singular = inverse_normal(np.diag([1e-24, 1.0, 1e24]))
    assert not is_singular
    assert np.diag(inverse) == pytest.approx([1e24, 1.0, 1e-24])


@pytest.mark.parametrize(("apart", "is_singular"), [(2.8e-13, False), (1.2e-13, True)])
def test_columns_are_one_where_rounding_hides_what_parts_them(apart: float, is_singular: bool) -> None:
    """Of two columns that correlate by 1 - d the eigenvalues are 2 - d and d; told apart to 1e-13 of the largest."""
    normal = np.array([[4.0, 6.0 * (1.0 - apart)], [6.0 * (1.0 - apart), 9.0]])
    inverse, told = inverse_normal(normal)
    assert told is is_singular
    assert np.isfinite(inverse).all()
    if not is_singular:
        assert inverse[0, 0] == pytest.approx(9.0 / (36.0 * 2.0 * apart), rel=0.02)


@pytest.mark.parametrize("nothing", [np.zeros((2, 2)), np.diag([0.0, 2.0]), np.full((2, 2), np.nan)])
def test_what_no_data_holds_is_singular(nothing: Array) -> None:
    with np.errstate(all="ignore"):
        assert inverse_normal(nothing)[1] is True


def test_beside_what_no_data_holds_the_rest_has_its_variance() -> None:
    inverse, is_singular = inverse_normal(np.diag([0.0, 2.0]))
    assert is_singular
    assert np.isfinite(inverse).all()
    assert inverse[1].tolist() == pytest.approx([0.0, 0.5])


def test_the_quantile_is_exact_to_a_thousand_degrees_and_an_expansion_beyond() -> None:
    for degrees in (1, 3, 999, 1000):
        assert t_quantile(degrees) == pytest.approx(float(stdtrit(degrees, 0.975)), rel=1e-12)
    for degrees in (1001, 1500, 10_000, 10**6):
        # The next term of the expansion: (5 z^5 + 16 z^3 + 3 z)/(96 degrees^2).
        assert t_quantile(degrees) == pytest.approx(float(stdtrit(degrees, 0.975)), abs=2.9 / degrees**2)


def test_a_border_that_was_crossed_and_not_settled_on_lies_no_further_out_than_the_search_went() -> None:
    """A cost that is rough about the border sends the search to and fro across it."""

    class _Rough:
        lower, upper = np.full(2, -9.0), np.full(2, 9.0)

        def __init__(self) -> None:
            self.count = 0

        def evaluate(self, theta: Array) -> Evaluation:
            self.count += 1
            inside = self.count % 2 == 0
            off = (0.5 if inside else 2.0) * ALLOWED
            return Evaluation(LEAST_COST + off, theta * (1.0 if inside else 40.0), 20.0 * np.eye(2), 100)

    first = Evaluation(LEAST_COST, np.zeros(2), 20.0 * np.eye(2), 100)
    ends = profile_interval(_Rough(), np.zeros(2), first, VARIANCE, QUANTILE, _first)  # type: ignore[arg-type]
    assert np.isfinite(ends).all()
    assert ends[0] < START - 0.2
    assert ends[1] > START + 0.2
