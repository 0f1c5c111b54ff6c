"""What is told of the clocks of several recordings: one pair for all that are fitted, or lags of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._apart import Increments, apart_s, beside, increments_of, is_better, refined, unforetold
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
    """``shared`` and ``others`` as ``one_clock`` and ``others`` in `Integrity`.

    ``offsets_s`` and ``rates`` as ``clock_offset_s`` and ``clock_rate``. ``found``: by place, the clock by which later
    recordings follow beside others that are fitted.
    """

    shared: OneClock | None
    others: frozenset[int]
    offsets_s: tuple[float, ...]
    rates: tuple[float, ...]
    found: dict[int, OneClock]


def clocks_of(
    recordings: Sequence[Recording], usable: Sequence[Mask], alone: Sequence[Alone], count: int, thresholds: Thresholds
) -> Clocks:
    """The clocks of ``recordings``, of which the first ``count`` are fitted and decide; the others go by them or not.

    A recording that judges goes by other clocks where its lags are none of the clock that the fitted ones share, and
    it is foretold far better by its own.
    """
    there = [place for place, mask in enumerate(usable) if mask.any()]
    runs = increments_of(recordings, usable, count, thresholds)
    fitted = _of_fitted([place for place in there if place < count], runs, alone, thresholds)
    found, others, zero = {**fitted.found}, set(), fitted.shared or OneClock(0.0, 0.0)
    offsets_s, rates = [one.offset_s for one in alone], [one.rate for one in alone]
    for place, lag in fitted.found.items():
        offsets_s[place] = lag.before_s
    for place in (place for place in there if place >= count):
        middle_s = np.array(0.5 * recordings[place].duration_s)
        is_other, by = _of_judging(alone[place], runs.get(place), fitted, middle_s, thresholds)
        if is_other:
            others.add(place)
        if by is not None:
            found[place] = by
            offsets_s[place], rates[place] = float(by.lag_s(middle_s) + zero.lag_s(middle_s)), by.rate + zero.rate
    return Clocks(fitted.shared, frozenset(others), tuple(offsets_s), tuple(rates), found)


@dataclass(frozen=True, eq=False)
class _Reference:
    """The clock that recordings ``shared``, if any, and those ``found`` of their own; ``runs`` that foretell others.

    These are on each's own clock, or all on one ``clock``: that which is shared, where it is told, or where one unit
    follows them far better by it. ``perhaps``: else one that all may go by, if it tells as much as clocks of their own.
    """

    shared: OneClock | None
    found: dict[int, OneClock]
    clock: OneClock | None
    runs: list[Increments]
    perhaps: OneClock | None = None


def _of_fitted(
    places: Sequence[int], runs: Mapping[int, Increments], alone: Sequence[Alone], thresholds: Thresholds
) -> _Reference:
    """What recordings that are fitted tell of their clocks."""
    runs = {place: runs[place] for place in places if place in runs}
    seen = [alone[place].lags for place in places]
    shared = one_clock(seen, thresholds)
    if shared is not None:
        shared = refined(shared, seen, [*runs.values()], thresholds)
    if shared is not None and any(alone[place].is_told for place in places):
        return _Reference(shared, {}, shared, [run.on(shared) for run in runs.values()])
    runs = {place: run for place, run in runs.items() if not alone[place].rate}  # that is put right as it was told
    own_s = {place: alone[place].offset_s for place in runs if alone[place].offset_s}
    perhaps = shared or clock_through(seen)
    apart = apart_s(runs, [one.lags for one in alone], thresholds, own_s, perhaps)
    if shared is not None:  # what parts slowly is farther apart the longer a recording lasts
        apart = {place: lag_s for place, lag_s in apart.items() if not alone[place].lags.are_of(shared, thresholds)}
    moved = [run.earlier(apart.get(place) or alone[place].offset_s) for place, run in runs.items()]
    found = {place: OneClock(lag_s, 0.0) for place, lag_s in apart.items()}
    if found:
        return _Reference(None, found, None, moved)
    clock = None
    if shared and runs and thresholds.clear * unforetold([*runs.values()], shared) < unforetold(moved):
        clock = shared
    return _Reference(shared, {}, clock, [run.on(clock) for run in moved], None if clock or own_s else perhaps)


def _of_judging(
    alone: Alone, run: Increments | None, fitted: _Reference, middle_s: Array, thresholds: Thresholds
) -> tuple[bool, OneClock | None]:
    """Whether a recording goes by another clock than those that are fitted; which beside theirs, if not as it tells.

    Theirs is its own where its lags lie on it, and where none are seen.
    """
    theirs = fitted.clock or OneClock(0.0, 0.0)
    if fitted.clock is not None and (not alone.lags.at_s.size or alone.lags.are_of(theirs, thresholds)):
        return False, None
    if run is None or not fitted.runs:
        return alone.is_told, None
    told = OneClock(alone.offset_s - alone.rate * float(middle_s), alone.rate)
    seen = told
    if fitted.clock is not None and not alone.is_told:  # that none is told alone is told as well
        seen = clock_through([alone.lags]) or told
    lag_s, run = float(seen.lag_s(middle_s) - theirs.lag_s(middle_s)), run.on(fitted.clock)
    by = beside(run, fitted.runs, thresholds, lag_s, _less(seen, theirs), fitted.perhaps)
    if by is None and alone.is_told:
        return is_better([*fitted.runs, run.on(_less(told, theirs))], [*fitted.runs, run]), None
    return by is not None, by


def _less(one: OneClock, other: OneClock) -> OneClock:
    """A clock beside another."""
    return OneClock(one.before_s - other.before_s, one.rate - other.rate)
