"""The paper's compensator: equation (13) under the bilinear transform, whole signals and streams alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter

from smartshoe.errors import InputError, UsageError
from smartshoe.models import discretise
from smartshoe.recording import Channel, Recording
from smartshoe.units import Unit

Array = NDArray[np.float64]
_FLOAT64 = np.dtype(np.float64)


class Compensator:
    """force = (b0 s + b1)/(s + a1) (reading - offset), Chinimilli 2016 (13), bilinear at ``sample_rate_hz``.

    Readings are in ``reading_unit``, forces in N, compression positive. The filter starts as if the first reading
    had lasted for ever, so that a static load has no transient. A reading that is not finite repeats the last one
    (force 0 before the first); the output is always finite.
    """

    def __init__(
        self,
        a1: float,
        b0: float,
        b1: float,
        *,
        offset: float = 0.0,
        sample_rate_hz: float = 100.0,
        reading_unit: Unit | None = None,
    ) -> None:
        self.numerator, self.denominator = discretise(a1, b0, b1, sample_rate_hz, "bilinear")
        if not np.isfinite(offset):
            raise UsageError(f"offset is {offset:g}: give a finite number")
        self.a1, self.b0, self.b1, self.offset = float(a1), float(b0), float(b1), float(offset)
        self.sample_rate_hz = float(sample_rate_hz)
        self.reading_unit = reading_unit
        self._static_gain = float(self.numerator.sum() / self.denominator.sum())
        self.reset()

    def reset(self) -> None:
        """Forget the past: the next reading counts as having lasted for ever."""
        self._last: float | None = None
        self._state = np.zeros(1)
        self._missing = 0

    @property
    def missing_count(self) -> int:
        """How many readings since `reset` were not finite."""
        return self._missing

    def apply(self, readings: ArrayLike | Channel | Recording) -> Array:
        """Force (n,) in N of a whole signal (n,), from a fresh start; the state of `push` stays as it is.

        A `Channel`, or the one sensor of a `Recording`, is converted to ``reading_unit``; raises `UnitError` where
        that cannot be.
        """
        if isinstance(readings, Recording):
            readings = readings.sensor
        if isinstance(readings, Channel):
            values = readings.values if self.reading_unit is None else readings.in_unit(self.reading_unit)
        else:
            values = np.asarray(readings, dtype=float)
        if values.ndim != 1:
            raise InputError(f"readings have shape {values.shape}: give one number per sample")
        fresh = self._copy()
        return fresh._push_block(values)

    @overload
    def push(self, readings: float) -> float: ...
    @overload
    def push(self, readings: Array) -> Array: ...
    def push(self, readings: Any) -> Any:
        """Force in N of the next reading (float in, float out) or block (n,): the same numbers as `apply`."""
        block = np.asarray(readings, dtype=float)
        if block.ndim == 0:
            return float(self._push_block(block.reshape(1))[0])
        if block.ndim != 1:
            raise InputError(f"readings have shape {block.shape}: give a number or one number per sample")
        return self._push_block(block)

    def _copy(self) -> Compensator:
        return Compensator(
            self.a1,
            self.b0,
            self.b1,
            offset=self.offset,
            sample_rate_hz=self.sample_rate_hz,
            reading_unit=self.reading_unit,
        )

    def _column(self) -> list[float]:
        """The filter as a column of a bank, in the order of `smartshoe.kernels.streaming`, with no past."""
        n0, n1 = self.numerator
        return [float(n0), float(n1), float(self.denominator[1]), self._static_gain, self.offset, 0.0, np.nan, 0.0]

    def _push_block(self, block: Array) -> Array:
        finite = np.isfinite(block)
        self._missing += int(block.size - np.count_nonzero(finite))
        force_n = np.zeros(block.size)
        start = 0
        if self._last is None:
            if not finite.any():
                return force_n
            start = int(np.argmax(finite))
            self._last = float(block[start])
            # y = n0 u + state: the state that makes the first output the static gain's.
            self._state = np.array([(self._static_gain - self.numerator[0]) * (self._last - self.offset)])
        kept = block[start:]
        if not kept.size:
            return force_n
        if not finite[start:].all():
            index = np.where(finite[start:], np.arange(kept.size), -1)
            np.maximum.accumulate(index, out=index)
            kept = np.where(index >= 0, kept[index], self._last)
        self._last = float(kept[-1])
        # One code path for floats and blocks: lfilter's loop gives the same bits for any chunking.
        force_n[start:], self._state = lfilter(self.numerator, self.denominator, kept - self.offset, zi=self._state)
        return force_n


class CompensatorBank:
    """Several units at once: one `Compensator` a unit, in the order given to `stack`.

    Its kernel is compiled (or fetched from numba's cache) here, so that the first tick of a live session does not wait.
    """

    def __init__(self, filters: Sequence[Compensator]) -> None:
        self.filters = tuple(item._copy() for item in filters)
        if not self.filters:
            raise UsageError("a bank needs one filter at least: give stack() a list of compensators")
        rates = sorted({item.sample_rate_hz for item in self.filters})
        if len(rates) > 1:
            raise UsageError(f"filters of {rates[0]:g} and {rates[-1]:g} Hz cannot run together: make them at one rate")
        from smartshoe.kernels.streaming import push_block, push_tick

        self._push_tick, self._push_block = push_tick, push_block
        self._bank = np.array([item._column() for item in self.filters]).T.copy()
        self.reset()

    def __len__(self) -> int:
        return len(self.filters)

    def reset(self) -> None:
        """Forget the past of every unit."""
        self._bank[5:] = np.array([[0.0], [np.nan], [0.0]])

    @property
    def missing_count(self) -> tuple[int, ...]:
        """Per unit, how many readings since `reset` were not finite."""
        return tuple(int(count) for count in self._bank[7])

    def push(self, readings: ArrayLike, out: Array | None = None) -> Array:
        """Forces in N of one tick (units,) or a block (ticks, units), of the same shape as ``readings``.

        A new array, or ``out`` where it is given: float64, C-contiguous, of the readings' shape. It may be ``readings``
        itself but not overlap it otherwise. A tick of float64 with ``out`` allocates no array.
        Raises `InputError` for other shapes, and `UsageError` for an ``out`` that cannot be written to.
        """
        if out is not None:
            # Numba tells the types apart more cheaply than Python can, and refuses before it does anything.
            try:
                if out.ndim == 1 and self._push_tick(readings, out, self._bank):
                    return out
            except (TypeError, AttributeError):
                pass
        elif (
            type(readings) is np.ndarray
            and readings.shape == (len(self.filters),)
            and readings.dtype is _FLOAT64
            and readings.flags.carray
        ):
            out = np.empty(len(self.filters))
            self._push_tick(readings, out, self._bank)
            return out
        return self._push_any(readings, out)

    def _push_any(self, readings: ArrayLike, out: Array | None) -> Array:
        block = np.require(readings, dtype=np.float64, requirements=["C", "A", "W"])
        units = len(self.filters)
        if np.ndim(readings) not in (1, 2) or block.shape[-1] != units:
            raise InputError(f"readings have shape {np.shape(readings)}: give ({units},) or (ticks, {units})")
        if out is None:
            out = np.empty(block.shape)
        elif (
            not isinstance(out, np.ndarray)
            or out.dtype != np.float64
            or out.shape != block.shape
            or not out.flags.carray
        ):
            raise UsageError(
                f"out cannot hold the forces: give a writeable C-contiguous float64 array of {block.shape}"
            )
        self._push_block(block.reshape(-1, units), out.reshape(-1, units), self._bank)
        return out


def stack(filters: Sequence[Compensator]) -> CompensatorBank:
    """A bank that runs ``filters`` (all of one rate) side by side, each from a fresh start."""
    return CompensatorBank(filters)
