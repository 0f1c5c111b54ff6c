"""Recordings of one unit whose readings follow by different lags, each too short to be told from the unit by itself.

Any unit may answer a tenth of a second late, but it does so in all of its recordings. What it makes of its load is
learnt from the others; a recording that it foretells far better at another moment was logged by other clocks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._answers import binned
from smartshoe.integrity._clocks import Lags, clock_through, made_of
from smartshoe.integrity._fault import OneClock
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording

STEPS = 4  # of Gauss and Newton: a lag within what the smoothing spans is found in two


@on_one_thread
def increments_of(
    recordings: Sequence[Recording], usable: Sequence[Mask], count: int, thresholds: Thresholds
) -> dict[int, Increments]:
    """By place, what is compared of recordings, of which the first ``count`` foretell; none where nothing can tell."""
    of_use = [place for place, mask in enumerate(usable) if mask.sum() >= thresholds.least_samples]
    fitted = [place for place in of_use if place < count]
    if not fitted:
        return {}
    longest_s = max(recordings[k].duration_s for k in fitted)
    step_s = max(thresholds.echo_s / thresholds.clear, longest_s / thresholds.bins)
    loads = [recordings[place].force_n[usable[place]] for place in fitted]
    ends_n = min(float(one.min()) for one in loads), max(float(one.max()) for one in loads)
    if ends_n[0] == ends_n[1]:
        return {}
    runs = {place: _run(recordings[place], usable[place], step_s, ends_n, thresholds) for place in of_use}
    return {place: run for place, run in runs.items() if run is not None}


@on_one_thread
def refined(clock: OneClock, seen: Sequence[Lags], runs: Sequence[Increments], thresholds: Thresholds) -> OneClock:
    """The ``clock`` that recordings share, or the line through lags that are ``seen`` by which one unit follows best.

    Its rate is what one unit tells, and its lags are those that are seen: what is late by a little a unit may make
    itself. In the place of a delay it must leave far fewer squares that one unit does not foretell than any delay.
    """
    through = clock_through(seen)
    if through is None or not runs:
        return clock
    line = clock_through(seen, _refined(through, 2, runs, thresholds).rate)
    least, plain = (1.0, clock) if clock.rate else (thresholds.clear, _refined(clock, 1, runs, thresholds))
    return line if line is not None and least * unforetold(runs, line) < unforetold(runs, plain) else clock


def _refined(about: OneClock, parts: int, runs: Sequence[Increments], thresholds: Thresholds) -> OneClock:
    """A clock of so many ``parts``, as in `_later`, by which one unit follows best; ``about`` itself if it is far."""
    found = about
    for _ in range(STEPS):
        moved = [run.on(found) for run in runs]
        weights = _weights(_products(moved))
        joint = [np.column_stack([run.made, run.late_by(run.made @ weights)[:, :parts]]) for run in moved]
        normal = sum(one.T @ np.column_stack([one, run.read]) for one, run in zip(joint, moved, strict=True))
        found = _moved_by(found, _weights(np.asarray(normal))[-parts:])
        if any(_farthest_s(run, found, about) > thresholds.settled_s for run in runs):
            return about
    return found


def unforetold(runs: Sequence[Increments], clock: OneClock | None = None) -> float:
    """Squares of what is read that one unit does not foretell, by a clock that all go by."""
    return _left([run.on(clock) for run in runs])


@on_one_thread
def apart_s(
    runs: Mapping[int, Increments],
    lags: Sequence[Lags],
    thresholds: Thresholds,
    own_s: Mapping[int, float],
    perhaps: OneClock | None = None,
) -> dict[int, float]:
    """By place, how much later the reading of a recording follows than those of the others.

    First of those of which no lag is told. The longest lag of its own comes first, since of two recordings either may
    be the late one: each is foretold by all others, on the clocks that are found by then. Then those of which one is
    told, ``own_s``, each by all before it: its own lag is where to look from. ``perhaps``: a clock that all may go by,
    if it tells as much as lags of their own.
    """
    first = [place for place in runs if place not in own_s]
    found = _of_first({place: runs[place] for place in first}, lags, thresholds)
    if found:  # foretold at other loads than the others had: one unit must follow all of them better by these lags
        alike = [runs[place] for place in first]
        moved = [runs[place].earlier(found.get(place, 0.0)) for place in first]
        if not is_better(moved, alike, perhaps):
            found = {}
    known = [runs[place].earlier(found.get(place, 0.0)) for place in first]
    for place in sorted((k for k in runs if k in own_s), key=lambda k: abs(own_s[k])):
        lag_s = _later_s(runs[place], _products(known), thresholds, own_s[place]) if known else 0.0
        if lag_s:
            found[place] = lag_s
        known.append(runs[place].earlier(lag_s or own_s[place]))
    return found


@on_one_thread
def beside(
    run: Increments,
    others: Sequence[Increments],
    thresholds: Thresholds,
    own_s: float,
    own: OneClock,
    perhaps: OneClock | None = None,
) -> OneClock | None:
    """The clock by which a recording follows beside the ``others`` that foretell it, or None where it goes by theirs.

    A lag about ``own_s``; a line about ``own`` where it is foretold far better still by that. ``perhaps`` as in
    `is_better`.
    """
    foretold = run.made @ _weights(_products(others))
    found = None
    for about, parts in ((OneClock(own_s, 0.0), 1), (own, 2)):
        found = _later(run, foretold, thresholds, about, parts, found) or found
    if found is None or not is_better([*others, run.on(found)], [*others, run], perhaps):
        return None
    return found


def is_better(moved: Sequence[Increments], alike: Sequence[Increments], perhaps: OneClock | None = None) -> bool:
    """Whether one unit follows recordings better as some are ``moved`` by clocks of their own than all ``alike``.

    Also than by one clock that all may go by, ``perhaps``: what that accounts for is none of their own.
    """
    return _left(moved) < min(unforetold(alike, clock) for clock in dict.fromkeys((None, perhaps)))


def _of_first(runs: Mapping[int, Increments], lags: Sequence[Lags], thresholds: Thresholds) -> dict[int, float]:
    """The same of recordings of which no lag is told."""
    if len(runs) < 2:
        return {}
    runs = dict(runs)
    foretelling = _of_others([*runs.values()])
    found = {place: _later_s(runs[place], one, thresholds) for place, one in zip(runs, foretelling, strict=True)}
    own = {place: abs(lags[place].middle_s) if lags[place].at_s.size else 0.0 for place in runs}
    apart: dict[int, float] = {}
    for place in sorted((k for k in runs if found[k]), key=lambda k: (-own[k], -abs(found[k]))):
        others = sum(one.products for other, one in runs.items() if other != place)
        lag_s = _later_s(runs[place], np.asarray(others), thresholds)
        if lag_s and len(apart) + 1 < len(runs):
            apart[place] = lag_s
            runs[place] = runs[place].earlier(lag_s)
    return apart


@dataclass(frozen=True, eq=False)
class Increments:
    """What is compared of a recording, over even bins at ``grid`` (b,).

    ``made`` (b, k): increments of what a unit may make of its load; ``read`` (b,): those of its reading. ``began_s``:
    when it began. ``least_s``: a shorter lag may be the delay of a logger.
    """

    grid: Array
    made: Array
    read: Array
    began_s: float
    least_s: float

    @cached_property
    def products(self) -> Array:
        """(k, k + 1) inner products of what is made of the load, with itself and with the reading."""
        return np.asarray(self.made.T @ np.column_stack([self.made, self.read]))

    def earlier(self, by_s: float) -> Increments:
        """The same with its reading earlier."""
        return self.on(OneClock(by_s, 0.0)) if by_s else self

    def on(self, clock: OneClock | None) -> Increments:
        """The same with its reading earlier by the lag of a clock."""
        return (
            self
            if clock is None
            else replace(self, read=np.interp(self.grid + self.lag_s(clock), self.grid, self.read))
        )

    def lag_s(self, clock: OneClock) -> Array:
        """(b,) lags of a clock."""
        return clock.lag_s(self.grid - self.began_s)

    def late(self, values: Array, clock: OneClock) -> Array:
        """``values`` (b,) later by the lag of a clock."""
        return np.asarray(np.interp(self.grid - self.lag_s(clock), self.grid, values))

    def late_by(self, foretold: Array) -> Array:
        """(b, 2) what a second of lag, and what one more in each second, adds to what is ``foretold`` (b,)."""
        slope = -np.gradient(foretold, float(self.grid[1] - self.grid[0]))
        return np.column_stack([slope, slope * (self.grid - self.began_s)])


def _run(
    recording: Recording, usable: Mask, step_s: float, ends_n: tuple[float, float], thresholds: Thresholds
) -> Increments | None:
    """None of a recording that lasts for a few bins: beside one of a day a minute tells nothing of moments."""
    from scipy.ndimage import gaussian_filter1d

    time_s = recording.time_s[usable]
    # One that only judges may be far longer than those that are fitted: its beginning tells.
    time_s = time_s[time_s <= time_s[0] + thresholds.clear * thresholds.bins * step_s]
    grid = np.arange(time_s[0] + 0.5 * step_s, time_s[-1], step_s)
    if grid.size <= thresholds.few:
        return None
    load, reading = (
        binned(time_s, five_point_median(one[usable][: time_s.size]), grid, step_s)
        for one in (recording.force_n, recording.sensor.si)
    )
    smooth = max(thresholds.echo_s / step_s, 1.0)
    made = made_of((load - ends_n[0]) / (ends_n[1] - ends_n[0]), step_s, smooth, thresholds)
    read, least_s = gaussian_filter1d(reading, smooth, order=1), thresholds.few * recording.sample_time_s
    return Increments(grid, made, read, float(recording.time_s[0]), least_s)


def _of_others(runs: Sequence[Increments]) -> list[Array]:
    """For each of them the sum of all others' products: of those before it and of those after it."""
    products = np.array([one.products for one in runs])
    nothing = np.zeros_like(products[:1])
    before = np.concatenate([nothing, np.cumsum(products[:-1], axis=0)])
    after = np.concatenate([np.cumsum(products[:0:-1], axis=0)[::-1], nothing])
    return [*(before + after)]


