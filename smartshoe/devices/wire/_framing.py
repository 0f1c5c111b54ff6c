"""A payload between two zeros: COBS around it, its checksum at its end."""

from __future__ import annotations

from cobs import cobs

from smartshoe.devices.wire._checksums import checksum


def framed(payload: bytes) -> bytes:
    """``payload`` (type first) with its checksum, COBS around it and a zero behind."""
    return bytes(cobs.encode(payload + checksum(payload).to_bytes(2, "little"))) + b"\0"


def unframed(encoded: bytes) -> bytes | None:
    """COBS undone of what stood between two zeros: type to checksum, None where it is no COBS."""
    try:
        return bytes(cobs.decode(encoded))
    except cobs.DecodeError:
        return None


def is_intact(payload: bytes) -> bool:
    """Whether ``payload``'s last two bytes are the checksum of those before."""
    return len(payload) > 2 and checksum(payload[:-2]) == int.from_bytes(payload[-2:], "little")
