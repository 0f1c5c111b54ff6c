"""Text files: their encoding, their lines, their cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from smartshoe.errors import FormatError, InputError
from smartshoe.recording import split_column
from smartshoe.units import ONE, find_unit

_BOMS = (
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
_BRACKETED = re.compile(r"(.*?)\s*[\[(（]([^\[\]()（）]*)[\])）]\s*")
_AFTER_COMMA = re.compile(r"(.*\S)\s*,\s*([^,\s]+)\s*")
_HIGH_RUNS = re.compile(rb"[\x80-\xff]+")


def is_text(head: bytes) -> bool:
    """Whether a file that begins with ``head`` can be text: a byte order mark, or no control bytes."""
    if any(head.startswith(mark) for mark, _ in _BOMS):
        return True
    return not re.search(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]", head)


def _is_gb2312(run: bytes) -> bool:
    # Every common Chinese character and symbol is a pair of bytes A1..F7, A1..FE. Latin letters with accents in
    # cp1250 lie between ASCII letters, which shows in runs of odd length and low second bytes.
    return len(run) % 2 == 0 and all(
        0xA1 <= a <= 0xF7 and 0xA1 <= b <= 0xFE for a, b in zip(run[::2], run[1::2], strict=True)
    )


def encoding_of(data: bytes) -> tuple[str, str | None]:
    """The encoding of ``data`` and, where it was chosen by plausibility, a sentence about that."""
    for mark, encoding in _BOMS:
        if data.startswith(mark):
            return encoding, None
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        pass
    else:
        return "utf-8", None
    runs = _HIGH_RUNS.findall(data)
    order = ("gb18030", "cp1250") if all(map(_is_gb2312, runs)) else ("cp1250", "gb18030")
    for encoding in order:
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            continue
        return (
            encoding,
            f"The text is not UTF-8 and was read as {encoding}, the likelier of cp1250 and gb18030.",
        )
    raise UnicodeDecodeError("utf-8", data, 0, 1, "neither UTF-8, UTF-16, cp1250 nor GB18030")


def read_lines(path: Path) -> tuple[list[str], list[str]]:
    """The lines of the text file at ``path`` without line ends, and notes on its encoding.

    Raises `InputError` where it cannot be read, `FormatError` where it is not text.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its permissions") from error
    try:
        encoding, note = encoding_of(data)
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise FormatError(f"{path} is no text in UTF-8, UTF-16, cp1250 or GB18030: save it as UTF-8") from error
    if "\x00" in text:
        line = text[: text.index("\x00")].count("\n") + 1
        raise FormatError(f"{path}, line {line} holds binary zeros: export the file again")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return lines, [note] if note else []


def head_lines(head: bytes) -> list[str]:
    """The complete lines in the first bytes ``head`` of a text file; none for an unknown encoding."""
    try:
        encoding, _ = encoding_of(head[: head.rfind(b"\n") + 1] if b"\x00" not in head else head)
        text = head.decode(encoding, errors="replace")
    except UnicodeDecodeError:
        return []
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def split_cells(lines: Sequence[str], delimiter: str | None) -> list[list[str]]:
    """The cells of each line, stripped and unquoted; ``delimiter`` None is any run of blanks."""
    if delimiter is None:
        return [line.split() for line in lines]
    if any('"' in line for line in lines):
        # An unclosed quote would absorb the lines below it; such lines are read one by one.
        whole = all(line.count('"') % 2 == 0 for line in lines)
        rows = csv.reader(lines, delimiter=delimiter) if whole else (
            next(csv.reader([line], delimiter=delimiter), []) for line in lines
        )  # fmt: skip
        return [[cell.strip() for cell in row] for row in rows]
    return [[cell.strip() for cell in line.split(delimiter)] for line in lines]


def even_rows(path: Path, rows: list[list[str]], lines: Sequence[int], width: int) -> list[list[str]]:
    """``rows`` cut to ``width`` cells.

    Raises `FormatError` where a row has fewer, or further cells that are not empty.
    """
    even: list[list[str]] = []
    for row, line in zip(rows, lines, strict=True):
        if len(row) < width or any(row[width:]):
            raise FormatError(
                f"{path}, line {line} has {len(row)} cells where {width} are expected: mend or remove that line"
            )
        even.append(row if len(row) == width else row[:width])
    return even


def bracketed(title: str) -> tuple[str, str]:
    """A title as name and unit's text: ``Time[s]``, ``Force (N)``, ``Force, N``; without a unit the title and ''."""
    match = _BRACKETED.fullmatch(title)
    if match and match[1]:
        return match[1], match[2].strip()
    match = _AFTER_COMMA.fullmatch(title)
    return (match[1], match[2]) if match and find_unit(match[2]) is not None else (title, "")


def plain_title(title: str) -> tuple[str, str]:
    """A plain table's title as name and unit's symbol: ``force_n``, or with a known unit in the form of `bracketed`.

    A number in brackets is part of the name, and so is any other text there, since the name is the user's own.
    """
    name, unit = split_column(title)
    if unit is None:
        name, text = bracketed(title)
        unit = find_unit(text)
        if unit is None or unit == ONE:
            return title, ""
    return name, unit.symbol
