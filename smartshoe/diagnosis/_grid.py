"""A recording on an even grid, its missing samples interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._averaging import LEAST_WINDOW, smoothed, thinning_weights
from smartshoe.diagnosis._neighbours import neighbours_of
from smartshoe.diagnosis._scale import Scale, reading_in
from smartshoe.diagnosis._slow_segments import spacing_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.masks import bridged


@dataclass(frozen=True, eq=False)
class Logged:
    """A recording on an even grid, (n,) each, interpolated where samples are missing; ``reading`` in the scale's unit.

    ``usable``: load and reading are present and sound. ``load_known``: the load is present. ``auxiliary``: temperature
    and neighbour, where they were logged.
    """

    time_s: Array
    load_n: Array
    reading: Array
    usable: Mask
    load_known: Mask
    auxiliary: dict[str, Array]


def longest_step_s(recording: Recording, factor: int) -> float:
    """The longest step in s that a fit can follow in a recording thinned by ``factor``: the width of its average."""
    return (max(factor, LEAST_WINDOW) + 0.5) * recording.sample_time_s  # half a sample more, since stamps are rounded


def logged_on_grid(
    recording: Recording, usable: Mask, scale: Scale, longest_s: float, thresholds: Thresholds, *, is_judged: bool
) -> Logged:
    """The recording on an even grid; samples are usable up to ``longest_s`` apart.

    ``is_judged``: the reading keeps its noise, of which lines between samples would average a part away.
    """
    time_s, step_s = recording.time_s - recording.time_s[0], recording.sample_time_s
    known = recording.load.present
    good = usable & recording.sensor.present & known
    reading = bridged(time_s, reading_in(recording, scale.unit), good)
    load_n = bridged(time_s, recording.force_n, known)
    auxiliary = _auxiliary_channels(recording, time_s, scale)
    if recording.is_uniform:
        return Logged(time_s, load_n, reading, good, known, auxiliary)
    even = np.asarray(step_s * np.arange(int(time_s[-1] / step_s) + 1), dtype=np.float64)
    nearest = np.clip(np.searchsorted(time_s, even - 0.5 * step_s), 0, time_s.size - 1)
    is_near = np.abs(time_s[nearest] - even) < step_s
    spacing = spacing_of(time_s, load_n, even, longest_s, thresholds)
    good, known = (one[nearest] & is_near | spacing.followed(one) for one in (good, known))
    on_grid = np.interp(even, time_s, reading)
    if is_judged:
        # How far a reading goes from its sample to the grid's moment: by averages of both over the same samples.
        course_s, course = (smoothed(one, thinning_weights(1, one.size), 1) for one in (time_s, reading))
        moved = np.interp(even, course_s, course) - np.interp(time_s[nearest], course_s, course)
        on_grid = np.where(is_near, reading[nearest] + moved, on_grid)
    return Logged(
        even,
        np.interp(even, time_s, load_n),
        on_grid,
        good,
        known,
        {name: np.interp(even, time_s, values) for name, values in auxiliary.items()},
    )


def _auxiliary_channels(recording: Recording, time_s: Array, scale: Scale) -> dict[str, Array]:
    """Temperature and neighbour (n,) in the units of conditions, where any sample is present."""
    found = {}
    temperature, neighbours = recording.channels.get("temperature"), neighbours_of(recording)
    if temperature is not None and temperature.role == "auxiliary" and temperature.present.any():
        found["temperature_k"] = bridged(time_s, temperature.si, temperature.present)
    if neighbours:
        share = neighbours[0].in_unit(scale.unit) / abs(scale.reading)
        found["neighbour"] = bridged(time_s, share, neighbours[0].present)
    return found
