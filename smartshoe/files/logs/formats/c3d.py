"""C3D, the motion laboratories' format: its analog channels, with the gait events as remarks. Read by ezc3d."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.errors import FormatError, InputError
from smartshoe.files.gate import require_values
from smartshoe.files.logs._sheet import Column, Format, Sheet
from smartshoe.recording import UNITS_OF_A_SHOE, Role
from smartshoe.units import find_unit

_PARAMETERS_FOLLOW = 0x50  # the second byte of every C3D file
MINUTE_S = 60.0


def _sniff(path: Path, head: bytes) -> bool:
    return path.suffix.casefold() == ".c3d" and len(head) > 1 and head[1] == _PARAMETERS_FOLLOW


def read(path: Path) -> Sheet:
    """Every analog channel at its own rate; remarks ``events SIDE WHAT`` are event times in s from the start.

    Raises `InputError` where the library ezc3d is not installed, `FormatError` where there is no analog channel.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise InputError(
            f"{path}: reading C3D needs the library ezc3d: install it with pip install 'smartshoe[c3d]'"
        ) from error
    try:
        found: Any = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise FormatError(f"{path} is no whole C3D file ({error}): export it again") from error
    parameters = found["parameters"]
    analog = np.asarray(found["data"]["analogs"], dtype=np.float64)
    rate_hz = float(np.ravel(parameters["ANALOG"]["RATE"]["value"] or [0.0])[0])
    if analog.ndim != 3 or 0 in analog.shape or not rate_hz > 0.0:
        raise FormatError(f"{path} has no analog channels: export the forces with it")
    require_values(path, analog.size)
    labels = _texts(parameters["ANALOG"], "LABELS", analog.shape[1])
    units = _texts(parameters["ANALOG"], "UNITS", analog.shape[1])
    columns = [Column("time", "s", np.arange(analog.shape[2]) / rate_hz)]
    for label, unit, values in zip(labels, units, analog[0], strict=True):
        known = find_unit(unit) if unit else None
        name = label.strip() or f"analog_{len(columns)}"
        role: Role | None = None if name in UNITS_OF_A_SHOE else "auxiliary"
        columns.append(Column(name, known.symbol if known else unit, np.array(values), role, label=label))
    return Sheet(path, "c3d", columns, {"sample_rate_hz": f"{rate_hz:g}", **_events(parameters)})


def _texts(group: Any, key: str, count: int) -> list[str]:
    given: Sequence[Any] = group[key]["value"] if key in group else []
    return [str(text) for text in given[:count]] + [""] * (count - len(given))


def _events(parameters: Any) -> dict[str, str]:
    """Times in s of the events by side and label; C3D stores minutes and seconds."""
    if "EVENT" not in parameters or "TIMES" not in parameters["EVENT"]:
        return {}
    group = parameters["EVENT"]
    times = np.asarray(group["TIMES"]["value"], dtype=np.float64)
    if times.ndim != 2 or times.shape[0] < 2:
        return {}
    sides, labels = (_texts(group, key, times.shape[1]) for key in ("CONTEXTS", "LABELS"))
    events: dict[str, list[float]] = {}
    for side, label, (minutes, seconds) in zip(sides, labels, times[:2].T, strict=True):
        events.setdefault(f"events {side} {label}".strip(), []).append(MINUTE_S * minutes + seconds)
    return {key: " ".join(f"{time_s:g}" for time_s in sorted(each)) for key, each in events.items()}


FORMAT = Format("c3d", "C3D file", (".c3d",), _sniff, read, asked=0)
