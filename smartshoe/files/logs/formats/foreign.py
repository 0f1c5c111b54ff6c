"""Any other delimited text: with or without a header, with units in the header, below it, or nowhere."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import require_columns
from smartshoe.files.logs._moments import is_moment, seconds_of
from smartshoe.files.logs._numbers import is_missing, is_number, numbers_of_columns, split_unit, without_units
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.files.logs._text import bracketed, even_rows, is_text, read_lines, split_cells
from smartshoe.recording import split_column
from smartshoe.units import ONE, find_unit

_DELIMITERS = ("\t", ";", ",", None)  # None is any run of blanks
_SAMPLE_LINES = 200
_LEAST_SCORE = 0.2  # share of cells that must be numbers for text to be a table
_AFTER_SLASH = re.compile(r"(.*\S)\s*/\s*([^/\s]+)")


def sniff(path: Path, head: bytes) -> bool:
    """Whether the file is text."""
    return is_text(head)


def _without_trailing(cells: list[str]) -> list[str]:
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _is_number(cell: str) -> bool:
    """Whether a cell is a number, with or without a unit."""
    return is_number(cell) or bool(split_unit(cell)[1])


def _delimiter(path: Path, lines: Sequence[str]) -> tuple[str | None, list[list[str]]]:
    """The delimiter by which most cells of the later lines are numbers, and the rows of the most frequent width."""
    best: tuple[float, str | None, list[list[str]]] | None = None
    for delimiter in _DELIMITERS:
        rows = split_cells(lines, delimiter)
        width, count = Counter(map(len, rows)).most_common(1)[0]
        even = [row for row in rows if len(row) == width]
        cells = [cell for row in even for cell in _without_trailing(row)]
        numeric = sum(map(_is_number, cells)) / len(cells)
        if width < 2:
            continue
        score = numeric * count / len(rows)
        if score < _LEAST_SCORE:
            continue
        if best is None or score > best[0] + 1e-9:
            best = (score, delimiter, even)
    if best is None:
        raise FormatError(
            f"{path} holds no table of numbers with two columns or more: separate columns by comma, semicolon or tab"
        )
    return best[1], best[2]


def _title(text: str) -> tuple[str, str]:
    """A header's cell as name and unit: ``Time[s]``, ``Force (N)``, ``Force, N``, ``F/N``, ``P_bar``."""
    name, unit_text = bracketed(text)
    if unit_text or name != text:
        return name, unit_text
    match = _AFTER_SLASH.fullmatch(text)
    if match and find_unit(match[2]) is not None:
        return match[1], match[2]
    name, unit = split_column(text)
    return (name, unit.symbol) if unit is not None and unit != ONE else (text, "")


def _is_unit_row(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell and cell != "-"]
    return (
        bool(filled)
        and not any(is_number(cell) for cell in filled)
        and sum(find_unit(cell) is not None for cell in filled) * 2 >= len(filled)
    )


def _said(lines: Sequence[str], delimiter: str | None) -> dict[str, str]:
    """Metadata in the lines above a table: ``key=value``, ``# key: value``, ``key<delimiter>value``."""
    metadata: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        text = line.strip().lstrip("#").strip()
        if not text or text == "endheader":
            continue
        bracketed = text.startswith("[") and text.endswith("]")
        for mark in () if bracketed else ("=", delimiter, ": ", None):
            key, *value = text.split(mark, 1)
            if value:
                break
        else:
            key, value = f"line {number}", [text]
        key, text = key.strip().rstrip(":"), value[0].strip().strip(delimiter or "")
        metadata[key] = f"{metadata[key]}\n{text}" if key in metadata else text
    return metadata


