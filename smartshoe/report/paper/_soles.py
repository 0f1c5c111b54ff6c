"""The centre of pressure over drawn insoles: each foot's path, and the butterfly curve of both feet."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path

from smartshoe.arrays import Array
from smartshoe.gait import FootSeries, GaitResult
from smartshoe.gait.insole import OUTLINE, PLACES
from smartshoe.report.gait.shapes import INWARDS, MIDDLE, paths_of, placed
from smartshoe.report.gait.strides import main_strides
from smartshoe.report.paper.drawing import FOOT_COLOURS, REGION_COLOURS, STYLE, TOTAL

MOST_STANCES = 30
MOST_SWAY = 3000


def outline(foot: str) -> Path:
    """The insole's outline as a closed smooth curve, seen from above with the heel at the bottom."""
    points = np.array([(MIDDLE[foot] + INWARDS[foot] * medial, along) for along, medial in OUTLINE])
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    # A Catmull-Rom curve through the points, as cubic Bézier segments.
    slope = (after - before) / 6.0
    vertices, codes = [points[0]], [Path.MOVETO]
    for k in range(len(points)):
        following = (k + 1) % len(points)
        vertices += [points[k] + slope[k], points[following] - slope[following], points[following]]
        codes += [Path.CURVE4] * 3
    return Path(vertices, codes)


def _draw_sole(axis: Any, foot: FootSeries) -> None:
    axis.add_patch(PathPatch(outline(foot.name), facecolor="#f9fafb", edgecolor="#9ca3af", lw=1.2, zorder=0))
    usual = foot.usual_peak / max(float(foot.usual_peak.max()), 1e-12)
    for region, peak in zip(foot.regions, usual, strict=True):
        along, medial = PLACES[region]
        at = (MIDDLE[foot.name] + INWARDS[foot.name] * medial, along)
        size = 0.02 + 0.03 * float(np.sqrt(max(peak, 0.0)))
        axis.add_patch(Circle(at, size, facecolor=REGION_COLOURS[region], alpha=0.35, lw=0, zorder=1))
        axis.annotate(
            region, (at[0], along + size + 0.008), fontsize=7, color="#4b5563", va="bottom", ha="center", zorder=4
        )


def _plain(axis: Any, title: str) -> None:
    axis.set_aspect("equal")
    axis.set_xlim(-0.5, 0.5)
    axis.set_ylim(-0.05, 1.05)
    axis.set_axis_off()
    axis.set_title(title)


def centre(found: GaitResult) -> Figure:
    """Left: each foot's centre of pressure over its insole. Right: that of both feet, as if they stood side by side."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 4.9))
        both = len(found.feet) == 2 and found.total_n is not None
        axes = figure.subplots(1, 2 if both else 1, squeeze=False)[0]
        figure.subplots_adjust(0.02, 0.02, 0.98, 0.93, 0.06)
        for foot in found.feet.values():
            _draw_sole(axes[0], foot)
            paths, mean = paths_of(found, foot)
            for path in paths[:: max(1, len(paths) // MOST_STANCES)]:
                axes[0].plot(*placed(foot.name, path).T, color=FOOT_COLOURS[foot.name], lw=0.5, alpha=0.3, zorder=2)
            if paths:
                points = placed(foot.name, mean)
                pieces = np.stack([points[:-1], points[1:]], axis=1)
                line = LineCollection(list(pieces), cmap="viridis", linewidths=3.0, zorder=3)
                line.set_array(np.linspace(0.0, 100.0, len(pieces)))
                axes[0].add_collection(line)
            else:
                known = np.flatnonzero(np.isfinite(foot.centre[:, 0]))
                sway = foot.centre[known[:: max(1, known.size // MOST_SWAY)]]
                axes[0].plot(*placed(foot.name, sway).T, ",", color=FOOT_COLOURS[foot.name], alpha=0.6, zorder=2)
        moved = " (mean path from dark, heel strike, to light, toe off)" if found.strides else ""
        _plain(axes[0], f"each foot{moved}")
        if both:
            for foot in found.feet.values():
                axes[1].add_patch(
                    PathPatch(outline(foot.name), facecolor="#f9fafb", edgecolor="#d1d5db", lw=1.0, zorder=0)
                )
            axes[1].plot(*_of_both(found).T, color=TOTAL, lw=0.5, alpha=0.5)
            _plain(axes[1], "both feet, as if side by side")
        return figure


def _of_both(found: GaitResult) -> Array:
    """The centre of both feet's load (n, 2) over the strides shown; NaN where neither foot bears load."""
    feet = list(found.feet.values())
    time_s = feet[0].time_s
    own = main_strides(found, feet[0].name)
    if own:
        shown = own[:MOST_STANCES]
        time_s = time_s[(time_s >= shown[0].start_s) & (time_s <= shown[-1].end_s)]
    elif time_s.size > MOST_SWAY:
        time_s = time_s[:: time_s.size // MOST_SWAY]
    moment, whole = np.zeros((time_s.size, 2)), np.zeros(time_s.size)
    for foot in feet:
        held = np.maximum(np.interp(time_s, foot.time_s, foot.load.sum(axis=1)), 0.0)
        known = np.isfinite(foot.centre[:, 0])
        if not known.any():
            continue
        points = placed(foot.name, foot.centre[known])
        at = np.column_stack([np.interp(time_s, foot.time_s[known], points[:, way]) for way in range(2)])
        moment += held[:, None] * at
        whole += held
    least = 0.1 * float(whole.max()) if whole.size else 0.0
    return np.where((whole > least)[:, None], moment / np.maximum(whole, 1e-12)[:, None], np.nan)
