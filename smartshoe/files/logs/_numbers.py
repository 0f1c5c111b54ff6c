"""Converts cells to numbers: the decimal mark is decided from all cells of a file, or the file is refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import FormatError
from smartshoe.units import find_unit

MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "-", "--", "---"})
_INTEGER = re.compile(r"[+-]?\d+(?:[eE][+-]?\d+)?", re.ASCII)
_ONE_MARK = re.compile(r"[+-]?(?:\d+[.,]\d*|[.,]\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.ASCII | re.IGNORECASE)
_LIKE_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", re.ASCII)
_THOUSANDS = {
    ".": re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d*", re.ASCII),
    ",": re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+,\d*", re.ASCII),
}
_GROUPS = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+", re.ASCII)
_WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*([^\W\d].*|[°%].*)")
_PLAIN_NUMBERS = re.compile(r"[0-9eE+\-., \n]*", re.ASCII)


def is_number(cell: str) -> bool:
    """Whether a cell is a number in any notation; a missing one is not."""
    return bool(
        _INTEGER.fullmatch(cell)
        or _ONE_MARK.fullmatch(cell)
        or _GROUPS.fullmatch(cell)
        or _THOUSANDS["."].fullmatch(cell)
        or _THOUSANDS[","].fullmatch(cell)
        or _INFINITE.fullmatch(cell)
    )


def split_unit(cell: str) -> tuple[str, str]:
    """A cell's number and unit, for example of ``12.3 N``; ('', '') where it is not a number with a known unit."""
    match = _WITH_UNIT.fullmatch(cell)
    if match and is_number(match[1]) and find_unit(match[2]) is not None:
        return match[1], match[2]
    return "", ""


def is_missing(cell: str) -> bool:
    """Whether a cell marks a missing sample."""
    return cell.casefold() in MISSING


@dataclass(frozen=True, eq=False)
class Numbers:
    """The columns of a table as numbers (NaN where missing), and notes on how they were read."""

    columns: list[Array]
    decimal: str
    notes: list[str]


def _lines(found: list[int]) -> str:
    return f"line {found[0]}" if len(found) == 1 else f"lines {', '.join(map(str, found))}"


