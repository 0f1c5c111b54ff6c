"""Fits of an extended model to several sessions at once: penalised output error, with nuisances marginalised."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dposv

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._sensitivity import nuisance_precision, nuisances, ridged, rows_where
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel, Trace

# Resolutions of a fit. Half and twice of each changed no name in two cases.
MOST_STEPS = 25
FEW_STEPS = 4  # of a fit that is only compared with others
SETTLED = 0.1  # a smaller fall of -2 log likelihood ends a fit
RELATIVE_TO_BEST = 0.01  # share of the excess over a better fit's cost; a smaller fall ends the comparison
LOG_RANGE = 30.0  # shape parameters whose bounds have at least this ratio are stepped in their logarithm


def rows_of(model: ExtendedModel, session: Session, trace: Trace | None = None, spare: int = 0) -> Array:
    """(n, 1 + p + spare): the residual of a session, its slopes over `theta`, and ``spare`` empty columns."""
    count = len(model.parameters)
    rows = np.empty((session.reading.size, 1 + count + spare), order="F")
    reading, _ = model.sensitivities(session.conditions, trace, rows[:, 1 : 1 + count])
    rows[:, 0] = session.reading - reading
    return rows


class Likelihood:
    """The likelihood of models: the fitted ``sessions``, white noise of ``noise_sd``, and the sessions' nuisances.

    The nuisances' prior follows from the model ``like``.
    """

    def __init__(
        self, sessions: Sequence[Session], noise_sd: float, like: ExtendedModel, thresholds: Thresholds
    ) -> None:
        self.sessions = fitted_of(sessions)
        self.noise_sd, self.thresholds = noise_sd, thresholds
        self._last: tuple[ExtendedModel, list[Trace]] | None = None
        self._rows: list[Array] = []  # `rows_of` at the last model asked for, with room for one more column
        self._scales = np.zeros(0)
        self._precision = [nuisance_precision(session, like) for session in self.sessions]
        self._pole_per_s = math.nan
        self._nuisances: list[Array] = []
        self._inverse: list[Array] = []

    def _update_nuisances(self, model: ExtendedModel, left: Sequence[Array]) -> None:
        """Update the nuisances for the pole of ``model``, by which memory fades; ``left`` (n,) are its residuals."""
        if model.pole_per_s == self._pole_per_s and not any(one.own_gain_sd for one in self.sessions):
            return
        self._pole_per_s = model.pole_per_s
        pasts = [
            rows_where(one.fitted, nuisances(one, model.pole_per_s, one.reading - rest)) / self.noise_sd
            for one, rest in zip(self.sessions, left, strict=True)
        ]
        inner = [ridged(past.T @ past + precision) for past, precision in zip(pasts, self._precision, strict=True)]
        self._nuisances, self._inverse = pasts, [np.asarray(np.linalg.inv(one), dtype=np.float64) for one in inner]

    def _gram(self, k: int, rows: Array) -> Array:
        """Inner products of ``rows`` over fitted samples of session k, nuisances marginalised, over noise variance."""
        seen = rows_where(self.sessions[k].fitted, rows)
        cross = self._nuisances[k].T @ seen
        return np.asarray((seen.T @ seen - cross.T @ self._inverse[k] @ cross) / self.noise_sd**2)

    def cost(self, model: ExtendedModel) -> float:
        """Sum of squares over fitted samples, in units of the noise variance; infinite for a model that diverges."""
        total = 0.0
        with np.errstate(over="ignore", invalid="ignore"):  # a leak beside an arm of negative share may be unstable
            traces = [model.trace(session.conditions) for session in self.sessions]
            self._last = model, traces  # reused for the slopes if the step is taken
            left = [session.reading - reading for session, (reading, _) in zip(self.sessions, traces, strict=True)]
            self._update_nuisances(model, left)
            for k, rest in enumerate(left):
                total += float(self._gram(k, rest[:, None])[0, 0])
        return total if math.isfinite(total) else math.inf

    def normal(self, model: ExtendedModel, rows: Sequence[Array] | None = None) -> tuple[float, Array, Array]:
        """Cost, right side J'r (p,) and normal matrix J'J (p, p); ``rows`` are `rows_of` each session where known."""
        if rows is None:
            known: Sequence[Trace | None] = self._last_traces(model) or [None] * len(self.sessions)
            self._rows = [rows_of(model, *one, spare=1) for one in zip(self.sessions, known, strict=True)]
        else:
            self._rows = [np.empty((one.shape[0], one.shape[1] + 1), order="F") for one in rows]
            for own, one in zip(self._rows, rows, strict=True):
                own[:, :-1] = one  # a copy, since they are updated in place
        return self._products(model)

    def broyden_normal(self, model: ExtendedModel, step: Array) -> tuple[float, Array, Array]:
        """`normal` after a ``step`` (p,), with the slopes updated instead of computed.

        The update is the smallest that agrees with the effect of the step (Broyden 1965). ``model`` is the last one
        that `cost` evaluated.
        """
        known = self._last_traces(model)
        assert known is not None
        evaluated = self._scales * step  # each parameter in units of its effect
        for rows, session, (reading, _) in zip(self._rows, self.sessions, known, strict=True):
            left = session.reading - reading
            missed = rows[:, 0] - left - rows[:, 1:-1] @ step
            for k, share in enumerate(evaluated / max(float(evaluated @ step), 1e-300), start=1):
                rows[:, k] += share * missed
            rows[:, 0] = left
        return self._products(model)

    def _last_traces(self, model: ExtendedModel) -> list[Trace] | None:
        """The traces of ``model`` if it is the last one that `cost` evaluated."""
        return self._last[1] if self._last is not None and self._last[0] is model else None

    def _products(self, model: ExtendedModel) -> tuple[float, Array, Array]:
        """`normal` from the rows as they are now."""
        self._update_nuisances(model, [rows[:, 0] for rows in self._rows])
        total = np.sum([self._with_memory(k, rows, model) for k, rows in enumerate(self._rows)], axis=0)
        self._scales = np.diag(total)[1:]
        return float(total[0, 0]), total[1:, 0], total[1:, 1:]

    def _with_memory(self, k: int, rows: Array, model: ExtendedModel) -> Array:
        """`_gram` of all ``rows`` but the last, with the slope of the fading memory added to those of the arm.

        A session's memory c exp(-p t) depends on the pole p = a/(1 + kappa): its derivative over p is -c t exp(-p t).
        """
        session = self.sessions[k]
        seen = self._nuisances[k].T @ rows_where(session.fitted, rows[:, :1])[:, 0] / self.noise_sd
        brought = float(self._inverse[k][1] @ seen)
        time_s = session.conditions.time_s - session.conditions.time_s[0]
        rows[:, -1] = -brought * time_s * np.exp(-self._pole_per_s * time_s)
        turn = np.eye(rows.shape[1], rows.shape[1] - 1)
        turn[-1, 2:4] = np.array([-model.pole_per_s, 1.0]) / (1.0 + model.relaxing_share)
        return np.asarray(turn.T @ self._gram(k, rows) @ turn)


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted ``model``; ``cost`` is -2 log posterior up to a constant, prior included."""

    model: ExtendedModel
    cost: float
    likelihood: Likelihood

    @cached_property
    def covariance(self) -> Array:
        """(p, p) of theta; computed on demand, since most fits are only compared."""
        prior = _Prior.about(self.model)
        scale = np.where(prior.logarithmic, self.model.theta, 1.0)
        inner = self.likelihood.normal(self.model)[2] * np.outer(scale, scale) + np.diag(prior.precision)
        return np.asarray(_inverse(inner) * np.outer(scale, scale))


