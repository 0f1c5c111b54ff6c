"""Cross-validation within the fitted data, and effects that act mainly beyond it or cancel one another."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of, within_bounds
from smartshoe.diagnosis._load_cycles import load_cycles
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

MOST_FOLDS = 6  # of one recording or of many, a resolution
MOST_ALONE = 2 * MOST_FOLDS  # up to so many recordings each is left out by itself
OWN_STEPS = 2  # of an effect's own parameters, which start from the fit to all recordings


class LeftOut:
    """Each fitted recording in turn, predicted by fits to the others; of a single recording, its load cycles in blocks.

    Many recordings are left out in groups, so that six fits suffice; errors are still per recording. Each fit starts
    where the fit to all of them ended, so that few steps are needed.

    Two recordings of several load cycles each may also be judged by leaving out the same third of both. Either may hold
    a rate or a peak that the other lacks, so that the one cannot predict the other. Not with ``by_recording``: there
    the question is what differs between recordings.
    """

    def __init__(
        self,
        sessions: Sequence[Session],
        noise_sd: float,
        like: ExtendedModel,
        thresholds: Thresholds,
        *,
        by_recording: bool = False,
    ) -> None:
        self.sessions, self.thresholds = sessions, thresholds
        thirds = [] if by_recording else thirds_of(sessions, thresholds)
        self._schemes = [
            (folds, [Likelihood(fold.rest, noise_sd, like, thresholds) for fold in folds])
            for folds in (folds_of(sessions), thirds)
            if folds
        ]
        self._errors: dict[tuple[ExtendedModel, int], Array] = {}

    def errors(self, model: ExtendedModel, scheme: int = -1) -> Array:
        """(recordings or blocks,) squared errors of what is left out, by one ``scheme`` (default the last); cached."""
        scheme %= len(self._schemes)
        if (model, scheme) not in self._errors:
            (folds, rests), start = self._schemes[scheme], within_bounds(model)
            rows = self._rows_of(start)
            models = [fit(rest, start, FEW_STEPS, rows(rest)).model for rest in rests]
            self._errors[model, scheme] = _squares(folds, models)
        return self._errors[model, scheme]

    def consistent(self, found: Fit) -> Fit:
        """``found``, refitted without the effects whose parameters do not hold for what is left out.

        Each effect's own parameters are fitted without a recording, all else being as fitted to all of them. Its gain
        there over a fit without it must be positive by most of a standard error (``validated``). Where thirds can be
        left out, it suffices that it is positive in each third: a law that counts cycles may differ between few long
        and many short ones, but is the same in each third of both. Of several effects that fail, which may replace one
        another, the one with the smallest gain is removed first.
        """
        failing = list(found.model.names)
        while failing:
            start = within_bounds(found.model)
            rows, gains, less = self._rows_of(start), {}, {}
            for name in failing:
                less[name] = fit(found.likelihood, start.without(name), best_cost=found.cost)
                gains[name] = self._gains(name, start, less[name].model, rows)
            failing = [name for name in failing if not self._is_same(gains[name])]
            if failing:
                worst = min(failing, key=lambda name: float(gains[name][0].sum()))
                failing.remove(worst)
                found = less[worst]
        return found

    def _is_same(self, gains: Sequence[Array]) -> bool:
        """Whether an effect's ``gains``, by recordings and then by thirds, show that it holds for what is left out."""
        by_recording, *thirds = gains
        return _in_standard_errors(by_recording) >= self.thresholds.validated or any(
            bool((one > 0.0).all()) for one in thirds
        )

    def _gains(
        self, name: str, start: ExtendedModel, less: ExtendedModel, rows: Callable[[Likelihood], list[Array]]
    ) -> list[Array]:
        """(recordings or blocks,) gains over ``less``, which lacks the effect; by thirds as well where these decide."""
        gains: list[Array] = []
        for folds, rests in self._schemes:
            own = [fit(rest, start, OWN_STEPS, rows(rest), name).model for rest in rests]
            gains.append(_squares(folds, [less] * len(own)) - _squares(folds, own))
            if self._is_same(gains):
                break
        return gains

    def _rows_of(self, start: ExtendedModel) -> Callable[[Likelihood], list[Array]]:
        """Residuals and slopes at the start of a fit, for the recordings that a likelihood is fitted to."""
        rows = {id(one.conditions): rows_of(start, one) for one in fitted_of(self.sessions)}
        return lambda rest: [rows[id(one.conditions)] for one in rest.sessions]

    def is_validated(self, model: ExtendedModel, plain: ExtendedModel) -> bool:
        """Whether ``model`` removes enough of the plain model's squared error where data is left out.

        At least the share `foreseen`, and nearly the share that it removes where it was fitted, since a chance fit does
        not. Where it follows the fitted data nearly as well as a law does, the former suffices: fewer recordings may
        lack what an effect needs.
        """
        fitted = 1.0 - (error_of(self.sessions, model) / max(error_of(self.sessions, plain), 1e-300)) ** 2
        thresholds = self.thresholds
        nearly = (1.0 - thresholds.same) * fitted if fitted < 1.0 - thresholds.law_departure**2 else 0.0
        left_out = (
            1.0 - float(self.errors(model, way).sum()) / max(float(self.errors(plain, way).sum()), 1e-300)
            for way in range(len(self._schemes))
        )
        return any(share >= max(thresholds.foreseen, nearly) for share in left_out)


