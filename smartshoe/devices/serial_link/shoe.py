"""`SerialShoe`: a real shoe at a serial port, over Bluetooth's RFCOMM or USB."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.devices._base import Block, ChannelDescription, Shoe
from smartshoe.devices._events import Dropped, ShoeEvent
from smartshoe.devices.serial_link._settings import SerialSettings, settings_from
from smartshoe.devices.serial_link.reconnect import Backoff
from smartshoe.errors import DeviceError, DeviceTimeoutError, UsageError
from smartshoe.recording import REGIONS
from smartshoe.units import COUNTS, MILLIBAR, Unit, declared, find_unit

if TYPE_CHECKING:
    from smartshoe.devices.serial_link._assembly import Assembler
    from smartshoe.devices.serial_link._greeting import Greeting
    from smartshoe.devices.serial_link._port import Port
    from smartshoe.devices.serial_link._reader import SerialReader
    from smartshoe.devices.wire.clock import DeviceClock
    from smartshoe.devices.wire.counters import Counters
    from smartshoe.devices.wire.information import Information

EXPECTED_RATE_HZ = 200.0  # Chinimilli 2016, Section II
SIDES = ("left", "right")


class SerialShoe(Shoe):
    """The shoe at port ``target`` (``/dev/rfcomm0``, ``/dev/ttyUSB0``, ``COM5``).

    A thread reads while the shoe is open. `blocks` yields everything received since the last block, each sample once,
    in order, on the device's own clock, and an empty block for each half second of silence. A lost connection is
    re-established and reported in `events`; only ``give_up_s`` without one valid frame ends `blocks`, with
    `DeviceTimeoutError`. `close`, from any thread, ends it at once. Unread samples wait in a bounded buffer; the oldest
    are dropped first, with an event.
    """

    def __init__(
        self,
        target: str,
        settings: SerialSettings | None = None,
        *,
        open_port: Callable[[str, int], Port] | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        super().__init__()
        self.target = target
        self.settings = settings or SerialSettings()
        self._open_port = open_port
        self._clock = clock
        self._reader: SerialReader | None = None

    def __str__(self) -> str:
        return f"shoe serial://{self.target}"

    @property
    def information(self) -> Information | None:
        """What the device reported about itself when last opened; None before that, and for text lines."""
        return None if self._reader is None else self._reader.greeting.information

    @property
    def counters(self) -> Counters | None:
        """Counts of frames seen, damaged, lost and so on since the last opening; None before."""
        return None if self._reader is None else self._reader.decoder.counters

    @property
    def device_clock(self) -> DeviceClock | None:
        """The device's clock against the host's, as fitted so far; None before the first opening."""
        return None if self._reader is None else self._reader.assembler.clock

    @property
    def events(self) -> tuple[ShoeEvent, ...]:
        """Events of the stream since it was last opened, oldest first."""
        if self._reader is None:
            return ()
        self._note_drops(self._reader)
        return self._reader.log.all()

    @property
    def sample_rate_hz(self) -> float:
        """The rate that the device states, else the one its time steps show, else the one asked for, else 200 Hz."""
        said = self.information
        if said is not None and said.rate_hz > 0:
            return float(said.rate_hz)
        if self._reader is not None and self._reader.assembler.rate_hz is not None:
            return self._reader.assembler.rate_hz
        return self.settings.rate or EXPECTED_RATE_HZ

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The device's channels; before the first opening those that the address states."""
        if self._reader is None:
            columns = _columns_of(self.settings) if self.settings.format == "lines" else REGIONS
            unit = find_unit(self.settings.unit) or MILLIBAR
            return tuple(
                ChannelDescription(self._named(name), unit.quantity, unit, rate_hz=self.sample_rate_hz)
                for name in columns
            )
        assembler = self._reader.assembler
        # Text lines state their unit, but not their range.
        said = self.information if self._reader.greeting.takes_commands else None
        described = []
        for column, name in enumerate(assembler.names):
            range_, step = None, None
            if said is not None and assembler.unit != COUNTS:
                channel = said.channels[column]
                source = _unit(channel.unit)
                low, high = (float(v) for v in source.convert([channel.low, channel.high], assembler.unit))
                range_, step = (low, high), (high - low) / said.full_scale_counts
            described.append(
                ChannelDescription(name, assembler.unit.quantity, assembler.unit, range_, step, self.sample_rate_hz)
            )
        return tuple(described)

    def _named(self, name: str) -> str:
        if not self.settings.side or name.split("_")[0] in SIDES:
            return name
        return f"{self.settings.side}_{name}"

    def _port(self) -> Port:
        if self._open_port is not None:
            return self._open_port(self.target, self.settings.baud)
        from smartshoe.devices.serial_link._port import SerialPort

        return SerialPort(self.target, self.settings.baud)

    def _open_internal(self) -> None:
        from smartshoe.devices.serial_link._assembly import Assembler
        from smartshoe.devices.serial_link._reader import SerialReader

        port, greeting = self._greeted(self._port(), self._clock() + self.settings.wait_s)
        try:
            assembler = Assembler(
                greeting.first[0][0],
                greeting.information,
                find_unit(self.settings.unit),
                self._named,
                counts_samples=greeting.takes_commands,
                apart=_in_a_thread,
            )
            self._require_convertible(assembler)
            self._reader = SerialReader(str(self), port, self._port, greeting, assembler, self.settings, self._clock)
        except BaseException:
            port.close()
            raise
        self._reader.start()

    def _greeted(self, port: Port, until_s: float) -> tuple[Port, Greeting]:
        """A port and the shoe's greeting over it; a broken connection is re-established until ``until_s``."""
        from smartshoe.devices.serial_link._greeting import greet

        backoff = Backoff()
        while True:
            try:
                return port, greet(str(self), port, self.settings, self._clock, until_s)
            except DeviceTimeoutError:
                port.close()
                raise
            except DeviceError:
                port.close()
                port = self._port_again(backoff, until_s)
            except BaseException:
                port.close()
                raise

    def _port_again(self, backoff: Backoff, until_s: float) -> Port:
        while True:
            time.sleep(backoff.next_wait_s())
            try:
                return self._port()
            except DeviceError:
                if self._clock() > until_s:
                    raise

    def _require_convertible(self, assembler: Assembler) -> None:
        if assembler.unit.quantity != assembler.comes_in.quantity:
            raise DeviceError(
                f"{self} sends {assembler.comes_in.symbol} and does not say how to make {assembler.unit.symbol} of it:"
                " leave unit out of its address"
            )

    def _close_internal(self) -> None:
        if self._reader is not None:
            self._reader.close()

    def _blocks_internal(self) -> Iterator[Block]:
        from smartshoe.devices.serial_link.inbox import joined

        reader = self._reader
        while reader is not None:
            taken = reader.inbox.take(self.settings.silence_s)
            self._note_drops(reader)
            if taken is None:
                return
            yield joined(taken) if taken else _empty(reader)

    def _note_drops(self, reader: SerialReader) -> None:
        dropped = reader.inbox.take_dropped()
        if dropped is not None:
            reader.log.add(Dropped(self._clock(), *dropped))


