"""LabVIEW measurement files (.lvm), versions 0.92 and 2, with X columns One, Multi and No."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import FormatError
from smartshoe.files.gate import require_columns
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.recording import Recording, Role

_MAGIC = "LabVIEW Measurement"
_END = "***End_of_Header***"
# Keys of the header that describe the file's layout, not the measurement.
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
    """The decimal mark of the data's cells; raises with line numbers where they use both or contradict the header."""
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
    """A header row's cells, one per channel (every second cell with X_Columns Multi)."""
    return [cells[k * 2 if multi else k] if (k * 2 if multi else k) < len(cells) else "" for k in range(channels)]


@dataclass(frozen=True)
class _SegmentLayout:
    """How the file's cells are to be read; ``width`` cells make a row of ``channels`` signals."""

    path: Path
    separator: str
    x_columns: str
    decimal: str | None

    @property
    def is_multi(self) -> bool:
        return self.x_columns == "multi"

    def width(self, channels: int) -> int:
        return 2 * channels if self.is_multi else channels + 1

    def signals(self, channels: int) -> list[int]:
        """Indices of the cells of a row that are signals; the others are times."""
        return [(2 * k + 1 if self.is_multi else k + 1) for k in range(channels)]


def read(path: Path) -> Sheet:
    """One segment (or several with the same channels, concatenated) as columns, time first.

    Raises `FormatError` with the line for a truncated header, mixed decimal marks or cells that are not numbers.
    """
    lines = _text(path).splitlines()
    general, at = _general_header(path, lines)
    separator = _SEPARATORS.get(general.get("Separator", "Tab").casefold(), "\t")
    layout = _SegmentLayout(
        path, separator, general.get("X_Columns", "One").casefold(), general.get("Decimal_Separator")
    )
    sheet = Sheet(path, "labview", [], {key: value for key, value in general.items() if key not in _LAYOUT})
    segments: list[list[Column]] = []
    while (at := _next_filled(lines, at)) < len(lines):
        columns, at = _segment(layout, lines, at, sheet)
        segments.append(columns)
    if not segments:
        raise FormatError(f"{path} has a header and no data: export the file again")
    sheet.columns = _one_after_the_other(path, segments, sheet.notes)
    sheet.recording_name = sheet.metadata.pop("smartshoe_name", None)
    sheet.unit_name = sheet.metadata.pop("smartshoe_unit", None)
    roles = sheet.metadata.pop("smartshoe_roles", "").split()
    for column, role in zip(sheet.columns[1:], roles, strict=False):
        column.role = cast(Role, role)
    return sheet


def _general_header(path: Path, lines: list[str]) -> tuple[dict[str, str], int]:
    """The header that applies to all segments, and the index of the line below it."""
    general: dict[str, str] = {}
    for at, line in enumerate(lines):
        if line.startswith(_END):
            return general, at + 1
        cells = line.rstrip("\t").split("\t" if "\t" in line else ",")
        if len(cells) > 1:
            general[cells[0]] = cells[1]
    raise FormatError(f"{path}, line {len(lines)}: the header has no end: export the file again")


def _next_filled(lines: list[str], at: int) -> int:
    while at < len(lines) and not lines[at].strip():
        at += 1
    return at


def _one_after_the_other(path: Path, segments: list[list[Column]], notes: list[str]) -> list[Column]:
    first = segments[0]
    if len(segments) == 1:
        return first
    names = [column.name for column in first]
    if any([column.name for column in columns] != names for columns in segments[1:]):
        raise FormatError(
            f"{path} holds {len(segments)} segments with different channels: save them as files of their own"
        )
    notes.append(f"{len(segments)} segments were put one after the other")
    for position, column in enumerate(first):
        column.values = np.concatenate([columns[position].values for columns in segments])
    return first


