"""Two clocks: a lag between load and reading that no relaxation, lag or friction of the unit explains.

1. Increments of load and reading over equal bins are correlated window by window. A window's lag is the smallest one
   that correlates about as well as the best. A unit with friction stands still after each reversal, so all lags from
   zero on correlate alike; a unit that relaxes answers a corner of the load at once. Both give zero.
2. A straight line (an offset and a rate) is laid through the windows' lags.
3. The line must *earn* its place. Powers of the load, the load behind a bank of first-order lags and play operators are
   fitted to the reading; they must fit it far better on the shifted clock than on the given one, both as the load rises
   and as it falls.
4. The reading must not answer changes of the load before that lag is over, as a slow unit does, whatever its equation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity._answers import answered_s, in_bins
from smartshoe.integrity._fault import Finding, OneClock
from smartshoe.integrity._view import Signal, View
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording
from smartshoe.signals.lags import share_regressors
from smartshoe.signals.masks import runs_of

# Resolutions: half and twice of each changed no finding in two cases.
SMOOTHING = (1.0, 3.0, 6.0)  # echoes
WINDOWS = 8  # at most: octants of the load's movement
OCTAVES: Array = 2.0 ** np.arange(-2.0, 4.0)  # widths of the play operators, in shares that count as standing still


@dataclass(frozen=True, eq=False)
class Lags:
    """The lags ``lag_s`` (w,) by which the reading follows its load, at times ``at_s`` (w,) from a recording's start.

    They may be of a clock or of the unit itself. Empty where the recording tells none.
    """

    at_s: Array
    lag_s: Array

    @property
    def middle_s(self) -> float:
        """The median lag."""
        return float(np.median(self.lag_s))

    def off_from_s(self, clock: OneClock) -> float:
        """The median of their distances from a clock's lags; infinite where there are none."""
        off = np.abs(self.lag_s - clock.lag_s(self.at_s))
        return float(np.median(off)) if off.size else np.inf

    def are_of(self, clock: OneClock, thresholds: Thresholds) -> bool:
        """Whether they lie on a clock's line, within a share of its longest lag; false where there are none."""
        return bool(self.at_s.size) and _describes(clock.lag_s(self.at_s), self.lag_s, thresholds)


UNSEEN = Lags(np.zeros(0), np.zeros(0))


def align(view: View) -> tuple[View, Lags]:
    """The view with its load set on the reading's clock, where the clocks differ, and the lags that were seen.

    A reading that is late by a quarter or half of a period seems to fall as the load rises. It is turned over where it
    follows the load only when turned over, or far more closely. Where the load rises as it falls both are as close,
    and the reading is left as it is.
    """
    followed = _window_lags(view)
    is_open = not _correlates(followed, view.thresholds)
    if view.sign < 0 or is_open:
        turned = view.turned()
        over = _window_lags(turned)
        far = view.thresholds.clear * (1.0 - _correlation_of(over)) < 1.0 - _correlation_of(followed)
        if far and over is not None and followed is not None and over.smooth_s > followed.smooth_s:
            # Strong smoothing makes sines of any presses, and sines follow one another either way.
            alike = _window_lags(view, (over.smooth_s / view.thresholds.echo_s,))
            far = view.thresholds.clear * (1.0 - _correlation_of(over)) < 1.0 - _correlation_of(alike)
        if _correlates(over, view.thresholds) and (is_open or far):
            view, followed = turned, over
    if followed is None:
        return view, UNSEEN
    seen = Lags(followed.places - view.recording.time_s[0], followed.best)
    line = _lag_line(view, followed) if _correlates(followed, view.thresholds) else None
    if line is None:
        return view, seen
    offset_s, rate = line
    middle = _middle_of(view)
    moved = view.time_s - offset_s - rate * (view.time_s - middle)
    load = np.interp(moved, view.time_s, view.load.values)
    return replace(view, load=Signal(load, view.thresholds), offset_s=offset_s, rate=rate), seen


