"""A channel that was logged more slowly than its table and is blank in the rows between, as in a table of two rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording


def without_blanks(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """The recording at the rows in which the slowest of load and reading was logged, and the finding that says so.

    Blanks that come at no even pace are missing samples, and stay.
    """
    pace_s = {one.name: _pace_s(recording.time_s, one, thresholds) for one in recording.loads_and_sensors}
    slowest = max(pace_s, key=lambda name: pace_s[name], default=None)
    if slowest is None or pace_s[slowest] == 0.0:
        return recording, []
    rows = np.flatnonzero(recording.channels[slowest].present)
    taken = recording.taken(rows)
    blank = [one for name, one in recording.channels.items() if not taken.channels[name].present.all()]
    interpolated = {
        one.name: one.with_values(_interpolated_at(recording.time_s, one, rows, thresholds)) for one in blank
    }
    says = (
        f"{slowest} is logged every {pace_s[slowest]:.3g} s and blank in the rows between: of all channels only those"
        f" moments are used{', what is blank there on lines between its own' if interpolated else ''}"
    )
    thinned = replace(taken, channels={**taken.channels, **interpolated})
    return thinned, [Finding("missing_samples", np.ones(rows.size, dtype=bool), says)]


def _pace_s(time_s: Array, channel: Channel, thresholds: Thresholds) -> float:
    """The time from one sample of a ``channel`` to the next in s, where it is even and blanks lie between; else 0."""
    present = np.flatnonzero(channel.present)
    if present.size < thresholds.least_samples or np.median(np.diff(present)) <= 1.0:
        return 0.0
    steps = np.diff(time_s[present])
    usual = float(np.median(steps))
    row_s = float(np.median(np.diff(time_s)))  # a sample waits for its row
    uneven = np.abs(steps - usual) > thresholds.same * usual + row_s
    return usual if uneven.mean() < thresholds.faulty_share else 0.0


def _interpolated_at(time_s: Array, channel: Channel, rows: Index, thresholds: Thresholds) -> Array:
    """(m,) a ``channel`` at the ``rows`` (m,) that remain, interpolated where it is blank between samples of its own.

    Where these are more than two and a quarter of its usual steps apart (`clear`, `same`) it stays missing.
    """
    own_s, at_s = time_s[channel.present], time_s[rows]
    if own_s.size < 2:
        return channel.with_nan()[rows]
    step_s = np.diff(own_s)
    before = np.clip(np.searchsorted(own_s, at_s) - 1, 0, step_s.size - 1)
    is_wide = step_s[before] > (thresholds.clear + thresholds.same) * float(np.median(step_s))
    values = np.interp(at_s, own_s, channel.values[channel.present], np.nan, np.nan)
    return np.where(is_wide & ~channel.present[rows], np.nan, values)
