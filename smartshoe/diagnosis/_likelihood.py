"""Fits of an extended model to several sessions at once: penalised output error, nuisances marginalised."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dposv

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._sensitivity import nuisance_precision, nuisances, ridged, where
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel, Trace

# Resolutions of a fit: half and twice of each changed no name in two cases.
MOST_STEPS = 25
FEW_STEPS = 4  # of a fit that only has to be compared with others
SETTLED = 0.1  # fall of -2 log likelihood that ends a fit
KNOWN_TO = 0.01  # of what a fit costs more than one that it is compared with: less ends it
LOG_RANGE = 30.0  # ratio of bounds from which a parameter of shape is stepped in its logarithm


def rows_of(model: ExtendedModel, session: Session, trace: Trace | None = None, spare: int = 0) -> Array:
    """(n, 1 + p): what a model leaves of a session, and the slopes of its reading over `theta`; ``spare`` columns."""
    count = len(model.parameters)
    rows = np.empty((session.reading.size, 1 + count + spare), order="F")
    reading, _ = model.sensitivities(session.conditions, trace, rows[:, 1 : 1 + count])
    rows[:, 0] = session.reading - reading
    return rows


class Likelihood:
    """What a model's parameters are judged by: ``sessions`` of which anything is fitted, the noise, their nuisances."""

    def __init__(
        self, sessions: Sequence[Session], noise_sd: float, like: ExtendedModel, thresholds: Thresholds
    ) -> None:
        self.sessions = fitted_of(sessions)
        self.noise_sd, self.thresholds = noise_sd, thresholds
        self._last: tuple[ExtendedModel, list[Trace]] | None = None
        self._rows: list[Array] = []  # `rows_of` where they were last asked for, with room for one column more
        self._scales = np.zeros(0)
        self._precision = [nuisance_precision(session, like) for session in self.sessions]
        self._pole_per_s = math.nan
        self._past: list[Array] = []
        self._inverse: list[Array] = []

    def _about(self, model: ExtendedModel, left: Sequence[Array]) -> None:
        """The sessions' nuisances: their memory fades with the pole of ``model``, which leaves ``left``, (n,) each."""
        if model.pole_per_s == self._pole_per_s and not any(one.own_gain_sd for one in self.sessions):
            return
        self._pole_per_s = model.pole_per_s
        pasts = [
            where(one.fitted, nuisances(one, model.pole_per_s, one.reading - rest)) / self.noise_sd
            for one, rest in zip(self.sessions, left, strict=True)
        ]
        inner = [ridged(past.T @ past + precision) for past, precision in zip(pasts, self._precision, strict=True)]
        self._past, self._inverse = pasts, [np.asarray(np.linalg.inv(one), dtype=np.float64) for one in inner]

    def _gram(self, k: int, rows: Array) -> Array:
        seen = where(self.sessions[k].fitted, rows)
        cross = self._past[k].T @ seen
        return np.asarray((seen.T @ seen - cross.T @ self._inverse[k] @ cross) / self.noise_sd**2)

    def cost(self, model: ExtendedModel) -> float:
        """Sum of squares over what is fitted, in units of the noise's variance; infinite of a model that runs off."""
        total = 0.0
        with np.errstate(over="ignore", invalid="ignore"):  # a leak beside an arm that pushes grows without bounds
            traces = [model.trace(session.conditions) for session in self.sessions]
            self._last = model, traces  # the slopes of a step that is taken begin with them
            left = [session.reading - reading for session, (reading, _) in zip(self.sessions, traces, strict=True)]
            self._about(model, left)
            for k, rest in enumerate(left):
                total += float(self._gram(k, rest[:, None])[0, 0])
        return total if math.isfinite(total) else math.inf

    def normal(self, model: ExtendedModel, rows: Sequence[Array] | None = None) -> tuple[float, Array, Array]:
        """Cost, its half gradient's negative J'r (p,) and normal matrix J'J (p, p); ``rows`` where they are known."""
        if rows is None:
            known: Sequence[Trace | None] = self._known(model) or [None] * len(self.sessions)
            self._rows = [rows_of(model, *one, spare=1) for one in zip(self.sessions, known, strict=True)]
        else:
            self._rows = [np.empty((one.shape[0], one.shape[1] + 1), order="F") for one in rows]
            for own, one in zip(self._rows, rows, strict=True):
                own[:, :-1] = one  # they are brought up to date in place
        return self._products(model)

    def nearly_normal(self, model: ExtendedModel, step: Array) -> tuple[float, Array, Array]:
        """The same after a ``step`` (p,) from where slopes were last known, these brought up to date by it.

        The least change that agrees with what the step did (Broyden 1965). ``model`` is the last one that was judged.
        """
        known = self._known(model)
        assert known is not None
        weighed = self._scales * step  # each parameter in units of what it does
        for rows, session, (reading, _) in zip(self._rows, self.sessions, known, strict=True):
            left = session.reading - reading
            missed = rows[:, 0] - left - rows[:, 1:-1] @ step
            for k, share in enumerate(weighed / max(float(weighed @ step), 1e-300), start=1):
                rows[:, k] += share * missed
            rows[:, 0] = left
        return self._products(model)

    def _known(self, model: ExtendedModel) -> list[Trace] | None:
        return self._last[1] if self._last is not None and self._last[0] is model else None

    def _products(self, model: ExtendedModel) -> tuple[float, Array, Array]:
        self._about(model, [rows[:, 0] for rows in self._rows])
        total = np.sum([self._with_memory(k, rows, model) for k, rows in enumerate(self._rows)], axis=0)
        self._scales = np.diag(total)[1:]
        return float(total[0, 0]), total[1:, 0], total[1:, 1:]

    def _with_memory(self, k: int, rows: Array, model: ExtendedModel) -> Array:
        """`_gram` of all ``rows`` but the last, whose slopes over the arm's share and rate take along how memory fades.

        What a session brought along, c exp(-p t), moves with the pole p = a/(1 + kappa) by -c t exp(-p t).
        """
        session = self.sessions[k]
        seen = self._past[k].T @ where(session.fitted, rows[:, :1])[:, 0] / self.noise_sd
        brought = float(self._inverse[k][1] @ seen)
        time_s = session.conditions.time_s - session.conditions.time_s[0]
        rows[:, -1] = -brought * time_s * np.exp(-self._pole_per_s * time_s)
        turn = np.eye(rows.shape[1], rows.shape[1] - 1)
        turn[-1, 2:4] = np.array([-model.pole_per_s, 1.0]) / (1.0 + model.relaxing_share)
        return np.asarray(turn.T @ self._gram(k, rows) @ turn)


