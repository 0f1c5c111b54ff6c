"""HDF5 in the layout of netCDF-4, so that MATLAB's h5read and xarray (h5netcdf) can open it."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any, cast

import numpy as np

from smartshoe.errors import FormatError
from smartshoe.files.gate import parsed_json
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.files.logs.formats._hdf5_objects import opened, vectors
from smartshoe.recording import Recording

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_OWN = "smartshoe.recording/1"
_LONGEST_TEXT = 10_000  # characters of another writer's attribute


def _sniff(path: Path, head: bytes) -> bool:
    return head.startswith(_SIGNATURE) and path.suffix.casefold() != ".mat"


def read(path: Path) -> Sheet:
    """Every one-dimensional numeric variable along the longest dimension as a column."""
    with opened(path) as file:
        attributes = {key: file.attrs[key] for key in file.attrs if not key.startswith("_")}
        found = [
            (name, dataset[...], dict(dataset.attrs))
            for name, dataset in vectors(path, file, deep=False)
            if dataset.ndim == 1
        ]
    if not found:
        raise FormatError(f"{path} holds no vectors of numbers: write one variable a channel")
    length = max(values.size for _, values, _ in found)
    sheet = Sheet(path, "hdf5", [])
    left_out = [name for name, values, _ in found if values.size != length]
    if left_out:
        sheet.notes.append(f"variables of another length were left out: {', '.join(left_out)}")
    for name, values, about in found:
        if values.size == length:
            role = _text(about["role"]) if "role" in about else None
            sheet.columns.append(Column(name, _text(about.get("units", "")), values.astype(float), cast(Any, role)))
    if _text(attributes.pop("schema", "")) == _OWN:
        sheet.recording_name = _text(attributes["name"])
        sheet.unit_name = _text(attributes["unit"]) if "unit" in attributes else None
        sheet.metadata.update(parsed_json(_text(attributes["metadata"])))
        order = {name: at for at, name in enumerate(parsed_json(_text(attributes["channels"])))}
        sheet.columns.sort(key=lambda column: order.get(column.name, len(order)))
    else:
        sheet.metadata.update({key: _text(value)[:_LONGEST_TEXT] for key, value in attributes.items()})
    sheet.columns.sort(key=lambda column: column.name != "time")
    return sheet


def _text(value: Any) -> str:
    """An attribute as text; accepts bytes and arrays of one element, as other writers store it."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return str(value)


def write(recording: Recording, path: Path) -> None:
    """Write dimension and coordinate ``time`` in s, and a variable per channel with ``units`` and ``role``.

    Missing samples are NaN.
    """
    import h5netcdf

    # Built in memory, since HDF5 on a full disk ends in a segmentation fault.
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        file.attrs["schema"] = _OWN
        file.attrs["name"] = recording.name
        if recording.unit is not None:
            file.attrs["unit"] = recording.unit
        file.attrs["metadata"] = json.dumps(dict(recording.metadata), ensure_ascii=False)
        file.attrs["channels"] = json.dumps(list(recording.channels), ensure_ascii=False)
        file.dimensions = {"time": len(recording)}
        time = file.create_variable("time", ("time",), data=recording.time_s)
        # Not 's' alone: xarray takes that as a duration and would convert the numbers to timedelta64.
        time.attrs["units"] = "s"
        for channel in recording.channels.values():
            variable = file.create_variable(channel.name, ("time",), data=channel.with_nan(), fillvalue=np.nan)
            variable.attrs["units"] = channel.unit.symbol
            variable.attrs["quantity"] = channel.unit.quantity
            variable.attrs["role"] = channel.role
    path.write_bytes(content.getbuffer())


FORMAT = Format("hdf5", "HDF5 file", (".h5", ".hdf5", ".nc"), _sniff, read, write)