@dataclass(frozen=True, eq=False)
class _Fold:
    """The sessions to fit (``rest``) and the samples (n,) of recordings ``left_out``, which keep their own terms."""

    rest: list[Session]
    left_out: list[tuple[Session, Mask]]


def _squares(folds: Sequence[_Fold], models: Sequence[ExtendedModel]) -> Array:
    """(recordings or blocks,) squared errors of what each fold leaves out, by its model.

    Recordings left out together share a fit. Its error affects their gains in second order only, so that each counts in
    a standard error.
    """
    left = [
        residual_of(session, model)[mask]
        for fold, model in zip(folds, models, strict=True)
        for session, mask in fold.left_out
    ]
    return np.array([float(one @ one) for one in left])


def thirds_of(sessions: Sequence[Session], thresholds: Thresholds) -> list[_Fold]:
    """The folds that leave the same third of two recordings out, each with enough cycles; none for other numbers."""
    fitted = fitted_of(sessions)
    several = thresholds.held_out_every
    if len(fitted) == 2 and all(load_cycles([one], thresholds) >= several for one in fitted):
        return _blocks_of(fitted, several)
    return []


def folds_of(sessions: Sequence[Session]) -> list[_Fold]:
    """What is left out in turn: recordings, or blocks of cycles of a single one.

    Many recordings are dealt to groups in order, forwards and then backwards. Neighbours, which often share a loading
    rate or a day, come into different groups, and so do every sixth ones of a protocol: no group takes all of a kind
    away.
    """
    fitted = fitted_of(sessions)
    if len(fitted) > 1:
        turns = [*range(MOST_FOLDS), *reversed(range(MOST_FOLDS))]
        groups = [k if len(fitted) <= MOST_ALONE else turns[k % len(turns)] for k in range(len(fitted))]
        return [
            _Fold(
                [one for one, group in zip(fitted, groups, strict=True) if group != k],
                [(one, one.fitted) for one, group in zip(fitted, groups, strict=True) if group == k],
            )
            for k in range(max(groups) + 1)
        ]
    return _blocks_of(fitted, MOST_FOLDS)


def _blocks_of(fitted: Sequence[Session], count: int) -> list[_Fold]:
    """Folds that leave out one of ``count`` blocks of the load cycles, the same block of each recording."""
    blocks = [np.array_split(np.unique(one.cycle[one.fitted]), count) for one in fitted]
    folds = []
    for cycles in zip(*blocks, strict=True):
        masks = [np.isin(one.cycle, own) & one.fitted for one, own in zip(fitted, cycles, strict=True)]
        rest = [replace(one, held_out=one.held_out | mask) for one, mask in zip(fitted, masks, strict=True)]
        left_out = [(one, mask) for one, mask in zip(fitted, masks, strict=True) if mask.any()]
        if left_out and all(one.fitted.any() for one in rest):
            folds.append(_Fold(rest, left_out))
    return folds


