"""What an effect is worth within what is fitted: recordings left out in turn, loads beyond those that were fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of, within_bounds
from smartshoe.diagnosis._session import Session, fitted_of, load_cycles
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

MOST_FOLDS = 6  # of a single recording and of many, a resolution
MOST_ALONE = 2 * MOST_FOLDS  # recordings that are left out one at a time
OWN_STEPS = 2  # of an effect's own parameters, from where all recordings have them


class LeftOut:
    """Each fitted recording in turn, predicted by fits to the others; of a single one, its load cycles in blocks.

    Many recordings are left out in groups, so that six fits do; the errors are still those of each recording.
    A fit begins where that of all of them ended, so that few steps lead to its end.

    Of two recordings, each of several load cycles, a model may also foresee the same third of both: neither need hold
    what the other shows, a rate or a peak, so that the one would have to foretell what only the other can tell. Not
    where ``is_apart``, since what differs between recordings is asked for.
    """

    def __init__(
        self,
        sessions: Sequence[Session],
        noise_sd: float,
        like: ExtendedModel,
        thresholds: Thresholds,
        *,
        is_apart: bool = False,
    ) -> None:
        self.sessions, self.thresholds = sessions, thresholds
        thirds = [] if is_apart else thirds_of(sessions, thresholds)
        self._ways = [
            (folds, [Likelihood(fold.rest, noise_sd, like, thresholds) for fold in folds])
            for folds in (folds_of(sessions), thirds)
            if folds
        ]
        self._errors: dict[tuple[ExtendedModel, int], Array] = {}

    def errors(self, model: ExtendedModel, way: int = -1) -> Array:
        """(recordings or blocks,) squared errors of what is left out, one ``way`` or the other; cached."""
        way %= len(self._ways)
        if (model, way) not in self._errors:
            (folds, rests), start = self._ways[way], within_bounds(model)
            rows = self._rows_of(start)
            models = [fit(rest, start, FEW_STEPS, rows(rest)).model for rest in rests]
            self._errors[model, way] = _squares(folds, models)
        return self._errors[model, way]

    def following(self, found: Fit) -> Fit:
        """``found``, fitted again without the effects that are not the same in what is left out.

        Each effect's parameters are found without a recording, all else as all of them together ask. Its gain there,
        over a fit without it, must lie above zero by most of a standard error, or, where recordings can be left out by
        thirds, lie above zero in every one of these: the law of what counts cycles may differ between few long ones and
        many short ones, and is the same in each third of both. Of several of which neither holds, and which may stand
        in for one another, that one goes that gains least.
        """
        failing = list(found.model.names)
        while failing:
            start = within_bounds(found.model)
            rows, gains, less = self._rows_of(start), {}, {}
            for name in failing:
                less[name] = fit(found.likelihood, start.without(name), beside=found.cost)
                gains[name] = self._gains(name, start, less[name].model, rows)
            failing = [name for name in failing if not self._is_same(gains[name])]
            if failing:
                worst = min(failing, key=lambda name: float(gains[name][0].sum()))
                failing.remove(worst)
                found = less[worst]
        return found

    def _is_same(self, gains: Sequence[Array]) -> bool:
        apart, *thirds = gains
        return _in_standard_errors(apart) >= self.thresholds.validated or any(bool((one > 0.0).all()) for one in thirds)

    def _gains(
        self, name: str, start: ExtendedModel, less: ExtendedModel, rows: Callable[[Likelihood], list[Array]]
    ) -> list[Array]:
        """(recordings or blocks,) gains over ``less``, which lacks the effect; by thirds where these decide."""
        gains: list[Array] = []
        for folds, rests in self._ways:
            own = [fit(rest, start, OWN_STEPS, rows(rest), name).model for rest in rests]
            gains.append(_squares(folds, [less] * len(own)) - _squares(folds, own))
            if self._is_same(gains):
                break
        return gains

    def _rows_of(self, start: ExtendedModel) -> Callable[[Likelihood], list[Array]]:
        """What all fits begin with, of those recordings that one of them is fitted to."""
        rows = {id(one.conditions): rows_of(start, one) for one in fitted_of(self.sessions)}
        return lambda rest: [rows[id(one.conditions)] for one in rest.sessions]

    def stands(self, model: ExtendedModel, plain: ExtendedModel) -> bool:
        """Whether ``model`` does away with enough of the plain model's squared error where recordings are left out.

        With `foreseen` of it, and with nearly the share that it does away with where it was fitted: what fits by
        chance, or only these loads, does not. Where it follows what was fitted as nearly as a law does, the former is
        enough: fewer recordings may not hold all that an effect needs, and what is wrong follows all of them less well.
        """
        fitted = 1.0 - (error_of(self.sessions, model) / max(error_of(self.sessions, plain), 1e-300)) ** 2
        given = self.thresholds
        nearly = (1.0 - given.same) * fitted if fitted < 1.0 - given.law_departure**2 else 0.0
        left_out = (
            1.0 - float(self.errors(model, way).sum()) / max(float(self.errors(plain, way).sum()), 1e-300)
            for way in range(len(self._ways))
        )
        return any(share >= max(given.foreseen, nearly) for share in left_out)


@dataclass(frozen=True, eq=False)
class _Fold:
    """``rest`` is fitted, samples (n,) of recordings ``left_out`` predicted, whose offset and past stay their own."""

    rest: list[Session]
    left_out: list[tuple[Session, Mask]]


def _squares(folds: Sequence[_Fold], models: Sequence[ExtendedModel]) -> Array:
    """(recordings or blocks,) squared errors of what each fold leaves out, by its model.

    What is left out together shares a fit, whose own error moves their gains in the second order only: each of them
    counts in a standard error.
    """
    left = [
        residual_of(session, model)[mask]
        for fold, model in zip(folds, models, strict=True)
        for session, mask in fold.left_out
    ]
    return np.array([float(one @ one) for one in left])


def thirds_of(sessions: Sequence[Session], thresholds: Thresholds) -> list[_Fold]:
    """Of two recordings, each of several load cycles, the same third of both in turn; nothing of any others."""
    fitted = fitted_of(sessions)
    several = thresholds.held_out_every
    if len(fitted) == 2 and all(load_cycles([one], thresholds) >= several for one in fitted):
        return _blocks_of(fitted, several)
    return []


def folds_of(sessions: Sequence[Session]) -> list[_Fold]:
    """What is left out in turn: recordings, or cycles of a single one where they are fitted.

    Many recordings are dealt out to groups, there and back. Neighbours, which a loading rate or a day often has in
    common, come into different groups, and so do those of a protocol that comes round with every sixth: no group takes
    all of a kind away.
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
    """So many blocks of the load cycles of each recording, the same one of all left out."""
    blocks = [np.array_split(np.unique(one.cycle[one.fitted]), count) for one in fitted]
    folds = []
    for cycles in zip(*blocks, strict=True):
        masks = [np.isin(one.cycle, own) & one.fitted for one, own in zip(fitted, cycles, strict=True)]
        rest = [replace(one, held_out=one.held_out | mask) for one, mask in zip(fitted, masks, strict=True)]
        left_out = [(one, mask) for one, mask in zip(fitted, masks, strict=True) if mask.any()]
        if left_out and all(one.fitted.any() for one in rest):
            folds.append(_Fold(rest, left_out))
    return folds


