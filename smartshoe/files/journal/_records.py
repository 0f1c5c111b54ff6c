"""The journal's records: marker, kind, length, CRC-32, payload; all numbers little-endian.

====== ======= ==============================================================
offset type    meaning
====== ======= ==============================================================
0      2 bytes marker ``A5 5A``
2      u8      kind, the writer's own
3      u8      0
4      u32     length of the payload
8      u32     CRC-32 (zlib) of bytes 2 to 7 and the payload
12     bytes   payload
====== ======= ==============================================================

A file begins with the eight bytes of `OPENING`. A marker after damage is where reading goes on.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

OPENING = b"\x89SSJ1\r\n\x1a"
MARKER = b"\xa5\x5a"
_HEAD = struct.Struct("<2sBBII")
LONGEST_PAYLOAD = 1 << 28


@dataclass(frozen=True, slots=True)
class Record:
    """A record as appended; ``end`` is the position of the byte after it in its file."""

    kind: int
    payload: bytes
    end: int


def packed(kind: int, payload: bytes) -> bytes:
    """The record's encoded bytes."""
    checked = struct.pack("<BBI", kind, 0, len(payload))
    return _HEAD.pack(MARKER, kind, 0, len(payload), zlib.crc32(payload, zlib.crc32(checked))) + payload


def record_at(data: bytes | memoryview, start: int) -> Record | None:
    """The complete, intact record that begins at byte ``start``, or None."""
    if len(data) - start < _HEAD.size:
        return None
    marker, kind, zero, length, crc = _HEAD.unpack_from(data, start)
    body = start + _HEAD.size
    if marker != MARKER or zero != 0 or length > LONGEST_PAYLOAD or body + length > len(data):
        return None
    payload = bytes(data[body : body + length])
    if zlib.crc32(payload, zlib.crc32(bytes(data[start + 2 : start + 8]))) != crc:
        return None
    return Record(kind, payload, body + length)


def scan(data: bytes) -> tuple[list[Record], list[tuple[int, int]]]:
    """Every intact record of a journal's bytes, and the spans (start, stop) between them that hold none."""
    records: list[Record] = []
    damage: list[tuple[int, int]] = []
    at = len(OPENING)
    while at < len(data):
        found = record_at(data, at)
        if found is not None:
            records.append(found)
            at = found.end
            continue
        start = at
        while found is None:
            at = data.find(MARKER, at + 1)
            if at < 0:
                damage.append((start, len(data)))
                return records, damage
            found = record_at(data, at)
        damage.append((start, at))
    return records, damage
