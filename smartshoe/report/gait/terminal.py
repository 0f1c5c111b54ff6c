"""Prints a trial's result on a terminal, as a short table."""

from __future__ import annotations

import math
from typing import Any

from smartshoe.gait import GaitFindings
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.tables import new_console, table_of
from smartshoe.signals.noise import NORMAL_95

COVERAGE_NOTE = (
    "* no --coverage was given: peaks, impulses, loading rates and an estimated body weight are those of the load on"
    " the units alone, lower than the foot's where part of it passes beside them"
)


def _has_peaks(found: GaitFindings) -> bool:
    """Whether peaks of forces are told of any foot."""
    return any(own["mean"] is not None for own in found.figures["peak_n"].values())


def depends_on_coverage(found: GaitFindings) -> bool:
    """Whether forces on the feet assume a coverage of 1 because none was given."""
    return found.coverage == 1.0 and _has_peaks(found)


def depends_on_course(found: GaitFindings) -> bool:
    """Whether forces on the feet assume one coverage at each moment of a stance, so that peaks are none of the foot's.

    What they are off by is neither the spread of strides nor the estimate's error.
    """
    return _has_peaks(found) and not found.covering.knows_when(running=found.activity == "running")


def coverage_note(found: GaitFindings) -> str:
    """What forces on the feet assume of the load beside the units, '' if nothing that moves them much.

    Divided by a share c, a force that is on the units alone, as nearly all is in push-off, comes out 1/c times as
    large; no more can be too much, for the units bear no more than the foot does.
    """
    if depends_on_coverage(found):
        return COVERAGE_NOTE
    if not depends_on_course(found):
        return ""
    how = "give --coverage-course midfoot, or one learned from plates"
    if found.activity == "running":
        how = "give --coverage-course with one learned from plates; the midfoot's is of walking"
    return (
        f"* a coverage of {found.coverage:.3g} alone says how much of a stance's load is on the units, not when: peaks"
        f" may be up to {100.0 * (1.0 / found.coverage - 1.0):.2g} % too high, since in push-off the units bear nearly"
        f" all of it, and loading rates are off too: {how}"
    )


def weight_mark(found: GaitFindings) -> str:
    """A star for a body weight that was estimated from loads without a coverage, otherwise ''."""
    weight = found.forces.body_weight
    return "*" if weight is not None and weight.source != "given" and depends_on_coverage(found) else ""


def _peaks(found: GaitFindings, foot: str) -> str:
    """The mean peak with its 95 % interval, from the spread over strides and the estimate's own error.

    Like the peak force, it is of all strides that the summary counts: a stream lists only the first of them. The dash
    where peaks are none of the foot's.
    """
    if depends_on_course(found):
        return "–"
    peak, count = found.figures["peak_n"].get(foot), found.figures["strides"].get(foot, 0)
    if not peak or peak["mean"] is None or peak["cv_percent"] is None:
        return "–"
    own_sd = 0.01 * peak["cv_percent"] * peak["mean"] / math.sqrt(count)
    sd = math.hypot(own_sd, found.forces.rmse_estimate_n or 0.0)
    return f"{plain(peak['mean'])} ± {plain(NORMAL_95 * sd, 2)}"


def _cv(spread: dict[str, Any] | None) -> str:
    if not spread or spread["mean"] is None:
        return "–"
    cv = spread["cv_percent"]
    return plain(spread["mean"], 3) + ("" if cv is None else f" ({cv:.1f} %)")


def by_foot(found: GaitFindings) -> list[tuple[str, list[str]]]:
    """Rows of the table, each a name and a cell for each foot; rows without content are left out."""
    summary = found.figures
    feet = list(found.indices)
    mark = "*" if depends_on_coverage(found) else ""
    of_moment = "*" if coverage_note(found) else ""
    rows: list[tuple[str, list[str]]] = [
        ("strides", [str(summary["strides"].get(foot, 0)) for foot in feet]),
        ("stride time (s)", [_cv(summary["stride_time_s"].get(foot)) for foot in feet]),
        ("step time to this foot (s)", [_cv(summary["step_time_s"].get(foot)) for foot in feet]),
        ("stance (% of stride)", [plain(summary["stance_percent"].get(foot)) for foot in feet]),
        (f"peak force{of_moment} (N)", [_cv(summary["peak_n"].get(foot)) for foot in feet]),
        (f"mean peak{of_moment} ± 95 % (N)", [_peaks(found, foot) for foot in feet]),
        (f"impulse{mark} (N s)", [_cv(summary["impulse_n_s"].get(foot)) for foot in feet]),
        (f"loading rate{of_moment} (N/s)", [_cv(summary["loading_rate_n_per_s"].get(foot)) for foot in feet]),
        ("sequence errors (%)", [plain(found.indices[foot]["sequence_error_percent"], 2) for foot in feet]),
        ("deviation from pattern (%)", [plain(found.indices[foot]["deviation_percent"], 2) for foot in feet]),
        ("abnormality (%)", [plain(found.indices[foot]["abnormality_percent"], 2) for foot in feet]),
    ]
    return [(name, cells) for name, cells in rows if any(cell not in ("–", "0") for cell in cells)]


def print_gait(found: GaitFindings, title: str) -> None:
    """Print times and forces by foot, then what concerns both feet, then the flags."""
    summary = found.figures
    table = table_of(f"{title}: {found.activity}; mean (variation)", ["", *found.indices])
    for name, cells in by_foot(found):
        table.add_row(name, *cells)
    console = new_console()
    if table.row_count:
        console.print(table)
        if note := coverage_note(found):
            console.print(note, soft_wrap=True)
    else:
        none = ", but no stride is whole enough to count: see below" if found.activity in ("walking", "running") else ""
        console.print(f"{title}: {found.activity}{none}", soft_wrap=True)
    said = [
        ("cadence", summary["cadence_steps_per_min"], " steps/min"),
        ("double support", summary["double_support_percent"], " %"),
        ("flight", summary["flight_percent"] or None, " %"),
        ("asymmetry", summary["asymmetry_percent"], " %"),
    ]
    line = ", ".join(f"{name} {plain(value)}{unit}" for name, value, unit in said if value is not None)
    if line:
        console.print(line, soft_wrap=True)
    if summary["order_of_contact"]:
        console.print(
            f"order of contact: {', '.join(summary['order_of_contact'])}"
            f" ({plain(summary['order_of_contact_percent'])} % of stances)",
            soft_wrap=True,
        )
    forces = found.forces
    if forces.body_weight is not None:
        weight = forces.body_weight
        weighed = with_sd({"value": weight.value, "sd": weight.sd})
        line = f"body weight{weight_mark(found)} {weighed} N ({weight.source.replace('_', ' ')})"
        for name, value in (("mean total", forces.mean_total_n), ("standing total", forces.standing_total_n)):
            if value is not None:
                line += f", {name} {value:.1f} N"
        if found.coverage != 1.0:
            line += f", coverage {found.coverage:.3g}, {found.covering.says}"
        console.print(line, soft_wrap=True)
    for flag in found.flags:
        where = "" if flag.where == "all" else f" ({flag.where})"
        console.print(f"{flag.kind}: {flag.says}{where}", soft_wrap=True)
