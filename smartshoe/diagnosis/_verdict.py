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
from smartshoe.diagnosis._session import Scale, Session
from smartshoe.integrity import DataFault
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise


def known_error(faults: Sequence[DataFault], sessions: Sequence[Session], scale: Scale) -> float:
    """Rms, shares of full scale, that faults of all samples add to a recording that is fitted, the most of all."""
    units = {one.index: one.recording.sensor.unit for one in sessions if one.fitted.any()}
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

    ``worse``: that the extension is so, for certain, on what is held out: whatever it follows, it explains a part.
    ``elsewhere``: `off_elsewhere`, or what an effect moves that is followed, but of no kind that has a name.

    ``follows``: every cause has a law, so that what is left may be what laws usually depart by.

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
    alone = [replace(one, held_out=np.zeros_like(one.held_out)) for one, _ in apart]
    off = beyond_noise(alone, [left for _, left in apart], thresholds)
    seen = np.concatenate([left[one.usable] for one, left in apart]) if apart else np.zeros(1)
    white = float(seen @ seen) / max(seen.size, 1) - off**2
    chance = largest_of_noise(1, thresholds) * math.sqrt(2.0 / max(seen.size, 1)) * white
    is_off = off > thresholds.clear * max(within, thresholds.tolerable) and off**2 > chance
    return off if is_off else 0.0


def sentence_of(
    verdict: Verdict,
    causes: Sequence[Cause],
    baseline: Errors,
    best: Errors,
    rest: ResidualStructure,
    thresholds: Thresholds,
    *,
    worse: bool = False,
    elsewhere: float = 0.0,
) -> str:
    """The answer in a sentence: size before judgement; ``rest`` is what no cause accounts for."""
    names = [cause.name.replace("_", " ") for cause in causes]
    named = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    good = f"the baseline simulation is good to {100 * baseline.rmse:.2g} % of full scale on data it was not fitted to"
    if baseline.is_empty:
        good = "nothing that is held out can be used, so that it is not known how good the baseline simulation is"
    not_explained = f"{100 * rest.rms:.2g} % {rest.how} and is not explained"
    if elsewhere > rest.rms:
        not_explained = f"of what is held out {100 * elsewhere:.2g} % is not explained"
    by_all = f"{100 * best.rmse:.2g} %"
    if verdict == "adequate":
        return good if rest.rms <= thresholds.material else f"{good}; {not_explained}"
    if verdict == "unexplained" and best.rmse**2 < (1.0 - thresholds.foreseen) * baseline.rmse**2:
        return f"{good}; {not_explained}: the extended model is good to {by_all}, by effects of which none is sure"
    if verdict == "unexplained":
        return f"{good}; {not_explained}, and no effect of the catalogue accounts for it"
    if baseline.is_empty:
        said = f"{good}; what is fitted is explained by {named}"
        return said if verdict == "explained" else f"{said}; {not_explained}"
    said = f"{good}; with {named} it is worse there, good to {by_all}" if worse else f"{good}, with {named} to {by_all}"
    return said if verdict == "explained" else f"{said}; {not_explained}"
