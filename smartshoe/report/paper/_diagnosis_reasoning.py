"""Figures of a diagnosis' reasoning: screening of effects, their likeness, and what is left."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from smartshoe.arrays import Array
from smartshoe.diagnosis import Diagnosis
from smartshoe.models.effects import in_words
from smartshoe.report.diagnosis.grids import ALIKE, compared, ranked
from smartshoe.report.diagnosis.views import Map
from smartshoe.report.paper.drawing import STYLE, figure_of

CAUSE, EQUIVALENT, OTHER = "#0072B2", "#56B4E9", "#cbd5e1"


def screening(diagnosis: Diagnosis) -> Figure | None:
    """Effects ranked by the fall of −2 log likelihood each alone could cause; causes and equivalents are marked."""
    bars = ranked(diagnosis)
    if not bars:
        return None
    names, falls = [bar.name for bar in bars], np.array([bar.fall for bar in bars])
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(5.2, 0.7 + 0.27 * len(names), 1)
        place = np.arange(len(names))
        for kind, colour in (("cause", CAUSE), ("equivalent", EQUIVALENT), ("other", OTHER)):
            shown = [k for k, bar in enumerate(bars) if bar.kind == kind]
            label = next((bar.says for bar in bars if bar.kind == kind), "")
            if shown:
                axis.barh(place[shown], falls[shown] / falls[0] * 100.0, color=colour, label=label, height=0.72)
        for k, fall in enumerate(falls):
            axis.text(fall / falls[0] * 100.0 + 1.5, k, f"{fall:,.0f}", va="center", fontsize=8)
        axis.set_yticks(place, [in_words(name) for name in names])
        axis.invert_yaxis()
        axis.set_xlim(0, 122)
        axis.grid(axis="y", visible=False)
        axis.set_axisbelow(True)
        axis.set_xlabel("fall of −2 log likelihood (%, and as a number)")
        axis.legend(loc="lower right", fontsize=8)
        figure.subplots_adjust(left=0.33, right=0.99, top=0.98)
        return figure


def likeness(diagnosis: Diagnosis) -> Figure | None:
    """The likeness, in this data, of the effects at the top of the screening; with 1 they cannot be told apart."""
    found = compared(diagnosis)
    if found is None:
        return None
    chosen, part = found
    with mpl.rc_context(STYLE):
        height = 1.7 + 0.29 * len(chosen)
        figure, (axis,) = figure_of(5.2, height, 1)
        _cells(axis, part, "Blues", 0.0, 1.0)
        for i, j in np.ndindex(part.shape):
            if i != j:
                axis.text(
                    j, i, f"{part[i, j]:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if part[i, j] > 0.6 else "#374151", fontweight="bold" if part[i, j] > ALIKE else None,
                )  # fmt: skip
        labels = [in_words(name) for name in chosen]
        axis.set_xticks(range(len(chosen)), labels, rotation=40, ha="right")
        axis.set_yticks(range(len(chosen)), labels)
        figure.subplots_adjust(left=0.31, right=0.98, top=0.98, bottom=1.4 / height)
        return figure


def what_is_left(by_load: Map | None, by_cycle: Map | None, unit: str) -> Figure | None:
    """Maps of the mean residual of the extended simulation, on one colour scale."""
    maps: list[tuple[Map, str, str, str]] = []
    if by_load is not None:
        maps.append((by_load, "over load and rate", "rate of the ramp (N/s), unloading left", "load (N)"))
    if by_cycle is not None:
        title, up = "over the course of each load cycle", "place in the cycle (% of its time)"
        maps.append((by_cycle, title, "load cycle (number)", up))
    maps = [one for one in maps if np.isfinite(one[0].values).any()]
    if not maps:
        return None
    everything = np.concatenate([np.abs(found.values[np.isfinite(found.values)]) for found, *_ in maps])
    limit = float(np.percentile(everything, 98)) or 1.0
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(10.6, 3.6, len(maps))
        for axis, (found, title, across, up) in zip(axes, maps, strict=True):
            mesh: Any = _cells(axis, found.values, "RdBu_r", -limit, limit, found.row_edges)
            shown = np.arange(0, len(found.columns), -(-len(found.columns) // 14))
            axis.set_xticks(shown, [found.columns[k] for k in shown], rotation=35 if found is by_load else 0)
            axis.set_title(title, fontsize=9)
            axis.set_xlabel(across)
            axis.set_ylabel(up)
        figure.subplots_adjust(left=0.07, right=0.87, bottom=0.2, wspace=0.22)
        bar = figure.add_axes((0.89, 0.2, 0.015, 0.7))
        figure.colorbar(mesh, cax=bar, label=f"measured − simulated ({unit})")
        return figure


def _cells(axis: Any, values: Array, colours: str, low: float, high: float, edges: Array | None = None) -> Any:
    """Coloured cells; the first row is on top if rows are names (no ``edges``), at the bottom if they are numbers."""
    rows, columns = values.shape
    up = np.arange(rows + 1) - 0.5 if edges is None else edges
    mesh = axis.pcolormesh(
        np.arange(columns + 1) - 0.5, up, np.ma.masked_invalid(values), cmap=colours, vmin=low, vmax=high,
        edgecolors="face", linewidth=0.2, rasterized=values.size > 400,
    )  # fmt: skip
    if edges is None:
        axis.invert_yaxis()
    axis.grid(visible=False)
    return mesh
