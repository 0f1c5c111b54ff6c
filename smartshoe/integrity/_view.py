"""`View`: one recording as the detectors see it: load and reading on one clock, their scales, the static curve.

All scales are computed when first asked for, and rest on medians where faults must not move them.
"""

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
    is_turning,
    local_scale,
    slope_change,
    white_noise,
)
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.recording import Recording
from smartshoe.signals.noise import is_switched
from smartshoe.stamps import usual_step_s


def toggling(thresholds: Thresholds) -> float:
    """Noise in grid steps that is no clear noise: a silent signal that toggles between two levels shows half a step."""
    return 0.5 * math.sqrt(thresholds.clear)


@dataclass(frozen=True, eq=False)
class Signal:
    """A channel at the m samples where load and reading are both present: ``values`` (m,) with their scales."""

    values: Array
    thresholds: Thresholds

    @cached_property
    def largest(self) -> float:
        """How many standard deviations noise reaches in the whole recording."""
        return largest_of_noise(self.values.size, self.thresholds)

    @cached_property
    def levels(self) -> tuple[Array, Index]:
        """The values that occur, increasing, and how often each occurs, (l,) each."""
        values, count = np.unique(self.values, return_counts=True)
        return values, count.astype(np.intp)

    @cached_property
    def step(self) -> float:
        """The grid's step, 0 where no grid is found."""
        return grid_step(*self.levels, self.thresholds)

    @cached_property
    def least_gap(self) -> Array:
        """(m,) smallest difference between values that occur near each value: a grid's step is not larger there."""
        from scipy.ndimage import minimum_filter1d

        levels = self.levels[0]
        if levels.size < 2:
            return np.zeros(self.values.size)
        gaps = np.diff(levels)
        width = max(self.thresholds.local, round(self.thresholds.standing * gaps.size))
        least = minimum_filter1d(np.append(gaps, gaps[-1]), width)
        return least[np.searchsorted(levels, self.values)]

    @cached_property
    def local_step(self) -> Array:
        """(m,) the grid's step at each reading, 0 where it lies on no grid.

        Where the grid is uneven (a logarithmic code), or part of the readings lie on it (a converter with two ranges),
        it is the distance between neighbours among those values to which the signal comes back after others: values by
        noise alone do not recur.
        """
        if self.step > 0.0:
            return np.full(self.values.size, self.step)
        visited = self.values[np.flatnonzero(np.diff(self.values, prepend=np.nan) != 0.0)]
        values, visits = np.unique(visited, return_counts=True)
        levels = values[visits > 1]
        if levels.size < 3:
            return np.zeros(self.values.size)
        nearest = np.minimum(np.searchsorted(levels, self.values), levels.size - 1)
        is_on_level = levels[nearest] == self.values
        # A peak may touch a level only once. Where most readings lie on a grid, all are taken to.
        return np.where(
            is_on_level | (is_on_level.mean() > 1.0 - self.thresholds.same), np.gradient(levels)[nearest], 0.0
        )

    @cached_property
    def is_noisy(self) -> bool:
        """Whether second differences change sign more often than not, as of noise, by more than one grid step."""
        least = max(toggling(self.thresholds) * self.step, self.thresholds.material * float(np.ptp(self.values)))
        return is_turning(self.values) and self.quiet_noise > least

    @cached_property
    def outlying(self) -> Array:
        """(m,) values less their running five-point median.

        0 at both ends, and wherever values only rise or only fall without noise.
        """
        off: Array = self.values - five_point_median(self.values)
        off[:2] = off[-2:] = 0.0
        return off

    @cached_property
    def noise(self) -> Array:
        """(m,) local standard deviation of white noise; 0 for a signal that is switched between a few levels."""
        if self.is_switched:
            return np.zeros(self.values.size)
        return white_noise(self.values, self.thresholds, self.step)

    @cached_property
    def is_switched(self) -> bool:
        """Whether the signal takes only a few values and stays on each, so that its steps are no noise."""
        return is_switched(self.values, self.thresholds.few, self.thresholds.false_alarm)

    @cached_property
    def quiet_noise(self) -> float:
        """The usual noise of the recording: the median of the local standard deviations."""
        return float(np.median(self.noise))


