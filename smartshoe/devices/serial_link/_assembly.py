"""Turns decoded samples and their arrival times into blocks and events; without I/O, so that it runs on any clock."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Integers
from smartshoe.devices._base import Block
from smartshoe.devices._events import Gap, Restarted, ShoeEvent
from smartshoe.devices.serial_link._line_pace import LinePace
from smartshoe.devices.serial_link.inbox import joined
from smartshoe.devices.wire.clock import DeviceClock, at_once
from smartshoe.devices.wire.information import Information
from smartshoe.devices.wire.samples import Samples
from smartshoe.errors import DeviceError
from smartshoe.units import Unit

RATED_S = 1.0
# The time unit of text lines is a guess: a clock that seems this much slower than the host's is in another unit.
SLOWEST_CLOCK = 0.1
WATCHED_S = 3.0


class Assembler:
    """Scales and names samples, keeps their time increasing over restarts, fits the device's clock to the host's.

    ``first`` are samples of the stream, from which names and unit are taken; ``to`` is the unit of the blocks, that of
    the samples where it is None. ``counts_samples`` is False where the device has no sample counter (text lines): gaps
    are then found from the time alone. A restarted device counts from zero: its time is continued where the host's
    clock puts it, and the clock is fitted anew. ``apart`` is passed to the `DeviceClock`.
    """

    def __init__(
        self,
        first: Samples,
        information: Information | None = None,
        to: Unit | None = None,
        named: Callable[[str], str] = str,
        counts_samples: bool = True,
        apart: Callable[[Callable[[], None]], None] = at_once,
    ) -> None:
        self._information = information
        scaled = self._scaled(first)
        self.names = tuple(named(name) for name in scaled.names)
        self.comes_in = scaled.unit
        self.unit = to or scaled.unit
        self._apart = apart
        self.clock = DeviceClock(apart)
        self._counts_samples = counts_samples
        self._pace: LinePace | None = None
        self._steps_s: list[float] = []
        self._is_rated = False
        self._watched_s = [0.0, 0.0]  # elapsed by the device's clock and by the host's, while samples arrived
        self._shift_s = 0.0
        self._last: tuple[int, int, float, float] | None = None  # boot, sequence, time and arrival of the last sample

    def take(self, samples: Samples, arrival_s: ArrayLike) -> tuple[Block, list[ShoeEvent]]:
        """One block of ``samples`` (at least one), arrived at ``arrival_s`` (n,), and the events that preceded it."""
        events: list[ShoeEvent] = []
        scaled = self._scaled(samples)
        arrivals_s = np.array(np.broadcast_to(np.asarray(arrival_s, dtype=np.float64), len(scaled)))
        if scaled.unit != self.comes_in:
            raise DeviceError(
                f"the shoe's readings changed from {self.comes_in.symbol} to {scaled.unit.symbol}: open it again, or"
                " say unit in its address"
            )
        boots = np.flatnonzero(np.diff(scaled.boot)) + 1
        ends = [*boots.tolist(), len(scaled)]
        blocks = [
            self._take_boot(scaled, slice(start, end), arrivals_s[start:end], events)
            for start, end in zip([0, *ends], ends, strict=False)
        ]
        return joined(blocks), events

    @property
    def rate_hz(self) -> float | None:
        """Samples per second, measured from their times; None before two samples have arrived."""
        return None if self._pace is None else 1.0 / self._pace.period_s

    def _scaled(self, samples: Samples) -> Samples:
        return samples if self._information is None else self._information.scale(samples)

    def _take_boot(self, samples: Samples, part: slice, arrival_s: Array, events: list[ShoeEvent]) -> Block:
        """The block of the samples ``part`` (one boot of the device); appends to ``events``."""
        sequence, device_s, boot = samples.sequence[part], samples.device_time_s[part], int(samples.boot[part][0])
        if self._last is not None and boot != self._last[0]:
            # Time must increase even over a restart within one arrival, if only by a microsecond.
            resumes_s = self._last[2] + max(float(arrival_s[0]) - self._last[3], 1e-6)
            self._shift_s = resumes_s - float(device_s[0])
            self._last = None
            self.clock = DeviceClock(self._apart)
            events.append(Restarted(float(arrival_s[0]), resumes_s))
        time_s = device_s + self._shift_s
        self._require_seconds(float(time_s[-1]), float(arrival_s[-1]))
        self._find_gaps(sequence, time_s, arrival_s, events)
        self._last = (boot, int(sequence[-1]), float(time_s[-1]), float(arrival_s[-1]))
        self.clock.update(time_s, arrival_s)
        readings = self.comes_in.convert(samples.readings[part], self.unit)
        return Block(
            time_s, readings, samples.missing[part], self.names, self.unit, self.clock.host_time(time_s), arrival_s
        )

    def _find_gaps(self, sequence: Integers, time_s: Array, arrival_s: Array, events: list[ShoeEvent]) -> None:
        if self._last is not None:
            sequence, time_s = np.append(self._last[1], sequence), np.append(self._last[2], time_s)
            arrival_s = np.append(self._last[3], arrival_s)
        if time_s.size < 2:
            return
        steps_s = np.diff(time_s)
        if not self._is_rated:
            self._rate(steps_s / np.diff(sequence))
        steps = np.diff(sequence) if self._counts_samples or self._pace is None else self._pace.samples(steps_s)
        events += [
            Gap(float(arrival_s[i + 1]), int(steps[i]) - 1, float(time_s[i]), float(time_s[i + 1]))
            for i in np.flatnonzero(steps > 1)
        ]

    def _rate(self, steps_s: Array) -> None:
        """Update the measured rate from steps (n,) between samples, until `RATED_S` without gaps have been seen."""
        self._steps_s += steps_s.tolist()
        so_far_s = np.array(self._steps_s)
        self._pace = LinePace.of(so_far_s)
        self._is_rated = bool(np.sum(so_far_s / self._pace.samples(so_far_s)) >= RATED_S)

    def _require_seconds(self, time_s: float, arrival_s: float) -> None:
        """Raise `DeviceError` where the times of text lines run far slower than the host's clock."""
        if self._counts_samples or self._last is None or arrival_s - self._last[3] > WATCHED_S:
            return
        self._watched_s[0] += time_s - self._last[2]
        self._watched_s[1] += arrival_s - self._last[3]
        device_s, host_s = self._watched_s
        if host_s >= WATCHED_S and device_s < SLOWEST_CLOCK * host_s:
            raise DeviceError(
                f"the shoe's times went on by {device_s:.3g} s in {host_s:.1f} s: say their unit in its address,"
                " with time=s, time=ms or time=us"
            )
