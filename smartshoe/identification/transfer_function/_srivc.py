"""SRIVC for any order: the simplified refined instrumental variable method for continuous time.

Young and Jakeman (1980), Garnier and Wang (2008, chapter 4). Least squares behind a state-variable filter 1/(s +
lambda)^n gives the start; then the filter 1/A and the instrument (the auxiliary model's own filtered derivatives) are
updated until they converge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError
from smartshoe.identification.transfer_function._discrete import StateVariableFilter, prefilter
from smartshoe.identification.transfer_function._problem import ErrorGradient, OutputError

NEGLIGIBLE_STEP = 1e-3  # standard errors, over all parameters together
FIRST_STEPS, FIRST_CLIMB = 3, 1.5  # steps that may raise the cost, and by how much
HALVINGS = 14


@dataclass(frozen=True)
class Settled:
    """theta, the number of updates, whether they converged, and the cost e'e there."""

    theta: Array
    iterations: int
    converged: bool
    cost: float


def reflected(denominator: Array) -> Array:
    """``denominator`` (n,) without its leading 1, with roots of the right half plane mirrored into the left."""
    roots = np.roots(np.concatenate([[1.0], denominator]))
    if not (roots.real > 0.0).any():
        return denominator
    return np.asarray(np.real(np.poly(np.where(roots.real > 0.0, -roots.conj(), roots)))[1:], dtype=float)


def least_squares(problem: OutputError, prefilter_rad_s: float, delay_s: float) -> Array:
    """theta by least squares on y^(n) = -A y + B u behind 1/(s + lambda)^n; the output is linear between samples."""
    n = problem.poles
    chain = prefilter(n, prefilter_rad_s)
    rows, _ = chain.derivatives_of_x()
    powers = list(range(problem.zeros, -1, -1))
    tall = []
    for index, experiment in enumerate(problem.experiments):
        first = problem.firsts[index]
        counted = experiment.counted[first:]
        y = experiment.y[first:] - (problem.offset or 0.0)
        run_u = problem.forced(chain, index, delay_s)
        run_y = problem.filtered(chain, index, y)
        if not (np.isfinite(run_u.states).all() and np.isfinite(run_y.states).all()):
            raise NotIdentifiableError(
                f"the prefilter of {prefilter_rad_s:g} rad/s has no finite output: give one nearer the poles"
            )
        inputs = run_u.states @ rows[powers].T
        if problem.zeros == n:
            inputs[:, 0] += run_u.value
        outputs = run_y.states @ rows[n - 1 :: -1][:n].T
        highest = run_y.states @ rows[n] + y
        # The filter's initial state is unknown in any case, since the output's first value is noisy.
        nuisance = problem.nuisance(chain, index, problem.free(chain, index))
        block = np.hstack([inputs, -outputs, highest[:, None]])
        block[~counted] = 0.0
        tall.append(nuisance.clear(block))
    stacked = np.vstack(tall)
    norm = np.sqrt(np.einsum("ij,ij->j", stacked, stacked))
    if not (np.isfinite(norm).all() and (norm[:-1] > 0.0).all()):
        raise NotIdentifiableError("the input does not excite the model: record one with more than one frequency")
    solution = np.linalg.lstsq(stacked[:, :-1] / norm[:-1], stacked[:, -1], rcond=None)[0] / norm[:-1]
    return np.asarray(solution)


def srivc(
    problem: OutputError,
    theta: Array,
    *,
    tolerance: float,
    max_iterations: int,
    delay_bounds_s: tuple[float, float] = (0.0, np.inf),
) -> Settled:
    """Update filter and instrument from ``theta`` until a step is below ``tolerance`` of theta or negligible.

    The regressors are the filtered derivatives of the measured output. Between samples only the residual is taken as
    linear; the model's part is exact, so that noise-free data give the exact result and the fixed point is the output
    error's optimum. A delay is estimated by a Gauss-Newton step alongside. Where the step leads uphill (the iteration
    has no proof of convergence, and may cycle on poor data), the Gauss-Newton step, which uses the instruments as
    regressors, replaces it.
    """
    theta = _inside(problem, theta, delay_bounds_s)
    looks = problem.look(theta)
    cost = _cost(looks)
    for iteration in range(1, max_iterations + 1):
        ways = _Ways(problem, looks, theta, delay_bounds_s)
        step, relative, length = ways.refined()
        noise = np.sqrt(cost / max(problem.count - theta.size, 1))
        settled = relative < tolerance or length <= NEGLIGIBLE_STEP * noise
        best: tuple[float, Array, list[ErrorGradient]] | None = None
        for attempt in range(HALVINGS):
            if attempt == 1:
                step, _, _ = ways.descending()
            fraction = 1.0 if attempt < 2 else 0.5 ** (attempt - 1)
            trial = _inside(problem, theta + fraction * step, delay_bounds_s)
            try:
                following = problem.look(trial)
            except FloatingPointError:
                continue
            reached = _cost(following)
            if best is None or reached < best[0]:
                best = (reached, trial, following)
            # The first steps start from such a poor model that going uphill may be right.
            if settled or reached <= cost * (FIRST_CLIMB if iteration <= FIRST_STEPS else 1.0):
                best = (reached, trial, following)
                break
        if best is None:
            return Settled(theta, iteration, False, cost)
        if best[0] > cost and iteration > FIRST_STEPS and not settled:
            # No step leads downhill beyond rounding: this is the optimum if the remaining step is negligible.
            return Settled(theta, iteration, length <= 0.1 * noise or relative < 1e3 * tolerance, cost)
        cost, theta, looks = best
        if settled:
            return Settled(theta, iteration, True, cost)
    return Settled(theta, max_iterations, False, cost)


