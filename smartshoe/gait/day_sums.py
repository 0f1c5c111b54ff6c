"""What the stretches of a long trial add up to: summary, indices, forces and flags of the whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait import checks
from smartshoe.gait.contact import Contacts
from smartshoe.gait.coverage import Coverage
from smartshoe.gait.flag import Flag, where_text
from smartshoe.gait.indices import POINTS, deviations, overlaid, sequence_errors
from smartshoe.gait.result import FootCourse, Forces
from smartshoe.gait.stretch import AnalysisWindow
from smartshoe.gait.strides import Stride
from smartshoe.gait.summary import Activity, activity_by_time
from smartshoe.gait.sums import BlockMeans, Moments, StrideSums, weighted_mean
from smartshoe.gait.total import ONE_SHOE_SHARE_SD, SETTLED_S, SWAY_S, WIDE_SD, BodyWeight, total_of, whole_strides
from smartshoe.gait.trial import Foot

Array = NDArray[np.float64]

# Told of each stretch alike, so of the whole as it stands.
STEADY = frozenset({"one_shoe", "missing_unit", "uncalibrated", "low_rate", "negative_load", "no_stance", "no_swing",
                    "too_short"})  # fmt: skip
# What two minutes may show by chance: told where most stretches with strides show it.
MOSTLY_SHOWN = frozenset({"left_right_swapped", "metatarsals_swapped", "sequence_broken", "clocks_apart",
                          "clock_rates_differ"})  # fmt: skip
LEAST_STOP_S = 1.0  # two shoes' files end some samples apart


class _FootSums:
    def __init__(self, regions: int) -> None:
        self.samples = self.swing_samples = self.contacts = 0
        self.load = np.zeros(regions)
        self.load_squares = np.zeros(regions)
        self.swing_squares = 0.0
        self.has_floor = False
        self.floor_steps = Moments()
        self.last_floor: float | None = None


class _KindSums:
    """One foot's strides of one kind: how regular they are."""

    def __init__(self, regions: int) -> None:
        self.wrong = self.count = self.inside = 0
        self.pattern = np.zeros((POINTS, regions))
        self.deviation = Moments()
        self.abnormality = 0.0


