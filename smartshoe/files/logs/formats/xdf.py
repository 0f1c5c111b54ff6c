"""XDF files recorded by the Lab Streaming Layer, read by pyxdf: one numeric stream with channel names and units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.errors import FormatError, InputError
from smartshoe.files.logs._sheet import Column, Format, Sheet


def _sniff(path: Path, head: bytes) -> bool:
    return head[:4] == b"XDF:"


def read(path: Path) -> Sheet:
    """The numeric stream with the most samples, on the recorder's synchronised clock, from its first sample on.

    Other streams are named in the notes, markers with their number. Raises `InputError` where pyxdf is not installed,
    `FormatError` where the file has no numeric stream.
    """
    try:
        import pyxdf
    except ImportError as error:
        raise InputError(f"{path} is an XDF file, which needs pyxdf: pip install 'smartshoe[xdf]'") from error
    streams, _ = pyxdf.load_xdf(path, verbose=False)
    numeric = [stream for stream in streams if _is_numeric(stream)]
    if not numeric:
        raise FormatError(f"{path} holds no numeric stream with samples: record the shoe's stream too")
    chosen = max(numeric, key=lambda stream: len(stream["time_stamps"]))
    sheet = Sheet(path, "xdf", [])
    sheet.metadata["stream"] = _text(chosen["info"], "name")
    sheet.metadata["source_id"] = _text(chosen["info"], "source_id")
    for other in streams:
        if other is not chosen and len(other["time_stamps"]):
            what = "channels" if _is_numeric(other) else "markers"
            sheet.notes.append(
                f"stream {_text(other['info'], 'name')!r} with {len(other['time_stamps'])} {what} was left out: it has"
                " a time base of its own"
            )
    stamps = np.asarray(chosen["time_stamps"], dtype=float)
    values = np.asarray(chosen["time_series"], dtype=float).reshape(stamps.size, -1)
    sheet.columns.append(Column("time", "s", stamps - stamps[0]))
    for number, (label, unit) in enumerate(_channels(chosen["info"], values.shape[1])):
        sheet.columns.append(Column(label, unit, values[:, number]))
    return sheet


def _is_numeric(stream: Any) -> bool:
    return _text(stream["info"], "channel_format") != "string" and len(stream["time_stamps"]) > 1


def _text(info: Any, key: str) -> str:
    found = info.get(key)
    while isinstance(found, list):
        found = found[0] if found else None
    return "" if found is None else str(found)


def _channels(info: Any, count: int) -> list[tuple[str, str]]:
    """Label and unit of each channel; its 1-based number where the description gives no label."""
    try:
        described = info["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        described = []
    found = [(_text(channel, "label"), _text(channel, "unit")) for channel in described][:count]
    found += [("", "")] * (count - len(found))
    return [(label or str(number + 1), unit) for number, (label, unit) in enumerate(found)]


FORMAT = Format("xdf", "XDF file", (".xdf",), _sniff, read)
