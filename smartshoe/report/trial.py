"""A scenario's trial on the report's page and on a terminal: raw and corrected forces compared with the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from smartshoe.arrays import Array
from smartshoe.gait import GaitResult
from smartshoe.report.charts import Chart, Line, Panel, Style
from smartshoe.report.gait import charts as gait_charts
from smartshoe.report.numbers import plain
from smartshoe.report.tables import new_console, table_of

COLUMNS = ("truth", "raw", "corrected")
WEIGHT = 8.0  # of the trial's chart: it lasts minutes and needs more points than the pressings on the page


@dataclass(frozen=True, eq=False)
class TrialSection:
    """What the page shows of a trial.

    ``rows`` are figures compared with the truth (a label, and a text for each of `COLUMNS`), ``notes`` are sentences,
    and ``page`` is the path of the trial's own page relative to the report.
    """

    name: str
    verdict: str
    rows: list[tuple[str, list[str]]]
    notes: list[str]
    charts: list[Chart]
    page: str
    columns: tuple[str, ...] = COLUMNS


def section(
    result: Mapping[str, Any], found: GaitResult, time_s: Array, totals: Mapping[str, Array], page: str
) -> TrialSection:
    """The section of a trial; ``result`` is `TrialResult.to_dict()`, ``totals`` (n,) in N by `COLUMNS`."""
    charts = [total_chart(found, time_s, totals), *gait_charts.mean_strides(found)]
    return TrialSection(result["name"], verdict(result), rows(result), notes(result), charts, page)


def verdict(result: Mapping[str, Any]) -> str:
    """One sentence: what was done, and how close the corrected total is to the truth."""
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
    """Labels, each with its texts by `COLUMNS`; empty if the truth is unknown."""
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
    """Sentences about order of contact, errors of events, and flags."""
    said: list[str] = []
    against = result["against_truth"]
    errors = {} if against is None else against["rmse_total_n"] or {}
    raw, corrected = errors.get("raw"), errors.get("corrected")
    if raw is not None and corrected is not None and corrected > raw:
        said.append(
            f"The correction makes this trial worse: its total is off by {plain(corrected)} N rms, the raw one by"
            f" {plain(raw)} N."
        )
    if against is not None and against["order"] is not None:
        order = against["order"]
        said.append(
            f"Order of contact: {', '.join(order['order_of_contact'] or ())}. Meta4 comes before meta1 in"
            f" {order['truth']['meta4_before_meta1_percent']:.1f} % of {order['stances']} stances in truth, in"
            f" {order['observed']['meta4_before_meta1_percent']:.1f} % as observed."
        )
    if against is not None:
        by_kind = [
            f"{kind.replace('_', ' ')} {errors['median_ms']:.1f} ms ({errors['p95_ms']:.1f} ms)"
            + (f", {errors['missed']} missed, {errors['false']} false" if errors["missed"] + errors["false"] else "")
            for kind, errors in against["events"].items()
            if errors["median_ms"] is not None and errors["true"] > 9
        ]
        if by_kind:
            said.append(f"Events, median error (95th percentile): {'; '.join(by_kind)}.")
    said += [f"{flag['kind'].replace('_', ' ')}: {flag['says']}." for flag in result["gait"]["flags"]]
    return said


def total_chart(found: GaitResult, time_s: Array, totals: Mapping[str, Array]) -> Chart:
    """The force of both feet over time and, if the truth is known, the errors of the estimates."""
    styles: dict[str, Style] = {"truth": "line", "raw": "dashed", "corrected": "line"}
    lines = [Line(name, totals[name], name, styles[name]) for name in COLUMNS if name in totals]
    panels = [Panel("total force (N)", lines)]
    says = "Total vertical force of both feet."
    weight = found.forces.body_weight
    if weight is not None:
        says = f"Total vertical force of both feet; body weight {plain(weight.value, 4)} N."
    if "truth" in totals:
        apart = [Line(f"{name} − truth", totals[name] - totals["truth"], name, styles[name])
                 for name in COLUMNS[1:] if name in totals]  # fmt: skip
        panels.append(Panel("estimate − truth (N)", apart, height=150))
    return Chart("The trial's total force", says, "time (s)", time_s, panels,
                 window=gait_charts.some_strides(found), weight=WEIGHT)  # fmt: skip


def print_trial(result: Mapping[str, Any]) -> None:
    """Print the trial's figures and sentences on a terminal."""
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
