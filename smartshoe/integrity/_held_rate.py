"""A channel that is logged more slowly than its table, each of its values held until the next one comes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording


def without_held(recordings: Sequence[Recording], thresholds: Thresholds) -> list[tuple[Recording, list[Finding]]]:
    """Each recording at the moments at which the slowest of load and reading was read, and the findings that say so.

    Between these moments that channel was not measured: taken for a load, its steps would make the unit seem to lag.
    What one recording shows of a channel holds for the others, since a coarse grid looks the same at a single loading
    rate.
    """
    each = [_held_for(recording, thresholds) for recording in recordings]
    certain = {(name, count) for own in each for name, (count, is_certain) in own.items() if is_certain}
    thinned = []
    for recording, own in zip(recordings, each, strict=True):
        held = {name: count for name, (count, _) in own.items() if (name, count) in certain}
        slowest = max(held, key=lambda name: held[name], default=None)
        thinned.append((recording, []) if slowest is None else _taken(recording, slowest, held[slowest]))
    return thinned


def _held_for(recording: Recording, thresholds: Thresholds) -> dict[str, tuple[int, bool]]:
    """By channel that moves, for how many samples nearly each value is held; and whether that is certain.

    A coarse grid repeats values as well. But it goes on by single steps, whereas a held channel moves by small and by
    large steps: that makes it certain.
    """
    found = {}
    for channel in recording.loads_and_sensors:
        change = np.abs(np.diff(channel.values[channel.present]))
        changed_at = np.flatnonzero(change)
        if changed_at.size < thresholds.few**2:
            continue
        held_for = np.diff(changed_at)
        usual = max(round(float(np.median(held_for))), 1)
        small, large = np.quantile(change[changed_at], [0.1, 0.9])
        if usual > 1 and np.mean(held_for % usual == 0) > 1.0 - thresholds.faulty_share:
            found[channel.name] = usual, bool(large > thresholds.clear * small)
    return found


def _taken(recording: Recording, slowest: str, count: int) -> tuple[Recording, list[Finding]]:
    """The recording where its ``slowest`` channel was read, once in ``count`` samples, and the finding that says so."""
    read_at = _read_at(recording.channels[slowest].values, count)
    says = (
        f"{slowest} is read every {count * recording.sample_time_s:.3g} s and held for the {count - 1} samples between:"
        " of all channels only those moments are used"
    )
    return recording.taken(read_at), [Finding("held_samples", np.ones(read_at.size, dtype=bool), says)]


def _read_at(values: Array, count: int) -> Index:
    """(m,) samples at which a value came, and every ``count`` samples after it while it did not change."""
    index = np.arange(values.size)
    came_at = np.where(np.diff(values, prepend=np.nan) != 0.0, index, 0)
    return np.flatnonzero((index - np.maximum.accumulate(came_at)) % count == 0)
