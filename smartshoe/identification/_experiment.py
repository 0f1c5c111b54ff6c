"""Prepares recordings for identification: one pair of signals each, with missing samples masked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.models.first_order import Steps, steps
from smartshoe.recording import Recording
from smartshoe.signals.masks import bridged
from smartshoe.units import Unit

Direction = Literal["inverse", "forward"]

FEWEST_SAMPLES = 20
MOST_SKIPPED = 4  # inserted samples per sample present, at most
SKIPPED_TOLERANCE = 0.05  # of a step
LEAST_RETURN = 0.1  # of the load's range that must be covered both upwards and downwards


@dataclass(frozen=True, eq=False)
class Experiment:
    """One recording as load in N and reading in the common reading unit, both (n,), with gaps interpolated linearly.

    ``time_s`` starts at 0; ``step`` is `models.first_order.steps` of it; ``mask`` marks the samples whose error counts.
    Where samples skipped by the logger were inserted, ``rows`` tells which ones are the recording's; None: all are.
    """

    name: str
    time_s: Array
    step: Steps
    load_n: Array
    reading: Array
    mask: Mask
    n_missing: int
    command_n: Array | None = None
    rows: Index | None = None

    @property
    def sample_time_s(self) -> float:
        """The even sampling step in s, or the median of uneven ones."""
        return self.step if isinstance(self.step, float) else float(np.median(self.step))

    def of_recording(self, signal: Any) -> Any:
        """``signal`` (n,) restricted to the recording's own samples."""
        return signal if self.rows is None else signal[self.rows]

    def is_of(self, recording: Recording, reading_unit: Unit) -> bool:
        """Whether load and reading, in ``reading_unit``, equal those of ``recording``, regardless of names."""
        if recording.sensor.unit.quantity != reading_unit.quantity:
            return False
        held = (self.of_recording(self.load_n), self.of_recording(self.reading))
        return all(map(np.array_equal, held, _bridged_signals(recording, reading_unit)))

    def decimated(self, factor: int) -> Experiment:
        """The experiment with means of ``factor`` neighbouring samples, for a cheap start of a fit."""
        blocks = self.time_s.size // factor
        if factor <= 1 or blocks < 2:
            return self

        time_s = block_means(self.time_s, factor)
        return replace(
            self,
            time_s=time_s,
            step=self.step * factor if isinstance(self.step, float) else np.diff(time_s),
            load_n=block_means(self.load_n, factor),
            reading=block_means(self.reading, factor),
            mask=whole_blocks(self.mask, factor),
        )


