"""Non-linear least squares on normal equations: Gauss-Newton, Levenberg-Marquardt, trust region reflective.

The three differ in how they take a step. They share the problem's error and gradient, the bounds and the termination
test, so that they end at the same optimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import NotIdentifiableError

Solver = Literal["gn", "lm", "trf"]

# A Gauss-Newton step predicted to gain less than this share of one residual's variance is 1e-4 standard errors
# long; after it the remaining distance to the optimum is of second order.
NEGLIGIBLE = 1e-8
ROUNDING = 1e-14  # of the cost: a smaller change is rounding, not descent
SINGULAR = 1e-15


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Results at one theta: ``cost`` = e'e, ``gradient`` (p,) = J'e, ``normal`` (p, p) = J'J, ``count`` of errors e."""

    cost: float
    gradient: Array
    normal: Array
    count: int


class Problem(Protocol):
    """What `minimise` requires: bounds (size,), infinite where there are none, and one pass over the data."""

    @property
    def size(self) -> int:
        """The number of unknowns."""

    @property
    def lower(self) -> Array:
        """Lower bounds."""

    @property
    def upper(self) -> Array:
        """Upper bounds."""

    def evaluate(self, theta: Array) -> Evaluation:
        """Cost, gradient and normal matrix at ``theta`` (size,)."""


@dataclass(frozen=True, slots=True)
class Minimum:
    """The result of `minimise`: theta, the evaluation there, the number of ``iterations``, and whether it converged."""

    theta: Array
    evaluation: Evaluation
    iterations: int
    converged: bool


def solve_normal(normal: Array, right: Array) -> Array:
    """x with normal x = right, columns scaled by their norm; the x of smallest norm where the matrix is singular."""
    scale = np.sqrt(np.maximum(normal.diagonal(), 0.0))  # rounding may make a zero column's entry negative
    if not scale.all():
        scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(normal / (scale[:, np.newaxis] * scale))
    along = vectors.T @ (right / scale)
    usable = values > SINGULAR * values[-1]
    if usable.all():
        along /= values
    else:
        along = np.where(usable, along / np.where(usable, values, 1.0), 0.0)
    x: Array = vectors @ along / scale
    return x


def minimise(problem: Problem, theta: Array, method: Solver, *, tolerance: float, max_iterations: int) -> Minimum:
    """The least-squares solution from ``theta`` on; ``tolerance`` is the relative change of theta at which it ends.

    It also ends where the full Gauss-Newton step, which is then still taken, is below 1e-4 standard errors. Raises
    `NotIdentifiableError` where the normal equations have no finite solution.
    """
    theta = np.minimum(np.maximum(theta, problem.lower), problem.upper)
    now = problem.evaluate(theta)
    if not np.isfinite(now.cost):
        raise NotIdentifiableError(
            "the error is not finite where the fit starts: record a load that rises and falls at several rates"
        )
    walk = _WALKS[method](now)
    for iteration in range(1, max_iterations + 1):
        free = _free(problem, theta, now.gradient)
        newton = _newton_step(now, free)
        promised = float(newton @ now.gradient)
        if promised <= NEGLIGIBLE * now.cost / max(now.count, 1):
            # The step is worth taking, but not another pass over the data.
            last = np.minimum(np.maximum(theta - newton, problem.lower), problem.upper)
            return Minimum(last, now, iteration, True)
        for _ in range(60):
            step = walk.step(now, newton, free)
            trial = walk.keep_inside(theta - step, problem)
            move = theta - trial
            following = problem.evaluate(trial)
            predicted = _promised(now, move)
            accepted = walk.judge(now, following, predicted, move)
            if accepted or float(np.max(np.abs(move) / (np.abs(theta) + 1e-300))) < 1e-16:
                break
        if not accepted:
            # No further descent beyond rounding: this is the optimum if the predicted gain was small.
            return Minimum(theta, now, iteration, promised <= 1e-7 * now.cost)
        size = np.abs(trial)
        change = float((np.abs(move) / (size + (1e-3 * size.max() + 1e-300))).max())
        gained = now.cost - following.cost
        theta, before, now = trial, now.cost, following
        if change < tolerance or (gained <= ROUNDING * before and predicted <= 1e-6 * before):
            return Minimum(theta, now, iteration, True)
    return Minimum(theta, now, max_iterations, False)


def _free(problem: Problem, theta: Array, gradient: Array) -> Mask:
    """Mask of the unknowns that may move: not those at a bound that the descent would cross."""
    if (theta > problem.lower).all() and (theta < problem.upper).all():
        return np.ones(theta.size, dtype=bool)
    held = ((theta <= problem.lower) & (gradient > 0)) | ((theta >= problem.upper) & (gradient < 0))
    return ~held


def _newton_step(now: Evaluation, free: Mask) -> Array:
    if not (np.isfinite(now.normal).all() and np.isfinite(now.gradient).all()):
        raise NotIdentifiableError(
            "the normal equations are not finite: record a load that rises and falls at several rates"
        )
    if free.all():
        return solve_normal(now.normal, now.gradient)
    step = np.zeros(free.size)
    if free.any():
        step[free] = solve_normal(now.normal[np.ix_(free, free)], now.gradient[free])
    return step


