"""The plain table: ``# key: value`` lines, one header of ``name_unit`` columns, one row per sample; UTF-8, comma."""

from __future__ import annotations

import csv
import json
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import require_columns
from smartshoe.files.logs._moments import is_moment
from smartshoe.files.logs._numbers import is_missing, numbers_of
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.files.logs._text import head_lines, is_text, plain_title, read_lines
from smartshoe.files.logs.columns import roles_of
from smartshoe.recording import Channel, Recording, Role, column_name, only_reading, split_column
from smartshoe.units import declared, find_unit

_KEY_VALUE = re.compile(r'#\s*("(?:[^"\\]|\\.)*"|[^:]*?)\s*:\s*(.*?)\s*')
_ROLES: dict[str, Role] = {"load": "load", "sensor": "sensor", "command": "command", "auxiliary": "auxiliary"}
_CHUNK = 1 << 24


def sniff(path: Path, head: bytes) -> bool:
    """Whether the first line that is not a remark is a header with a column ``time_s``."""
    if not is_text(head):
        return False
    lines = [line for line in head_lines(head) if line.strip() and not line.startswith("#")]
    if not lines:
        return path.suffix.casefold() in FORMAT.suffixes
    return "time_s" in [cell.strip().strip('"') for cell in lines[0].split(",")]


def _unquoted(text: str) -> str:
    if len(text) >= 2 and text[0] == text[-1] == '"':
        try:
            return str(json.loads(text))
        except ValueError:
            return text
    return text


def _quoted(text: str, *, key: bool = False) -> str:
    bare = text == text.strip() and text.isprintable() and not text.startswith('"')
    if bare and not (key and (":" in text or not text)):
        return text
    return json.dumps(text)


def remarks(lines: list[str]) -> dict[str, list[str]]:
    """The values of every key in ``# key: value`` lines; a line without a colon is listed under ``comment``."""
    found: dict[str, list[str]] = {}
    for line in lines:
        match = _KEY_VALUE.fullmatch(line)
        key, value = (_unquoted(match[1]), _unquoted(match[2])) if match else ("comment", line[1:].strip())
        found.setdefault(key, []).append(value)
    return found


def _opening(path: Path) -> tuple[list[str], list[str], int]:
    """The remark lines, the header's cells and the header's 1-based line number."""
    marks: list[str] = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            for number, line in enumerate(iter(file.readline, ""), start=1):
                text = line.rstrip("\r\n")
                if text.startswith("#"):
                    marks.append(text)
                elif text.strip():
                    return marks, [cell.strip() for cell in next(csv.reader([text]))], number
    except UnicodeDecodeError as error:
        raise FormatError(f"{path} is not UTF-8: save the plain table as UTF-8") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its permissions") from error
    raise InputError(f"{path} holds no header row: begin with one like time_s,force_n,pressure_mbar")


def _chunks(path: Path, skip_lines: int) -> Iterator[bytes]:
    with path.open("rb") as file:
        for _ in range(skip_lines):
            file.readline()
        while chunk := file.read(_CHUNK):
            yield chunk


def _marks(path: Path, skip_lines: int) -> tuple[int, int]:
    """The number of commas and of lines below the header."""
    commas = lines = 0
    last = b"\n"
    for chunk in _chunks(path, skip_lines):
        commas += chunk.count(b",")
        lines += chunk.count(b"\n")
        last = chunk[-1:]
    return commas, lines + (last != b"\n")


def _read_fast(path: Path, header: list[str], header_line: int) -> Array | None:
    """All cells (rows, columns) by pandas' C parser, or None where the slow pass must find the fault."""
    import pandas as pd

    # Up to 3.0 pandas' default parser may be off by the last bit; from 3.1 on it is exact and deprecates the option.
    exact = tuple(int(part) for part in pd.__version__.split(".")[:2]) >= (3, 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            frame = pd.read_csv(
                path,
                header=None,
                names=[str(index) for index in range(len(header))],
                index_col=False,
                skiprows=header_line,
                dtype=np.float64,
                keep_default_na=False,
                na_values=["", "nan", "NaN", "NAN"],
                encoding="utf-8",
                float_precision=None if exact else "round_trip",
            )
    except pd.errors.EmptyDataError:
        return np.empty((0, len(header)))
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning):
        return None
    return frame.to_numpy()


def _data_lines(path: Path, header_line: int) -> tuple[list[str], list[int]]:
    lines, _ = read_lines(path)
    rows = [(number, line) for number, line in enumerate(lines, start=1) if number > header_line and line.strip()]
    return [line for _, line in rows], [number for number, _ in rows]


def _cells(line: str) -> list[str]:
    """The cells of a line; those of a spreadsheet may stand in quotes, with decimal commas."""
    try:
        return [cell.strip() for row in csv.reader([line], strict=True) for cell in row]
    except csv.Error:  # a quote without its second one: the cell itself tells what is wrong
        return [cell.strip() for cell in line.split(",")]


