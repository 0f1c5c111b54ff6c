"""The verdict, and the sentence that states it."""

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


def fault_rms(faults: Sequence[DataFault], sessions: Sequence[Session], scale: Scale) -> float:
    """The largest rms error, a share of full scale, that data faults add to all samples of a fitted recording."""
    units = {one.index: one.recording.sensor.unit for one in fitted_of(sessions)}
    errors = (fault.error * units[fault.recording].scale for fault in faults if fault.recording in units)
    return max(errors, default=0.0) / (abs(scale.reading) * scale.unit.scale)


def unexplained_of(causes: Sequence[Cause], before: ResidualStructure, after: ResidualStructure) -> ResidualStructure:
    """The structure that no cause accounts for: ``after`` the effects, or ``before`` them where none has a name."""
    return before if not causes and before.rms > after.rms else after


def verdict_of(
    causes: Sequence[Cause],
    before: ResidualStructure,
    after: ResidualStructure,
    thresholds: Thresholds,
    is_lawful: bool = True,
    fault_error: float = 0.0,
    *,
    doubtful: bool = False,
    elsewhere: float = 0.0,
) -> Verdict:
    """The verdict, from the structure left against that ``before`` and against what is tolerable.

    ``is_lawful``: a cause is sure and all have laws, so that what is left may be what laws usually depart by.
    ``fault_error`` is the rms of data faults, below which nothing is seen. ``doubtful``: the extension is worse on
    held-out data, for certain or by more than is tolerable, or the reading is the load's integral. ``elsewhere`` is the
    `held_out_excess`, or the size of effects that are followed but have no name.
    """
    left = unexplained_of(causes, before, after).rms
    tolerated = max(thresholds.material, thresholds.tolerable, fault_error)
    if causes:
        tolerated = max(tolerated, thresholds.departure * before.rms if is_lawful else 0.0)
        return "partly_explained" if left > tolerated or doubtful or elsewhere else "explained"
    return "unexplained" if left > tolerated or elsewhere else "adequate"


def held_out_excess(
    sessions: Sequence[Session], residuals: Sequence[Array], within: float, thresholds: Thresholds
) -> float:
    """Rms beyond white noise of recordings that were not fitted; 0 where they are not clearly worse than others.

    ``within`` is the rms of the fitted ones. A recording that exceeds it by `clear`, and what is tolerable, is of
    another unit, or of loads that were not learnt.
    """
    unfitted = [(one, residual) for one, residual in zip(sessions, residuals, strict=True) if one.held_out.all()]
    off = beyond_noise(all_fitted([one for one, _ in unfitted]), [residual for _, residual in unfitted], thresholds)
    seen = np.concatenate([residual[one.usable] for one, residual in unfitted]) if unfitted else np.zeros(1)
    white = float(seen @ seen) / max(seen.size, 1) - off**2
    chance = largest_of_noise(1, thresholds) * math.sqrt(2.0 / max(seen.size, 1)) * white
    is_off = off > thresholds.clear * max(within, thresholds.tolerable) and off**2 > chance
    return off if is_off else 0.0


def names_in(causes: Sequence[Cause], unnamed: int) -> str:
    """The causes as "a, b and perhaps c", with the number of effects that are not named as causes."""
    names = [cause.name for cause in causes if cause.confidence >= 0.5]
    names += [f"perhaps {cause.name}" for cause in causes if cause.confidence < 0.5]
    names += [f"{unnamed} {'effects' if unnamed > 1 else 'effect'} without a name"] if unnamed else []
    return listed(names, "and")


def untested_rms(
    sessions: Sequence[Session],
    residuals: Sequence[Array],
    left: ResidualStructure,
    thresholds: Thresholds,
    fault_error: float = 0.0,
    before: Sequence[Array] | None = None,
) -> float:
    """Rms beyond white noise of all usable data, where there is too little of it for a test of structure.

    0 where that is tolerable, explained by data faults (``fault_error``), or within the usual departure of what was
    wrong ``before`` the causes (residuals (n,) of each recording).
    """
    every = all_fitted(sessions)
    size = beyond_noise(every, residuals, thresholds)
    expected = 0.0 if before is None else thresholds.departure * beyond_noise(every, before, thresholds)
    return 0.0 if left.is_noise or size <= max(thresholds.tolerable, fault_error, expected) else size


def held_out_rms(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> float:
    """Rms beyond white noise of held-out data: the most that a better model could remove there."""
    judged = [replace(one, usable=one.judged) for one in sessions]
    return beyond_noise(all_fitted(judged), residuals, thresholds)


def unexplained_remark(
    rest: ResidualStructure, elsewhere: float, unproven: float, thresholds: Thresholds
) -> str | None:
    """The sentence on what is not explained, or None.

    ``rest`` is structure without a cause, ``elsewhere`` the `held_out_excess`, ``unproven`` the `untested_rms`.
    """
    if unproven > max(rest.rms, elsewhere):
        return f"{percent(unproven)} is left, and nothing shows that this is noise"
    if elsewhere > rest.rms:
        return f"on held-out data {percent(elsewhere)} is not explained"
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
    """The answer in one sentence: sizes first, then the judgement.

    ``named`` are the causes by `names_in`, ``not_explained`` the `unexplained_remark`. ``withheld``: the limits say why
    no cause may be named.
    """
    good = f"the baseline simulation is good to {percent(baseline.rmse)} of full scale on data it was not fitted to"
    if baseline.is_empty:
        good = "no held-out data can be used, so that it is not known how good the baseline simulation is"
    left = "" if not_explained is None else f"; {not_explained}"
    by_all = percent(best.rmse)
    if verdict == "adequate":
        return f"{good}{left and f'{left}, no more than small imperfections of a good unit add up to'}"
    if verdict == "unexplained" and best.rmse**2 < (1.0 - thresholds.foreseen) * baseline.rmse**2:
        return f"{good}{left}: the extended model is good to {by_all}, with effects that are not named as causes"
    if verdict == "unexplained":
        why = "no cause can be named from this data (see its limits)" if withheld else None
        return f"{good}{left}, and {why or 'no effect of the catalogue accounts for it'}"
    if baseline.is_empty:
        said = f"{good}; what is fitted is explained by {named}"
    elif best.rmse == baseline.rmse:  # the causes are nothing that the baseline gets wrong
        said = f"{good}, with each recording's own zero and clock allowed for; found in these: {named}"
    elif worse or best.rmse > baseline.rmse:
        how = "worse" if worse else "no better"
        said = f"{good}; with {named} it is {how} there ({by_all}), so that the baseline is kept"
    else:
        said = f"{good}, and to {by_all} with {named}"
    return said if verdict == "explained" else f"{said}{left}"