@dataclass(frozen=True, eq=False)
class Fit:
    """``cost`` is -2 log ``likelihood`` but for a constant, prior included."""

    model: ExtendedModel
    cost: float
    likelihood: Likelihood

    @cached_property
    def covariance(self) -> Array:
        """(p, p) of theta; most fits are only compared, and never asked for it."""
        prior = _Prior.about(self.model)
        scale = np.where(prior.logarithmic, self.model.theta, 1.0)
        inner = self.likelihood.normal(self.model)[2] * np.outer(scale, scale) + np.diag(prior.precision)
        return np.asarray(_inverse(inner) * np.outer(scale, scale))


def weighed(likelihood: Likelihood, model: ExtendedModel) -> Fit:
    """``model`` within its bounds, as a fit that begins there and takes no step."""
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
    only: str | None = None,
    beside: float = math.inf,
) -> Fit:
    """Levenberg-Marquardt within the parameters' bounds, from ``start``; parameters of shape in their logarithm.

    Shapes have a prior about their start, of one in the logarithm or of their size; weights of flexible blocks have
    theirs about null. ``rows`` are `rows_of` the start within its bounds, a session each, where they are known.
    ``only``: the effect whose parameters are fitted, all others held; all of them where it is None. ``beside``: the
    cost of a better fit, where this one only has to tell how much better that is.
    """
    owners = start.parameters
    low, high = np.array([p.lower for _, p in owners]), np.array([p.upper for _, p in owners])
    model = within_bounds(start)
    prior = _Prior.about(model)
    logarithmic, precision = prior.logarithmic, prior.precision
    free = np.array([only in (None, owner) for owner, _ in owners])
    cost, right, normal = likelihood.normal(model, rows)
    cost += prior.cost(model)
    damping, exact, came = 1e-4, True, model.theta
    for taken in range(steps):
        theta = model.theta
        if taken:
            _, right, normal = likelihood.normal(model) if exact else likelihood.nearly_normal(model, theta - came)
        came = theta
        scale = np.where(logarithmic, theta, 1.0)
        inner = (normal * np.outer(scale, scale) + np.diag(precision)) * np.outer(free, free)
        pull = (right * scale - precision * prior.off(theta)) * free
        best: tuple[float, ExtendedModel] | None = None
        for _ in range(6):
            step = _bounded_step(inner, pull, damping, theta, low, high, logarithmic)
            moved = np.where(logarithmic, theta * np.exp(np.where(logarithmic, step, 0.0)), theta + step)
            trial = model.at(np.clip(moved, low, high))
            trial_cost = likelihood.cost(trial) + prior.cost(trial)
            if np.isfinite(trial_cost) and trial_cost < cost:
                best = trial_cost, trial
                damping = max(damping * 0.1, 1e-7)
                break
            damping = max(damping * 10.0, 1e-4)
        settled = best is None or cost - best[0] < max(SETTLED, KNOWN_TO * (cost - beside))
        if best is not None:
            cost, model = best
        if settled and exact:
            break
        # Every other step goes on with the slopes of the one before, brought up to date by what that did.
        exact = settled or not exact
    return Fit(model, cost, likelihood)


