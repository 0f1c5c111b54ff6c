"""The information that a device gives about itself, and its text in the information frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.devices.wire.samples import Samples
from smartshoe.errors import FormatError
from smartshoe.units import COUNTS, declared, find_unit

PROTOCOL = 1
MOST_COUNTS = 0xFFFE  # 0xFFFF means that there is no reading
LONGEST_TEXT = 480


@dataclass(frozen=True, slots=True)
class ChannelInformation:
    """A channel: 0 counts are ``low``, full scale is ``high``, both in ``unit``."""

    name: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Information:
    """The device's identity and the scales of its channels; ``full_scale_counts`` is at most 65534."""

    firmware: str
    serial_number: str
    rate_hz: float
    channels: tuple[ChannelInformation, ...]
    full_scale_counts: int = 4095

    def __post_init__(self) -> None:
        wrong = _what_is_wrong(self)
        if wrong:
            raise FormatError(f"information of device {self.serial_number!r}: {wrong}")

    @property
    def names(self) -> tuple[str, ...]:
        """The channels' names, in the order of the readings."""
        return tuple(channel.name for channel in self.channels)

    def to_text(self) -> str:
        """The information frame's text: printable ASCII, ``key=value`` pairs separated by semicolons."""
        channels = ",".join(f"{c.name}:{c.unit}:{_short(c.low)}:{_short(c.high)}" for c in self.channels)
        return (
            f"protocol={PROTOCOL};firmware={self.firmware};serial={self.serial_number};"
            f"rate_hz={_short(self.rate_hz)};full_scale={self.full_scale_counts};channels={channels}"
        )

    @classmethod
    def from_text(cls, text: str) -> Information:
        """Parse the text of `to_text`, ignoring unknown keys; raises `FormatError` for any other text."""
        fields = dict(part.split("=", 1) for part in text.split(";") if "=" in part)
        try:
            if int(fields["protocol"]) != PROTOCOL:
                raise FormatError(
                    f"the device speaks protocol {fields['protocol']}, this program {PROTOCOL}: update the older one"
                )
            channels = []
            for part in fields["channels"].split(","):
                name, unit, low, high = part.split(":")
                channels.append(ChannelInformation(name, unit, float(low), float(high)))
            return cls(
                fields["firmware"],
                fields["serial"],
                float(fields["rate_hz"]),
                tuple(channels),
                int(fields["full_scale"]),
            )
        except KeyError as error:
            raise FormatError(f"information frame without {error}: see docs/wire.md") from error
        except ValueError as error:
            if isinstance(error, FormatError):
                raise
            raise FormatError(f"information frame with a value that is none ({error}): see docs/wire.md") from error

    def scale(self, samples: Samples) -> Samples:
        """``samples`` converted from counts to the channels' unit; samples in another unit are returned unchanged.

        Channels of one quantity are all converted to the first one's unit; where quantities differ, counts stay counts.
        """
        if samples.unit != COUNTS or samples.readings.shape[1] != len(self.channels):
            return samples
        units = [find_unit(channel.unit) or declared(channel.unit) for channel in self.channels]
        first = units[0]
        if first == COUNTS or any(unit.quantity != first.quantity for unit in units):
            return replace(samples, names=self.names)
        if first.quantity == "unknown" and any(unit != first for unit in units):
            return replace(samples, names=self.names)
        low = np.array([float(unit.convert(c.low, first)) for unit, c in zip(units, self.channels, strict=True)])
        high = np.array([float(unit.convert(c.high, first)) for unit, c in zip(units, self.channels, strict=True)])
        readings = low + samples.readings * ((high - low) / self.full_scale_counts)
        return replace(samples, readings=readings, names=self.names, unit=first)


def _short(value: float) -> str:
    """The shortest text that reads back as ``value``."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _what_is_wrong(information: Information) -> str:
    words = {"firmware": information.firmware, "serial number": information.serial_number}
    for channel in information.channels:
        words[f"name of channel {channel.name!r}"] = channel.name
        words[f"unit of channel {channel.name!r}"] = channel.unit
        if not (math.isfinite(channel.low) and math.isfinite(channel.high) and channel.low < channel.high):
            return f"range {channel.low:g} to {channel.high:g} of channel {channel.name!r} does not rise"
    for what, word in words.items():
        if not word or not word.isascii() or not word.isprintable() or set(word) & set(";=,:"):
            return f"{what} must be printable ASCII without ; = , :"
    if not information.channels or len(set(information.names)) != len(information.channels):
        return "channels must have different names, and be at least one"
    if not 1 <= information.full_scale_counts <= MOST_COUNTS:
        return f"full scale of {information.full_scale_counts} counts is not from 1 to {MOST_COUNTS}"
    if not (math.isfinite(information.rate_hz) and information.rate_hz > 0):
        return f"rate of {information.rate_hz:g} Hz is not above 0"
    if len(information.to_text()) > LONGEST_TEXT:
        return f"its text is longer than {LONGEST_TEXT} characters: give shorter names"
    return ""
