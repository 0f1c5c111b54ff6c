"""OpenSim's motion and storage files (.mot, .sto): forces, points of application and torques of force plates."""

from __future__ import annotations

from pathlib import Path

from smartshoe.errors import FormatError
from smartshoe.files.logs._exported import lines_of, numbers_below
from smartshoe.files.logs._sheet import Column, Format, Sheet

_END = "endheader"
# OpenSim's ground reaction files have no units; its own convention is N, m and N m.
_UNITS = (("force_v", "N"), ("force_p", "m"), ("torque_", "N m"))


def _sniff(path: Path, head: bytes) -> bool:
    return path.suffix.casefold() in FORMAT.suffixes and any(
        line.strip().lower() == _END.encode() for line in head.splitlines()
    )


def read(path: Path) -> Sheet:
    """Every column; none is a load or a sensor unless the user says so. Raises `FormatError` with the faulty line."""
    lines = lines_of(path)
    end = next((k for k, line in enumerate(lines) if line.strip().casefold() == _END), None)
    if end is None:
        raise FormatError(f"{path}, line {len(lines)}: the header has no end ('endheader'): export it again")
    named = next((k for k in range(end + 1, len(lines)) if lines[k].strip()), None)
    if named is None:
        raise FormatError(f"{path}, line {len(lines)}: no names stand below the header: export it again")
    metadata = {}
    for line in lines[:end]:
        key, _, value = line.strip().partition("=" if "=" in line else " ")
        if value:
            metadata[key.strip()] = value.strip()
    names = lines[named].split()
    table = numbers_below(path, lines, named + 1, len(names), None)
    columns = [Column(name, _unit(name), table[:, k], None if k == 0 else "auxiliary") for k, name in enumerate(names)]
    return Sheet(path, "opensim", columns, metadata, first_line=named + 2)


def _unit(name: str) -> str:
    if name.casefold() == "time":
        return "s"
    return next((unit for part, unit in _UNITS if part in name), "")


FORMAT = Format("opensim", "OpenSim file", (".mot", ".sto"), _sniff, read, is_text=True)