def _read_slowly(path: Path, header: list[str], header_line: int) -> tuple[Array, list[int]]:
    """All cells, read one by one, raising `FormatError` at the first faulty one.

    Also the columns kept, as indices into ``header``: columns of dates or times of day, which loggers write beside
    ``time_s``, are left out.
    """
    lines, numbers = _data_lines(path, header_line)
    rows = [_cells(line) for line in lines]
    for row, number in zip(rows, numbers, strict=True):
        if len(row) != len(header):
            raise FormatError(
                f"{path}, line {number} has {len(row)} cells where the header names {len(header)} columns: mend or"
                " remove that line"
            )
    used = [
        index
        for index, name in enumerate(header)
        if name == "time_s" or not is_moment(next((row[index] for row in rows if not is_missing(row[index])), ""))
    ]
    names = [header[index] for index in used]
    cells = [[row[index] for index in used] for row in rows] if len(used) < len(header) else rows
    return np.column_stack(numbers_of(path, names, cells, numbers).columns), used


def read(path: Path) -> Sheet:
    """Read a plain table; raises `FormatError` naming line and column of any fault."""
    marks, header, header_line = _opening(path)
    require_columns(path, len(header))
    twice = [cell for cell, count in Counter(header).items() if count > 1]
    if twice:
        raise FormatError(f"{path}, line {header_line} names column {twice[0]!r} twice: rename one")
    commas, line_count = _marks(path, header_line)
    # Rows with more cells than the header are left to the slow pass: pandas takes minutes for a line of millions.
    fits = commas <= line_count * (len(header) - 1)
    values = _read_fast(path, header, header_line) if fits else None
    notes = []
    if values is None or commas != values.shape[0] * (len(header) - 1):
        values, used = _read_slowly(path, header, header_line)
        left_out = [name for index, name in enumerate(header) if index not in used]
        if left_out:
            header = [header[index] for index in used]
            notes = [f"time_s is the time: {', '.join(left_out)}, dates or times of day, left out"]
    if values.shape[0] == 0:
        raise InputError(f"{path} holds a header and no data rows: give a file with samples")
    numbers = None
    if line_count != values.shape[0]:  # there are blank lines in between
        numbers = np.array(_data_lines(path, header_line)[1], dtype=np.intp)

    said = remarks(marks)
    roles = {key.removeprefix("role "): role[0] for key, role in said.items() if key.startswith("role ")}
    for column, role in roles.items():
        if role not in _ROLES or column not in header:
            raise FormatError(f"{path}: remark 'role {column}: {role}' names no column or role: correct it")
    units = {cell: said.pop(f"unit {cell}")[0] for cell in header if f"unit {cell}" in said}
    metadata = {
        key: "\n".join(texts)
        for key, texts in said.items()
        if key not in ("name", "unit", "note") and not key.startswith("role ")
    }
    columns = []
    for index, cell in enumerate(header):
        name, unit = plain_title(cell)
        if cell in units:
            unit = units[cell]
            name = cell.removesuffix(f"_{(find_unit(unit) or declared(unit)).suffix}")
        role_of_column = _ROLES[roles[cell]] if cell in roles else None
        columns.append(Column(name, unit, values[:, index], role_of_column, label=cell))
    return Sheet(
        path,
        "plain",
        columns,
        metadata,
        notes=[*said.get("note", []), *notes],
        first_line=header_line + 1,
        recording_name=said.get("name", [None])[0],
        unit_name=said.get("unit", [None])[0],
        lines=numbers,
    )


def _is_foreign(channel: Channel) -> bool:
    """Whether a column's suffix would not give its unit, because the table of units lacks it."""
    return bool(channel.unit.symbol) and split_column(column_name(channel))[1] != channel.unit


def write(recording: Recording, path: Path) -> None:
    """Write ``recording`` with every number in its shortest exact form, and missing samples as empty cells."""
    import pandas as pd

    lines = [("name", recording.name)]
    if recording.unit is not None:
        lines.append(("unit", recording.unit))
    lines += [(key, value) for key, value in recording.metadata.items() if key not in ("name", "unit")]
    channels = list(recording.channels.values())
    # The reader infers roles and units from the names in the header.
    split = [(c.name, c.unit) if _is_foreign(c) else split_column(column_name(c)) for c in channels]
    lines += [(f"unit {column_name(channel)}", channel.unit.symbol) for channel in channels if _is_foreign(channel)]
    units = [unit for _, unit in split]
    roles = roles_of([name for name, _ in split], units)
    only = only_reading(roles, units)  # would be taken as the reading unless its role is stated
    lines += [
        (f"role {column_name(channel)}", channel.role)
        for at, (channel, role) in enumerate(zip(channels, roles, strict=True))
        if channel.role != role or at == only
    ]
    lines += [("note", note) for note in recording.notes]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for key, value in lines:
            file.write(f"# {_quoted(key, key=True)}: {_quoted(str(value))}\n")
        columns = {" ".join(name.splitlines()): values for name, values in recording.columns()}
        pd.DataFrame(columns).to_csv(file, index=False, lineterminator="\n")


FORMAT = Format("plain", "plain table", (".csv", ".txt"), sniff, read, write, asked=1, is_text=True)
