"""A channel that is logged more slowly than its table: each value is held until the next one comes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording


def without_held(recordings: Sequence[Recording], thresholds: Thresholds) -> list[tuple[Recording, list[Finding]]]:
    """Each recording at the moments at which the slowest of load and reading was read, and what is said of it.

    Between them that channel says nothing: taken for a load, its steps would be the reading's delay. What one recording
    shows of a channel holds for the others: of a single loading rate a coarse grid looks the same.
    """
    each = [_held_for(recording, thresholds) for recording in recordings]
    told = {(name, count) for own in each for name, (count, is_told) in own.items() if is_told}
    made = []
    for recording, own in zip(recordings, each, strict=True):
        held = {name: count for name, (count, _) in own.items() if (name, count) in told}
        slowest = max(held, key=lambda name: held[name], default=None)
        made.append((recording, []) if slowest is None else _taken(recording, slowest, held[slowest]))
    return made


def _held_for(recording: Recording, thresholds: Thresholds) -> dict[str, tuple[int, bool]]:
    """By channel, for how many samples nearly each value stands while it moves; and whether that is told.

    A coarse grid repeats values as well, but goes on by single steps of it, each as soon as it is due.
    """
    found = {}
    for channel in recording.loads_and_sensors:
        change = np.abs(np.diff(channel.values[channel.present]))
        at = np.flatnonzero(change)
        if at.size < thresholds.few**2:
            continue
        lasted = np.diff(at)
        usual = max(round(float(np.median(lasted))), 1)
        small, large = np.quantile(change[at], [0.1, 0.9])
        if usual > 1 and np.mean(lasted % usual == 0) > 1.0 - thresholds.faulty_share:
            found[channel.name] = usual, bool(large > thresholds.clear * small)
    return found


def _taken(recording: Recording, slowest: str, count: int) -> tuple[Recording, list[Finding]]:
    kept = _read_at(recording.channels[slowest].values, count)
    says = (
        f"{slowest} is read every {count * recording.sample_time_s:.3g} s and held for the {count - 1} samples between:"
        " of all channels only those moments are used"
    )
    return recording.taken(kept), [Finding("held_samples", np.ones(kept.size, dtype=bool), says)]


def _read_at(values: Array, count: int) -> Index:
    """(m,) where a value came, and every ``count`` samples after it where it did not change."""
    here = np.arange(values.size)
    came = np.where(np.diff(values, prepend=np.nan) != 0.0, here, 0)
    return np.flatnonzero((here - np.maximum.accumulate(came)) % count == 0)
