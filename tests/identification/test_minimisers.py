"""The three ways of taking a step end at one optimum: of problems whose optimum is known otherwise."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification._solve import (
    _WALKS,
    Evaluation,
    Solver,
    _LevenbergMarquardt,
    _TrustRegion,
    minimise,
    solve_normal,
)

Array = NDArray[np.float64]

METHODS: tuple[Solver, ...] = ("gn", "lm", "trf")


@dataclass
class _Linear:
    """|A x - b|^2 within bounds."""

    a: Array
    b: Array
    lower: Array = field(default_factory=lambda: np.zeros(0))
    upper: Array = field(default_factory=lambda: np.zeros(0))
    looks: int = 0

    def __post_init__(self) -> None:
        if not self.lower.size:
            self.lower, self.upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)

    @property
    def size(self) -> int:
        return int(self.a.shape[1])

    def evaluate(self, theta: Array) -> Evaluation:
        self.looks += 1
        error = self.a @ theta - self.b
        return Evaluation(float(error @ error), self.a.T @ error, self.a.T @ self.a, error.size)


class _Valley(_Linear):
    """Rosenbrock's: 1 - x and 10 (y - x^2), the least at (1, 1)."""

    def evaluate(self, theta: Array) -> Evaluation:
        self.looks += 1
        x, y = (float(value) for value in theta)
        error, slopes = np.array([1.0 - x, 10.0 * (y - x**2)]), np.array([[-1.0, 0.0], [-20.0 * x, 10.0]])
        return Evaluation(float(error @ error), slopes.T @ error, slopes.T @ slopes, 2)


@pytest.mark.parametrize("method", METHODS)
def test_a_line_is_fitted_at_once(method: Solver) -> None:
    rng = np.random.default_rng(1)
    problem = _Linear(rng.standard_normal((30, 4)) * np.array([1.0, 1e3, 1e-3, 1.0]), rng.standard_normal(30))
    found = minimise(problem, np.ones(4), method, tolerance=1e-9, max_iterations=60)
    expected = np.linalg.lstsq(problem.a, problem.b, rcond=None)[0]
    assert found.converged
    assert found.theta == pytest.approx(expected, rel=1e-5)
    if method != "lm":  # which damps its first steps
        assert found.iterations <= 2
        assert problem.looks <= 2


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=15)
@given(st.integers(0, 999))
def test_within_bounds_it_is_the_least_there(method: Solver, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((20, 3)), 3.0 * rng.standard_normal(20)
    lower = rng.uniform(-1.0, 0.0, 3)
    upper = lower + rng.uniform(0.1, 0.8, 3)
    found = minimise(_Linear(a, b, lower, upper), np.zeros(3), method, tolerance=1e-10, max_iterations=200)
    expected = lsq_linear(a, b, (lower, upper), method="bvls").x
    assert np.all((found.theta >= lower) & (found.theta <= upper))
    assert float(np.sum((a @ found.theta - b) ** 2)) == pytest.approx(float(np.sum((a @ expected - b) ** 2)), rel=1e-4)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -4.0), (0.5, 0.3)])
def test_a_bent_valley_is_followed_to_its_end(method: Solver, start: tuple[float, float]) -> None:
    problem = _Valley(np.zeros((2, 2)), np.zeros(2))
    found = minimise(problem, np.array(start), method, tolerance=1e-10, max_iterations=200)
    assert found.converged
    assert found.theta == pytest.approx([1.0, 1.0], abs=1e-4)
    assert found.evaluation.cost < 1e-6
    assert problem.looks < 200


@pytest.mark.parametrize("method", METHODS)
def test_few_iterations_are_said_not_to_have_settled(method: Solver) -> None:
    problem = _Valley(np.zeros((2, 2)), np.zeros(2))
    found = minimise(problem, np.array([-1.2, 1.0]), method, tolerance=1e-10, max_iterations=1)
    assert (found.converged, found.iterations) == (False, 1)


@pytest.mark.parametrize("method", METHODS)
def test_a_step_never_climbs(method: Solver) -> None:
    class Watched(_Valley):
        costs: list[float]

        def evaluate(self, theta: Array) -> Evaluation:
            seen = super().evaluate(theta)
            self.costs.append(seen.cost)
            return seen

    problem = Watched(np.zeros((2, 2)), np.zeros(2))
    problem.costs = []
    costs = [
        minimise(problem, np.array([-1.2, 1.0]), method, tolerance=1e-12, max_iterations=k).evaluation.cost
        for k in range(1, 12)
    ]
    assert costs == sorted(costs, reverse=True)


def test_what_is_not_finite_is_refused() -> None:
    problem = _Linear(np.ones((3, 1)), np.array([np.inf, 0.0, 0.0]))
    with pytest.raises(NotIdentifiableError, match="not finite where the fit starts"):
        minimise(problem, np.zeros(1), "lm", tolerance=1e-9, max_iterations=5)


