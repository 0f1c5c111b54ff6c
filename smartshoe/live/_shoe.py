"""`LiveShoe`: one shoe as the page shows it, with its last minute of data, its steps, its losses and its clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration
from smartshoe.devices import Block, Dropped, Gap, Shoe, ShoeEvent
from smartshoe.gait import LEAST_LOAD_N
from smartshoe.gait.insole import PLACES, centre_of_pressure
from smartshoe.live._ring import Ring
from smartshoe.live._steps import GaitStep, StepFollower
from smartshoe.recording import REGIONS, Channel, Recording
from smartshoe.runs.session.streaming import StreamedForces

REFERENCE_S = 60.0
KEPT_S = 62.0  # a little more than the longest trace on the page
LEAST_SHARE = 0.04  # of a unit's range: the smallest variation of a foot's load (in readings) that can be a step
USUAL_RANGE = 50.0  # in mbar, for devices that do not report their range


@dataclass(frozen=True)
class LiveFoot:
    """A foot: ``side`` ('left', 'right' or ''), its units' columns in the shoe's samples, and their regions."""

    side: str
    columns: tuple[int, ...]
    regions: tuple[str, ...]


def feet_of(names: Sequence[str]) -> tuple[LiveFoot, ...]:
    """The feet whose units are among ``names``; other names are ignored."""
    by_side: dict[str, list[int]] = {}
    for column, name in enumerate(names):
        side, _, region = name.rpartition("_")
        if region in REGIONS and side in ("", "left", "right"):
            by_side.setdefault(side, []).append(column)
    return tuple(
        LiveFoot(side, tuple(columns), tuple(names[c].rpartition("_")[2] for c in columns))
        for side, columns in by_side.items()
    )


@dataclass(frozen=True)
class FootNow:
    """A foot's current ``phase`` (None if unknown), whole ``load``, and centre of pressure (NaN if unknown)."""

    phase: int | None
    load: float
    centre: tuple[float, float]


