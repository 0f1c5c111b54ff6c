"""What all figures for papers share: style, thinning of lines, and saving."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from smartshoe.arrays import Array
from smartshoe.files.atomic import replacing

MOST = 900  # points of a line
FOOT_COLOURS = {"left": "#0072B2", "right": "#D55E00"}
REGION_COLOURS = {"heel": "#7c3aed", "meta4": "#0891b2", "meta1": "#ca8a04", "toe": "#be185d"}
TOTAL = "#1f2937"
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "smartshoe",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
}


def thin(x: Array, *signals: Array) -> tuple[Array, ...]:
    """Reduce to at most about `MOST` points that keep the extremes of the first signal in each segment."""
    if x.size <= MOST:
        return (x, *signals)
    block = -(-x.size // (MOST // 2))
    count = x.size // block
    cut = signals[0][: count * block].reshape(count, block)
    start = np.arange(count) * block
    index = np.unique(np.concatenate([start + cut.argmin(axis=1), start + cut.argmax(axis=1), [0, x.size - 1]]))
    return (x[index], *(signal[index] for signal in signals))


def save(figure: Figure, folder: Path, name: str, endings: Sequence[str]) -> list[Path]:
    """Write the figure as ``name.ending`` for each of ``endings`` (svg, pdf, png), each file whole or not at all.

    The same figure always gives the same bytes. Returns the paths.
    """
    written = [folder / f"{name}.{ending}" for ending in endings]
    for path, ending in zip(written, endings, strict=True):
        metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(ending)
        with mpl.rc_context(STYLE), replacing(path) as temporary:
            figure.savefig(temporary, format=ending, dpi=200, metadata=metadata)
    return written


def figure_of(width: float, height: float, columns: int, rows: int = 1) -> tuple[Figure, list[Any]]:
    """A figure of ``width`` by ``height`` inches and its axes, row by row."""
    figure = Figure(figsize=(width, height))
    axes = figure.subplots(rows, columns, squeeze=False)
    # Fixed margins (inches divided by the size), since a tight layout would draw every text twice.
    figure.subplots_adjust(0.75 / width, 0.45 / height, 1 - 0.15 / width, 1 - 0.3 / height, 0.25, 0.3)
    return figure, list(axes.ravel())
