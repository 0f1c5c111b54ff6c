"""Data for coloured tables and bars: effects by what they could explain, their likeness, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis import Diagnosis
from smartshoe.models.effects import in_words
from smartshoe.report.diagnosis.views import Map
from smartshoe.report.numbers import plain

Kind = Literal["cause", "equivalent", "minor", "other"]

MOST_BARS, MOST_ALIKE = 12, 10
ALIKE = 0.95  # likeness beyond which only a full fit can tell two effects apart, if at all
SAYS: dict[Kind, str] = {
    "cause": "named as a cause, or stands for one", "equivalent": "cannot be told from a cause",
    "minor": "in the extended model, without a name", "other": "not chosen",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bar:
    """An effect with the fall of −2 log likelihood that it alone could cause, and that in percent of the largest."""

    name: str
    fall: float
    percent: float
    kind: Kind

    @property
    def says(self) -> str:
        """What the diagnosis made of the effect."""
        return SAYS[self.kind]


def ranked(diagnosis: Diagnosis) -> list[Bar]:
    """Effects by the fall of the baseline's −2 log likelihood that each alone could cause, the largest first."""
    falls = [(name, fall) for name, fall in diagnosis.screening if np.isfinite(fall) and fall > 0][:MOST_BARS]
    kinds: dict[str | None, Kind] = dict.fromkeys(diagnosis.minor, "minor")
    kinds |= {name: "equivalent" for cause in diagnosis.causes for name in cause.equivalents}
    kinds |= {name: "cause" for cause in diagnosis.causes for name in (cause.name, cause.part)}
    most = max((fall for _, fall in falls), default=1.0)
    return [Bar(name, fall, 100.0 * fall / most, kinds.get(name, "other")) for name, fall in falls]


def compared(diagnosis: Diagnosis) -> tuple[list[str], Array] | None:
    """Names (n,) and likeness in this data (n, n) of causes, equivalents and rivals, then of the strongest effects.

    None if there is nothing to compare.
    """
    matrix = diagnosis.likeness
    names = [name for name, _ in diagnosis.screening]
    if matrix is None or matrix.shape != (len(names), len(names)) or len(names) < 2:
        return None
    wanted = [cause.name for cause in diagnosis.causes]
    wanted += [name for cause in diagnosis.causes for name in cause.equivalents]
    wanted += [cause.rivals[0].effect for cause in diagnosis.causes if cause.rivals]
    order = [name for name in dict.fromkeys([*wanted, *names]) if name in names]
    chosen = sorted(names.index(name) for name in order[:MOST_ALIKE])
    return [names[k] for k in chosen], np.nan_to_num(matrix[np.ix_(chosen, chosen)], nan=0.0)


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a coloured table: its text, depth of colour (0 to 100), and whether its number is negative."""

    text: str
    depth: int
    below: bool
    strong: bool = False


@dataclass(frozen=True, slots=True)
class Grid:
    """A coloured table: a title, labels for columns and rows, and rows of cells, each with its label."""

    title: str
    across: str
    down: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Cell]]]


def likeness(diagnosis: Diagnosis) -> Grid | None:
    """The likeness of the effects as a table; effects with 1 cannot be told apart."""
    found = compared(diagnosis)
    if found is None:
        return None
    names, part = found
    labels = [in_words(name) for name in names]
    rows = [
        (
            label,
            [
                Cell("–" if i == j else f"{value:.2f}", 0 if i == j else round(100 * value), False, value > ALIKE)
                for j, value in enumerate(row)
            ],
        )
        for i, (label, row) in enumerate(zip(labels, part, strict=True))
    ]
    return Grid("How alike the effects look in this data", "", "effect", labels, rows)


def left_grids(by_load: Map | None, by_cycle: Map | None, unit: str) -> list[Grid]:
    """The mean remaining error over load and rate, and over the course of the cycles, on one colour scale."""
    given = [
        (by_load, "Over load and rate", "rate of the ramp (N/s), unloading negative", "load (N)"),
        (by_cycle, "Over the course of each load cycle", "load cycle (number)", "place in the cycle (% of its time)"),
    ]
    maps = [
        (one, title, across, down)
        for one, title, across, down in given
        if one is not None and np.isfinite(one.values).any()
    ]
    if not maps:
        return []
    everything = np.concatenate([np.abs(one.values[np.isfinite(one.values)]) for one, *_ in maps])
    limit = float(np.percentile(everything, 98)) or 1.0
    return [
        Grid(f"{title} ({unit})", across, down, one.columns, _rows(one, limit)) for one, title, across, down in maps
    ]


def _rows(found: Map, limit: float) -> list[tuple[str, list[Cell]]]:
    low, high = found.row_edges[:-1], found.row_edges[1:]
    decimals = max(0, 1 - int(np.floor(np.log10(limit))))

    def cell(value: float) -> Cell:
        if not np.isfinite(value):
            return Cell("", 0, False)
        text = f"{value:.{decimals}f}"
        return Cell("0" if float(text) == 0 else text.replace("-", "−"),
                    round(100 * min(abs(value) / limit, 1.0)), value < 0)  # fmt: skip

    made = [
        (f"{plain(a)}–{plain(b)}".replace("-", "−"), [cell(value) for value in row])
        for a, b, row in zip(low, high, found.values, strict=True)
    ]
    return made[::-1]  # the largest load first
