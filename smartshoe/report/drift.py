"""The history of a unit as a page and on a terminal: its parameters at each calibration, trend, repairs and jumps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.calibration.store.dates import iso
from smartshoe.calibration.store.drift import Drift, Trend
from smartshoe.calibration.store.quantities import STATIC_GAIN, ZERO
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.report._drift_quantities import LEAST_SPAN, TITLES, shown_names
from smartshoe.report.charts import Chart, Line, Mark, Panel
from smartshoe.report.document import write_document
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.tables import new_console, table_of
from smartshoe.report.wording import sentence
from smartshoe.signals.noise import NORMAL_95
from smartshoe.units import DAY_S


def _chart(drift: Drift, trend: Trend) -> Chart:
    """A quantity against the date, with a gap between two levels of the trend, so that no line joins them."""
    start_s = drift.entries[0].date.timestamp()
    x: list[float] = []
    values: list[float] = []
    sds: list[float] = []
    fitted: list[float] = []
    for k, day in enumerate(trend.days):
        if k and trend.pieces[k] != trend.pieces[k - 1]:
            x.append(0.5 * (trend.days[k - 1] + day))
            for row in (values, sds, fitted):
                row.append(math.nan)
        x.append(float(day))
        values.append(float(trend.values[k]))
        sds.append(NORMAL_95 * float(trend.sds[k]) if math.isfinite(trend.sds[k]) else 0.0)
        fitted.append(float(trend.fitted(np.array([day]), int(trend.pieces[k]))[0]))
    y, bar, line = np.array(values), np.array(sds), np.array(fitted)
    marks = [Mark(event.date.timestamp(), event.date.timestamp(), "look", "repaired")
             for event in drift.events if event.kind == "repaired"]  # fmt: skip
    dates = [entry.date for entry in drift.entries]
    for jump in trend.jumps:
        at = dates.index(jump.date)
        marks.append(Mark(dates[at - 1].timestamp(), dates[at].timestamp(), "bad", "jump"))
    low, high = float(np.nanmin([y - bar, line])), float(np.nanmax([y + bar, line]))
    least = LEAST_SPAN * float(np.nanmean(np.abs(y)))
    margin = max(0.08 * (high - low), 0.5 * (least - (high - low)), 1e-12)
    lines = [
        Line("calibration", y, "reading", "points", y - bar, y + bar),
        Line("trend", line, "load", "dashed"),
    ]
    panel = Panel(trend.unit or trend.name, lines, (low - margin, high + margin), 170)
    return Chart(TITLES.get(trend.name, trend.name), sentence(trend.says), "date",
                 start_s + DAY_S * np.array(x), [panel], "drift", dates=True, marks=marks)  # fmt: skip


def newtons_a_year(drift: Drift) -> dict[str, tuple[float, float, float]]:
    """Change of gain and zero in newtons a year, with the 95 % interval; only where the slope is known."""
    gain = drift.trends.get(STATIC_GAIN)
    if gain is None:
        return {}
    mean = float(np.abs(gain.values).mean())
    scales = {STATIC_GAIN: drift.top_load_n / mean, ZERO: mean}
    found = {}
    for name, scale in scales.items():
        slope = drift.trends[name].per_year if name in drift.trends else None
        if slope is not None:
            low, high = (scale * bound for bound in slope.ci95)
            found[name] = (scale * slope.value, low, high)
    return found


def headline(drift: Drift) -> tuple[str, str]:
    """The unit's grade (good, look) and one sentence about what changed most, in newtons."""
    moved = newtons_a_year(drift)
    jumps = any(trend.jumps for trend in drift.trends.values())
    if not moved:
        return "look", drift.says
    name, (value, low, high) = max(moved.items(), key=lambda item: abs(item[1][0]))
    at = f" at {plain(drift.top_load_n)} N" if name == STATIC_GAIN else ""
    what = TITLES[name].split(" (")[0]
    interval = f" ({plain(low, 2)} to {plain(high, 2)})" if math.isfinite(low) else ""
    said = f"the {what} moves most: {plain(value, 2)} N a year{at}{interval}"
    if jumps:
        return "look", f"{_jumps(drift)}; apart from that {said}"
    if drift.trends[name].moves:
        return "look", said
    return "good", f"nothing moves beyond its errors; {said}"


def _jumps(drift: Drift) -> str:
    """A sentence on the jump that is largest relative to its quantity, in newtons if it is one of the gain."""
    found = [(abs(jump.change.value) / max(float(np.abs(trend.values).mean()), 1e-12), trend, jump)
             for trend in drift.trends.values() for jump in trend.jumps]  # fmt: skip
    gains = [(share, trend, jump) for share, trend, jump in found if trend.name == STATIC_GAIN]
    share, trend, jump = max(gains or found, key=lambda item: item[0])
    if trend.name == STATIC_GAIN:
        moved = drift.top_load_n * math.copysign(share, jump.change.value)
        return f"the static gain jumped by {plain(moved, 2)} N at {plain(drift.top_load_n)} N, which no repair explains"
    return jump.says


def write_drift(folder: Path | str, drift: Drift, figures: Sequence[str] = ()) -> dict[str, Path]:
    """Write drift.html and drift.json, and with ``figures`` (endings) drift.svg, pdf, png; returns the paths."""
    target = make_folder(folder)
    grade, says = headline(drift)
    written = {"report": target / "drift.html", "result": target / "drift.json"}
    facts = {
        "drift": drift,
        "grade": grade,
        "headline": says,
        "charts_of": [_chart(drift, drift.trends[name]) for name in shown_names(drift)],
        "happened": _happened(drift),
    }
    write_document(written["report"], "drift.html", facts)
    write_text(written["result"], json_text(drift.to_dict()))
    if figures:
        from smartshoe.report.paper.drawing import save
        from smartshoe.report.paper.drift import draw_drift

        for path in save(draw_drift(drift), target, "drift", figures):
            written["figure" if len(figures) == 1 else f"figure as {path.suffix[1:]}"] = path
    return written


def _happened(drift: Drift) -> list[tuple[str, str, str]]:
    """Calibrations and events in order of date, as (date, what, note)."""
    rows = [
        (entry.date, f"calibrated{f' at {entry.position}' if entry.position else ''}: {entry.name}", entry.note)
        for entry in drift.entries
    ]
    rows += [(event.date, event.happened, event.note) for event in drift.events]
    return [(iso(when), what, note) for when, what, note in sorted(rows, key=lambda row: row[0])]


def print_drift(drift: Drift) -> None:
    """Print one row for each quantity: first and last value, slope a year, and changes by repairs."""
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
    """Print the parameters of two calibrations side by side, and the force difference at each loading rate."""
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
