"""A channel that is logged more slowly than its table, each of its values held until the next one comes.

A load that was set step by step, as by a converter, stands between its steps as well, and is known at all samples. The
reading tells which of the two it was: under a load that was read slowly it goes on between the moments at which it was
read, towards a value that is logged only later.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._plain_unit import delays_of, plain_units, squares_left, weights_of, without_past
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording

PER_HOLD = 8  # resolution: samples of each value that are looked at


def without_held(recordings: Sequence[Recording], thresholds: Thresholds) -> list[tuple[Recording, list[Finding]]]:
    """Each recording at the moments at which the slowest of load and reading was read, and the findings that say so.

    Between these moments that channel was not measured: taken for a load, its steps would make the unit seem to lag.
    What one recording shows of a channel holds for the others, since a coarse grid looks the same at a single loading
    rate.
    """
    each = [_held_for(recording, thresholds) for recording in recordings]
    certain = {(name, count) for own in each for name, (count, is_certain) in own.items() if is_certain}
    certain = {(name, count) for name, count in certain if not _is_staircase(name, count, recordings, thresholds)}
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


@on_one_thread
def _is_staircase(name: str, count: int, recordings: Sequence[Recording], thresholds: Thresholds) -> bool:
    """Whether the load ``name``, which stands for ``count`` samples at a time, stood so, and readings followed that.

    Plain units must leave clearly fewer squares under it than under a load that goes in lines from each moment at which
    a value came to the next. They are compared by their increments over half of the time that a value stands, since the
    two loads differ in what happens within it.
    """
    stood, went_on = 0.0, 0.0
    for recording in recordings:
        if [one.name for one in recording.of_role("load")] != [name] or len(recording.sensors) != 1:
            continue
        load, reading = recording.load.values, recording.sensor.values
        came_at = np.flatnonzero(np.diff(load)) + 1
        if came_at.size < thresholds.few**2:
            continue
        step = max(count // PER_HOLD, 1)
        width = step * thresholds.bins
        busiest = int(came_at[np.argmax(np.searchsorted(came_at, came_at + width) - np.arange(came_at.size))])
        taken = slice(busiest, min(busiest + width, int(came_at[-1]) + 1), step)
        lines = np.interp(np.arange(load.size), *_corners_of(load, count))
        half = max(count // taken.step // 2, 1)
        stood, went_on = (
            total + _squares_of_increments(one[taken], reading[taken], half)
            for total, one in ((stood, load), (went_on, lines))
        )
    return thresholds.clear * stood < went_on


def _corners_of(load: Array, count: int) -> tuple[Index, Array]:
    """(m,) samples at which a ``load`` (n,) was read if that was every ``count`` samples, and (m,) its values there."""
    at = _read_at(load, count)
    return at, load[at]


def _squares_of_increments(load: Array, reading: Array, span: int) -> float:
    """What the best plain unit leaves of the squares of a ``reading``'s (n,) increments over ``span`` samples."""
    delays = {*range(0, 4 * span + 1, max(span // 2, 1)), *delays_of(load.size).tolist()}
    best = np.inf
    for lag, columns in plain_units(load, reading, sorted(delays)):
        increments = without_past(columns, lag)
        increments = increments[span:] - increments[:-span]
        best = min(best, squares_left(increments, weights_of(increments)))
    return best


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
