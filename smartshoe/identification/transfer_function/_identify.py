"""`identify_transfer_function`: a continuous-time transfer function of any order from sampled input and output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any, Literal, get_args

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification._solve import minimise
from smartshoe.identification.transfer_function import _delay as delay
from smartshoe.identification.transfer_function._discrete import Intersample
from smartshoe.identification.transfer_function._estimate import Ending, TransferFunctionEstimate, summarise
from smartshoe.identification.transfer_function._experiment import InputOutput, prepare
from smartshoe.identification.transfer_function._problem import InitialState, OutputError, Structure, Whitened
from smartshoe.identification.transfer_function._srivc import Settled, least_squares, reflected, srivc
from smartshoe.kernels.blas import on_one_thread

Method = Literal["srivc", "gn", "lm", "trf"]
FALLBACK_RATIOS = (4.0, 0.25, 16.0, 1 / 16)
AUTOMATIC_PREFILTERS = 9
SHORT_LOOK = 4  # iterations of SRIVC to compare delays or prefilters
FRACTIONS = (0.0, 0.25, 0.5, 0.75, -0.25, -0.5, -0.75)
CELLS = 6  # samples of delay to move at most from the best start
NEAR_END = 1e-3  # samples from a cell's end that count as near
SAME_COST = 1e-5  # relative difference of costs that count as equal
SINGULAR = 1e-13  # of the scaled gradient's largest singular value: smaller ones are rounding


@dataclass(frozen=True)
class _FitOptions:
    """Options of the individual parts of the fit."""

    method: Method
    prefilter_rad_s: float | None
    tolerance: float
    max_iterations: int


@on_one_thread
def identify_transfer_function(  # noqa: PLR0913 - a public verb
    u: Any,
    y: Any,
    *,
    poles: int,
    zeros: int,
    sample_time_s: float | None = None,
    time_s: Any = None,
    method: Method = "trf",
    intersample: Intersample = "zoh",
    prefilter_rad_s: float | None = None,
    delay_s: float | Literal["estimate"] = 0.0,
    max_delay_s: float | None = None,
    initial_state: InitialState = "estimate",
    offset: float | Literal["estimate"] = "estimate",
    tolerance: float = 1e-8,
    max_iterations: int = 100,
    strict: bool = True,
) -> TransferFunctionEstimate:
    """Identify y = B(s)/A(s) exp(-delay s) u + offset, A monic of degree ``poles``, B of degree ``zeros``.

    Parameters
    ----------
    u, y
        Input and output (n,), or lists of them for several experiments, which share A, B and the delay; NaN is a
        missing sample.
    poles, zeros
        Degrees of A and B.
    sample_time_s, time_s
        The even sampling step in s, or instead the times (n,) in s, with any steps.
    method : {"trf", "gn", "lm", "srivc"}
        SRIVC alone, or one of the others started from it, which share one output error and analytic gradient.
    intersample : {"zoh", "foh"}
        Whether the input is constant or linear between samples.
    prefilter_rad_s
        The lambda of SRIVC's first filter, about the bandwidth; by default several are tried.
    delay_s, max_delay_s
        A number or "estimate", from 0 up to ``max_delay_s`` (by default a quarter of the shortest experiment, 500
        samples at most).
    initial_state : {"estimate", "rest", "steady"}
        "rest": input and output were 0 before; "steady": the first input had lasted forever.
    offset
        Of the output, in y's unit: "estimate", one for each experiment, or a number.
    tolerance, max_iterations, strict
        The fit ends where the relative change is below ``tolerance`` or far below a standard error; ``strict`` raises
        where it does not in ``max_iterations``.

    Raises
    ------
    NotIdentifiableError
        On data that cannot hold the answer.
    NotConvergedError
        Where ``strict`` and unsettled.
    UsageError, InputError
        On arguments that do not fit.

    Notes
    -----
    Young and Jakeman 1980; Garnier and Wang 2008.

    Examples
    --------
    >>> import numpy as np
    >>> import smartshoe
    >>> u = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], 60), 20)
    >>> y = np.zeros(u.size)  # y' = -1.5 y + 3 u, u held for steps of 0.05 s
    >>> for k in range(1, y.size):
    ...     y[k] = np.exp(-0.075) * y[k - 1] + 2.0 * (1.0 - np.exp(-0.075)) * u[k - 1]
    >>> found = smartshoe.identify_transfer_function(u, y, sample_time_s=0.05, poles=1, zeros=0)
    >>> found.denominator.round(6).tolist(), found.numerator.round(6).tolist()
    ([1.0, 1.5], [3.0])
    """
    fixed = None if offset == "estimate" else offset
    structure = Structure(poles, zeros, intersample, initial_state, fixed)
    options = _FitOptions(method, prefilter_rad_s, tolerance, max_iterations)
    _check(structure, options, delay_s, max_delay_s)
    experiments, missing = prepare(u, y, sample_time_s=sample_time_s, time_s=time_s, hold=intersample)
    _require_within(experiments, delay_s)
    unknowns = zeros + 1 + poles + (delay_s == "estimate")
    nuisances = len(experiments) * ((fixed is None) + (poles if initial_state == "estimate" else 0))
    counted = sum(int(np.count_nonzero(experiment.counted)) for experiment in experiments)
    if counted < 2 * unknowns + nuisances:
        raise NotIdentifiableError(
            f"{counted} samples for {unknowns + nuisances} unknowns: record {2 * unknowns + nuisances} at least"
        )
    fit = _StructureFit(experiments, structure, options)
    try:
        problem, found, started, notes = (
            fit.with_delay(max_delay_s) if delay_s == "estimate" else fit.at(float(delay_s))
        )
        looks = problem.look(found.theta)
        _require_distinct(np.vstack([look.columns for look in looks]))
    except FloatingPointError as error:
        raise NotIdentifiableError(
            f"the fit has no finite solution ({error}): record a richer input or give fewer poles"
        ) from error
    message = f"{method} " + ("settled" if found.converged else "did not settle") + f" in {found.iterations} iterations"
    if not found.converged and strict:
        raise NotConvergedError(
            f"{message}: give a prefilter_rad_s nearer the poles, fewer poles or zeros, or more max_iterations"
        )
    if missing:
        notes = [*notes, f"{missing} missing samples do not count"]
    return summarise(
        problem,
        found.theta,
        looks,
        ended=Ending(method, found.iterations, started, found.converged, message),
        n_missing=missing,
        notes=notes,
    )


class _StructureFit:
    """The fit of one data set with one structure, at a known or estimated delay."""

    def __init__(self, experiments: Sequence[InputOutput], structure: Structure, options: _FitOptions) -> None:
        self.experiments, self.structure, self.options = experiments, structure, options

    def problem(self, *, delayed: bool, delay_s: float = 0.0, most_delay_s: float | None = None) -> OutputError:
        """The output error of this data set with this structure, with the delay fixed or a parameter (``delayed``)."""
        return OutputError(
            self.experiments, self.structure, delayed=delayed, delay_s=delay_s, most_delay_s=most_delay_s
        )

    def at(self, delay_s: float) -> tuple[OutputError, Settled, int, list[str]]:
        """Problem, final state, SRIVC's iterations and notes, for a known delay."""
        problem = self.problem(delayed=False, delay_s=delay_s)
        started, notes = self.start(problem, delay_s, self.options.max_iterations)
        return problem, self.finish(problem, started), started.iterations, notes

    def with_delay(self, max_delay_s: float | None) -> tuple[OutputError, Settled, int, list[str]]:
        """As `at`, with the delay as a parameter: first a grid of whole samples, then all together from the best."""
        whole = self.problem(delayed=False)
        most_s = delay.longest_delay_s(whole) if max_delay_s is None else float(max_delay_s)
        grid = delay.delay_grid(whole, most_s)
        tried: list[tuple[float, float, Settled]] = []
        seen: set[int] = set()
        for prefilter in self.screens(whole):
            for index in delay.candidates(delay.screen(whole, prefilter, grid)):
                if index in seen:
                    continue
                seen.add(index)
                # All delays are compared on all samples: a later window might exclude a record's only step.
                here = self.problem(delayed=False, delay_s=float(grid[index]), most_delay_s=0.0)
                try:
                    theta = self.first_guess(here, prefilter, float(grid[index]))
                    settled = self.srivc(here, theta, SHORT_LOOK)
                except (FloatingPointError, NotIdentifiableError):
                    continue
                tried.append((settled.cost, float(grid[index]), settled))
        if not tried:
            raise NotIdentifiableError("no delay gives a finite fit: give delay_s as a number, or fewer poles")
        _, at_s, first = min(tried, key=lambda one: one[0])
        if self.structure.zeros == self.structure.poles and self.structure.hold == "zoh":
            problem, found, started, notes = self.at(at_s)
            notes.append("with a direct term a held input tells whole samples of delay only")
            return problem, found, started, notes
        step_s = max(experiment.typical_step_s for experiment in self.experiments)
        ends = [self.walk(*self.between_samples(at_s, first.theta, step_s, most_s), step_s, most_s)]
        m = self.structure.zeros + 1
        last = ends[0][1].theta
        for numerator, later_s in delay.traded_zeros(last[:m]):
            there_s = float(np.clip(last[-1] + later_s, 0.0, most_s))
            rival = np.concatenate([numerator, last[m:-1]])
            try:
                ends.append(self.walk(*self.between_samples(there_s, rival, step_s, most_s), step_s, most_s))
            except (FloatingPointError, NotIdentifiableError):
                continue
        # Results are compared on the samples that remain at the longest of their delays.
        latest = max((problem for problem, _, _ in ends), key=lambda problem: problem.most_delay_s)
        problem, found, begun = min(ends, key=lambda end: latest.cost(end[1].theta))
        at_s = float(found.theta[-1])
        notes = []
        if at_s == 0.0:
            notes.append("the delay lies on its bound 0")
        elif at_s >= most_s:
            notes.append(f"the delay lies on its bound {most_s:g} s: give a larger max_delay_s")
        return problem, found, begun.iterations, notes

    def walk(self, at_s: float, theta: Array, step_s: float, most_s: float) -> tuple[OutputError, Settled, Settled]:
        """Problem, the method's result and SRIVC's before it, for all parameters together, moving from cell to cell.

        The search starts at the delay ``at_s``.
        """
        for _ in range(CELLS):
            problem = self.problem(delayed=True, most_delay_s=min(at_s + 2.0 * step_s, most_s))
            ended = [
                self.in_cell(problem, np.append(theta, at_s), cell)
                for cell in delay.cells(problem, at_s, step_s, most_s)
            ]
            (found, begun), (low_s, high_s) = min(ended, key=lambda one: one[0][0].cost)
            ended_s = float(found.theta[-1])
            theta = found.theta[:-1]
            found = replace(found, theta=np.append(theta, delay.snapped(ended_s, low_s, high_s, step_s)))
            # Near a cell's end the next cell is tried; if it was tried before, the minimum is the kink between them.
            before_s, at_s = at_s, delay.snapped(ended_s, low_s, high_s, step_s, near=NEAR_END)
            moved = abs(at_s - before_s) >= delay.MARGIN * step_s
            if low_s < at_s < high_s or at_s in (0.0, most_s) or not moved:
                break
        return problem, found, begun

    def in_cell(
        self, problem: OutputError, theta: Array, cell: tuple[float, float]
    ) -> tuple[tuple[Settled, Settled], tuple[float, float]]:
        """The method's result and SRIVC's before it with the delay inside ``cell``, and the cell."""
        started = srivc(
            problem,
            theta,
            tolerance=self.options.tolerance,
            max_iterations=self.options.max_iterations,
            delay_bounds_s=cell,
        )
        return (self.finish(problem, started, cell), started), cell

    def between_samples(self, at_s: float, theta: Array, step_s: float, most_s: float) -> tuple[float, Array]:
        """The best of a few fractional delays around ``at_s``, and theta there."""
        window_s = min(at_s + step_s, most_s)
        tried: list[tuple[float, float, Settled]] = []
        for fraction in FRACTIONS:
            delay_s = at_s + fraction * step_s
            if not 0.0 <= delay_s <= most_s:
                continue
            here = self.problem(delayed=False, delay_s=delay_s, most_delay_s=window_s)
            try:
                settled = self.srivc(here, theta, SHORT_LOOK)
            except FloatingPointError:
                continue
            tried.append((settled.cost, delay_s, settled))
        if not tried:
            return at_s, theta
        _, best_s, best = min(tried, key=lambda one: one[0])
        return best_s, best.theta

    def prefilters(self, problem: OutputError) -> list[float]:
        """The lambdas to try, in rad/s: the user's and wider ones, or ones over the band that the data can resolve."""
        if self.options.prefilter_rad_s is not None:
            given = self.options.prefilter_rad_s
            return [given, *(given * ratio for ratio in FALLBACK_RATIOS)]
        longest = max(float(experiment.time_s[-1]) for experiment in self.experiments)
        fastest = 1.0 / min(experiment.typical_step_s for experiment in self.experiments)
        band = np.geomspace(10.0 / longest, 0.5 * fastest, AUTOMATIC_PREFILTERS)
        middle_first = np.argsort(np.abs(np.arange(band.size) - band.size // 2), kind="stable")
        return [float(band[index]) for index in middle_first]

    def screens(self, problem: OutputError) -> list[float]:
        """Lambdas of the delay search in rad/s, slow ones included, since noise behind fast ones hides the delay."""
        if self.options.prefilter_rad_s is not None:
            return [self.options.prefilter_rad_s * ratio for ratio in (1.0, 0.25, 1 / 16)]
        return sorted(self.prefilters(problem))[:-1:2]

    def first_guess(self, problem: OutputError, prefilter_rad_s: float, delay_s: float) -> Array:
        """theta by least squares behind one state-variable filter, with unstable poles reflected."""
        theta = least_squares(problem, prefilter_rad_s, delay_s)
        theta[problem.zeros + 1 :] = reflected(theta[problem.zeros + 1 :])
        return theta

    def start(self, problem: OutputError, delay_s: float, max_iterations: int) -> tuple[Settled, list[str]]:
        """SRIVC's result, and notes about it.

        It starts from the user's prefilter, or if that does not converge from others; without one, from the prefilter
        whose first few iterations reach the lowest cost, or as soon as two have ended at the same best cost.
        """
        given = self.options.prefilter_rad_s
        ended: list[tuple[Settled, float]] = []
        for prefilter in self.prefilters(problem):
            try:
                theta = self.first_guess(problem, prefilter, delay_s)
                ended.append((self.srivc(problem, theta, max_iterations if given else SHORT_LOOK), prefilter))
            except (FloatingPointError, NotIdentifiableError, np.linalg.LinAlgError):
                continue
            if ended[-1][0].converged and (given or _agreed([one for one, _ in ended])):
                break
        if not ended:
            raise NotIdentifiableError(
                "no prefilter gives a finite start: record an input that excites all poles, or give fewer of them"
            )
        if given is None:
            best, prefilter = min(ended, key=lambda one: one[0].cost)
            if best.converged or max_iterations <= SHORT_LOOK:
                return best, []
            further = self.srivc(problem, best.theta, max_iterations)
            return replace(further, iterations=further.iterations + best.iterations), []
        settled = [one for one in ended if one[0].converged] or ended
        best, prefilter = min(settled, key=lambda one: one[0].cost)
        if prefilter == given:
            return best, []
        return best, [f"SRIVC did not settle from the prefilter given, it did from {prefilter:g} rad/s"]

    def srivc(self, problem: OutputError, theta: Array, max_iterations: int) -> Settled:
        """The result of SRIVC from ``theta`` with the user's tolerance."""
        return srivc(problem, theta, tolerance=self.options.tolerance, max_iterations=max_iterations)

    def finish(
        self, problem: OutputError, started: Settled, delay_bounds_s: tuple[float, float] = (0.0, np.inf)
    ) -> Settled:
        """The result of the method, started from SRIVC's."""
        if self.options.method == "srivc":
            return started
        whitened = Whitened(problem, started.theta, delay_bounds_s)
        found = minimise(
            whitened,
            whitened.inside(started.theta),
            self.options.method,
            tolerance=self.options.tolerance,
            max_iterations=self.options.max_iterations,
        )
        return Settled(whitened.outside(found.theta), found.iterations, found.converged, found.evaluation.cost)


def _agreed(ended: Sequence[Settled]) -> bool:
    """Whether the two lowest costs belong to converged fits and are equal."""
    first, *others = sorted(ended, key=lambda one: one.cost)
    return bool(
        others and first.converged and others[0].converged and others[0].cost - first.cost <= SAME_COST * first.cost
    )


def _require_distinct(columns: Array) -> None:
    norm = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    if not (np.isfinite(norm).all() and (norm > 0.0).all()):
        raise NotIdentifiableError("a coefficient has no effect on the output: give fewer poles or zeros")
    values = np.linalg.svd(np.linalg.qr(columns / norm, mode="r"), compute_uv=False)
    if values[-1] < SINGULAR * values[0]:
        raise NotIdentifiableError(
            "the data do not tell the coefficients apart: excite more frequencies, or give fewer poles or zeros"
        )


def _require_within(experiments: Sequence[InputOutput], delay_s: float | str) -> None:
    """Raise `UsageError` for a ``delay_s`` so long that nothing of an experiment's input reaches its output."""
    shortest_s = min(float(one.time_s[-1] - one.time_s[0]) for one in experiments)
    if not isinstance(delay_s, str) and delay_s >= shortest_s:
        raise UsageError(f"delay_s is {delay_s:g} s and the shortest experiment lasts {shortest_s:g} s: give less")


def _check(structure: Structure, options: _FitOptions, delay_s: float | str, max_delay_s: float | None) -> None:
    poles, zeros = structure.poles, structure.zeros
    for name, value, allowed in (
        ("method", options.method, get_args(Method)),
        ("intersample", structure.hold, get_args(Intersample)),
        ("initial_state", structure.initial_state, get_args(InitialState)),
    ):
        if value not in allowed:
            raise UsageError(f"{name} is {value!r}: give one of {', '.join(allowed)}")
    if not isinstance(poles, Integral) or not isinstance(zeros, Integral):
        raise UsageError(f"poles={poles!r} and zeros={zeros!r}: give whole numbers")
    if poles < 1 or zeros < 0:
        raise UsageError(f"poles={poles} and zeros={zeros}: give at least 1 pole and no negative number of zeros")
    if poles < zeros:
        raise NotIdentifiableError(
            f"{zeros} zeros and {poles} poles: no sampled signal holds a derivative of the input, "
            "give at least as many poles as zeros"
        )
    offset = "estimate" if structure.offset is None else structure.offset
    for name, number in (("offset", offset), ("delay_s", delay_s)):
        if number != "estimate" and not (isinstance(number, int | float) and np.isfinite(number)):
            raise UsageError(f"{name} is {number!r}: give a finite number or 'estimate'")
    for name, least in (("delay_s", delay_s), ("max_delay_s", max_delay_s)):
        if isinstance(least, int | float) and least < 0.0:
            raise UsageError(f"{name} is {least}: give 0 s or more, the output cannot come first")
    prefilter_rad_s = options.prefilter_rad_s
    if prefilter_rad_s is not None and not (np.isfinite(prefilter_rad_s) and prefilter_rad_s > 0.0):
        raise UsageError(f"prefilter_rad_s is {prefilter_rad_s}: give a number above 0 rad/s")
