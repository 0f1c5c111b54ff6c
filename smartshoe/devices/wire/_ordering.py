"""Orders frames: unwraps the 16-bit count and 32-bit clock, drops duplicates, holds back inconsistent frames.

A frame is *near* the last one where at most `NEAR` samples are missing between them and its time agrees with its count;
near frames pass at once. Any other frame waits for the next one. It is given out if that one continues it (after a
longer gap, at another rate, or from a restarted device), and dropped if the next one continues the frames before it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Integers
from smartshoe.devices.wire.counters import Counters

NEAR = 200
REMEMBERED = 64  # last frames, among which a late one is recognised
WINDOW = 1024  # frames over which the period is averaged
COUNT, CLOCK = 0xFFFF, 0xFFFFFFFF
HALF_TURN = 1 << 15
LONGEST_GAP_US = 1 << 31  # half a turn of the clock: 35.8 min
JITTER = 0.5  # of a period: largest error of a frame's time
CRYSTAL = 0.002  # largest relative error of the averaged period: less than one sample over NEAR of them
SHORTEST_US, LONGEST_US = 20.0, 5e6  # bounds of a period before one is known
MOST_DOUBTS = 8

_Frame = tuple[int, int]  # count and clock (us) as sent


@dataclass(frozen=True, eq=False)
class Placed:
    """The rows to give out, in order: row 0 is the frame held back before, row k the k-th frame of this call.

    ``sequence``, ``time_us`` and ``boot`` (n,) belong to these rows; ``held`` is the row held back now, or None.
    """

    rows: Integers
    sequence: Integers
    time_us: Integers
    boot: Integers
    held: int | None


class Ordering:
    """The state of one stream; frames that are not given out are counted in ``counters``."""

    def __init__(self, counters: Counters) -> None:
        self._counters = counters
        self._last: _Frame | None = None
        self._sequence = 0
        self._time_us = 0
        self._boot = 0
        self._held: _Frame | None = None
        self._period_us: float | None = None
        self._anchor = (0, 0)
        self._since_anchor = 0
        self._renew_after = 1
        self._doubts = 0
        self._recent = np.full(REMEMBERED, -1, dtype=np.int64)

    def place(self, counts: Integers, clocks: Integers) -> Placed:
        """Order frames with ``counts`` and ``clocks`` (n,), as sent and in order of arrival."""
        return _Placing(self, counts, clocks).run()

    # The methods below decide about single frames; `_Placing` applies them to a whole block.

    def _near(self, before: _Frame, frame: _Frame) -> bool:
        if self._period_us is None:
            return False
        ahead, later = (frame[0] - before[0]) & COUNT, (frame[1] - before[1]) & CLOCK
        return 1 <= ahead <= NEAR and abs(later - ahead * self._period_us) <= self._tolerance_us(ahead)

    def _tolerance_us(self, steps: int) -> float:
        return (JITTER + CRYSTAL * steps) * (self._period_us or 0.0)

    def _is_late(self, frame: _Frame, came: _Frame | None) -> bool:
        """Whether ``frame`` was sent shortly before the frame ``came``, by both count and clock."""
        if came is None or self._period_us is None:
            return False
        behind, earlier = (came[0] - frame[0]) & COUNT, (came[1] - frame[1]) & CLOCK
        return 1 <= behind <= REMEMBERED and abs(earlier - behind * self._period_us) <= self._tolerance_us(behind)

    def _steps(self, before: _Frame, frame: _Frame) -> int | None:
        """Number of samples from ``before`` to ``frame`` where clock and count agree, even over losses; else None."""
        ahead, later = (frame[0] - before[0]) & COUNT, (frame[1] - before[1]) & CLOCK
        if self._period_us is None or later >= LONGEST_GAP_US:
            return None
        turns = max(round((later / self._period_us - ahead) / (COUNT + 1)), 0)
        steps = ahead + turns * (COUNT + 1)
        if steps < 1 or abs(later - steps * self._period_us) > self._tolerance_us(steps):
            return None
        return steps

    def _agreement(self, held: _Frame, frame: _Frame) -> str:
        """How ``frame`` continues ``held``: "next", "strays" (soon, at another rate), "far" (after a long gap).

        Else "".
        """
        if self._near(held, frame):
            return "next"
        ahead, later = (frame[0] - held[0]) & COUNT, (frame[1] - held[1]) & CLOCK
        goes_on = ahead >= 1 and 0 < later < LONGEST_GAP_US
        if self._period_us is None:
            return "strays" if goes_on and SHORTEST_US <= later / ahead <= LONGEST_US else ""
        if goes_on and ahead <= NEAR:
            return "strays"
        return "far" if self._steps(held, frame) else ""

    def _gap_to(self, frame: _Frame) -> int | None:
        """Number of samples from the last frame to ``frame`` where the device kept running, None where it restarted."""
        if self._last is None or self._period_us is None:
            return None
        steps = self._steps(self._last, frame)
        if steps is not None and steps <= HALF_TURN:
            return steps
        # Both begin at 0 when the device boots, so that its count cannot be ahead of its clock.
        looks_young = (
            frame[0] < self._last[0]
            and frame[1] < self._last[1]
            and frame[0] * self._period_us <= 1.1 * frame[1] + self._period_us
        )
        if looks_young:
            return None
        ahead, later = (frame[0] - self._last[0]) & COUNT, (frame[1] - self._last[1]) & CLOCK
        if not 0 < later < LONGEST_GAP_US or ahead < 1:
            return None
        if ahead <= NEAR:
            return ahead  # the device paused, or runs at another rate
        if steps is None and ahead <= HALF_TURN and later >= ahead * SHORTEST_US:
            return ahead
        return steps

    def _doubt_period(self, before: _Frame, frame: _Frame) -> bool:
        """Note that two frames at another rate were given out; returns whether this changed the period.

        A single one may be stamped late, which the period ignores; several in a row mean another rate.
        """
        self._doubts += 2
        if self._period_us is not None and self._doubts < MOST_DOUBTS:
            return False
        self._period_us = ((frame[1] - before[1]) & CLOCK) / ((frame[0] - before[0]) & COUNT)
        self._doubts = 0
        self._measure_from_here(2)
        return True

    def _measure_from_here(self, renew_after: int) -> None:
        self._anchor = (self._sequence, self._time_us)
        self._since_anchor, self._renew_after = 0, renew_after

    def _count(self, frames: int) -> bool:
        """Count ``frames`` more as given out; returns whether this changed the period."""
        self._since_anchor += frames
        if self._since_anchor < self._renew_after:
            return False
        steps, time_us = self._sequence - self._anchor[0], self._time_us - self._anchor[1]
        self._period_us = time_us / steps
        if self._renew_after < WINDOW:
            self._renew_after *= 2
        else:
            self._measure_from_here(WINDOW)
        return True


class _Placing:
    """One block of frames being put through an `Ordering`.

    Row 0 is the frame held back, row 1 the last one given out; the block begins at row 2.
    """

    def __init__(self, state: Ordering, counts: Integers, clocks: Integers) -> None:
        self._state = state
        first = [state._held or (0, 0), state._last or (0, 0)]
        self._counts = np.concatenate([[frame[0] for frame in first], counts])
        self._clocks = np.concatenate([[frame[1] for frame in first], clocks])
        self._keys = (self._counts << 32) | self._clocks
        self._held_row = 0 if state._held is not None else None
        self._last_row = 1 if state._last is not None else -1
        room = self._counts.size
        self._out = np.empty((4, room), dtype=np.int64)  # row, sequence, time, boot
        self._given = np.concatenate([state._recent, np.empty(room, dtype=np.int64)])
        self._size = 0

    def run(self) -> Placed:
        """Place every row."""
        state, row, end = self._state, 2, self._counts.size
        while row < end:
            row = self._run_slice(row, min(end, row + WINDOW))
        state._recent = self._given[self._size : self._size + REMEMBERED].copy()
        rows, sequence, time_us, boot = self._out[:, : self._size]
        held = None if self._held_row is None else max(self._held_row - 1, 0)
        return Placed(np.maximum(rows - 1, 0), sequence, time_us, boot, held)

    def _run_slice(self, start: int, stop: int) -> int:
        """Place rows up to ``stop``, or until the period changes; returns the next row to place."""
        state = self._state
        period = state._period_us
        if period is None:
            self._step(start)
            return start + 1
        ahead = np.diff(self._counts[start - 1 : stop]) & COUNT
        later = np.diff(self._clocks[start - 1 : stop]) & CLOCK
        far_off = np.abs(later - ahead * period) > (JITTER + CRYSTAL * ahead) * period
        breaks = np.flatnonzero(far_off | (ahead < 1) | (ahead > NEAR)) + start
        row, at = start, 0
        while row < stop:
            while at < breaks.size and breaks[at] < row:
                at += 1
            until = int(breaks[at]) if at < breaks.size else stop
            if self._last_row == row - 1 and state._held is None and until > row:
                until = min(until, row + state._renew_after - state._since_anchor)
                changed = self._give_run(
                    row, until, ahead[row - start : until - start], later[row - start : until - start]
                )
                row = until
            else:
                changed = self._step(row)
                row += 1
            if changed:
                break
        return row

    def _give_run(self, start: int, stop: int, ahead: Integers, later: Integers) -> bool:
        """Give out rows that are each near the one before; returns whether the period changed."""
        state, size = self._state, stop - start
        here = slice(self._size, self._size + size)
        self._out[0, here] = np.arange(start, stop)
        self._out[1, here] = state._sequence + np.cumsum(ahead)
        self._out[2, here] = state._time_us + np.cumsum(later)
        self._out[3, here] = state._boot
        self._given[here.start + REMEMBERED : here.stop + REMEMBERED] = self._keys[start:stop]
        self._size += size
        state._counters.frames += size
        state._counters.lost += int(self._out[1, here.stop - 1]) - state._sequence - size
        state._sequence, state._time_us = int(self._out[1, here.stop - 1]), int(self._out[2, here.stop - 1])
        state._last, self._last_row = self._frame(stop - 1), stop - 1
        state._doubts = max(state._doubts - size, 0)
        return state._count(size)

    def _frame(self, row: int) -> _Frame:
        return int(self._counts[row]), int(self._clocks[row])

    def _step(self, row: int) -> bool:
        """Place one row by the known period and the frame held back; returns whether the period changed."""
        state, counters = self._state, self._state._counters
        frame, held = self._frame(row), state._held
        if state._last is not None and state._near(state._last, frame):
            state._doubts = max(state._doubts - 1, 0)
            changed = self._settle_before(frame)
            return self._give(row, (frame[0] - state._last[0]) & COUNT) or changed
        if frame == held or bool((self._given[self._size : self._size + REMEMBERED] == self._keys[row]).any()):
            counters.duplicated += 1
            return False
        if state._is_late(frame, state._last) or state._is_late(frame, held):
            counters.late += 1
            return False
        agreement = "" if held is None else state._agreement(held, frame)
        if held is None or self._held_row is None or not agreement:
            counters.implausible += held is not None
            self._hold(row)
            return False
        return self._give_held(held, self._held_row, row, agreement)

    def _settle_before(self, frame: _Frame) -> bool:
        """Give out the held row if it lies between the last one and ``frame``, else drop it.

        Returns whether the period changed.
        """
        state, held, row = self._state, self._state._held, self._held_row
        if held is None or row is None or state._last is None:
            return False
        self._hold(None)
        ahead, later = (held[0] - state._last[0]) & COUNT, (held[1] - state._last[1]) & CLOCK
        # Where samples are stamped unevenly, a frame may be far off its expected time between two that are not.
        if 0 < ahead < (frame[0] - state._last[0]) & COUNT and 0 < later < (frame[1] - state._last[1]) & CLOCK:
            return self._give(row, ahead)
        state._counters.implausible += 1
        return False

    def _give_held(self, held: _Frame, held_row: int, row: int, agreement: str) -> bool:
        state, frame = self._state, self._frame(row)
        gap = state._gap_to(held)
        changed = False
        self._hold(None)
        if gap is None:
            if state._last is not None:
                state._boot += 1
                state._counters.restarts += 1
            self._give_first(held, held_row)
        else:
            paused = state._last is not None and ((held[1] - state._last[1]) & CLOCK) > NEAR * (state._period_us or 0.0)
            changed = self._give(held_row, gap)
            if paused:
                state._measure_from_here(16)
        ahead = (frame[0] - held[0]) & COUNT
        if agreement == "strays":
            changed = state._doubt_period(held, frame) or changed
        if agreement == "far" or ahead > NEAR:
            self._hold(row)
            return changed
        return self._give(row, ahead) or changed

    def _give_first(self, frame: _Frame, row: int) -> None:
        """Give out the first frame of a device after it booted."""
        state = self._state
        state._sequence, state._time_us = frame
        state._measure_from_here(16)
        self._write(row)

    def _give(self, row: int, ahead: int) -> bool:
        """Give out ``row``, ``ahead`` samples after the last one; returns whether the period changed."""
        state, frame = self._state, self._frame(row)
        if state._last is not None:
            state._time_us += (frame[1] - state._last[1]) & CLOCK
        state._sequence += ahead
        state._counters.lost += ahead - 1
        self._write(row)
        return state._count(1)

    def _write(self, row: int) -> None:
        state = self._state
        self._out[:, self._size] = row, state._sequence, state._time_us, state._boot
        self._given[self._size + REMEMBERED] = self._keys[row]
        self._size += 1
        state._counters.frames += 1
        state._last, self._last_row = self._frame(row), row

    def _hold(self, row: int | None) -> None:
        self._held_row = row
        self._state._held = None if row is None else self._frame(row)
