"""Reduces samples to what a plot can show: the smallest and the largest value in each column of pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Integers


@dataclass(frozen=True, eq=False)
class PixelColumns:
    """A signal in columns of pixels; ``place`` (n,) are the columns' numbers, that is, times divided by the width.

    ``low`` and ``high`` (n, width) are the extreme values of the samples in each column, NaN where all are missing.
    Columns without samples are left out.
    """

    place: Integers
    low: Array
    high: Array

    def __len__(self) -> int:
        return int(self.place.size)

    def since(self, place: int) -> PixelColumns:
        """The columns from number ``place`` on."""
        first = int(np.searchsorted(self.place, place))
        return PixelColumns(self.place[first:], self.low[first:], self.high[first:])


def reduced(time_s: Array, rows: Array, width_s: float) -> PixelColumns:
    """Reduce rows (n, width) at increasing times (n,) to columns that are ``width_s`` wide."""
    if not time_s.size:
        return PixelColumns(np.zeros(0, dtype=np.int64), np.zeros((0, rows.shape[1])), np.zeros((0, rows.shape[1])))
    places = np.floor(time_s / width_s).astype(np.int64)
    first = np.flatnonzero(np.diff(places, prepend=places[0] - 1))
    return PixelColumns(
        places[first], np.fmin.reduceat(rows, first, axis=0), np.fmax.reduceat(rows, first, axis=0)
    )  # fmt: skip


def joined(before: PixelColumns, after: PixelColumns, most: int) -> PixelColumns:
    """Join consecutive columns and keep the last ``most``; a column that both sides have a part of is merged."""
    if not len(after):
        return before
    cut = len(before) - int(len(before) > 0 and before.place[-1] == after.place[0])
    low, high = after.low, after.high
    if cut < len(before):
        low, high = low.copy(), high.copy()
        low[0], high[0] = np.fmin(before.low[-1], low[0]), np.fmax(before.high[-1], high[0])
    whole = PixelColumns(
        np.concatenate([before.place[:cut], after.place]),
        np.concatenate([before.low[:cut], low]),
        np.concatenate([before.high[:cut], high]),
    )
    return whole.since(int(whole.place[-1]) - most + 1)
