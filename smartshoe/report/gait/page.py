"""The HTML page of a trial: what was done, how, how regular, how hard, and what to be careful with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smartshoe.atomic import write_text
from smartshoe.gait.result import GaitResult
from smartshoe.report.gait import figures, soles
from smartshoe.report.gait.terminal import by_foot
from smartshoe.report.numbers import plain, with_sd


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure: what it is, how to read it, and its SVG."""

    title: str
    reading: str
    svg: Markup


def write_gait_page(path: Path, found: GaitResult, title: str, facts: Mapping[str, str]) -> Path:
    """Write the page to ``path``, whole or not at all, and return it. ``facts``: small print by name."""
    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters.update(plain=plain)
    page = environment.get_template("gait.html").render(
        title=title,
        facts=facts,
        found=found,
        feet=list(found.feet),
        numbers=_numbers(found),
        rows=by_foot(found),
        pictures=_pictures(found),
    )
    write_text(path, page)
    return path


def _numbers(found: GaitResult) -> list[tuple[str, str]]:
    """The few numbers that stand in large letters."""
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
        said.append((text, f"body weight ({weight.source.replace('_', ' ')})"))
    if found.forces.standing_total_n is not None:
        said.append((f"{found.forces.standing_total_n:.1f} N", "total while standing"))
    return said


def _pictures(found: GaitResult) -> list[Picture]:
    """The figures that have something to show."""
    given: list[tuple[str, str, str | None]] = [
        ("The trial", "Each foot above, both feet below.", figures.course(found)),
        (
            "Strides, one over the other",
            "Each thin line is a stride. A wide band is an irregular gait; two humps are walking, one is running.",
            figures.strides(found),
        ),
        (
            "Left and right as a butterfly",
            "Right is drawn downwards. Wings of one shape are a symmetric gait; the dark line is their difference.",
            figures.butterfly(found),
        ),
        ("Load of each unit", "Mean over strides, band of one standard deviation.", figures.regions(found)),
        (
            "Phases",
            "Bands are cut at heel strike, foot flat, heel off and toe off; the line is the foot's whole force.",
            figures.phases(found),
        ),
        (
            "How much of each phase",
            "Continuous membership from the four loads, mean over strides, after the idea of Kong and Tomizuka 2009."
            " The red line is what fits no phase.",
            figures.memberships(found),
        ),
        (
            "Centre of pressure",
            "An estimate from four points: it cannot leave the quadrangle of the units. Circles are the units, by"
            " their usual peak. Right: where both feet's load would lie if the feet stood side by side.",
            soles.centre(found),
        ),
        ("From stride to stride", "", figures.variability(found)),
    ]
    # The SVG comes from matplotlib, which escapes the texts it draws.
    return [Picture(title, reading, Markup(svg)) for title, reading, svg in given if svg is not None]
