"""A trial's figures for papers: overlaid strides, the butterfly of both feet, phases as bands, the whole trial."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from smartshoe.arrays import Array
from smartshoe.gait import GaitResult, Stride
from smartshoe.gait.indices import POINTS, overlaid
from smartshoe.gait.membership import PHASES as MEMBERS
from smartshoe.gait.phases import PHASES
from smartshoe.gait.summary import of_main_activity
from smartshoe.report.gait.strides import main_strides, whole_of
from smartshoe.report.paper._soles import centre
from smartshoe.report.paper.drawing import FOOT_COLOURS, REGION_COLOURS, STYLE, TOTAL, figure_of, save, thin

PHASE_COLOURS = ("#f3f4f6", "#a5b4fc", "#6ee7b7", "#fcd34d")
MEMBER_COLOURS = ("#c7d2fe", "#a5b4fc", "#6ee7b7", "#fde68a", "#fbbf24", "#f3f4f6")
MOST_STRIDES = 40
WINDOW_STRIDES = 5
ABOVE: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 4, "fontsize": 8, "borderpad": 0.1}
PERCENT = np.linspace(0.0, 100.0, POINTS)


def bundle(x: Array, rows: Array, colour: str) -> LineCollection:
    """Many thin lines (m, n) over ``x`` (n,) as one artist; separate lines would take ten times as long to draw."""
    pieces = np.stack([np.broadcast_to(x, rows.shape), rows], axis=2)
    return LineCollection(list(pieces), colors=colour, linewidths=0.4, alpha=0.25)


def _unit(found: GaitResult) -> str:
    foot = next(iter(found.feet.values()))
    return "vertical force (N)" if foot.force_n is not None else f"sum of readings ({foot.symbol})"


def _toe_off(strides: Sequence[Stride]) -> float:
    return float(np.mean([stride.stance_percent for stride in strides]))


def strides(found: GaitResult) -> Figure | None:
    """All strides of each foot overlaid, with mean and a band of one sd; None without strides."""
    feet = [foot for foot in found.feet.values() if main_strides(found, foot.name)]
    if not feet:
        return None
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 3.4, len(feet))
        top = 0.0
        for axis, foot in zip(axes, feet, strict=True):
            own = main_strides(found, foot.name)
            each = overlaid(own, foot.time_s, whole_of(foot))
            mean, sd = each.mean(axis=0), each.std(axis=0)
            colour = FOOT_COLOURS[foot.name]
            axis.add_collection(bundle(PERCENT, each[:: max(1, len(own) // MOST_STRIDES)], colour))
            axis.fill_between(PERCENT, mean - sd, mean + sd, color=colour, alpha=0.3, lw=0, label="± 1 sd")
            axis.plot(PERCENT, mean, color=TOTAL, lw=1.3, label="mean")
            axis.axvline(_toe_off(own), color=TOTAL, lw=0.8, ls="--", label="toe off")
            axis.set_title(f"{foot.name}, {len(own)} strides")
            axis.set_xlabel("stride (%), from heel strike")
            axis.set_xlim(0, 100)
            top = max(top, float(each.max()))
        for axis in axes:
            axis.set_ylim(min(0.0, -0.04 * top), 1.06 * top)
        axes[0].set_ylabel(_unit(found))
        axes[0].legend(loc="upper right", fontsize=8)
        return figure


def butterfly(found: GaitResult) -> Figure | None:
    """The left foot's mean force upwards and the right one's downwards, with bands, and their difference.

    None with one foot.
    """
    feet = [foot for foot in found.feet.values() if main_strides(found, foot.name)]
    if len(feet) < 2:
        return None
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(9.6, 3.6, 1)
        means, top = [], 0.0
        for foot, sign in zip(feet, (1.0, -1.0), strict=True):
            own = main_strides(found, foot.name)
            each = overlaid(own, foot.time_s, whole_of(foot))
            mean, sd = each.mean(axis=0), each.std(axis=0)
            colour = FOOT_COLOURS[foot.name]
            axis.fill_between(PERCENT, 0.0, sign * mean, color=colour, alpha=0.18, lw=0)
            axis.fill_between(PERCENT, sign * (mean - sd), sign * (mean + sd), color=colour, alpha=0.35, lw=0)
            axis.plot(PERCENT, sign * mean, color=colour, lw=1.8, label=foot.name)
            axis.plot([_toe_off(own)] * 2, [0.0, sign * 0.35 * mean.max()], color=colour, lw=0.9, ls="--")
            means.append(mean)
            top = max(top, float((mean + sd).max()))
        axis.plot(PERCENT, means[1] - means[0], color=TOTAL, lw=1.2, label="right − left")
        axis.axhline(0.0, color=TOTAL, lw=0.8)
        axis.set_xlim(0, 100)
        axis.set_ylim(-1.08 * top, 1.08 * top)
        axis.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
        axis.set_xlabel("stride (%), each from its own heel strike; dashed: toe off")
        axis.set_ylabel(_unit(found))
        axis.legend(loc="upper right", ncols=3, fontsize=8)
        return figure


def regions(found: GaitResult) -> Figure | None:
    """Mean load of each unit over the stride, with a band of one sd; None without strides."""
    feet = [foot for foot in found.feet.values() if main_strides(found, foot.name)]
    if not feet:
        return None
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 3.0, len(feet))
        top = 0.0
        for axis, foot in zip(axes, feet, strict=True):
            each = overlaid(main_strides(found, foot.name), foot.time_s, foot.load)
            mean, sd = each.mean(axis=0), each.std(axis=0)
            for column, region in enumerate(foot.regions):
                colour = REGION_COLOURS[region]
                low, high = mean[:, column] - sd[:, column], mean[:, column] + sd[:, column]
                axis.fill_between(PERCENT, low, high, color=colour, alpha=0.2, lw=0)
                axis.plot(PERCENT, mean[:, column], color=colour, lw=1.6, label=region)
            axis.set_title(foot.name)
            axis.set_xlabel("stride (%)")
            axis.set_xlim(0, 100)
            top = max(top, float((mean + sd).max()))
        for axis in axes:
            axis.set_ylim(-0.05 * top, 1.06 * top)
        axes[0].set_ylabel("load (N)" if feet[0].is_force else f"reading ({feet[0].symbol})")
        axes[-1].legend(loc="upper right", fontsize=8)
        return figure


def phases(found: GaitResult) -> Figure | None:
    """A few strides of both feet with their distinct phases as bands; None without strides."""
    own = of_main_activity(found.strides)
    if not own:
        return None
    middle = own[len(own) // 2]
    begin = middle.start_s - 0.1 * middle.time_s
    end = begin + WINDOW_STRIDES * middle.time_s
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 1.75 * len(found.feet) + 0.4, 1, len(found.feet))
        for axis, foot in zip(axes, found.feet.values(), strict=True):
            first, last = np.searchsorted(foot.time_s, [begin, end])
            time_s, state, whole = foot.time_s[first:last], foot.state[first:last], whole_of(foot)[first:last]
            cuts = np.flatnonzero(np.diff(state)) + 1
            for a, b in zip(np.concatenate([[0], cuts]), np.concatenate([cuts, [state.size]]), strict=True):
                if b > a:
                    stop = time_s[b] if b < time_s.size else time_s[-1]
                    axis.axvspan(time_s[a], stop, color=PHASE_COLOURS[state[a]], lw=0)
            axis.plot(time_s, whole, color=FOOT_COLOURS[foot.name], lw=1.4)
            axis.set_xlim(begin, end)
            axis.set_ylim(bottom=min(0.0, float(whole.min()) * 1.05))
            axis.set_ylabel(f"{foot.name} ({'N' if foot.force_n is not None else foot.symbol})")
            axis.grid(visible=False)
        axes[-1].set_xlabel("time (s)")
        handles = [Patch(color=colour, label=name) for colour, name in zip(PHASE_COLOURS, PHASES, strict=True)]
        axes[0].legend(handles=handles, **ABOVE)
        return figure


def memberships(found: GaitResult) -> Figure | None:
    """Mean membership in the six phases over the stride, stacked, for each foot; None without strides."""
    feet = [foot for foot in found.feet.values() if main_strides(found, foot.name)]
    if not feet:
        return None
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 2.8, len(feet))
        for axis, foot in zip(axes, feet, strict=True):
            own = main_strides(found, foot.name)
            mean = overlaid(own, foot.time_s, foot.membership).mean(axis=0)
            odd = overlaid(own, foot.time_s, foot.abnormality).mean(axis=0)
            labels = [name.replace("_", " ") for name in MEMBERS]
            axis.stackplot(PERCENT, mean.T, colors=MEMBER_COLOURS, labels=labels, lw=0)
            axis.plot(PERCENT, odd, color="#b91c1c", lw=1.2, label="abnormality")
            axis.axvline(_toe_off(own), color=TOTAL, lw=0.8, ls="--")
            axis.set_xlim(0, 100)
            axis.set_ylim(0, 1)
            axis.set_title(foot.name)
            axis.set_xlabel("stride (%)")
            axis.grid(visible=False)
        axes[0].set_ylabel("membership")
        axes[-1].legend(loc="lower right", fontsize=7, frameon=True, framealpha=0.85)
        return figure


def course(found: GaitResult) -> Figure:
    """The whole trial over time: each foot's force, the total, and body weight."""
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 4.6, 1, 2)
        figure.subplots_adjust(hspace=0.45)
        for foot in found.feet.values():
            axes[0].plot(
                *thin(foot.time_s, whole_of(foot)), color=FOOT_COLOURS[foot.name], lw=0.6, alpha=0.8, label=foot.name
            )
        axes[0].set_ylabel(_unit(found))
        axes[0].legend(**ABOVE)
        if found.total_n is not None:
            axes[1].plot(*thin(found.total_time_s, found.total_n), color=TOTAL, lw=0.6, label="both feet")
            weight = found.forces.body_weight
            if weight is not None:
                axes[1].axhline(weight.value, color="#059669", lw=1.4, label=f"body weight {weight.value:.0f} N")
            for number, (start, end) in enumerate(found.standing_s):
                axes[1].axvspan(start, end, color="#dcfce7", lw=0, zorder=0, label=None if number else "standing")
            axes[1].set_ylabel("total force (N)")
            axes[1].legend(**ABOVE)
        else:
            for foot in found.feet.values():
                own = main_strides(found, foot.name)
                began_s = [stride.start_s for stride in own]
                lasts = [stride.time_s for stride in own]
                axes[1].plot(began_s, lasts, ".-", color=FOOT_COLOURS[foot.name], ms=3, lw=0.6)
            axes[1].set_ylabel("stride time (s)")
        first = next(iter(found.feet.values()))
        for axis in axes:
            axis.set_xlim(float(first.time_s[0]), float(first.time_s[-1]))
        axes[1].set_xlabel("time (s)")
        return figure


