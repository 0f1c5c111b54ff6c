"""A scenario's trial on the report's page and on a terminal: raw and corrected forces beside the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from smartshoe.gait.result import GaitResult
from smartshoe.report.gait import figures
from smartshoe.report.numbers import plain
from smartshoe.report.paper.drawing import STYLE, figure_of, svg, thin
from smartshoe.report.tables import new_console, table_of

Array = NDArray[np.float64]

TRUTH, RAW, CORRECTED = "#1f2937", "#d97706", "#059669"
WINDOW_STRIDES = 3
COLUMNS = ("truth", "raw", "corrected")


@dataclass(frozen=True, eq=False)
class TrialSection:
    """What the page says of a trial: numbers against the truth (label and one text each of `COLUMNS`), sentences,
    figures with captions, and where the trial's own page lies (relative to the report)."""

    name: str
    verdict: str
    rows: list[tuple[str, list[str]]]
    notes: list[str]
    pictures: list[tuple[str, Markup]]
    page: str


def section(
    result: Mapping[str, Any], found: GaitResult, time_s: Array, totals: Mapping[str, Array], page: str
) -> TrialSection:
    """The section of a trial; ``result`` is `TrialResult.to_dict()`, ``totals`` (n,) in N by `COLUMNS`."""
    pictures = [
        ("Total vertical force of both feet, and what each estimate misses", total_course(found, time_s, totals))
    ]
    if found.strides:
        pictures += [
            ("Left and right as a butterfly: right is drawn downwards", figures.butterfly(found) or ""),
            ("Load of each unit over a stride, mean and one standard deviation", figures.regions(found) or ""),
        ]
    # The SVG comes from matplotlib, which escapes the texts it draws.
    drawn = [(caption, Markup(text)) for caption, text in pictures if text]
    return TrialSection(result["name"], verdict(result), rows(result), notes(result), drawn, page)


def verdict(result: Mapping[str, Any]) -> str:
    """One sentence: what was done, and how near the corrected total comes."""
    gait, against = result["gait"], result["against_truth"]
    said = f"{gait['activity'].capitalize()}, {result['duration_s']:.0f} s"
    if against is None:
        weight = gait["forces"]["body_weight_n"]
        return said if weight is None else f"{said}; body weight by the forces {plain(weight['value'], 4)} N"
    weight_n = against["body_weight_n"]
    means = against["standing_total_n"] or against["strides_total_n"]
    if means is None:
        return said
    where = "while standing" if against["standing_total_n"] else "over whole strides"
    return (
        f"{said}; mean total {where}: {plain(means['corrected'], 4)} N corrected, {plain(means['raw'], 4)} N raw,"
        f" {plain(means['truth'], 4)} N in truth (body weight {plain(weight_n, 4)} N)"
    )


def rows(result: Mapping[str, Any]) -> list[tuple[str, list[str]]]:
    """Label and texts by `COLUMNS`; empty where the truth is not known."""
    against = result["against_truth"]
    if against is None:
        return []
    found: list[tuple[str, list[str]]] = []

    def add(label: str, values: Mapping[str, float | None] | None, digits: int = 4) -> None:
        if values is not None and any(value is not None for value in values.values()):
            texts = [values.get(column) for column in COLUMNS]
            found.append((label, ["–" if value is None else plain(value, digits) for value in texts]))

    add("mean total while standing (N)", against["standing_total_n"])
    for foot, means in (against["standing_feet_n"] or {}).items():
        add(f"of it on the {foot} foot (N)", means)
    add("mean total over whole strides (N)", against["strides_total_n"])
    for foot, peaks in against["peaks_n"].items():
        add(f"mean peak, {foot} (N)", peaks)
    add("error of the total (N rms)", against["rmse_total_n"], 3)
    add("error of the total (% of body weight)", against["rmse_total_percent_of_body_weight"], 3)
    add("error of the load on the coils alone (N rms)", against["rmse_coils_n"], 3)
    return found


def notes(result: Mapping[str, Any]) -> list[str]:
    """Sentences about order of contact, events and what to be careful with."""
    said: list[str] = []
    against = result["against_truth"]
    if against is not None and against["order"] is not None:
        order = against["order"]
        said.append(
            f"Order of contact: {', '.join(order['order_of_contact'] or ())}. Meta4 comes before meta1 in"
            f" {order['truth']['meta4_before_meta1_percent']:.1f} % of {order['stances']} stances in truth, in"
            f" {order['observed']['meta4_before_meta1_percent']:.1f} % as observed."
        )
    if against is not None:
        told = [
            f"{kind.replace('_', ' ')} {errors['median_ms']:.1f} ms ({errors['p95_ms']:.1f} ms)"
            + (f", {errors['missed']} missed, {errors['false']} false" if errors["missed"] + errors["false"] else "")
            for kind, errors in against["events"].items()
            if errors["median_ms"] is not None and errors["true"] > 9
        ]
        if told:
            said.append(f"Events, median error (95th percentile): {'; '.join(told)}.")
    said += [f"{flag['kind'].replace('_', ' ')}: {flag['says']}." for flag in result["gait"]["flags"]]
    return said


def total_course(found: GaitResult, time_s: Array, totals: Mapping[str, Array]) -> str:
    """Both feet's force against time, and the estimates less the truth: the whole trial, or a few strides of it."""
    start, end = float(time_s[0]), float(time_s[-1])
    own = [s for s in found.strides if s.foot == found.strides[0].foot]
    if own:
        middle = len(own) // 2
        start, end = own[middle].start_s, own[min(middle + WINDOW_STRIDES, len(own)) - 1].end_s
    kept = (time_s >= start) & (time_s <= end)
    colours = dict(zip(COLUMNS, (TRUTH, RAW, CORRECTED), strict=True))
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 5.0, 1, 2)
        for name in ("raw", "corrected", "truth"):
            if name in totals:
                axes[0].plot(*thin(time_s[kept], totals[name][kept]), color=colours[name], label=name)
                if name != "truth" and "truth" in totals:
                    left = (totals[name] - totals["truth"])[kept]
                    axes[1].plot(*thin(time_s[kept], left), color=colours[name], lw=0.8)
        weight = found.forces.body_weight
        if weight is not None:
            axes[0].axhline(weight.value, color="#6b7280", lw=0.8, ls="--", label=f"body weight {weight.value:.0f} N")
        axes[0].set_ylabel("total (N)")
        # Above the axes: a course may fill all of them.
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8, borderpad=0.1)
        axes[1].set_ylabel("estimate − truth (N)")
        axes[1].set_xlabel("time (s)")
        for axis in axes:
            axis.set_xlim(start, end)
        return svg(figure)


def print_trial(result: Mapping[str, Any]) -> None:
    """The trial's numbers and sentences on a terminal."""
    console = new_console()
    made = rows(result)
    if made:
        table = table_of(f"trial {result['name']}: forces against the truth", ["", *COLUMNS])
        for label, texts in made:
            table.add_row(label, *texts)
        console.print(table)
    console.print(f"trial {result['name']}: {verdict(result)}", soft_wrap=True)
    for note in notes(result):
        console.print(note, soft_wrap=True)