@dataclass(frozen=True, eq=False)
class Ends:
    """Values, as recorded, to which a unit's sensor drops out, ``dropouts`` (d,), and where it ends, ``rails`` (r,).

    ``loads`` (l,): where its load cell ends, in N.
    """

    dropouts: Array
    rails: Array
    loads: Array


UNKNOWN_ENDS = Ends(np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class View:
    """A recording with both signals at the m samples ``index`` (m,) where both are present.

    ``reading`` is turned so that it rises with load (``sign`` is -1 where it was turned). ``load`` is set on the
    reading's clock by the lag ``offset_s`` + ``rate`` (t - middle). ``ends``: what all recordings show of the unit's
    sensor. ``is_swapped``: load and reading have changed places.
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
        """How many samples after a corner of the load the reading may answer it."""
        return max((self.thresholds.few + 1) // 2, round(self.thresholds.echo_s / self.step_s))

    @cached_property
    def gap(self) -> Mask:
        """(m - 1,) increments of time in which at least one sample is missing."""
        return np.diff(self.time_s) > 1.5 * self.step_s

    @cached_property
    def curve(self) -> tuple[Array, Array]:
        """The static curve: mean load (bins,) and median reading (bins,) in even bins of load, increasing."""
        load, reading = self.load.values, self.reading.values
        steady = five_point_median(load)  # without spikes
        bins = round(1.0 / self.thresholds.standing)
        edges = np.linspace(steady.min(), steady.max(), bins + 1)[1:-1]
        bin_of = np.searchsorted(edges, load)
        order = np.lexsort((reading, bin_of))
        counts = np.bincount(bin_of, minlength=bins)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        filled = counts > 0
        first, size = starts[filled], counts[filled]
        readings = reading[order][first + size // 2]
        loads = np.bincount(bin_of, weights=load, minlength=bins)[filled] / size
        return loads, readings

    @cached_property
    def noise_at_load(self) -> Array:
        """(m,) standard deviation of the usual noise at each sample's load: the upper quartile, by second differences.

        The upper quartile, so that a rest beside a ramp has the ramp's noise.
        """
        from scipy.special import ndtri

        edges = self.curve[0][:-1] + 0.5 * np.diff(self.curve[0])
        bin_of = np.searchsorted(edges, self.load.values)
        second = np.zeros(bin_of.size)
        second[1:-1] = np.abs(np.diff(self.reading.values, 2))
        usual = np.zeros(edges.size + 1)
        order = np.argsort(bin_of, kind="stable")
        bounds = np.searchsorted(bin_of[order], np.arange(edges.size + 2))
        for i in range(usual.size):
            if bounds[i + 1] > bounds[i]:
                part, rank = second[order[bounds[i] : bounds[i + 1]]], 3 * (bounds[i + 1] - bounds[i]) // 4
                usual[i] = np.partition(part, rank)[rank]
        return usual[bin_of] / (float(ndtri(0.875)) * SECOND_DIFFERENCE)

    @cached_property
    def expected(self) -> Array:
        """(m,) the static curve's reading at each sample's load."""
        loads, readings = self.curve
        return np.interp(self.load.values, loads, readings)

    @cached_property
    def rest(self) -> float:
        """The reading of the unloaded unit, by the static curve."""
        return float(self.curve[1][0])

    @cached_property
    def span(self) -> float:
        """What the reading covers, by the static curve."""
        return float(np.ptp(self.curve[1]))

    @cached_property
    def load_span(self) -> float:
        """What the load covers, by the static curve: without spikes."""
        return float(np.ptp(self.curve[0]))

    @cached_property
    def gain(self) -> float:
        """The steepest slope of the static curve, in reading per load, over a quarter (`same`) of the load's span."""
        loads, readings = self.curve
        if loads.size < 2 or self.load_span == 0.0:
            return 0.0
        length = self.thresholds.same * self.load_span
        begins = loads[loads <= loads[-1] - length]
        rise = np.interp(begins + length, loads, readings) - np.interp(begins, loads, readings)
        return float(np.max(np.abs(rise)) / length)

    @cached_property
    def load_corner(self) -> Array:
        """(m,) the largest change nearby of the load's increment: what its corners may do to the reading, in load."""
        return slope_change(self.load.values, self.load.noise, self.near, self.load.largest)

    @cached_property
    def reading_corner(self) -> Array:
        """(m,) the largest change nearby of the reading's increment."""
        return slope_change(self.reading.values, self.reading.noise, self.near, self.reading.largest)

    @cached_property
    def steady_load(self) -> Array:
        """(m,) the load's running mean over ``near`` samples."""
        from scipy.ndimage import uniform_filter1d

        return uniform_filter1d(self.load.values, self.near, mode="nearest")

    @cached_property
    def load_move(self) -> Array:
        """(m - 1,) the largest increment of the load nearby, noise left out."""
        from scipy.ndimage import maximum_filter1d

        step = np.abs(np.diff(self.steady_load))
        noise = np.sqrt(2.0) * self.load.largest * self.load.quiet_noise
        at_once = np.maximum(np.abs(np.diff(self.load.values)) - noise - self.load.step, 0.0)
        return maximum_filter1d(np.maximum(step, at_once), 2 * self.near + 1, mode="nearest")

    @cached_property
    def reading_move(self) -> Array:
        """(m - 1,) the usual increment of the reading nearby."""
        return local_scale(np.diff(self.reading.values), self.thresholds)

    @cached_property
    def jump(self) -> Array:
        """(m - 1,) increments of the reading, signed, beyond what load, slope nearby, noise and grid explain; else 0.

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
        jump = np.where(np.abs(step) > allowed, step, 0.0)
        jump[self.gap] = 0.0
        return jump

    @cached_property
    def jitter_reach(self) -> Array:
        """(m,) what an error of the sampling time may bring into each reading; 0 unless the noise grows with the slope.

        Where ramps are much noisier than rests, noise over slope is the usual error of time. A rest beside a ramp may
        then hold any reading that the ramp takes within a few such errors.
        """
        from scipy.ndimage import maximum_filter1d, minimum_filter1d

        nothing = np.zeros(self.time_s.size)
        slope = np.abs(np.gradient(self.expected_steadily, self.step_s))
        given = self.thresholds
        steepest = float(np.quantile(slope, 1.0 - given.standing))  # a quantile leaves out a single step of load
        steep, flat = given.clear * slope > steepest, slope < given.faulty_share * steepest
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
        """(m,) the static curve's reading at each sample's averaged load."""
        return np.interp(self.steady_load, *self.curve)

    def turned(self) -> View:
        """The same recording with the reading turned over."""
        return replace(self, reading=Signal(-self.reading.values, self.thresholds), sign=-self.sign)

    def upside_down(self) -> View:
        """The same with load and reading both turned over, so that the loaded end is the unloaded one."""
        load, reading = (Signal(-one.values, self.thresholds) for one in (self.load, self.reading))
        return replace(self, load=load, reading=reading, sign=-self.sign)

    def swapped(self) -> View:
        """The same with reading and load in each other's place; the ends of such a reading are not known."""
        return replace(self, load=self.reading, reading=self.load, sign=1, ends=UNKNOWN_ENDS, is_swapped=True)

    def whole(self, at: Mask) -> Mask:
        """(n,) a mask over all samples of the recording from one over those of this view, ``at`` (m,)."""
        out = np.zeros(len(self.recording), dtype=bool)
        out[self.index[at]] = True
        return out