def variability(found: GaitResult) -> Figure | None:
    """Stride time and peak force, stride by stride; None if no foot has three strides."""
    feet = [foot for foot in found.feet.values() if len(main_strides(found, foot.name)) > 2]
    if not feet:
        return None
    with mpl.rc_context(STYLE):
        forces = all(foot.force_n is not None for foot in feet)
        figure, axes = figure_of(9.6, 2.8, 2 if forces else 1)
        for foot in feet:
            own = main_strides(found, foot.name)
            at = [stride.start_s for stride in own]
            series = [[stride.time_s for stride in own]]
            if forces:
                series.append([stride.peak_n or 0.0 for stride in own])
            for axis, values in zip(axes, series, strict=True):
                axis.plot(at, values, ".", color=FOOT_COLOURS[foot.name], ms=4, label=foot.name)
        for axis, label in zip(axes, ("stride time (s)", "peak force (N)"), strict=False):
            axis.set_ylabel(label)
            axis.set_xlabel("time (s)")
        axes[0].legend(**ABOVE)
        return figure


def write_figures(folder: Path, found: GaitResult, endings: Sequence[str]) -> list[Path]:
    """Write the trial's figures with each of ``endings`` below ``folder``; returns their paths."""
    drawn = {
        "trial": course(found), "strides": strides(found), "butterfly": butterfly(found), "units": regions(found),
        "phases": phases(found), "memberships": memberships(found), "centre": centre(found),
        "variability": variability(found),
    }  # fmt: skip
    return [
        path for what, figure in drawn.items() if figure is not None for path in save(figure, folder, what, endings)
    ]