def _promised(now: Evaluation, move: Array) -> float:
    """The predicted decrease of the linearised problem's cost from theta to theta - ``move``."""
    return float(2.0 * move @ now.gradient - move @ now.normal @ move)


def _length(vector: Array) -> float:
    return math.sqrt(float(vector @ vector))


class _GaussNewton:
    """The full step, halved until the error no longer grows (Chinimilli 2016, Section V)."""

    def __init__(self, _: Evaluation) -> None:
        self.fraction = 1.0

    def step(self, now: Evaluation, newton: Array, free: Mask) -> Array:
        return self.fraction * newton

    def keep_inside(self, trial: Array, problem: Problem) -> Array:
        inside: Array = np.clip(trial, problem.lower, problem.upper)
        return inside

    def judge(self, now: Evaluation, following: Evaluation, predicted: float, move: Array) -> bool:
        accepted = bool(following.cost <= now.cost)
        self.fraction = 1.0 if accepted else self.fraction / 2
        return accepted


class _LevenbergMarquardt(_GaussNewton):
    """Marquardt's scaling, damping by Nielsen's rule (Madsen, Nielsen, Tingleff 2004, Algorithm 3.16)."""

    def __init__(self, first: Evaluation) -> None:
        self.damping, self.growth = 1e-4, 2.0
        self.scale = first.normal.diagonal().copy()

    def step(self, now: Evaluation, newton: Array, free: Mask) -> Array:
        self.scale = np.maximum(self.scale, now.normal.diagonal())
        damped = now.normal + self.damping * np.diag(self.scale)
        step = np.zeros(newton.size)
        step[free] = solve_normal(damped[np.ix_(free, free)], now.gradient[free])
        return step

    def judge(self, now: Evaluation, following: Evaluation, predicted: float, move: Array) -> bool:
        gained = now.cost - following.cost
        if gained >= 0.0 and np.isfinite(following.cost):
            share = gained / predicted if predicted > 0.0 else 1.0
            self.damping = max(self.damping * max(1 / 3, 1 - (2 * share - 1) ** 3), 1e-14)
            self.growth = 2.0
            return True
        self.damping *= self.growth
        self.growth *= 2.0
        return False


class _TrustRegion(_GaussNewton):
    """Exact step within an ellipsoid of the columns' norms, reflected at bounds (Branch, Coleman, Li 1999)."""

    def __init__(self, first: Evaluation) -> None:
        self.radius = np.inf
        self.scale = np.sqrt(np.maximum(first.normal.diagonal(), 1e-300))
        self.last = first, np.zeros(first.gradient.size)  # the last evaluation and the full step from there

    def step(self, now: Evaluation, newton: Array, free: Mask) -> Array:
        self.scale = np.sqrt(np.maximum(self.scale**2, now.normal.diagonal()))
        self.last = now, newton
        if self.radius == np.inf or _length(self.scale * newton) <= self.radius:
            return newton
        scale = self.scale[free]
        values, vectors = np.linalg.eigh(now.normal[np.ix_(free, free)] / np.outer(scale, scale))
        values = np.maximum(values, 0.0)
        along = vectors.T @ (now.gradient[free] / scale)
        # |along/(values + mu)| decreases with mu: bisection needs no derivative and cannot fail.
        low, high = 0.0, float(np.linalg.norm(along)) / self.radius
        for _ in range(60):
            middle = 0.5 * (low + high)
            if float(np.linalg.norm(along / (values + middle))) > self.radius:
                low = middle
            else:
                high = middle
        step = np.zeros(newton.size)
        step[free] = vectors @ (along / (values + high)) / scale
        return step

    def keep_inside(self, trial: Array, problem: Problem) -> Array:
        if (trial >= problem.lower).all() and (trial <= problem.upper).all():
            return trial
        on_bounds: Array = np.clip(trial, problem.lower, problem.upper)
        if self.radius < np.inf:  # a reflected step has raised the cost before
            return on_bounds
        reflected = np.where(trial < problem.lower, 2 * problem.lower - trial, trial)
        reflected = np.where(reflected > problem.upper, 2 * problem.upper - reflected, reflected)
        reflected = np.clip(np.where(np.isfinite(reflected), reflected, trial), problem.lower, problem.upper)
        # Choose the larger predicted gain: the minimum may lie on a bound, about which reflections oscillate.
        now, newton = self.last
        return max(on_bounds, reflected, key=lambda point: _promised(now, trial + newton - point))

    def judge(self, now: Evaluation, following: Evaluation, predicted: float, move: Array) -> bool:
        gained = now.cost - following.cost
        share = gained / predicted if predicted > 0.0 else -1.0
        length = _length(self.scale * move)
        if not np.isfinite(following.cost) or share < 0.25:
            self.radius = 0.25 * length
        elif share > 0.75 and length > 0.95 * self.radius:
            self.radius *= 2.0
        return bool(gained >= 0.0 and np.isfinite(following.cost))


_WALKS: dict[str, type[_GaussNewton]] = {"gn": _GaussNewton, "lm": _LevenbergMarquardt, "trf": _TrustRegion}
