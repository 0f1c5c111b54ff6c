"""Faults that a radio and a cable do to frames: bursts of loss, duplicates, flipped bits, halves, garbage, outages.

Without I/O: bytes in, bytes out, every draw from the given generator, time as an argument. Frames are passed in whole,
each with its terminator, so that it is known exactly which arrived undamaged.

*Left out:* frames that overtake each other (a serial stream keeps its order; only duplicates arrive late) and bits
flipped in correlated bursts across frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from simulators.effects.bounds import Finite, NotNegative
from smartshoe.arrays import Mask

Percent = Annotated[float, Field(ge=0, le=100)]
LATEST_DUPLICATE = 3


class WireFaults(BaseModel):
    """The table ``[wire]``: percentages are of frames.

    ``every_s`` is the length of a slot, which has one outage of each kind. ``clock_skew_ppm`` is that of the device's
    clock against true time, positive where it runs fast. ``batch_ms`` is how long the radio collects frames before it
    sends them. In a stall nothing arrives and nothing is lost; in a disconnection the port disappears, and what the
    device sends meanwhile is lost; ``restarts`` tells whether it then reboots.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    loss_percent: Annotated[float, Field(ge=0, lt=100)] = 0.0
    loss_burst_frames: Annotated[float, Field(ge=1)] = 5.0
    duplicate_percent: Percent = 0.0
    flip_percent: Percent = 0.0
    half_percent: Percent = 0.0
    garbage_percent: Percent = 0.0
    garbage_bytes: Annotated[int, Field(ge=1, le=4096)] = 40
    clock_skew_ppm: Annotated[Finite, Field(ge=-100_000, le=100_000)] = 0.0
    batch_ms: NotNegative = 0.0
    stall_every_s: NotNegative = 0.0
    stall_s: NotNegative = 0.5
    disconnect_every_s: NotNegative = 0.0
    away_s: NotNegative = 2.0
    restarts: bool = False


@dataclass(frozen=True, eq=False)
class Aired:
    """What arrived of some frames: the bytes, and a mask (n,) of the frames that arrived complete and unchanged."""

    data: bytes
    intact: Mask


class FaultyAir:
    """Passes frames on with the given ``faults``; bursts of loss and late duplicates continue from call to call."""

    def __init__(self, faults: WireFaults, rng: np.random.Generator) -> None:
        self.faults = faults
        self._rng = rng
        self._left_in_burst = 0
        self._left_between = self._draw_between()
        self._late: list[tuple[int, bytes]] = []

    def _draw_between(self) -> int:
        share = self.faults.loss_percent / 100.0
        if share == 0.0:
            return np.iinfo(np.int64).max
        mean = self.faults.loss_burst_frames * (1.0 - share) / share
        return int(self._rng.geometric(1.0 / max(mean, 1.0)))

    def _lost(self, count: int) -> Mask:
        """Mask of lost frames: bursts of geometric length, ``loss_percent`` of all frames on average."""
        lost = np.zeros(count, dtype=bool)
        at = 0
        while at < count:
            if self._left_in_burst == 0 and self._left_between == 0:
                self._left_in_burst = int(self._rng.geometric(1.0 / self.faults.loss_burst_frames))
                self._left_between = self._draw_between()
            if self._left_in_burst:
                step = min(self._left_in_burst, count - at)
                lost[at : at + step] = True
                self._left_in_burst -= step
            else:
                step = min(self._left_between, count - at)
                self._left_between -= step
            at += step
        return lost

    def pass_on(self, frames: Sequence[bytes]) -> Aired:
        """The bytes that arrive of ``frames``, in order, and which frames are intact."""
        count, faults, rng = len(frames), self.faults, self._rng
        if not count:
            return Aired(b"", np.zeros(0, dtype=bool))
        lost = self._lost(count)
        drawn = rng.random((4, count)) * 100.0
        flipped, halved = drawn[0] < faults.flip_percent, drawn[1] < faults.half_percent
        doubled, soiled = drawn[2] < faults.duplicate_percent, drawn[3] < faults.garbage_percent
        arrived: list[bytes] = []
        touched = lost | flipped | halved | doubled | soiled
        for frame, is_touched, index in zip(frames, touched.tolist(), range(count), strict=True):
            if self._late:
                arrived += self._due_duplicates()
            if not is_touched:
                arrived.append(frame)
                continue
            if soiled[index]:
                arrived.append(rng.bytes(int(rng.integers(1, faults.garbage_bytes + 1))))
            if lost[index]:
                continue
            if doubled[index]:
                self._late.append((int(rng.integers(0, LATEST_DUPLICATE + 1)), frame))
            if halved[index]:
                frame = _half(frame, rng)
            if flipped[index]:
                frame = _with_flips(frame, rng)
            arrived.append(frame)
        return Aired(b"".join(arrived), ~(lost | halved | flipped))

    def _due_duplicates(self) -> list[bytes]:
        due = [frame for wait, frame in self._late if wait == 0]
        self._late = [(wait - 1, frame) for wait, frame in self._late if wait > 0]
        return due


def _half(frame: bytes, rng: np.random.Generator) -> bytes:
    """The first or the last part of a frame."""
    if len(frame) < 2:
        return b""
    cut = int(rng.integers(1, len(frame)))
    return frame[:cut] if rng.random() < 0.5 else frame[cut:]


def _with_flips(frame: bytes, rng: np.random.Generator) -> bytes:
    """The frame with one flipped bit, or several different ones (geometric, mostly one to three)."""
    bits = 8 * len(frame)
    flips = min(int(rng.geometric(0.6)), bits)
    harmed = bytearray(frame)
    for bit in rng.choice(bits, size=flips, replace=False).tolist():
        harmed[bit // 8] ^= 1 << (bit % 8)
    return bytes(harmed)


class Outages:
    """One outage of ``lasting_s`` at a random time in each slot of ``every_s``; none where either is zero."""

    def __init__(self, every_s: float, lasting_s: float, rng: np.random.Generator) -> None:
        self._every_s, self._lasting_s = every_s, min(lasting_s, every_s)
        self._rng = rng
        self._starts: list[float] = []

    def _start_of(self, slot: int) -> float:
        while len(self._starts) <= slot:
            room = self._every_s - self._lasting_s
            self._starts.append(len(self._starts) * self._every_s + float(self._rng.uniform(0.0, room)))
        return self._starts[slot]

    def at(self, time_s: float) -> tuple[float, float] | None:
        """Start and end of the outage that contains ``time_s``, or None."""
        if self._every_s <= 0.0 or self._lasting_s <= 0.0 or time_s < 0.0:
            return None
        start = self._start_of(int(time_s // self._every_s))
        return (start, start + self._lasting_s) if start <= time_s < start + self._lasting_s else None
