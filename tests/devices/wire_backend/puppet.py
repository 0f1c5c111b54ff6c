"""A shoe on strings: it answers commands by itself and sends what a test makes it send."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self, TypeVar

import numpy as np

from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine
from smartshoe.devices.replay import ReplayedShoe
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.recording import REGIONS, Recording

T = TypeVar("T")
RATE_HZ = 200.0
STEP_S = 10.0
PAUSES = 12  # between the pieces of one sending, so that they are read apart


def ramp_shoe(samples: int = 4000, rate_hz: float = RATE_HZ) -> ReplayedShoe:
    """A shoe whose four readings rise from 0 to 900 mbar, each a little apart, so that every sample is another one."""
    rise = np.linspace(0.0, 900.0, samples)
    columns = {f"{region}_mbar": rise + 10.0 * place for place, region in enumerate(REGIONS)}
    return ReplayedShoe(Recording.from_arrays(time_s=np.arange(samples) / rate_hz, **columns))


def within(seconds: float, call: Callable[[], T]) -> T:
    """What ``call`` returns or raises, in another thread; a test that hangs fails here instead."""
    done: list[tuple[T | None, BaseException | None]] = []

    def run() -> None:
        try:
            done.append((call(), None))
        except BaseException as error:  # raised again below, in the test's own thread
            done.append((None, error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    if not done:
        raise AssertionError(f"not done within {seconds:g} s")
    result, error = done[0]
    if error is not None:
        raise error
    return result  # type: ignore[return-value]


def wait_until(holds: Callable[[], bool], seconds: float = STEP_S) -> None:
    """Wait until ``holds``; fails after ``seconds``."""
    until_s = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < until_s, f"not so within {seconds:g} s"
        time.sleep(0.002)


class Puppet:
    """Firmware at a pseudo-terminal whose time only goes on when samples are sent.

    ``intact`` are the places (0, 1, ...) of the samples that went out whole while the port was open and started,
    ``written`` the bytes of all that went out.
    """

    def __init__(self, link: Path) -> None:
        self.firmware = Firmware(ramp_shoe())
        self.line = PtyLine(link)
        self.intact: list[int] = []
        self.written = 0
        self.is_mute_after_start = False
        self._was_started = False
        self._idle_rounds = 0
        self._place = 0
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._answer, daemon=True)

    def __enter__(self) -> Self:
        self.line.appear()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.line.vanish()

    @property
    def is_started(self) -> bool:
        """Whether a host is there and has started the stream over the present connection."""
        return self.firmware.is_streaming and self.line.peer_is_there

    def _answer(self) -> None:
        while not self._stop.is_set():
            with self._lock:
                heard = self.line.read()
                self._idle_rounds = 0 if heard else self._idle_rounds + 1
                answers = self.firmware.hear(heard)
                for answer in answers:
                    self._write(answer)
                if self.is_mute_after_start and self._was_started:
                    continue
                if answers and self.is_started:
                    self._was_started = True
                    # Two, so that the decoder can be sure of the first.
                    self._send_samples(2)
            time.sleep(0.002)

    def _write(self, data: bytes) -> None:
        until_s = time.monotonic() + STEP_S
        while data and self.line.peer_is_there:
            count = self.line.write(data)
            self.written += count
            data = data[count:]
            assert time.monotonic() < until_s, "nobody reads the port"

    def _send_samples(self, count: int, chunk: int = 4096) -> None:
        frames = self.firmware.due((self._place + count - 1) / RATE_HZ)
        self.intact += range(self._place, self._place + len(frames))
        self._place += count
        data = b"".join(frames)
        for number, at in enumerate(range(0, len(data), chunk)):
            self._write(data[at : at + chunk])
            if number < PAUSES:
                time.sleep(0.001)

    def send(self, count: int, chunk: int = 4096) -> None:
        """Send ``count`` samples, ``chunk`` bytes at a time."""
        with self._lock:
            if self.is_started:
                self._send_samples(count, chunk)

    def lose(self, count: int, keep: int = 0) -> None:
        """Take ``count`` samples and send nothing of them but the last one's first ``keep`` bytes."""
        with self._lock:
            if self.is_started:
                self._place += count
                frames = self.firmware.due((self._place - 1) / RATE_HZ)
                self._write(frames[-1][: min(keep, len(frames[-1]) - 1)])

    def send_raw(self, data: bytes) -> None:
        """Send ``data``, whatever it is."""
        with self._lock:
            if self.is_started:
                self._write(data)

    def settle(self) -> None:
        """Wait until the last host's commands are heard: answers to them would come to the next one as it opens."""
        self._idle_rounds = 0
        wait_until(lambda: self._idle_rounds >= 2)

    def firmware_range(self, channel: int) -> tuple[float, float]:
        """What the device says of a channel's range."""
        said = self.firmware.information.channels[channel]
        return said.low, said.high

    def restart(self) -> None:
        """The device boots anew: count and clock from nought."""
        with self._lock:
            self.firmware.reboot(self.firmware.next_due_s())

    def drop(self, reader: SerialShoe) -> None:
        """The connection goes, once ``reader`` (opened over this port, once) has read everything on its way."""

        # The kernel does not tell: bytes on their way between the two ends are in no count of its.
        def is_read() -> bool:
            return reader.counters is not None and reader.counters.bytes >= self.written

        wait_until(lambda: not self.line.peer_is_there or is_read())
        with self._lock:
            self.firmware.is_streaming = False
            self.line.vanish()

    def come_back(self) -> None:
        """The port appears again; samples were taken meanwhile."""
        with self._lock:
            self.line.appear()
