"""Lags between recordings of one unit: which of them was logged by other clocks than the rest.

A unit may answer a tenth of a second late, but it does so in all of its recordings. A linear model of the unit is
fitted to the other recordings; a recording whose reading that model predicts far better at another moment was logged by
other clocks. All is done on increments over even bins, since edges tell of time and the static curve does not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._answers import binned
from smartshoe.integrity._clocks import Lags, clock_through, movements_of, regressors_of
from smartshoe.integrity._fault import OneClock
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording

NEWTON_STEPS = 4  # a lag within what the smoothing spans is found in two
NO_LAG = OneClock(0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Increments:
    """Increments of one recording's load and reading over even bins at ``grid`` (b,) in s.

    ``regressors`` (b, k): of what a unit may make of its load, the load itself first; ``response`` (b,): of the
    reading. ``start_s``: when the recording began. ``min_lag_s``: a shorter lag may be the delay of a logger.
    """

    grid: Array
    regressors: Array
    response: Array
    start_s: float
    min_lag_s: float

    @cached_property
    def normal_equations(self) -> Array:
        """(k, k + 1) inner products of the regressors with one another, and in the last column with the response."""
        return np.asarray(self.regressors.T @ np.column_stack([self.regressors, self.response]))

    def edges(self, thresholds: Thresholds) -> int:
        """The number of times that the load rises, or falls if that is less often."""
        moves = self.regressors[:, 0]
        size = np.abs(moves)
        return min(movements_of(moves, size > thresholds.standing * float(size.max())))

    def without_lag(self, clock: OneClock | None) -> Increments:
        """The same with its reading earlier by the lag of ``clock``; itself if that is None."""
        if clock is None or clock == NO_LAG:
            return self
        return replace(self, response=np.interp(self.grid + self.lag_s(clock), self.grid, self.response))

    def lag_s(self, clock: OneClock) -> Array:
        """(b,) the lag of ``clock`` at each bin."""
        return clock.lag_s(self.grid - self.start_s)

    def delayed(self, values: Array, clock: OneClock) -> Array:
        """``values`` (b,) later by the lag of ``clock``."""
        return np.asarray(np.interp(self.grid - self.lag_s(clock), self.grid, values))

    def lag_derivatives(self, predicted: Array) -> Array:
        """(b, 2) derivatives of ``predicted`` (b,) with respect to its lag at the start (s) and that lag's rate."""
        slope = -np.gradient(predicted, float(self.grid[1] - self.grid[0]))
        return np.column_stack([slope, slope * (self.grid - self.start_s)])


@on_one_thread
def increments_of(
    recordings: Sequence[Recording], usable: Sequence[Mask], count: int, thresholds: Thresholds
) -> dict[int, Increments]:
    """Increments by place in ``recordings``, of which the first ``count`` are fitted; empty where those tell nothing.

    Recordings with too few usable samples, or too short beside the longest fitted one, are left out.
    """
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
    found = {place: _increments(recordings[place], usable[place], step_s, ends_n, thresholds) for place in of_use}
    return {place: one for place, one in found.items() if one is not None}


@on_one_thread
def refined_clock(
    clock: OneClock, seen: Sequence[Lags], compared: Sequence[Increments], thresholds: Thresholds
) -> OneClock:
    """The ``clock`` that recordings share, or the line through the lags ``seen`` if one unit fits clearly better by it.

    The line's rate is the one by which one unit fits best; its offset is that of the lags seen, since a unit may be a
    little late itself. A line replaces a constant delay only if its residual squares are fewer by the factor ``clear``
    than those of the best delay.
    """
    through = clock_through(seen)
    if through is None or not compared:
        return clock
    line = clock_through(seen, _least_squares_clock(through, 2, compared, thresholds).rate)
    factor, plain = 1.0, clock
    if not clock.rate:
        factor, plain = thresholds.clear, _least_squares_clock(clock, 1, compared, thresholds)
    if line is not None and factor * residual_squares(compared, line) < residual_squares(compared, plain):
        return line
    return clock