def extrapolating(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """An effect that moves recordings that were not fitted far more than those that were; their loads alone decide.

    It is none where it is so large where it was fitted that a small imperfection of the unit, taken for it, is no more
    than its own equation may be wrong by.
    """
    whole = [model.simulate(one.conditions) for one in sessions]
    for part in model.parts:
        by = _moved(sessions, whole, model.without(part.name))
        within = _spread(by, [one.fitted for one in sessions])
        if thresholds.departure * within >= thresholds.imperfection:
            continue
        if _spread(by, [one.judged for one in sessions]) > thresholds.extrapolates * max(within, thresholds.material):
            return part.name
    return None


def cancelling(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> list[str]:
    """Effects that undo each other: each moves the reading by more than all of them do together, or nearly so.

    Powers of independent effects add up to that of all; where they are clear of it, most of what the effects do is
    undone by one another, and they fit by their difference, which is neither's.
    """
    seen = [one.fitted for one in sessions]
    whole = [model.simulate(one.conditions) for one in sessions]
    sizes = {name: _spread(_moved(sessions, whole, model.without(name)), seen) for name in model.names}
    together = _spread(_moved(sessions, whole, replace(model, parts=())), seen)
    if sum(size**2 for size in sizes.values()) <= thresholds.clear * together**2:
        return []
    return [name for name, size in sizes.items() if size > (1.0 - thresholds.same) * together]


def error_of(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """Rms of what is left of what is fitted."""
    return fitted_rms(sessions, [residual_of(session, model) for session in sessions])


def apart(sessions: Sequence[Session], first: ExtendedModel, second: ExtendedModel) -> float:
    """Rms of the difference of two models' readings over what is fitted, each recording's own offset aside."""
    return fitted_rms(sessions, [residual_of(session, first) - residual_of(session, second) for session in sessions])


def _moved(sessions: Sequence[Session], whole: Sequence[Array], less: ExtendedModel) -> list[Array]:
    """By how much the readings ``whole``, (n,) each, lie beside those of a model that lacks something."""
    return [reading - less.simulate(one.conditions) for reading, one in zip(whole, sessions, strict=True)]


def _spread(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Rms of ``signals``, (n,) each, where ``seen``, each about its own mean."""
    parts = [signal[mask] - signal[mask].mean() for signal, mask in zip(signals, seen, strict=True) if mask.any()]
    return math.sqrt(sum(float(one @ one) for one in parts) / max(sum(one.size for one in parts), 1))


def fitted_rms(sessions: Sequence[Session], signals: Sequence[Array]) -> float:
    """Rms of ``signals``, (n,) a session, over what is fitted."""
    square, count = 0.0, 0
    for session, signal in zip(sessions, signals, strict=True):
        fitted = signal[session.fitted]
        square += float(fitted @ fitted)
        count += fitted.size
    return float(np.sqrt(square / max(count, 1)))


def _in_standard_errors(gains: Array) -> float:
    """The mean of ``gains`` (n,) over its standard error."""
    error = float(np.std(gains, ddof=1)) / math.sqrt(gains.size) if gains.size > 1 else 0.0
    return float(gains.mean()) / max(error, 1e-300)
