"""NI TDMS files, read and written by npTDMS."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import FormatError
from smartshoe.files.gate import require_columns, require_values
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.recording import Recording

_PADDING = "channels end at different samples; the shorter ones were filled up with missing samples"


def _sniff(path: Path, head: bytes) -> bool:
    return head[:4] in (b"TDSm", b"TDSh")


def _numbers(values: Any) -> np.ndarray | None:
    """A channel's values as float64; time stamps in seconds from the first one; None where they are not numbers."""
    array = np.asarray(values)
    if array.dtype.kind == "M":
        nanoseconds = array.astype("datetime64[ns]").astype(np.int64)
        return (nanoseconds - nanoseconds[0]) * 1e-9 if array.size else None
    if array.dtype.kind in "biuf":
        return array.astype(np.float64)
    return None


@dataclass(frozen=True, eq=False)
class _Signal:
    """A numeric channel; ``timing`` is (start, step) in s of a waveform, None for other channels."""

    group: str
    name: str
    unit: str
    values: Array
    timing: tuple[float, float] | None
    is_stamps: bool
    role: Any

    @property
    def is_time(self) -> bool:
        return self.is_stamps or self.name.casefold() in ("time", "time_s") or self.unit.casefold() in ("s", "ms")


def read(path: Path) -> Sheet:
    """Every numeric channel as a column; time from ``wf_increment``, a channel of time stamps, or else the index."""
    properties, channels = _loaded(path)
    sheet = Sheet(path, "tdms", [], {str(key): str(value) for key, value in properties.items()})
    signals = _numeric(path, channels, sheet.notes)
    signals = _at_one_rate(signals, sheet.notes)
    length = max(signal.values.size for signal in signals)
    if any(signal.values.size != length for signal in signals):
        sheet.notes.append(_PADDING)
    if not any(signal.is_time for signal in signals):
        sheet.columns.append(_time_column(signals, length, sheet))
    sheet.columns += _columns(signals, length)
    sheet.recording_name = sheet.metadata.pop("smartshoe_name", None)
    sheet.unit_name = sheet.metadata.pop("smartshoe_unit", None)
    return sheet


def _loaded(path: Path) -> tuple[Mapping[str, Any], list[tuple[str, Any]]]:
    """The file's properties and its channels (group, channel), after checking the sizes that they declare."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    log_manager.set_level(logging.ERROR)  # what a truncated file lacks is said here, in one sentence
    with path.open("rb") as content:
        with TdmsFile.open(content) as file:
            lengths = [len(channel) for group in file.groups() for channel in group.channels()]
        require_columns(path, len(lengths))
        require_values(path, sum(lengths), path.stat().st_size, item_bytes=1)
        content.seek(0)
        file = TdmsFile.read(content)
    return file.properties, [(group.name, channel) for group in file.groups() for channel in group.channels()]


def _numeric(path: Path, channels: list[tuple[str, Any]], notes: list[str]) -> list[_Signal]:
    """The numeric channels; raises `FormatError` where there is none, or where a file of our own is truncated."""
    taken = [(group, channel, _numbers(channel[:])) for group, channel in channels]
    left_out = [channel.name for _, channel, values in taken if values is None]
    if left_out:
        notes.append(f"channels that hold no numbers were left out: {', '.join(left_out)}")
    sizes = {values.size for _, _, values in taken if values is not None}
    if any("smartshoe_role" in channel.properties for _, channel in channels) and len(sizes) > 1:
        raise FormatError(f"{path} is truncated: its channels end at different samples; write it again")
    found = [
        _Signal(
            group,
            str(channel.name),
            str(channel.properties.get("unit_string", "")),
            values,
            _timing(channel),
            channel.dtype.kind == "M",
            channel.properties.get("smartshoe_role"),
        )
        for group, channel, values in taken
        if values is not None and values.size
    ]
    if not found:
        raise FormatError(f"{path} holds no numbers: export channels of measured values")
    return found


def _timing(channel: Any) -> tuple[float, float] | None:
    step = float(channel.properties.get("wf_increment", 0.0))
    return (float(channel.properties.get("wf_start_offset", 0.0)), step) if step > 0 else None


def _at_one_rate(signals: list[_Signal], notes: list[str]) -> list[_Signal]:
    """The channels at the sample time of the longest one; decimated copies (LabVIEW SignalExpress) are left out."""
    if len({signal.timing for signal in signals} - {None}) <= 1:
        return signals
    longest = max(signals, key=lambda signal: signal.values.size).timing
    slower = [signal.name for signal in signals if signal.timing != longest]
    notes.append(f"channels at another sample time were left out: {', '.join(slower)}")
    return [signal for signal in signals if signal.timing == longest]


def _time_column(signals: list[_Signal], length: int, sheet: Sheet) -> Column:
    timings = {signal.timing for signal in signals} - {None}
    if timings:
        start, step = timings.pop() or (0.0, 1.0)
        return Column("time", "s", np.asarray(start + step * np.arange(length), dtype=float))
    sheet.metadata["time"] = "sample index"
    sheet.notes.append("the file says nothing of time: the sample's number stands in its place, as if at 1 Hz")
    return Column("time", "s", np.arange(length, dtype=float))


def _columns(signals: list[_Signal], length: int) -> Iterator[Column]:
    counts = Counter(signal.name for signal in signals)
    stamps = [signal for signal in signals if signal.is_stamps]
    for signal in signals:
        padded = np.full(length, np.nan)
        padded[: signal.values.size] = signal.values
        name = signal.name if counts[signal.name] == 1 else f"{signal.group}/{signal.name}"
        if stamps and signal is stamps[0]:
            name = "time"
        yield Column(name, "s" if signal.is_stamps else signal.unit, padded, signal.role)


def write(recording: Recording, path: Path) -> None:
    """Write one group with a time channel and one channel per signal; missing samples are NaN."""
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


FORMAT = Format("tdms", "NI TDMS file", (".tdms",), _sniff, read, write)