def clock_through(each: Sequence[Lags], rate: float | None = None) -> OneClock | None:
    """One line through the lags of all recordings (Theil 1950, Sen 1968), of a given ``rate`` if any; None of none."""
    there = [one for one in each if one.at_s.size]
    if not there:
        return None
    at_s, lag_s = np.concatenate([one.at_s for one in there]), np.concatenate([one.lag_s for one in there])
    rate = _slope(at_s, lag_s) if rate is None else rate
    return OneClock(float(np.median(lag_s - rate * at_s)), rate)


def one_clock(each: Sequence[Lags], thresholds: Thresholds) -> OneClock | None:
    """The one clock that accounts for the lags of all recordings: a constant delay if that does, else a line, or None.

    A recording with few or slow movements tells no clock alone, and those that do differ by chance. The distances of
    most lags from the clock, and the spread of the recordings' medians, must be within a share of the longest lag.
    """
    through, there = clock_through(each), [one for one in each if one.at_s.size]
    if through is None:
        return None
    middle_s = np.array([one.middle_s for one in there])
    for found in (OneClock(float(np.mean(middle_s)), 0.0), through):
        lines = [found.lag_s(one.at_s) for one in there]
        off = [one.lag_s - line for one, line in zip(there, lines, strict=True)]
        allowed = thresholds.same * float(np.max(np.abs([*middle_s, *np.concatenate(lines)])))
        within = max(float(np.quantile(np.abs(one), 1.0 - thresholds.same)) for one in off)
        if max(within, float(np.ptp([np.median(one) for one in off]))) <= allowed:
            return found
    return None