def extrapolating_effect(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """An effect that moves unfitted recordings far more than fitted ones, or None; only their loads decide.

    An effect that is large where it was fitted is none: a small imperfection mistaken for it is within the error of its
    equation.
    """
    whole = [model.simulate(one.conditions) for one in sessions]
    for part in model.parts:
        by = _contributions(sessions, whole, model.without(part.name))
        within = _centred_rms(by, [one.fitted for one in sessions])
        if thresholds.departure * within >= thresholds.imperfection:
            continue
        if _centred_rms(by, [one.judged for one in sessions]) > thresholds.extrapolates * max(
            within, thresholds.material
        ):
            return part.name
    return None


def cancelling_effects(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> list[str]:
    """Effects that cancel one another: each moves the reading by at least nearly as much as all of them together."""
    sizes, together = contributed_rms(sessions, model, model.names)
    if not do_cancel(sizes, together, thresholds):
        return []
    return [name for name, size in sizes.items() if size > (1.0 - thresholds.same) * together]


def contributed_rms(
    sessions: Sequence[Session], model: ExtendedModel, names: Sequence[str]
) -> tuple[dict[str, float], float]:
    """The rms by which each of the effects ``names`` moves the reading, and by which all of them together do."""
    seen = [one.fitted for one in sessions]
    whole = [model.simulate(one.conditions) for one in sessions]
    sizes = {name: _centred_rms(_contributions(sessions, whole, model.without(name)), seen) for name in names}
    return sizes, _centred_rms(_contributions(sessions, whole, model.without(*names)), seen)


def do_cancel(sizes: Mapping[str, float], together: float, thresholds: Thresholds) -> bool:
    """Whether effects of rms ``sizes`` fit by their difference, which is neither's; ``together`` is all effects' rms.

    Powers of independent effects add up to that of their sum; here they clearly exceed it.
    """
    return sum(size**2 for size in sizes.values()) > thresholds.clear * together**2


def error_of(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """Rms of the residual over the fitted samples, a share of full scale."""
    return fitted_rms(sessions, [residual_of(session, model) for session in sessions])


def is_tolerable(error: float, beside: float, thresholds: Thresholds) -> bool:
    """Whether an ``error`` (rms) is larger than another, ``beside``, by no more than small imperfections add up to."""
    return error**2 - beside**2 <= thresholds.tolerable**2


def rms_difference(sessions: Sequence[Session], first: ExtendedModel, second: ExtendedModel) -> float:
    """Rms difference of two models' readings over the fitted samples, each recording's own terms aside."""
    return fitted_rms(sessions, [residual_of(session, first) - residual_of(session, second) for session in sessions])


def _contributions(sessions: Sequence[Session], whole: Sequence[Array], less: ExtendedModel) -> list[Array]:
    """(n,) for each session: by how much its reading ``whole`` exceeds that of a model that lacks something."""
    return [reading - less.simulate(one.conditions) for reading, one in zip(whole, sessions, strict=True)]


def _centred_rms(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Rms of ``signals`` (n,) over the samples ``seen``, each about its own mean."""
    return rms_of([part - part.mean() for one, mask in zip(signals, seen, strict=True) if (part := one[mask]).size])


def fitted_rms(sessions: Sequence[Session], signals: Sequence[Array]) -> float:
    """Rms of ``signals``, (n,) for each session, over the fitted samples."""
    return rms_of([signal[one.fitted] for one, signal in zip(sessions, signals, strict=True)])


def rms_of(parts: Sequence[Array], nothing: float = 0.0) -> float:
    """Root mean square over all ``parts`` (n,); ``nothing`` of no sample."""
    count = sum(one.size for one in parts)
    return math.sqrt(sum(float(one @ one) for one in parts) / count) if count else nothing


def _in_standard_errors(gains: Array) -> float:
    """The mean of ``gains`` (n,) in its standard errors."""
    error = float(np.std(gains, ddof=1)) / math.sqrt(gains.size) if gains.size > 1 else 0.0
    return float(gains.mean()) / max(error, 1e-300)
