"""Text lines, as most microcontroller sketches print them: ``t,toe,meta1,meta4,heel`` and common variants of it.

Lines carry no count and mostly no checksum, so that a digit changed on the way goes unnoticed. docs/wire.md explains
how a sketch adds an NMEA checksum (``*5A``), which is verified wherever it is present, and required of every line once
one had it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.devices.wire._line_clock import LineClock, ReadingLine, TimeUnit
from smartshoe.devices.wire.counters import Counters
from smartshoe.devices.wire.information import ChannelInformation, Information
from smartshoe.devices.wire.samples import CHANNELS, Samples
from smartshoe.errors import FormatError, UsageError
from smartshoe.units import COUNTS, Unit, find_unit, unit_of_suffix
from smartshoe.units import unit as unit_of

COLUMNS = ("t", *CHANNELS)
LONGEST_LINE = 1024
_TIME_NAMES = frozenset({"t", "time", "timestamp", "millis", "micros"})
_TIME_UNIT_OF_NAME: dict[str, TimeUnit] = {"millis": "ms", "micros": "us", "s": "s", "ms": "ms", "us": "us"}
_NO_READING = frozenset({"", "nan", "-", "na", "null", "ovf"})
_FULL_SCALE = 4095


@dataclass(frozen=True, slots=True)
class _Layout:
    """Which fields of a line are the time and the channels, and how many fields there are."""

    time: int
    channels: tuple[int, ...]
    fields: int


class LineDecoder:
    """Samples from text lines; how the bytes are divided into chunks does not matter.

    ``columns`` are the lines' columns: time (``t``, ``time``, ``millis`` or ``micros``), then one name per channel. A
    header line with these names, in any order, with or without units (``time_ms,toe_mbar,...``), takes precedence over
    ``columns``, ``time`` and ``unit``. ``time`` "auto" infers the unit from the first steps. ``unit`` is that of the
    readings, by default counts. Separators are tabs, semicolons, commas or blanks, whichever a line has. Comment lines
    (``#``) may state ``firmware``, ``serial`` and ``rate`` (``# serial: L-0042``).
    """

    def __init__(
        self,
        columns: Sequence[str] = COLUMNS,
        time: TimeUnit | Literal["auto"] = "auto",
        unit: Unit | str = COUNTS,
    ) -> None:
        self.counters = Counters()
        self.information: Information | None = None
        names = [name.strip() for name in columns]
        times = [place for place, name in enumerate(names) if _name_and_unit(name)[0] in _TIME_NAMES]
        if len(times) != 1 or len(names) < 2 or len(set(names)) != len(names) or not all(names):
            raise UsageError(
                f"columns are {','.join(columns)!r}: give one time (t, time, millis or micros) and different names"
                " of channels"
            )
        if isinstance(unit, str):
            unit = unit_of(unit) if unit else COUNTS
        self._names = tuple(name for place, name in enumerate(names) if place != times[0])
        self._unit = unit
        self._layout = _Layout(times[0], tuple(place for place in range(len(names)) if place != times[0]), len(names))
        named_time = _TIME_UNIT_OF_NAME.get(names[times[0]].casefold())
        self._clock = LineClock(self.counters, named_time if time == "auto" else time)
        self._rest = b""
        self._is_cut = False
        self._is_lost = False
        self._is_checksummed = False
        self._has_samples = False
        self._said: dict[str, str] = {}
        self._present = np.zeros(len(self._names))

    def reset(self) -> None:
        """Discard the incomplete line after a reconnection; counters and the known state of the stream are kept."""
        self._is_lost |= bool(self._rest)
        self._rest, self._is_cut = b"", False

    def feed(self, data: bytes) -> Samples:
        """The samples that ``data`` confirms, possibly none."""
        self.counters.bytes += len(data)
        data = self._rest + data
        *whole, rest = data.replace(b"\r", b"\n").split(b"\n")
        lines: list[ReadingLine] = []
        end = self.counters.bytes - len(data)
        for line in whole:
            end += len(line) + 1
            was_cut, self._is_cut = self._is_cut, False
            if was_cut or len(line) > LONGEST_LINE:
                self._blame()
            elif line:
                self._read(line, end, lines)
        self._is_cut |= len(rest) > LONGEST_LINE
        self._rest = rest[:1] if self._is_cut else rest
        return self._samples(lines)

    def _blame(self, is_checksum: bool = False) -> None:
        if is_checksum:
            self.counters.bad_crc += 1
        else:
            self.counters.malformed += 1
        self._is_lost = True

    def _read(self, line: bytes, end: int, lines: list[ReadingLine]) -> None:
        """Process one line ended at byte ``end``: reading (appended to ``lines`` once confirmed), header or other."""
        try:
            text = line.decode("utf-8").strip().lstrip("\ufeff\0")
        except UnicodeDecodeError:
            self._blame()
            return
        if not text:
            return
        if text.startswith("#"):
            self._take_comment(text[1:])
            return
        body, star, check = text.rpartition("*")
        if star:
            if not _is_checked(body, check):
                self._blame(is_checksum=True)
                return
            self._is_checksummed, text = True, body
        elif self._is_checksummed:
            self._blame()
            return
        fields = split_fields(text)
        sample = self._sample(fields, end)
        if sample is None:
            if self._take_header(fields):
                self.counters.information += 1
            else:
                self._blame()
            return
        self._has_samples = True
        if self._is_lost:
            self._is_lost = False
            self.counters.resynchronisations += 1
        lines.extend(self._clock.place(sample))

    def _sample(self, fields: list[str], end: int) -> ReadingLine | None:
        layout = self._layout
        if len(fields) == layout.fields + 1 and not fields[-1]:
            fields = fields[:-1]  # a sketch's loop prints a separator after every number
        if len(fields) != layout.fields:
            return None
        time = number(without_label(fields[layout.time]))
        if time is None or not math.isfinite(time):
            return None
        readings = []
        for place in layout.channels:
            field = without_label(fields[place])
            value = math.nan if field.casefold() in _NO_READING else number(field)
            if value is None or math.isinf(value):
                return None
            readings.append(value)
        return ReadingLine(time, tuple(readings), end=end)

    def _take_header(self, fields: list[str]) -> bool:
        """Whether the fields are a header with this decoder's columns, which then applies from here on."""
        if not fields[-1]:
            fields = fields[:-1]
        named = [_name_and_unit(field) for field in fields]
        places = {name.casefold(): place for place, (name, _) in enumerate(named)}
        times = [place for name, place in places.items() if name in _TIME_NAMES]
        wanted = [_name_and_unit(name)[0].casefold() for name in self._names]
        if len(times) != 1 or any(name not in places for name in wanted):
            return False
        channels = tuple(places[name] for name in wanted)
        units = {found for place in channels if (found := named[place][1]) is not None}
        unit = units.pop() if len(units) == 1 else self._unit
        if self._has_samples and unit != self._unit:
            return False  # readings before and after could not be in one block
        self._unit, self._layout = unit, _Layout(times[0], channels, len(fields))
        time_unit = named[times[0]][1]
        name = time_unit.symbol if time_unit is not None else named[times[0]][0].casefold()
        if name in _TIME_UNIT_OF_NAME:
            self._clock.use(_TIME_UNIT_OF_NAME[name])
        return True

    def _take_comment(self, text: str) -> None:
        self.counters.information += 1
        key, colon, value = text.partition(":")
        if not colon:
            return
        self._said[key.strip().casefold()] = value.strip()
        rate = number(self._said.get("rate", "").casefold().removesuffix("hz"))
        if "serial" not in self._said or rate is None:
            return
        low, high = (0.0, float(_FULL_SCALE))
        channels = tuple(ChannelInformation(name, self._unit.symbol, low, high) for name in self._names)
        try:
            self.information = Information(self._said.get("firmware", "?"), self._said["serial"], rate, channels)
        except FormatError:
            return  # a comment that is not valid information remains a comment

    def _samples(self, lines: list[ReadingLine]) -> Samples:
        if not lines:
            return Samples.empty(self._names, self._unit)
        values = np.array([line.readings for line in lines])
        missing = np.isnan(values)
        for row in np.flatnonzero(missing.any(axis=1)):
            values[row] = np.where(missing[row], values[row - 1] if row else self._present, values[row])
        self._present = values[-1].copy()
        first = self.counters.frames - len(lines)
        return Samples(
            np.arange(first, self.counters.frames, dtype=np.int64),
            np.array([line.time for line in lines]),
            values,
            missing,
            self._names,
            self._unit,
            np.array([line.boot for line in lines], dtype=np.int64),
            np.array([line.end for line in lines], dtype=np.int64),
        )


def number(text: str) -> float | None:
    """The number in ``text``, or None (also for ``1_0`` and ``infinity``)."""
    plain = text.strip()
    if not plain or not set(plain) <= _OF_NUMBERS:
        return None
    try:
        return float(plain)
    except ValueError:
        return None


_OF_NUMBERS = frozenset("0123456789+-.eE")


def without_label(field: str) -> str:
    """A field without the label of Arduino's serial plotter: ``12.3`` for ``toe:12.3``."""
    label, colon, value = field.partition(":")
    return value.strip() if colon and label.strip().isidentifier() else field


def split_fields(text: str) -> list[str]:
    """A line's fields, separated by tabs or semicolons (commas are then decimal marks), else commas, else blanks.

    A line that ends in a separator has an empty last field.
    """
    for separator in ("\t", ";"):
        if separator in text:
            return [field.strip().replace(",", ".") for field in text.split(separator)]
    if "," in text:
        return [field.strip() for field in text.split(",")]
    return text.split()


def _name_and_unit(text: str) -> tuple[str, Unit | None]:
    """``toe_mbar``, ``toe [mbar]`` or ``toe (mbar)`` split into name and unit."""
    plain = text.strip()
    if plain.endswith(("]", ")")):
        name, _, inside = plain.replace("(", "[").partition("[")
        return name.strip(), find_unit(inside[:-1])
    name, underscore, suffix = plain.rpartition("_")
    found = unit_of_suffix(suffix) if underscore else None
    return (name, found) if found is not None else (plain, None)


def _is_checked(body: str, check: str) -> bool:
    """Whether ``check`` is the NMEA checksum of ``body``: two hexadecimal digits of all its bytes XORed."""
    return len(check) == 2 and check.upper() == f"{line_checksum(body):02X}"


def line_checksum(body: str) -> int:
    """The XOR of all bytes of ``body``, as in NMEA 0183."""
    total = 0
    for byte in body.encode("utf-8"):
        total ^= byte
    return total


def encode_lines(
    time: ArrayLike, readings: ArrayLike, separator: str = ",", decimals: int = 3, is_checksummed: bool = False
) -> bytes:
    """Lines of ``time`` (n,), in any unit, and ``readings`` (n, channels); NaN becomes an empty field."""
    values = np.atleast_2d(np.asarray(readings, dtype=np.float64))
    lines = []
    for moment, row in zip(np.atleast_1d(np.asarray(time)).tolist(), values.tolist(), strict=True):
        fields = ["" if math.isnan(value) else _written(value, decimals) for value in row]
        text = separator.join([_written(moment, 6), *fields])
        lines.append(f"{text}*{line_checksum(text):02X}" if is_checksummed else text)
    return "".join(f"{line}\n" for line in lines).encode("ascii")


def _written(value: float, decimals: int) -> str:
    if value == int(value):
        return str(int(value))
    return f"{value:.{decimals}f}"


def encode_header(names: Iterable[str] = COLUMNS, separator: str = ",") -> bytes:
    """The header line with these column ``names``, including the newline."""
    return (separator.join(names) + "\n").encode("ascii")