def _cost(looks: Sequence[ErrorGradient]) -> float:
    return float(sum(look.error @ look.error for look in looks))


def _inside(problem: OutputError, theta: Array, delay_bounds_s: tuple[float, float]) -> Array:
    theta = theta.copy()
    m = problem.zeros + 1
    theta[m : m + problem.poles] = reflected(theta[m : m + problem.poles])
    if problem.delayed:
        theta[-1] = float(np.clip(theta[-1], *delay_bounds_s))
    return theta


class _Ways:
    """The steps available at one theta; each is the step, its relative size, and how far it moves the output.

    The delay moves by at most one sample and stays within its bounds; the rest is solved given that move.
    """

    def __init__(
        self, problem: OutputError, looks: Sequence[ErrorGradient], theta: Array, delay_bounds_s: tuple[float, float]
    ) -> None:
        self.problem, self.looks, self.theta, self.bounds = problem, looks, theta, delay_bounds_s
        instruments = np.vstack([look.columns for look in looks])
        self.norm = np.sqrt(np.einsum("ij,ij->j", instruments, instruments))
        if not (self.norm > 0.0).all():
            raise NotIdentifiableError("a coefficient has no effect on the output: give fewer poles or zeros")
        self.basis, self.triangle = np.linalg.qr(instruments / self.norm)
        self.error = self.basis.T @ np.concatenate([look.error for look in looks])

    def refined(self) -> tuple[Array, float, float]:
        """SRIVC's step: rows of the instruments, with the measured output's filtered derivatives as regressors."""
        m, n = self.problem.zeros + 1, self.problem.poles
        chain = StateVariableFilter(self.theta[m : m + n], levels=1)
        rows, _ = chain.derivatives_of_x()
        straight = []
        for index, look in enumerate(self.looks):
            run = self.problem.filtered(chain, index, look.error)
            filtered = run.states @ rows[n - 1 :: -1][:n].T
            filtered[~self.problem.experiments[index].counted[self.problem.firsts[index] :]] = 0.0
            straight.append(look.nuisance.clear(filtered))
        normal = self.triangle.copy()
        normal[:, m : m + n] -= self.basis.T @ (np.vstack(straight) / self.norm[m : m + n])
        return self._solved(normal)

    def descending(self) -> tuple[Array, float, float]:
        """Gauss-Newton's step: the same without the residual's filtered derivatives."""
        return self._solved(self.triangle)

    def _solved(self, normal: Array) -> tuple[Array, float, float]:
        moved = np.linalg.lstsq(normal, self.error, rcond=1e-15)[0]
        if self.problem.delayed:
            most = max(experiment.typical_step_s for experiment in self.problem.experiments)
            lowest = max(-most, self.bounds[0] - self.theta[-1]) * self.norm[-1]
            highest = min(most, self.bounds[1] - self.theta[-1]) * self.norm[-1]
            if not lowest <= moved[-1] <= highest:
                moved[-1] = np.clip(moved[-1], lowest, highest)
                # The delay comes last, so that the instruments before it are the leading columns of the basis.
                left = self.error[:-1] - normal[:-1, -1] * moved[-1]
                moved[:-1] = np.linalg.lstsq(normal[:-1, :-1], left, rcond=1e-15)[0]
        share = float(np.linalg.norm(moved) / np.linalg.norm(self.norm * self.theta))
        return moved / self.norm, share, float(np.linalg.norm(self.triangle @ moved))
