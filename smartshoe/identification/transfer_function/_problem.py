"""The output error of a continuous-time transfer function, its analytic gradient, and what SRIVC needs besides.

y(t) = B(s)/A(s) exp(-s tau) u + C(s)/A(s) delta + offset: the initial state of an experiment acts like an impulse at
its first sample, seen through a numerator C of its own (its coefficients are the initial state in observer form). C and
the offset enter linearly, so they are fitted at every theta and projected out of the gradient (variable projection,
Golub and Pereyra 1973, with Kaufman's gradient, which is exact for the cost's gradient). What remains is theta = (B, A
without its leading 1, tau), highest powers first, whose size does not depend on the number of experiments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.identification._solve import Evaluation
from smartshoe.identification.transfer_function._discrete import Intersample, StateVariableFilter, Trajectory
from smartshoe.identification.transfer_function._experiment import InputOutput

InitialState = Literal["estimate", "steady", "rest"]
RANK_TOLERANCE = 1e-11  # of the largest column: an initial state that decays within a step has no effect


@dataclass(frozen=True, eq=False)
class Nuisance:
    """The linear unknowns of one experiment: ``basis`` (n, r) orthonormal, and the map back to coefficients.

    Fitted output = basis @ t; coefficients = ``back`` (c, r) @ t, initial state before offset.
    """

    basis: Array
    back: Array

    def clear(self, columns: Array) -> Array:
        """``columns`` (n,) or (n, k) with their projection on the basis removed."""
        if not self.basis.shape[1]:
            return columns
        left: Array = columns - self.basis @ (self.basis.T @ columns)
        return left


@dataclass(frozen=True, eq=False)
class ErrorGradient:
    """One experiment at one theta: ``error`` (n,) = measured - model, ``columns`` (n, p) = d model / d theta.

    In both, the nuisance parameters are projected out, and uncounted samples are 0. ``coefficients`` are the nuisance
    parameters. ``leaning`` (r, p) is the projection of the columns on their basis, needed for their covariance.
    """

    error: Array
    columns: Array
    nuisance: Nuisance
    coefficients: Array
    leaning: Array


@dataclass(frozen=True)
class Structure:
    """What is fitted: degrees of A and B, the input between samples, an experiment's initial state, and the offset.

    ``hold`` tells whether the input is constant or linear between samples. ``offset`` is in the output's unit, None
    where each experiment has its own estimated one.
    """

    poles: int
    zeros: int
    hold: Intersample
    initial_state: InitialState
    offset: float | None


class OutputError:
    """Experiments and a structure; `Whitened` makes it a `smartshoe.identification._solve.Problem`.

    ``firsts`` are the first counted samples. With an estimated initial state, an experiment begins at ``most_delay_s``
    (by default ``delay_s``), where the delayed input begins, since the input before is not known; otherwise the first
    input is assumed to have lasted before. ``delayed`` tells whether theta contains the delay; if not, it is
    ``delay_s``.
    """

    def __init__(
        self,
        experiments: Sequence[InputOutput],
        structure: Structure,
        *,
        delayed: bool,
        delay_s: float = 0.0,
        most_delay_s: float | None = None,
    ) -> None:
        self.experiments = experiments
        self.poles, self.zeros, self.hold = structure.poles, structure.zeros, structure.hold
        self.initial_state, self.offset = structure.initial_state, structure.offset
        self.delayed, self.delay_s = delayed, delay_s
        self.most_delay_s = delay_s if most_delay_s is None else most_delay_s
        self.firsts = [self._first(experiment) for experiment in experiments]
        self.drives = [self._drive(experiment) for experiment in experiments]
        self.count = sum(
            int(np.count_nonzero(one.counted[first:])) for one, first in zip(experiments, self.firsts, strict=True)
        )

    @property
    def size(self) -> int:
        """The number of shared parameters."""
        return self.zeros + 1 + self.poles + self.delayed

    def _first(self, experiment: InputOutput) -> int:
        if self.initial_state != "estimate" or self.most_delay_s <= 0.0:
            return 0
        latest = max(experiment.time_s.size - 1, 0)
        return min(int(np.searchsorted(experiment.time_s, self.most_delay_s * (1.0 - 1e-9))), latest)

    def _drive(self, experiment: InputOutput) -> tuple[Array, Array, int]:
        """Input, its times, and the number of prepended samples: at rest the input was 0 before the record."""
        u, knots = experiment.u, experiment.time_s
        if self.initial_state != "rest":
            return u, knots, 0
        return np.concatenate([[0.0], u]), np.concatenate([[-experiment.typical_step_s], knots]), 1

    def split(self, theta: Array) -> tuple[Array, Array, float]:
        """Numerator, denominator without its leading 1, and delay in s."""
        m = self.zeros + 1
        return theta[:m], theta[m : m + self.poles], float(theta[-1]) if self.delayed else self.delay_s

    def forced(self, chain: StateVariableFilter, index: int, delay_s: float, start: Array | None = None) -> Trajectory:
        """The chain driven by the input of experiment ``index`` from its first counted sample, starting in ``start``.

        By default it starts from 0, or for a steady start from equilibrium with the first input.
        """
        experiment = self.experiments[index]
        u, knots, before = self.drives[index]
        begin = self.firsts[index]
        if start is None:
            start = chain.steady(float(u[0])) if self.initial_state == "steady" else np.zeros(chain.size)
        count = experiment.time_s.size - begin
        if experiment.step_s is not None:
            return chain.run_even(u, begin + before, count, start, experiment.step_s, self.hold, delay_s)
        return chain.run_uneven(u, knots, experiment.time_s[begin:], start, self.hold, delay_s)

    def filtered(self, chain: StateVariableFilter, index: int, signal: Array) -> Trajectory:
        """The chain driven by ``signal``, one value per sample from the first counted one, linear in between."""
        experiment = self.experiments[index]
        time_s = experiment.time_s[self.firsts[index] :]
        start = np.zeros(chain.size)
        if experiment.step_s is not None:
            return chain.run_even(signal, 0, signal.size, start, experiment.step_s, "foh", 0.0)
        return chain.run_uneven(signal, time_s, time_s, start, "foh", 0.0)

    def free(self, chain: StateVariableFilter, index: int) -> Array:
        """The chain's states after an impulse at the first counted sample."""
        experiment = self.experiments[index]
        return chain.run_free(experiment.time_s[self.firsts[index] :], experiment.step_s)

    def nuisance(self, chain: StateVariableFilter, index: int, free: Array | None) -> Nuisance:
        """The orthonormal basis of the linear unknowns of experiment ``index``; 0 where a sample is not counted."""
        from scipy.linalg import qr, solve_triangular

        counted = self.experiments[index].counted[self.firsts[index] :]
        columns = []
        if free is not None:
            columns.append(free[:, chain.size - chain.order :])
        if self.offset is None:
            columns.append(np.ones((counted.size, 1)))
        if not columns:
            return Nuisance(np.zeros((counted.size, 0)), np.zeros((0, 0)))
        stacked = np.hstack(columns)
        stacked[~counted] = 0.0
        norm = np.sqrt(np.einsum("ij,ij->j", stacked, stacked))
        norm[norm == 0.0] = 1.0
        basis, triangle, order = qr(stacked / norm, mode="economic", pivoting=True, check_finite=False)
        rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > RANK_TOLERANCE * abs(triangle[0, 0])))
        back = np.zeros((norm.size, rank))
        back[order[:rank]] = solve_triangular(triangle[:rank, :rank], np.eye(rank))
        return Nuisance(np.asarray(basis[:, :rank]), back / norm[:, None])

    def look(self, theta: Array) -> list[ErrorGradient]:
        """Error and gradient of every experiment at ``theta`` (size,); not finite at an impossible theta."""
        numerator, denominator, delay_s = self.split(theta)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            chain = StateVariableFilter(denominator)
            x_rows, x_inputs = chain.derivatives_of_x()
            forced_map = chain.denominator_map(numerator)
            powers = range(self.zeros, -1, -1)
            looks = []
            frees: dict[float, Array] = {}
            for index, experiment in enumerate(self.experiments):
                first = self.firsts[index]
                run = self.forced(chain, index, delay_s)
                given = np.stack([run.value, run.slope])
                numerators = run.states @ x_rows[list(powers)].T
                if self.zeros == self.poles:
                    numerators[:, 0] += run.value
                target = experiment.y[first:] - (self.offset or 0.0)
                error = np.where(experiment.counted[first:], target - numerators @ numerator, 0.0)
                free = self._free(chain, index, frees) if self.initial_state == "estimate" else None
                if not np.isfinite(error).all() or (free is not None and not np.isfinite(free).all()):
                    raise FloatingPointError("the model's output is not finite")
                nuisance = self.nuisance(chain, index, free)
                taken = nuisance.basis.T @ error
                coefficients = nuisance.back @ taken
                denominators = -run.states @ forced_map.T
                if free is not None:
                    # The coefficients of the state belong to balanced derivatives, lowest first.
                    own = (coefficients[: self.poles] / chain.scale[-self.poles :])[::-1]
                    denominators -= free @ chain.denominator_map(own).T
                columns = [numerators, denominators]
                if self.delayed:
                    rising = [power + 1 for power in powers]
                    rate = run.states @ (numerator @ x_rows[rising]) + (numerator @ x_inputs[rising]) @ given
                    columns.append(-rate[:, None])
                shared = np.hstack(columns)
                if not np.isfinite(shared).all():
                    raise FloatingPointError("the model's gradient is not finite")
                if not experiment.counted.all():
                    shared[~experiment.counted[first:]] = 0.0
                leaning = nuisance.basis.T @ shared
                looks.append(
                    ErrorGradient(
                        error - nuisance.basis @ taken,
                        shared - nuisance.basis @ leaning if leaning.size else shared,
                        nuisance,
                        coefficients,
                        leaning,
                    )
                )
        return looks

    def cost(self, theta: Array) -> float:
        """The sum of squares e'e at ``theta``."""
        return float(sum(one.error @ one.error for one in self.look(theta)))

    def output(self, theta: Array, index: int) -> Array:
        """The model's output (n,) of experiment ``index`` without offset and estimated initial state."""
        numerator, denominator, delay_s = self.split(theta)
        chain = StateVariableFilter(denominator, levels=1)
        rows, inputs = chain.derivatives_of_x()
        powers = list(range(self.zeros, -1, -1))
        run = self.forced(chain, index, delay_s)
        output: Array = run.states @ (numerator @ rows[powers]) + (numerator @ inputs[powers])[0] * run.value
        return output

    def _free(self, chain: StateVariableFilter, index: int, known: dict[float, Array]) -> Array:
        step = self.experiments[index].step_s
        if step is None:
            return self.free(chain, index)
        count = self.experiments[index].time_s.size - self.firsts[index]
        if step not in known or known[step].shape[0] < count:
            known[step] = self.free(chain, index)
        return known[step][:count]