@on_one_thread
def own_lags_s(
    compared: Mapping[int, Increments],
    lags: Sequence[Lags],
    thresholds: Thresholds,
    told_s: Mapping[int, float],
    shared: OneClock | None,
) -> dict[int, float]:
    """By place, how much later in s the reading of a recording follows than those of the others; only where it does.

    ``lags``: what each recording shows alone. ``told_s``: lags in s that some recordings have shown for certain; these
    are compared last, each with all before it, and its lag is sought near its own. ``shared``: a clock that all
    recordings may go by; lags of their own must then fit better than that.
    """
    untold = [place for place in compared if place not in told_s]
    found = _lags_of_untold({place: compared[place] for place in untold}, lags, thresholds)

    def moved(place: int) -> Increments:
        return compared[place].without_lag(OneClock(found.get(place, 0.0), 0.0))

    # Predicted at loads that the others never had: one unit must fit all of them better by these lags.
    if found and not is_better([moved(place) for place in untold], [compared[place] for place in untold], shared):
        found = {}
    known = [moved(place) for place in untold]
    for place in sorted((k for k in compared if k in told_s), key=lambda k: abs(told_s[k])):
        lag_s = _relative_lag_s(compared[place], _summed(known), thresholds, told_s[place]) if known else 0.0
        if lag_s:
            found[place] = lag_s
        known.append(compared[place].without_lag(OneClock(lag_s or told_s[place], 0.0)))
    return found


@on_one_thread
def own_clock(
    one: Increments,
    others: Sequence[Increments],
    thresholds: Thresholds,
    near_s: float,
    near: OneClock,
    shared: OneClock | None,
) -> OneClock | None:
    """The clock of one recording relative to the ``others``, which predict it; None where it goes by theirs.

    A constant lag is sought near ``near_s``, and a line near the clock ``near``, which must predict far better still.
    ``shared`` as in `is_better`.
    """
    predicted = one.regressors @ _weights(_summed(others))
    found = None
    for about, parts in ((OneClock(near_s, 0.0), 1), (near, 2)):
        found = _relative_clock(one, predicted, thresholds, about, parts, found) or found
    if found is None or not is_better([*others, one.without_lag(found)], [*others, one], shared):
        return None
    return found


def is_better(moved: Sequence[Increments], given: Sequence[Increments], shared: OneClock | None = None) -> bool:
    """Whether one unit fits recordings better with some ``moved`` by lags of their own than as they were ``given``.

    It must also fit better than with all moved by one clock, ``shared``, if there is one: what that explains is no lag
    of a single recording.
    """
    return residual_squares(moved) < min(residual_squares(given, clock) for clock in {None, shared})


def residual_squares(compared: Sequence[Increments], clock: OneClock | None = None) -> float:
    """Sum of squares of the response that one linear unit leaves, all readings moved earlier by ``clock``."""
    moved = [one.without_lag(clock) for one in compared]
    normal = _summed(moved)
    return float(sum(np.sum(one.response**2) for one in moved) - normal[:, -1] @ _weights(normal))


def _least_squares_clock(
    start: OneClock, parts: int, compared: Sequence[Increments], thresholds: Thresholds
) -> OneClock:
    """The clock, a lag or (two ``parts``) a line, by which one unit fits all best, by Gauss-Newton from ``start``.

    ``start`` itself where the steps lead farther than ``settled_s`` away.
    """
    found = start
    for _ in range(NEWTON_STEPS):
        moved = [one.without_lag(found) for one in compared]
        weights = _weights(_summed(moved))
        joint = [
            np.column_stack([one.regressors, one.lag_derivatives(one.regressors @ weights)[:, :parts]]) for one in moved
        ]
        normal = sum(rows.T @ np.column_stack([rows, one.response]) for rows, one in zip(joint, moved, strict=True))
        found = _plus(found, _weights(np.asarray(normal))[-parts:])
        if any(_largest_difference_s(one, found, start) > thresholds.settled_s for one in compared):
            return start
    return found


def _lags_of_untold(
    compared: Mapping[int, Increments], lags: Sequence[Lags], thresholds: Thresholds
) -> dict[int, float]:
    """`own_lags_s` of recordings that show no lag for certain when alone.

    The one with the longest lag of its own is moved first, since of two recordings either may be the late one; each is
    predicted by all others on the clocks found by then, and at least one stays as it is.
    """
    if len(compared) < 2:
        return {}
    compared = dict(compared)
    rest = _sums_of_others([*compared.values()])
    first_s = {
        place: _relative_lag_s(compared[place], one, thresholds) for place, one in zip(compared, rest, strict=True)
    }
    alone_s = {place: abs(lags[place].middle_s) if lags[place].at_s.size else 0.0 for place in compared}
    found: dict[int, float] = {}
    for place in sorted((k for k in compared if first_s[k]), key=lambda k: (-alone_s[k], -abs(first_s[k]))):
        others = sum(one.normal_equations for other, one in compared.items() if other != place)
        lag_s = _relative_lag_s(compared[place], np.asarray(others), thresholds)
        if lag_s and len(found) + 1 < len(compared):
            found[place] = lag_s
            compared[place] = compared[place].without_lag(OneClock(lag_s, 0.0))
    return found


