"""The text export of novel's loadsol insoles: heel, medial, lateral and total force of each foot."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import counted
from smartshoe.errors import FormatError
from smartshoe.files.logs._exported import lines_of, numbers_below
from smartshoe.files.logs._sheet import Column, Format, Sheet

_SENSOR = re.compile(r"(?P<serial>\w+)-(?P<side>[LR])(::(?P<part>\w+))?")
_SIDES = {"L": "left", "R": "right"}
# The insole has no unit under toe or metatarsals: its front zones measure whatever is above them.
_ZONES = {"heel": "heel", "medial": "meta1", "lateral": "meta4", None: "total"}
_PREAMBLE = 4
_LOST_N = -1.0  # value of a zone whose packet did not arrive; the total is 0 there


def _sniff(path: Path, head: bytes) -> bool:
    return head.split(b"\n", 1)[0].strip().endswith(b".loadflux")


def read(path: Path) -> Sheet:
    """Every column, on the first insole's clock; raises `FormatError` with the faulty line."""
    lines = lines_of(path)
    if len(lines) < _PREAMBLE:
        raise FormatError(f"{path}, line {len(lines)}: the header has no end: export it again")
    names, units = lines[2].split("\t"), lines[3].split("\t")
    # The column after the last unit contains remarks.
    width = max((k + 1 for k, unit in enumerate(units[: len(names)]) if unit.strip()), default=0)
    table = numbers_below(path, lines, _PREAMBLE, width, "\t")
    clocks = [k for k in range(width) if units[k].strip().casefold().startswith("time")]
    if not clocks:
        raise FormatError(f"{path}, line 4 names no time column: export it again")
    for k in clocks:
        table[:, k] = _even(table[:, k])
    time_s, clock, moved = table[:, clocks[0]], clocks[0], False
    columns = [Column("time", "s", time_s)]
    lost = _lost(names[:width], table)
    serials: dict[str, str] = {}
    for k in range(width):
        if k in clocks:
            clock = k
            continue
        found = _SENSOR.fullmatch(names[k].strip())
        if found is None:
            continue
        side, part = _SIDES[found["side"]], found["part"]
        serials[f"{side}_insole"] = f"{found['serial']}-{found['side']}"
        values = table[:, k].copy()
        if clock != clocks[0] and not np.array_equal(table[:, clock], time_s):
            values, moved = np.interp(time_s, table[:, clock], values), True
        if part in _ZONES:
            zone = _ZONES[part]
            values = np.where(lost[side], np.nan, values)
            columns.append(Column(f"{side}_{zone}", "N", values, "auxiliary" if zone == "total" else "sensor"))
        else:
            columns.append(Column(f"{side}_{part}", units[k].strip().strip("[]"), values, "auxiliary"))
    notes = ["The zones heel, medial and lateral are taken as heel, meta1 and meta4."]
    for side, rows in lost.items():
        if rows.any():
            lost_samples = counted(int(rows.sum()), "sample")
            notes.append(f"{lost_samples} of the {side} insole did not arrive (-1 in its zones): missing.")
    if moved:
        notes.append("The insoles' clocks differ: the second was put on the first one's times.")
    comment = lines[1].removeprefix("comment").strip()
    metadata = {"file": lines[0].strip(), **({"comment": comment} if comment else {}), **serials}
    return Sheet(path, "loadsol", columns, metadata, notes, first_line=_PREAMBLE + 1)


def _even(time_s: Array) -> Array:
    """Evenly spaced times (n,), freed of the steps of 0 and 2 sampling times that the program's rounding causes.

    Unchanged where a time is further off than rounding explains, since the sampling is then not even.
    """
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    even = time_s[0] + step_s * np.arange(time_s.size)
    return even if np.abs(even - time_s).max() <= 1.5 * step_s else time_s


def _lost(names: list[str], table: Array) -> dict[str, Mask]:
    """For each side, a mask (rows,) of the samples where a zone of that insole marks a lost packet."""
    lost = {side: np.zeros(len(table), dtype=bool) for side in _SIDES.values()}
    for k, name in enumerate(names):
        found = _SENSOR.fullmatch(name.strip())
        if found is not None and found["part"] in _ZONES and found["part"] is not None:
            lost[_SIDES[found["side"]]] |= table[:, k] == _LOST_N
    return lost


FORMAT = Format("loadsol", "loadsol export", (), _sniff, read, is_text=True)
