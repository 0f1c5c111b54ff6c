"""The hardware interface: abstract Sensor, Bladder, Shoe and TestMachine, with their lifecycle, channels and limits.

A backend writes the small ``_..._internal`` methods; the public ones own the lifecycle and the checks. Four kinds of
backend have distinct names: simulated (has physics), replayed (plays a file back through the same calls), logged (reads
a machine's own log files) and real.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.devices._events import ShoeEvent
from smartshoe.errors import DeviceError, LimitError
from smartshoe.protocol import MachineLimits, Protocol
from smartshoe.recording import Channel, Recording
from smartshoe.units import Unit

if TYPE_CHECKING:
    from smartshoe.devices.wire.clock import DeviceClock


@dataclass(frozen=True, slots=True)
class ChannelDescription:
    """What a channel of a device measures: ``range_`` and ``resolution`` are in ``unit``, None where not known."""

    name: str
    quantity: str
    unit: Unit
    range_: tuple[float, float] | None = None
    resolution: float | None = None
    rate_hz: float | None = None


@dataclass(frozen=True, eq=False)
class Block:
    """Consecutive samples of a shoe: ``time_s`` (n,), ``readings`` (n, units) in ``unit``, mask ``missing`` (n, units).

    ``time_s`` is the device's own time. A live shoe adds two times on the host's monotonic clock (`time.perf_counter`),
    both (n,): ``arrival_s``, when the bytes arrived, and ``host_time_s``, the device's time converted by the fitted
    clock.
    """

    time_s: Array
    readings: Array
    missing: Mask
    names: tuple[str, ...]
    unit: Unit
    host_time_s: Array | None = None
    arrival_s: Array | None = None

    def __len__(self) -> int:
        return int(self.time_s.size)


class Device(ABC):
    """A device that is opened and closed, also as a context manager; ``describe`` works whether it is open or not.

    Opening twice and using a closed device raise `DeviceError`; closing twice does nothing.
    """

    def __init__(self) -> None:
        self._is_open = False

    @property
    def is_open(self) -> bool:
        """Whether the device is open."""
        return self._is_open

    def open(self) -> Self:
        """Open the device; raises `DeviceError` where that fails or the device is already open."""
        if self._is_open:
            raise DeviceError(f"{self} is open already: close it first")
        self._open_internal()
        self._is_open = True
        return self

    def close(self) -> None:
        """Close the device and release its resources; does nothing if it is closed."""
        if self._is_open:
            self._is_open = False
            self._close_internal()

    def __enter__(self) -> Self:
        return self if self._is_open else self.open()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_open(self) -> None:
        if not self._is_open:
            raise DeviceError(f"{self} is not open: use it in a with block or call open() first")

    def _open_internal(self) -> None:  # noqa: B027  most backends hold nothing
        """Acquire what the device needs (ports, files, threads)."""

    def _close_internal(self) -> None:  # noqa: B027
        """Release what `_open_internal` acquired."""

    @abstractmethod
    def describe(self) -> tuple[ChannelDescription, ...]:
        """The device's channels, each with quantity, unit, range, resolution and rate."""


class Bladder(ABC):
    """An air bladder: load in, gauge pressure out. It remembers its past loads."""

    @abstractmethod
    def reset(self) -> None:
        """Return to rest: unloaded, in steady state, without memory of past loads."""

    @abstractmethod
    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa under the load (n,) in N, both at ``sample_rate_hz``.

        Continues from the last call.
        """


class Sensor(ABC):
    """A gauge pressure sensor: reading from pressure, and pressure from reading by the nominal characteristic."""

    @abstractmethod
    def describe(self) -> ChannelDescription:
        """The reading's quantity, unit, range and resolution."""

    @property
    @abstractmethod
    def range_pa(self) -> tuple[float, float]:
        """Lowest and highest pressure in Pa that the sensor measures."""

    @property
    @abstractmethod
    def proof_pressure_pa(self) -> float:
        """The highest pressure in Pa that does not damage the sensor."""

    @abstractmethod
    def reset(self) -> None:
        """Return the sensor to its initial state, as if it had not been read before."""

    @abstractmethod
    def read(self, pressure_pa: Array, sample_rate_hz: float) -> Array:
        """The reading (n,) in volt for the pressure (n,) in Pa."""

    @abstractmethod
    def to_pressure_pa(self, reading_v: Array) -> Array:
        """Pressure (n,) in Pa by the nominal characteristic, from the reading (n,) in volt."""


