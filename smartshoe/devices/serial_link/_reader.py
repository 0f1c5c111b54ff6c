"""The thread behind a `SerialShoe`: reads the port, watches for valid frames, reopens a lost port.

No wait is unbounded.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices._events import Disconnected, EventLog, Reconnected, Silence, ToldLate
from smartshoe.devices.serial_link._assembly import Assembler
from smartshoe.devices.serial_link._greeting import Decoder, Greeting, farewell, hello
from smartshoe.devices.serial_link._port import READ_WAIT_S, Port
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.inbox import Inbox
from smartshoe.devices.serial_link.reconnect import Backoff
from smartshoe.devices.wire.samples import Samples, join_samples
from smartshoe.errors import DeviceError, DeviceTimeoutError

# Reading waits 50 ms, writing 500 ms; only an operating system that hangs while opening a port takes longer.
JOIN_S = 2.0
MOST_DOUBLINGS = 3
PAUSE_SAMPLES = 5.0
# Bytes that arrive within this time of a first one are decoded together, since the cost is per call, not per sample.
# Each chunk is still read, and its time noted, as it arrives.
GATHER_S = 0.016
ENOUGH_BYTES = 512  # are decoded at once: gathering more of a fast stream would cost more than it saves


class SerialReader:
    """Reads one opened port, beginning with the greeting. It fills its own ``assembler`` and ``inbox``.

    Every wait is bounded: without a valid frame for ``settings.give_up_s``, the inbox ends with `DeviceTimeoutError`.
    """

    def __init__(
        self,
        name: str,
        port: Port,
        reopen: Callable[[], Port],
        greeting: Greeting,
        assembler: Assembler,
        settings: SerialSettings,
        clock: Callable[[], float],
    ) -> None:
        self.inbox = Inbox(settings.buffer)
        self.log = EventLog()
        self.assembler = assembler
        self.greeting = greeting
        self._name = name
        self._port: Port | None = port
        self._reopen_port = reopen
        self._settings = settings
        self._clock = clock
        self._closing = threading.Event()
        self._backoff = Backoff()
        self._opened_s = self._valid_s = clock()
        said = greeting.information
        self._serial_number = None if said is None else said.serial_number
        self._openings = 0  # of the port, since the last valid frame
        self._is_silent = self._is_away = False
        self._reason = "silent"
        # In one call: the period of text lines, which reveals lost ones, is measured over all of them.
        parts, arrivals_s = zip(*greeting.first, strict=True)
        self._hand_on(join_samples(parts), np.concatenate(arrivals_s))
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)

    @property
    def decoder(self) -> Decoder:
        """The decoder of this shoe's bytes, with its counters."""
        return self.greeting.decoder

    def start(self) -> None:
        """Start the reading thread."""
        self._thread.start()

    def close(self) -> None:
        """Stop reading and end all waits at once; blocks that were not taken are discarded."""
        self._closing.set()
        self.inbox.end(discard=True)
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        error: DeviceError | None = None
        try:
            while not self._closing.is_set():
                try:
                    self._read_once()
                except _LostError as lost:
                    self._recover(str(lost))
            self._say(farewell())
        except DeviceError as failed:
            error = failed
        except Exception as failed:  # an error in this thread must end the stream, not leave the consumer waiting
            error = DeviceError(f"{self._name}: reading failed ({type(failed).__name__}: {failed}); please report this")
            error.__cause__ = failed
        finally:
            self._let_go()
            self.inbox.end(error)

    def _read_once(self) -> None:
        port = self._port
        if port is None:
            raise _LostError(self._reason)
        data, lost = self._gathered(port)
        now_s = self._clock()
        samples = self.decoder.feed(data) if data else None
        self._require_the_same_shoe()
        if samples is not None and len(samples):
            self._valid(now_s)
            self._hand_on(samples, self.greeting.arrivals.of(samples.end))
        elif lost is None:
            self._watch(now_s)
        if lost is not None:
            raise _LostError(str(lost)) from lost

    def _gathered(self, port: Port) -> tuple[bytes, DeviceError | None]:
        """The bytes received within `GATHER_S` (or `ENOUGH_BYTES`) and the error that ended the port, if any."""
        pieces: list[bytes] = []
        wait_s, until_s, size = READ_WAIT_S, 0.0, 0
        while wait_s > 0.0 and size < ENOUGH_BYTES and not self._closing.is_set():
            try:
                piece = port.read(wait_s)
            except DeviceError as error:
                return b"".join(pieces), error
            now_s = self._clock()
            if not piece:
                break
            until_s = until_s if pieces else now_s + GATHER_S
            wait_s = until_s - now_s
            self.greeting.arrivals.note(len(piece), now_s)
            pieces.append(piece)
            size += len(piece)
        return b"".join(pieces), None

    def _require_the_same_shoe(self) -> None:
        said = self.greeting.information
        if said is None:
            return
        if self._serial_number is None:
            self._serial_number = said.serial_number
            if self.greeting.takes_commands:
                self.log.add(ToldLate(self._clock(), said.serial_number))
        elif said.serial_number != self._serial_number:
            raise DeviceError(
                f"{self._name}: shoe {said.serial_number} answers where shoe {self._serial_number} was:"
                " bring that one back, or open again to go on with this one"
            )

    def _hand_on(self, samples: Samples, arrival_s: Array) -> None:
        block, events = self.assembler.take(samples, arrival_s)
        self.log.add(*events)
        self.inbox.put(block)

    def _valid(self, now_s: float) -> None:
        if self._is_away:
            self.log.add(Reconnected(now_s, now_s - self._valid_s, self._backoff.attempts))
        self._valid_s, self._is_away, self._is_silent = now_s, False, False
        self._openings = 0
        self._backoff.reset()

    def _watch(self, now_s: float) -> None:
        """React to silence: first an event, then a new start command, then reopening the port, finally an error."""
        silent_s = now_s - self._valid_s
        if silent_s > max(self._settings.silence_s, self._pause_s()) and not self._is_silent:
            self._is_silent = True
            self.log.add(Silence(now_s, silent_s))
            # The device may have rebooted and wait for the start command.
            self._say(hello(self._settings))
        self._give_up_in_time(now_s, "silent, though its port is open")
        if now_s - max(self._valid_s, self._opened_s) > self._patience_s():
            raise _LostError(f"no valid frame for {silent_s:.1f} s")

    def _pause_s(self) -> float:
        """Longest pause in s that is not yet silence, for a shoe that sends rarely."""
        rate_hz = self.assembler.rate_hz
        return 0.0 if rate_hz is None else PAUSE_SAMPLES / rate_hz

    def _patience_s(self) -> float:
        """How long in s an open port may be silent; longer each time, since Bluetooth may take seconds to connect."""
        return max(self._settings.reopen_s * 2.0 ** min(self._openings, MOST_DOUBLINGS), self._pause_s())

    def _give_up_in_time(self, now_s: float, reason: str) -> None:
        if now_s - self._valid_s > self._settings.give_up_s:
            raise DeviceTimeoutError(
                f"{self._name} sent no valid frame for {self._settings.give_up_s:g} s ({reason}):"
                " bring the shoe back and open it again, or give a longer give_up_s"
            )

    def _recover(self, reason: str) -> None:
        """Close the port fully and reopen it.

        Returns when it is open or the reader is closing; raises `DeviceTimeoutError` at the time limit.
        """
        self._let_go()
        if not self._is_away:
            self._is_away = True
            self.log.add(Disconnected(self._clock(), reason))
        while not self._closing.wait(self._backoff.next_wait_s()):
            self._give_up_in_time(self._clock(), reason)
            try:
                self._port = self._reopen_port()
            except DeviceError as error:
                reason = str(error)
                continue
            self.decoder.reset()
            self._opened_s = self._clock()
            self._openings += 1
            self._say(hello(self._settings))
            return

    def _say(self, command: bytes) -> None:
        if self._port is None or not self.greeting.takes_commands:
            return
        try:
            self._port.write(command)
        except DeviceError:
            return  # the next read, or the silence that follows, reveals a port that takes no bytes; both are handled

    def _let_go(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()


class _LostError(Exception):
    """The connection is lost or useless and must be re-established."""
