"""Parquet, one column per channel: for pandas, Polars, DuckDB, MATLAB's ``parquetread``.

Needs the extra ``parquet``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.errors import FormatError, UsageError
from smartshoe.files.gate import parsed_json, require_columns, require_values
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.recording import Recording, column_name, split_column

_MAGIC = b"PAR1"
_OWN = b"smartshoe.recording/1"
_KEY = b"smartshoe"


def _sniff(path: Path, head: bytes) -> bool:
    return head.startswith(_MAGIC)


def _library(path: Path) -> Any:
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise UsageError(
            f"{path} is a Parquet file, which needs pyarrow: pip install 'smartshoe[parquet]', or use .csv or .h5"
        ) from error
    return pyarrow


def read(path: Path) -> Sheet:
    """Every numeric column; units come from the names (``force_n``) unless the file is our own."""
    arrow = _library(path)
    declared = arrow.parquet.read_metadata(path)
    require_columns(path, declared.num_columns)
    require_values(path, declared.num_rows * declared.num_columns, path.stat().st_size)
    with path.open("rb") as file:
        table = arrow.parquet.ParquetFile(file).read()
    sheet = Sheet(path, "parquet", [])
    numeric = [f.name for f in table.schema if arrow.types.is_floating(f.type) or arrow.types.is_integer(f.type)]
    if not numeric:
        raise FormatError(f"{path} has no column of numbers: write one column a channel, time_s among them")
    others = [name for name in table.column_names if name not in numeric]
    if others:
        sheet.notes.append(f"columns that hold no numbers were left out: {', '.join(others)}")
    about = (table.schema.metadata or {}).get(_KEY)
    own = _described(path, about) if about is not None else {}
    for name in numeric:
        values = np.asarray(table.column(name).to_numpy(), dtype=float)
        said = own.get("channels", {}).get(name)
        if said is not None:
            sheet.columns.append(Column(said["name"], said["unit"], values, said["role"]))
        else:
            bare, unit = split_column(name)
            sheet.columns.append(Column(bare, unit.symbol if unit else "", values, label=name))
    if own:
        sheet.recording_name = own["name"]
        sheet.unit_name = own["unit"]
        sheet.metadata.update(own["metadata"])
    return sheet


def _described(path: Path, about: bytes) -> dict[str, Any]:
    try:
        found = parsed_json(about)
        if found["schema"].encode() != _OWN:
            raise ValueError(found["schema"])
        return {key: found[key] for key in ("name", "unit", "metadata", "channels")}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FormatError(f"{path}: the key 'smartshoe' of its metadata is damaged: write the file again") from error


def write(recording: Recording, path: Path) -> None:
    """Write ``time_s`` and one ``name_unit`` column per channel, null where missing.

    The metadata hold units and roles.
    """
    arrow = _library(path)
    arrays = {"time_s": arrow.array(recording.time_s)}
    channels: dict[str, dict[str, str]] = {}
    for channel in recording.channels.values():
        column = column_name(channel)
        channels[column] = {"name": channel.name, "unit": channel.unit.symbol, "role": channel.role}
        arrays[column] = arrow.array(channel.with_nan(), from_pandas=True)
    about = {
        "schema": _OWN.decode(),
        "name": recording.name,
        "unit": recording.unit,
        "metadata": dict(recording.metadata),
        "channels": channels,
    }
    table = arrow.table(arrays).replace_schema_metadata({_KEY: json.dumps(about, ensure_ascii=False).encode()})
    arrow.parquet.write_table(table, path)


FORMAT = Format("parquet", "Parquet file", (".parquet",), _sniff, read, write)
