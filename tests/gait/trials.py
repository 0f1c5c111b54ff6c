"""Simulated trials that the tests of this folder share, made once each."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simulators.people import Person, Run, Stand, Tiptoe, Trial, Walk, trial
from smartshoe.gait import GaitResult, analyse
from smartshoe.recording import Recording

Array = NDArray[np.float64]


@lru_cache(maxsize=8)
def walked(seconds: float = 30.0) -> Trial:
    """Walking at 1.3 m/s, loads in N with 1 N of noise, coverage the same at each moment."""
    return trial(Person(), Walk(1.3), seconds, np.random.default_rng(11), sensors=False, noise_n=1.0, outside="even")


@lru_cache(maxsize=4)
def ran() -> Trial:
    return trial(Person(), Run(2.68), 15.0, np.random.default_rng(12), sensors=False, noise_n=1.0, outside="even")


@lru_cache(maxsize=4)
def stood() -> Trial:
    parts = ((Tiptoe(), 15.0), (Stand(), 15.0))
    return trial(Person(), parts, 30.0, np.random.default_rng(13), sensors=False, noise_n=1.0, outside="even")


@lru_cache(maxsize=4)
def analysed() -> GaitResult:
    """The result of `walked`."""
    return analyse(walked().recording, coverage=0.8)


def loads_of(made: Trial) -> dict[str, Array]:
    """The recorded loads by column (``left_heel_n``)."""
    return {f"{unit}_n": made.recording[unit].values.copy() for unit in made.unit_n}


def recorded(time_s: Array, columns: Mapping[str, Array], name: str = "walk") -> Recording:
    return Recording.from_arrays(time_s=time_s, name=name, **columns)


def times_of(found: GaitResult, foot: str, event: str) -> Array:
    return np.array([e.time_s for e in found.events if e.foot == foot and e.event == event])
