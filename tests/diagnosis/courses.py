"""Loads of straight lines, for tests that count samples, and recordings of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smartshoe import Recording
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._scale import Scale, full_scale
from smartshoe.diagnosis._session import Session, prepare

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.02


def course(*corners: tuple[int, float]) -> Array:
    """Straight lines of so many steps to such a load."""
    parts, at = [np.zeros(1)], 0.0
    for steps, share in corners:
        parts.append(np.linspace(at, share, steps + 1)[1:])
        at = share
    return np.concatenate(parts)


def pressed(load: Array, reading: Array | None = None, step_s: float = STEP_S, **metadata: object) -> Recording:
    """``load`` and ``reading`` in full scales of 800 N and 140 mbar."""
    time_s = step_s * np.arange(load.size)
    shown = 140.0 * (load if reading is None else reading)
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=shown, metadata=metadata)


def triangles(count: int = 8, period_s: float = 5.0, rest_s: float = 2.0, height: float = 1.0) -> Array:
    rest = np.zeros(round(rest_s / STEP_S))
    up = np.linspace(0.0, height, round(0.5 * period_s / STEP_S), endpoint=False)
    return np.concatenate([rest, *([up, up[::-1], rest] * count)])


def prepared(*runs: Recording, factor: int = 1, held: list[bool] | None = None) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in runs]
    scale = full_scale(runs, usable, STANDARD)
    return prepare(runs, usable, held, scale, [factor], STANDARD), scale