def _increments(
    recording: Recording, usable: Mask, step_s: float, ends_n: tuple[float, float], thresholds: Thresholds
) -> Increments | None:
    """None of a recording of a few bins only: beside one that lasts a day, a minute tells nothing of moments."""
    from scipy.ndimage import gaussian_filter1d

    time_s = recording.time_s[usable]
    # A recording that only judges may be far longer than those that are fitted: its beginning tells enough.
    time_s = time_s[time_s <= time_s[0] + thresholds.clear * thresholds.bins * step_s]
    grid = np.arange(time_s[0] + 0.5 * step_s, time_s[-1], step_s)
    if grid.size <= thresholds.few:
        return None
    load, reading = (
        binned(time_s, five_point_median(one[usable][: time_s.size]), grid, step_s)
        for one in (recording.force_n, recording.sensor.si)
    )
    smooth = max(thresholds.echo_s / step_s, 1.0)
    regressors = regressors_of((load - ends_n[0]) / (ends_n[1] - ends_n[0]), step_s, smooth, thresholds)
    response, min_lag_s = gaussian_filter1d(reading, smooth, order=1), thresholds.few * recording.sample_time_s
    return Increments(grid, regressors, response, float(recording.time_s[0]), min_lag_s)


def _sums_of_others(compared: Sequence[Increments]) -> list[Array]:
    """For each recording the sum of all others' normal equations: of those before it and of those after it.

    A difference from the sum over all would be rounding where one recording outweighs the others.
    """
    each = np.array([one.normal_equations for one in compared])
    nothing = np.zeros_like(each[:1])
    before = np.concatenate([nothing, np.cumsum(each[:-1], axis=0)])
    after = np.concatenate([np.cumsum(each[:0:-1], axis=0)[::-1], nothing])
    return [*(before + after)]


def _relative_lag_s(one: Increments, others: Array, thresholds: Thresholds, near_s: float = 0.0) -> float:
    """The lag in s, sought near ``near_s``, of a recording behind what ``others``' normal equations predict; or 0."""
    found = _relative_clock(one, one.regressors @ _weights(others), thresholds, OneClock(near_s, 0.0), 1)
    return 0.0 if found is None else found.before_s


def _relative_clock(
    one: Increments,
    predicted: Array,
    thresholds: Thresholds,
    near: OneClock,
    parts: int,
    known: OneClock | None = None,
) -> OneClock | None:
    """The clock, a lag or (two ``parts``) a line near another, by which a reading follows what is ``predicted`` (b,).

    None unless it leaves fewer squares than the ``known`` clock (else none) by the factor ``clear``, at rising and at
    falling edges alike: load that the unit remembers has another lag for each direction. A line is told by no fewer
    than ``few`` edges of each: it goes through any two.
    """
    if parts > 1 and one.edges(thresholds) < thresholds.few:
        return None
    rises = (one.regressors[:, 0] > 0.0).astype(float)
    found = near
    for _ in range(NEWTON_STEPS):
        shifted = one.delayed(predicted, found)
        columns = one.lag_derivatives(shifted)[:, :parts]
        size = np.linalg.norm(columns, axis=0) + 1e-150
        change = np.linalg.lstsq(columns / size, one.response - shifted)[0] / size
        found = _plus(found, change)
        if _largest_difference_s(one, found, near) > thresholds.settled_s:
            return None

    def squares(clock: OneClock) -> Array:
        """(2,) at rising and at falling edges."""
        off, up = one.response - one.delayed(predicted, clock), one.delayed(rises, clock)
        return np.array([np.sum(up * off**2), np.sum((1.0 - up) * off**2)])

    is_predicted = np.all(thresholds.clear * squares(found) <= squares(known or NO_LAG))
    return found if is_predicted and _largest_difference_s(one, found, NO_LAG) > one.min_lag_s else None


def _plus(clock: OneClock, change: Array) -> OneClock:
    """A clock whose lag is longer by ``change`` (1 or 2,): at the start in s, and in its rate."""
    return OneClock(clock.before_s + float(change[0]), clock.rate + float(change[1:].sum()))


def _largest_difference_s(one: Increments, first: OneClock, second: OneClock) -> float:
    """The largest difference of two clocks' lags in a recording."""
    return float(np.max(np.abs(one.lag_s(first) - one.lag_s(second))))


def _summed(compared: Sequence[Increments]) -> Array:
    return np.asarray(np.sum([one.normal_equations for one in compared], axis=0))


def _weights(normal: Array) -> Array:
    """(k,) least-squares coefficients of the regressors, from their normal equations (k, k + 1)."""
    inner, right = normal[:, :-1], normal[:, -1]
    size = np.sqrt(np.diag(inner)) + 1e-300
    inner = inner / size / size[:, None]  # one by one: a play operator that never moves is all zeros
    inner[np.diag_indices_from(inner)] += 1e-6
    return np.asarray(np.linalg.solve(inner, right / size) / size)