def _later_s(run: Increments, others: Array, thresholds: Thresholds, own_s: float = 0.0) -> float:
    """How much later one reading follows than the ``others``, by their products, foretell; about ``own_s``, or 0."""
    found = _later(run, run.made @ _weights(others), thresholds, OneClock(own_s, 0.0), 1)
    return 0.0 if found is None else found.before_s


def _later(
    run: Increments, foretold: Array, thresholds: Thresholds, about: OneClock, parts: int, known: OneClock | None = None
) -> OneClock | None:
    """The clock by which a reading follows what is ``foretold`` (b,), about another: a lag, or a line of two ``parts``.

    None where it is not foretold far better so than by the one that is ``known``, at rising and at falling edges alike:
    load that the unit remembers has a lag for each direction.
    """
    rises = (run.made[:, 0] > 0.0).astype(float)
    found = about
    for _ in range(STEPS):
        shifted = run.late(foretold, found)
        columns = run.late_by(shifted)[:, :parts]
        size = np.linalg.norm(columns, axis=0) + 1e-150
        by = np.linalg.lstsq(columns / size, run.read - shifted)[0] / size
        found = _moved_by(found, by)
        if _farthest_s(run, found, about) > thresholds.settled_s:
            return None

    def left(clock: OneClock) -> Array:
        off, up = run.read - run.late(foretold, clock), run.late(rises, clock)
        return np.array([np.sum(up * off**2), np.sum((1.0 - up) * off**2)])

    nowhere = OneClock(0.0, 0.0)
    is_foretold = np.all(thresholds.clear * left(found) <= left(known or nowhere))
    return found if is_foretold and _farthest_s(run, found, nowhere) > run.least_s else None


def _moved_by(clock: OneClock, parts: Array) -> OneClock:
    """A clock that is later by a lag and, if there are two ``parts``, grows more by a rate."""
    return OneClock(clock.before_s + float(parts[0]), clock.rate + float(parts[1:].sum()))


def _farthest_s(run: Increments, one: OneClock, other: OneClock) -> float:
    """By how much two clocks are apart at most."""
    return float(np.max(np.abs(run.lag_s(one) - run.lag_s(other))))


def _products(runs: Sequence[Increments]) -> Array:
    return np.asarray(np.sum([one.products for one in runs], axis=0))


def _left(runs: Sequence[Increments]) -> float:
    """Squares of what is read that all together do not foretell."""
    products = _products(runs)
    return float(sum(np.sum(one.read**2) for one in runs) - products[:, -1] @ _weights(products))


def _weights(products: Array) -> Array:
    """(k,) of what a unit may make of its load, by least squares."""
    normal, pulled = products[:, :-1], products[:, -1]
    size = np.sqrt(np.diag(normal)) + 1e-300
    normal = normal / size / size[:, None]  # one by one: a play that never moves is all noughts
    normal[np.diag_indices_from(normal)] += 1e-6
    return np.asarray(np.linalg.solve(normal, pulled / size) / size)