def evaluated(likelihood: Likelihood, model: ExtendedModel) -> Fit:
    """``model`` within its bounds with its cost, as a fit of no steps."""
    model = within_bounds(model)
    return Fit(model, likelihood.cost(model) + _Prior.about(model).cost(model), likelihood)


def within_bounds(model: ExtendedModel) -> ExtendedModel:
    """``model`` with every parameter within its bounds."""
    bounds = [(one.lower, one.upper) for _, one in model.parameters]
    return model.at(np.clip(model.theta, *np.transpose(bounds)))


def fit(
    likelihood: Likelihood,
    start: ExtendedModel,
    steps: int = MOST_STEPS,
    rows: Sequence[Array] | None = None,
    only_effect: str | None = None,
    best_cost: float = math.inf,
) -> Fit:
    """Levenberg-Marquardt from ``start`` within the bounds; shapes of a wide range are stepped in their logarithm.

    Shapes have a Gaussian prior about their start, of standard deviation one in the logarithm, or of their size;
    weights of flexible blocks have theirs about null. ``rows`` are `rows_of` the start within its bounds, one for each
    session, where known. ``only_effect``: the effect whose parameters are fitted, all others held. ``best_cost``: the
    cost of a better fit, where this one is only compared with it.
    """
    owners = start.parameters
    low, high = np.array([p.lower for _, p in owners]), np.array([p.upper for _, p in owners])
    model = within_bounds(start)
    prior = _Prior.about(model)
    logarithmic, precision = prior.logarithmic, prior.precision
    free = np.array([only_effect in (None, owner) for owner, _ in owners])
    cost, right, normal = likelihood.normal(model, rows)
    cost += prior.cost(model)
    damping, exact, previous = 1e-4, True, model.theta
    for iteration in range(steps):
        theta = model.theta
        if iteration:
            _, right, normal = likelihood.normal(model) if exact else likelihood.broyden_normal(model, theta - previous)
        previous = theta
        scale = np.where(logarithmic, theta, 1.0)
        inner = (normal * np.outer(scale, scale) + np.diag(precision)) * np.outer(free, free)
        gradient = (right * scale - precision * prior.off(theta)) * free
        best: tuple[float, ExtendedModel] | None = None
        for _ in range(6):
            step = _bounded_step(inner, gradient, damping, theta, low, high, logarithmic)
            moved = np.where(logarithmic, theta * np.exp(np.where(logarithmic, step, 0.0)), theta + step)
            trial = model.at(np.clip(moved, low, high))
            trial_cost = likelihood.cost(trial) + prior.cost(trial)
            if np.isfinite(trial_cost) and trial_cost < cost:
                best = trial_cost, trial
                damping = max(damping * 0.1, 1e-7)
                break
            damping = max(damping * 10.0, 1e-4)
        settled = best is None or cost - best[0] < max(SETTLED, RELATIVE_TO_BEST * (cost - best_cost))
        if best is not None:
            cost, model = best
        if settled and exact:
            break
        # Every other step updates the slopes of the one before instead of computing them.
        exact = settled or not exact
    return Fit(model, cost, likelihood)


