"""Commands from the host to a device: start, stop, set the rate, send information."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from smartshoe.devices.wire._framing import framed, is_intact, unframed
from smartshoe.errors import UsageError

CommandKind = Literal["start", "stop", "rate", "information"]
_TYPES: dict[CommandKind, int] = {"start": 0x81, "stop": 0x82, "rate": 0x83, "information": 0x84}
_KINDS = {number: kind for kind, number in _TYPES.items()}
_LONGEST = 8  # bytes of an encoded command
MOST_MILLIHERTZ = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Command:
    """A command; ``rate_hz`` is used by kind "rate" only and sent in whole millihertz."""

    kind: CommandKind
    rate_hz: float | None = None

    def __post_init__(self) -> None:
        if (self.rate_hz is not None) != (self.kind == "rate"):
            raise UsageError(
                f"command {self.kind!r} with rate_hz={self.rate_hz}: a rate goes with kind 'rate', and only there"
            )
        if self.rate_hz is not None and not 1 <= self.rate_hz * 1000.0 <= MOST_MILLIHERTZ:
            raise UsageError(f"rate of {self.rate_hz:g} Hz cannot be sent: give 0.001 to {MOST_MILLIHERTZ / 1000:g} Hz")


def encode_command(command: Command) -> bytes:
    """The command's frame, preceded by a zero, which ends any partial frame that the device has received."""
    payload = bytes([_TYPES[command.kind]])
    if command.rate_hz is not None:
        payload += round(command.rate_hz * 1000.0).to_bytes(4, "little")
    return b"\0" + framed(payload)


class CommandDecoder:
    """The device's side: finds commands in chunks of bytes and skips everything else."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Command]:
        """The commands that are completed by ``data``."""
        *gaps, rest = (self._rest + data).split(b"\0")
        self._rest = rest[-_LONGEST - 1 :]
        return [command for gap in gaps if gap and (command := _command_of(gap)) is not None]


def _command_of(gap: bytes) -> Command | None:
    payload = unframed(gap)
    if payload is None or not is_intact(payload):
        return None
    kind, rest = _KINDS.get(payload[0]), payload[1:-2]
    if kind is None or len(rest) != (4 if kind == "rate" else 0):
        return None
    if kind != "rate":
        return Command(kind)
    millihertz = int.from_bytes(rest, "little")
    return Command(kind, millihertz / 1000.0) if millihertz else None
