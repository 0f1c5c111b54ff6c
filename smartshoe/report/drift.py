"""A unit's life as a figure and a page: its parameters at each calibration, the trend, repairs and jumps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from smartshoe.atomic import json_text, make_folder, write_text
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.paper.drawing import STYLE, figure_of, svg
from smartshoe.report.tables import new_console, table_of
from smartshoe.store.dates import iso
from smartshoe.store.drift import Drift, Trend
from smartshoe.store.quantities import ZERO

POINT, LINE, REPAIR, JUMP = "#2563eb", "#1f2937", "#d97706", "#dc2626"
COLUMNS = 2
SHOWN = ("static_gain", "a1", "b0", "b1", "k1", "k2", "zero")
ROW_INCHES = 2.15
TITLES = {
    "static_gain": "static gain",
    "a1": "relaxation rate a1",
    "b0": "fast gain b0",
    "zero": "zero (reading at no load)",
}


def draw_drift(drift: Drift) -> Figure:
    """The figure: one panel a quantity; bars are 95 % of each calibration, the line is the trend of all.

    Dashed: a repair. Red: a jump that no repair explains.
    """
    names = [name for name in SHOWN if name in drift.trends] + [n for n in drift.trends if n not in SHOWN and n != "c"]
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
    bars = np.where(np.isfinite(trend.sds), 1.96 * trend.sds, 0.0)
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
    least = 0.004 * float(np.abs(trend.values).mean())  # so that a still parameter looks still
    if high - low < least:
        axis.set_ylim((low + high - least) / 2, (low + high + least) / 2)


def write_drift(folder: Path | str, drift: Drift) -> dict[str, Path]:
    """Write drift.html (with the figure in it), drift.svg and drift.json; returns their paths by what they are."""
    target = make_folder(folder)
    with mpl.rc_context(STYLE):
        figure = svg(draw_drift(drift))
    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters.update(plain=plain, with_sd=with_sd)
    # The SVG comes from matplotlib, which escapes the texts it draws.
    page = environment.get_template("drift.html").render(drift=drift, happened=_happened(drift), figure=Markup(figure))
    written = {"report": target / "drift.html", "figure": target / "drift.svg", "result": target / "drift.json"}
    write_text(written["report"], page)
    write_text(written["figure"], figure)
    write_text(written["result"], json_text(drift.to_dict()))
    return written


def _happened(drift: Drift) -> list[tuple[str, str, str]]:
    """Calibrations and events by date: (date, what, note)."""
    rows = [
        (entry.date, f"calibrated{f' at {entry.position}' if entry.position else ''}: {entry.name}", entry.note)
        for entry in drift.entries
    ]
    rows += [(event.date, event.happened, event.note) for event in drift.events]
    return [(iso(when), what, note) for when, what, note in sorted(rows, key=lambda row: row[0])]


def print_drift(drift: Drift) -> None:
    """One row a quantity: where it stands, its slope a year, what repairs changed."""
    table = table_of(
        f"unit {drift.serial_number}: {len(drift.entries)} calibrations, {iso(drift.entries[0].date)} to"
        f" {iso(drift.entries[-1].date)}",
        ["quantity", "first", "last", "change a year (95 %)", "% a year", "repairs", "scatter"],
    )
    for name, trend in drift.trends.items():
        slope = trend.per_year
        low, high = slope.ci95 if slope is not None else (float("nan"),) * 2
        size = float(np.abs(trend.values).mean())
        repairs = ", ".join(
            f"{step.change.value:+.3g}{'' if step.is_significant else ' (n.s.)'}" for step in trend.repairs
        )
        table.add_row(
            name.replace("_", " "),
            plain(float(trend.values[0]), 5),
            plain(float(trend.values[-1]), 5),
            "–"
            if slope is None
            else f"{plain(slope.value)} ({plain(low)} … {plain(high)}){' *' if trend.moves else ''}",
            "–" if slope is None or name == ZERO else plain(100 * slope.value / size, 2),
            repairs or "–",
            plain(trend.scatter, 2),
        )
    console = new_console()
    console.print(table)
    console.print(
        "*: the interval leaves out no change; n.s.: within the errors; scatter: spread about the trend over what the"
        " calibrations' own sd explain",
        soft_wrap=True,
    )
    for trend in drift.trends.values():
        for jump in trend.jumps:
            console.print(f"jump: {jump.says}", soft_wrap=True)
    console.print(drift.says, soft_wrap=True)


def print_comparison(result: Mapping[str, Any], names: Sequence[str]) -> None:
    """Parameters of two calibrations side by side, and the force difference per loading rate."""
    table = table_of(f"{names[0]} against {names[1]}", ["parameter", "first", "second", "difference", "%", "in sd"])
    for name, item in result["parameters"].items():
        table.add_row(
            name.replace("_", " "),
            with_sd(item["first"]),
            with_sd(item["second"]),
            with_sd({"value": item["difference"], "sd": item["sd"]}),
            plain(item["percent"], 2),
            plain(item["in_sd"], 2),
        )
    console = new_console()
    console.print(table)
    forces = table_of(
        f"force by the second less force by the first, N, triangles to {plain(result['top_load_n'])} N",
        ["rate (N/s)", "rms", "largest ± sd", "at load (N)"],
    )
    for item in result["forces"]:
        forces.add_row(
            f"{item['rate_n_per_s']:g}",
            plain(item["rms_n"]),
            with_sd({"value": item["largest_n"], "sd": item["sd_n"]}),
            plain(item["at_load_n"]),
        )
    console.print(forces)
    console.print(f"zero moved by {result['zero_difference_n']:.3g} N (stands apart: each is used with its own)")
    console.print(result["says"], soft_wrap=True)
