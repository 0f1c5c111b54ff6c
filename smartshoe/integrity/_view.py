"""`View`: one recording as the detectors see it: load and reading on one clock, their scales, the static curve."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity._scales import (
    SECOND_DIFFERENCE,
    five_point_median,
    grid_step,
    local_scale,
    slope_change,
    turns,
    white_noise,
)
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.recording import Recording
from smartshoe.signals.noise import is_switched
from smartshoe.stamps import usual_step_s


def toggling(thresholds: Thresholds) -> float:
    """In grid steps, no clear noise: half a step is what the toggling of a silent signal between two looks like."""
    return 0.5 * math.sqrt(thresholds.clear)


@dataclass(frozen=True, eq=False)
class Signal:
    """A channel at the samples where load and reading are both present: ``values`` (m,) with their scales."""

    values: Array
    thresholds: Thresholds

    @cached_property
    def largest(self) -> float:
        """What noise reaches in the whole recording, in standard deviations."""
        return largest_of_noise(self.values.size, self.thresholds)

    @cached_property
    def levels(self) -> tuple[Array, Index]:
        """The values that occur, increasing, and how often each does."""
        values, count = np.unique(self.values, return_counts=True)
        return values, count.astype(np.intp)

    @cached_property
    def step(self) -> float:
        """The grid's step, 0 where there is none."""
        return grid_step(*self.levels, self.thresholds)

    @cached_property
    def least_gap(self) -> Array:
        """(m,) the smallest difference between values near each reading that differ: no grid's step is larger there."""
        from scipy.ndimage import minimum_filter1d

        levels = self.levels[0]
        if levels.size < 2:
            return np.zeros(self.values.size)
        gaps = np.diff(levels)
        beside = max(self.thresholds.local, round(self.thresholds.standing * gaps.size))
        least = minimum_filter1d(np.append(gaps, gaps[-1]), beside)
        return least[np.searchsorted(levels, self.values)]

    @cached_property
    def local_step(self) -> Array:
        """(m,) the grid's step at each reading, 0 where it lies on none.

        Where the grid is uneven (a logarithmic code) or part of the readings lie on it (a converter with two ranges),
        the distance between neighbours among the values that come back after others: noise takes none of its own twice.
        """
        if self.step > 0.0:
            return np.full(self.values.size, self.step)
        visited = self.values[np.flatnonzero(np.diff(self.values, prepend=np.nan) != 0.0)]
        values, visits = np.unique(visited, return_counts=True)
        levels = values[visits > 1]
        if levels.size < 3:
            return np.zeros(self.values.size)
        place = np.minimum(np.searchsorted(levels, self.values), levels.size - 1)
        on = levels[place] == self.values
        # A peak may touch a level once: where most readings lie on a grid all do.
        return np.where(on | (on.mean() > 1.0 - self.thresholds.same), np.gradient(levels)[place], 0.0)

    @cached_property
    def is_noisy(self) -> bool:
        """Whether second differences change sign more often than not: noise above one grid step, not curvature."""
        turned, stayed = turns(np.diff(self.values, 2))
        least = max(toggling(self.thresholds) * self.step, self.thresholds.material * float(np.ptp(self.values)))
        return bool(turned.sum() > stayed.sum()) and self.quiet_noise > least

    @cached_property
    def outlying(self) -> Array:
        """(m,) values less their running five-point median: 0 at both ends and on monotone stretches without noise."""
        out: Array = self.values - five_point_median(self.values)
        out[:2] = out[-2:] = 0.0
        return out

    @cached_property
    def noise(self) -> Array:
        """(m,) local standard deviation of white noise; none of what is switched between a few levels."""
        if self.is_switched:
            return np.zeros(self.values.size)
        return white_noise(self.values, self.thresholds, self.step)

    @cached_property
    def is_switched(self) -> bool:
        """Whether it takes a few values only and stays on them, so that its steps are no noise."""
        return is_switched(self.values, self.thresholds.few, self.thresholds.false_alarm)

    @cached_property
    def quiet_noise(self) -> float:
        """The recording's usual noise: median of the local ones."""
        return float(np.median(self.noise))


@dataclass(frozen=True, eq=False)
class Ends:
    """Readings, as recorded, to which a unit's sensor drops out, ``dropouts`` (v,), and where it ends, ``rails``."""

    dropouts: Array
    rails: Array