class _NumberTable:
    def __init__(self, path: Path, names: Sequence[str], cells: Sequence[Sequence[str]], lines: Sequence[int]) -> None:
        self.path, self.names, self.lines, self.cells = path, names, lines, cells
        self.joined = ["\n".join(column) for column in self.cells]

    def first(self, wanted: re.Pattern[str], limit: int = 3) -> list[int]:
        """Lines (at most ``limit``) of the cells that ``wanted`` matches entirely."""
        found: set[int] = set()
        for column in self.cells:
            count = 0
            for row, cell in enumerate(column):
                if wanted.fullmatch(cell):
                    found.add(self.lines[row])
                    count += 1
                    if count == limit:
                        break
        return sorted(found)[:limit]

    def decimal(self) -> str:
        """The file's only decimal mark; raises `FormatError` where cells contradict each other."""
        if not any("," in text for text in self.joined):
            return "."
        if not any("." in text for text in self.joined):
            self._refuse_ambiguous_commas()
            return ","
        dot = self.first(re.compile(r"[+-]?\d*\.\d*(?:[eE][+-]?\d+)?", re.ASCII))
        comma = self.first(re.compile(r"[+-]?\d*,\d*(?:[eE][+-]?\d+)?", re.ASCII))
        if dot and comma:
            raise FormatError(
                f"{self.path}: decimals are inconsistent: a point in {_lines(dot)}, a comma in {_lines(comma)}:"
                " export the file again with one decimal mark"
            )
        both = {mark: self.first(pattern) for mark, pattern in _THOUSANDS.items()}
        if both["."] and not both[","] and not comma:
            return "."
        if both[","] and not both["."] and not dot:
            return ","
        lines = sorted({*both["."], *both[","], *dot, *comma})[:4]
        if lines:
            raise FormatError(
                f"{self.path}: thousands and decimal marks cannot be told apart in {_lines(lines)}:"
                " export the file again without thousands marks"
            )
        return "."  # only text cells contain both marks; the conversion reports them

    def _refuse_ambiguous_commas(self) -> None:
        alike: set[int] = set()
        for column in self.cells:
            for row, cell in enumerate(column):
                if "," in cell and _ONE_MARK.fullmatch(cell):
                    if not _LIKE_THOUSANDS.fullmatch(cell):
                        return  # 0,5 or 1,25 can only be a decimal comma
                    alike.add(self.lines[row])
        if alike:
            raise FormatError(
                f"{self.path}: commas in {_lines(sorted(alike)[:3])} may mark thousands or decimals and no cell"
                " decides: export the file again with a decimal point"
            )

    def convert(self, index: int, decimal: str, notes: list[str]) -> Array:
        """Column ``index`` as numbers; raises `FormatError` naming the line of a cell that is not one."""
        cells: Sequence[str] = self.cells[index]
        text = self.joined[index]
        if _PLAIN_NUMBERS.fullmatch(text):
            if decimal == "," and "," in text:
                cells = text.replace(",", ".").split("\n") if "." not in text else cells
            if "," not in text or decimal == ",":
                try:
                    return np.array([cell or "nan" for cell in cells], dtype=float)
                except ValueError:
                    cells = self.cells[index]
        return self._convert_slowly(index, cells, decimal, notes)

    def _convert_slowly(self, index: int, cells: Sequence[str], decimal: str, notes: list[str]) -> Array:
        name = self.names[index]
        grouped = decimal == "." and any(cell.count(".") > 1 for cell in cells)
        values = np.empty(len(cells))
        thousands = "," if decimal == "." else "."
        marked = False
        for row, cell in enumerate(cells):
            number = cell
            if grouped and _GROUPS.fullmatch(cell):
                head, tail = cell.rsplit(".", 1)
                number = f"{head.replace('.', '')}.{tail}"
            elif is_missing(cell):
                number = "nan"
            elif _THOUSANDS[decimal].fullmatch(cell):
                number, marked = cell.replace(thousands, "").replace(decimal, "."), True
            elif _ONE_MARK.fullmatch(cell) and thousands not in cell and not grouped:
                number = cell.replace(decimal, ".")
            elif not (_INTEGER.fullmatch(cell) or _INFINITE.fullmatch(cell)):
                raise FormatError(
                    f"{self.path}, line {self.lines[row]}: {cell!r} in column {name} is no number:"
                    " correct the cell, or leave it empty where the sample is missing"
                )
            values[row] = float(number)
        if grouped:
            self._check_grouped(index, values)
            notes.append(
                f"Column {name} is written like 1.002.000 and was read with the last point as decimal mark (1002.000)."
            )
        if marked:
            notes.append(f"Column {name} holds thousands marks ({thousands!r}), which were removed.")
        return values

    def _check_grouped(self, index: int, values: Array) -> None:
        steps = np.diff(values)
        if values.size > 1 and not (steps > 0).all():
            several = [row for row, cell in enumerate(self.cells[index]) if cell.count(".") > 1][:3]
            raise FormatError(
                f"{self.path}: cells with several points in {_lines([self.lines[row] for row in several])} of column"
                f" {self.names[index]} have no certain reading: export the file again without thousands marks"
            )


def without_units(
    path: Path, name: str, unit: str, cells: Sequence[str], lines: Sequence[int]
) -> tuple[Sequence[str], str]:
    """A column's ``cells`` (n,) on ``lines`` (n,) with the unit that all of them carry removed, and the column's unit.

    Missing cells carry none. Raises `FormatError` with the line of the first cell whose unit differs from that of the
    cells above it, or from that of the header, whose text is ``unit`` ('' where it gives none).
    """
    first = next((cell for cell in cells if not is_missing(cell)), "")
    said = split_unit(first)[1]
    if not said:
        return cells, unit
    if find_unit(unit) not in (None, find_unit(said)):
        raise FormatError(
            f"{path}, line {lines[cells.index(first)]}: {first!r} stands in column {name}, which is in {unit} by its"
            " header: take the unit out of the header or out of the cells"
        )
    numbers = []
    for cell, line in zip(cells, lines, strict=True):
        number, own = split_unit(cell)
        if own != said and not is_missing(cell):
            raise FormatError(
                f"{path}, line {line}: {cell!r} in column {name} is not in {said} as the cells above it are: write the"
                " column in one unit"
            )
        numbers.append(number)
    return numbers, said


def numbers_of(path: Path, names: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[int]) -> Numbers:
    """The cells ``rows`` (n rows of one cell per name), found on ``lines`` (n,), as columns of numbers.

    Raises the errors of `numbers_of_columns`.
    """
    return numbers_of_columns(path, names, list(zip(*rows, strict=True)), lines)


def numbers_of_columns(
    path: Path, names: Sequence[str], cells: Sequence[Sequence[str]], lines: Sequence[int]
) -> Numbers:
    """The cells of columns, (n,) each and one per name, found on ``lines`` (n,), as numbers.

    The whole file has one decimal mark. Raises `FormatError` naming the lines where cells contradict each other, and
    line and column of a cell that is not a number.
    """
    table = _NumberTable(path, names, cells, lines)
    decimal = table.decimal()
    notes: list[str] = []
    columns = [table.convert(index, decimal, notes) for index in range(len(names))]
    return Numbers(columns, decimal, notes)
