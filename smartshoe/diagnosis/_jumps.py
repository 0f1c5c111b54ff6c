"""What makes a change of a recording's zero a jump, and no stair, curve, rounding or noise that steps follow as well.

A zero that jumps does so at once, by more than the reading is rounded to and than what is left wanders elsewhere; and
from then on the unit reads otherwise, also at a load that was there before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from smartshoe.arrays import Array, Index
from smartshoe.diagnosis._held_out import changes_in, own_of
from smartshoe.diagnosis._scale import reading_in
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity import coarse_step
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import find_unit

MOMENTS = 60  # a resolution: at how many moments of a recording a gain, or its zero, may change


def moments_of(session: Session, thresholds: Thresholds) -> Index:
    """(k,) samples at which something may change: fewer where too `few` would lie between two to tell the noise."""
    count = max(min(MOMENTS, session.reading.size // thresholds.few - 1), 0)
    return np.arange(1, count + 1) * session.reading.size // (count + 1)


def rounded_to(session: Session, model: ExtendedModel, thresholds: Thresholds) -> float:
    """The step of a recording's reading where it is coarse beside its noise, a share of full scale; else 0."""
    sensor = session.recording.sensor
    values = reading_in(session.recording, find_unit(model.reading_unit) or sensor.unit)
    return coarse_step(values[sensor.present], thresholds) / abs(model.full_scale_reading)


def may_jump(session: Session, at: int, model: ExtendedModel, step: float, thresholds: Thresholds) -> bool:
    """Whether the zero changes ``at`` a sample by what its change there amounts to, and not ever more on either side.

    What creeps through a hold is followed by a stair; between the moments beside a step of it next to nothing happens.
    And what is not clear of the ``step`` of the reading is how that is rounded.
    """
    shares, left = _changes_of(session, model)
    share = float(shares[session.zero_changes.index(at)])
    if abs(share) < thresholds.clear * step:
        return False
    seen = share + float(_moved(session, left, thresholds)[at])
    return thresholds.clear * seen * math.copysign(1.0, share) >= abs(share)


def any_jumps(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> bool:
    """Whether at least one of the changes of zeros is a jump, if ``model`` is what else there is.

    Evidence takes what is left for white noise: noise that remembers, a curve and a loop are followed by steps as well.
    Where one is a jump, whether others are is a matter of odds.
    """
    fitted = fitted_of(sessions)
    places = sum(moments_of(one, thresholds).size for one in fitted)
    return any(_jumps(one, model, places, thresholds) for one in fitted if one.zero_changes)


def _jumps(session: Session, model: ExtendedModel, places: int, thresholds: Thresholds) -> bool:
    """Whether a change is abrupt, stands out at any of as many ``places``, and is there again at a load as before.

    What is left of the recording changes from moment to moment as well, however it wanders, by amounts of which as many
    are known as there are moments without a change (Student 1908): a jump is more than noise does at any of the places.
    """
    shares, left = _changes_of(session, model)
    free = moments_of(session, thresholds).size - shares.size
    if free < 1:
        return False
    moved = _moved(session, left, thresholds)
    usual = math.sqrt(float(np.mean(moved**2)) * (free + shares.size) / free)
    most = -float(stdtrit(free, 0.5 * thresholds.false_alarm / places)) * usual
    ends = (0, *session.zero_changes, session.reading.size)
    for k, (at, share) in enumerate(zip(session.zero_changes, shares, strict=True)):
        seen = float(share + moved[at])
        if abs(seen) > most and _is_alike(seen, share, thresholds):
            again = _at_like_loads(session, left, at, slice(ends[k], ends[k + 2]), thresholds)
            if again is not None and _is_alike(share + again, share, thresholds):
                return True
    return False


def _changes_of(session: Session, model: ExtendedModel) -> tuple[Array, Array]:
    """By what a session's zero changes (l,), shares of full scale, and what is left beside that (n,)."""
    residual = session.reading - model.simulate(session.conditions)
    own, added = own_of(session, model, residual)
    return session.zero_sd * changes_in(session, own)[1], residual - added


def _is_alike(seen: float, share: float, thresholds: Thresholds) -> bool:
    """Whether what is ``seen`` of a change is its ``share``: neither is clear of the other."""
    return share != 0.0 and 1.0 <= thresholds.clear * seen / share <= thresholds.clear**2


def _moved(session: Session, left: Array, thresholds: Thresholds) -> Array:
    """(n,) by what the mean of what is ``left`` changes at each sample, from one moment's length to the next one's.

    0 where nothing is fitted on either side.
    """
    width = left.size // (moments_of(session, thresholds).size + 1)
    at = np.arange(left.size)
    before, after = np.maximum(at - width, 0), np.minimum(at + width, left.size)
    sums = np.concatenate([[0.0], np.cumsum(np.where(session.fitted, left, 0.0))])
    counts = np.concatenate([[0], np.cumsum(session.fitted)])
    earlier, later = counts[at] - counts[before], counts[after] - counts[at]
    moved = (sums[after] - sums[at]) / np.maximum(later, 1) - (sums[at] - sums[before]) / np.maximum(earlier, 1)
    return np.where((earlier > 0) & (later > 0), moved, 0.0)


def _at_like_loads(session: Session, left: Array, at: int, part: slice, thresholds: Thresholds) -> float | None:
    """By what is ``left`` in a ``part`` differs from ``at`` a sample on, where load and its motion are as before.

    A zero that jumps is moved under each load alike. What a curve reads beyond the loads of before, and a loop as the
    load turns, is no zero's. None where no load comes back for more than a few samples.
    """
    fitted = session.fitted[part]
    load, rate = session.conditions.load[part][fitted], session.conditions.rate_per_s[part][fitted]
    way = np.where(np.abs(rate) < thresholds.still_per_s, 0.0, np.sign(rate))
    _, state = np.unique(3.0 * np.floor(load / thresholds.standing) + way, return_inverse=True)
    is_after = (np.arange(part.start, part.stop) >= at)[fitted]
    later, earlier = (
        np.bincount(state[is_after], minlength=load.size),
        np.bincount(state[~is_after], minlength=load.size),
    )
    weights = later * earlier / np.maximum(later + earlier, 1)  # of a difference of two means
    if weights.sum() < thresholds.few:
        return None
    sums = (np.bincount(state[one], left[part][fitted][one], load.size) for one in (is_after, ~is_after))
    after, before = (of / np.maximum(count, 1) for of, count in zip(sums, (later, earlier), strict=True))
    return float(weights @ (after - before) / weights.sum())