def test_where_the_least_lies_on_a_bound_no_reflection_keeps_from_it() -> None:
    """A full step beyond a bound comes back from it as far; from there the same step comes to the same place."""
    problem = _Linear(np.eye(2), np.array([3.0, 0.5]), np.zeros(2), np.array([2.0, 1.0]))
    found = minimise(problem, np.array([0.1, 0.1]), "trf", tolerance=1e-10, max_iterations=50)
    assert found.converged
    assert found.theta == pytest.approx([2.0, 0.5])


@settings(max_examples=30)
@given(st.integers(0, 9999))
def test_beyond_bounds_the_better_of_the_reflection_and_the_bound_is_taken(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tilted = np.linalg.qr(rng.standard_normal((2, 2)))[0] * np.array([1.0, 0.05])
    lower, upper = np.array([-1.0, -np.inf]), np.array([np.inf, 1.0])
    problem = _Linear(tilted.T, rng.standard_normal(2), lower, upper)
    theta = np.array([rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)])
    now = problem.evaluate(theta)
    newton, walk = solve_normal(now.normal, now.gradient), _TrustRegion(now)
    trial = theta - walk.step(now, newton, np.ones(2, dtype=bool))
    bound = np.array([max(trial[0], -1.0), min(trial[1], 1.0)])
    back = np.array([max(trial[0], -2.0 - trial[0]), min(trial[1], 2.0 - trial[1])])
    taken = walk.keep_inside(trial, problem)
    costs = [problem.evaluate(one).cost for one in (taken, bound, back)]
    assert costs[0] == pytest.approx(min(costs), rel=1e-9, abs=1e-12)
    assert taken == pytest.approx(bound) or taken == pytest.approx(back)
    walk.radius = 1.0  # after a step that climbed there is only the bound
    assert walk.keep_inside(trial, problem) == pytest.approx(bound)
    for other in (_WALKS["gn"](now), _LevenbergMarquardt(now)):
        assert other.keep_inside(trial, problem) == pytest.approx(bound)


def test_within_a_radius_the_step_is_the_best_of_that_length() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((12, 3)), rng.standard_normal(12)
    now = _Linear(a, b).evaluate(np.zeros(3))
    newton, free = solve_normal(now.normal, now.gradient), np.ones(3, dtype=bool)
    walk = _TrustRegion(now)
    assert walk.step(now, newton, free) == pytest.approx(newton)
    scaled = float(np.linalg.norm(walk.scale * newton))
    walk.radius = 0.4 * scaled
    step = walk.step(now, newton, free)
    assert float(np.linalg.norm(walk.scale * step)) == pytest.approx(walk.radius, rel=1e-6)

    def cost(by: Array) -> float:
        return float(np.sum((a @ -by - b) ** 2))

    for _ in range(50):
        other = step + 0.05 * rng.standard_normal(3) * np.abs(step)
        other *= walk.radius / np.linalg.norm(walk.scale * other)
        assert cost(other) >= cost(step) - 1e-9


def test_a_trust_region_grows_with_good_steps_and_shrinks_with_bad_ones() -> None:
    now = Evaluation(1.0, np.ones(1), np.eye(1), 1)
    move = np.array([2.0])
    for gained, predicted, ratio in ((0.5, 0.5, 2.0), (0.25, 0.5, 1.0), (0.01, 0.5, 0.25), (-0.5, 0.5, 0.25)):
        walk = _TrustRegion(now)
        walk.radius = 2.0
        accepted = walk.judge(now, Evaluation(1.0 - gained, now.gradient, now.normal, 1), predicted, move)
        assert accepted is (gained >= 0.0)
        assert walk.radius == pytest.approx(2.0 * ratio)


def test_damping_follows_how_good_a_step_was() -> None:
    now = Evaluation(1.0, np.ones(1), np.eye(1), 1)

    def judged(gained: float) -> _LevenbergMarquardt:
        walk = _LevenbergMarquardt(now)
        walk.judge(now, Evaluation(1.0 - gained, now.gradient, now.normal, 1), 0.5, np.ones(1))
        return walk

    start = _LevenbergMarquardt(now).damping
    # Nielsen's rule: a third where all that was promised came, as it was where half of it did.
    assert judged(0.5).damping == pytest.approx(start / 3.0)
    assert judged(0.25).damping == pytest.approx(start)
    worse = judged(-0.1)
    assert (worse.damping, worse.growth) == (pytest.approx(2.0 * start), 4.0)


def test_normal_equations_are_solved_whatever_the_units_and_where_they_are_singular() -> None:
    rng = np.random.default_rng(2)
    a = rng.standard_normal((20, 3)) * np.array([1e-8, 1.0, 1e8])
    b = rng.standard_normal(20)
    assert solve_normal(a.T @ a, a.T @ b) == pytest.approx(np.linalg.lstsq(a, b, rcond=1e-30)[0], rel=1e-6)
    twice = np.column_stack([a[:, 1], a[:, 1], np.zeros(20)])
    found = solve_normal(twice.T @ twice, twice.T @ b)
    alone = float(a[:, 1] @ b / (a[:, 1] @ a[:, 1]))
    assert found == pytest.approx([alone / 2.0, alone / 2.0, 0.0])
