"""The times of text lines: their unit inferred from their steps, counters unwrapped, inconsistent lines held back."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from itertools import pairwise
from statistics import median
from typing import Literal

from smartshoe.devices.wire.counters import Counters

TimeUnit = Literal["s", "ms", "us"]
SECONDS: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
COUNTER_TURN = 2.0**32  # of millis() and micros()
LOOKED_AT = 5  # steps from which the unit is inferred
GAP_PERIODS = 256.0  # after a longer step, a line waits for confirmation by the next one
MOST_UNEVEN = 2.0
REMEMBERED = 64


@dataclass(frozen=True, slots=True)
class ReadingLine:
    """A line's ``time`` (as written, or in s once placed) and readings (channels,), NaN where there is none.

    ``end`` is the number of bytes of the stream up to the end of this line; it does not count for equality, since a
    line may be sent twice.
    """

    time: float
    readings: tuple[float, ...]
    boot: int = 0
    end: int = field(default=0, compare=False)


class LineClock:
    """Puts lines in order of time and drops repetitions. A line that jumps in time must be confirmed by the next one.

    A ``unit`` of None is inferred from the first `LOOKED_AT` steps; lines wait until then. 32-bit integer counters are
    unwrapped; a device that restarts begins a new ``boot``.
    """

    def __init__(self, counters: Counters, unit: TimeUnit | None) -> None:
        self._counters = counters
        self._unit: TimeUnit | None = unit
        self._waiting: list[ReadingLine] = []
        self._last: ReadingLine | None = None
        self._held: ReadingLine | None = None
        self._first: list[ReadingLine] = []
        self._turns = 0.0
        self._boot = 0
        self._period = 0.0
        self._recent: deque[ReadingLine] = deque(maxlen=REMEMBERED)

    def use(self, unit: TimeUnit) -> None:
        """Interpret times in ``unit`` from the next line on."""
        self._unit = unit

    def place(self, line: ReadingLine) -> list[ReadingLine]:
        """The lines that ``line`` confirms, in order, with their times in s."""
        self._waiting.append(line)
        if self._unit is None:
            if len(self._waiting) <= LOOKED_AT:
                return []
            self._unit = told_unit([waiting.time for waiting in self._waiting])
        lines, self._waiting = self._waiting, []
        placed = [sure for waiting in lines for sure in self._place(waiting)]
        self._counters.frames += len(placed)
        return placed

    def _step(self, before: ReadingLine, line: ReadingLine) -> float:
        """Time from ``before`` to ``line`` in the unit as written, allowing for one counter overflow."""
        step = line.time - before.time
        is_counter = self._unit != "s" and line.time == int(line.time) and before.time == int(before.time)
        return step + COUNTER_TURN if is_counter and step < -COUNTER_TURN / 2 else step

    def _goes_on(self, before: ReadingLine, line: ReadingLine) -> bool:
        """Whether ``line`` is one of the next few lines after ``before``."""
        return 0.0 < self._step(before, line) <= GAP_PERIODS * self._period

    def _place(self, line: ReadingLine) -> list[ReadingLine]:
        if self._last is None:
            return self._start(line)
        last, held = self._last, self._held
        if self._goes_on(last, line):
            self._counters.implausible += held is not None
            self._held = None
            return [self._give(line)]
        if line == held or line in self._recent:
            self._counters.duplicated += 1
            return []
        if -REMEMBERED * self._period <= self._step(last, line) <= 0.0:
            self._counters.late += 1
            return []
        if held is None or not self._goes_on(held, line):
            self._counters.implausible += held is not None
            self._held = line
            return []
        self._held = None
        if self._step(last, held) <= 0.0:
            self._boot += 1
            self._counters.restarts += 1
            self._last, self._turns = None, 0.0
        first = self._give(held)
        self._period = self._step(held, line)
        return [first, self._give(line)]

    def _start(self, line: ReadingLine) -> list[ReadingLine]:
        """The first three lines in even steps; the stream may begin within a line, whose time then lacks digits."""
        self._first.append(line)
        if len(self._first) < 3:
            return []
        one, two, three = self._first
        if not 0.0 < self._step(one, two) <= MOST_UNEVEN * self._step(two, three):
            self._counters.implausible += 1
            del self._first[0]
            return []
        self._first, self._period = [], self._step(two, three)
        return [self._give(one), self._give(two), self._give(three)]

    def _give(self, line: ReadingLine) -> ReadingLine:
        if self._last is not None:
            step = self._step(self._last, line)
            if line.time < self._last.time:
                self._turns += COUNTER_TURN
            # Adapt slowly, by a quarter at most: lost lines make long steps, which must remain exceptions.
            self._period += max(min(step - self._period, self._period), -self._period) / 4.0
        self._last = line
        self._recent.append(line)
        seconds = SECONDS[self._unit or "s"]
        return replace(line, time=(line.time + self._turns) * seconds, boot=self._boot)


def told_unit(times: list[float]) -> TimeUnit:
    """The unit of ``times`` as written, inferred from their steps; shoes send 1 to 1000 samples per second.

    Fractions are seconds. Whole numbers are microseconds in steps from 1000 on, else milliseconds.
    """
    if any(time != int(time) for time in times):
        steps = [abs(b - a) for a, b in pairwise(times)]
        return "s" if median(steps) < 1.0 else "ms"
    steps = [b - a for a, b in pairwise(times) if b > a]
    return "us" if steps and median(steps) >= 1000.0 else "ms"
