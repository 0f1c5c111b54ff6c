"""The options of a ``serial:`` address, checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from smartshoe.errors import UsageError
from smartshoe.recording import REGIONS
from smartshoe.units import find_unit

Format = Literal["auto", "frames", "lines"]
TimeUnit = Literal["auto", "s", "ms", "us"]
Side = Literal["", "left", "right"]

# Half a turn of the device's 32-bit microsecond counter (71.6 min): its time would be ambiguous after a longer silence.
LONGEST_SILENCE_S = 2100.0


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """How a shoe at a serial port communicates, and how long its silence is tolerated.

    ``columns`` and ``time`` describe text lines; ``unit`` is that of the readings (text lines) or the one to convert to
    (frames), empty for the device's own. ``rate`` in Hz is requested from a device that takes commands, and is assumed
    until the device states its own; 0 leaves it unchanged. ``wait_s`` is how long the first valid frame may take,
    ``silence_s`` when silence becomes an event, ``reopen_s`` when a silent port is closed and reopened (doubled after
    each attempt, up to eight times), ``give_up_s`` when the stream ends with an error. ``buffer`` is how many unread
    samples are stored.
    """

    baud: int = 115200
    format: Format = "auto"
    columns: tuple[str, ...] = ("t", *REGIONS)
    time: TimeUnit = "auto"
    unit: str = ""
    side: Side = ""
    rate: float = 0.0
    wait_s: float = 8.0
    silence_s: float = 0.5
    reopen_s: float = 3.0
    give_up_s: float = 30.0
    buffer: int = 200_000


def _columns(text: Any) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (text.split(",") if isinstance(text, str) else text))
    if not all(names) or len(set(names)) != len(names) or len(names) < 2:
        raise ValueError
    return names


def _unit(text: Any) -> str:
    found = find_unit(str(text))
    if found is None:
        raise ValueError
    return found.symbol


def _choice(choices: tuple[str, ...]) -> Callable[[Any], str]:
    def pick(text: Any) -> str:
        if text not in choices:
            raise ValueError
        return str(text)

    return pick


def _number(low: float, high: float, kind: type[int] | type[float] = float) -> Callable[[Any], float]:
    def parse(text: Any) -> float:
        value = kind(text)
        if not low <= value <= high:
            raise ValueError
        return value

    return parse


_OPTIONS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "baud": (_number(50, 12_000_000, int), "a whole number such as 115200"),
    "format": (_choice(get_args(Format)), "auto, frames or lines"),
    "columns": (_columns, "different names with commas between, such as t,toe,meta1,meta4,heel"),
    "time": (_choice(get_args(TimeUnit)), "auto, s, ms or us"),
    "unit": (_unit, "a unit such as mbar, V or counts"),
    "side": (_choice(("left", "right")), "left or right"),
    "rate": (_number(0.1, 10_000), "a rate in Hz from 0.1 to 10000"),
    "wait_s": (_number(0.1, 600), "seconds from 0.1 to 600"),
    "silence_s": (_number(0.05, 600), "seconds from 0.05 to 600"),
    "reopen_s": (_number(0.1, 600), "seconds from 0.1 to 600"),
    "give_up_s": (_number(0.1, LONGEST_SILENCE_S), f"seconds from 0.1 to {LONGEST_SILENCE_S:g}"),
    "buffer": (_number(10, 100_000_000, int), "a number of samples from 10"),
}


def settings_from(target: str, options: Mapping[str, Any]) -> SerialSettings:
    """Settings from an address's options; raises `UsageError` for the first one that is unknown or out of bounds."""
    checked: dict[str, Any] = {}
    for key, value in options.items():
        if key not in _OPTIONS:
            raise UsageError(f"serial:{target} has no option {key!r}; use {', '.join(_OPTIONS)}")
        parse, wanted = _OPTIONS[key]
        try:
            checked[key] = parse(value)
        except (TypeError, ValueError) as error:
            raise UsageError(f"serial:{target}: {key} is {value!r}; give {wanted}") from error
    return SerialSettings(**checked)
