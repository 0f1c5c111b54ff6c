r"""Messages to a page: binary frames with the traces (JSON carries all else), and the views they are reduced for.

A frame, little-endian:

====== ====== ==================================================================
offset type   meaning
====== ====== ==================================================================
0      u8     1, the version
1      u8     number of shoes
2      u16    0
4      u32    number of the frame
8      f64    now, seconds of the session
16     f64    width of a column in seconds
====== ====== ==================================================================

then for each shoe

====== ============ ============================================================
0      u32          c, units
4      u32          n, columns
8      u32          f, feet
12     f64          place of the first column (its time is place times width)
20     i32[n]       place of each column, from the first
\      f32[c]       the last value of each unit
\      f32[4 f]     of each foot: phase (-1 unknown), load, centre along, centre medial
\      f32[n c]     least value of each unit in each column, a row a column
\      f32[n c]     greatest value
====== ============ ============================================================

A column that was sent before is sent again while samples are still added to it. NaN means no value.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from smartshoe.arrays import Array
from smartshoe.live._pixel_columns import PixelColumns, joined, reduced
from smartshoe.live._shoe import FootNow, LiveShoe

VERSION = 1
_HEAD = struct.Struct("<BBHIdd")
_SHOE = struct.Struct("<IIId")
SECONDS = (5.0, 20.0, 60.0)
FEWEST_COLUMNS, MOST_COLUMNS = 100, 1600


@dataclass(frozen=True)
class PageView:
    """What a page shows: the last ``seconds`` of the traces, in ``columns`` columns of pixels."""

    seconds: float = 20.0
    columns: int = 600

    @property
    def width_s(self) -> float:
        """Width of a column in seconds."""
        return self.seconds / self.columns


def view_of(seconds: object, columns: object) -> PageView:
    """The permitted view nearest to the one a page asks for; there are few, so pages can share reduced traces."""
    usual = PageView()
    wanted_s = float(seconds) if _is_number(seconds) else usual.seconds
    count = float(columns) if _is_number(columns) else usual.columns
    nearest = min(SECONDS, key=lambda each: abs(each - wanted_s))
    return PageView(nearest, int(np.clip(100 * round(count / 100), FEWEST_COLUMNS, MOST_COLUMNS)))


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and math.isfinite(value)


class Reduction:
    """One shoe's traces reduced to the columns of one view, updated when a page asks for them."""

    def __init__(self, live: LiveShoe, view: PageView) -> None:
        self._live, self._view = live, view
        self._place, self._zero = 0, live.zero
        self._columns: PixelColumns | None = None

    def columns(self) -> PixelColumns:
        """All columns of the view, up to the latest sample."""
        if self._columns is None or self._zero is not self._live.zero:
            self._place, self._columns, self._zero = 0, None, self._live.zero
        self._place, time_s, rows = self._live.since(self._place)
        new = reduced(time_s, rows, self._view.width_s)
        self._columns = new if self._columns is None else joined(self._columns, new, self._view.columns + 2)
        return self._columns


def shoe_bytes(columns: PixelColumns, values: Array, feet: Sequence[FootNow]) -> bytes:
    """The part of a frame that belongs to one shoe."""
    first = int(columns.place[0]) if len(columns) else 0
    of_feet = [(-1.0 if f.phase is None else float(f.phase), f.load, *f.centre) for f in feet]
    return b"".join(
        (
            _SHOE.pack(values.size, len(columns), len(feet), float(first)),
            (columns.place - first).astype("<i4").tobytes(),
            values.astype("<f4").tobytes(),
            np.asarray(of_feet, dtype="<f4").tobytes(),
            columns.low.astype("<f4").tobytes(),
            columns.high.astype("<f4").tobytes(),
        )
    )


def head_bytes(shoes: int, number: int, now_s: float, width_s: float) -> bytes:
    """The head of a frame."""
    return _HEAD.pack(VERSION, shoes, 0, number & 0xFFFFFFFF, now_s, width_s)
