"""A bank of filters for several units at once; plain filters run together in one compiled pass."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, numbers_of
from smartshoe.calibration._compensator import Compensator
from smartshoe.calibration._filter import ForceFilter
from smartshoe.errors import InputError, UsageError

_FLOAT64 = np.dtype(np.float64)
_NO_FILTER = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.nan, 0.0]


class CompensatorBank:
    """Filters of several units that run together, one filter per unit, in the order given to `stack`.

    The kernel is compiled (or fetched from numba's cache) on construction, so that the first tick of a live session is
    not delayed.
    """

    def __init__(self, filters: Sequence[ForceFilter]) -> None:
        self.filters = tuple(item._copy() for item in filters)
        if not self.filters:
            raise UsageError("a bank needs one filter at least: give stack() a list of compensators")
        rates = sorted({item.sample_rate_hz for item in self.filters})
        if len(rates) > 1:
            raise UsageError(f"filters of {rates[0]:g} and {rates[-1]:g} Hz cannot run together: make them at one rate")
        from smartshoe.kernels.streaming import push_block, push_tick

        self._push_tick, self._push_block = push_tick, push_block
        self._bank = np.array([_column(item) for item in self.filters]).T.copy()
        self.reset()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)} filters at {self.filters[0].sample_rate_hz:g} Hz>"

    def __len__(self) -> int:
        return len(self.filters)

    def reset(self) -> None:
        """Return all filters to their initial state."""
        self._bank[5:] = np.array([[0.0], [np.nan], [0.0]])

    @property
    def missing_count(self) -> tuple[int, ...]:
        """For each unit, how many readings since `reset` were not finite."""
        return tuple(int(count) for count in self._bank[7])

    def push(self, readings: ArrayLike, out: Array | None = None) -> Array:
        """Forces in N of one tick (units,) or a block (ticks, units), of the same shape as ``readings``.

        The result is a new array, or ``out`` where it is given: float64, C-contiguous, of the readings' shape. ``out``
        may be ``readings`` itself, but must not overlap it otherwise. A tick of float64 with ``out`` allocates no
        array. Raises `InputError` for other shapes, and `UsageError` for an ``out`` that cannot be written to.
        """
        if out is not None:
            # Numba checks the types more cheaply than Python can, and refuses wrong ones before it runs.
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
        block = np.require(numbers_of(readings, "readings"), requirements=["C", "A", "W"])
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


class MixedBank(CompensatorBank):
    """A bank in which some filters are not plain; those run one by one, the plain ones in one compiled pass."""

    def __init__(self, filters: Sequence[ForceFilter]) -> None:
        self._others: tuple[tuple[int, ForceFilter], ...] = ()
        super().__init__(filters)
        # The bank's own copies, in their initial state.
        self._others = tuple((k, item) for k, item in enumerate(self.filters) if not isinstance(item, Compensator))

    def reset(self) -> None:
        """Return all filters to their initial state."""
        super().reset()
        for _, item in self._others:
            item.reset()

    @property
    def missing_count(self) -> tuple[int, ...]:
        """For each unit, how many readings since `reset` were not finite."""
        counts = list(super().missing_count)
        for column, item in self._others:
            counts[column] = item.missing_count
        return tuple(counts)

    def push(self, readings: ArrayLike, out: Array | None = None) -> Array:
        """The same as `CompensatorBank.push`."""
        # A copy, since ``out`` may be the readings themselves.
        block = np.array(numbers_of(readings, "readings"))
        forces_n = super().push(readings, out)
        for column, item in self._others:
            forces_n[..., column] = item.push(block[..., column])
        return forces_n


def _column(item: ForceFilter) -> list[float]:
    return item._column() if isinstance(item, Compensator) else _NO_FILTER


def stack(filters: Sequence[ForceFilter]) -> CompensatorBank:
    """A bank of filters, one per unit, that run together, each from its initial state.

    Parameters
    ----------
    filters
        Plain or extended compensators, all of one rate.

    Raises
    ------
    UsageError
        Where no filter is given, or their rates differ.

    Examples
    --------
    >>> import numpy as np
    >>> import smartshoe
    >>> filters = [smartshoe.Compensator(0.2, 5.0, b1, sample_rate_hz=100.0) for b1 in (1.0, 1.1)]
    >>> bank = smartshoe.stack(filters)
    >>> bank.push(np.array([10.0, 20.0])).round(6).tolist()  # one tick: a reading of each unit, in N
    [50.0, 110.0]
    >>> bank.push(np.full((3, 2), 10.0)).shape  # a block of three
    (3, 2)
    """
    if isinstance(filters, ForceFilter) or not isinstance(filters, Iterable):
        raise UsageError(f"filters is of type {type(filters).__name__}: give stack() a list of compensators")
    filters = tuple(filters)
    if strange := [type(item).__name__ for item in filters if not isinstance(item, ForceFilter)]:
        raise UsageError(f"filters hold one of type {strange[0]}: give stack() a list of compensators")
    plain = all(isinstance(item, Compensator) for item in filters)
    return CompensatorBank(filters) if plain else MixedBank(filters)
