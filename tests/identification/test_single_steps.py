"""How long a step is, when it is taken and when a fit ends: each rule at its bound, on problems of a line."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._solve import (
    Evaluation,
    Minimum,
    Solver,
    _free,
    _GaussNewton,
    _LevenbergMarquardt,
    _newton_step,
    _promised,
    _TrustRegion,
    minimise,
    solve_normal,
)

Array = NDArray[np.float64]


def seen(cost: float, gradient: float = 1.0, normal: float = 1.0) -> Evaluation:
    return Evaluation(cost, np.array([gradient]), np.array([[normal]]), 1)


@dataclass
class _Parabola:
    """least + sum of normal (x - middle)^2, over ``count`` errors."""

    middle: Array
    least: float
    normal: Array
    count: int = 1
    looks: list[Array] = field(default_factory=list)

    @property
    def size(self) -> int:
        return self.middle.size

    @property
    def lower(self) -> Array:
        return np.full(self.size, -np.inf)

    @property
    def upper(self) -> Array:
        return np.full(self.size, np.inf)

    def evaluate(self, theta: Array) -> Evaluation:
        self.looks.append(theta.copy())
        off = theta - self.middle
        return Evaluation(
            self.least + float(off @ (self.normal * off)), self.normal * off, np.diag(self.normal), self.count
        )


# -- when a fit ends -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("count", [1, 50])
@pytest.mark.parametrize("cost", [0.02, 400.0])
@pytest.mark.parametrize(("share", "looks"), [(0.9e-8, 1), (1.1e-8, 2)])
def test_a_step_that_promises_a_hundred_millionth_of_a_residual_is_taken_without_another_look(
    count: int, cost: float, share: float, looks: int
) -> None:
    off = np.sqrt(share * cost / count / 3.0)
    problem = _Parabola(np.array([5.0]), cost, np.array([3.0]), count)
    found = minimise(problem, np.array([5.0 + off]), "gn", tolerance=1e-30, max_iterations=5)
    assert len(problem.looks) == looks
    assert (found.converged, found.iterations) == (True, looks)
    assert found.theta == pytest.approx([5.0], rel=1e-15)


@pytest.mark.parametrize(("tolerance", "steps"), [(1.1e-3, 1), (0.9e-3, 2)])
def test_a_change_below_the_tolerance_ends_a_fit_relative_to_each_unknown_or_a_thousandth_of_the_largest(
    tolerance: float, steps: int
) -> None:
    """Of 1000 and nothing a thousandth of the largest is 1: the second moves by 1e-3 of 1, beside its own 1e-3."""
    problem = _Parabola(np.array([1000.0, 1e-3]), 1.0, np.array([1.0, 1e6]))
    found = minimise(problem, np.array([1000.0, 0.0]), "gn", tolerance=tolerance, max_iterations=9)
    assert (found.converged, found.iterations) == (True, steps)
    one = _Parabola(np.array([1001.0]), 1e-3, np.array([1.0]))
    found = minimise(one, np.array([1000.0]), "gn", tolerance=tolerance, max_iterations=9)
    assert (found.converged, found.iterations) == (True, steps)


class _Level(_Parabola):
    """A cost that arithmetic cannot bring down, or that climbs, whatever its gradient promises."""

    climbs: float = 0.0

    def evaluate(self, theta: Array) -> Evaluation:
        self.looks.append(theta.copy())
        first = len(self.looks) == 1
        return Evaluation(
            self.least + (0.0 if first else self.climbs), self.normal * 0.0 + 1.0, np.diag(self.normal), 1
        )


def _on_a_level(promised: float, climbs: float, most: int = 4) -> Minimum:
    """One unknown near 1; a full step of 1/normal promises 1/normal of a cost of 8."""
    problem = _Level(np.array([1.0]), 8.0, np.array([1.0 / (8.0 * promised)]))
    problem.climbs = climbs
    return minimise(problem, np.array([1e-3]), "gn", tolerance=1e-30, max_iterations=most)


def test_a_step_that_gains_no_more_than_rounding_ends_a_fit_where_a_millionth_was_promised() -> None:
    assert _on_a_level(0.9e-6, 0.0).converged
    assert _on_a_level(0.9e-6, 0.0).iterations == 1
    far = _on_a_level(1.1e-6, 0.0)
    assert (far.converged, far.iterations) == (False, 4)


def test_where_every_step_climbs_a_fit_has_settled_where_a_ten_millionth_was_promised() -> None:
    assert (_on_a_level(0.9e-7, 1.0).converged, _on_a_level(1.1e-7, 1.0).converged) == (True, False)
    assert _on_a_level(1.1e-7, 1.0).theta.tolist() == [1e-3]


def test_a_cost_that_is_none_at_the_start_is_refused() -> None:
    problem = _Parabola(np.array([1.0]), np.inf, np.array([1.0]))
    with pytest.raises(NotIdentifiableError, match="not finite where the fit starts"):
        minimise(problem, np.array([2.0]), "gn", tolerance=1e-9, max_iterations=5)
    for gradient, normal in ((np.nan, 1.0), (1.0, np.inf)):
        with pytest.raises(NotIdentifiableError, match="normal equations are not finite"):
            _newton_step(seen(1.0, gradient, normal), np.ones(1, dtype=bool))


# -- bounds ----------------------------------------------------------------------------------------------------------
def test_at_a_bound_an_unknown_is_held_whose_descent_would_cross_it() -> None:
    problem = _Parabola(np.zeros(5), 0.0, np.ones(5))

    class Bounded(_Parabola):
        lower = np.array([0.0, 0.0, 0.0, -np.inf, 0.0])
        upper = np.array([np.inf, np.inf, 1.0, 1.0, 1.0])

    bounded = Bounded(problem.middle, 0.0, np.ones(5))
    theta = np.array([0.0, 0.0, 1.0, 1.0, 0.5])
    # A step goes against the gradient: down from 0 in the first place, up in the second.
    free = _free(bounded, theta, np.array([0.5, -0.5, -0.5, 0.5, 3.0]))
    assert free.tolist() == [False, True, False, True, True]
    assert _free(bounded, theta, np.zeros(5)).all()
    now = Evaluation(1.0, np.arange(1.0, 6.0), np.diag([1.0, 2.0, 3.0, 4.0, 5.0]) + 0.1, 9)
    step = _newton_step(now, free)
    kept = np.flatnonzero(free)
    assert step[kept] == pytest.approx(np.linalg.solve(now.normal[np.ix_(kept, kept)], now.gradient[kept]))
    assert step[~free].tolist() == [0.0, 0.0]
    assert _newton_step(now, np.zeros(5, dtype=bool)).tolist() == [0.0] * 5
    assert _newton_step(now, np.ones(5, dtype=bool)) == pytest.approx(np.linalg.solve(now.normal, now.gradient))


def test_what_a_step_promises_is_what_the_parabola_falls_by() -> None:
    problem = _Parabola(np.array([1.0, -2.0]), 3.0, np.array([2.0, 5.0]))
    here, move = np.array([4.0, 1.0]), np.array([0.5, -0.25])
    fall = problem.evaluate(here).cost - problem.evaluate(here - move).cost
    assert _promised(problem.evaluate(here), move) == pytest.approx(fall)


def test_of_columns_that_are_one_each_takes_half() -> None:
    assert solve_normal(np.array([[4.0, 4.0], [4.0, 4.0]]), np.array([8.0, 8.0])) == pytest.approx([1.0, 1.0])
    assert solve_normal(np.diag([0.0, 1e-30]), np.array([5.0, 3e-30])) == pytest.approx([0.0, 3.0])
    # What rounding makes of a column of nothing.
    assert solve_normal(np.diag([-6e-22, 4.0]), np.array([0.0, 8.0])) == pytest.approx([0.0, 2.0])


# -- Gauss and Newton ----------------------------------------------------------------------------------------------
def test_a_full_step_is_halved_until_it_climbs_no_more_and_begins_whole_again() -> None:
    walk, newton = _GaussNewton(seen(8.0)), np.array([3.0])
    lengths = []
    for cost in (9.0, 8.5, 8.0, 9.0, 7.0):
        lengths.append(float(walk.step(seen(8.0), newton, np.ones(1, dtype=bool))[0]))
        assert walk.judge(seen(8.0), seen(cost), 1.0, newton) is (cost <= 8.0)
    lengths.append(float(walk.step(seen(8.0), newton, np.ones(1, dtype=bool))[0]))
    assert lengths == [3.0, 1.5, 0.75, 3.0, 1.5, 3.0]


# -- Levenberg and Marquardt -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("gained", "predicted", "factor"),
    [
        # 1 - (2 share - 1)^3, a third at least.
        (0.9, 1.0, 1.0 - 0.8**3),
        (0.1, 1.0, 1.0 + 0.8**3),
        (1.2, 4.0, 1.0 + 0.4**3),
        (1.0, 1.0, 1.0 / 3.0),
        (3.0, 2.0, 1.0 / 3.0),
        (0.0, 2.0, 2.0),
        (0.5, 0.0, 1.0 / 3.0),
        (0.5, -1.0, 1.0 / 3.0),
        (0.4, 0.5, 1.0 - 0.6**3),
    ],
)
def test_damping_changes_by_nielsens_rule(gained: float, predicted: float, factor: float) -> None:
    walk = _LevenbergMarquardt(seen(8.0))
    walk.damping, walk.growth = 0.5, 16.0
    assert walk.judge(seen(8.0), seen(8.0 - gained), predicted, np.ones(1)) is True
    assert (walk.damping, walk.growth) == (pytest.approx(0.5 * factor), 2.0)


def test_damping_doubles_ever_faster_while_steps_climb() -> None:
    walk = _LevenbergMarquardt(seen(8.0))
    walk.damping = 0.5
    told = []
    for cost in (8.1, np.inf, 9.0):
        assert walk.judge(seen(8.0), seen(cost), 1.0, np.ones(1)) is False
        told.append((walk.damping, walk.growth))
    assert told == [(1.0, 4.0), (4.0, 8.0), (32.0, 16.0)]
    assert walk.judge(seen(np.inf), seen(np.inf), 1.0, np.ones(1)) is False
    walk.damping = 2e-14
    walk.judge(seen(8.0), seen(7.0), 1.0, np.ones(1))
    assert walk.damping == 1e-14


def test_a_damped_step_is_of_the_largest_slopes_seen_so_far() -> None:
    def at(diagonal: list[float]) -> Evaluation:
        return Evaluation(1.0, np.array([1.0, -2.0, 3.0]), np.diag(diagonal) + 0.1, 9)

    walk = _LevenbergMarquardt(at([5.0, 1.0, 2.0]))
    assert (walk.damping, walk.growth) == (1e-4, 2.0)
    walk.damping, now, free = 0.7, at([1.0, 4.0, 2.0]), np.array([True, True, False])
    step = walk.step(now, np.zeros(3), free)
    damped = now.normal[:2, :2] + 0.7 * np.diag([5.1, 4.1])
    assert step == pytest.approx([*np.linalg.solve(damped, [1.0, -2.0]), 0.0])


# -- a region of trust -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scale", [1.0, 3.0])
@pytest.mark.parametrize(
    ("share", "of_radius", "ratio"),
    [(0.24, 0.5, 0.125), (0.26, 0.5, 1.0), (0.74, 1.0, 1.0), (0.76, 1.0, 2.0), (0.9, 0.96, 2.0), (0.9, 0.94, 1.0)],
)
def test_a_region_shrinks_below_a_quarter_of_what_was_promised_and_grows_at_its_edge_beyond_three(
    scale: float, share: float, of_radius: float, ratio: float
) -> None:
    walk = _TrustRegion(seen(8.0, normal=scale**2))
    walk.radius = 6.0
    move = np.array([of_radius * 6.0 / scale])
    assert walk.judge(seen(8.0), seen(8.0 - 2.0 * share), 2.0, move) is True
    assert walk.radius == pytest.approx(6.0 * ratio)


@pytest.mark.parametrize(("cost", "predicted"), [(np.inf, 1.0), (np.nan, 1.0), (8.5, 1.0), (7.9, 0.0), (7.9, -1.0)])
def test_a_step_that_climbs_or_promised_nothing_shrinks_the_region(cost: float, predicted: float) -> None:
    walk = _TrustRegion(seen(8.0))
    assert walk.judge(seen(8.0), seen(cost), predicted, np.array([2.0])) is (cost < 8.0)
    assert walk.radius == 0.5


@pytest.mark.parametrize("radius", [0.01, 0.5, 3.0])
def test_a_step_at_the_edge_of_the_region_solves_the_damped_equations(radius: float) -> None:
    normal = np.array([[9.0, 2.0, 0.5], [2.0, 4.0, 0.1], [0.5, 0.1, 1.0]])
    now, free = Evaluation(1.0, np.array([6.0, -4.0, 9.0]), normal, 9), np.array([True, True, False])
    walk = _TrustRegion(now)
    walk.radius = radius
    newton = _newton_step(now, free)
    step = walk.step(now, newton, free)
    scale = np.array([3.0, 2.0])
    length = float(np.linalg.norm(scale * newton[:2]))
    if length <= radius:
        assert step == pytest.approx(newton)
        return
    assert np.linalg.norm(scale * step[:2]) == pytest.approx(radius, rel=1e-9)
    # (N + mu D^2) step = gradient for one mu above 0.
    rest = (now.gradient[:2] - normal[:2, :2] @ step[:2]) / (scale**2 * step[:2])
    assert rest[0] == pytest.approx(rest[1], rel=1e-6)
    assert rest[0] > 0.0
    assert step[2] == 0.0


@pytest.mark.parametrize("method", ["gn", "lm", "trf"])
def test_a_fit_begins_within_its_bounds(method: Solver) -> None:
    class Bounded(_Parabola):
        lower = np.array([2.0, -np.inf])
        upper = np.array([3.0, 0.0])

    problem = Bounded(np.array([2.5, -1.0]), 1.0, np.ones(2))
    found = minimise(problem, np.array([9.0, 9.0]), method, tolerance=1e-9, max_iterations=50)
    assert problem.looks[0].tolist() == [3.0, 0.0]
    assert found.theta == pytest.approx([2.5, -1.0], abs=1e-3)
