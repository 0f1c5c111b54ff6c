"""Sessions of a known model under loads that go up and down, some samples of which are lost."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._scale import Scale
from smartshoe.models.effects import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")
SCALE = Scale(800.0, 140.0, MILLIBAR)
STEP_S = 0.1


def session_under(load: Array, reading: Array, seed: int = 0, lost: float = 0.2, held: Any = None) -> Any:
    rng = np.random.default_rng([seed, 9])
    usable = rng.random(load.size) >= lost
    held_out = np.zeros(load.size, dtype=bool) if held is None else held
    told = SimpleNamespace(metadata={}, sensor=SimpleNamespace(unit=MILLIBAR))
    return SimpleNamespace(
        conditions=Conditions(STEP_S * np.arange(load.size), load, STEP_S), reading=reading, usable=usable,
        held_out=held_out, fitted=usable & ~held_out, judged=usable & held_out,
        cycle=np.arange(load.size) * 7 // load.size, recording=told, unknown_past=0.05,
        without_gas_memory=False, without_catch_alls=False, tare=None,
        own_gain_sd=0.0, gain_parts=(), zero_changes=(), zero_sd=0.0, gap_ends=(), thinned=1, resting=load <= 0.0,
    )  # fmt: skip


def some_load(size: int, seed: int) -> Array:
    rng = np.random.default_rng([seed, 4])
    return np.interp(np.arange(size), np.linspace(0, size, 20), rng.uniform(0.0, 1.0, 20))


def past_columns(session: Any, rate_per_s: float) -> Array:
    return np.array([[1.0, math.exp(-rate_per_s * at)] for at in session.conditions.time_s])


def sessions_under(model: ExtendedModel, noise: float = 0.01, sizes: tuple[int, ...] = (300, 220)) -> list[Any]:
    made = []
    for seed, size in enumerate(sizes):
        load = some_load(size, seed)
        at = Conditions(STEP_S * np.arange(size), load, STEP_S)
        off = noise * np.random.default_rng(seed).standard_normal(size)
        made.append(session_under(load, 0.05 * seed + model.simulate(at) + off, seed))
    return made
