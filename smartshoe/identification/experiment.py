"""Recordings made ready for identification: one pair of signals each, with what is missing marked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.models.first_order import Steps, steps
from smartshoe.recording import Recording
from smartshoe.units import Unit

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Direction = Literal["inverse", "forward"]

FEWEST_SAMPLES = 20
LEAST_RETURN = 0.1  # of the load's range that must be travelled both ways


@dataclass(frozen=True, eq=False)
class Experiment:
    """One recording as load in N and reading in the common reading unit, both (n,), gaps bridged by straight lines.

    ``time_s`` starts at 0; ``step`` is `models.first_order.steps` of it; ``kept`` marks the samples whose error counts.
    """

    name: str
    time_s: Array
    step: Steps
    load_n: Array
    reading: Array
    kept: Mask
    n_missing: int

    def signals(self, direction: Direction) -> tuple[Array, Array]:
        """Input and output of the direction: inverse reading -> load, forward load -> reading."""
        return (self.reading, self.load_n) if direction == "inverse" else (self.load_n, self.reading)

    @property
    def sample_time_s(self) -> float:
        """The even step, or the median of the uneven ones."""
        return self.step if isinstance(self.step, float) else float(np.median(self.step))


def _unique_names(recordings: Sequence[Recording]) -> list[str]:
    names: list[str] = []
    for recording in recordings:
        name, count = recording.name, 2
        while name in names:
            name, count = f"{recording.name} ({count})", count + 1
        names.append(name)
    return names


def prepare(recordings: Sequence[Recording]) -> tuple[list[Experiment], Unit]:
    """The experiments and their common reading unit (the first recording's).

    Raises `UnitError` where a reading is of another quantity, `MissingChannelError` without load or reading,
    `NotIdentifiableError` where the signals cannot hold the answer, naming what is missing.
    """
    if not recordings:
        raise UsageError("identify was given no recording: give one at least")
    reading_unit = recordings[0].sensor.unit
    experiments = []
    for recording, name in zip(recordings, _unique_names(recordings), strict=True):
        load, sensor = recording.load, recording.sensor
        kept = load.present & sensor.present
        time_s = recording.time_s - recording.time_s[0]
        experiments.append(
            Experiment(
                name,
                time_s,
                steps(time_s),
                _bridged(time_s, np.asarray(load.si, dtype=float), load.present),
                _bridged(time_s, sensor.in_unit(reading_unit), sensor.present),
                kept,
                int(np.count_nonzero(~kept)),
            )
        )
    _require_identifiable(experiments, recordings)
    return experiments, reading_unit


def _bridged(time_s: Array, values: Array, present: Mask) -> Array:
    """``values`` with missing samples on the line between their neighbours: what the model takes for granted anyway."""
    if present.all() or not present.any():
        return values
    return np.interp(time_s, time_s[present], values[present])


def _require_identifiable(experiments: Sequence[Experiment], recordings: Sequence[Recording]) -> None:
    where = recordings[0].label + (f" and {len(recordings) - 1} more" if len(recordings) > 1 else "")
    count = sum(int(np.count_nonzero(experiment.kept)) for experiment in experiments)
    if count < FEWEST_SAMPLES:
        raise NotIdentifiableError(
            f"{where} holds {count} samples with both load and reading: record {FEWEST_SAMPLES} at least"
        )
    loads = [experiment.load_n[experiment.kept] for experiment in experiments]
    readings = [experiment.reading[experiment.kept] for experiment in experiments]
    for what, signals in (("load", loads), ("reading", readings)):
        largest = max((float(np.max(np.abs(signal))) for signal in signals if signal.size), default=0.0)
        spread = max((float(np.ptp(signal)) for signal in signals if signal.size), default=0.0)
        if spread <= 1e-12 * largest or spread == 0.0:
            raise NotIdentifiableError(
                f"{where}: the {what} is constant, a single static level: record a load that rises and falls"
            )
    ends = [(float(load.min()), float(load.max())) for load in loads if load.size]
    span = max(end[1] for end in ends) - min(end[0] for end in ends)
    rise = max(_largest_rise(load) for load in loads)
    fall = max(_largest_rise(-load) for load in loads)
    if min(rise, fall) < LEAST_RETURN * span:
        missing = "never falls again" if fall < rise else "never rises"
        raise NotIdentifiableError(
            f"{where}: the load {missing} (no return), so that the loop is not seen: record loading and unloading"
        )


def _largest_rise(signal: Array) -> float:
    return float(np.max(signal - np.minimum.accumulate(signal))) if signal.size else 0.0
