"""A shoe's firmware on a virtual clock: plays any `Shoe` at its rate, sends frames or text lines, obeys commands.

*Left out:* jitter of the microcontroller's sampling, its boot time, a full scale other than the sensor's range.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array
from smartshoe.devices import Shoe
from smartshoe.devices.wire.frames import CommandDecoder, encode_information, encode_samples
from smartshoe.devices.wire.information import ChannelInformation, Information
from smartshoe.devices.wire.lines import encode_header, encode_lines
from smartshoe.recording import Recording

Format = Literal["frames", "lines"]

FULL_SCALE_COUNTS = 65534
DEFAULT_RANGE = (0.0, 1000.0)


class Firmware:
    """A simulated device that reads ``shoe`` once, then plays it repeatedly at ``rate_hz`` or its own rate.

    ``clock_skew_ppm`` makes the device's clock run fast, ``boot_us`` is its counter at true time 0. Frames wait for the
    start command, lines are sent at once. True time is given by the caller; it only increases. ``played`` (n, channels)
    are the readings, in the shoe's unit.
    """

    def __init__(
        self,
        shoe: Shoe,
        format_: Format = "frames",
        *,
        rate_hz: float | None = None,
        clock_skew_ppm: float = 0.0,
        boot_us: int = 0,
        serial_number: str = "emulated",
    ) -> None:
        recording = shoe.record() if shoe.is_open else _read_through(shoe)
        channels = shoe.describe()
        ranges = [c.range_ or DEFAULT_RANGE for c in channels]
        self.format = format_
        self.is_streaming = format_ == "lines"
        self.names = tuple(c.name for c in channels)
        self.unit = channels[0].unit
        self.rate_hz = float(rate_hz or shoe.sample_rate_hz)
        self.sent = 0
        self._low, self._high = np.array(ranges).T
        self.played = np.column_stack([c.values for c in recording.sensors])
        self.serial_number = serial_number
        self._skew = clock_skew_ppm * 1e-6
        self._boot_us = boot_us
        self._booted_s = 0.0
        self._index = 0
        self._keep_each = 1
        self._commands = CommandDecoder()

    @property
    def information(self) -> Information:
        """The information that the device sends about itself."""
        channels = tuple(
            ChannelInformation(name, self.unit.symbol, float(low), float(high))
            for name, low, high in zip(self.names, self._low, self._high, strict=True)
        )
        return Information(
            firmware="smartshoe emulator",
            serial_number=self.serial_number,
            rate_hz=self.rate_hz / self._keep_each,
            channels=channels,
            full_scale_counts=FULL_SCALE_COUNTS,
        )

    @property
    def banner(self) -> bytes:
        """What a sketch of text lines prints when its port is opened; empty for frames."""
        if self.format == "frames":
            return b""
        said = f"# firmware: emulator\n# serial: {self.serial_number}\n# rate: {self.information.rate_hz:g} Hz\n"
        columns = [f"{name.split('_')[-1]}_{self.unit.suffix}" for name in self.names]
        return said.encode("ascii") + encode_header(["t_us", *columns])

    def reboot(self, now_s: float) -> None:
        """Restart counter and sequence at true time ``now_s``; frames wait for a start command again."""
        self._booted_s, self._boot_us, self.sent = now_s, 0, 0
        self.is_streaming = self.format == "lines"
        self._commands = CommandDecoder()

    def hear(self, data: bytes) -> list[bytes]:
        """Carry out the commands in ``data``; returns the frames that answer them."""
        if self.format == "lines":
            return []
        answers: list[bytes] = []
        for command in self._commands.feed(data):
            if command.kind == "start":
                self.is_streaming = True
            elif command.kind == "stop":
                self.is_streaming = False
            elif command.rate_hz is not None:
                self._keep_each = max(1, round(self.rate_hz / command.rate_hz))
                answers.append(encode_information(self.information))
            elif command.kind == "information":
                answers.append(encode_information(self.information))
        return answers

    def next_due_s(self) -> float:
        """True time in s of the next sample."""
        return self._index / self.rate_hz

    def due(self, until_s: float) -> list[bytes]:
        """The frames or lines of the samples taken up to true time ``until_s``, in order; none while stopped."""
        last = int(np.floor(until_s * self.rate_hz * (1.0 + 1e-12)))
        index = np.arange(self._index, last + 1)
        self._index = max(self._index, last + 1)
        index = index[index % self._keep_each == 0]
        if not self.is_streaming or not index.size:
            return []
        sequence = self.sent + np.arange(index.size)
        self.sent += index.size
        device_s = (index / self.rate_hz - self._booted_s) * (1.0 + self._skew)
        device_us = np.round(device_s * 1e6).astype(np.int64) + self._boot_us
        readings = self.played[index % len(self.played)]
        if self.format == "lines":
            return encode_lines(device_us % 2**32, readings).splitlines(keepends=True)
        return whole_frames(encode_samples(sequence, device_us, self.counts(readings)))

    def counts(self, readings: Array) -> NDArray[np.uint16]:
        """Readings (n, channels) as the converter's counts, limited to its range."""
        share = (readings - self._low) / (self._high - self._low)
        counts: NDArray[np.uint16] = np.clip(np.round(share * FULL_SCALE_COUNTS), 0, FULL_SCALE_COUNTS).astype(
            np.uint16
        )
        return counts


def whole_frames(data: bytes) -> list[bytes]:
    """The zero-terminated frames in ``data``, each with its terminator."""
    return [part + b"\0" for part in data.split(b"\0")[:-1]]


def _read_through(shoe: Shoe) -> Recording:
    with shoe:
        return shoe.record()
