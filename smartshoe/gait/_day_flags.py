"""Flags of a long trial: those of its windows, each once, and where the recording stops."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from smartshoe.gait._flag import Flag, where_text
from smartshoe.gait._trial_sums import TrialSums
from smartshoe.gait._window import AnalysisWindow

# Flags that every window raises alike; they hold for the whole trial unchanged.
STEADY = frozenset({"one_shoe", "missing_unit", "uncalibrated", "low_rate", "negative_load", "no_stance", "no_swing",
                    "too_short"})  # fmt: skip
# Flags that two minutes may show by chance: reported if most windows with strides show them.
MOSTLY_SHOWN = frozenset({"left_right_swapped", "metatarsals_swapped", "sequence_broken", "clocks_apart",
                          "clock_rates_differ"})  # fmt: skip
LEAST_STOP_S = 1.0  # shorter stops are ignored: two shoes' files end some samples apart
LISTED_STOPS = 3

Key = tuple[str, str | None, str | None]


class DayFlags:
    """Collects the flags of a trial's windows and the runs of its recording."""

    def __init__(self) -> None:
        self._first: dict[Key, tuple[Flag, AnalysisWindow]] = {}
        self._ends_s: dict[Key, float] = {}
        self._counts: Counter[Key] = Counter()
        self._windows = self._stepping = 0
        self._stops: list[tuple[float, float]] = []
        self._stop_count = 0
        self.stopped_s = self.recorded_s = 0.0
        self._begin_s: float | None = None
        self._end_s = 0.0

    @property
    def duration_s(self) -> float:
        """Time in s from the first sample to the last."""
        return 0.0 if self._begin_s is None else self._end_s - self._begin_s

    def add_run(self, start_s: float, end_s: float) -> None:
        """Add a run of recording by the times of its first and last sample."""
        if self._begin_s is None:
            self._begin_s = start_s
        elif start_s - self._end_s > LEAST_STOP_S:
            self.stopped_s += start_s - self._end_s
            self._stop_count += 1
            if len(self._stops) < LISTED_STOPS:
                self._stops.append((float(self._end_s), start_s))
        self._end_s = end_s
        self.recorded_s += end_s - start_s

    def add(self, window: AnalysisWindow) -> None:
        """Add the flags of one more window."""
        self._windows += 1
        self._stepping += bool(window.strides)
        shown: dict[Key, Flag] = {}
        for flag in window.flags:
            shown.setdefault((flag.kind, flag.foot, flag.unit), flag)
        for key, flag in shown.items():
            self._first.setdefault(key, (flag, window))
            self._counts[key] += 1
            self._ends_s[key] = min(window.end_s, float(next(iter(window.feet.values())).time_s[-1]))

    def flags(self, sums: TrialSums) -> list[Flag]:
        """The flags of the whole trial, in the order in which they were first seen."""
        found = [flag for key in self._first if (flag := self._of_day(key, sums)) is not None]
        if self._stop_count:
            often = "once" if self._stop_count == 1 else f"{self._stop_count} times"
            found.append(
                Flag(
                    "recording_stops",
                    f"the recording stops {often}, for {self.stopped_s:.0f} s in all: nothing is known of that time",
                    where=where_text(self._stops),
                )
            )
        return found

    def _of_day(self, key: Key, sums: TrialSums) -> Flag | None:
        """A window's flag restated for the whole trial; None if it does not hold for the trial."""
        flag, window = self._first[key]
        count = self._counts[key]
        if flag.kind in STEADY:
            foot = flag.foot or ""
            wrong = (
                (flag.kind == "one_shoe" and len(sums.contacts) > 1)
                or (flag.kind == "no_stance" and (sums.contacts.get(foot, 1) > 0 or not sums.moved))
                or (flag.kind == "no_swing" and sums.floors.get(foot, 1) > 0)
                or (flag.kind == "too_short" and sums.moved)
            )
            return None if wrong else flag
        if flag.kind in MOSTLY_SHOWN and count <= 0.5 * self._stepping:
            return None
        if self._windows < 2:
            return flag
        where = flag.where if flag.where != "all" else where_text([(window.start_s, window.end_s)])
        more = f" and in {count - 1} more windows, to {self._ends_s[key]:.1f} s" if count > 1 else ""
        says = f"in {count} of {self._windows} windows of the record, in the first of them: {flag.says}"
        return replace(flag, says=says, where=where + more)
