"""The verdict, and the sentence that says it: size before judgement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._held_out import Errors
from smartshoe.diagnosis._residual_structure import ResidualStructure, beyond_noise
from smartshoe.diagnosis._result import Cause, Verdict
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, all_fitted, fitted_of
from smartshoe.display import percent
from smartshoe.integrity import DataFault
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import listed


def known_error(faults: Sequence[DataFault], sessions: Sequence[Session], scale: Scale) -> float:
    """Rms, shares of full scale, that faults of all samples add to a recording that is fitted, the most of all."""
    units = {one.index: one.recording.sensor.unit for one in fitted_of(sessions)}
    errors = (fault.error * units[fault.recording].scale for fault in faults if fault.recording in units)
    return max(errors, default=0.0) / (abs(scale.reading) * scale.unit.scale)


def unexplained_of(causes: Sequence[Cause], before: ResidualStructure, after: ResidualStructure) -> ResidualStructure:
    """What no cause accounts for: ``after`` them, or all that was ``before`` where effects have no name."""
    return before if not causes and before.rms > after.rms else after


def verdict_of(
    causes: Sequence[Cause],
    before: ResidualStructure,
    after: ResidualStructure,
    thresholds: Thresholds,
    follows: bool = True,
    known: float = 0.0,
    *,
    worse: bool = False,
    elsewhere: float = 0.0,
) -> Verdict:
    """What is left, against what was wrong ``before`` and what is tolerable.

    ``worse``: that the extension is so on what is held out, for certain or by more than what is tolerable: whatever it
    follows, it explains a part.
    ``elsewhere``: `off_elsewhere`, or what an effect moves that is followed, but of no kind that has a name, or what
    effects without names do away with.

    ``follows``: one cause is sure and all have laws, so that what is left may be what laws usually depart by.

    ``known``: what faults of the data add, which is left whatever the model; nothing else is seen below it.
    """
    left = unexplained_of(causes, before, after).rms
    least = max(thresholds.material, thresholds.tolerable, known)
    if causes:
        least = max(least, thresholds.departure * before.rms if follows else 0.0)
        return "partly_explained" if left > least or worse or elsewhere else "explained"
    return "unexplained" if left > least or elsewhere else "adequate"


def off_elsewhere(
    sessions: Sequence[Session], residuals: Sequence[Array], within: float, thresholds: Thresholds
) -> float:
    """Rms beyond white noise of recordings that were not fitted, 0 where it is as what was fitted is off by.

    ``within`` is that of what was fitted. What is off by `clear` of it, and of what is tolerable, is of another unit or
    of loads of which nothing was learnt.
    """
    apart = [(one, left) for one, left in zip(sessions, residuals, strict=True) if one.held_out.all()]
    off = beyond_noise(all_fitted([one for one, _ in apart]), [left for _, left in apart], thresholds)
    seen = np.concatenate([left[one.usable] for one, left in apart]) if apart else np.zeros(1)
    white = float(seen @ seen) / max(seen.size, 1) - off**2
    chance = largest_of_noise(1, thresholds) * math.sqrt(2.0 / max(seen.size, 1)) * white
    is_off = off > thresholds.clear * max(within, thresholds.tolerable) and off**2 > chance
    return off if is_off else 0.0


def names_in(causes: Sequence[Cause], unnamed: int) -> str:
    """The causes as "a, b and perhaps c", and how many effects of the extended model are none."""
    names = [cause.name for cause in causes if cause.confidence >= 0.5]
    names += [f"perhaps {cause.name}" for cause in causes if cause.confidence < 0.5]
    names += [f"{unnamed} {'effects' if unnamed > 1 else 'effect'} without a name"] if unnamed else []
    return listed(names, "and")


def not_shown_to_be_noise(
    sessions: Sequence[Session],
    residuals: Sequence[Array],
    left: ResidualStructure,
    thresholds: Thresholds,
    known: float = 0.0,
    before: Sequence[Array] | None = None,
) -> float:
    """Rms beyond white noise of all that can be used, where too little is there to test it.

    0 where it is tolerable, or no more than what is ``known`` to be a fault's of the data, or than laws depart by of
    what was wrong ``before`` their causes, residuals as well.
    """
    every = all_fitted(sessions)
    size = beyond_noise(every, residuals, thresholds)
    expected = 0.0 if before is None else thresholds.departure * beyond_noise(every, before, thresholds)
    return 0.0 if left.is_noise or size <= max(thresholds.tolerable, known, expected) else size


def left_where_judged(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> float:
    """Rms beyond white noise of what is held out: the most that a better model could do away with there."""
    judged = [replace(one, usable=one.judged) for one in sessions]
    return beyond_noise(all_fitted(judged), residuals, thresholds)


def not_explained_of(rest: ResidualStructure, elsewhere: float, unproven: float, thresholds: Thresholds) -> str | None:
    """What is said of the ``rest`` that no cause accounts for, or of what is more; None of nothing.

    ``elsewhere`` is that of `off_elsewhere`, ``unproven`` of `not_shown_to_be_noise`.
    """
    if unproven > max(rest.rms, elsewhere):
        return f"{percent(unproven)} is left, of which nothing shows that it is noise"
    if elsewhere > rest.rms:
        return f"of held-out data {percent(elsewhere)} is not explained"
    if rest.rms <= thresholds.material:
        return None
    return f"over all recordings {percent(rest.rms)} {rest.how} and is not explained"


def sentence_of(
    verdict: Verdict,
    named: str,
    baseline: Errors,
    best: Errors,
    not_explained: str | None,
    thresholds: Thresholds,
    *,
    worse: bool = False,
    withheld: bool = False,
) -> str:
    """The answer in a sentence: size before judgement.

    ``named``: what is in the extended model, as `names_in` says it. ``not_explained``: that of `not_explained_of`.
    ``withheld``: its limits say why no cause may be named.
    """
    good = f"the baseline simulation is good to {percent(baseline.rmse)} of full scale on data it was not fitted to"
    if baseline.is_empty:
        good = "nothing that is held out can be used, so that it is not known how good the baseline simulation is"
    left = "" if not_explained is None else f"; {not_explained}"
    by_all = percent(best.rmse)
    if verdict == "adequate":
        return f"{good}{left}"
    if verdict == "unexplained" and best.rmse**2 < (1.0 - thresholds.foreseen) * baseline.rmse**2:
        return f"{good}{left}: the extended model is good to {by_all}, by effects of which none is sure"
    if verdict == "unexplained":
        why = "no cause can be named from this data (see its limits)" if withheld else None
        return f"{good}{left}, and {why or 'no effect of the catalogue accounts for it'}"
    if baseline.is_empty:
        said = f"{good}; what is fitted is explained by {named}"
    elif best.rmse == baseline.rmse:  # what is named is nothing that the baseline gets wrong
        said = f"{good}, the recordings' own zeros allowed for; found in these: {named}"
    elif worse or best.rmse > baseline.rmse:
        how = "worse" if worse else "no better"
        said = f"{good}; with {named} it is {how} there, good to {by_all}, and it stays as it is"
    else:
        said = f"{good}, and to {by_all} with {named}"
    return said if verdict == "explained" else f"{said}{left}"