class DaySums:
    """The sums of a trial of ``feet``, stretch by stretch."""

    def __init__(self, feet: Mapping[str, Foot], coverage: Coverage) -> None:
        self._feet, self._coverage = feet, coverage
        self._foot = {name: _FootSums(len(foot.units)) for name, foot in feet.items()}
        self._kinds = {runs: StrideSums(tuple(feet)) for runs in (False, True)}
        self._regular = {
            (runs, name): _KindSums(len(foot.units)) for runs in (False, True) for name, foot in feet.items()
        }
        self._time_s = {False: 0.0, True: 0.0}  # of strides of either kind, gaps or none
        self._strides = {False: 0, True: 0}
        self._stepping: set[str] = set()
        first = next(iter(feet))
        self._first = first
        self._totals = {own: (Moments(), Moments()) for own in (True, False)}  # of strides: newtons seconds, seconds
        self._means = {own: Moments() for own in (True, False)}
        self._standing = BlockMeans(max(1, round(SWAY_S * feet[first].rate_hz)))
        self._standing_s = 0.0
        self._flags: dict[tuple[str, str | None, str | None], tuple[Flag, int, AnalysisWindow]] = {}
        self._ends_s: dict[tuple[str, str | None, str | None], float] = {}
        self._stretches: Counter[str] = Counter()
        self._runs: list[tuple[float, float]] = []
        self._stops: list[tuple[float, float]] = []
        self.stopped_s = 0.0
        self._stop_count = 0
        self.was_loaded = False
        self.last_courses: Mapping[str, FootCourse] = {}
        self._begin_s = self._end_s = np.nan
        self.recorded_s = 0.0

    @property
    def duration_s(self) -> float:
        """From the first sample to the last."""
        return float(self._end_s - self._begin_s)

    def floors(self, foot: str, told: Contacts) -> None:
        """More contacts with the floors beside them."""
        own = self._foot[foot]
        own.contacts += len(told)
        floor = told.floor.sum(axis=1)
        if floor.size:
            own.has_floor = True
            before = [] if own.last_floor is None else [own.last_floor]
            own.floor_steps.add(np.diff(np.concatenate([before, floor])))
            own.last_floor = float(floor[-1])

    def run(self, start_s: float, end_s: float) -> None:
        """A run of recording, from its first sample to its last."""
        if np.isnan(self._begin_s):
            self._begin_s = start_s
        elif start_s - self._end_s > LEAST_STOP_S:
            self.stopped_s += start_s - self._end_s
            self._stop_count += 1
            if len(self._stops) < 3:
                self._stops.append((float(self._end_s), start_s))
        self._end_s = end_s
        self.recorded_s += end_s - start_s

    def add(self, stretch: AnalysisWindow) -> None:
        """One more stretch."""
        courses = stretch.courses
        seen = {**self.last_courses, **courses}
        self.last_courses = {name: seen[name] for name in self._feet if name in seen}
        self.was_loaded |= any(stretch.loaded.values())
        contacts = {name: course.contacts for name, course in courses.items()}
        for stride in stretch.strides:
            self._time_s[stride.runs] += stride.time_s
            self._strides[stride.runs] += 1
            self._stepping.add(stride.foot)
        for runs in (False, True):
            own = [stride for stride in stretch.strides if stride.runs == runs and not stride.gap]
            self._kinds[runs].add(contacts, own)
            for name, course in courses.items():
                self._regularity(self._regular[runs, name], course, [s for s in own if s.foot == name])
        for name, course in courses.items():
            self._load(self._foot[name], stretch, course)
        for start_s, end_s in stretch.spans:
            self._standing_s += max(0.0, min(end_s, stretch.end_s) - max(start_s, stretch.start_s))
        if len(courses) == len(self._feet) and all(course.is_force for course in courses.values()):
            self._total(stretch)
        self._flagged(stretch)

    def _load(self, own: _FootSums, stretch: AnalysisWindow, course: FootCourse) -> None:
        load = course.load[inside := stretch.own(course.time_s)]
        own.samples += len(load)
        own.load += load.sum(axis=0)
        own.load_squares += (load**2).sum(axis=0)
        swing = ((course.state == 0) & ~course.missing)[inside]
        own.swing_samples += int(swing.sum())
        own.swing_squares += float((load[swing].sum(axis=1) ** 2).sum())

    def _regularity(self, own: _KindSums, course: FootCourse, strides: list[Stride]) -> None:
        if not strides:
            return
        wrong, count = sequence_errors(course.contacts, strides)
        own.wrong, own.count = own.wrong + wrong, own.count + count
        own.pattern += overlaid(strides, course.time_s, course.load).sum(axis=0)
        largest = float(own.pattern.sum(axis=1).max())
        if largest > 0.0:
            own.deviation.add(deviations(strides, course.time_s, course.load, own.pattern / largest))
        for stride in strides:
            first, last = np.searchsorted(course.time_s, [stride.start_s, stride.end_s])
            own.abnormality += float(course.abnormality[first:last].sum())
            own.inside += int(last - first)

    def _total(self, stretch: AnalysisWindow) -> None:
        forces = {n: course.force_n for n, course in stretch.courses.items() if course.force_n is not None}
        time_s, total_n = total_of(stretch.feet, forces)
        if time_s.size < 2:
            return
        missing = np.zeros(time_s.size, dtype=bool)
        for foot in stretch.feet.values():
            if foot.missing.any():
                missing |= np.interp(time_s, foot.time_s, foot.missing.astype(float)) > 0.0
        step = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
        gathered = np.concatenate([[0.0], np.cumsum(0.5 * (total_n[1:] + total_n[:-1])) * step])
        whole = whole_strides(time_s, missing, stretch.strides)
        for is_first in (True, False):
            own = [s for s in whole if (s.foot == self._first) == is_first]
            start, end = np.array([s.start_s for s in own]), np.array([s.end_s for s in own])
            impulse = np.interp(end, time_s, gathered) - np.interp(start, time_s, gathered)
            sums, lasting = self._totals[is_first]
            sums.add(impulse)
            lasting.add(end - start)
            self._means[is_first].add(impulse / (end - start))
        kept = np.zeros(time_s.size, dtype=bool)
        for start_s, end_s in stretch.spans:
            kept |= (time_s >= start_s + SETTLED_S) & (time_s <= end_s - SETTLED_S)
        self._standing.add(total_n[kept & ~missing & stretch.own(time_s)])

    def _flagged(self, stretch: AnalysisWindow) -> None:
        self._stretches["all"] += 1
        self._stretches["stepping"] += bool(stretch.strides)
        seen = set()
        for flag in stretch.flags:
            key = (flag.kind, flag.foot, flag.unit)
            if key in seen or flag.kind == "mixed_strides":
                continue
            seen.add(key)
            first, count, where = self._flags.get(key, (flag, 0, stretch))
            self._flags[key] = (first, count + 1, where if count else stretch)
            self._ends_s[key] = min(stretch.end_s, float(next(iter(stretch.feet.values())).time_s[-1]))

    # -- what it comes to --------------------------------------------------------------------------------------
    @property
    def _main(self) -> bool:
        return self._kinds[True].count > self._kinds[False].count

    def activity(self) -> Activity:
        """What most of the trial is, by time, as `smartshoe.gait.summary.activity_of` has it."""
        feet = max(len(self._stepping), 1)
        return activity_by_time(
            {"walking": self._time_s[False] / feet, "running": self._time_s[True] / feet, "standing": self._standing_s}
        )

    def summary(self) -> dict[str, Any]:
        """Of the strides without gaps of the main activity."""
        return self._kinds[self._main].summary()

    def indices(self) -> dict[str, dict[str, float | None]]:
        """Each foot's indices in percent; the pattern is the mean stride up to the stretch that is compared."""
        found: dict[str, dict[str, float | None]] = {}
        for name in self._feet:
            own = self._regular[self._main, name]
            found[name] = {
                "sequence_error_percent": 100.0 * own.wrong / own.count if own.count else None,
                "deviation_percent": own.deviation.mean if own.deviation.count else None,
                "abnormality_percent": 100.0 * own.abnormality / own.inside if own.inside else None,
            }
        return found

    def forces(self, given_n: float | None) -> Forces:
        """Body weight and totals, as `smartshoe.gait.total` has them."""
        if not all(foot.is_force for foot in self._feet.values()):
            return Forces(None, None, None, None)
        own = self._means[True].count > 0
        sums, lasting = self._totals[own]
        moving_s = lasting.mean * lasting.count
        moving_n = sums.mean / lasting.mean if lasting.count else None
        still, step_s = self._standing, 1.0 / self._feet[self._first].rate_hz
        still_n, still_s = (still.total / still.count, still.count * step_s) if still.count else (None, 0.0)
        weight = self._weight(given_n, moving_n, moving_s, self._means[own], still_n, still_s)
        if len(self._feet) == 1:
            return Forces(weight, None, None, self._rmse())
        parts = [(n, s) for n, s in ((moving_n, moving_s), (still_n, still_s)) if n is not None]
        return Forces(weight, weighted_mean(parts), still_n, self._rmse())

    def _weight(
        self,
        given_n: float | None,
        moving_n: float | None,
        moving_s: float,
        strides: Moments,
        still_n: float | None,
        still_s: float,
    ) -> BodyWeight | None:
        if given_n is not None:
            return BodyWeight(given_n, 0.0, "given")
        if still_n is not None and still_s >= moving_s:
            means = self._standing.means
            spread = means.sd / np.sqrt(means.count) if means.count > 1 else WIDE_SD * still_n
            value, source = still_n, "standing"
        elif moving_n is not None:
            spread = strides.sd / np.sqrt(strides.count) if strides.count > 1 else WIDE_SD * moving_n
            value, source = moving_n, "strides"
        else:
            return None
        variance, share = float(spread) ** 2, self._coverage.share
        for name, foot in self._feet.items():
            own = self._foot[name]
            gain = np.array([unit.gain_sd for unit in foot.units])
            variance += float(np.sum((gain * own.load / max(own.samples, 1) / share) ** 2))
            steps = own.floor_steps
            if steps.count >= 3:
                variance += steps.squares / steps.count / 2.0 / (steps.count + 1) / share**2
        if len(self._feet) == 1:
            value, variance = 2.0 * value, 4.0 * (variance + (ONE_SHOE_SHARE_SD * value) ** 2)
            source = "one_shoe"
        return BodyWeight(float(value), float(np.sqrt(variance)), source)

    def _rmse(self) -> float | None:
        variance = 0.0
        for name, foot in self._feet.items():
            own = self._foot[name]
            if not own.has_floor or not own.swing_samples:
                return None
            gain = np.array([unit.gain_sd for unit in foot.units])
            variance += own.swing_squares / own.swing_samples + float(np.sum(gain**2 * own.load_squares / own.samples))
        return float(np.sqrt(variance)) / self._coverage.share

    def flags(self, forces: Forces, given_n: float | None) -> list[Flag]:
        """What should not be trusted, and why: flags of stretches, each once, and those of the whole."""
        found = [flag for key in self._flags if (flag := self._said(key)) is not None]
        if self._stop_count:
            often = "once" if self._stop_count == 1 else f"{self._stop_count} times"
            found.append(
                Flag(
                    "recording_stops",
                    f"the recording stops {often}, for {self.stopped_s:.0f} s in all: nothing is told of that time",
                    where=where_text(self._stops),
                )
            )
        found += checks._weight(forces, self._coverage.share, given_n)
        walks, runs = self._strides[False], self._strides[True]
        if walks and runs:
            main = "running" if runs > walks else "walking"
            found.append(
                Flag(
                    "mixed_strides",
                    f"{walks} strides are walking and {runs} running: the summary is of the {main} ones",
                )
            )
        return found

    def _said(self, key: tuple[str, str | None, str | None]) -> Flag | None:
        flag, count, stretch = self._flags[key]
        of = self._stretches["all"]
        if flag.kind in STEADY:
            foot = self._foot.get(flag.foot or "")
            moving = any(self._strides.values()) or self._standing_s > 0.0
            wrong = (
                (flag.kind == "one_shoe" and len(self._feet) > 1)
                or (flag.kind == "no_stance" and (foot is None or foot.contacts or not moving))
                or (flag.kind == "no_swing" and (foot is None or foot.has_floor))
                or (flag.kind == "too_short" and moving)
            )
            return None if wrong else flag
        if flag.kind in MOSTLY_SHOWN and count <= 0.5 * self._stretches["stepping"]:
            return None
        if of < 2:
            return flag
        where = flag.where if flag.where != "all" else where_text([(stretch.start_s, stretch.end_s)])
        more = f" and in {count - 1} more stretches, to {self._ends_s[key]:.1f} s" if count > 1 else ""
        says = f"in {count} of {of} stretches of the record, in the first of them: {flag.says}"
        return replace(flag, says=says, where=where + more)
