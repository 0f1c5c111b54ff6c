"""Whether a change of a recording's zero is a jump, rather than creep, a curve, rounding or noise.

A zero that jumps does so at once, by more than the reading's rounding and more than the residual changes elsewhere; and
from then on the unit reads differently, also at a load that occurred before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.diagnosis._own_terms import gains_and_zero_changes, own_terms_of
from smartshoe.diagnosis._scale import reading_in
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity import coarse_step
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import find_unit

MOMENTS = 60  # a resolution: the number of moments of a recording at which a gain, or its zero, may change


def moments_of(session: Session, thresholds: Thresholds) -> Index:
    """(k,) samples at which a gain or zero may change, with at least `few` between two to estimate the noise."""
    count = max(min(MOMENTS, session.reading.size // thresholds.few - 1), 0)
    return np.arange(1, count + 1) * session.reading.size // (count + 1)


def rounded_to(session: Session, model: ExtendedModel, thresholds: Thresholds) -> float:
    """The resolution of a recording's reading, a share of full scale, where it is coarse against noise; else 0."""
    sensor = session.recording.sensor
    values = reading_in(session.recording, find_unit(model.reading_unit) or sensor.unit)
    return coarse_step(values[sensor.present], thresholds) / abs(model.full_scale_reading)


def may_jump(session: Session, at: int, model: ExtendedModel, step: float, thresholds: Thresholds) -> bool:
    """Whether the change of the zero ``at`` a sample happens there, rather than gradually on either side.

    Steps also follow creep in a hold, like stairs, but then hardly anything happens at each of them. A change that is
    not clearly larger than the reading's ``step`` is rounding.
    """
    shares, left = _changes_of(session, model)
    share = float(shares[session.zero_changes.index(at)])
    if abs(share) < thresholds.clear * step:
        return False
    seen = share + float(_mean_steps(session, left, thresholds)[at])
    return thresholds.clear * seen * math.copysign(1.0, share) >= abs(share)


def any_jumps(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> bool:
    """Whether at least one change of the zeros is a jump, with ``model`` for all else.

    The evidence takes the residual for white noise, so that steps also follow correlated noise, a curve or a loop.
    Where one change is a jump, the others are a matter of odds.
    """
    fitted = fitted_of(sessions)
    places = sum(moments_of(one, thresholds).size for one in fitted)
    return any(_has_jump(one, model, places, thresholds) for one in fitted if one.zero_changes)


def _has_jump(session: Session, model: ExtendedModel, places: int, thresholds: Thresholds) -> bool:
    """Whether a change is abrupt, exceeds noise at any of ``places`` moments, and recurs at a load from before.

    The residual also changes between other moments, which gives its usual change and their number the degrees of
    freedom of Student's t (1908).
    """
    shares, residual = _changes_of(session, model)
    free = moments_of(session, thresholds).size - shares.size
    if free < 1:
        return False
    mean_steps = _mean_steps(session, residual, thresholds)
    usual_step = math.sqrt(float(np.mean(mean_steps**2)) * (free + shares.size) / free)
    threshold = largest_of_noise(places, thresholds, free) * usual_step
    ends = (0, *session.zero_changes, session.reading.size)
    for k, (at, share) in enumerate(zip(session.zero_changes, shares, strict=True)):
        observed = float(share + mean_steps[at])
        if abs(observed) > threshold and _is_alike(observed, share, thresholds):
            again = _change_at_equal_loads(session, residual, at, slice(ends[k], ends[k + 2]), thresholds)
            if again is not None and _is_alike(share + again, share, thresholds):
                return True
    return False


def _changes_of(session: Session, model: ExtendedModel) -> tuple[Array, Array]:
    """The changes (l,) of a session's zero, shares of full scale, and the residual (n,) without them."""
    residual = session.reading - model.simulate(session.conditions)
    own, added = own_terms_of(session, model, residual)
    return session.zero_sd * gains_and_zero_changes(session, own)[1], residual - added


def _is_alike(observed: float, share: float, thresholds: Thresholds) -> bool:
    """Whether the observed part ``observed`` of a change agrees with its ``share`` within a factor `clear`."""
    return share != 0.0 and 1.0 <= thresholds.clear * observed / share <= thresholds.clear**2


def _mean_steps(session: Session, residual: Array, thresholds: Thresholds) -> Array:
    """(n,) change of the mean of ``residual`` at each sample, over the length of a moment on either side.

    0 where nothing is fitted on either side.
    """
    width = residual.size // (moments_of(session, thresholds).size + 1)
    at = np.arange(residual.size)
    before, after = np.maximum(at - width, 0), np.minimum(at + width, residual.size)
    sums = np.concatenate([[0.0], np.cumsum(np.where(session.fitted, residual, 0.0))])
    counts = np.concatenate([[0], np.cumsum(session.fitted)])
    earlier, later = counts[at] - counts[before], counts[after] - counts[at]
    moved = (sums[after] - sums[at]) / np.maximum(later, 1) - (sums[at] - sums[before]) / np.maximum(earlier, 1)
    return np.where((earlier > 0) & (later > 0), moved, 0.0)


def _change_at_equal_loads(
    session: Session, residual: Array, at: int, part: slice, thresholds: Thresholds
) -> float | None:
    """The mean change of ``residual`` at a sample, within ``part``, between equal loads and directions of motion.

    A jump moves the reading equally at each load; a curve acts only at new loads, and a loop only as the load turns.
    None where hardly any load recurs.
    """
    fitted = session.fitted[part]
    load, rate = session.conditions.load[part][fitted], session.conditions.rate_per_s[part][fitted]
    direction = np.where(np.abs(rate) < thresholds.still_per_s, 0.0, np.sign(rate))
    _, state = np.unique(3.0 * np.floor(load / thresholds.standing) + direction, return_inverse=True)
    is_after = (np.arange(part.start, part.stop) >= at)[fitted]
    later, earlier = (
        np.bincount(state[is_after], minlength=load.size),
        np.bincount(state[~is_after], minlength=load.size),
    )
    weights = later * earlier / np.maximum(later + earlier, 1)  # inverse variance of a difference of two means
    if weights.sum() < thresholds.few:
        return None
    sums = (np.bincount(state[one], residual[part][fitted][one], load.size) for one in (is_after, ~is_after))
    after, before = (of / np.maximum(count, 1) for of, count in zip(sums, (later, earlier), strict=True))
    return float(weights @ (after - before) / weights.sum())
