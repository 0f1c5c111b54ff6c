"""NI TDMS files, by npTDMS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.errors import FormatError
from smartshoe.logs.sheet import Column, Format, Sheet
from smartshoe.recording import Recording

_PADDING = "channels end at different samples; the shorter ones were filled up with missing samples"


def _sniff(path: Path, head: bytes) -> bool:
    return head[:4] in (b"TDSm", b"TDSh")


def _numbers(values: Any) -> np.ndarray | None:
    """A channel's values as float64; time stamps in seconds from the first one; None where they are no numbers."""
    array = np.asarray(values)
    if array.dtype.kind == "M":
        nanoseconds = array.astype("datetime64[ns]").astype(np.int64)
        return (nanoseconds - nanoseconds[0]) * 1e-9 if array.size else None
    if array.dtype.kind in "biuf":
        return array.astype(np.float64)
    return None


def _timing(channel: Any) -> tuple[float, float] | None:
    """Start offset and step in s of a waveform channel; None for one that is none."""
    step = float(channel.properties.get("wf_increment", 0.0))
    return (float(channel.properties.get("wf_start_offset", 0.0)), step) if step > 0 else None


def read(path: Path) -> Sheet:
    """Every numeric channel as a column; time from ``wf_increment``, a channel of time stamps, or else the index."""
    from nptdms import TdmsFile

    try:
        file = TdmsFile.read(path)
        groups = file.groups()
        raw = [(group.name, channel) for group in groups for channel in group.channels()]
        taken = [(group, channel, _numbers(channel[:])) for group, channel in raw]
    except (ValueError, KeyError, OSError, EOFError, IndexError, TypeError, NotImplementedError) as error:
        raise FormatError(f"{path} is truncated or no TDMS file ({error}): export it again") from error
    sheet = Sheet(path, "tdms", [])
    for key, value in file.properties.items():
        sheet.metadata[str(key)] = str(value)
    left_out = [channel.name for _, channel, values in taken if values is None]
    if left_out:
        sheet.notes.append(f"channels that hold no numbers were left out: {', '.join(left_out)}")
    kept = [(group, channel, values) for group, channel, values in taken if values is not None and values.size]
    own = any("smartshoe_role" in channel.properties for _, channel in raw)
    if own and len({len(values) for _, _, values in taken if values is not None}) > 1:
        raise FormatError(f"{path} is truncated: its channels end at different samples; write it again")
    if not kept:
        raise FormatError(f"{path} holds no numbers: export channels of measured values")
    timings = {_timing(channel) for _, channel, _ in kept} - {None}
    if len(timings) > 1:
        # Decimated copies beside the data (LabVIEW SignalExpress): the channels that go with the longest one stay.
        longest = _timing(max(kept, key=lambda item: item[2].size)[1])
        slower = [channel.name for _, channel, _ in kept if _timing(channel) != longest]
        kept = [item for item in kept if _timing(item[1]) == longest]
        sheet.notes.append(f"channels at another sample time were left out: {', '.join(slower)}")
        timings = {longest}
    length = max(values.size for _, _, values in kept)
    if any(values.size != length for _, _, values in kept):
        sheet.notes.append(_PADDING)
    names = [channel.name for _, channel, _ in kept]
    stamps = [column for column, (_, channel, _) in enumerate(kept) if channel.dtype.kind == "M"]
    has_time = bool(stamps) or any(
        name.casefold() in ("time", "time_s")
        or str(channel.properties.get("unit_string", "")).casefold() in ("s", "ms")
        for name, (_, channel, _) in zip(names, kept, strict=True)
    )
    if timings and not has_time:
        start, step = timings.pop() or (0.0, 1.0)
        sheet.columns.append(Column("time", "s", np.asarray(start + step * np.arange(length), dtype=float)))
    elif not has_time:
        sheet.columns.append(Column("time", "s", np.arange(length, dtype=float)))
        sheet.metadata["time"] = "sample index"
        sheet.notes.append("the file says nothing of time: the sample's number stands in its place, as if at 1 Hz")
    for column, (group, channel, values) in enumerate(kept):
        padded = np.full(length, np.nan)
        padded[: values.size] = values
        name = channel.name if names.count(channel.name) == 1 else f"{group}/{channel.name}"
        unit = "s" if column in stamps else str(channel.properties.get("unit_string", ""))
        if column in stamps and column == stamps[0]:
            name = "time"
        role = channel.properties.get("smartshoe_role")
        sheet.columns.append(Column(name, unit, padded, role))
    sheet.recording_name = sheet.metadata.pop("smartshoe_name", None)
    sheet.unit_name = sheet.metadata.pop("smartshoe_unit", None)
    return sheet


def write(recording: Recording, path: Path) -> None:
    """One group with a time channel and one channel a signal; missing samples are NaN."""
    from nptdms import ChannelObject, RootObject, TdmsWriter

    properties = {**recording.metadata, "smartshoe_name": recording.name}
    if recording.unit is not None:
        properties["smartshoe_unit"] = recording.unit
    channels = [ChannelObject("recording", "time", recording.time_s, properties={"unit_string": "s"})]
    channels += [
        ChannelObject(
            "recording",
            channel.name,
            channel.with_nan(),
            properties={"unit_string": channel.unit.symbol, "smartshoe_role": channel.role},
        )
        for channel in recording.channels.values()
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment([RootObject(properties=properties), *channels])


FORMAT = Format("tdms", (".tdms",), _sniff, read, write)
