"""Resamples a shoe's readings, which arrive in blocks of any size, onto an even time base.

They come out in pieces of a fixed length; a piece is shorter only where a run of recording ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import InputError, UnitError
from smartshoe.recording import Recording
from smartshoe.units import Unit

LONGEST_HOLE_S = 10.0  # a longer hole ends a run of recording; shorter ones are interpolated linearly
ON_GRID = 0.02  # of a step: how far a sample's time may be from the even grid to be used as it is
HOLE_STEPS = 1.5
PIECE_S = 20.0


@dataclass(frozen=True, eq=False)
class Piece:
    """Consecutive samples of one run of recording, at the times ``start_s + k / rate_hz`` for k from ``first`` on.

    ``values`` (n, c) are finite. ``missing`` (n, c) marks samples that were interpolated or hold the last reading.
    ``last`` is true if the recording stops after this piece, for longer than `LONGEST_HOLE_S` or for good.
    """

    run: int
    start_s: float
    first: int
    values: Array
    missing: Mask
    last: bool


def pieces(
    blocks: Iterable[Recording], names: tuple[str, ...], rate_hz: float, piece_s: float = PIECE_S
) -> Iterator[Piece]:
    """Yield the channels ``names`` of consecutive ``blocks`` in pieces of ``piece_s``, whatever the size of the blocks.

    A row in which every channel is missing counts as no row. Raises `InputError` if a block lacks a channel or does not
    begin after the one before, and `UnitError` if its units differ.
    """
    size = max(1, round(piece_s * rate_hz))
    number = 0
    run: _EvenRun | None = None
    units: list[Unit] = []
    for block in blocks:
        time_s, values, missing = _rows(block, names)
        units = units or [block[name].unit for name in names]
        if [block[name].unit for name in names] != units:
            raise UnitError(f"{block.label}: a block's columns have other units than those before: give one trial")
        if time_s.size == 0:
            continue
        if run is not None and not time_s[0] > run.last_s:
            raise InputError(
                f"{block.label}: a block begins at {time_s[0]:.9g} s, the one before ended at {run.last_s:.9g} s: give"
                " blocks in order of time"
            )
        before = time_s[0] if run is None else run.last_s
        holes = np.flatnonzero(np.diff(np.concatenate([[before], time_s])) > LONGEST_HOLE_S)
        for first, stop in zip([0, *holes], [*holes, time_s.size], strict=True):
            if first in holes and run is not None:
                yield from run.taken(size, at_end=True)
                number, run = number + 1, None
            if first == stop:
                continue
            run = run or _EvenRun(number, float(time_s[first]), rate_hz)
            run.push(time_s[first:stop], values[first:stop], missing[first:stop])
            yield from run.taken(size, at_end=False)
    if run is not None:
        yield from run.taken(size, at_end=True)


def _rows(block: Recording, names: tuple[str, ...]) -> tuple[Array, Array, Mask]:
    """Times (n,), values (n, c) and mask of missing samples (n, c) of a block, less rows that are wholly missing."""
    lacking = [name for name in names if name not in block.channels]
    if lacking:
        raise InputError(
            f"{block.label}: a block lacks {', '.join(lacking)}: every block needs the first one's columns"
        )
    channels = [block[name] for name in names]
    values = np.column_stack([channel.values for channel in channels])
    if all(channel.missing is None for channel in channels):
        return block.time_s, values, np.zeros(values.shape, dtype=bool)
    missing = np.column_stack([~channel.present for channel in channels])
    there = ~missing.all(axis=1)
    return block.time_s[there], values[there], missing[there]


class _EvenRun:
    """One run of recording: takes rows as they come and gives evenly spaced rows, with missing samples interpolated."""

    def __init__(self, number: int, start_s: float, rate_hz: float) -> None:
        self.number, self.start_s, self.rate_hz = number, start_s, rate_hz
        self.last_s = start_s
        self._next = 0  # index of the next even row
        self._handed_on = 0  # number of rows given out so far
        self._end: tuple[Array, Mask] | None = None  # values and mask of the last row that was pushed
        self._values: list[Array] = []
        self._missing: list[Mask] = []
        self._anchor: Array | None = None  # the last row given out, from which interpolation starts

    def push(self, time_s: Array, values: Array, missing: Mask) -> None:
        """Resample rows, times (n,), values (n, c) and mask (n, c), onto the even times up to the last row."""
        if self._end is not None:
            time_s = np.concatenate([[self.last_s], time_s])
            values, missing = np.vstack([self._end[0], values]), np.vstack([self._end[1], missing])
        count = int(np.floor((time_s[-1] - self.start_s) * self.rate_hz + ON_GRID)) + 1
        grid = self.start_s + np.arange(self._next, count) / self.rate_hz
        behind = 0 if self._end is None else 1
        self.last_s, self._end = float(time_s[-1]), (values[-1], missing[-1])
        if grid.size == 0:
            return
        if grid.size == time_s.size - behind and np.abs(grid - time_s[behind:]).max() < ON_GRID / self.rate_hz:
            even, gone = values[behind:], missing[behind:]
        else:
            after = np.clip(np.searchsorted(time_s, grid), 1, time_s.size - 1)
            step = 1.0 / self.rate_hz
            hole = time_s[after] - time_s[after - 1] > HOLE_STEPS * step
            hole &= (np.abs(time_s[after] - grid) > 0.5 * step) & (np.abs(time_s[after - 1] - grid) > 0.5 * step)
            even = np.column_stack([np.interp(grid, time_s, column) for column in values.T])
            gone = np.column_stack([np.interp(grid, time_s, column.astype(float)) > 0.5 for column in missing.T])
            gone |= hole[:, None]
        self._next = count
        self._values.append(even)
        self._missing.append(gone)

    def taken(self, size: int, *, at_end: bool) -> Iterator[Piece]:
        """Yield the complete pieces of ``size`` rows; at the end all that is left, the last piece marked."""
        wait = round(LONGEST_HOLE_S * self.rate_hz)
        values = self._values[0] if len(self._values) == 1 else np.vstack(self._values)
        missing = self._missing[0] if len(self._missing) == 1 else np.vstack(self._missing)
        while values.shape[0] >= size + wait or (at_end and values.shape[0]):
            # A missing sample is interpolated towards the next present one, which may be up to ``wait`` rows ahead.
            seen, gone = values[: size + wait], missing[: size + wait]
            if gone[:size].any():
                seen = self._bridged(seen, gone)
            part = seen[:size]
            is_last = at_end and values.shape[0] <= size
            yield Piece(self.number, self.start_s, self._handed_on, part, gone[:size], is_last)
            self._anchor = part[-1]
            self._handed_on += part.shape[0]
            values, missing = values[size:], missing[size:]
        self._values, self._missing = [values], [missing]

    def _bridged(self, values: Array, missing: Mask) -> Array:
        """The values (n, c) with missing samples interpolated, also from the last row given out."""
        found = values.copy()
        at = np.arange(len(values))
        for column in np.flatnonzero(missing.any(axis=0)):
            there = ~missing[:, column]
            places, known = at[there], values[there, column]
            if self._anchor is not None:
                places, known = np.concatenate([[-1], places]), np.concatenate([self._anchor[column, None], known])
            found[:, column] = np.interp(at, places, known) if places.size else 0.0
        return found


def joined_head(blocks: Iterator[Recording], least_s: float) -> tuple[Recording | None, list[Recording]]:
    """The first blocks, up to ``least_s``: joined as one recording (None if there is no block), and as a list."""
    came: list[Recording] = []
    for block in blocks:
        came.append(block)
        if came[-1].time_s[-1] - came[0].time_s[0] >= least_s:
            break
    if not came:
        return None, came
    return _joined(came, came[0].time_s[0] + least_s), came


def _joined(blocks: list[Recording], end_s: float) -> Recording:
    """One recording of several consecutive blocks, up to ``end_s``."""
    from smartshoe.recording import Channel

    first = blocks[0]
    time_s = np.concatenate([block.time_s for block in blocks])
    keep = time_s <= end_s
    channels: Mapping[str, Channel] = {
        name: Channel.from_values(
            name, np.concatenate([block[name].with_nan() for block in blocks])[keep], channel.unit, channel.role
        )
        for name, channel in first.channels.items()
    }
    return Recording(
        time_s[keep], channels, name=first.name, unit=first.unit, metadata=first.metadata, source=first.source
    )
