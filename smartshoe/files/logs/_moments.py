"""Reads dates and times of day in cells: ISO 8601 (2026-05-01T10:00:00.25, with or without a zone) and 10:00:00.25."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array, Index
from smartshoe.errors import FormatError
from smartshoe.files.logs._numbers import is_missing
from smartshoe.units import DAY_S

_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d{1,9})?)?\s?(Z|[+-]\d\d:?\d\d)?", re.ASCII)
_OF_DAY = re.compile(r"\d{1,2}:\d\d:\d\d([.,]\d{1,9})?", re.ASCII)

LONGEST_BREAK_S = 3600.0  # between two rows around midnight


def is_moment(cell: str) -> bool:
    """Whether a cell is a date with a time, or a time of day."""
    return bool(_DATE.fullmatch(cell) or _OF_DAY.fullmatch(cell))


def midnights(of_day_s: Array) -> Index:
    """The rows (m,) from which times of day (n,) in s, NaN where missing, are the next day's.

    A step back by a day, less an hour at most, is midnight. None is found if any step is as far forward: then a single
    row is off, or the clock was set.
    """
    rows = np.flatnonzero(np.isfinite(of_day_s))
    step = np.diff(of_day_s[rows])
    far = DAY_S - LONGEST_BREAK_S
    return rows[1:][step < -far] if not (step > far).any() else rows[:0]


def seconds_of(path: Path, name: str, cells: Sequence[str], lines: Sequence[int]) -> tuple[Array, Index]:
    """Seconds (n,) since the first cell, to a nanosecond; NaN where a cell is empty.

    Also the rows (m,) from which times of day are the next day's, as they are counted. Raises `FormatError` with the
    line of a cell that is not a moment of the same kind as the first one.
    """
    import pandas as pd

    kind = _DATE if _DATE.fullmatch(cells[0]) else _OF_DAY
    has_zone = [bool(re.search(r"(Z|[+-]\d\d:?\d\d)$", cell)) for cell in cells]
    for cell, line, zoned in zip(cells, lines, has_zone, strict=True):
        alike = kind.fullmatch(cell) and (kind is _OF_DAY or zoned == has_zone[0])
        if not alike and not is_missing(cell):
            raise FormatError(
                f"{path}, line {line}: {cell!r} in column {name} is no time like {cells[0]!r}: correct it"
            )
    texts = pd.Series([None if is_missing(cell) else cell.replace(",", ".") for cell in cells])
    try:
        if kind is _OF_DAY:
            ticks: NDArray[Any] = pd.to_timedelta(texts).to_numpy(dtype="timedelta64[ns]")
        else:
            ticks = pd.to_datetime(texts, format="ISO8601", utc=has_zone[0]).to_numpy(dtype="datetime64[ns]")
    except ValueError as error:
        raise FormatError(f"{path}: column {name} holds no such time ({error}): correct it") from error
    since = np.asarray(ticks).astype(np.int64)  # nanoseconds; missing ones become the smallest integer
    seconds = np.where(np.isnat(ticks), np.nan, (since - since[0]) / 1e9)
    next_days = midnights(seconds if kind is _OF_DAY else seconds[:0])
    for row in next_days:
        seconds[row:] += DAY_S
    return seconds, next_days