class Shoe(Device):
    """A stream of readings of a shoe's units."""

    @abstractmethod
    def _blocks_internal(self) -> Iterator[Block]:
        """Yield blocks of samples until the stream ends."""

    def blocks(self) -> Iterator[Block]:
        """Blocks of samples in order of time, until the stream ends; raises `DeviceError` where the shoe is not open.

        A live shoe that is silent yields an empty block now and then, so that the caller never blocks for long.
        """
        self._require_open()
        yield from self._blocks_internal()

    @property
    def events(self) -> tuple[ShoeEvent, ...]:
        """Events of the stream since it was opened (gaps, reconnections, dropped samples), oldest first."""
        return ()

    @property
    def device_clock(self) -> DeviceClock | None:
        """The device's clock against the host's as fitted so far; None where the stream has no clock of its own."""
        return None

    @property
    @abstractmethod
    def sample_rate_hz(self) -> float:
        """Nominal sampling rate of the readings."""

    def record(self, duration_s: float | None = None, name: str = "trial") -> Recording:
        """The whole stream, or its first ``duration_s``, as one recording; raises where no sample arrives."""
        blocks: list[Block] = []
        start: float | None = None
        for block in self.blocks():
            if not len(block):
                continue
            start = float(block.time_s[0]) if start is None else start
            blocks.append(block)
            if duration_s is not None and block.time_s[-1] - start >= duration_s:
                break
        if not blocks or start is None:
            raise DeviceError(f"{self} sent no samples")
        time_s = np.concatenate([block.time_s for block in blocks])
        readings = np.concatenate([np.where(b.missing, np.nan, b.readings) for b in blocks])
        channels = {
            unit_name: Channel.from_values(unit_name, readings[:, column], blocks[0].unit, "sensor")
            for column, unit_name in enumerate(blocks[0].names)
        }
        whole = Recording(time_s, channels, name=name, source=str(self))
        return whole if duration_s is None else whole.between(start, start + duration_s)


class TestMachine(Device):
    """A machine that presses one sensing unit and logs load and reading."""

    __test__ = False  # tells pytest that this is not a test class, despite its name

    @property
    @abstractmethod
    def limits(self) -> MachineLimits:
        """The largest loads and rates that the machine and the sensor under it withstand."""

    def check(self, protocol: Protocol) -> None:
        """Raise `LimitError` where ``protocol`` exceeds the limits; nothing moves."""
        try:
            protocol.check(self.limits)
            self._check_internal(protocol)
        except LimitError as error:
            raise LimitError(f"{self}: {error}") from error

    def _check_internal(self, protocol: Protocol) -> None:
        """Further checks of a backend; raises where ``protocol`` cannot be run."""

    @abstractmethod
    def _run_internal(self, protocol: Protocol) -> Recording:
        """Run the protocol and return its recording."""

    def run(self, protocol: Protocol) -> Recording:
        """Check and run the protocol; returns load, command and reading on one time base."""
        self._require_open()
        self.check(protocol)
        return self._run_internal(protocol)

    @property
    def logs(self) -> tuple[Recording, ...]:
        """The instruments' separate logs of the last run, before they were joined."""
        return ()

    @property
    def is_instant(self) -> bool:
        """Whether ``run`` takes no real time, as for a machine on a virtual clock."""
        return False

    def under(self, shoe: Shoe, unit: str) -> None:
        """Tell the machine that ``unit`` of ``shoe`` lies on the anvil; only a simulated machine needs to know."""
