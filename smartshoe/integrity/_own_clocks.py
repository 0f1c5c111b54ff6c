"""Clocks of several recordings: one pair that all fitted recordings share, or a lag of a recording's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._clocks import UNSEEN, Lags, clock_through, one_clock
from smartshoe.integrity._fault import OneClock
from smartshoe.integrity._relative_lags import (
    NO_LAG,
    Increments,
    increments_of,
    is_better,
    own_clock,
    own_lags_s,
    refined_clock,
    residual_squares,
)
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording


@dataclass(frozen=True, eq=False)
class Alone:
    """What one recording shows of its clocks by itself: ``offset_s`` and ``rate`` as in `Integrity`, and all lags."""

    offset_s: float = 0.0
    rate: float = 0.0
    lags: Lags = UNSEEN

    @property
    def has_two_clocks(self) -> bool:
        """Whether it shows for certain that load and reading come from two clocks."""
        return bool(self.offset_s or self.rate)


@dataclass(frozen=True, eq=False)
class Clocks:
    """``shared`` and ``others`` as ``one_clock`` and ``others`` in `Integrity`.

    ``offsets_s`` and ``rates`` as ``clock_offset_s`` and ``clock_rate``. ``own``: by place, the clock of a recording
    relative to that of the fitted ones.
    """

    shared: OneClock | None
    others: frozenset[int]
    offsets_s: tuple[float, ...]
    rates: tuple[float, ...]
    own: dict[int, OneClock]


def clocks_of(
    recordings: Sequence[Recording], usable: Sequence[Mask], alone: Sequence[Alone], count: int, thresholds: Thresholds
) -> Clocks:
    """The clocks of ``recordings``. The first ``count`` are fitted and decide; the others are only judged on.

    A recording that is judged on goes by another clock than the fitted ones where its lags do not lie on theirs and it
    is predicted far better by a clock of its own.
    """
    there = [place for place, mask in enumerate(usable) if mask.any()]
    compared = increments_of(recordings, usable, count, thresholds)
    fitted = _fitted_clocks([place for place in there if place < count], compared, alone, thresholds)
    own, others, zero = {**fitted.own}, set(), fitted.shared or NO_LAG
    offsets_s, rates = [one.offset_s for one in alone], [one.rate for one in alone]
    for place, lag in fitted.own.items():
        offsets_s[place] = lag.before_s
    for place in (place for place in there if place >= count):
        middle_s = np.array(0.5 * recordings[place].duration_s)
        if fitted.is_of_unit(alone[place].lags, thresholds):
            offsets_s[place] = rates[place] = 0.0
            continue
        is_other, clock = _judged_clock(alone[place], compared.get(place), fitted, middle_s, thresholds)
        if is_other:
            others.add(place)
        if clock is not None:
            own[place] = clock
            offsets_s[place] = float(clock.lag_s(middle_s) + zero.lag_s(middle_s))
            rates[place] = clock.rate + zero.rate
    return Clocks(fitted.shared, frozenset(others), tuple(offsets_s), tuple(rates), own)


@dataclass(frozen=True, eq=False)
class _FittedClocks:
    """The clocks of the fitted recordings, and what other recordings are compared with.

    ``shared``: the one clock of all, if there is one; ``own``: the lags of single ones, by place. ``compared``: their
    increments with those lags taken off, or all with that of ``clock`` taken off: of the shared clock, where it is told
    for certain or one unit fits far better by it. ``possible``: else a clock that all may go by.
    """

    shared: OneClock | None
    own: dict[int, OneClock]
    clock: OneClock | None
    compared: list[Increments]
    possible: OneClock | None = None

    def is_of_unit(self, lags: Lags, thresholds: Thresholds) -> bool:
        """Whether ``lags`` of another recording are those of the unit, which is late in the fitted ones as well.

        There the lag is accounted for by one delay and is told to be no clock's.
        """
        return self.clock is None and self.shared is not None and lags.are_of(self.shared, thresholds)


def _fitted_clocks(
    places: Sequence[int], compared: Mapping[int, Increments], alone: Sequence[Alone], thresholds: Thresholds
) -> _FittedClocks:
    """What the fitted recordings, at ``places``, tell of their clocks."""
    compared = {place: compared[place] for place in places if place in compared}
    seen = [alone[place].lags for place in places]
    shared = one_clock(seen, thresholds)
    if shared is not None:
        shared = refined_clock(shared, seen, [*compared.values()], thresholds)
    if shared is not None and any(alone[place].has_two_clocks for place in places):
        return _FittedClocks(shared, {}, shared, [one.without_lag(shared) for one in compared.values()])
    # A recording whose clocks part by a rate is put right by what it shows alone.
    compared = {place: one for place, one in compared.items() if not alone[place].rate}
    told_s = {place: alone[place].offset_s for place in compared if alone[place].offset_s}
    possible = shared or clock_through(seen)
    lags_s = own_lags_s(compared, [one.lags for one in alone], thresholds, told_s, possible)
    if shared is not None:  # clocks that part slowly are farther apart the longer a recording lasts
        lags_s = {place: lag_s for place, lag_s in lags_s.items() if not alone[place].lags.are_of(shared, thresholds)}
    moved = [
        one.without_lag(OneClock(lags_s.get(place) or alone[place].offset_s, 0.0)) for place, one in compared.items()
    ]
    if lags_s:
        return _FittedClocks(None, {place: OneClock(lag_s, 0.0) for place, lag_s in lags_s.items()}, None, moved)
    clock = None
    if shared and compared:
        is_far_better = thresholds.clear * residual_squares([*compared.values()], shared) < residual_squares(moved)
        clock = shared if is_far_better else None
    moved = [one.without_lag(clock) for one in moved]
    return _FittedClocks(shared, {}, clock, moved, None if clock or told_s else possible)


def _judged_clock(
    alone: Alone, one: Increments | None, fitted: _FittedClocks, middle_s: Array, thresholds: Thresholds
) -> tuple[bool, OneClock | None]:
    """Whether a recording that is judged on goes by another clock than the fitted ones, and its clock relative to it.

    That clock is None where it goes by theirs (its lags lie on it, or none are seen), and where what it shows alone is
    all that is known.
    """
    theirs = fitted.clock or NO_LAG
    if fitted.clock is not None and (not alone.lags.at_s.size or alone.lags.are_of(theirs, thresholds)):
        return False, None
    if one is None or not fitted.compared:
        return alone.has_two_clocks, None
    told = OneClock(alone.offset_s - alone.rate * float(middle_s), alone.rate)
    seen = told
    if fitted.clock is not None and not alone.has_two_clocks:  # that it shows no lag alone is against their clock
        seen = clock_through([alone.lags]) or told
    near_s, one = float(seen.lag_s(middle_s) - theirs.lag_s(middle_s)), one.without_lag(fitted.clock)
    clock = own_clock(one, fitted.compared, thresholds, near_s, _minus(seen, theirs), fitted.possible)
    if clock is None and alone.has_two_clocks:
        moved = one.without_lag(_minus(told, theirs))
        return is_better([*fitted.compared, moved], [*fitted.compared, one]), None
    return clock is not None, clock


def _minus(one: OneClock, other: OneClock) -> OneClock:
    """A clock relative to another."""
    return OneClock(one.before_s - other.before_s, one.rate - other.rate)
