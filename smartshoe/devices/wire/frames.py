"""Decodes binary frames to samples, and encodes them. docs/wire.md specifies the format."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smartshoe.arrays import Array, Integers, Mask
from smartshoe.devices.wire._checksums import checksums
from smartshoe.devices.wire._commands import Command, CommandDecoder, encode_command
from smartshoe.devices.wire._framing import framed
from smartshoe.devices.wire._ordering import CLOCK, COUNT, Ordering
from smartshoe.devices.wire._scanning import INFORMATION, SAMPLE, FrameScanner
from smartshoe.devices.wire.counters import Counters
from smartshoe.devices.wire.information import MOST_COUNTS, ChannelInformation, Information
from smartshoe.devices.wire.samples import CHANNELS, Samples
from smartshoe.errors import UsageError
from smartshoe.units import COUNTS

__all__ = [
    "ChannelInformation",
    "Command",
    "CommandDecoder",
    "FrameDecoder",
    "Information",
    "encode_command",
    "encode_information",
    "encode_samples",
]

NO_READING = MOST_COUNTS + 1
MOST_CHANNELS = 100  # with more, a frame would exceed one block of COBS


class FrameDecoder:
    """Samples of the named ``channels`` from binary frames; how the bytes are divided into chunks does not matter.

    Readings are counts; `Information.scale` converts them to the device's unit once ``information`` has arrived. The
    first frame, and any that follows a long gap, is given out together with the next one, which must agree with it.
    """

    def __init__(self, channels: Sequence[str] = CHANNELS) -> None:
        if not 1 <= len(channels) <= MOST_CHANNELS or len(set(channels)) != len(channels):
            raise UsageError(f"channels are {', '.join(channels)}: give 1 to {MOST_CHANNELS} different names")
        self.counters = Counters()
        self.information: Information | None = None
        self._names = tuple(channels)
        self._ordering = Ordering(self.counters)
        self._form = np.dtype(
            [
                ("type", "u1"),
                ("count", "<u2"),
                ("clock", "<u4"),
                ("readings", "<u2", (len(self._names),)),
                ("checksum", "<u2"),
            ]
        )
        self._held = np.zeros((1, len(self._names)), dtype="<u2")
        self._held_end = np.zeros(1, dtype=np.int64)
        self._scanner = FrameScanner(self._form.itemsize, self.counters)
        self._present = np.zeros(len(self._names))

    def reset(self) -> None:
        """Discard the incomplete frame after a reconnection; counters and the known state of the stream are kept.

        The next two frames show whether the device kept running or restarted meanwhile (`Samples.boot`).
        """
        self._scanner.reset()

    def feed(self, data: bytes) -> Samples:
        """The samples that ``data`` confirms, possibly none."""
        scanned = self._scanner.feed(data)
        if scanned.information is not None:
            self.information = scanned.information
        payloads = scanned.payloads
        if not payloads.shape[1]:
            return Samples.empty(self._names)
        frames = np.ascontiguousarray(payloads.T).view(self._form)[:, 0]
        readings = np.concatenate([self._held, frames["readings"]])
        placed = self._ordering.place(frames["count"].astype(np.int64), frames["clock"].astype(np.int64))
        end = np.concatenate([self._held_end, scanned.end])
        if placed.held is not None:
            self._held = readings[placed.held : placed.held + 1].copy()
            self._held_end = end[placed.held : placed.held + 1]
        if not placed.rows.size:
            return Samples.empty(self._names)
        values = readings[placed.rows].astype(np.float64)
        missing = values == NO_READING
        return Samples(
            placed.sequence.copy(),
            np.multiply(placed.time_us, 1e-6, dtype=np.float64),
            self._carried(values, missing),
            missing,
            self._names,
            COUNTS,
            placed.boot.copy(),
            end[placed.rows],
        )

    def _carried(self, values: Array, missing: Mask) -> Array:
        """``values`` with missing readings replaced by the last ones present."""
        if missing.any():
            whole = np.concatenate([self._present[None, :], values])
            places = np.arange(len(whole))[:, None]
            there = np.concatenate([np.ones((1, missing.shape[1]), dtype=bool), ~missing])
            values = whole[np.maximum.accumulate(np.where(there, places, 0)), np.arange(missing.shape[1])][1:]
        self._present = values[-1].copy()
        return values


def encode_samples(sequence: ArrayLike, device_us: ArrayLike, readings: ArrayLike) -> bytes:
    """Sample frames, one after another: ``sequence`` and ``device_us`` (n,), ``readings`` (n, channels) in counts.

    Count and clock are truncated to 16 and 32 bits, like a device's. Readings are rounded; NaN is sent as no reading;
    raises `UsageError` beyond 0 to 65534 counts. Each frame has the same length, and its last byte is zero.
    """
    values = np.atleast_2d(np.asarray(readings, dtype=np.float64))
    counts = np.where(np.isnan(values), NO_READING, np.rint(values))
    there = ~np.isnan(values)
    if ((counts < 0) | (counts > MOST_COUNTS))[there].any():
        raise UsageError(f"readings must be from 0 to {MOST_COUNTS} counts, or NaN where there is none")
    n, channels = values.shape
    payload = np.empty((n, 9 + 2 * channels), dtype=np.uint8)
    payload[:, 0] = SAMPLE
    payload[:, 1:3] = _little(np.broadcast_to(np.asarray(sequence), (n,)).astype(np.int64) & COUNT, "<u2")
    payload[:, 3:7] = _little(np.broadcast_to(np.asarray(device_us), (n,)).astype(np.int64) & CLOCK, "<u4")
    payload[:, 7:-2] = counts.astype("<u2").view(np.uint8).reshape(n, 2 * channels)
    payload[:, -2:] = _little(checksums(np.ascontiguousarray(payload[:, :-2].T)).astype(np.int64), "<u2")
    return _with_cobs(payload)


def _little(values: Integers, kind: str) -> NDArray[np.uint8]:
    return np.ascontiguousarray(values.astype(kind)).view(np.uint8).reshape(values.size, -1)


def _with_cobs(payload: NDArray[np.uint8]) -> bytes:
    """Each row (n, length <= 253) COBS-encoded and followed by a zero: zeros become the distance to the next one."""
    n, length = payload.shape
    encoded = np.zeros((n, length + 2), dtype=np.uint8)
    code = np.ones(n, dtype=np.uint8)
    for place in range(length - 1, -1, -1):
        is_zero = payload[:, place] == 0
        encoded[:, place + 1] = np.where(is_zero, code, payload[:, place])
        code = np.where(is_zero, 1, code + 1).astype(np.uint8)
    encoded[:, 0] = code
    return encoded.tobytes()


def encode_information(information: Information) -> bytes:
    """The information frame, preceded by a zero."""
    return b"\0" + framed(bytes([INFORMATION]) + information.to_text().encode("ascii"))
