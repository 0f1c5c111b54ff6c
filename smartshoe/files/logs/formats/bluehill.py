"""Bluehill raw-data CSV of Instron's testing machines, in the dialects of its locales and versions.

Up to 24 or more lines ``Section : name;value;unit``, a row of names in any language, below it a row of units in
brackets, then numbers. The format is recognised by the row of units; the columns are recognised by their units.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import require_columns
from smartshoe.files.logs._numbers import is_number, numbers_of
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.files.logs._text import even_rows, head_lines, is_text, read_lines, split_cells
from smartshoe.files.logs.formats.plain import remarks
from smartshoe.recording import Recording

_BRACKETED = re.compile(r"\s*[(（\[]([^()（）]*)[)）\]]\s*")
_DELIMITERS = (";", "\t", ",")
_SEARCHED_LINES = 400


def _unit_row(lines: Sequence[str]) -> tuple[int, str] | None:
    """Index and delimiter of the row of units in brackets, with a row of names above it."""
    for index, line in enumerate(lines[1:_SEARCHED_LINES], start=1):
        if "(" not in line and "（" not in line and "[" not in line:
            continue
        for delimiter in _DELIMITERS:
            names, units = split_cells(lines[index - 1 : index + 1], delimiter)
            filled = [cell for cell in units if cell]
            if (
                len(filled) >= 2
                and all(_BRACKETED.fullmatch(cell) for cell in filled)
                and len([name for name in names if name]) >= len(filled)
                and not any(is_number(name) for name in names)
            ):
                return index, delimiter
    return None


def sniff(path: Path, head: bytes) -> bool:
    """Whether there is a row of names with a row of units in brackets below it near the beginning."""
    return is_text(head) and _unit_row(head_lines(head)) is not None


def _preamble(lines: Sequence[str], delimiter: str) -> dict[str, str]:
    metadata: dict[str, str] = {}
    for number, cells in enumerate(split_cells(lines, delimiter), start=1):
        if not any(cells):
            continue
        key, value = cells[0] or f"line {number}", " ".join(cell for cell in cells[1:] if cell)
        count, unique = 1, key
        while unique in metadata:
            count += 1
            unique = f"{key} ({count})"
        metadata[unique] = value
    return metadata


def read(path: Path) -> Sheet:
    """Read a Bluehill log.

    Raises `FormatError` naming the lines where cells are not numbers or contradict each other in their decimal mark.
    """
    lines, notes = read_lines(path)
    found = _unit_row(lines)
    if found is None:
        raise FormatError(f"{path} has no row of units in brackets below a row of names: export it from Bluehill again")
    at, delimiter = found
    names, units = split_cells(lines[at - 1 : at + 1], delimiter)
    numbered = [(number, line) for number, line in enumerate(lines[at + 1 :], start=at + 2) if line.strip()]
    if not numbered:
        raise InputError(f"{path} holds a header and no data rows below line {at + 1}: give a file with samples")
    numbers = [number for number, _ in numbered]
    rows = split_cells([line for _, line in numbered], delimiter)
    width = max(index for index, (name, unit) in enumerate(_paired(names, units)) if name or unit) + 1
    names, units = ([*row, *[""] * width][:width] for row in (names, units))
    require_columns(path, width)
    rows = even_rows(path, rows, numbers, width)
    # A column of row numbers, or an entirely blank one, has neither name nor unit.
    used = [index for index in range(width) if names[index] or units[index] or any(row[index] for row in rows)]
    rows = [[row[index] for index in used] for row in rows]
    names = [names[index] or f"column {index + 1}" for index in used]
    table = numbers_of(path, names, rows, numbers)
    texts = [units[index] for index in used]
    columns = [
        Column(name, (match[1].strip() if (match := _BRACKETED.fullmatch(text)) else ""), values)
        for name, text, values in zip(names, texts, table.columns, strict=True)
    ]
    # A user may have added lines of a plain table above the export.
    marks = [line for line in lines[: at - 1] if line.startswith("#") and ":" in line]
    said = {key: "\n".join(values) for key, values in remarks(marks).items()}
    recording_name, unit_name = (said.pop(key, None) for key in ("name", "unit"))
    return Sheet(
        path,
        "bluehill",
        columns,
        _preamble(["" if line in marks else line for line in lines[: at - 1]], delimiter) | said,
        notes=[*notes, *table.notes],
        first_line=numbers[0],
        recording_name=recording_name,
        unit_name=unit_name,
        lines=np.array(numbers, dtype=np.intp),
    )


def _paired(names: Sequence[str], units: Sequence[str]) -> list[tuple[str, str]]:
    length = max(len(names), len(units))
    return list(zip([*names, *[""] * (length - len(names))], [*units, *[""] * (length - len(units))], strict=True))


def write_bluehill(  # noqa: PLR0913 - a public verb
    recording: Recording,
    path: Path | str,
    *,
    delimiter: str = ",",
    decimal: str = ".",
    encoding: str = "utf-8",
    quoted: bool = True,
    newline: str = "\r\n",
    preamble: Sequence[tuple[str, str, str]] = (),
    names: Sequence[str] | None = None,
    digits: int | None = None,
) -> None:
    """Write time, displacement and load like Bluehill: names, units in brackets, numbers.

    ``preamble`` holds (``Section : name``, value, unit); ``names`` replaces Time, Extension, Load (channels that the
    recording lacks are left out, others follow by their names); ``digits`` after the decimal mark, or None for full
    precision. An encoding with a byte order mark (``utf-16``, ``utf-8-sig``) writes the mark.
    """
    order = {"auxiliary": 1, "load": 2, "command": 3, "sensor": 4}
    channels = sorted(recording.channels.values(), key=lambda c: 0 if c.name == "displacement" else order[c.role])
    titles = ["Time"] + [
        "Extension" if c.name == "displacement" else "Load" if c.role == "load" else c.name for c in channels
    ]
    if names is not None:
        titles[: len(names)] = names
    units = ["(s)"] + [f"({c.unit.symbol})" for c in channels]

    def cell(value: float) -> str:
        if not np.isfinite(value):
            return ""
        text = repr(float(value)) if digits is None else f"{value:.{digits}f}"
        return text.replace(".", decimal)

    def row(cells: Sequence[str]) -> str:
        return delimiter.join(f'"{c}"' if quoted else c for c in cells)

    table = np.column_stack([recording.time_s, *(channel.with_nan() for channel in channels)])
    lines = [delimiter.join(entry).rstrip(delimiter) for entry in preamble]
    lines += [row(titles), row(units)]
    lines += [row([cell(value) for value in values]) for values in table]
    Path(path).write_bytes((newline.join(lines) + newline).encode(encoding))


FORMAT = Format("bluehill", "Bluehill CSV", (".csv", ".txt", ".raw"), sniff, read, asked=2, is_text=True)
