"""Packs a shoe's block into bytes for the journal and unpacks it, bit for bit."""

from __future__ import annotations

import struct

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices import Block
from smartshoe.errors import FormatError
from smartshoe.units import Unit

_HEAD = struct.Struct("<IHH")  # samples, units, flags
_HAS_HOST, _HAS_ARRIVAL = 1, 2


def packed(block: Block) -> bytes:
    """The block as bytes: counts and flags, then times, readings, mask of missing samples, host times if present."""
    flags = _HAS_HOST * (block.host_time_s is not None) | _HAS_ARRIVAL * (block.arrival_s is not None)
    parts = [_HEAD.pack(len(block), len(block.names), flags), _bytes(block.time_s), _bytes(block.readings)]
    parts.append(np.ascontiguousarray(block.missing, dtype=np.uint8).tobytes())
    parts += [_bytes(times) for times in (block.host_time_s, block.arrival_s) if times is not None]
    return b"".join(parts)


def _bytes(numbers: Array) -> bytes:
    return np.ascontiguousarray(numbers, dtype="<f8").tobytes()


def unpacked(payload: bytes, names: tuple[str, ...], unit: Unit) -> Block:
    """The block from which `packed` made ``payload``; raises `FormatError` if the sizes do not fit."""
    try:
        count, units, flags = _HEAD.unpack_from(payload)
    except struct.error as error:
        raise FormatError(f"a block of samples has {len(payload)} bytes only: the journal is no session's") from error
    times = 1 + bool(flags & _HAS_HOST) + bool(flags & _HAS_ARRIVAL)
    if units != len(names) or len(payload) != _HEAD.size + 8 * count * (times + units) + count * units:
        raise FormatError(
            f"a block of {count} samples of {units} units does not fit the stream's {len(names)} units:"
            " the journal is another session's"
        )
    at = _HEAD.size

    def taken(size: int) -> Array:
        nonlocal at
        found = np.frombuffer(payload, dtype="<f8", count=size, offset=at).astype(float)
        at += 8 * size
        return found

    time_s, readings = taken(count), taken(count * units).reshape(count, units)
    missing = np.frombuffer(payload, dtype=np.uint8, count=count * units, offset=at).reshape(count, units).astype(bool)
    at += count * units
    host_s = taken(count) if flags & _HAS_HOST else None
    arrival_s = taken(count) if flags & _HAS_ARRIVAL else None
    return Block(time_s, readings, missing, names, unit, host_s, arrival_s)
