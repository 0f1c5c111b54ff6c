"""Which of the channels logged alongside is the neighbour whose pressure the reading may contain (cross talk)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording
from smartshoe.signals.lags import lagged, left_by
from smartshoe.signals.masks import bridged


def neighbours_of(recording: Recording) -> list[Channel]:
    """The readings of units other than the one that is diagnosed."""
    quantity = recording.sensor.unit.quantity
    return [one for one in recording.of_role("auxiliary") if one.unit.quantity == quantity and one.present.any()]


def with_one_neighbour(
    recordings: Sequence[Recording], count: int, usable: Sequence[Mask], thresholds: Thresholds
) -> tuple[list[Recording], list[str]]:
    """The recordings with one neighbour at most, and sentences on the others.

    It is the one that the readings of the first ``count``, fitted, recordings follow best beyond what their loads
    predict. A channel that predicts the reading to less than the reading's noise is a copy of it, and no neighbour.
    """
    readable = [(one, mask) for one, mask in zip(recordings, usable, strict=True) if mask.any()]
    fitted = readable[: sum(bool(mask.any()) for mask in usable[:count])]
    names = list(dict.fromkeys(channel.name for one, _ in readable for channel in neighbours_of(one)))
    if not names:
        return [*recordings], []
    shared = [n for n in names if all(n in [c.name for c in neighbours_of(one)] for one, _ in fitted)]
    sums = {n: [_neighbour_sums(one, one[n], mask, thresholds) for one, mask in fitted] for n in shared}
    copies = [n for n in shared if any(one.is_copy for one in sums[n])]
    followed = {n: _covaried_power(sums[n]) for n in shared if n not in copies}
    kept = max(followed, key=lambda n: followed[n], default=None)
    said = [f"{', '.join(copies)} reads as the unit does, noise and all: it is no neighbour"] if copies else []
    if passed := [n for n in names if n not in (kept, *copies)]:
        beside = f", but of {kept} alone, which the reading follows best" if kept else ": not all recordings hold it"
        said.append(f"cross talk is not looked for of {', '.join(passed)}{beside}")
    return [one.without(*(n for n in names if n != kept)) for one in recordings], said


@dataclass(frozen=True, slots=True)
class _NeighbourSums:
    """Sums over a recording, beyond what its load predicts: of reading times neighbour, and of neighbour squared."""

    product: float
    square: float
    is_copy: bool


def _covaried_power(sums: Sequence[_NeighbourSums]) -> float:
    """The squared covariance of reading and neighbour over the neighbour's power."""
    square = sum(one.square for one in sums)
    return sum(one.product for one in sums) ** 2 / square if square > 0.0 else 0.0


def _neighbour_sums(recording: Recording, neighbour: Channel, usable: Mask, thresholds: Thresholds) -> _NeighbourSums:
    """The sums beyond what the load predicts by itself, its square and its lags (``memory_s``)."""
    sensor, load = recording.sensor, recording.load
    mask = usable & sensor.present & load.present & neighbour.present
    if not mask.any():
        return _NeighbourSums(0.0, 0.0, False)
    force = bridged(recording.time_s, load.values, load.present)
    behind = [lagged(force, recording.sample_time_s, tau_s) for tau_s in thresholds.memory_s]
    load_terms = np.column_stack([np.ones(force.size), force, force**2, *behind])[mask]
    reading, other = sensor.values[mask], neighbour.in_unit(sensor.unit)[mask]
    with_neighbour = np.column_stack([np.ones(other.size), other])
    left, other_left = left_by(load_terms, reading), left_by(load_terms, other)
    # Compared with the noise beyond the load's prediction, since fast loads bend a reading as noise does.
    is_copy = float(np.std(left_by(with_neighbour, reading))) < (1.0 - thresholds.same) * noise_sd(left, thresholds)
    return _NeighbourSums(float(left @ other_left), float(other_left @ other_left), is_copy)
