"""`Sheet`: what a format's reader hands over before anyone has said which column is load and which is a sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smartshoe.recording import Recording, Role

Array = NDArray[np.float64]


@dataclass(eq=False)
class Column:
    """One column as it stands in the file: ``name`` and ``unit`` are the file's texts ('' where it gives none).

    ``values`` (n,) hold NaN where a cell is empty. ``role`` is set only by formats that store roles (our own HDF5
    and MAT files); elsewhere the role is told from name and unit, or by the user. ``label`` is the header's whole
    text where that is more than the name (``force_n``, ``Time[s]``): a user may choose the column by either.
    """

    name: str
    unit: str
    values: Array
    role: Role | None = None
    label: str = ""


@dataclass(eq=False)
class Sheet:
    """A file's columns with what it says of itself.

    ``first_line`` is the 1-based line of the first data row (text formats), for messages that name a line.
    ``lines`` (n,) gives every row's line instead where rows do not stand on consecutive lines. ``has_header`` is
    False for bare numbers, whose columns are then called '1', '2', ...
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
    lines: NDArray[np.intp] | None = None

    def place(self, row: int) -> str:
        """Where the 0-based ``row`` stands in the file, as an error message names it."""
        if self.lines is not None:
            return f"{self.path}, line {int(self.lines[row])}"
        if self.first_line is not None:
            return f"{self.path}, line {self.first_line + row}"
        return f"{self.path}, sample {row + 1}"


@dataclass(frozen=True)
class Format:
    """A file format: how it is recognised, read and written.

    ``sniff(path, head)`` says whether the first bytes ``head`` are of this format; ``read`` raises `FormatError`
    or `InputError` with file and line; ``write`` is None where the format is read only.
    """

    name: str
    suffixes: tuple[str, ...]
    sniff: Callable[[Path, bytes], bool]
    read: Callable[[Path], Sheet]
    write: Callable[[Recording, Path], None] | None = None
