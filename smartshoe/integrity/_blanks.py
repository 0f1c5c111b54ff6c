"""A channel that is logged more slowly than its table, and blank in the rows between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording


def without_blanks(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """The recording at the rows in which the slowest of load and reading was logged, and what is said of it.

    As of a table that was merged from two rates. Blanks that come at no even pace are samples that are missing.
    """
    found = {one.name: _pace_s(recording.time_s, one, thresholds) for one in recording.loads_and_sensors}
    slowest = max(found, key=lambda name: found[name], default=None)
    if slowest is None or found[slowest] == 0.0:
        return recording, []
    kept = np.flatnonzero(recording.channels[slowest].present)
    taken = recording.taken(kept)
    blank = [one for name, one in recording.channels.items() if not taken.channels[name].present.all()]
    drawn = {one.name: one.with_values(_drawn(recording.time_s, one, kept, thresholds)) for one in blank}
    says = (
        f"{slowest} is logged every {found[slowest]:.3g} s and blank in the rows between: of all channels only those"
        f" moments are used{', what is blank there on lines between its own' if drawn else ''}"
    )
    made = replace(taken, channels={**taken.channels, **drawn})
    return made, [Finding("missing_samples", np.ones(kept.size, dtype=bool), says)]


def _pace_s(time_s: Array, channel: Channel, thresholds: Thresholds) -> float:
    """The even time from one sample of a channel to the next, with blanks between; 0 where there is none."""
    there = np.flatnonzero(channel.present)
    if there.size < thresholds.least_samples or np.median(np.diff(there)) <= 1.0:
        return 0.0
    steps = np.diff(time_s[there])
    usual = float(np.median(steps))
    row_s = float(np.median(np.diff(time_s)))  # a sample waits for its row
    uneven = np.abs(steps - usual) > thresholds.same * usual + row_s
    return usual if uneven.mean() < thresholds.faulty_share else 0.0


def _drawn(time_s: Array, channel: Channel, kept: Index, thresholds: Thresholds) -> Array:
    """(m,) a channel at the rows ``kept`` (m,), where it is blank on lines over two of its own steps (`clear`)."""
    own_s, at_s = time_s[channel.present], time_s[kept]
    if own_s.size < 2:
        return channel.with_nan()[kept]
    step_s = np.diff(own_s)
    before = np.clip(np.searchsorted(own_s, at_s) - 1, 0, step_s.size - 1)
    is_wide = step_s[before] > (thresholds.clear + thresholds.same) * float(np.median(step_s))
    values = np.interp(at_s, own_s, channel.values[channel.present], np.nan, np.nan)
    return np.where(is_wide & ~channel.present[kept], np.nan, values)
