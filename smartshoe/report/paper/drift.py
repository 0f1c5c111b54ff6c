"""The history of a unit as a figure: its parameters at each calibration, the trend, repairs and jumps."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from smartshoe.calibration.store.drift import Drift, Trend
from smartshoe.report._drift_quantities import LEAST_SPAN, TITLES, shown_names
from smartshoe.report.paper.drawing import STYLE, figure_of
from smartshoe.signals.noise import NORMAL_95

POINT, LINE, REPAIR, JUMP = "#2563eb", "#1f2937", "#d97706", "#dc2626"
COLUMNS = 2
ROW_INCHES = 2.15


def draw_drift(drift: Drift) -> Figure:
    """The figure, with a panel for each quantity: calibrations with 95 % error bars, and their trend as a line.

    A dashed line is a repair, a red band a jump that no repair explains.
    """
    names = shown_names(drift)
    rows = -(-len(names) // COLUMNS)
    with mpl.rc_context({**STYLE, "axes.formatter.useoffset": False}):
        figure, axes = figure_of(9.6, 0.75 + ROW_INCHES * rows, COLUMNS, rows)
        height = 0.75 + ROW_INCHES * rows
        figure.subplots_adjust(top=1 - 0.3 / height, bottom=0.4 / height, hspace=0.55, wspace=0.3, left=0.09)
        for axis, name in zip(axes, names, strict=False):
            _panel(axis, drift, drift.trends[name])
        for axis in axes[len(names) :]:
            axis.set_visible(False)
    return figure


def _panel(axis: Any, drift: Drift, trend: Trend) -> None:
    start = drift.entries[0].date
    dates = [entry.date for entry in drift.entries]
    repairs = [event.date for event in drift.events if event.kind == "repaired"]
    for piece in np.unique(trend.pieces):
        own = trend.days[trend.pieces == piece]
        span = np.array([own.min(), own.max()])
        axis.plot(
            [start + timedelta(days=float(day)) for day in span], trend.fitted(span, int(piece)), color=LINE, lw=1
        )
    bars = np.where(np.isfinite(trend.sds), NORMAL_95 * trend.sds, 0.0)
    axis.errorbar(dates, trend.values, yerr=bars, fmt="o", ms=3.5, color=POINT, elinewidth=1, capsize=2)
    for repair in repairs:
        axis.axvline(repair, color=REPAIR, ls="--", lw=1)
    for jump in trend.jumps:
        at = dates.index(jump.date)
        axis.axvspan(dates[at - 1], dates[at], color=JUMP, alpha=0.12, lw=0)
    axis.set_title(TITLES.get(trend.name, trend.name), loc="left")
    axis.set_ylabel(trend.unit)
    locator = AutoDateLocator(minticks=3, maxticks=7)  # type: ignore[no-untyped-call]
    axis.xaxis.set_major_locator(locator)
    axis.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    low, high = axis.get_ylim()
    least = LEAST_SPAN * float(np.abs(trend.values).mean())
    if high - low < least:
        axis.set_ylim((low + high - least) / 2, (low + high + least) / 2)
