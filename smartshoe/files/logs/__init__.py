"""Converts vendors' files to `Recording` and back: `read` and `write`.

Formats are recognised by content, then suffix.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from smartshoe.errors import FormatError, InputError, UsageError
from smartshoe.files.atomic import replacing
from smartshoe.files.gate import foreign_code, require_regular_file
from smartshoe.files.logs._sheet import Column, Format, Sheet, require_sound
from smartshoe.files.logs.formats import formats
from smartshoe.recording import Recording

_HEAD_BYTES = 1 << 16
# First bytes of files that hold other files, and what to do with them.
_PACKED = {
    b"\x1f\x8b": "packed by gzip: unpack it (gunzip)",
    b"BZh": "packed by bzip2: unpack it (bunzip2)",
    b"\xfd7zXZ\0": "packed by xz: unpack it (unxz)",
    b"\x28\xb5\x2f\xfd": "packed by zstd: unpack it (unzstd)",
    b"7z\xbc\xaf\x27\x1c": "a 7z archive: unpack it and name a file of it",
    b"PK\x03\x04": "a zip archive or a workbook: unpack it and name a file of it, or export the sheet as CSV",
}


def _head(path: Path) -> bytes:
    require_regular_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its permissions") from error
    if not head.strip():
        raise InputError(f"{path} is empty: give a file with samples in it")
    return head


def detect(path: Path | str) -> Format:
    """The format of the file at ``path``.

    Raises `InputError` where it cannot be read, `FormatError` where it is in no known format.
    """
    path = Path(path)
    head = _head(path)
    for format_ in formats():
        if format_.sniff(path, head):
            return format_
    for format_ in formats():
        # A text suffix on a binary file is meaningless; other suffixes select a reader that can report the fault.
        if path.suffix.casefold() in format_.suffixes and not format_.is_text:
            return format_
    packed = next((what for begins, what in _PACKED.items() if head.startswith(begins)), None)
    if packed is not None:
        raise FormatError(f"{path} is {packed}")
    *titles, last = (format_.title for format_ in formats())
    raise FormatError(f"{path} is binary and in no known format: give a {', '.join(titles)} or {last}")


def read_sheet(path: Path | str) -> Sheet:
    """The columns of any readable file as they are in it; raises `InputError` and its subclasses.

    All formats' readers, our own and others', run here, so that any failure becomes one sentence.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise UsageError(f"path is of type {type(path).__name__}: give the name of a file")
    path = Path(path)
    format_ = detect(path)
    with foreign_code(path, format_.title, "export it again"):
        sheet = format_.read(path)
    require_sound(sheet)
    return sheet


def read(
    path: Path | str,
    *,
    time: str | None = None,
    force: str | None = None,
    sensors: Sequence[str] = (),
    unit: str | None = None,
    name: str | None = None,
    partly: bool = False,
) -> Recording:
    """Any readable file as a `Recording`.

    Parameters
    ----------
    path
        The file, in any of the formats; recognised by its content, then by its suffix.
    time, force, sensors
        Columns, where names and units are ambiguous: ``NAME``, ``NAME[unit]`` or, by 1-based number, ``3`` and
        ``3[bar]``; the time also ``rows[49Hz]``, or ``NAME[49Hz]`` for a column that counts samples at that rate. A
        reference that is a pressure is taken for the force on 1 cm².
    unit, name
        The sensing unit (``left_toe``) and the recording's name, instead of those in the file.
    partly
        The file is one of two logs: choices that name none of its columns are ignored.

    Raises
    ------
    InputError
        For a file that cannot be read or holds no usable data, naming file and line.

    Examples
    --------
    >>> import smartshoe
    >>> pressed = smartshoe.Recording.from_arrays(time_s=[0.0, 0.1], force_n=[0.0, 5.0], pressure_mbar=[1.0, 2.5])
    >>> smartshoe.write(pressed, "pressed.csv")
    >>> smartshoe.read("pressed.csv")["pressure"].in_unit(smartshoe.units.PASCAL).tolist()
    [100.0, 250.0]
    """
    from smartshoe.files.logs.columns import recording_from

    sheet = read_sheet(path)
    chosen = (sensors,) if isinstance(sensors, str) else tuple(sensors)
    return recording_from(sheet, time=time, force=force, sensors=chosen, unit=unit, name=name, partly=partly)


def write(recording: Recording, path: Path | str) -> None:
    """Write ``recording`` in the format that the suffix of ``path`` names, whole or not at all.

    Parameters
    ----------
    recording
        The recording; numbers are written unchanged, with their units in the columns' names.
    path
        ``.csv`` and ``.txt`` are the plain table.

    Raises
    ------
    UsageError
        For a suffix that no writable format has.
    """
    path = Path(path)
    writable = [format_ for format_ in formats() if format_.write is not None]
    for format_ in writable:
        if format_.write is not None and path.suffix.casefold() in format_.suffixes:
            with replacing(path) as temporary:
                format_.write(recording, temporary)
            return
    suffixes = [suffix for format_ in writable for suffix in format_.suffixes]
    raise UsageError(f"{path} has no suffix of a writable format: end it in one of {', '.join(suffixes)}")


__all__ = ["Column", "Format", "Sheet", "detect", "read", "read_sheet", "write"]
