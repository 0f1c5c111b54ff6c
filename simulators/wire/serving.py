"""`Emulator`: a firmware on a pseudo-terminal, in real time or as fast as it is read, with a radio's faults."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulators.wire.faults import FaultyAir, Outages, WireFaults
from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine

Pace = Literal["real", "drain"]

# Size of a Bluetooth module's buffer; a send that does not fit is dropped entirely.
RADIO_BUFFER_BYTES = 8192
TICK_S = 0.02
# A sketch boots when its port is opened, and prints its header then.
BOOT_S = 0.05
DRAIN_BLOCK_S = 0.1


@dataclass(slots=True)
class Served:
    """Counts of what the emulator has done so far; ``unheard_frames`` were sent while the port was gone or not open."""

    frames: int = 0
    intact_frames: int = 0
    unheard_frames: int = 0
    dropped_bytes: int = 0
    disconnections: int = 0
    device_s: float = 0.0


class Emulator:
    """Serves ``firmware`` on ``line``, through ``faults``.

    ``pace`` "real" follows ``clock`` and drops what the reader is too slow for, as a radio does. "drain" goes as fast
    as the reader takes the bytes and drops nothing; its time is that of the samples, and it has no stalls and no
    batches.
    """

    def __init__(
        self,
        firmware: Firmware,
        line: PtyLine,
        faults: WireFaults | None = None,
        rng: np.random.Generator | None = None,
        pace: Pace = "real",
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.firmware, self.line, self.pace = firmware, line, pace
        self.faults = faults or WireFaults()
        self.served = Served()
        rng = rng if rng is not None else np.random.default_rng(0)
        self._air = FaultyAir(self.faults, rng)
        self._stalls = Outages(self.faults.stall_every_s, self.faults.stall_s, rng)
        self._disconnections = Outages(self.faults.disconnect_every_s, self.faults.away_s, rng)
        self._clock = clock
        self._out = bytearray()
        self._next_batch_s = 0.0
        self._opened_s: float | None = None
        self._is_booted = False

    @property
    def url(self) -> str:
        """The address to open."""
        link = self.line.link
        return f"serial://{link}" if link.is_absolute() else f"serial://./{link}"

    def run(self, stop: threading.Event, duration_s: float = float("inf")) -> None:
        """Serve until ``stop`` is set or ``duration_s`` of the device's time has passed.

        The port is removed at the end.
        """
        now_s = self.firmware.next_due_s()
        begin_s, end_s = self._clock() - now_s, now_s + duration_s
        try:
            self.line.appear()
            while not stop.is_set() and now_s < end_s:
                if self.pace == "real":
                    now_s = self._clock() - begin_s
                elif self._is_drained():
                    now_s += DRAIN_BLOCK_S
                self._step(now_s)
                self._listen(self._idle_s(now_s))
        finally:
            self.line.vanish()

    @contextmanager
    def serving(self) -> Iterator[str]:
        """Serve from a separate thread; yields the address, and re-raises what the thread raised."""
        stop = threading.Event()
        failed: list[BaseException] = []

        def run() -> None:
            try:
                self.run(stop)
            except BaseException as error:  # re-raised below, in the caller's thread
                failed.append(error)

        self.line.appear()
        thread = threading.Thread(target=run, name=f"emulator {self.line.link}", daemon=True)
        thread.start()
        try:
            yield self.url
        finally:
            stop.set()
            thread.join()
        if failed:
            raise failed[0]

    def _is_drained(self) -> bool:
        """Whether a reader has taken everything and wants more, or the port is absent and will reappear with time."""
        is_wanted = self.firmware.is_streaming and self.line.peer_is_there
        return not self._out and (is_wanted or not self.line.is_up)

    def _idle_s(self, now_s: float) -> float:
        if self.pace == "drain":
            return 0.0 if self._out or self._is_drained() else TICK_S
        return min(max(self.firmware.next_due_s() - now_s, 0.0), TICK_S)

    def _listen(self, wait_s: float) -> None:
        heard = self.line.read(wait_s)
        if heard:
            for answer in self.firmware.hear(heard):
                self._queue(answer)

    def _step(self, now_s: float) -> None:
        self.served.device_s = now_s
        self._connect(now_s)
        frames = self.firmware.due(now_s)
        self.served.frames += len(frames)
        if not self._is_heard(now_s):
            self.served.unheard_frames += len(frames)
            self._out.clear()
            return
        aired = self._air.pass_on(frames)
        self.served.intact_frames += int(aired.intact.sum())
        self._queue(aired.data)
        # A stall or a batch would wait for time to pass, which when draining only advances once the frames are out.
        if self.pace == "drain" or (self._stalls.at(now_s) is None and now_s >= self._next_batch_s):
            self._next_batch_s = now_s + 1e-3 * self.faults.batch_ms
            self._flush()

    def _is_heard(self, now_s: float) -> bool:
        """Whether the port is open and the device behind it has booted; sends a sketch's header first."""
        if not self.line.peer_is_there:
            self._opened_s = None
            return False
        if self._opened_s is None:
            self._opened_s, self._is_booted = now_s, not self.firmware.banner
        if not self._is_booted and now_s >= self._opened_s + BOOT_S:
            self._is_booted = True
            self._queue(self.firmware.banner)
        return self._is_booted

    def _connect(self, now_s: float) -> None:
        away = self._disconnections.at(now_s) is not None
        if away and self.line.is_up:
            self.line.vanish()
            self.served.disconnections += 1
        elif not away and not self.line.is_up:
            self.line.appear()
            if self.faults.restarts:
                self.firmware.reboot(now_s)

    def _queue(self, data: bytes) -> None:
        if self.pace == "real" and len(self._out) + len(data) > RADIO_BUFFER_BYTES:
            self.served.dropped_bytes += len(data)
            return
        self._out += data

    def _flush(self) -> None:
        if self.pace == "drain" and self._out:
            self.line.wait_writable(TICK_S)
        del self._out[: self.line.write(bytes(self._out))]
