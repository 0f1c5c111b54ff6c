"""Writes a trial as C3D, the motion laboratories' format: loads as analog channels, gait events with their side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.files.atomic import replacing

if TYPE_CHECKING:
    from smartshoe.gait._result import GaitResult


# Event labels as Vicon, Visual3D and Mokka use them; they have none for foot flat and heel off.
LABELS = {"heel_strike": "Foot Strike", "toe_off": "Foot Off", "foot_flat": "Foot Flat", "heel_off": "Heel Off"}
MINUTE_S = 60.0
LONGEST = 255  # values that one parameter can hold
MOST = 16 * LONGEST  # largest number of events: a file's parameters hold 128 kB
DIGITS = 3  # to which the rate is rounded; beyond these, two clocks' rates differ by chance


class C3dSignal(NamedTuple):
    """A column of the table of forces: ``values`` (n,) in ``unit``, NaN where unknown."""

    label: str
    unit: str
    values: Array


def analog_signals(found: GaitResult) -> tuple[Array, list[C3dSignal]]:
    """The trial's times (n,) in s and its signals: each unit, each foot, the total force and the centre of pressure."""
    table = found.columns()
    time_s = table.pop("time_s")
    symbol = next(iter(found.feet.values())).symbol
    signals = []
    for name, values in table.items():
        label, _, suffix = name.rpartition("_")
        if suffix != "phase":
            unit = {"n": "N", "percent": "%"}.get(suffix, symbol)
            signals.append(C3dSignal(label, unit, np.asarray(values, dtype=float)))
    return time_s, signals


def write_c3d(path: Path | str, found: GaitResult) -> None:
    """Write units, feet, total and centre of pressure as analog channels, and the events in the group EVENT.

    Event times count from the file's first sample, as C3D requires; TRIAL:START_S gives that sample's time on the
    trial's clock. Samples without a value are 0. The file is written completely or not at all. Raises `UsageError` if
    the library ezc3d is not installed, and for more events than the format holds.
    """
    try:
        import ezc3d
    except ImportError as error:
        raise UsageError(
            f"{path}: writing C3D needs the library ezc3d: install it with pip install 'smartshoe[c3d]'"
        ) from error
    if len(found.events) > MOST:
        raise UsageError(
            f"{path}: C3D holds {MOST} events at most and the trial has {len(found.events)}: cut it, or use --out"
        )
    time_s, signals = analog_signals(found)
    rate_hz = float(np.round(next(iter(found.feet.values())).rate_hz, DIGITS))
    made: Any = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [rate_hz]
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    analog = made["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [rate_hz]
    analog["LABELS"]["value"] = [signal.label for signal in signals]
    analog["UNITS"]["value"] = [signal.unit for signal in signals]
    made["data"]["analogs"] = np.array([np.nan_to_num(signal.values, nan=0.0) for signal in signals])[None]
    made["data"]["points"] = np.zeros((4, 0, time_s.size))
    _add_events(made, found, float(time_s[0]))
    made.add_parameter("TRIAL", "START_S", [float(time_s[0])])
    with replacing(path) as temporary:
        made.write(str(temporary))


def _add_events(made: Any, found: GaitResult, start_s: float) -> None:
    """Add the events to ``made``, with times in minutes and seconds after ``start_s``, as C3D stores them."""
    made.add_parameter("EVENT", "USED", [len(found.events)])
    for part in range(-(-len(found.events) // LONGEST)):
        # A parameter holds 255 values; further ones go into LABELS2, LABELS3 and so on, as for points.
        events = found.events[part * LONGEST : (part + 1) * LONGEST]
        number = str(part + 1) if part else ""
        times_s = np.array([event.time_s - start_s for event in events])
        minutes = np.floor(times_s / MINUTE_S)
        made.add_parameter("EVENT", f"CONTEXTS{number}", [event.foot.capitalize() for event in events])
        made.add_parameter("EVENT", f"LABELS{number}", [LABELS[event.event] for event in events])
        made.add_parameter("EVENT", f"TIMES{number}", np.vstack([minutes, times_s - MINUTE_S * minutes]))
