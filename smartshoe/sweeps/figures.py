"""Figures of a sweep: a figure of merit against each key, and against pairs of keys."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from smartshoe.report.drawing import STYLE, figure_of, svg

if TYPE_CHECKING:
    import pandas as pd

POINT, LINE, BAND = "#93c5fd", "#1f2937", "#2563eb"
BINS = 8  # of a key that takes more values than that
MOST_POINTS = 2000
MOST_PAIRS = 6
COLUMNS = 3


def one_at_a_time(table: pd.DataFrame, keys: list[str], figure: str) -> str | None:
    """``figure`` against each key: cases as points, their median and quartiles at each value; SVG text."""
    rows = -(-len(keys) // COLUMNS)
    if not keys:
        return None
    width, height = 9.6, 0.75 + 2.3 * rows
    with mpl.rc_context(STYLE):
        drawn, axes = figure_of(width, height, min(COLUMNS, len(keys)), rows)
        drawn.subplots_adjust(top=1 - 0.3 / height, bottom=0.5 / height, hspace=0.6, wspace=0.3)
        for axis, key in zip(axes, keys, strict=False):
            _against(axis, table, key, figure)
        for axis in axes[len(keys) :]:
            axis.set_visible(False)
        axes[0].set_ylabel(figure)
        return svg(drawn)


def _against(axis: Any, table: pd.DataFrame, key: str, figure: str) -> None:
    there = table[[key, figure]].dropna()
    places, names = _places(there[key])
    shown = slice(None, None, max(1, len(there) // MOST_POINTS))
    axis.plot(places[shown], there[figure].to_numpy()[shown], ".", color=POINT, ms=3)
    groups = [there[figure].to_numpy()[places == place] for place in np.unique(places)]
    at = np.unique(places)
    if len(at) > BINS and names is None:
        edges = np.quantile(places, np.linspace(0, 1, BINS + 1))
        which = np.clip(np.searchsorted(edges, places, side="right") - 1, 0, BINS - 1)
        groups = [there[figure].to_numpy()[which == each] for each in np.unique(which)]
        at = np.array([np.median(places[which == each]) for each in np.unique(which)])
    low, middle, high = np.array([np.quantile(group, [0.25, 0.5, 0.75]) for group in groups]).T
    axis.fill_between(at, low, high, color=BAND, alpha=0.15, lw=0)
    axis.plot(at, middle, "o-", color=LINE, ms=3)
    if names is not None:
        axis.set_xticks(range(len(names)), names)
    axis.set_xlabel(key)


def _places(values: pd.Series[Any]) -> tuple[Any, list[str] | None]:
    """Where values stand on an axis: themselves where they are numbers, else one place a word, with the words."""
    import pandas as pd

    if pd.api.types.is_numeric_dtype(values) and not pd.api.types.is_bool_dtype(values):
        return values.to_numpy(dtype=float), None
    codes, words = pd.factorize(values, sort=True)
    return codes.astype(float), [str(word) for word in words]


def pair_maps(table: pd.DataFrame, keys: list[str], figure: str) -> str | None:
    """The median of ``figure`` over each pair of keys (the first ones where there are many); SVG text."""
    pairs = list(combinations(keys, 2))[:MOST_PAIRS]
    if not pairs:
        return None
    rows = -(-len(pairs) // COLUMNS)
    width, height = 9.6, 0.75 + 2.5 * rows
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        drawn, axes = figure_of(width, height, min(COLUMNS, len(pairs)), rows)
        drawn.subplots_adjust(top=1 - 0.3 / height, bottom=0.5 / height, hspace=0.6, wspace=0.45)
        bounds = table[figure].quantile([0.02, 0.98])
        for axis, (across, up) in zip(axes, pairs, strict=False):
            image = _map(axis, table, across, up, figure, (float(bounds.iloc[0]), float(bounds.iloc[1])))
            drawn.colorbar(image, ax=axis)
        for axis in axes[len(pairs) :]:
            axis.set_visible(False)
        return svg(drawn)


def _map(axis: Any, table: pd.DataFrame, across: str, up: str, figure: str, bounds: tuple[float, float]) -> Any:
    there = table[[across, up, figure]].dropna()
    columns, rows = _classes(there[across]), _classes(there[up])
    cells = there[figure].groupby([rows[0], columns[0]]).median().unstack()
    grid = np.full((len(rows[1]), len(columns[1])), np.nan)
    grid[np.ix_(cells.index.to_numpy(dtype=int), cells.columns.to_numpy(dtype=int))] = cells.to_numpy()
    image = axis.imshow(grid, origin="lower", aspect="auto", cmap="viridis", vmin=bounds[0], vmax=bounds[1])
    for set_ticks, (_, names) in ((axis.set_xticks, columns), (axis.set_yticks, rows)):
        every = max(1, len(names) // 4)
        set_ticks(range(0, len(names), every), names[::every])
    axis.set_xlabel(across)
    axis.set_ylabel(up)
    return image


def _classes(values: pd.Series[Any]) -> tuple[Any, list[str]]:
    """The class of each value and the classes' names: each value one, or `BINS` of as many cases each."""
    places, names = _places(values)
    if names is not None:
        return places.astype(int), names
    single = np.unique(places)
    if single.size <= BINS:
        return np.searchsorted(single, places), [f"{value:.4g}" for value in single]
    edges = np.quantile(places, np.linspace(0, 1, BINS + 1))
    which = np.clip(np.searchsorted(edges, places, side="right") - 1, 0, BINS - 1)
    return which, [f"{0.5 * (low + high):.3g}" for low, high in pairwise(edges)]
