"""Streams a shoe to a plain table on disk without losing samples, with forces for calibrated units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration, ForceFilter
from smartshoe.devices import Block, Shoe
from smartshoe.errors import UnitError, UsageError
from smartshoe.files.journal import AppendedFile
from smartshoe.units import Unit

LONGEST_BRIDGED_S = 2.0


class StreamTable:
    """A growing plain table: ``time_s``, a reading for each unit, a force for each calibrated unit.

    A block is completely on disk when `append` returns.
    """

    def __init__(self, path: Path | str, block: Block, forces: Sequence[str], metadata: Mapping[str, str]) -> None:
        """Create the file; raises `UsageError` if it exists."""
        readings = [f"{name}_{block.unit.suffix}" for name in block.names]
        header = ",".join(["time_s", *readings, *(f"{name}_force_estimate_n" for name in forces)])
        self._forces = tuple(forces)
        self._file = AppendedFile(path, new=True)
        self._file.append("".join([f"# {key}: {value}\n" for key, value in metadata.items()] + [header, "\n"]).encode())

    def append(self, block: Block, force_n: Mapping[str, Array]) -> None:
        """Append a block's samples as the shortest exact numbers, with empty cells for missing ones."""
        readings = np.where(block.missing, np.nan, block.readings)
        table = np.column_stack([block.time_s, readings, *(force_n[name] for name in self._forces)])
        rows = (",".join("" if value != value else repr(value) for value in row) for row in table.tolist())
        self._file.append("".join(f"{row}\n" for row in rows).encode())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class StreamedForces:
    """Forces of the calibrated units in a stream; lost samples are bridged so that the filters keep their time base."""

    def __init__(self, calibrations: Sequence[Calibration], shoe: Shoe) -> None:
        names = [channel.name for channel in shoe.describe()]
        self._rate_hz = shoe.sample_rate_hz
        self._filters: dict[str, ForceFilter] = {}
        self._units: dict[str, Unit] = {}
        self._last_s: float | None = None
        for calibration in calibrations:
            if calibration.unit not in names:
                raise UsageError(
                    f"the calibration of {calibration.unit or 'an unnamed unit'} fits no unit of {shoe}: it has"
                    f" {', '.join(names)}"
                )
            if calibration.unit in self._filters:
                raise UsageError(f"there are two calibrations of {calibration.unit}: give one a unit")
            self._filters[calibration.unit] = calibration.compensator(self._rate_hz)
            self._units[calibration.unit] = calibration.reading_unit

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the calibrated units."""
        return tuple(self._filters)

    def push(self, block: Block) -> dict[str, Array]:
        """Force (n,) in N of each calibrated unit; raises `UnitError` if the readings are of another quantity."""
        steps = np.diff(block.time_s, prepend=self._last_s if self._last_s is not None else block.time_s[:1])
        bridged = np.rint(np.clip(steps, 0.0, LONGEST_BRIDGED_S) * self._rate_hz).astype(int)
        if self._last_s is None:
            bridged[0] = 1
        at = np.cumsum(np.maximum(bridged, 1)) - 1
        found: dict[str, Array] = {}
        for name, filter_ in self._filters.items():
            column = block.names.index(name)
            readings = np.where(block.missing[:, column], np.nan, block.readings[:, column])
            if block.unit.quantity != self._units[name].quantity:
                raise UnitError(
                    f"the calibration of {name} takes {self._units[name].symbol}, the shoe sends {block.unit.symbol}:"
                    " give the calibration of this shoe"
                )
            even = np.full(int(at[-1]) + 1, np.nan)
            even[at] = block.unit.convert(readings, self._units[name])
            found[name] = filter_.push(even)[at]
        self._last_s = float(block.time_s[-1])
        return found


WIDTH, TIME_WIDTH, CELL_WIDTH = 80, 10, 17  # in characters: of a line, of its time, of one unit


class Seconds:
    """The smallest and the largest value of each unit since the last report, in N for calibrated units.

    A walking foot's value at one instant means little; the range within a second shows how far it was loaded.
    """

    def __init__(self, block: Block, forces: Sequence[str]) -> None:
        self._symbols = {name: "N" if name in forces else block.unit.symbol for name in block.names}
        self._low: dict[str, float] = {}
        self._high: dict[str, float] = {}

    @property
    def heading(self) -> str:
        """The names above the columns, with their units of measurement."""
        return "\n".join(self._rows("time", [f"{name} {symbol}" for name, symbol in self._symbols.items()]))

    def add(self, block: Block, force_n: Mapping[str, Array]) -> None:
        """Add a block; missing samples are ignored."""
        for column, name in enumerate(block.names):
            values = np.asarray(force_n.get(name, block.readings[:, column]))[~block.missing[:, column]]
            if values.size:
                self._low[name] = min(self._low.get(name, np.inf), float(values.min()))
                self._high[name] = max(self._high.get(name, -np.inf), float(values.max()))

    def report(self, time_s: float) -> str:
        """The line at ``time_s`` (several lines for many units); the ranges then start anew."""
        cells = [
            f"{self._low[name]:.1f} to {self._high[name]:.1f}" if name in self._low else "–" for name in self._symbols
        ]
        self._low, self._high = {}, {}
        return "\n".join(self._rows(f"{time_s:.1f} s", cells))

    def _rows(self, first: str, cells: Sequence[str]) -> list[str]:
        each = (WIDTH - TIME_WIDTH) // CELL_WIDTH
        rows = [cells[k : k + each] for k in range(0, len(cells), each)]
        return [
            f"{first if k == 0 else '':>{TIME_WIDTH}}" + "".join(f"{cell:>{CELL_WIDTH}}" for cell in row)
            for k, row in enumerate(rows)
        ]
