"""The text export of Moticon's OpenGo insoles: for each foot sixteen pressures, total force and centre of pressure."""

from __future__ import annotations

import re
from pathlib import Path

from smartshoe.errors import FormatError
from smartshoe.files.logs._exported import lines_of, numbers_below
from smartshoe.files.logs._sheet import Column, Format, Sheet

_HEADER = "# time\t"
_TITLE = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]\s*")
KPA_PER_N_CM2 = 10.0


def _sniff(path: Path, head: bytes) -> bool:
    return head.startswith(b"#") and b"# Sensor insoles:" in head


def read(path: Path) -> Sheet:
    """Every column, pressures in kPa; raises `FormatError` with the faulty line."""
    lines = lines_of(path)
    at = next((k for k, line in enumerate(lines) if line.startswith(_HEADER)), None)
    if at is None:
        raise FormatError(f"{path}, line {len(lines)}: no row of names begins with '# time': export it again")
    metadata = {}
    for line in lines[:at]:
        key, _, value = line.lstrip("# ").partition(":")
        metadata[key.strip().casefold().replace(" ", "_")] = value.strip()
    titles = lines[at].removeprefix("# ").split("\t")
    table = numbers_below(path, lines, at + 1, len(titles), "\t")
    columns = [Column("time", "s", table[:, 0])]
    for k, title in enumerate(titles[1:], 1):
        found = _TITLE.fullmatch(title)
        name, unit = (found["name"], found["unit"]) if found else (title, "")
        values = table[:, k]
        if unit == "N/cm²":
            values, unit = KPA_PER_N_CM2 * values, "kPa"
        if name.endswith("total force"):
            name = name.replace("total force", "total")
        columns.append(Column(name.replace(" ", "_"), "" if "..." in unit else unit, values, "auxiliary", title))
    return Sheet(path, "opengo", columns, metadata, first_line=at + 2)


FORMAT = Format("opengo", "OpenGo export", (), _sniff, read, is_text=True)
