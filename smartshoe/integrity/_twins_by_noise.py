"""Recordings that are copies of earlier ones in other digits or units, or at another rate: their noise is the same.

A repetition of an experiment has noise of its own, so that two readings differ by more than the noise of either. Those
of a copy differ by less, whatever was rounded, converted or left out on the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity._quantisation import coarse_step
from smartshoe.integrity._scales import is_turning
from smartshoe.integrity._twins import Twin
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.noise import white_noise_sd

COMPARED = 1000  # samples of each pair, a resolution: readings that differ show it in a few


@dataclass(frozen=True, eq=False)
class _Signals:
    """Load and reading (n,) in SI at ``time_s`` from the first sample on, where both are present."""

    time_s: Array
    load_n: Array
    reading: Array
    quantity: str

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1])

    @cached_property
    def noise_sd(self) -> float:
        """Standard deviation of the reading's white noise."""
        return white_noise_sd(self.reading)


def twins_by_noise(recordings: Sequence[Recording], thresholds: Thresholds) -> dict[int, Twin]:
    """By place, each recording that is a copy as a whole of an earlier one, and the first such.

    Every two that last equally long are compared, so that thousands take minutes.
    """
    seen: dict[int, _Signals] = {}
    found = {}
    for place, recording in enumerate(recordings):
        if len(recording.of_role("load")) != 1 or len(recording.sensors) != 1:
            continue
        one = _signals_of(recording)
        if one.time_s.size < thresholds.least_samples:
            continue
        earlier = next((k for k, other in seen.items() if _is_copy(other, one, thresholds)), None)
        if earlier is None:
            seen[place] = one
        else:
            same = f"{recording.label} has the same noise as {recordings[earlier].label}"
            says = f"{same}, in other digits or units, or at another rate: it is one experiment, given twice"
            found[place] = Twin(np.ones(len(recording), dtype=bool), says)
    return found


def _signals_of(recording: Recording) -> _Signals:
    """The recording's load and reading."""
    sensor = recording.sensor
    there = sensor.present & recording.load.present
    time_s = recording.time_s[there]
    return _Signals(time_s - time_s[:1], recording.force_n[there], sensor.si[there], sensor.unit.quantity)


def _is_copy(one: _Signals, other: _Signals, thresholds: Thresholds) -> bool:
    """Whether both last equally long, and the readings differ by clearly less than the noise of either.

    Samples of the more slowly logged one are compared. The loads need only be alike, since they may have no noise.
    """
    fine, coarse = sorted((one, other), key=lambda each: each.time_s.size, reverse=True)
    step_s = coarse.duration_s / (coarse.time_s.size - 1)
    if one.quantity != other.quantity or abs(one.duration_s - other.duration_s) > thresholds.clear * step_s:
        return False
    at = np.unique(np.linspace(0, coarse.time_s.size - 1, COMPARED).astype(np.intp))
    off, off_n = (
        float(np.sqrt(np.mean((np.interp(coarse.time_s[at], fine.time_s, theirs) - own[at]) ** 2)))
        for theirs, own in ((fine.reading, coarse.reading), (fine.load_n, coarse.load_n))
    )
    return (
        off_n < thresholds.same * float(np.ptp(coarse.load_n))
        and thresholds.clear * off < min(fine.noise_sd, coarse.noise_sd)
        and all(_is_noisy(each.reading, thresholds) for each in (fine, coarse))
    )


def _is_noisy(reading: Array, thresholds: Thresholds) -> bool:
    """Whether second differences of a ``reading`` (n,) are those of noise, neither of its shape nor of its grid."""
    return is_turning(reading) and coarse_step(reading, thresholds) == 0.0
