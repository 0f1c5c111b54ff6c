"""Recordings on one clock, before any model sees them.

What two clocks make of a recording must not be left to a model: a lag or a relaxation would be named in its place.
A lag or a drift that all recordings share is a cause like any other, and the model bears it from the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity import Integrity
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, effect
from smartshoe.recording import Recording


@dataclass(frozen=True, eq=False)
class Aligned:
    """Recordings, usable samples, effects of timing with values that the model starts with, sentences.

    ``places`` of the recordings among those that were given: what has no usable sample is left out. ``moved`` are the
    places of those whose reading was moved by a lag of their own.
    """

    recordings: list[Recording]
    usable: list[Mask]
    parts: tuple[tuple[Effect, Array], ...]
    says: tuple[str, ...]
    places: list[int]
    moved: frozenset[int] = frozenset()


def aligned(recordings: Sequence[Recording], integrity: Integrity, thresholds: Thresholds) -> Aligned:
    """The recordings on one clock each: by a shared delay or drift for the model, or each moved by its own."""
    places = [k for k, mask in enumerate(integrity.usable) if mask.any()]
    recordings, masks = [recordings[k] for k in places], [integrity.usable[k] for k in places]
    told = (integrity.clock_offset_s, integrity.clock_rate, integrity.lag_seen_s)
    lags, rates, seen = (np.array(one)[places] for one in told)
    plain = Aligned(recordings, masks, (), (), places)
    if not lags.any() and not rates.any():
        return plain
    delay, drift = effect("delay"), effect("clock_drift")
    duration_s = np.array([recording.duration_s for recording in recordings])
    pair = _one_pair(lags, rates, duration_s, thresholds)
    before_s, rate = pair or (_one_lag(lags, rates, seen, duration_s, thresholds), 0.0)
    if before_s is not None and abs(before_s) < delay.parameters[0].upper:
        late, parting = (delay, np.array([before_s])), (drift, np.array([rate]))
        return replace(plain, parts=(parting, late) if pair else (late,))
    made, usable, says, moved = [], [], [], []
    for place, recording, mask, offset_s, rate in zip(places, recordings, masks, lags, rates, strict=True):
        if offset_s or rate:
            moved.append(place)
            recording, mask = _on_one_clock(recording, mask, float(offset_s), float(rate))
            way = "earlier" if offset_s > 0 else "later"
            says.append(
                f"{recording.label}: the reading was moved {abs(offset_s):.3g} s {way}"
                " to the load's clock before anything else: nothing is said of delays in it"
            )
        made.append(recording)
        usable.append(mask)
    return Aligned(made, usable, (), tuple(says), places, frozenset(moved))


def _one_pair(lags_s: Array, rates: Array, duration_s: Array, thresholds: Thresholds) -> tuple[float, float] | None:
    """The lag in s at the beginning of each recording, and its growth in s per s, where one line fits them all.

    One pair of clocks: where some recordings show that they part, they part in all; in the others by less than a
    sensor's own lag would hide.
    """
    shown, seen = _shown(lags_s, rates, duration_s)
    if abs(float(np.sum(np.sign(rates)))) < np.sum(shown):
        return None
    places = np.concatenate([0.0 * duration_s[shown], duration_s[shown]])
    rate, before_s = (float(one) for one in np.polyfit(places, seen, 1))
    hidden = np.abs(before_s + rate * duration_s[~shown]) < thresholds.settled_s
    fits = np.abs(seen - before_s - rate * places) <= thresholds.same * np.max(np.abs(seen))
    return (before_s, rate) if hidden.all() and fits.all() else None


def _one_lag(lags_s: Array, rates: Array, seen_s: Array, duration_s: Array, thresholds: Thresholds) -> float | None:
    """The lag in s that all recordings share.

    A recording of which no clock is told alone, as of slow or few movements, shares what its reading is seen to follow
    by (``seen_s``), or anything where that is seen of none.
    """
    shown, ends_s = _shown(lags_s, rates, duration_s)
    every_s = np.concatenate([ends_s, seen_s[~shown & np.isfinite(seen_s)]])
    if np.ptp(every_s) > thresholds.same * np.max(np.abs(every_s)):
        return None
    return float(np.mean(lags_s[shown]))


def _shown(lags_s: Array, rates: Array, duration_s: Array) -> tuple[Mask, Array]:
    """Which recordings (r,) show a clock of their own, and the lags in s at the beginnings, then ends, of those."""
    shown = (lags_s != 0.0) | (rates != 0.0)
    grown = 0.5 * rates * duration_s
    return shown, np.concatenate([(lags_s - grown)[shown], (lags_s + grown)[shown]])


def _on_one_clock(recording: Recording, usable: Mask, offset_s: float, rate: float) -> tuple[Recording, Mask]:
    time_s = recording.time_s
    middle = 0.5 * (time_s[0] + time_s[-1])
    source_s = time_s + offset_s + rate * (time_s - middle)
    sensor = recording.sensor
    values = np.interp(source_s, time_s, sensor.values)
    inside = (source_s >= time_s[0]) & (source_s <= time_s[-1])
    nearest = np.clip(np.searchsorted(time_s, source_s), 0, time_s.size - 1)
    return recording.with_channel(replace(sensor, values=values, missing=None)), inside & usable[nearest]
