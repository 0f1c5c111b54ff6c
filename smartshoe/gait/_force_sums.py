"""Body weight, total force and expected error, from running sums over the windows of a trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts
from smartshoe.gait._series import FootSeries
from smartshoe.gait._sums import BlockMeans, Moments, weighted_mean
from smartshoe.gait._total import SETTLED_S, whole_strides
from smartshoe.gait._trial import Foot
from smartshoe.gait._window import AnalysisWindow

ONE_SHOE_SHARE_SD = 0.05  # of body weight: sd of the mean load on one foot about a half of it
SWAY_S = 2.0  # length of standing whose means count as independent
WIDE_SD = 0.05  # of the force: sd assumed if there is a single stride or spell


@dataclass(frozen=True, slots=True)
class BodyWeight:
    """Body weight in N with its standard deviation; ``source`` is "given", "strides", "standing" or "one_shoe"."""

    value: float
    sd: float
    source: str


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces on the whole body in N; None where unknown."""

    body_weight: BodyWeight | None
    mean_total_n: float | None
    standing_total_n: float | None
    rmse_estimate_n: float | None


class _FootSums:
    """Sums over the samples of one foot: its load, its load in swing, and the differences of its floors."""

    def __init__(self, regions: int) -> None:
        self.samples = self.swing_samples = 0
        self.load = np.zeros(regions)
        self.load_squares = np.zeros(regions)
        self.swing_squares = 0.0
        self.floor_steps = Moments()
        self.last_floor: float | None = None

    def add(self, window: AnalysisWindow, series: FootSeries) -> None:
        load = series.load[inside := window.own(series.time_s)]
        self.samples += len(load)
        self.load += load.sum(axis=0)
        self.load_squares += (load**2).sum(axis=0)
        swing = ((series.state == 0) & ~series.missing)[inside]
        self.swing_samples += int(swing.sum())
        self.swing_squares += float((load[swing].sum(axis=1) ** 2).sum())

    def add_floors(self, contacts: Contacts) -> None:
        floor = contacts.floor.sum(axis=1)
        if floor.size:
            before = [] if self.last_floor is None else [self.last_floor]
            self.floor_steps.add(np.diff(np.concatenate([before, floor])))
            self.last_floor = float(floor[-1])

    @property
    def floor_variance(self) -> float:
        """Variance in N^2 of the mean floor, from the differences of successive floors."""
        steps = self.floor_steps
        return steps.squares / steps.count / 2.0 / (steps.count + 1) if steps.count >= 3 else 0.0


class _StrideForces:
    """Sums of the mean total force over strides, and of their durations."""

    def __init__(self) -> None:
        self.means = Moments()
        self.impulse_n_s = self.lasting_s = 0.0

    @property
    def mean_n(self) -> float | None:
        return self.impulse_n_s / self.lasting_s if self.means.count else None


