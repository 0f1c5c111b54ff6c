"""HDF5 in netCDF-4's layout, so that MATLAB's h5read and xarray (h5netcdf) open it."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from smartshoe.errors import FormatError
from smartshoe.logs.hdf5_objects import opened, vectors
from smartshoe.logs.sheet import Column, Format, Sheet
from smartshoe.recording import Recording

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_OWN = "smartshoe.recording/1"


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
            role = about.get("role")
            sheet.columns.append(
                Column(name, str(about.get("units", "")), values.astype(float), None if role is None else str(role))  # type: ignore[arg-type]
            )
    sheet.columns.sort(key=lambda column: column.name != "time")
    if str(attributes.pop("schema", "")) == _OWN:
        sheet.recording_name = str(attributes["name"])
        sheet.unit_name = str(attributes["unit"]) if "unit" in attributes else None
        sheet.metadata.update(json.loads(str(attributes["metadata"])))
        order = json.loads(str(attributes["channels"]))
        sheet.columns.sort(key=lambda column: -1 if column.name == "time" else order.index(column.name))
    else:
        sheet.metadata.update({key: str(value) for key, value in attributes.items()})
    return sheet


def write(recording: Recording, path: Path) -> None:
    """Dimension and coordinate ``time`` in s, one variable a channel with ``units`` and ``role``, NaN where missing."""
    import h5netcdf

    # Made in memory: HDF5 on a full disk ends in a segmentation fault.
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
        # Not 's' alone: xarray takes that for a duration and would turn the numbers into timedelta64.
        time.attrs["units"] = "s"
        for channel in recording.channels.values():
            variable = file.create_variable(channel.name, ("time",), data=channel.with_nan(), fillvalue=np.nan)
            variable.attrs["units"] = channel.unit.symbol
            variable.attrs["quantity"] = channel.unit.quantity
            variable.attrs["role"] = channel.role
    path.write_bytes(content.getbuffer())


FORMAT = Format("hdf5", (".h5", ".hdf5", ".nc"), _sniff, read, write)