class LiveShoe:
    """All that is shown of one shoe, in bounded memory; written by the shoe's thread, read by the server's.

    ``samples`` counts the samples taken in (while recording, those that are on disk). Shown values are forces in N for
    calibrated units and readings for the others, against the session's time.
    """

    def __init__(self, url: str, shoe: Shoe, calibrations: Sequence[Calibration]) -> None:
        self.url, self.shoe = url, shoe
        channels = shoe.describe()
        self.names = tuple(channel.name for channel in channels)
        self.unit = channels[0].unit
        self.rate_hz = round(float(shoe.sample_rate_hz), 6)
        self.calibrations = tuple(calibrations)
        self.forces = StreamedForces(self.calibrations, shoe)
        self.symbols = tuple("N" if name in self.forces.names else self.unit.symbol for name in self.names)
        self.ranges = tuple(channel.range_ for channel in channels)
        self.feet = feet_of(self.names)
        self.state = "opening"
        self.samples = self.lost = self.waiting = 0
        self.zero = np.zeros(len(self.names))
        self._offset_s = self._sd_s = self._skew_ppm = 0.0
        self._first_s: float | None = None
        self._reference_s: float | None = None
        capacity = int(KEPT_S * self.rate_hz) + 1
        self._shown, self._readings = Ring(capacity, len(self.names)), Ring(capacity, len(self.names))
        self._last = np.zeros(len(self.names))
        self._steps = [StepFollower(foot.regions, self._least(foot)) for foot in self.feet]
        self._lock = Lock()
        self._last_times: tuple[float, float] | None = None  # of the last sample: the shoe's time and the session's
        self._written_s = -np.inf
        self.last_arrival_s = -np.inf
        self.newest_s = -np.inf

    @property
    def side(self) -> str:
        """The foot that this shoe is on; '' if it has the units of both feet or of none."""
        sides = {foot.side for foot in self.feet}
        return sides.pop() if len(sides) == 1 else ""

    def _least(self, foot: LiveFoot) -> float:
        """The smallest variation of a foot's load that can be a step, in the unit of its shown values."""
        if all(self.symbols[c] == "N" for c in foot.columns):
            return LEAST_LOAD_N
        ranges = [self.ranges[c] for c in foot.columns]
        return LEAST_SHARE * max([r[1] - r[0] for r in ranges if r is not None] or [USUAL_RANGE])

    def take(self, block: Block, session_s: Array, force_n: dict[str, Array]) -> list[tuple[str, GaitStep]]:
        """Take in a block with session times ``session_s`` (n,); returns its steps, each with its foot's side."""
        columns = [
            force_n[name] if name in force_n else np.where(block.missing[:, k], np.nan, block.readings[:, k])
            for k, name in enumerate(self.names)
        ]
        shown = np.column_stack(columns)
        # A corrected clock may place a sample before the last one; shown time must not go back.
        session_s = np.maximum.accumulate(np.maximum(session_s, self.newest_s))
        with self._lock:
            self._shown.append(session_s, shown)
            self._readings.append(block.time_s, np.where(block.missing, np.nan, block.readings))
            self.newest_s = float(session_s[-1])
            self._last_times = float(block.time_s[-1]), self.newest_s
        if block.arrival_s is not None:
            self.last_arrival_s = float(block.arrival_s[-1])
        held = self._held(shown) - self.zero
        return [
            (foot.side, step)
            for foot, follower in zip(self.feet, self._steps, strict=True)
            for step in follower.push(session_s, held[:, foot.columns])
        ]

    def _held(self, shown: Array) -> Array:
        """The shown values (n, units) with missing ones replaced by the last present one."""
        whole = np.vstack([self._last, shown])
        there = np.isfinite(whole)
        index = np.maximum.accumulate(np.where(there, np.arange(len(whole))[:, None], 0), axis=0)
        held = np.asarray(np.take_along_axis(whole, index, axis=0)[1:])
        self._last = held[-1]
        return held

    def follow_clock(self, block: Block, shift_s: float) -> None:
        """Note a block's host time and its uncertainty; the block's time is the shoe's own plus ``shift_s``."""
        if block.host_time_s is None:
            return
        device_s, host_s = float(block.time_s[-1]), float(block.host_time_s[-1])
        clock = self.shoe.device_clock
        if clock is None or clock.fit is None:  # the host times were computed from the stream's own times
            self._reference_s = 0.0
            return
        self._sd_s, self._skew_ppm = float(clock.fit.sd_s(device_s - shift_s)), clock.fit.skew_ppm
        if self._first_s is None:
            self._first_s = float(block.time_s[0])
        if self._reference_s is None or device_s - self._first_s < REFERENCE_S:
            # The first fits of the clock are rough; later ones give a better start time.
            self._reference_s = float(clock.host_time(self._first_s - shift_s)) - self._first_s
        self._offset_s = host_s - device_s - self._reference_s

    def clock_dict(self) -> dict[str, float | None]:
        """How far the host's clock has moved from the shoe's, its standard error, and the difference of the rates."""
        if self._reference_s is None:
            return {"offset_ms": None, "sd_ms": None, "skew_ppm": None}
        return {
            "offset_ms": round(1e3 * self._offset_s, 4),
            "sd_ms": round(1e3 * self._sd_s, 4),
            "skew_ppm": round(self._skew_ppm, 3),
        }

    def since(self, place: int) -> tuple[int, Array, Array]:
        """The number of the next sample, and from ``place`` on session times (n,) and shown values less their zero."""
        with self._lock:
            time_s, rows = self._shown.since(place)
            return self._shown.end, time_s, rows - self.zero

    def now(self) -> tuple[Array, list[FootNow]]:
        """The last value (units,) of each unit, and the state of each foot."""
        values = self._last - self.zero
        feet = []
        for foot, follower in zip(self.feet, self._steps, strict=True):
            loads = values[list(foot.columns)]
            centre = centre_of_pressure(loads[None], foot.regions, follower.least, PLACES)[0]
            feet.append(FootNow(follower.phase, float(loads.sum()), (float(centre[0]), float(centre[1]))))
        return values, feet

    def readings_of_last(self, seconds: float) -> tuple[Array, Array]:
        """Device times (n,) and readings (n, units), NaN where missing, of the last ``seconds``."""
        with self._lock:
            times, _ = self._readings.since(self._readings.end - 1)
            return self._readings.after(float(times[-1]) - seconds) if times.size else self._readings.since(0)

    def shown_of_last(self, seconds: float) -> Array:
        """Shown values (n, units) of the last ``seconds``, without subtracting the zero."""
        with self._lock:
            return self._shown.after(self.newest_s - seconds)[1]

    def recording_of_last(self, seconds: float) -> Recording | None:
        """The readings of the last ``seconds`` as a recording; None if there are fewer than two samples."""
        time_s, readings = self.readings_of_last(seconds)
        if time_s.size < 2:
            return None
        channels = {
            name: Channel.from_values(name, readings[:, k], self.unit, "sensor") for k, name in enumerate(self.names)
        }
        return Recording(time_s, channels, name=self.side or "shoe")

    def set_zero(self, columns: Sequence[int], zeros: Array) -> None:
        """Subtract ``zeros`` (c,) from what ``columns`` (c,) show, also in the traces shown so far."""
        zero = self.zero.copy()
        zero[list(columns)] = zeros
        self.zero = zero

    def full_scale(self, column: int) -> float:
        """Full scale of a unit's reading: its range, or a usual one if the device does not report it."""
        range_ = self.ranges[column]
        return USUAL_RANGE if range_ is None else range_[1] - range_[0]

    def device_time_s(self, session_s: float) -> float | None:
        """The shoe's time at a session time, extrapolated from the last sample; None before the first."""
        last = self._last_times
        return None if last is None else round(last[0] + (session_s - last[1]), 4)

    def on_session_time(self, block: Block, session_s: Array) -> Block:
        """The block with session times instead of its own, strictly increasing, so that two shoes share one clock."""
        rising = np.maximum.accumulate(np.concatenate([[self._written_s], session_s]))
        for k in np.flatnonzero(np.diff(rising) <= 0.0) + 1:
            rising[k] = np.nextafter(rising[k - 1], np.inf)
        self._written_s = float(rising[-1])
        return replace(block, time_s=rising[1:])

    def to_dict(self) -> dict[str, Any]:
        """The shoe's part of the state that pages get."""
        return {
            "state": self.state,
            "samples": self.samples,
            "lost": self.lost,
            "rate_hz": self.rate_hz,
            "clock": self.clock_dict(),
        }


def lost_in(events: Sequence[ShoeEvent]) -> int:
    """Number of samples that the device took but that never arrived."""
    return sum(e.lost if isinstance(e, Gap) else e.samples if isinstance(e, Dropped) else 0 for e in events)
