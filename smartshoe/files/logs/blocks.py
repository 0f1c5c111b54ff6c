"""`read_blocks` reads a plain table too long for memory block by block, with the columns and errors of `read`."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.errors import FormatError, InputError
from smartshoe.files.logs import detect, read
from smartshoe.files.logs._numbers import numbers_of
from smartshoe.files.logs._sheet import Column, Sheet
from smartshoe.files.logs._text import even_rows
from smartshoe.files.logs._times import check_increasing, time_of
from smartshoe.files.logs.columns import recording_from
from smartshoe.files.logs.formats import plain as table
from smartshoe.files.logs.picks import unit_in_file
from smartshoe.recording import Channel, Recording, split_column

BLOCK_BYTES = 4 << 20  # of text; as numbers and during parsing about five times as much


def read_blocks(path: Path | str, *, time: str | None = None, block_bytes: int = BLOCK_BYTES) -> Iterator[Recording]:
    """A recording as consecutive `Recording` blocks of ``block_bytes`` of text: a plain table in bounded memory.

    ``time`` chooses the time column as in `smartshoe.files.logs.read`. A column may be empty throughout a block. Other
    formats than the plain table are read completely and yield one block, as does a time that counts rows. Raises
    `InputError` and its subclasses, naming file and line, when the faulty block is reached.
    """
    path = Path(path)
    if detect(path).name != "plain" or (time is not None and time.startswith("rows[")):
        yield read(path, time=time)
        return
    head, header, header_line = table._opening(path)
    twice = [cell for index, cell in enumerate(header) if cell in header[:index]]
    if twice:
        raise FormatError(f"{path}, line {header_line} names column {twice[0]!r} twice: rename one")
    layout: Recording | None = None
    last_s = -np.inf
    for text, first_line in _texts(path, header_line, block_bytes):
        values, lines = _numbers(path, header, text, first_line)
        if not len(values):
            continue
        sheet = _sheet(path, header, values, lines, first_line, table.remarks(head))
        if layout is None:
            layout = _layout(sheet, time)
        block = _block(sheet, layout, time)
        if not block.time_s[0] > last_s:
            raise InputError(f"{sheet.place(0)}: time {block.time_s[0]:.9g} s does not follow {last_s:.9g} s: mend it")
        last_s = float(block.time_s[-1])
        yield block
    if layout is None:
        raise InputError(f"{path} holds a header and no data rows: give a file with samples")


def _texts(path: Path, header_line: int, block_bytes: int) -> Iterator[tuple[bytes, int]]:
    """Complete lines of about ``block_bytes``, and the 1-based line of the first of them."""
    line = header_line + 1
    with path.open("rb") as file:
        for _ in range(header_line):
            file.readline()
        while text := file.read(block_bytes):
            text += file.readline()
            yield text, line
            line += text.count(b"\n")


def _numbers(path: Path, header: list[str], text: bytes, first_line: int) -> tuple[Array, Index | None]:
    """The cells (rows, columns) of a block of lines, and the rows' lines where blank ones lie in between, else None."""
    import pandas as pd

    width = len(header)
    count = text.count(b"\n") + (not text.endswith(b"\n"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            values = pd.read_csv(
                io.BytesIO(text), header=None, names=[str(k) for k in range(width)], index_col=False,
                dtype=np.float64, keep_default_na=False, na_values=["", "nan", "NaN", "NAN"], encoding="utf-8",
            ).to_numpy()  # fmt: skip
        if len(values) == count and text.count(b",") == count * (width - 1):
            return values, None
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning, pd.errors.EmptyDataError):
        pass  # the slow pass reads it, or reports the faulty cell
    rows = [
        (number, [cell.strip() for cell in line.split(",")])
        for number, line in enumerate(text.decode("utf-8", errors="replace").splitlines(), start=first_line)
        if line.strip()
    ]
    if not rows:
        return np.empty((0, width)), None
    numbers = [number for number, _ in rows]
    even = even_rows(path, [cells for _, cells in rows], numbers, width)
    return np.column_stack(numbers_of(path, header, even, numbers).columns), np.array(numbers, dtype=np.intp)


def _sheet(
    path: Path, header: list[str], values: Array, lines: Index | None, first_line: int,
    said: dict[str, list[str]],
) -> Sheet:  # fmt: skip
    columns = []
    for index, cell in enumerate(header):
        name, unit = split_column(cell)
        columns.append(Column(name, unit.symbol if unit else "", values[:, index], None, label=cell))
    return Sheet(
        path, "plain", columns,
        {key: "\n".join(texts) for key, texts in said.items() if key not in ("name", "unit", "note")
         and not key.startswith("role ")},
        notes=said.get("note", []),
        first_line=first_line,
        recording_name=said.get("name", [None])[0],
        unit_name=said.get("unit", [None])[0],
        lines=lines,
    )  # fmt: skip


def _layout(sheet: Sheet, time: str | None) -> Recording:
    """The channels by name, unit and role, as in `read`; includes columns that are empty so far."""
    filled = [
        Column(c.name, c.unit, np.zeros_like(c.values), None, c.label) if not np.isfinite(c.values).any() else c
        for c in sheet.columns
    ]
    return recording_from(Sheet(**{**vars(sheet), "columns": filled}), time=time)


def _block(sheet: Sheet, layout: Recording, time: str | None) -> Recording:
    units = [unit_in_file(column) for column in sheet.columns]
    at_time, time_s = time_of(sheet, units, time)
    check_increasing(sheet, time_s)
    others = [column for index, column in enumerate(sheet.columns) if index != at_time]
    channels = {
        name: Channel.from_values(name, column.values, model.unit, model.role)
        for (name, model), column in zip(layout.channels.items(), others, strict=True)
    }
    return Recording(
        time_s, channels, name=layout.name, unit=layout.unit, metadata=layout.metadata, source=layout.source,
        notes=layout.notes,
    )  # fmt: skip
