"""The text export of novel's pedar insoles (.asc): 99 pressures in kPa of each foot, left before right.

The export gives neither areas nor positions of its sensors, and which of them lie under the heel depends on the insole.
Therefore none is a unit of a shoe unless the user says so. Layout after the readers of pressuRe (Telfer) and
pedarProbe.
"""

from __future__ import annotations

import re
from pathlib import Path

from smartshoe.errors import FormatError
from smartshoe.files.logs._exported import lines_of, numbers_below
from smartshoe.files.logs._sheet import Column, Format, Sheet

SENSORS = 99  # in an insole
_RATE = re.compile(rb"\[Hz\]\s*:")
_MOST_LINES = 30  # lines above the numbers, at most


def _sniff(path: Path, head: bytes) -> bool:
    return path.suffix.casefold() == ".asc" and bool(_RATE.search(head))


def read(path: Path) -> Sheet:
    """Time and every sensor as ``left_1`` to ``right_99`` in kPa; raises `FormatError` with the faulty line."""
    lines = lines_of(path)
    named = next((k for k, line in enumerate(lines[:_MOST_LINES]) if line.casefold().startswith("time")), None)
    if named is None:
        raise FormatError(f"{path}: no row of names begins with 'time': export it again as ASCII")
    metadata = {}
    for line in lines[:named]:
        key, colon, value = line.partition(":")
        if colon and value.strip():
            metadata[" ".join(key.split())] = " ".join(value.split())
    first = next((k for k in range(named + 1, len(lines)) if lines[k].strip()), len(lines))
    count = len(lines[first].split()) if first < len(lines) else 0
    names = {
        1 + SENSORS: [f"sensor_{k}" for k in range(1, SENSORS + 1)],
        1 + 2 * SENSORS: [f"{side}_{k}" for side in ("left", "right") for k in range(1, SENSORS + 1)],
    }.get(count)
    if names is None:
        raise FormatError(
            f"{path}, line {first + 1} has {count} numbers: a time and {SENSORS} or {2 * SENSORS} pressures are"
            " expected; export it again as ASCII"
        )
    table = numbers_below(path, lines, first, count, None)
    columns = [Column("time", "s", table[:, 0])]
    columns += [Column(name, "kPa", table[:, k], "auxiliary") for k, name in enumerate(names, 1)]
    return Sheet(path, "pedar", columns, metadata, first_line=first + 1)


FORMAT = Format("pedar", "pedar export", (".asc",), _sniff, read, asked=0, is_text=True)
