"""Reads numbers below a header, as exported by programs of insoles and motion laboratories."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import FormatError
from smartshoe.files.logs._text import encoding_of

EMPTY = frozenset({"", "-"})


def lines_of(path: Path) -> list[str]:
    """The file's lines without empty ones at its end."""
    data = path.read_bytes()
    lines = data.decode(encoding_of(data)[0]).splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    return lines


def numbers_below(path: Path, lines: list[str], first: int, columns: int, separator: str | None) -> Array:
    """Numbers (rows, columns) from the 0-based line ``first`` on; NaN where a cell is empty.

    A ``separator`` of None is white space. Raises `FormatError` with the line of a row that is too short or has a cell
    that is no number.
    """
    table = np.full((max(len(lines) - first, 0), columns), np.nan)
    if not len(table):
        raise FormatError(f"{path} holds no samples below its header: export it again")
    for row, line in enumerate(lines[first:]):
        cells = line.split(separator)
        if separator is None and len(cells) != columns:
            raise FormatError(
                f"{path}, line {first + row + 1}: {len(cells)} numbers stand under {columns} names: export it again"
            )
        for column, cell in enumerate(cells[:columns]):
            text = cell.strip()
            if text in EMPTY:
                continue
            try:
                table[row, column] = float(text)
            except ValueError:
                place = f"{path}, line {first + row + 1}"
                raise FormatError(f"{place}: {text!r} is no number: correct the cell or empty it") from None
    return table