def _segment(layout: _SegmentLayout, lines: list[str], at: int, sheet: Sheet) -> tuple[list[Column], int]:
    """The columns of the segment whose header begins at line index ``at``, and the index below it."""
    path = layout.path
    header, at = _segment_header(layout, lines, at)
    try:
        channels = int(header["Channels"][0])
    except (KeyError, IndexError, ValueError):
        raise FormatError(f"{path}, line {at + 1}: the segment does not say how many channels it has") from None
    titles = [cell.strip() for cell in lines[at + 1].rstrip("\r").split(layout.separator)]
    if titles and titles[-1] == "Comment":
        titles = titles[:-1]
    width = layout.width(channels)
    if len(titles) != width:
        raise FormatError(f"{path}, line {at + 2}: {len(titles)} column names where {width} belong: export again")
    require_columns(path, width)
    sheet.first_line = sheet.first_line or at + 3
    rows, comments, at = _rows(layout, lines, at + 2, width, header)
    if comments:
        shown = "; ".join(comments[:20]) + (f"; and {len(comments) - 20} more" if len(comments) > 20 else "")
        sheet.metadata["comments"] = shown
    for key in ("Notes", "Date", "Time"):
        if header.get(key):
            sheet.metadata.setdefault(f"segment_{key.lower()}", header[key][0])
    mark = _decimal_mark(path, layout.decimal, rows, width)
    table = [
        np.array([_number(cells[column], mark, path, line, titles[column]) for line, cells in rows])
        for column in range(width)
    ]
    columns = [Column("time", "s", _times(layout, header, table, channels))]
    dropped: list[str] = []
    units = _spread(header.get("Y_Unit_Label", []), channels, layout.is_multi)
    for position, unit in zip(layout.signals(channels), units, strict=True):
        values = table[position]
        if values.size and np.isnan(values).all():
            dropped.append(titles[position])
        else:
            columns.append(Column(titles[position], unit, values))
    if dropped:
        sheet.notes.append(f"channels without samples were left out: {', '.join(dropped)}")
    return columns, at


def _segment_header(layout: _SegmentLayout, lines: list[str], at: int) -> tuple[dict[str, list[str]], int]:
    """A segment's header by key, and the index of its last line."""
    header: dict[str, list[str]] = {}
    while at < len(lines) and not lines[at].startswith(_END):
        cells = lines[at].split(layout.separator)
        header[cells[0]] = [cell.strip() for cell in cells[1:]]
        at += 1
    if at >= len(lines) - 1:
        raise FormatError(f"{layout.path}, line {len(lines)}: the segment's header has no data below it: export again")
    return header, at


def _rows(
    layout: _SegmentLayout, lines: list[str], at: int, width: int, header: dict[str, list[str]]
) -> tuple[list[tuple[int, list[str]]], list[str], int]:
    """The rows (line, cells) up to the next segment or blank line, the texts of the Comment column, the index below."""
    rows: list[tuple[int, list[str]]] = []
    comments: list[str] = []
    while at < len(lines) and lines[at].strip():
        cells = lines[at].split(layout.separator)
        if cells[0] in header or cells[0] == "Channels":
            break
        if len(cells) > width and cells[width].strip():
            comments.append(f"line {at + 1}: {cells[width].strip()}")
        rows.append((at + 1, (cells + [""] * width)[:width]))
        at += 1
    return rows, comments, at


def _times(layout: _SegmentLayout, header: dict[str, list[str]], table: list[Array], channels: int) -> Array:
    """The segment's time (n,) in s: its X column, or the start and step that its header gives."""
    path = layout.path
    if layout.x_columns == "no":
        start = _spread(header.get("X0", []), channels, layout.is_multi)
        step = _spread(header.get("Delta_X", []), channels, layout.is_multi)
        timing = {(_cell(a, path), _cell(b, path)) for a, b in zip(start, step, strict=True) if b}
        if len(timing) != 1:
            raise FormatError(f"{path}: channels have {len(timing)} sample times; export them at one rate")
        x0, dx = timing.pop()
        return np.asarray(x0 + dx * np.arange(table[0].size), dtype=float)
    time_s = table[0]
    if layout.is_multi and any(not np.array_equal(table[2 * k], time_s, equal_nan=True) for k in range(1, channels)):
        raise FormatError(f"{path}: the channels' X columns differ: export them with X_Columns One")
    return time_s


def _cell(text: str, path: Path) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise FormatError(f"{path}: {text!r} among X0 and Delta_X is no number: export again") from None


def write(recording: Recording, path: Path) -> None:
    """Write version 2 with X_Columns One and a decimal point; missing samples are empty cells."""
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


FORMAT = Format("labview", "LabVIEW .lvm file", (".lvm",), _sniff, read, write)