@dataclass(frozen=True, eq=False)
class _Prior:
    """The prior of a fit: which parameters (p,) are ``logarithmic``, and the ``centre`` and ``precision`` of each."""

    logarithmic: Mask
    centre: Array
    precision: Array

    @classmethod
    def about(cls, model: ExtendedModel) -> _Prior:
        """The prior about the start for shapes, about null for the weights of flexible blocks; flat for all else."""
        logarithmic = _are_logarithmic(model)
        centre, precision = _stepped(model.theta, logarithmic), np.zeros(logarithmic.size)
        for k, (owner, parameter) in enumerate(model.parameters):
            if parameter.prior_sd is not None:
                centre[k], precision[k] = parameter.null or 0.0, 1.0 / parameter.prior_sd**2
            elif parameter.null is None and owner != "baseline":
                precision[k] = 1.0 if logarithmic[k] else 1.0 / parameter.size**2
        return cls(logarithmic, centre, precision)

    def off(self, theta: Array) -> Array:
        """(p,) distance of ``theta`` from the centre, in logarithms where these are stepped."""
        return _stepped(theta, self.logarithmic) - self.centre

    def cost(self, model: ExtendedModel) -> float:
        """-2 log density up to a constant."""
        return float(np.sum(self.precision * self.off(model.theta) ** 2))


def _stepped(theta: Array, logarithmic: Mask) -> Array:
    """(p,) theta as it is stepped: logarithms where ``logarithmic``."""
    return np.where(logarithmic, np.log(np.where(logarithmic, np.abs(theta) + 1e-300, 1.0)), theta)


def _are_logarithmic(model: ExtendedModel) -> Mask:
    """(p,) which parameters are stepped in their logarithm."""
    return np.array(
        [p.null is None and p.lower > 0 and p.upper / p.lower >= LOG_RANGE for _, p in model.parameters], dtype=bool
    )


def _bounded_step(
    normal: Array, right: Array, damping: float, theta: Array, low: Array, high: Array, logarithmic: Mask
) -> Array:
    """The damped step (p,) of the parameters that have an influence and are not pushed against a bound."""
    diagonal = np.diag(normal)
    free = diagonal > 1e-12 * max(float(diagonal.max()), 1e-300)
    step = np.zeros(theta.size)
    for _ in range(theta.size):
        index = np.flatnonzero(free)
        if not index.size:
            break
        root = np.sqrt((1.0 + damping) * diagonal[index])
        part = normal[index[:, None], index] / (root[:, None] * root)
        np.fill_diagonal(part, 1.0)
        found, failed = dposv(part, right[index] / root, lower=1)[1:]
        if failed:  # rounding made it indefinite
            found = np.linalg.lstsq(part, right[index] / root, rcond=1e-12)[0]
        step[:] = 0.0
        step[index] = found / root
        step = np.where(logarithmic, np.clip(step, -1.0, 1.0), step)
        outward = ((theta <= low) & (step < 0)) | ((theta >= high) & (step > 0))
        if not (outward & free).any():
            break
        free &= ~outward
    return step


def _inverse(normal: Array) -> Array:
    """(p, p) pseudo-inverse of a normal matrix, scaled; 0 for parameters without influence."""
    scale = np.sqrt(np.diag(normal))
    out = np.zeros_like(normal)
    index = np.flatnonzero(scale > 0)
    if index.size:
        part = normal[np.ix_(index, index)] / np.outer(scale[index], scale[index])
        inverse = np.linalg.pinv(part, rcond=1e-12, hermitian=True)
        out[np.ix_(index, index)] = inverse / np.outer(scale[index], scale[index])
    return out
