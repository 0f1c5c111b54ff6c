"""Charts of a sweep: a figure of merit against each key, and against pairs of keys."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.report.charts import Chart, Line, Panel
from smartshoe.report.numbers import plain

if TYPE_CHECKING:
    import pandas as pd

CLASSES = 8  # number of equally large classes into which a key with more values is divided
LINES = 5  # largest number of lines in a chart over a pair of keys
LINE_COLOURS = ("load", "reading", "raw", "corrected", "toe")
MOST_PAIRS = 6


def against_key(table: pd.DataFrame, key: str, figure: str) -> Chart:
    """``figure`` against one key, over all other keys: median, quartiles, minimum and maximum."""
    there = table[[key, figure]].dropna()
    which, x, words = _classes(there[key], CLASSES)
    groups = [there[figure].to_numpy()[which == each] for each in range(x.size)]
    low, first, median, third, high = np.array([np.quantile(group, [0.0, 0.25, 0.5, 0.75, 1.0]) for group in groups]).T
    ends = f"Median from {plain(median[0])} to {plain(median[-1])} over {len(there)} cases"
    says = f"{ends}; the band holds the middle half.{words}"
    lines = [
        Line("median", median, "load", low=first, high=third),
        Line("most", high, "raw", "points"),
        Line("least", low, "corrected", "points"),
    ]
    return Chart(f"Against {key}", says, key, x, [Panel(figure, lines)])


def over_pairs(table: pd.DataFrame, keys: list[str], figure: str) -> list[Chart]:
    """The median of ``figure`` against one key, with a line for each value of another; non-parallel lines interact.

    Only the first `MOST_PAIRS` pairs of ``keys`` are drawn.
    """
    return [_over_pair(table, across, other, figure) for across, other in list(combinations(keys, 2))[:MOST_PAIRS]]


def _over_pair(table: pd.DataFrame, across: str, other: str, figure: str) -> Chart:
    there = table[[across, other, figure]].dropna()
    which, x, words = _classes(there[across], CLASSES)
    line_of, levels, names = _classes(there[other], LINES)
    lines = []
    for number, level in enumerate(levels):
        values = np.full(x.size, np.nan)
        for each in range(x.size):
            own = there[figure].to_numpy()[(which == each) & (line_of == number)]
            if own.size:
                values[each] = np.median(own)
        lines.append(Line(f"{other} {plain(level)}", values, LINE_COLOURS[number]))
    says = f"Medians; a line for each value of {other}. Lines that are not parallel: the keys interact.{words}{names}"
    return Chart(f"{across} and {other}", says, across, x, [Panel(figure, lines)])


def _classes(values: pd.Series[Any], most: int) -> tuple[Any, Any, str]:
    """The class of each value, the position (ascending) of each class on an axis, and a sentence that explains words.

    Each value is a class, or the values are divided into ``most`` classes of equally many cases, placed at their
    medians.
    """
    import pandas as pd

    if not pd.api.types.is_numeric_dtype(values) or pd.api.types.is_bool_dtype(values):
        codes, words = pd.factorize(values, sort=True)
        named = ", ".join(f"{number} = {word}" for number, word in enumerate(words[:most]))
        return np.minimum(codes, most - 1), np.arange(min(len(words), most), dtype=float), f" {named}."
    numbers = values.to_numpy(dtype=float)
    single = np.unique(numbers)
    if single.size <= most:
        return np.searchsorted(single, numbers), single, ""
    edges = np.unique(np.quantile(numbers, np.linspace(0, 1, most + 1)))
    which = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, edges.size - 2)
    there, which = np.unique(which, return_inverse=True)
    return which, np.array([np.median(numbers[which == each]) for each in range(there.size)]), ""
