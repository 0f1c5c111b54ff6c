"""CRC-16/CCITT-FALSE of many frames of one length at once."""

from __future__ import annotations

import binascii
from functools import cache

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

FEW = 2000  # frames: up to so many, one look-up of all their bytes fits the cache and is faster


def checksum(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, nothing reflected; 0x29B1 for ``123456789``."""
    return binascii.crc_hqx(data, 0xFFFF)


@cache
def _tables(length: int) -> tuple[int, NDArray[np.uint16]]:
    """The checksum of ``length`` zero bytes, and the contribution (length, 256) of each value of each byte to it."""
    base = checksum(bytes(length))
    tables = np.empty((length, 256), dtype=np.uint16)
    for position in range(length):
        data = bytearray(length)
        for value in range(256):
            data[position] = value
            tables[position, value] = checksum(bytes(data)) ^ base
    return base, tables


def checksums(columns: Bytes) -> NDArray[np.uint16]:
    """Checksums (n,) of the frames whose bytes are ``columns`` (length, n), as XOR of each byte's contribution."""
    base, tables = _tables(len(columns))
    if columns.shape[1] < FEW:
        places = 256 * np.arange(len(columns), dtype=np.intp)[:, None]
        few: NDArray[np.uint16] = np.bitwise_xor.reduce(tables.ravel().take(columns + places), axis=0) ^ np.uint16(base)
        return few
    total = np.full(columns.shape[1], base, dtype=np.uint16)
    for table, column in zip(tables, columns, strict=True):
        total ^= table.take(column)
    return total
