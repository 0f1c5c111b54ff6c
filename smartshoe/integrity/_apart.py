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
from smartshoe.integrity._clocks import Lags, made_of
from smartshoe.integrity._fault import OneClock
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording

STEPS = 4  # of Gauss and Newton: a lag within what the smoothing spans is found in two


@dataclass(frozen=True, eq=False)
class Told:
    """What is known of the clocks before recordings are compared: ``own_s``, lags that are told, by place.

    ``shared``: the clock that all that are fitted go by, or None; lags are beside it. ``fitted``: how many, from the
    first, foretell; all others are foretold only. ``perhaps``: one that all may go by, if it tells as much as lags of
    their own.
    """

    own_s: Mapping[int, float]
    shared: OneClock | None
    fitted: int
    perhaps: OneClock | None = None


@on_one_thread
def apart_s(
    recordings: Sequence[Recording],
    usable: Sequence[Mask],
    lags: Sequence[Lags],
    thresholds: Thresholds,
    told: Told,
) -> dict[int, float]:
    """By place, how much later the reading of a recording follows than those of the others that are fitted.

    First of those of which no lag is told. The longest lag of its own comes first, since of two recordings either may
    be the late one: each is foretold by all others, on the clocks that are found by then. Then those of which one is
    told, and those that are not fitted, each by all before it that are fitted: its own lag is where to look from.
    """
    of_use = [place for place, mask in enumerate(usable) if mask.sum() >= thresholds.least_samples]
    fitted = [place for place in of_use if place < told.fitted]
    if len(of_use) < 2 or not fitted:
        return {}
    longest_s = max(recordings[k].duration_s for k in fitted)
    step_s = max(thresholds.echo_s / thresholds.clear, longest_s / thresholds.bins)
    loads = [recordings[place].force_n[usable[place]] for place in fitted]
    ends_n = min(float(one.min()) for one in loads), max(float(one.max()) for one in loads)
    if ends_n[0] == ends_n[1]:
        return {}
    runs = {}
    for place in of_use:
        run = _run(recordings[place], usable[place], step_s, ends_n, thresholds)
        if run is not None:
            runs[place] = run.on(told.shared)
    told_last = sorted((k for k in runs if k in told.own_s), key=lambda k: abs(told.own_s[k]))
    first = [k for k in runs if k < told.fitted and k not in told.own_s]
    found = {} if told.shared else _of_first({place: runs[place] for place in first}, lags, thresholds)
    if found:  # foretold at other loads than the others had: one unit must follow all of them better by these lags
        moved = [runs[place].earlier(found.get(place, 0.0)) for place in first]
        by_one_clock = ([runs[place].on(clock) for place in first] for clock in (None, told.perhaps))
        if min(_left(one) for one in by_one_clock) <= _left(moved):
            found = {}
    known = [runs[place].earlier(found.get(place, 0.0)).products for place in first]
    later = [*(k for k in told_last if k < told.fitted), *(k for k in runs if k >= told.fitted)]
    for place in later:
        own_s = told.own_s.get(place, 0.0)
        lag_s = _later_s(runs[place], np.sum(known, axis=0), thresholds, own_s) if known else 0.0
        if lag_s:
            found[place] = lag_s
        if place < told.fitted:
            known.append(runs[place].earlier(lag_s or own_s).products)
    return found


def _of_first(runs: Mapping[int, _Run], lags: Sequence[Lags], thresholds: Thresholds) -> dict[int, float]:
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
class _Run:
    """A recording over even bins at ``grid`` (b,): increments of what a unit may make of its load, ``made`` (b, k).

    And of its reading, ``read`` (b,). ``began_s``: when it began. ``least_s``: a shorter lag may be the delay of a
    logger.
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

    def earlier(self, by_s: float) -> _Run:
        """The same with its reading earlier."""
        return self.on(OneClock(by_s, 0.0)) if by_s else self

    def on(self, clock: OneClock | None) -> _Run:
        """The same with its reading earlier by the lag of a clock."""
        if clock is None:
            return self
        return replace(self, read=np.interp(self.grid + clock.lag_s(self.grid - self.began_s), self.grid, self.read))


def _run(
    recording: Recording, usable: Mask, step_s: float, ends_n: tuple[float, float], thresholds: Thresholds
) -> _Run | None:
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
    return _Run(grid, made, read, float(recording.time_s[0]), least_s)


def _of_others(runs: Sequence[_Run]) -> list[Array]:
    """For each of them the sum of all others' products: of those before it and of those after it."""
    products = np.array([one.products for one in runs])
    nothing = np.zeros_like(products[:1])
    before = np.concatenate([nothing, np.cumsum(products[:-1], axis=0)])
    after = np.concatenate([np.cumsum(products[:0:-1], axis=0)[::-1], nothing])
    return [*(before + after)]


def _later_s(run: _Run, others: Array, thresholds: Thresholds, own_s: float = 0.0) -> float:
    """How much later one reading follows than the ``others``, by their products, foretell; about ``own_s``.

    0 where it is not foretold far better so, at rising and at falling edges alike: load that the unit remembers has a
    lag for each direction.
    """
    foretold = run.made @ _weights(others)
    rises = (run.made[:, 0] > 0.0).astype(float)
    lag_s, step_s = own_s, float(run.grid[1] - run.grid[0])
    for _ in range(STEPS):
        shifted = np.interp(run.grid - lag_s, run.grid, foretold)
        slope = -np.gradient(shifted, step_s)
        lag_s += float(slope @ (run.read - shifted)) / max(float(slope @ slope), 1e-300)
        if abs(lag_s - own_s) > thresholds.settled_s:
            return 0.0

    def left(late_s: float) -> Array:
        off = run.read - np.interp(run.grid - late_s, run.grid, foretold)
        up = np.interp(run.grid - late_s, run.grid, rises)
        return np.array([np.sum(up * off**2), np.sum((1.0 - up) * off**2)])

    is_foretold = np.all(thresholds.clear * left(lag_s) <= left(0.0))
    return lag_s if is_foretold and abs(lag_s) > run.least_s else 0.0


def _left(runs: Sequence[_Run]) -> float:
    """Squares of what is read that all together do not foretell."""
    products = np.sum([one.products for one in runs], axis=0)
    return float(sum(np.sum(one.read**2) for one in runs) - products[:, -1] @ _weights(products))


def _weights(products: Array) -> Array:
    """(k,) of what a unit may make of its load, by least squares."""
    normal, pulled = products[:, :-1], products[:, -1]
    size = np.sqrt(np.diag(normal)) + 1e-300
    normal = normal / size / size[:, None]  # one by one: a play that never moves is all noughts
    normal[np.diag_indices_from(normal)] += 1e-6
    return np.asarray(np.linalg.solve(normal, pulled / size) / size)
