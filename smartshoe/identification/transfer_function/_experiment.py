"""Prepares input and output for a transfer-function fit: one pair per experiment, with missing samples masked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smartshoe.arrays import Array, Mask, numbers_of
from smartshoe.errors import InputError, NotIdentifiableError, UsageError
from smartshoe.identification.transfer_function._discrete import Intersample
from smartshoe.models.first_order import steps


@dataclass(frozen=True, eq=False)
class InputOutput:
    """One experiment: ``u`` and ``y`` (n,) with gaps filled, and the mask ``counted`` (n,) where both were present.

    ``step_s`` is the even step, None where ``time_s`` (n,), which begins at 0, is uneven.
    """

    time_s: Array
    step_s: float | None
    u: Array
    y: Array
    counted: Mask

    @property
    def typical_step_s(self) -> float:
        """The even step in s, or the median of the uneven ones."""
        return self.step_s if self.step_s is not None else float(np.median(np.diff(self.time_s)))


def as_signals(values: Any, what: str) -> list[Array]:
    """One array or several as a list of one-dimensional arrays; raises `UsageError` on another shape."""
    several = isinstance(values, list | tuple) and bool(values) and np.ndim(values[0]) > 0
    try:
        signals = [np.array(numbers_of(value, what)) for value in (values if several else [values])]
    except InputError as error:
        raise UsageError(str(error)) from error
    signals = [signal.ravel() if signal.ndim == 2 and 1 in signal.shape else signal for signal in signals]
    for index, signal in enumerate(signals):
        if signal.ndim != 1:
            raise UsageError(
                f"{what} of experiment {index + 1} has the shape {signal.shape}: give one dimension, "
                "a list of arrays for several experiments"
            )
        signal[~np.isfinite(signal)] = np.nan
    return signals


def prepare(
    u: Any, y: Any, *, sample_time_s: float | None, time_s: Any, hold: Intersample, strict: bool = True
) -> tuple[list[InputOutput], int]:
    """The experiments, and the total number of missing samples.

    A missing input is filled according to the hold; neither it nor a missing output counts in the error. Raises
    `UsageError` for arguments that do not match; if ``strict``, `NotIdentifiableError` for a constant signal.
    """
    inputs, outputs = as_signals(u, "u"), as_signals(y, "y")
    if len(inputs) != len(outputs):
        raise UsageError(f"u holds {len(inputs)} experiments and y {len(outputs)}: give as many of each")
    if (sample_time_s is None) == (time_s is None):
        raise UsageError("give either sample_time_s or time_s, so that the samples have one time each")
    if sample_time_s is not None and not (np.isfinite(sample_time_s) and sample_time_s > 0.0):
        raise UsageError(f"sample_time_s is {sample_time_s}: give a step above 0 s")
    times = _times(time_s, inputs)
    experiments = []
    missing = 0
    for index, (one_u, one_y) in enumerate(zip(inputs, outputs, strict=True)):
        where = f"experiment {index + 1}"
        if one_u.size != one_y.size:
            raise UsageError(f"{where}: u holds {one_u.size} samples and y {one_y.size}: give as many of each")
        if one_u.size < 2:
            raise NotIdentifiableError(f"{where} holds {one_u.size} samples: record more")
        present = np.isfinite(one_u) & np.isfinite(one_y)
        missing += int(np.count_nonzero(~present))
        if not np.isfinite(one_u).any() or not present.any():
            raise NotIdentifiableError(f"{where} holds no sample with both input and output: record both")
        if times is None:
            time, step = np.arange(one_u.size, dtype=float) * float(sample_time_s or 0.0), sample_time_s
        else:
            time = np.asarray(times[index] - times[index][0], dtype=float)
            found = steps(time)
            step = found if isinstance(found, float) else None
            if step is not None:
                time = np.arange(one_u.size, dtype=float) * step
        y_known = np.isfinite(one_y)
        filled = one_y if y_known.all() else np.interp(time, time[y_known], one_y[y_known])
        experiments.append(InputOutput(time, step, _bridged(one_u, time, hold), filled, present))
    if strict:
        _require_excitation(experiments)
    return experiments, missing


def _times(time_s: Any, inputs: Sequence[Array]) -> list[Array] | None:
    if time_s is None:
        return None
    times = as_signals(time_s, "time_s")
    if len(times) == 1 and len(inputs) > 1:
        times = times * len(inputs)
    if [time.size for time in times] != [one.size for one in inputs]:
        raise UsageError("time_s does not hold as many samples as u: give one time for each sample")
    for index, time in enumerate(times):
        backwards = np.flatnonzero(~(np.diff(time) > 0.0))
        if backwards.size:
            raise InputError(
                f"time_s of experiment {index + 1} does not rise at sample {int(backwards[0]) + 2}: "
                "sort the samples and take doubles out"
            )
    return times


def _bridged(u: Array, time_s: Array, hold: Intersample) -> Array:
    known = np.isfinite(u)
    if known.all():
        return u
    if hold == "foh":
        return np.interp(time_s, time_s[known], u[known])
    last = np.maximum.accumulate(np.where(known, np.arange(u.size), -1))
    return np.asarray(u[np.where(last < 0, int(np.argmax(known)), last)])


def _require_excitation(experiments: Sequence[InputOutput]) -> None:
    for what, signals in (
        ("input", [experiment.u for experiment in experiments]),
        ("output", [experiment.y[experiment.counted] for experiment in experiments]),
    ):
        largest = max(float(np.max(np.abs(signal))) for signal in signals)
        if max(float(np.ptp(signal)) for signal in signals) <= 1e-12 * largest:
            raise NotIdentifiableError(f"the {what} is constant: record one that varies, a random binary one is best")