def block_means(signal: Array, factor: int) -> Array:
    """(n // factor,) means of ``factor`` neighbours; an incomplete last block is left out."""
    blocks = signal[: signal.size // factor * factor].reshape(-1, factor)
    # A matrix product is many times faster than a mean over such a short axis.
    means: Array = blocks @ np.full(factor, 1.0 / factor)
    return means


def whole_blocks(mask: Mask, factor: int) -> Mask:
    """(n // factor,) whether all samples of a block are in the mask."""
    whole = np.ones(mask.size // factor, dtype=bool)
    broken = np.flatnonzero(~mask) // factor
    whole[broken[broken < whole.size]] = False
    return whole


def _unique_names(recordings: Sequence[Recording]) -> list[str]:
    names: list[str] = []
    for recording in recordings:
        name, count = recording.name, 2
        while name in names:
            name, count = f"{recording.name} ({count})", count + 1
        names.append(name)
    return names


def prepare(
    recordings: Sequence[Recording], counted: Mapping[str, Mask] | None = None, *, on_one_step: bool = True
) -> tuple[list[Experiment], Unit]:
    """The experiments and their common reading unit (that of the first recording).

    ``counted`` gives, by recording name, the mask (n,) of samples whose error counts; all of them where a name is
    missing. ``on_one_step`` inserts rows that a logger skipped as samples that do not count. Raises `UnitError` where a
    reading is of another quantity, `MissingChannelError` without load or reading, `NotIdentifiableError`, naming the
    reason, where the signals cannot determine the parameters.
    """
    if not recordings:
        raise UsageError("identify was given no recording: give one at least")
    reading_unit = recordings[0].sensor.unit
    names = _unique_names(recordings)
    masks = dict(counted or {})
    for name in masks:
        if name not in names:
            raise UsageError(f"counted names {name!r}, which is no recording here: use {', '.join(names)}")
    experiments = []
    for recording, name in zip(recordings, names, strict=True):
        present = recording.load.present & recording.sensor.present
        mask = present
        if name in masks:
            given = np.asarray(masks[name], dtype=bool)
            if given.shape != present.shape:
                raise UsageError(f"counted[{name!r}] has shape {given.shape}: give one flag a sample, {present.shape}")
            mask = present & given
        command_n = recording.command_n
        experiment = Experiment(
            name,
            recording.time_s - recording.time_s[0],
            steps(recording.time_s),
            *_bridged_signals(recording, reading_unit),
            mask,
            int(np.count_nonzero(~present)),
            None if command_n is None else np.array(command_n, dtype=float),
        )
        experiments.append(_on_one_step(experiment) if on_one_step else experiment)
    _require_identifiable(experiments, recordings)
    return experiments, reading_unit


def _bridged_signals(recording: Recording, reading_unit: Unit) -> tuple[Array, Array]:
    """(n,) load in N and reading, interpolated linearly where either is missing."""
    load, sensor = recording.load, recording.sensor
    return (
        bridged(recording.time_s, load.si, load.present),
        bridged(recording.time_s, sensor.in_unit(reading_unit), sensor.present),
    )


def _on_one_step(experiment: Experiment) -> Experiment:
    """The experiment with rows skipped by the logger inserted as uncounted samples, if that makes the step even.

    They are interpolated linearly, which the model assumes anyway. The results stay the same, but even steps are
    faster, and a delay then shifts the input by the better interpolation.
    """
    if isinstance(experiment.step, float):
        return experiment
    step_s = float(np.median(experiment.step))
    places = np.concatenate([[0.0], np.cumsum(np.round(experiment.step / step_s))])
    size = int(places[-1]) + 1
    if np.min(np.diff(places)) < 1 or size > MOST_SKIPPED * places.size:
        return experiment
    step_s = float(experiment.time_s[-1] / places[-1])
    if np.max(np.abs(experiment.time_s - step_s * places)) > SKIPPED_TOLERANCE * step_s:
        return experiment
    time_s, at = step_s * np.arange(size, dtype=float), places.astype(int)
    mask = np.zeros(size, dtype=bool)
    mask[at] = experiment.mask
    command_n = experiment.command_n
    return replace(
        experiment,
        time_s=time_s,
        step=step_s,
        load_n=np.interp(np.arange(size), places, experiment.load_n),
        reading=np.interp(np.arange(size), places, experiment.reading),
        mask=mask,
        command_n=None if command_n is None else np.interp(np.arange(size), places, command_n),
        rows=at,
    )


def _require_identifiable(experiments: Sequence[Experiment], recordings: Sequence[Recording]) -> None:
    where = recordings[0].label + (f" and {len(recordings) - 1} more" if len(recordings) > 1 else "")
    count = sum(int(np.count_nonzero(experiment.mask)) for experiment in experiments)
    if count < FEWEST_SAMPLES:
        raise NotIdentifiableError(
            f"{where} holds {count} samples with both load and reading: record {FEWEST_SAMPLES} at least"
        )
    counted = [experiment for experiment in experiments if experiment.mask.any()]
    loads = [masked(experiment.load_n, experiment.mask) for experiment in counted]
    readings = [masked(experiment.reading, experiment.mask) for experiment in counted]
    for what, signals in (("load", loads), ("reading", readings)):
        ends = [(float(signal.min()), float(signal.max())) for signal in signals]
        largest = max(max(abs(low), abs(high)) for low, high in ends)
        spread = max(high - low for low, high in ends)
        if spread <= 1e-12 * largest:
            raise NotIdentifiableError(
                f"{where}: the {what} is constant, a single static level: record a load that rises and falls"
            )
        if what == "load":
            span = max(high for _, high in ends) - min(low for low, _ in ends)
    rises = [_largest_rises(load) for load in loads]
    rise, fall = max(up for up, _ in rises), max(down for _, down in rises)
    if min(rise, fall) < LEAST_RETURN * span:
        missing = "never falls again" if fall < rise else "never rises"
        raise NotIdentifiableError(
            f"{where}: the load {missing} (no return), so that the loop is not seen: record loading and unloading"
        )


def masked(signal: Array, mask: Mask) -> Array:
    """``signal`` (n,) at the counted samples; itself, or a view, where those are contiguous."""
    first, count = int(mask.argmax()), int(np.count_nonzero(mask))
    together = slice(first, first + count)
    return signal[together] if mask[together].all() else signal[mask]


def _largest_rises(signal: Array) -> tuple[float, float]:
    """The largest rise and the largest fall from an earlier sample, or of means of a few samples in long signals."""
    few = max(signal.size // 2000, 1)
    coarse = block_means(signal, few) if few > 1 else signal
    return (
        float(np.max(coarse - np.minimum.accumulate(coarse))),
        float(np.max(np.maximum.accumulate(coarse) - coarse)),
    )
