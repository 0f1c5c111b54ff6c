"""The HTML page of a trial: its activity, figures, charts and flags."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from smartshoe.gait import GaitResult
from smartshoe.report.document import write_document
from smartshoe.report.gait import charts, shapes
from smartshoe.report.gait.terminal import by_foot, coverage_note, depends_on_course, weight_mark
from smartshoe.report.numbers import plain, with_sd

UNUSABLE = frozenset({"implausible_weight", "too_short", "no_stance"})  # flags: all numbers are meaningless


def write_gait_page(path: Path, found: GaitResult, title: str, facts: Mapping[str, str]) -> Path:
    """Write the page to ``path``, completely or not at all, and return the path; ``facts`` is small print by name."""
    grade, headline = verdict(found)
    both, by_stride = charts.left_and_right(found), charts.variability(found)
    return write_document(
        path,
        "gait.html",
        {
            "title": title,
            "facts": facts,
            "found": found,
            "grade": grade,
            "headline": headline,
            "feet": list(found.feet),
            "numbers": _numbers(found),
            "rows": by_foot(found),
            "strides": charts.mean_strides(found),
            "insoles": shapes.insoles(found),
            "trial": charts.trial(found),
            "coverage_note": coverage_note(found),
            "more": [chart for chart in (both, *charts.units(found), by_stride) if chart is not None],
            "folded": [*charts.phases(found), *charts.memberships(found)],
        },
    )


def verdict(found: GaitResult) -> tuple[str, str]:
    """The trial's grade (good, look, bad) and one sentence."""
    summary: Mapping[str, Any] = found.summary
    said = [found.activity.capitalize()]
    if summary["cadence_steps_per_min"] is not None:
        said.append(f"{plain(summary['cadence_steps_per_min'])} steps a minute")
    if summary["asymmetry_percent"] is not None:
        said.append(f"asymmetry {plain(summary['asymmetry_percent'], 2)} %")
    counted = sum(summary["strides"].values())
    if counted:
        said.append(f"{counted} strides counted")
    sentence = ", ".join(said)
    kinds = [flag.kind for flag in found.flags]
    if not kinds:
        careful = "only the peaks ask for care, by the note at the table" if depends_on_course(found) else ""
        return "good", f"{sentence}; {careful or 'nothing to be careful with was found'}"
    grade = "bad" if UNUSABLE & set(kinds) else "look"
    words = ", ".join(dict.fromkeys(kind.replace("_", " ") for kind in kinds))
    return grade, f"{sentence}; be careful with: {words}"


def _numbers(found: GaitResult) -> list[tuple[str, str]]:
    """The few figures shown in large letters, as (number, what it is)."""
    summary: Mapping[str, Any] = found.summary
    said: list[tuple[str, str]] = []
    if summary["cadence_steps_per_min"] is not None:
        said.append((plain(summary["cadence_steps_per_min"]), "steps a minute"))
    if found.activity == "running" and summary["flight_percent"] is not None:
        said.append((f"{plain(summary['flight_percent'])} %", "of a stride in flight"))
    elif summary["double_support_percent"] is not None:
        said.append((f"{plain(summary['double_support_percent'])} %", "of a stride on both feet"))
    if summary["asymmetry_percent"] is not None:
        said.append((f"{plain(summary['asymmetry_percent'], 2)} %", "asymmetry, left to right"))
    weight = found.forces.body_weight
    if weight is not None:
        text = f"{with_sd({'value': weight.value, 'sd': weight.sd})} N"
        said.append((text, f"body weight{weight_mark(found)} ({weight.source.replace('_', ' ')})"))
    if found.forces.standing_total_n is not None:
        said.append((f"{found.forces.standing_total_n:.1f} N", "total while standing"))
    return said
