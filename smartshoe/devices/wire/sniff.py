"""Recognises what kind of stream bytes are, to choose a decoder and to explain a failure."""

from __future__ import annotations

import re
from collections import Counter
from itertools import pairwise
from typing import Literal

from smartshoe.devices.wire._framing import is_intact, unframed
from smartshoe.devices.wire.frames import FrameDecoder
from smartshoe.devices.wire.lines import number, split_fields, without_label

Format = Literal["frames", "lines"]
_TEXT = re.compile(rb"[\x20-\x7e\t\r\n]")


def guess(data: bytes) -> Format | None:
    """The format of ``data``: frames if one passes its checksum, lines if one contains numbers, else None."""
    if any(_is_frame(gap) for gap in data.split(b"\0")):
        return "frames"
    # The first line may be incomplete, and so may the last one.
    whole = [line for line in _lines(data)[1:-1] if line]
    numbers = [count for line in whole if (count := _numbers(line)) >= 2]
    if len(numbers) >= 2 and 2 * len(numbers) > len(whole) and _share_of_text(data) > 0.8:
        return "lines"
    return None


def looks_like(data: bytes, columns: int = 5, channels: int = 4) -> str:
    """A clause for an error message: what ``data`` is instead of frames of ``channels`` or lines of ``columns``."""
    if not data:
        return "no bytes at all"
    extremes = Counter(data)[0] + Counter(data)[0xFF]
    if extremes > 0.9 * len(data):
        return "nothing but 0x00 and 0xFF: likely a wrong baud rate or an open line"
    decoder = FrameDecoder(tuple(f"c{k}" for k in range(channels)))
    decoder.feed(data)
    counters = decoder.counters
    payloads = [payload for gap in data.split(b"\0") if (payload := unframed(gap)) and is_intact(payload)]
    sizes = Counter(len(payload) for payload in payloads if payload[0] == 1)
    if sizes and sizes.most_common(1)[0][0] != 9 + 2 * channels:
        return f"frames of {(sizes.most_common(1)[0][0] - 9) // 2} readings, not {channels}"
    if payloads:
        types = sorted({payload[0] for payload in payloads})
        if counters.unknown_type and not sizes:
            return f"frames of type {', '.join(f'0x{t:02X}' for t in types)}, which this program does not know"
        return f"frames, {len(payloads)} whole and {counters.bad_crc + counters.malformed} damaged"
    if _share_of_text(data) > 0.8:
        return _looks_like_text(data, columns)
    if b"\0" not in data:
        return f"binary without a zero byte in {len(data)}: no frames, likely a wrong baud rate or another protocol"
    if counters.bad_crc:
        return f"{counters.bad_crc} frames, none with a right checksum: another checksum, or a bad line"
    return f"binary, {data.count(0)} zero bytes in {len(data)} but no frame between them: another protocol or baud rate"


def _looks_like_text(data: bytes, columns: int) -> str:
    lines = _lines(data)
    if len(lines) < 2:
        return f"text without an end of line in {len(data)} bytes"
    whole = [line for line in (lines[1:-1] or lines[:1]) if line.strip()]
    counts = Counter(count for line in whole if (count := _numbers(line)))
    if not counts:
        return f"text lines without numbers, such as {whole[0][:40]!r}" if whole else "empty text lines"
    common = counts.most_common(1)[0][0]
    if common != columns:
        is_without_time = " (where is the time? print millis() first)" if common == columns - 1 else ""
        return f"text lines of {common} number{'s' * (common != 1)}, not {columns}{is_without_time}"
    if _repeats(whole):
        return (
            f"text lines of {columns} numbers, the first of which repeats from line to line: where it is the time,"
            " print it finer, with micros() or more decimals"
        )
    return f"text lines of {columns} numbers"


def _repeats(lines: list[str]) -> bool:
    """Whether at least a tenth of the lines begin like the line before."""
    firsts = [split_fields(line)[0] for line in lines]
    same = sum(before == here for before, here in pairwise(firsts))
    return 10 * same >= len(firsts)


def _lines(data: bytes) -> list[str]:
    return data.decode("ascii", errors="replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _numbers(line: str) -> int:
    """The number of numbers in a line, 0 if it contains anything else."""
    fields = split_fields(line.rpartition("*")[0] or line)
    fields = fields[: len(fields) - (not fields[-1])] if fields else fields
    values = [number(without_label(field)) for field in fields if field]
    return len(fields) if values and all(value is not None for value in values) else 0


def _share_of_text(data: bytes) -> float:
    return len(_TEXT.findall(data)) / len(data) if data else 0.0


def _is_frame(gap: bytes) -> bool:
    payload = unframed(gap)
    return payload is not None and len(payload) >= 9 and is_intact(payload)
