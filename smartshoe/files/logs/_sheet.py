"""`Sheet`: the result of a format's reader, before it is decided which column is load and which is a sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args
from unicodedata import category

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import require_columns, require_values
from smartshoe.recording import Recording, Role

LARGEST = 1e30  # in any unit: larger numbers come from broken files, and overflow when squared twice


@dataclass(eq=False)
class Column:
    """One column of the file: ``name`` and ``unit`` are the file's texts ('' where it gives none).

    ``values`` (n,) are NaN where a cell is empty. ``role`` is set only by formats that store roles (our own HDF5 and
    MAT files); otherwise the role follows from name and unit, or from the user. ``label`` is the header's entire text
    where that is more than the name (``force_n``, ``Time[s]``): a user may choose the column by either.
    """

    name: str
    unit: str
    values: Array
    role: Role | None = None
    label: str = ""


@dataclass(eq=False)
class Sheet:
    """A file's columns and the information that it gives about itself.

    ``first_line`` is the 1-based line of the first data row (text formats), for messages that name a line. ``lines``
    (n,) gives every row's line instead where rows are not on consecutive lines. ``has_header`` is False for bare
    numbers, whose columns are then called '1', '2', ...
    """

    path: Path
    format: str
    columns: list[Column]
    metadata: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    first_line: int | None = None
    has_header: bool = True
    recording_name: str | None = None
    unit_name: str | None = None
    lines: Index | None = None

    def place(self, row: int) -> str:
        """The place of the 0-based ``row`` in the file, as an error message names it."""
        if self.lines is not None:
            return f"{self.path}, line {int(self.lines[row])}"
        if self.first_line is not None:
            return f"{self.path}, line {self.first_line + row}"
        return f"{self.path}, sample {row + 1}"


@dataclass(frozen=True)
class Format:
    """A file format: how it is recognised, read and written.

    ``title`` is its name for users ("NI TDMS file"). ``sniff(path, head)`` tells whether the first bytes ``head`` are
    of this format. ``read`` gives the `Sheet`; any exception becomes one sentence (`FormatError` and `InputError` keep
    their own words). ``write`` is None where the format is read only. Formats are tried in the order of ``asked``: 0
    has an unmistakable beginning, 9 accepts any text. ``is_text`` excludes binary files.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    read: Callable[[Path], Sheet]
    write: Callable[[Recording, Path], None] | None = None
    asked: int = 0
    is_text: bool = False


def printable(text: str) -> str:
    """``text`` with blanks for line breaks, and escapes for other characters that a terminal would interpret."""
    if text.isprintable():
        return text
    return "".join(
        letter if category(letter) != "Cc" else " " if letter.isspace() else repr(letter)[1:-1] for letter in text
    )


def require_sound(sheet: Sheet) -> None:
    """Raise `FormatError` or `InputError` where a reader's sheet violates the contract of `Sheet`.

    A file may contain anything in place of names, units, roles and numbers, and a reader may be another package's.
    Afterwards its texts are printable, since they are shown on terminals.
    """
    require_columns(sheet.path, len(sheet.columns))
    require_values(sheet.path, sum(np.size(column.values) for column in sheet.columns))
    texts: list[Any] = [*sheet.metadata, *sheet.metadata.values(), *sheet.notes]
    texts += [text for text in (sheet.recording_name, sheet.unit_name) if text is not None]
    for column in sheet.columns:
        texts += [column.name, column.unit, column.label]
        values: Any = column.values
        if not isinstance(values, np.ndarray) or values.dtype != np.float64 or values.ndim != 1:
            raise FormatError(f"{sheet.path}: column {column.name!r} is no row of numbers: write the file again")
        if values.size != sheet.columns[0].values.size:
            raise FormatError(
                f"{sheet.path}: column {column.name!r} has {values.size} samples, the first one"
                f" {sheet.columns[0].values.size}: write the file again"
            )
        if column.role is not None and column.role not in get_args(Role):
            raise FormatError(f"{sheet.path}: column {column.name!r} has the role {column.role!r}: write it again")
        impossible = np.abs(values) > LARGEST
        if impossible.any() and np.isfinite(values[impossible]).any():
            row = int(np.argmax(impossible & np.isfinite(values)))
            raise InputError(
                f"{sheet.place(row)}: {values[row]:g} in column {column.name!r} is no measurement: correct the cell,"
                " or leave it empty where the sample is missing"
            )
    if not all(isinstance(text, str) for text in texts):
        wrong = next(text for text in texts if not isinstance(text, str))
        raise FormatError(f"{sheet.path} holds {wrong!r} where a text belongs: write the file again")
    sheet.metadata = {printable(key): printable(value) for key, value in sheet.metadata.items()}
    sheet.notes = [printable(note) for note in sheet.notes]
    sheet.recording_name, sheet.unit_name = (
        None if name is None else printable(name) for name in (sheet.recording_name, sheet.unit_name)
    )
    for column in sheet.columns:
        column.name, column.unit, column.label = printable(column.name), printable(column.unit), printable(column.label)