UNKNOWN_ENDS = Ends(np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class View:
    """A recording with both signals.

    ``index`` (m,) are the samples where both are present. ``reading`` is turned so that it rises with load (``sign``
    is -1 where it was turned), ``load`` is set on the reading's clock by the lag ``offset_s`` + ``rate`` (t - middle).
    ``ends``: what all recordings tell of the unit's sensor. ``is_swapped``: load and reading have changed places.
    """

    recording: Recording
    index: Index
    time_s: Array
    load: Signal
    reading: Signal
    sign: int
    thresholds: Thresholds
    offset_s: float = 0.0
    rate: float = 0.0
    ends: Ends = UNKNOWN_ENDS
    is_swapped: bool = False

    @cached_property
    def step_s(self) -> float:
        """The usual sampling step."""
        return usual_step_s(self.time_s)

    @cached_property
    def near(self) -> int:
        """Samples within which a corner of the load and its echo in the reading may lie."""
        return max((self.thresholds.few + 1) // 2, round(self.thresholds.echo_s / self.step_s))

    @cached_property
    def gap(self) -> Mask:
        """(m - 1,) increments of time in which a sample is missing."""
        return np.diff(self.time_s) > 1.5 * self.step_s

    @cached_property
    def curve(self) -> tuple[Array, Array]:
        """Loads (bins,) and median reading at each: the static curve, whatever its shape."""
        load, reading = self.load.values, self.reading.values
        steady = five_point_median(load)  # without spikes
        bins = round(1.0 / self.thresholds.standing)
        edges = np.linspace(steady.min(), steady.max(), bins + 1)[1:-1]
        place = np.searchsorted(edges, load)
        order = np.lexsort((reading, place))
        counts = np.bincount(place, minlength=bins)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        filled = counts > 0
        first, size = starts[filled], counts[filled]
        middle = reading[order][first + size // 2]
        at = np.bincount(place, weights=load, minlength=bins)[filled] / size
        return at, middle

    @cached_property
    def noise_at_load(self) -> Array:
        """(m,) the usual noise at each sample's load, by the upper quartile: also that of a rest beside a ramp."""
        from scipy.special import ndtri

        edges = self.curve[0][:-1] + 0.5 * np.diff(self.curve[0])
        place = np.searchsorted(edges, self.load.values)
        second = np.zeros(place.size)
        second[1:-1] = np.abs(np.diff(self.reading.values, 2))
        usual = np.zeros(edges.size + 1)
        order = np.argsort(place, kind="stable")
        cuts = np.searchsorted(place[order], np.arange(edges.size + 2))
        for i in range(usual.size):
            if cuts[i + 1] > cuts[i]:
                part, rank = second[order[cuts[i] : cuts[i + 1]]], 3 * (cuts[i + 1] - cuts[i]) // 4
                usual[i] = np.partition(part, rank)[rank]
        return usual[place] / (float(ndtri(0.875)) * SECOND_DIFFERENCE)

    @cached_property
    def expected(self) -> Array:
        """(m,) the static curve at each sample's load."""
        at, middle = self.curve
        return np.interp(self.load.values, at, middle)

    @cached_property
    def rest(self) -> float:
        """The reading of the unloaded unit."""
        return float(self.curve[1][0])

    @cached_property
    def span(self) -> float:
        """What the reading covers, by the static curve."""
        return float(np.ptp(self.curve[1]))

    @cached_property
    def load_span(self) -> float:
        """What the load covers, spikes left out."""
        return float(np.ptp(self.curve[0]))

    @cached_property
    def gain(self) -> float:
        """Reading per load that no stretch of the static curve exceeds much: the steepest of its stretches."""
        at, middle = self.curve
        if at.size < 2 or self.load_span == 0.0:
            return 0.0
        stretch = self.thresholds.same * self.load_span
        low = at[at <= at[-1] - stretch]
        rise = np.interp(low + stretch, at, middle) - np.interp(low, at, middle)
        return float(np.max(np.abs(rise)) / stretch)

    @cached_property
    def load_corner(self) -> Array:
        """(m,) change of the load's increment nearby: what a corner of the load may do to the reading, in load."""
        return slope_change(self.load.values, self.load.noise, self.near, self.load.largest)

    @cached_property
    def reading_corner(self) -> Array:
        """(m,) the same of the reading."""
        return slope_change(self.reading.values, self.reading.noise, self.near, self.reading.largest)

    @cached_property
    def steady_load(self) -> Array:
        """(m,) the load's mean over ``near`` samples."""
        from scipy.ndimage import uniform_filter1d

        return uniform_filter1d(self.load.values, self.near, mode="nearest")

    @cached_property
    def load_move(self) -> Array:
        """(m - 1,) largest increment of the load nearby, noise left out."""
        from scipy.ndimage import maximum_filter1d

        step = np.abs(np.diff(self.steady_load))
        noise = np.sqrt(2.0) * self.load.largest * self.load.quiet_noise
        sharp = np.maximum(np.abs(np.diff(self.load.values)) - noise - self.load.step, 0.0)
        return maximum_filter1d(np.maximum(step, sharp), 2 * self.near + 1, mode="nearest")

    @cached_property
    def reading_move(self) -> Array:
        """(m - 1,) usual increment of the reading nearby."""
        return local_scale(np.diff(self.reading.values), self.thresholds)

    @cached_property
    def jump(self) -> Array:
        """(m - 1,) increments of the reading beyond what load, local slope, noise and grid explain; signed, else 0.

        Increments over gaps of time count as explained.
        """
        step = np.diff(self.reading.values)
        noise = np.maximum(self.reading.noise[1:], self.reading.noise[:-1])
        clear = self.thresholds.clear
        grid = np.maximum(self.reading.local_step[1:], self.reading.local_step[:-1])
        allowed = clear * (self.gain * self.load_move + clear * self.reading_move + grid)
        allowed = np.maximum(
            allowed + np.sqrt(2.0) * self.reading.largest * noise, self.thresholds.material * self.span
        )
        excess = np.where(np.abs(step) > allowed, step, 0.0)
        excess[self.gap] = 0.0
        return excess

    @cached_property
    def jitter_reach(self) -> Array:
        """(m,) what an error of the sampling time may bring into each reading; 0 unless noise follows the slope.

        Where ramps are much noisier than rests, noise over slope is an error of time, and a rest beside a ramp may
        hold any reading that the ramp takes within a few of those.
        """
        from scipy.ndimage import maximum_filter1d, minimum_filter1d

        nothing = np.zeros(self.time_s.size)
        slope = np.abs(np.gradient(self.expected_steadily, self.step_s))
        given = self.thresholds
        usual = float(np.quantile(slope, 1.0 - given.standing))  # not the one corner that a step of load makes
        steep, flat = given.clear * slope > usual, slope < given.faulty_share * usual
        if min(steep.sum(), flat.sum()) < given.least_samples:
            return nothing
        if np.median(self.reading.noise[steep]) < given.clear * np.median(self.reading.noise[flat]):
            return nothing
        jitter_s = float(np.median(self.reading.noise[steep] / slope[steep]))
        size = 2 * int(np.ceil(self.reading.largest * jitter_s / self.step_s)) + 1
        high = maximum_filter1d(self.expected_steadily, size, mode="nearest")
        return high - minimum_filter1d(self.expected_steadily, size, mode="nearest")

    @cached_property
    def expected_steadily(self) -> Array:
        """(m,) the static curve at each sample's load, the load's noise averaged."""
        return np.interp(self.steady_load, *self.curve)

    def turned(self) -> View:
        """The same with the reading turned over."""
        return replace(self, reading=Signal(-self.reading.values, self.thresholds), sign=-self.sign)

    def upside_down(self) -> View:
        """The same with load and reading turned over: the loaded end is the unloaded one."""
        load, reading = (Signal(-one.values, self.thresholds) for one in (self.load, self.reading))
        return replace(self, load=load, reading=reading, sign=-self.sign)

    def swapped(self) -> View:
        """The reading for the load and the load for the reading, of which no ends are known."""
        return replace(self, load=self.reading, reading=self.load, sign=1, ends=UNKNOWN_ENDS, is_swapped=True)

    def whole(self, at: Mask) -> Mask:
        """A mask (m,) over this view as one over all of the recording's samples."""
        out = np.zeros(len(self.recording), dtype=bool)
        out[self.index[at]] = True
        return out
