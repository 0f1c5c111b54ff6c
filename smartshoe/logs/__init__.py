"""Vendor files to `Recording` and back: `read` and `write` for every format, told by content first, suffix second."""

from __future__ import annotations

import csv
import importlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from smartshoe.atomic import replacing
from smartshoe.errors import FormatError, InputError, UsageError
from smartshoe.gate import require_regular_file
from smartshoe.logs.sheet import Format
from smartshoe.recording import Recording

# The order in which formats are asked: those with an unmistakable beginning first, any delimited text last.
_MODULES = (
    "tdms",
    "xdf",
    "labview",
    "matlab",
    "hdf5",
    "parquet",
    "loadsol",
    "opengo",
    "opensim",
    "plain",
    "bluehill",
    "foreign",
)
_HEAD_BYTES = 1 << 16


def _formats() -> Iterator[Format]:
    for module in _MODULES:
        yield importlib.import_module(f"smartshoe.logs.{module}").FORMAT


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
    """The format of the file at ``path``; raises `InputError` where it cannot be read, `FormatError` where no
    format fits."""
    path = Path(path)
    head = _head(path)
    for format_ in _formats():
        if format_.sniff(path, head):
            return format_
    for format_ in _formats():
        # A text suffix on a file that is no text says nothing; others give a reader that can name the fault.
        if path.suffix.casefold() in format_.suffixes and format_.name not in (
            "plain",
            "bluehill",
            "foreign",
        ):
            return format_
    raise FormatError(
        f"{path} is binary and in no known format: give a plain table, Bluehill CSV, LabVIEW .lvm, NI .tdms,"
        " MATLAB .mat, HDF5, Parquet or delimited text file"
    )


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

    ``time``, ``force`` and ``sensors`` choose columns where names and units do not tell: ``NAME``, ``NAME[unit]``
    or, by 1-based number, ``3`` and ``3[bar]``; the time also ``rows[49Hz]``, or ``NAME[49Hz]`` for a column that
    counts samples at that rate. A reference that is a pressure is taken for the force on 1 cm². Where the file is
    ``partly`` what the choices are of (one of two logs), those that name no column of it are passed over. ``unit``
    names the sensing unit (``left_toe``) and ``name`` the recording in place of what the file says. Raises
    `InputError` and its kin, naming file and line.
    """
    from smartshoe.logs.columns import recording_from

    path = Path(path)
    try:
        sheet = detect(path).read(path)
    except csv.Error as error:
        raise FormatError(f"{path} is no table of numbers ({error}): export it again") from error
    chosen = (sensors,) if isinstance(sensors, str) else tuple(sensors)
    return recording_from(sheet, time=time, force=force, sensors=chosen, unit=unit, name=name, partly=partly)


def write(recording: Recording, path: Path | str) -> None:
    """Write ``recording`` in the format that the suffix of ``path`` names, whole or not at all.

    ``.csv`` and ``.txt`` are the plain table. Raises `UsageError` for a suffix that no writable format has.
    """
    path = Path(path)
    suffixes: list[str] = []
    for module in ("plain", *(name for name in _MODULES if name != "plain")):
        format_: Format = importlib.import_module(f"smartshoe.logs.{module}").FORMAT
        if format_.write is None:
            continue
        suffixes += format_.suffixes
        if path.suffix.casefold() in format_.suffixes:
            with replacing(path) as temporary:
                format_.write(recording, temporary)
            return
    raise UsageError(
        f"{path} has no suffix of a writable format: end it in one of {', '.join(dict.fromkeys(suffixes))}"
    )


__all__ = ["detect", "read", "write"]
