"""The common base of all filters from readings to force: whole signals, streams, and missing readings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Self, overload

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, numbers_of
from smartshoe.errors import InputError, UsageError
from smartshoe.recording import Channel, Recording
from smartshoe.stamps import SAME_STEP
from smartshoe.units import Unit


class ForceFilter(ABC):
    """Readings in ``reading_unit`` to force in N, compression positive, at ``sample_rate_hz``.

    The filter starts in the steady state of its first reading, so that a static load has no transient. A reading
    that is not finite repeats the last one (force 0 before the first); the output is always finite.
    """

    sample_rate_hz: float
    reading_unit: Unit | None

    @abstractmethod
    def _copy(self) -> Self:
        """A copy of this filter in its initial state."""

    @abstractmethod
    def _begin(self, first: float) -> None:
        """Start in the steady state of ``first``."""

    @abstractmethod
    def _advance(self, readings: Array, count: int) -> Array:
        """Force (n,) of finite ``readings`` (n,), the first of which is number ``count`` since `reset`."""

    def __repr__(self) -> str:
        of = "" if self.reading_unit is None else f" of readings in {self.reading_unit.symbol}"
        return f"<{type(self).__name__} at {self.sample_rate_hz:g} Hz{of}>"

    def reset(self) -> None:
        """Return to the initial state: the filter starts in the steady state of the next reading."""
        self._last: float | None = None
        self._missing = 0
        self._count = 0

    @property
    def missing_count(self) -> int:
        """How many readings since `reset` were not finite."""
        return self._missing

    def apply(self, readings: ArrayLike | Channel | Recording) -> Array:
        """Force (n,) in N of a whole signal (n,), from the initial state; the state of `push` is not changed.

        A `Channel`, or the only sensor of a `Recording`, is converted to ``reading_unit``. Raises `UnitError` where
        that is not possible, and `UsageError` where the recording's rate differs from the filter's.
        """
        if isinstance(readings, Recording):
            self._require_rate_of(readings)
            readings = readings.sensor
        if isinstance(readings, Channel):
            values = readings.values if self.reading_unit is None else readings.in_unit(self.reading_unit)
        else:
            values = numbers_of(readings, "readings")
        if values.ndim != 1:
            raise InputError(f"readings have shape {values.shape}: give one number per sample")
        return self._copy()._push_block(values)

    def _require_rate_of(self, recording: Recording) -> None:
        """Raise `UsageError` where the recording's sampling rate differs from the filter's."""
        if len(recording) < 2 or abs(recording.sample_rate_hz / self.sample_rate_hz - 1.0) <= SAME_STEP:
            return
        raise UsageError(
            f"{recording.label} has {recording.sample_rate_hz:.5g} samples a second and the filter is for"
            f" {self.sample_rate_hz:g}: take one from compensator({recording.sample_rate_hz:.5g}), or let"
            " smartshoe.compensate choose the rate"
        )

    @overload
    def push(self, readings: float) -> float: ...
    @overload
    def push(self, readings: Array) -> Array: ...
    def push(self, readings: Any) -> Any:
        """Force in N of the next reading (float in, float out) or block (n,): the same numbers as `apply`."""
        block = numbers_of(readings, "readings")
        if block.ndim == 0:
            return float(self._push_block(block.reshape(1))[0])
        if block.ndim != 1:
            raise InputError(f"readings have shape {block.shape}: give a number or one number per sample")
        return self._push_block(block)

    def _push_block(self, block: Array) -> Array:
        finite = np.isfinite(block)
        self._missing += int(block.size - np.count_nonzero(finite))
        count, self._count = self._count, self._count + block.size
        force_n = np.zeros(block.size)
        start = 0
        if self._last is None:
            if not finite.any():
                return force_n
            start = int(np.argmax(finite))
            self._last = float(block[start])
            self._begin(self._last)
        values = block[start:]
        if not values.size:
            return force_n
        if not finite[start:].all():
            index = np.where(finite[start:], np.arange(values.size), -1)
            np.maximum.accumulate(index, out=index)
            values = np.where(index >= 0, values[index], self._last)
        self._last = float(values[-1])
        # One code path for floats and blocks, so that the result is bit-equal for any chunking.
        force_n[start:] = self._advance(values, count + start)
        return force_n