@dataclass(frozen=True, eq=False)
class _Prior:
    """The steps' prior: (p,) which parameters are stepped in their logarithm, what it is ``centre``d on, precisions."""

    logarithmic: Mask
    centre: Array
    precision: Array

    @classmethod
    def about(cls, model: ExtendedModel) -> _Prior:
        """About where a shape begins, and where a flexible block's weight is null; all else is free."""
        logarithmic = _are_logarithmic(model)
        centre, precision = _stepped(model.theta, logarithmic), np.zeros(logarithmic.size)
        for k, (owner, parameter) in enumerate(model.parameters):
            if parameter.prior_sd is not None:
                centre[k], precision[k] = parameter.null or 0.0, 1.0 / parameter.prior_sd**2
            elif parameter.null is None and owner != "baseline":
                precision[k] = 1.0 if logarithmic[k] else 1.0 / parameter.size**2
        return cls(logarithmic, centre, precision)

    def off(self, theta: Array) -> Array:
        """(p,) by how much ``theta`` lies off its centre, as it is stepped."""
        return _stepped(theta, self.logarithmic) - self.centre

    def cost(self, model: ExtendedModel) -> float:
        """-2 log of its density but for a constant."""
        return float(np.sum(self.precision * self.off(model.theta) ** 2))


def _stepped(theta: Array, logarithmic: Mask) -> Array:
    return np.where(logarithmic, np.log(np.where(logarithmic, np.abs(theta) + 1e-300, 1.0)), theta)


def _are_logarithmic(model: ExtendedModel) -> Mask:
    """(p,) which parameters are stepped in their logarithm."""
    return np.array(
        [p.null is None and p.lower > 0 and p.upper / p.lower >= LOG_RANGE for _, p in model.parameters], dtype=bool
    )


def _bounded_step(
    normal: Array, right: Array, damping: float, theta: Array, low: Array, high: Array, logarithmic: Mask
) -> Array:
    """The damped step over the parameters that are not pushed against a bound or without any influence."""
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
        if failed:  # rounding has made it indefinite
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
    scale = np.sqrt(np.diag(normal))
    out = np.zeros_like(normal)
    index = np.flatnonzero(scale > 0)
    if index.size:
        part = normal[np.ix_(index, index)] / np.outer(scale[index], scale[index])
        inverse = np.linalg.pinv(part, rcond=1e-12, hermitian=True)
        out[np.ix_(index, index)] = inverse / np.outer(scale[index], scale[index])
    return out
