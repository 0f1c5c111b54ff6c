"""Frames on the wire: a payload with its checksum at the end, COBS-encoded, between two zeros."""

from __future__ import annotations

from cobs import cobs

from smartshoe.devices.wire._checksums import checksum


def framed(payload: bytes) -> bytes:
    """``payload`` (type first) with its checksum appended, COBS-encoded, followed by a zero."""
    return bytes(cobs.encode(payload + checksum(payload).to_bytes(2, "little"))) + b"\0"


def unframed(encoded: bytes) -> bytes | None:
    """The payload, from type to checksum, of the bytes between two zeros; None where they are not valid COBS."""
    try:
        return bytes(cobs.decode(encoded))
    except cobs.DecodeError:
        return None


def is_intact(payload: bytes) -> bool:
    """Whether the last two bytes of ``payload`` are the checksum of the bytes before them."""
    return len(payload) > 2 and checksum(payload[:-2]) == int.from_bytes(payload[-2:], "little")
