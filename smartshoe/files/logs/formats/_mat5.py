"""Checks a MAT-file of level 5 to 7 before scipy unpacks it: bytes, depth, number of arrays.

A compressed variable may unpack to a thousand times its size, and scipy's compiled reader follows nested cells until
the stack overflows. Layout: MathWorks, MAT-File Format (level 5): tags of type and length, arrays in arrays.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import limits
from smartshoe.files.gate.limits import FREELY_UNPACKED

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED, _DIMENSIONS, _FLAGS = 14, 15, 5, 6
_OF_ARRAYS = (1, 2, 3)  # classes that contain arrays: cells, structs, objects
_DEEPEST = 32
_ARRAYS_PER_COLUMN = 25
_FREE_CELLS = 1024


def require_bounded(path: Path) -> None:
    """Raise `InputError` where the level 5 file at ``path`` unpacks to more than the limits or is nested too deeply."""
    content = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        return  # level 4, which only contains plain matrices, or no MAT-file
    left = max(FREELY_UNPACKED, limits().expansion * len(content))
    arrays = 0
    for kind, body in _elements(memoryview(content)[_HEADER_BYTES:], order):
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            unpacked = unpacker.decompress(body, left + 1)
            if len(unpacked) > left:
                raise InputError(
                    f"{path} unpacks to far more than its {len(content)} bytes: save it again without compression, or"
                    " raise the limit with --limit expansion=1000"
                )
            left -= len(unpacked)
            arrays += _weighed(path, memoryview(unpacked), order, 0)
        elif kind == _MATRIX:
            arrays += _weighed(path, body, order, 1)
        if arrays > _ARRAYS_PER_COLUMN * limits().columns:
            raise FormatError(f"{path} holds more than {arrays} arrays: save the measured channels alone")


def _weighed(path: Path, body: memoryview, order: str, depth: int) -> int:
    """The number of arrays in ``body``, at any depth; raises where one declares more than it can contain."""
    arrays, waiting = 0, [(body, depth)]
    while waiting:
        here, depth = waiting.pop()
        if depth > _DEEPEST:
            raise FormatError(f"{path} is nested deeper than {_DEEPEST}: save the measured channels alone")
        class_ = 0
        for kind, inner in _elements(here, order):
            if kind == _MATRIX:
                arrays += 1
                waiting.append((inner, depth + 1))
            elif kind == _FLAGS and len(inner) >= 4:
                class_ = struct.unpack_from(f"{order}I", inner)[0] & 0xFF
            elif kind == _DIMENSIONS and class_ in _OF_ARRAYS:
                lengths = struct.unpack_from(f"{order}{len(inner) // 4}i", inner)
                if math.prod(lengths) > max(_FREE_CELLS, len(here) // 8):
                    raise FormatError(f"{path} declares {math.prod(lengths)} cells and cannot hold them: save it again")
    return arrays


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """The successive elements (type, content) in ``data``; ends at an incomplete one."""
    at = 0
    while at + 8 <= len(data):
        kind, length = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # a small element: its content is in the tag
            yield kind & 0xFFFF, data[at + 4 : at + 4 + min(kind >> 16, 4)]
            at += 8
            continue
        yield kind, data[at + 8 : at + 8 + length]
        at += 8 + (length if kind == _COMPRESSED else -(-length // 8) * 8)
