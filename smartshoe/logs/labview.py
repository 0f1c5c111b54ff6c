"""LabVIEW measurement files (.lvm), versions 0.92 and 2, with X columns One, Multi and No."""

from __future__ import annotations

from pathlib import Path
from typing import cast, get_args

import numpy as np

from smartshoe.errors import FormatError
from smartshoe.logs.sheet import Column, Format, Sheet
from smartshoe.recording import Recording, Role

_MAGIC = "LabVIEW Measurement"
_END = "***End_of_Header***"
# Keys of the header that say how the file is laid out, not what was measured.
_LAYOUT = {"LabVIEW Measurement", "Writer_Version", "Reader_Version", "Separator", "Decimal_Separator",
           "Multi_Headings", "X_Columns", "Time_Pref"}  # fmt: skip
_SEPARATORS = {"tab": "\t", "comma": ",", "space": " "}


def _sniff(path: Path, head: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf").startswith(_MAGIC.encode())


def _text(path: Path) -> str:
    raw = path.read_bytes()
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")  # LabVIEW on Windows writes the system's code page


def _decimal_mark(path: Path, declared: str | None, rows: list[tuple[int, list[str]]], numeric: int) -> str:
    """The mark that the data's cells use; refused with line numbers where they use both or contradict the header."""
    first: dict[str, int] = {}
    for line, cells in rows:
        for cell in cells[:numeric]:
            for mark in ".,":
                if mark in cell:
                    first.setdefault(mark, line)
    if len(first) == 2:
        raise FormatError(
            f"{path}: decimal points (line {first['.']}) and decimal commas (line {first[',']}) are mixed: export again"
        )
    if first:
        (mark,) = first
        if declared in (".", ",") and mark != declared:
            raise FormatError(
                f"{path}, line {first[mark]}: the header declares {declared!r} as decimal mark, the data use {mark!r}:"
                " export again"
            )
        return mark
    return declared or "."


def _number(text: str, mark: str, path: Path, line: int, column: str) -> float:
    if not text.strip():
        return np.nan
    try:
        return float(text.replace(mark, "."))
    except ValueError:
        raise FormatError(f"{path}, line {line}: {text!r} in column {column!r} is no number: export again") from None


def _spread(cells: list[str], channels: int, multi: bool) -> list[str]:
    """A header row's cells, one a channel (with X_Columns Multi every second one)."""
    return [cells[k * 2 if multi else k] if (k * 2 if multi else k) < len(cells) else "" for k in range(channels)]


def read(path: Path) -> Sheet:
    """One segment (or several with the same channels, one after the other) as columns, time first.

    Raises `FormatError` with the line for a truncated header, marks that are mixed or cells that are no numbers.
    """
    lines = _text(path).splitlines()
    general: dict[str, str] = {}
    at = 0
    while at < len(lines) and not lines[at].startswith(_END):
        cells = lines[at].rstrip("\t").split("\t" if "\t" in lines[at] else ",")
        if len(cells) > 1:
            general[cells[0]] = cells[1]
        at += 1
    if at == len(lines):
        raise FormatError(f"{path}, line {len(lines)}: the header has no end: export the file again")
    separator = _SEPARATORS.get(general.get("Separator", "Tab").casefold(), "\t")
    x_columns = general.get("X_Columns", "One").casefold()
    sheet = Sheet(path, "labview", [], {key: value for key, value in general.items() if key not in _LAYOUT})
    at += 1
    segments: list[list[Column]] = []
    while True:
        while at < len(lines) and not lines[at].strip():
            at += 1
        if at >= len(lines):
            break
        columns, at = _segment(path, lines, at, separator, x_columns, general.get("Decimal_Separator"), sheet)
        segments.append(columns)
    if not segments:
        raise FormatError(f"{path} has a header and no data: export the file again")
    names = [column.name for column in segments[0]]
    if any([column.name for column in columns] != names for columns in segments[1:]):
        raise FormatError(
            f"{path} holds {len(segments)} segments with different channels: save them as files of their own"
        )
    sheet.columns = segments[0]
    if len(segments) > 1:
        sheet.notes.append(f"{len(segments)} segments were put one after the other")
        for position, column in enumerate(sheet.columns):
            column.values = np.concatenate([columns[position].values for columns in segments])
    sheet.recording_name = sheet.metadata.pop("smartshoe_name", None)
    sheet.unit_name = sheet.metadata.pop("smartshoe_unit", None)
    roles = sheet.metadata.pop("smartshoe_roles", "").split()
    for column, role in zip(sheet.columns[1:], roles, strict=False):
        if role not in get_args(Role):
            raise FormatError(f"{path}: smartshoe_roles names {role!r}: write the file again")
        column.role = cast(Role, role)
    return sheet


def _segment(
    path: Path, lines: list[str], at: int, separator: str, x_columns: str, declared: str | None, sheet: Sheet
) -> tuple[list[Column], int]:
    header: dict[str, list[str]] = {}
    while at < len(lines) and not lines[at].startswith(_END):
        cells = lines[at].split(separator)
        header[cells[0]] = [cell.strip() for cell in cells[1:]]
        at += 1
    if at >= len(lines) - 1:
        raise FormatError(f"{path}, line {len(lines)}: the segment's header has no data below it: export again")
    try:
        channels = int(header["Channels"][0])
    except (KeyError, IndexError, ValueError):
        raise FormatError(f"{path}, line {at + 1}: the segment does not say how many channels it has") from None
    titles = [cell.strip() for cell in lines[at + 1].rstrip("\r").split(separator)]
    if titles and titles[-1] == "Comment":
        titles = titles[:-1]
    multi = x_columns == "multi"
    width = 2 * channels if multi else channels + 1
    if len(titles) != width:
        raise FormatError(f"{path}, line {at + 2}: {len(titles)} column names where {width} belong: export again")
    at += 2
    sheet.first_line = sheet.first_line or at + 1
    rows: list[tuple[int, list[str]]] = []
    comments: list[str] = []
    while at < len(lines) and lines[at].strip():
        cells = lines[at].split(separator)
        if cells[0] in header or cells[0] == "Channels":
            break
        if len(cells) > width and cells[width].strip():
            comments.append(f"line {at + 1}: {cells[width].strip()}")
        rows.append((at + 1, (cells + [""] * width)[:width]))
        at += 1
    if comments:
        shown = "; ".join(comments[:20]) + (f"; and {len(comments) - 20} more" if len(comments) > 20 else "")
        sheet.metadata["comments"] = shown
    for key in ("Notes", "Date", "Time"):
        if header.get(key):
            sheet.metadata.setdefault(f"segment_{key.lower()}", header[key][0])
    mark = _decimal_mark(path, declared, rows, width)
    table = {
        column: np.array([_number(cells[column], mark, path, line, titles[column]) for line, cells in rows])
        for column in range(width)
    }
    units = _spread(header.get("Y_Unit_Label", []), channels, multi)
    signals = [(2 * k + 1 if multi else k + 1) for k in range(channels)]
    if x_columns == "no":
        start = _spread(header.get("X0", []), channels, multi)
        step = _spread(header.get("Delta_X", []), channels, multi)
        timing = {(_cell(a, path), _cell(b, path)) for a, b in zip(start, step, strict=True) if b}
        if len(timing) != 1:
            raise FormatError(f"{path}: channels have {len(timing)} sample times; export them at one rate")
        x0, dx = timing.pop()
        time_s = np.asarray(x0 + dx * np.arange(len(rows)), dtype=float)
    else:
        time_s = table[0]
        if multi and any(not np.array_equal(table[2 * k], time_s, equal_nan=True) for k in range(1, channels)):
            raise FormatError(f"{path}: the channels' X columns differ: export them with X_Columns One")
    columns = [Column("time", "s", time_s)]
    dropped: list[str] = []
    for position, unit in zip(signals, units, strict=True):
        values = table[position]
        if values.size and np.isnan(values).all():
            dropped.append(titles[position])
            continue
        columns.append(Column(titles[position], unit, values))
    if dropped:
        sheet.notes.append(f"channels without samples were left out: {', '.join(dropped)}")
    return columns, at


def _cell(text: str, path: Path) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise FormatError(f"{path}: {text!r} among X0 and Delta_X is no number: export again") from None


def write(recording: Recording, path: Path) -> None:
    """Version 2, X_Columns One, decimal point; missing samples are empty cells."""
    channels = list(recording.channels.values())
    count = len(channels)

    def row(key: str, cells: list[str]) -> str:
        return "\t".join([key, *cells, ""])

    step = repr(float(recording.sample_time_s)) if len(recording) > 1 else "0.0"
    lines = [
        f"{_MAGIC}\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
    ]
    metadata = {**recording.metadata, "smartshoe_name": recording.name}
    if recording.unit is not None:
        metadata["smartshoe_unit"] = recording.unit
    metadata["smartshoe_roles"] = " ".join(channel.role for channel in channels)
    lines += [
        f"{' '.join(key.split())}\t{' '.join(value.split())}" for key, value in metadata.items() if key not in _LAYOUT
    ]
    lines += [
        f"{_END}\t",
        "\t",
        row("Channels", [str(count)]),
        row("Samples", [str(len(recording))] * count),
        row("Y_Unit_Label", [channel.unit.symbol for channel in channels]),
        row("X_Dimension", ["Time"] * count),
        row("X0", ["0.0000000000000000E+0"] * count),
        row("Delta_X", [step] * count),
        row(_END, [""] * (count - 1)),
        "\t".join(["X_Value", *(channel.name for channel in channels), "Comment"]),
    ]
    signals = [recording.time_s.tolist(), *(channel.with_nan().tolist() for channel in channels)]
    lines += [
        "\t".join("" if value != value else repr(value) for value in values) for values in zip(*signals, strict=True)
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


FORMAT = Format("labview", (".lvm",), _sniff, read, write)
