"""Recordings put on one clock, before any model sees them.

Two clocks must not be left to a model: a lag or a relaxation would be named in their place. A lag or drift that all
recordings share is a cause like any other, and is part of the model from the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._scale import load_reading_covariance
from smartshoe.integrity import Integrity, OneClock
from smartshoe.models.effects import Effect, between_clocks
from smartshoe.recording import Recording


@dataclass(frozen=True, eq=False)
class Aligned:
    """Recordings on one clock, their usable samples, the timing effects ``parts`` of the model, and sentences.

    ``places`` are those of the recordings among all given, without those that have no usable sample; ``moved`` those
    whose reading was shifted by a lag of their own.
    """

    recordings: list[Recording]
    usable: list[Mask]
    parts: tuple[tuple[Effect, Array], ...]
    says: tuple[str, ...]
    places: list[int]
    moved: frozenset[int] = frozenset()


def aligned(recordings: Sequence[Recording], integrity: Integrity) -> Aligned:
    """The recordings, each on one clock: by a shared delay or drift in the model, or each shifted by its own lag.

    A recording that only judges, on another clock than the fitted ones share, is shifted to that one.
    """
    places = [k for k, mask in enumerate(integrity.usable) if mask.any()]
    lags, rates = integrity.clock_offset_s, integrity.clock_rate
    delay, drift = between_clocks("lag"), between_clocks("rate")
    shared = integrity.one_clock
    is_told = any(lags[k] or rates[k] for k in places if k not in integrity.others)
    clock_in_model = (
        shared if is_told and shared is not None and abs(shared.before_s) < delay.parameters[0].upper else None
    )
    clock_of_fitted = clock_in_model if is_told else shared
    made, usable, says, moved = [], [], [], []
    for place in places:
        recording, mask, offset_s, rate = recordings[place], integrity.usable[place], lags[place], rates[place]
        if place in integrity.others and clock_of_fitted is not None:
            middle_s = np.array(0.5 * recording.duration_s)
            offset_s, rate = offset_s - float(clock_of_fitted.lag_s(middle_s)), rate - clock_of_fitted.rate
        elif clock_in_model is not None:
            offset_s = rate = 0.0
        judged_lag_s = integrity.judged_lags_s.get(place, 0.0)
        is_beside_fitted = place in integrity.others or (bool(judged_lag_s) and not offset_s)
        offset_s += judged_lag_s
        if offset_s or rate:
            moved.append(place)
            recording, mask = _on_one_clock(recording, mask, float(offset_s), float(rate))
            does = "lags" if offset_s > 0 else "leads"
            more = f" in the middle, by {abs(rate):.2g} s {'more' if rate * offset_s >= 0 else 'less'} each second"
            by = f"by {abs(offset_s):.3g} s{more if rate else ''}"
            if is_beside_fitted:
                said = (
                    f"the reading {does} those of the fitted recordings {by}; it was shifted to their clock before it"
                    " is used as held-out data, so that it tells nothing of a delay or a drift of clocks (either clock"
                    " may be the wrong one)"
                )
            elif integrity.are_about_mean:
                said = (
                    f"the reading {does} those of the other recordings {by}, as with a clock of its own, and was"
                    " shifted to theirs before anything else"
                )
            else:
                said = (
                    f"the reading {does} the load {by}, as with two clocks, and was shifted to the load's clock before"
                    " anything else: delays of this recording are not diagnosed; if the unit itself is late, the force"
                    " of a calibration is late by as much"
                )
            says.append(f"{recording.label}: {said}")
        made.append(recording)
        usable.append(mask if clock_in_model is None else mask & _is_load_known(recording, clock_in_model))
    if clock_in_model is None:
        return Aligned(made, usable, (), tuple(says), places, frozenset(moved))
    late, parting = (delay, np.array([clock_in_model.before_s])), (drift, np.array([clock_in_model.rate]))
    return Aligned(
        made, usable, (parting, late) if clock_in_model.rate else (late,), tuple(says), places, frozenset(moved)
    )


def with_lags_removed(
    recordings: Sequence[Recording], usable: Sequence[Mask], shared: OneClock | None
) -> list[Recording]:
    """``recordings`` with each reading shifted to the load that it follows, by the ``shared`` lag.

    Unshifted where that covaries more with the load: relaxation in long holds looks like a lag and a reversed sign.
    """
    as_read = [*recordings]
    if shared is None:
        return as_read
    offsets_s = (shared.before_s + 0.5 * shared.rate * one.duration_s for one in recordings)
    moved = [
        _on_one_clock(one, one.sensor.present, offset_s, shared.rate)[0]
        for one, offset_s in zip(recordings, offsets_s, strict=True)
    ]
    return max(as_read, moved, key=lambda some: abs(load_reading_covariance(some, usable)))


def _is_load_known(recording: Recording, clock: OneClock) -> Mask:
    """(n,) True where the reading, late or early by ``clock``, follows a load within the recording."""
    time_s = recording.time_s - recording.time_s[0]
    followed_s = time_s - clock.lag_s(time_s)
    return np.asarray((followed_s >= 0.0) & (followed_s <= time_s[-1]))


def _on_one_clock(recording: Recording, usable: Mask, offset_s: float, rate: float) -> tuple[Recording, Mask]:
    """The recording with its reading shifted, missing where a missing sample is involved, and its usable samples."""
    time_s = recording.time_s
    middle = 0.5 * (time_s[0] + time_s[-1])
    source_s = time_s + offset_s + rate * (time_s - middle)
    sensor = recording.sensor
    inside = (source_s >= time_s[0]) & (source_s <= time_s[-1])
    before, after = (np.searchsorted(time_s, source_s, side) for side in ("right", "left"))
    before, after = np.maximum(before - 1, 0), np.minimum(after, time_s.size - 1)
    there, usable = (inside & mask[before] & mask[after] for mask in (sensor.present, usable))
    moved = sensor.with_values(np.where(there, np.interp(source_s, time_s, sensor.values), np.nan))
    return recording.with_channel(moved), usable