def two_clocks(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``two_clocks``: all samples are late or early; none is masked."""
    if view.offset_s == 0.0 and view.rate == 0.0:
        return
    clock = OneClock(view.offset_s - 0.5 * view.rate * view.recording.duration_s, view.rate)
    yield from_two_clocks(view.recording, clock, "than the unit's relaxation explains", _least_lag_s(view))


def from_two_clocks(recording: Recording, clock: OneClock, more: str, least_s: float = 0.0) -> Finding:
    """The finding of a reading that lags by ``clock``; ``more`` says than what.

    The lag at the start and at the end is said where they differ by more than ``least_s``.
    """
    first_s, middle_s, last_s = clock.lag_s(np.array([0.0, 0.5, 1.0]) * recording.duration_s)
    is_drift = abs(last_s - first_s) > least_s
    course = f" (from {first_s:+.2f} s at the start to {last_s:+.2f} s at the end)" if is_drift else ""
    return Finding(
        "two_clocks",
        np.ones(len(recording), dtype=bool),
        f"load and reading come from two clocks: the reading is {abs(middle_s):.2f} s"
        f" {'late' if middle_s >= 0 else 'early'}{course}, more {more} (record both"
        " by one clock, unless the unit is itself that slow under such loads)",
    )


def _least_lag_s(view: View) -> float:
    """The shortest lag that counts: a shorter one may be the sensor's own or a logger's delay, which a model has."""
    return max(view.thresholds.sensor_lag_s, view.thresholds.few * view.step_s)


@dataclass(frozen=True, eq=False)
class _WindowLags:
    """Load and reading over even bins at ``grid`` (b,), and the lag of the reading in each of w windows.

    ``movements``: how often the load begins to rise or to fall. ``places`` (w,): the windows' middles in s. ``best``
    (w,): the lags in s that correlate best, ``weights`` (w,) these correlations; ``smallest`` (w,): zero where zero
    correlates about as well, else ``best``.
    """

    grid: Array
    load: Array
    reading: Array
    smooth_s: float
    movements: int
    places: Array
    smallest: Array
    best: Array
    weights: Array


def _window_lags(view: View, smoothing: Sequence[float] = SMOOTHING) -> _WindowLags | None:
    """How late the reading follows, or None where that cannot be told; ``smoothing``: widths to try, in ``echo_s``."""
    given = view.thresholds
    if view.time_s[-1] - view.time_s[0] < given.hold_s:
        return None
    width_s, grid, load, reading = in_bins(view, 2)
    if np.ptp(load) == 0.0 or np.ptp(reading) == 0.0 or _is_one_sine(load, given):
        return None
    for echoes in smoothing:  # the narrowest that the noise allows, since smoothing blunts the edges
        found = _by_windows(grid, load, reading, width_s, echoes * given.echo_s, given)
        if _correlates(found, given):
            break
    return found


def _correlation_of(of: _WindowLags | None) -> float:
    """The windows' median correlation of the reading's increments with the load's; -1 of none."""
    return -1.0 if of is None else float(np.median(of.weights))


def _correlates(of: _WindowLags | None, thresholds: Thresholds) -> bool:
    """Whether the reading's increments correlate well with the load's."""
    return _correlation_of(of) >= 1.0 - thresholds.same


def _lag_line(view: View, of: _WindowLags) -> tuple[float, float] | None:
    """The lag in the middle of the recording in s and its rate in s per s, or None where the clocks agree."""
    duration_s = view.recording.duration_s
    given = view.thresholds
    grid, places = of.grid, of.places
    if of.movements < given.few:  # a curve, too, makes the rise late and the fall early
        return None
    least = _least_lag_s(view)
    middle = _middle_of(view)
    as_logged, repeating = None, _repeats_itself(of.load, given)
    # Where zero lag correlates nearly as well, as it does on long even ramps, the line must earn more.
    for lags, earned in ((of.smallest, 1.0 - given.same), (of.best, 1.0 / given.clear)):
        if np.max(np.abs(lags)) <= least:
            continue
        offered = []
        for offset_s, rate in _lines(places - middle, lags, of.weights, 0.5 * duration_s):
            ends = offset_s + 0.5 * rate * duration_s * np.array([-1.0, 1.0])
            if np.max(np.abs(ends)) <= least or not _describes(offset_s + rate * (places - middle), lags, given):
                continue
            followed_s = grid - offset_s - rate * (grid - middle)
            known = (followed_s >= grid[0]) & (followed_s <= grid[-1])
            as_logged = _increments(of, of.load, given) if as_logged is None else as_logged
            before = _unexplained(*as_logged, known)
            after = _unexplained(*_increments(of, np.interp(followed_s, grid, of.load), given), known)
            agreed = lags is of.smallest and not repeating and _unanimous(places - middle, lags, offset_s, rate, given)
            # A unit that relaxes answers later the farther it is pressed: a growing lag without any clock. Where it
            # relaxes by half it is seconds late, and the shifted clock explains it far worse. Blunt edges tell a
            # constant lag and a relaxation apart in neither way.
            agrees = agreed and after.sum() < before.sum() / (1.0 if rate else 1.0 - given.same)
            # At rising and at falling edges alike: what a unit remembers of its load has another lag each way.
            is_earned = agrees or np.all(after <= earned * before)
            if is_earned and not _is_answered_before(view, ends, given):
                offered.append((float(after.sum()), offset_s, rate))
        if offered:
            return min(offered)[1:]
    return None


def _middle_of(view: View) -> float:
    """The middle of the recording in s, also where load or reading is missing at an end."""
    return 0.5 * float(view.recording.time_s[0] + view.recording.time_s[-1])


def _is_one_sine(load: Array, thresholds: Thresholds) -> bool:
    """Whether the load is hardly more than one sine: a lag is then a phase shift, which any relaxation makes."""
    power = np.abs(np.fft.rfft(np.diff(load))) ** 2
    best = int(np.argmax(power))
    return bool(power[max(best - 2, 0) : best + 3].sum() > (1.0 - thresholds.faulty_share) * power.sum())


def _repeats_itself(load: Array, thresholds: Thresholds) -> bool:
    """Whether the load is periodic: all windows may then agree on a lag that is wrong by a period."""
    from scipy.signal import correlate

    d = np.diff(load)
    correlation = correlate(d, d, mode="full", method="fft")[d.size - 1 :]
    correlation = correlation[: d.size // 2] / (correlation[0] * (1.0 - np.arange(d.size // 2) / d.size))
    fallen = int(np.argmax(correlation < 0.0)) or correlation.size
    return bool(np.max(correlation[fallen:], initial=0.0) > 1.0 - thresholds.same)


def _unanimous(places: Array, lags: Array, offset_s: float, rate: float, thresholds: Thresholds) -> bool:
    """Whether the windows agree on a lag that is too long for a sensor: edges then need not be sharp enough to tell.

    Counted are the windows in which the line is clearly longer than a sensor's lag. Hardly any of them may allow a lag
    of zero, as those of a unit that relaxes do.
    """
    line = offset_s + rate * places
    far = np.abs(line) > thresholds.clear * thresholds.sensor_lag_s
    return bool(far.sum() >= WINDOWS // 2 and np.mean(lags[far] != 0.0) >= 1.0 - thresholds.same)


def _is_answered_before(view: View, ends_s: Array, thresholds: Thresholds) -> bool:
    """Whether the reading answers its load within half of the line's lag (``ends_s``, (2,), at its ends).

    Then the unit is slow: with two clocks nothing is answered before the lag is over.
    """
    if ends_s[0] * ends_s[1] <= 0.0:
        return False
    least_s = float(np.min(np.abs(ends_s)))
    width_s = max(view.step_s, least_s / (thresholds.clear * thresholds.few))
    answered = answered_s(view, width_s)
    return answered is not None and thresholds.clear * abs(answered) < least_s


def _describes(line: Array, lags: Array, thresholds: Thresholds) -> bool:
    """Whether ``lags`` (w,) lie on a ``line`` (w,), within a share of its longest lag."""
    return bool(np.median(np.abs(lags - line)) < thresholds.same * np.max(np.abs(line)))


def _by_windows(
    grid: Array, load: Array, reading: Array, width_s: float, smooth_s: float, thresholds: Thresholds
) -> _WindowLags | None:
    """How late the reading follows in each window in which both it and the load move; None where there is none."""
    from scipy.ndimage import gaussian_filter1d

    smooth = max(smooth_s / width_s, 1.0)
    d_load = gaussian_filter1d(load, smooth, order=1)
    d_reading = gaussian_filter1d(reading, smooth, order=1)
    moving = np.abs(d_load) > thresholds.faulty_share * np.max(np.abs(d_load))
    d_reading = _without_jumps(d_reading, moving, thresholds)
    longest_s = thresholds.lasting_s
    most = min(int(np.ceil(longest_s / width_s)), grid.size // 6)
    windows = int(max(1, min(WINDOWS, grid.size * width_s / (thresholds.clear * longest_s))))
    lags_bins = np.arange(-most, most + 1)
    cumulated = np.cumsum(d_load**2)
    cuts = np.searchsorted(cumulated, np.linspace(0.0, cumulated[-1], windows + 1))
    places, smallest, peaks, weights = [], [], [], []
    for first, last in pairwise(cuts):
        low, high = max(int(first) - most, 0), min(int(last) + most, grid.size)
        if high - low < 4 * most:
            continue
        correlation = _correlation(d_load[low:high], d_reading[low:high], most, thresholds)
        best = _peak(correlation, thresholds)
        if best is None:
            continue
        closeness, against = float(correlation[best]), -float(correlation[-1 - best])
        is_opposed = thresholds.clear * against > closeness
        # A correlation as strong and negative at the opposite lag: one signal is the other's rate, as in friction. A
        # delay does the same in even steps, but the reading then follows far more closely.
        if closeness < thresholds.follows or (is_opposed and thresholds.clear * (1.0 - closeness) > 1.0 - against):
            continue
        good = np.flatnonzero(correlation >= (1.0 - thresholds.standing) * correlation[best])
        chosen = int(good[np.argmin(np.abs(lags_bins[good]))])
        # Where zero does not correlate about as well as the best, the lag is that of the peak.
        peak = (float(lags_bins[best]) + _beside_its_sample(correlation, best)) * width_s
        power = d_load[low:high] ** 2
        places.append(float(np.dot(power, grid[low:high]) / power.sum()))
        smallest.append(peak if lags_bins[chosen] != 0 else 0.0)
        peaks.append(peak)
        weights.append(closeness)
    if not places:
        return None
    each = (np.array(one) for one in (places, smallest, peaks, weights))
    return _WindowLags(grid, load, reading, smooth_s, sum(movements_of(d_load, moving)), *each)


def movements_of(increments: Array, moving: Mask) -> tuple[int, int]:
    """How often a load with these ``increments`` (b,) rises, and falls, where it is ``moving`` (b,)."""
    rises, falls = (runs_of(moving & (way * increments > 0.0))[0].size for way in (1.0, -1.0))
    return rises, falls


def _without_jumps(increments: Array, moving: Mask, thresholds: Thresholds) -> Array:
    """(b,) a reading's increments, those of dropouts and jumps clipped to what moves usually reach.

    The usual size is the median of the largest ones, as many as there are bins in which the load is ``moving`` (b,):
    when the reading moves is not known before the clocks are, but how often is.
    """
    usual = float(np.quantile(np.abs(increments), 1.0 - 0.5 * float(moving.mean())))
    limit = largest_of_noise(increments.size, thresholds) * usual + 1e-300
    return np.asarray(np.clip(increments, -limit, limit))


def _correlation(load: Array, reading: Array, most: int, thresholds: Thresholds) -> Array:
    """(2 most + 1,) correlation at lags -most..most bins, normalised by what overlaps at each lag.

    Normalised by the whole window, a long lag would seem worse than one that is shorter by a step of a walk. Where less
    than half of the movement overlaps, the norm of half of it is taken.
    """
    from scipy.signal import correlate

    lags = np.arange(-most, most + 1)
    begin, count = np.maximum(lags, 0), load.size - np.abs(lags)  # the reading's samples that overlap

    def overlapping(values: Array, first: Index) -> Array:
        total = np.append(0.0, np.cumsum(values))
        return np.asarray(total[first + count] - total[first])

    products = correlate(reading, load, mode="full", method="fft")[load.size - 1 - most : load.size + most]
    of_load, of_reading = overlapping(load, begin - lags), overlapping(reading, begin)
    together = products - of_load * of_reading / count
    power = (overlapping(load**2, begin - lags) - of_load**2 / count) * (
        overlapping(reading**2, begin) - of_reading**2 / count
    )
    least = load.size * float(np.std(load) * np.std(reading)) / thresholds.clear
    if least == 0.0:
        return np.zeros(lags.size)
    return np.asarray(np.minimum(together / np.maximum(np.sqrt(np.maximum(power, 0.0)), least), 1.0))


def _peak(correlation: Array, thresholds: Thresholds) -> int | None:
    """The index of the correlation's peak, or None where the reading follows beyond the longest lag.

    A periodic load has a peak a period: the one nearest to zero is taken whose distance from 1 is within a factor
    ``clear`` of the best one's. That best distance is taken as ``standing`` squared at least, since a gain that drifts
    makes a later period the closer one; and as ``standing`` where the best is at the longest lag, as a period may be.
    """
    inner = correlation[1:-1]
    is_peak = (inner >= correlation[:-2]) & (inner >= correlation[2:])
    is_inside = 0 < int(np.argmax(correlation)) < correlation.size - 1
    missed = max(1.0 - float(np.max(correlation)), thresholds.standing ** (2 if is_inside else 1))
    peaks = np.flatnonzero(is_peak & (thresholds.clear * missed >= 1.0 - inner)) + 1
    return int(peaks[np.argmin(np.abs(peaks - correlation.size // 2))]) if peaks.size else None


def _beside_its_sample(values: Array, best: int) -> float:
    """How far the peak of ``values`` (n,) lies from its sample ``best``, in samples, by a parabola through three."""
    before, at, after = values[best - 1 : best + 2]
    bend = before - 2.0 * at + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def _lines(places: Array, lags: Array, weights: Array, half_s: float) -> list[tuple[float, float]]:
    """Lines to try, as (lag in the middle in s, rate); ``places`` (w,) from the middle, which is ``half_s`` long after.

    With four windows or more the median of all pairs' slopes (Theil 1950, Sen 1968), if it halves the scatter; then a
    line from zero at the start, where both clocks may have been set; then a constant.
    """
    found = []
    if places.size >= 4:
        rate = _slope(places, lags)
        left = lags - rate * places
        if np.median(np.abs(left - np.median(left))) < 0.5 * np.median(np.abs(lags - np.median(lags))):
            found.append((_middle(left, weights), rate))
    grown = _middle(lags / (places + half_s), weights)
    return [*found, (grown * half_s, grown), (_middle(lags, weights), 0.0)]


def _slope(places: Array, lags: Array) -> float:
    """The median slope over all pairs of places that are not close together; 0 of a single place."""
    i, j = np.triu_indices(places.size, 1)
    apart = np.abs(places[j] - places[i]) > np.ptp(places) / places.size
    return float(np.median((lags[j] - lags[i])[apart] / (places[j] - places[i])[apart])) if apart.any() else 0.0


def _middle(values: Array, weights: Array) -> float:
    """The weighted median."""
    return float(np.quantile(values, 0.5, weights=weights, method="inverted_cdf"))


def _increments(of: _WindowLags, load: Array, thresholds: Thresholds) -> tuple[Array, Array]:
    """Increments (b, k) of what a unit may make of a ``load`` (b,), the load's own first, and (b,) of the reading.

    Increments, since edges tell of clocks and the static curve does not. Jumps of the reading are clipped.
    """
    from scipy.ndimage import gaussian_filter1d

    step_s = float(of.grid[1] - of.grid[0])
    smooth = max(of.smooth_s / step_s, 1.0)
    made = regressors_of((load - load.min()) / np.ptp(load), step_s, smooth, thresholds)
    read = gaussian_filter1d(of.reading, smooth, order=1)
    moving = np.abs(made[:, 0]) > thresholds.faulty_share * np.max(np.abs(made[:, 0]))
    return made, _without_jumps(read, moving, thresholds)


def regressors_of(share: Array, step_s: float, smooth: float, thresholds: Thresholds) -> Array:
    """Increments (b, k), smoothed over ``smooth`` bins, of what a unit may make of a load of ``share`` (b,).

    First its own, then its square and cube, first-order lags of it, and play operators.
    """
    from scipy.ndimage import gaussian_filter1d

    shortest_s, longest_s = thresholds.echo_s / thresholds.clear, thresholds.clear * thresholds.memory_s[-1]
    viscous = share_regressors(share, step_s, np.geomspace(shortest_s, longest_s, 8))  # two and a half a decade
    rubbed = _play(share, thresholds.standing * OCTAVES)
    return np.asarray(gaussian_filter1d(np.concatenate([viscous, rubbed], axis=1), smooth, axis=0, order=1))


@on_one_thread
def _unexplained(made: Array, read: Array, known: Mask) -> Array:
    """(2,) residual sums of squares over rising and over falling load, of `_increments` by least squares.

    Only where the shifted load is ``known`` (b,): what a reading follows may lie before or after the recording.
    """
    matrix, target = made[known], read[known]
    matrix /= np.linalg.norm(matrix, axis=0) + 1e-300
    normal = matrix.T @ matrix
    normal[np.diag_indices_from(normal)] += 1e-6
    left = target - matrix @ np.linalg.solve(normal, matrix.T @ target)
    rising = matrix[:, 0] > 0.0
    return np.array([np.sum(left[rising] ** 2), np.sum(left[~rising] ** 2)])


def _play(load: Array, width: Array) -> Array:
    """(n, widths) play operators of the load, one a width."""
    from smartshoe.kernels.memory import NO_LOAD, backlash

    out = np.empty((width.size, load.size))
    for half_width, row in zip(width, out, strict=True):
        backlash(load, half_width, np.array([NO_LOAD]), row)
    return out.T