def _split_table(path: Path, lines: list[str]) -> tuple[str | None, int, int]:
    """Delimiter, width, and the index of the table's first line (its header, where it has one)."""
    filled = [line for line in lines if line.strip()]
    if not filled:
        raise InputError(f"{path} is empty: give a file with samples in it")
    # Lines further down belong to the table, whatever is above it.
    sample = filled[len(filled) // 2 :][:_SAMPLE_LINES]
    delimiter, rows = _delimiter(path, sample)
    width = len(rows[0])
    # All rows end with a delimiter or with an empty cell: the lines above tell which.
    ends_empty = not any(row[-1] for row in rows)
    for index, line in enumerate(lines):
        cells = split_cells([line], delimiter)[0] if line.strip() else [""]
        if line.startswith("#") and ":" in line:
            continue
        own = _without_trailing(cells)
        if len(own) == width or (len(cells) == width and not ends_empty):
            return delimiter, width, index
        if len(own) == width - 1 and ends_empty:
            return delimiter, width - 1, index
    raise FormatError(f"{path} holds no table: no line has the {width} cells that most have")


def read(path: Path) -> Sheet:
    """Read delimited text; raises `FormatError` naming lines that do not match or contradict each other."""
    lines, notes = read_lines(path)
    delimiter, width, start = _split_table(path, lines)
    require_columns(path, width)
    above = lines[:start]
    said = _said(above, delimiter)
    of_table = {key: said.pop(key, None) for key in ("name", "unit") if f"# {key}:" in "\n".join(above)}
    numbered = [(number, line) for number, line in enumerate(lines[start:], start=start + 1) if line.strip()]
    numbers = [number for number, _ in numbered]
    rows = even_rows(path, split_cells([line for _, line in numbered], delimiter), numbers, width)

    has_header = any(not (_is_number(cell) or is_missing(cell) or is_moment(cell)) for cell in rows[0])
    names, units = [str(index + 1) for index in range(width)], [""] * width
    labels = [""] * width
    if has_header:
        labels = rows[0]
        names, units = (list(part) for part in zip(*map(_title, labels), strict=True))
        rows, numbers = rows[1:], numbers[1:]
        if rows and _is_unit_row(rows[0]):
            units = [cell.strip("()[] ") or unit for cell, unit in zip(rows[0], units, strict=True)]
            names = [label if cell else name for label, name, cell in zip(labels, names, rows[0], strict=True)]
            rows, numbers = rows[1:], numbers[1:]
    if not rows:
        raise InputError(f"{path} holds a header and no data rows: give a file with samples")

    used, clocks, cells = [], {}, []
    for index in range(width):
        column: Sequence[str] = [row[index] for row in rows]
        if is_moment(column[0]) and not is_number(column[0]):
            seconds, next_days = seconds_of(path, names[index], column, numbers)
            notes += [
                f"Column {names[index]} passes midnight at line {numbers[row]}: what follows is the next day."
                for row in next_days
            ]
            clocks[index] = Column(names[index], "s", seconds, label=labels[index])
            said.setdefault(f"start of {names[index]}", column[0])
            continue
        column, units[index] = without_units(path, names[index], units[index], column, numbers)
        if any(map(is_number, column)) or all(map(is_missing, column)):
            used.append(index)
            cells.append(column)
        else:
            notes.append(f"Column {names[index]} holds text and was left out.")
    table = numbers_of_columns(path, [names[index] for index in used], cells, numbers)
    read_ = dict(zip(used, table.columns, strict=True))
    columns = [
        clocks.get(index) or Column(names[index], units[index], read_[index], label=labels[index])
        for index in range(width)
        if index in clocks or index in read_
    ]
    return Sheet(
        path,
        "foreign",
        columns,
        said,
        notes=[*notes, *table.notes],
        first_line=numbers[0],
        has_header=has_header,
        recording_name=of_table.get("name"),
        unit_name=of_table.get("unit"),
        lines=np.array(numbers, dtype=np.intp),
    )


FORMAT = Format(
    "foreign", "delimited text", (".csv", ".txt", ".tsv", ".dat", ".mot", ".forces"), sniff, read, asked=9, is_text=True
)