def _in_a_thread(work: Callable[[], None]) -> None:
    """Run ``work`` in a thread, so that the port continues to be read."""
    threading.Thread(target=work, name="law of delays", daemon=True).start()


def _columns_of(settings: SerialSettings) -> tuple[str, ...]:
    """The units among the columns of text lines; raises `UsageError` where none of the columns is the time."""
    from smartshoe.devices.serial_link._greeting import decoder_for

    return decoder_for("lines", settings).feed(b"").names


def _unit(symbol: str) -> Unit:
    return find_unit(symbol) or declared(symbol)


def _empty(reader: SerialReader) -> Block:
    names = reader.assembler.names
    none = np.zeros(0)
    return Block(
        none, np.zeros((0, len(names))), np.zeros((0, len(names)), dtype=bool), names, reader.assembler.unit, none, none
    )


class _SerialProvider:
    """Provider of ``serial:///dev/rfcomm0?baud=115200&format=auto&side=left``; see `SerialSettings` for the options."""

    def open_shoe(
        self, target: str, options: Mapping[str, Any] | None = None, rng: np.random.Generator | None = None
    ) -> SerialShoe:
        """The shoe at port ``target``, not yet opened; ``rng`` is not used."""
        if not target:
            raise UsageError("serial: has no port: write it like serial:///dev/rfcomm0 or serial://COM5")
        settings = settings_from(target, options or {})
        if settings.format != "frames":
            _columns_of(settings)  # raises where no column is the time
        return SerialShoe(target, settings)


provider = _SerialProvider()