class ForceSums:
    """Sums over a trial of ``feet``, whose units bear the share ``coverage`` of the load."""

    def __init__(self, feet: Mapping[str, Foot], coverage: float) -> None:
        self._units, self._coverage = {name: foot.units for name, foot in feet.items()}, coverage
        self._is_known = all(foot.is_force for foot in feet.values())
        self._feet = {name: _FootSums(len(foot.units)) for name, foot in feet.items()}
        self._first = next(iter(feet))
        self._strides = {True: _StrideForces(), False: _StrideForces()}  # strides of the first foot, and of the other
        self._standing = BlockMeans(max(1, round(SWAY_S * feet[self._first].rate_hz)))
        self._standing_s = 0.0

    def add_floors(self, foot: str, contacts: Contacts) -> None:
        """Add the floors that were read beside a foot's next contacts."""
        self._feet[foot].add_floors(contacts)

    def add(self, window: AnalysisWindow) -> None:
        """Add the loads, strides and standing of one more window."""
        for name, series in window.series.items():
            self._feet[name].add(window, series)
        total = window.total
        if len(window.feet) < len(self._feet) or total is None or total.time_s.size < 2:
            return
        time_s, total_n = total.time_s, total.force_n
        step = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
        gathered = np.concatenate([[0.0], np.cumsum(0.5 * (total_n[1:] + total_n[:-1])) * step])
        whole = whole_strides(total, window.strides)
        for is_first, sums in self._strides.items():
            own = [stride for stride in whole if (stride.foot == self._first) == is_first]
            start, end = np.array([s.start_s for s in own]), np.array([s.end_s for s in own])
            means = (np.interp(end, time_s, gathered) - np.interp(start, time_s, gathered)) / (end - start)
            sums.means.add(means)
            sums.impulse_n_s += float((means * (end - start)).sum())
            sums.lasting_s += float((end - start).sum())
        stands = np.zeros(time_s.size, dtype=bool)
        for start_s, end_s in window.spans:
            stands |= (time_s >= start_s + SETTLED_S) & (time_s <= end_s - SETTLED_S)
        standing_n = total_n[stands & ~total.missing & window.own(time_s)]
        self._standing.add(standing_n)
        self._standing_s += standing_n.size * float(time_s[1] - time_s[0])

    def forces(self, given_n: float | None) -> Forces:
        """The forces of the trial so far; ``given_n`` is the body weight if it was given."""
        if not self._is_known:
            return Forces(None, None, None, None)
        moving = self._strides[self._strides[True].means.count > 0]
        still = self._standing
        still_n = still.total / still.count if still.count else None
        weight = self._weight(given_n, moving, still_n)
        if len(self._feet) == 1:
            return Forces(weight, None, None, self._rmse())
        known = [(n, s) for n, s in ((moving.mean_n, moving.lasting_s), (still_n, self._standing_s)) if n is not None]
        return Forces(weight, weighted_mean(known), still_n, self._rmse())

    def _weight(self, given_n: float | None, moving: _StrideForces, still_n: float | None) -> BodyWeight | None:
        """Body weight: as given, or the mean total force over whole strides or over standing, whichever lasts longer.

        Over whole strides the body neither gains nor loses vertical momentum, so the mean total force is its weight.
        The sd combines the spread over strides with the sd of gains and floors. With one shoe the weight is twice its
        mean, and the sd includes the uncertain share of that foot.
        """
        if given_n is not None:
            return BodyWeight(given_n, 0.0, "given")
        if still_n is not None and self._standing_s >= moving.lasting_s:
            value, means, source = still_n, self._standing.means, "standing"
        elif moving.mean_n is not None:
            value, means, source = moving.mean_n, moving.means, "strides"
        else:
            return None
        spread = means.sd / np.sqrt(means.count) if means.count > 1 else WIDE_SD * value
        variance = float(spread) ** 2
        for name, own in self._feet.items():
            mean_n = own.load / max(own.samples, 1) / self._coverage
            variance += float(np.sum((self._gain_sd(name) * mean_n) ** 2)) + own.floor_variance / self._coverage**2
        if len(self._feet) == 1:
            value, variance = 2.0 * value, 4.0 * (variance + (ONE_SHOE_SHARE_SD * value) ** 2)
            source = "one_shoe"
        return BodyWeight(float(value), float(np.sqrt(variance)), source)

    def _gain_sd(self, foot: str) -> Array:
        return np.array([unit.gain_sd for unit in self._units[foot]])

    def _rmse(self) -> float | None:
        """The expected error in N of the whole force; None if no swing was seen.

        It combines the readings in swing, where the true force is zero, with the gains' sd times the load. The residual
        deformation of a unit while it is loaded is in neither.
        """
        variance = 0.0
        for name, own in self._feet.items():
            if own.last_floor is None or not own.swing_samples:
                return None
            gain = self._gain_sd(name)
            variance += own.swing_squares / own.swing_samples + float(
                np.sum(gain**2 * (own.load_squares / own.samples))
            )
        return float(np.sqrt(variance)) / self._coverage
