"""Which of the channels that were read along is the neighbour whose pressure the reading may hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording
from smartshoe.signals.lags import lagged
from smartshoe.signals.masks import bridged


def neighbours_of(recording: Recording) -> list[Channel]:
    """Other units' readings beside the one that is diagnosed."""
    quantity = recording.sensor.unit.quantity
    others = (one for one in recording.of_role("auxiliary") if one.unit.quantity == quantity)
    return [one for one in others if one.name != "reference" and one.present.any()]


def with_one_neighbour(
    recordings: Sequence[Recording], count: int, usable: Sequence[Mask], thresholds: Thresholds
) -> tuple[list[Recording], list[str]]:
    """The recordings with one neighbour at most, and what is said of the others.

    It is the one that readings of the first ``count``, which are fitted, follow best beside what their loads foretell.
    What foretells a reading to less than the reading's own noise is the same channel once more, and no neighbour.
    """
    of_use = [(one, mask) for one, mask in zip(recordings, usable, strict=True) if mask.any()]
    fitted = of_use[: sum(bool(mask.any()) for mask in usable[:count])]
    names = list(dict.fromkeys(channel.name for one, _ in of_use for channel in neighbours_of(one)))
    if not names:
        return [*recordings], []
    shared = [n for n in names if all(n in [c.name for c in neighbours_of(one)] for one, _ in fitted)]
    sums = {n: [_beside(one, one[n], mask, thresholds) for one, mask in fitted] for n in shared}
    copies = [n for n in shared if any(one.is_copy for one in sums[n])]
    followed = {n: _followed(sums[n]) for n in shared if n not in copies}
    kept = max(followed, key=lambda n: followed[n], default=None)
    said = [f"{', '.join(copies)} reads as the unit does, noise and all: it is no neighbour"] if copies else []
    if passed := [n for n in names if n not in (kept, *copies)]:
        beside = f", but of {kept} alone, which the reading follows best" if kept else ": not all recordings hold it"
        said.append(f"cross talk is not looked for of {', '.join(passed)}{beside}")
    return [one.without(*(n for n in names if n != kept)) for one in recordings], said


@dataclass(frozen=True, slots=True)
class _Beside:
    """Sums over one recording of what its load does not foretell: reading times neighbour, and neighbour squared."""

    product: float
    square: float
    is_copy: bool


def _followed(sums: Sequence[_Beside]) -> float:
    square = sum(one.square for one in sums)
    return sum(one.product for one in sums) ** 2 / square if square > 0.0 else 0.0


def _beside(recording: Recording, neighbour: Channel, usable: Mask, thresholds: Thresholds) -> _Beside:
    """By the load, its square and what relaxes behind it (``memory_s``)."""
    sensor, load = recording.sensor, recording.load
    mask = usable & sensor.present & load.present & neighbour.present
    if not mask.any():
        return _Beside(0.0, 0.0, False)
    force = bridged(recording.time_s, load.values, load.present)
    behind = [lagged(force, recording.sample_time_s, tau_s) for tau_s in thresholds.memory_s]
    foretold = np.column_stack([np.ones(force.size), force, force**2, *behind])[mask]
    reading, other = sensor.values[mask], neighbour.in_unit(sensor.unit)[mask]
    as_well = np.column_stack([np.ones(other.size), other])
    left, left_of_other = _left(foretold, reading), _left(foretold, other)
    # Of what the load does not foretell: fast loads bend a reading as noise does.
    is_copy = float(np.std(_left(as_well, reading))) < (1.0 - thresholds.same) * noise_sd(left, thresholds)
    return _Beside(float(left @ left_of_other), float(left_of_other @ left_of_other), is_copy)


def _left(columns: Array, values: Array) -> Array:
    scaled = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
    return np.asarray(values - scaled @ np.linalg.lstsq(scaled, values, rcond=None)[0])