class Whitened:
    """The problem in coordinates ``rotation`` @ theta, whose gradient columns are orthonormal at the start of the fit.

    Coefficients of high powers are nearly collinear and differ widely in size; in these coordinates the normal matrix
    is near the identity, so that forming it loses no digits. The rotation is upper triangular and the delay comes last,
    so that the delay's bounds remain bounds.
    """

    def __init__(self, problem: OutputError, theta: Array, delay_bounds_s: tuple[float, float] = (0.0, np.inf)) -> None:
        self.problem = problem
        self.rotation = orthogonal_factor(np.vstack([look.columns for look in problem.look(theta)]))
        self.size = problem.size
        self.lower, self.upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        if problem.delayed:
            self.lower[-1], self.upper[-1] = np.multiply(delay_bounds_s, self.rotation[-1, -1])

    def inside(self, theta: Array) -> Array:
        """theta converted to these coordinates."""
        rotated: Array = self.rotation @ theta
        return rotated

    def outside(self, rotated: Array) -> Array:
        """theta from these coordinates."""
        from scipy.linalg import solve_triangular

        return np.asarray(solve_triangular(self.rotation, rotated))

    def evaluate(self, rotated: Array) -> Evaluation:
        """Cost, gradient and normal matrix; an infinite cost where the model has no finite output."""
        from scipy.linalg import solve_triangular

        try:
            looks = self.problem.look(self.outside(rotated))
        except FloatingPointError:
            return Evaluation(np.inf, np.zeros(self.size), np.eye(self.size), self.problem.count)
        cost, gradient, normal = 0.0, np.zeros(self.size), np.zeros((self.size, self.size))
        with np.errstate(over="ignore", invalid="ignore"):
            for look in looks:
                columns = solve_triangular(self.rotation, look.columns.T, trans="T", check_finite=False)
                cost += float(look.error @ look.error)
                gradient -= columns @ look.error
                normal += columns @ columns.T
        if not (np.isfinite(cost) and np.isfinite(normal).all()):
            return Evaluation(np.inf, np.zeros(self.size), np.eye(self.size), self.problem.count)
        return Evaluation(cost, gradient, normal, self.problem.count)


def orthogonal_factor(columns: Array) -> Array:
    """Upper triangular R (p, p) with columns = Q R and a positive diagonal; raises where a column has no effect."""
    norm = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    if not (norm > 0.0).all() or not np.isfinite(norm).all():
        raise FloatingPointError("a parameter has no effect on the output")
    triangle = np.linalg.qr(columns / norm, mode="r")
    diagonal = np.diag(triangle)
    sign = np.where(diagonal < 0.0, -1.0, 1.0)
    floor = np.finfo(float).eps
    upper = sign[:, None] * triangle
    upper[np.diag_indices_from(upper)] = np.maximum(np.abs(diagonal), floor)
    return np.asarray(upper * norm)
