"""MATLAB MAT-files: level 5 to 7 by scipy, 7.3 (HDF5) by h5py. No object is unpickled."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.errors import FormatError
from smartshoe.files.gate import parsed_json
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.files.logs.formats._hdf5_objects import opened, vectors
from smartshoe.files.logs.formats._mat5 import require_bounded
from smartshoe.recording import Recording, column_name, split_column

_HDF5 = b"\x89HDF\r\n\x1a\n"


def _sniff(path: Path, head: bytes) -> bool:
    return head.startswith(b"MATLAB ") or (path.suffix.casefold() == ".mat" and head.startswith(b"\x89HDF"))


def _flatten(name: str, value: Any) -> list[tuple[str, np.ndarray]]:
    """Numeric arrays of a variable: structs are expanded as NAME.FIELD, matrices as NAME:1, NAME:2, ..."""
    array = np.asarray(value)
    if array.dtype.names:
        item = array.reshape(-1)[0] if array.size else None
        if item is None:
            return []
        return [pair for field in array.dtype.names for pair in _flatten(f"{name}.{field}", item[field])]
    if array.dtype.kind == "O":
        return _flatten(name, array.item()) if array.size == 1 else []
    if array.dtype.kind not in "biuf":
        return []
    array = np.squeeze(array)
    if array.ndim < 2:
        return [(name, np.atleast_1d(array).astype(float))]
    if array.ndim == 2:
        if array.shape[0] < array.shape[1]:
            array = array.T
        return [(f"{name}:{column + 1}", array[:, column].astype(float)) for column in range(array.shape[1])]
    return []


def _is_hdf5(path: Path) -> bool:
    """Whether the file is of level 7.3, which is HDF5, in MATLAB's own files after a header of 512 bytes."""
    with path.open("rb") as file:
        head = file.read(512 + len(_HDF5))
    return head.startswith(_HDF5) or head.endswith(_HDF5)


def _load(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    if _is_hdf5(path):
        return _load_hdf5(path)
    require_bounded(path)
    return {k: v for k, v in loadmat(path).items() if not k.startswith("__")}


def _load_hdf5(path: Path) -> dict[str, Any]:
    with opened(path) as file:
        return {
            name.replace("/", "."): dataset[...]
            for name, dataset in vectors(path, file, deep=True)
            if not name.startswith("#")
        }


def read(path: Path) -> Sheet:
    """Vectors of one length as columns: the longest length that more than one vector has, else the longest.

    Others are left out with a note. A scalar ``Ts`` (sample time) or ``fs`` (rate) gives a time column if no vector is
    called time.
    """
    loaded = _load(path)
    about = loaded.pop("smartshoe", None)
    arrays = [pair for name, value in loaded.items() for pair in _flatten(name, value)]
    vectors_ = [(name, values) for name, values in arrays if values.size > 1 or about is not None]
    if not vectors_:
        raise FormatError(f"{path} holds no vectors of numbers: save one variable a channel")
    counts = Counter(values.size for _, values in vectors_)
    shared = [size for size, count in counts.items() if count > 1]
    length = max(shared or counts)
    sheet = Sheet(path, "matlab", [])
    left_out = [name for name, values in vectors_ if values.size != length]
    if left_out:
        shown = ", ".join(left_out[:8]) + (", ..." if len(left_out) > 8 else "")
        sheet.notes.append(f"variables of another length than {length} were left out: {shown}")
    of_one_length = [(name, values) for name, values in vectors_ if values.size == length]
    if about is not None:
        sheet.columns = _own_columns(sheet, about, of_one_length)
    else:
        sheet.columns = [*_sampled(arrays, length), *(_column(name, values) for name, values in of_one_length)]
    return sheet


def _own_columns(sheet: Sheet, about: Any, vectors_: list[tuple[str, np.ndarray]]) -> list[Column]:
    """The columns as `write` described them; a damaged description may raise anything."""
    own = parsed_json(str(np.asarray(about).item()))
    sheet.recording_name, sheet.unit_name = own["name"], own["unit"]
    sheet.metadata.update(own["metadata"])
    columns = []
    for name, values in vectors_:
        said = own["columns"].get(name)
        columns.append(Column(said["name"], said["unit"], values, said["role"]) if said else _column(name, values))
    return columns


def _column(name: str, values: np.ndarray) -> Column:
    plain, unit = split_column(name)
    return Column(plain, unit.symbol, values) if unit else Column(name, "", values)


def _sampled(arrays: list[tuple[str, np.ndarray]], length: int) -> list[Column]:
    """A time column from the scalars Ts or fs, for use where no vector is the time."""
    if any(name.rsplit(".", 1)[-1].casefold() in ("t", "time", "time_s") for name, values in arrays if values.size > 1):
        return []
    scalars = {name.casefold(): float(values[0]) for name, values in arrays if values.size == 1}
    step = scalars.get("ts") or (1.0 / scalars["fs"] if scalars.get("fs") else None)
    if step is None or not step > 0:
        return []
    return [Column("time", "s", np.asarray(step * np.arange(length), dtype=float))]


def write(recording: Recording, path: Path) -> None:
    """Write variables named like a plain table's columns, and ``smartshoe``: JSON with name, unit, roles, metadata."""
    from scipy.io import savemat

    columns: dict[str, Any] = {"time_s": {"name": "time", "unit": "s", "role": None}}
    variables: dict[str, Any] = {"time_s": recording.time_s[:, None]}
    for index, channel in enumerate(recording.channels.values()):
        name = column_name(channel)
        if not (name.isidentifier() and name.isascii() and len(name) <= 63 and not name.startswith("_")):
            name = f"channel_{index + 1}"  # MATLAB's names consist of letters, digits and _ only
        variables[name] = channel.with_nan()[:, None]
        columns[name] = {"name": channel.name, "unit": channel.unit.symbol, "role": channel.role}
    about = {
        "name": recording.name,
        "unit": recording.unit,
        "metadata": dict(recording.metadata),
        "columns": columns,
    }
    variables["smartshoe"] = json.dumps(about)
    with path.open("wb") as file:
        savemat(file, variables, do_compression=True)  # type: ignore[arg-type]  # any binary file will do


FORMAT = Format("matlab", "MATLAB MAT-file", (".mat",), _sniff, read, write)
