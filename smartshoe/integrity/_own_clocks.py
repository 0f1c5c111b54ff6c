"""What is told of the clocks of several recordings: one pair for all that are fitted, or lags of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._apart import Told, apart_s
from smartshoe.integrity._clocks import UNSEEN, Lags, clock_through, one_clock
from smartshoe.integrity._fault import OneClock
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording


@dataclass(frozen=True, eq=False)
class Alone:
    """What a recording tells of its clocks by itself: ``offset_s`` and ``rate`` as in `Integrity`, lags as seen."""

    offset_s: float = 0.0
    rate: float = 0.0
    lags: Lags = UNSEEN

    @property
    def is_told(self) -> bool:
        """Whether it tells two clocks."""
        return bool(self.offset_s or self.rate)


@dataclass(frozen=True, eq=False)
class Clocks:
    """``shared`` and ``others`` as ``one_clock`` and ``others`` in `Integrity`, ``offsets_s`` as ``clock_offset_s``.

    ``found``: by place, how much later recordings follow than others that are fitted.
    """

    shared: OneClock | None
    others: frozenset[int]
    offsets_s: tuple[float, ...]
    found: dict[int, float]


def clocks_of(
    recordings: Sequence[Recording], usable: Sequence[Mask], alone: Sequence[Alone], count: int, thresholds: Thresholds
) -> Clocks:
    """The clocks of ``recordings``, of which the first ``count`` are fitted and decide; the others go by them or not.

    A recording that judges goes by other clocks where its lags are none of the clock that the fitted ones share.
    """
    there = [place for place, mask in enumerate(usable) if mask.any()]
    fitted = [place for place in there if place < count]
    seen = [alone[place].lags for place in fitted]
    shared = one_clock(seen, thresholds)
    borne = shared if any(alone[place].is_told for place in fitted) else None
    beside_s = [0.0 if borne is None else float(borne.lag_s(np.array(0.5 * one.duration_s))) for one in recordings]
    own_s = {place: alone[place].offset_s for place in there if alone[place].offset_s}
    drifting = {place for place in there if alone[place].rate}
    apart, compared = {*there}, {*there} - drifting  # what drifts as no other does is put right by what it tells alone
    if borne is not None:
        judging = (place for place in there if place >= count and alone[place].lags.at_s.size)
        apart = {place for place in judging if not _goes_by(borne, alone[place], thresholds)}
        compared = {*fitted} | apart - drifting
        own_s = {place: (own_s.get(place) or alone[place].lags.middle_s) - beside_s[place] for place in apart}
    masks = [mask & (place in compared) for place, mask in enumerate(usable)]
    told = Told(own_s, borne, count, clock_through(seen))
    found = apart_s(recordings, masks, [one.lags for one in alone], thresholds, told)
    if borne is None and shared is not None:  # what parts slowly is farther apart the longer a recording lasts
        found = {place: by for place, by in found.items() if not _goes_by(shared, alone[place], thresholds)}
    others = {place for place in apart if place >= count and (place in found or alone[place].is_told)}
    return Clocks(
        None if any(place < count for place in found) else shared,
        frozenset(others),
        tuple(found[place] + beside_s[place] if place in found else one.offset_s for place, one in enumerate(alone)),
        found,
    )


def _goes_by(clock: OneClock, alone: Alone, thresholds: Thresholds) -> bool:
    """Whether lags are seen that are those of a ``clock``."""
    return bool(alone.lags.at_s.size) and alone.lags.are_of(clock, thresholds)
