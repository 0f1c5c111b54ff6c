"""Writes a self-contained HTML file with its style, script and charts as numbers."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smartshoe.errors import InputError
from smartshoe.files.atomic import write_text
from smartshoe.report.charts import Chart, script_text
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.wording import sentence, words


@functools.cache
def _uplot(name: str) -> Markup:
    """A file of the uplot-python package, read directly, since importing the package would load IPython."""
    spec = importlib.util.find_spec("uplot")
    for place in (spec.submodule_search_locations or ()) if spec is not None else ():
        path = Path(place) / "static" / name
        if path.is_file():
            return Markup(path.read_text(encoding="utf-8").replace("</script", "<\\/script"))
    raise InputError(f"{name} of the package uplot-python is not there: install it with pip install uplot-python")


@functools.cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters.update(plain=plain, with_sd=with_sd, sentence=sentence, words=words)
    return environment


def render(template: str, facts: Mapping[str, Any]) -> str:
    """The text of the page. The template places a chart by ``figure(place, chart)``; the numbers follow at the end."""
    charts: list[Chart] = []

    def place(chart: Chart) -> int:
        charts.append(chart)
        return len(charts) - 1

    def tail() -> Markup:
        if not charts:
            return Markup("")
        script = Path(__file__).parent / "static" / "charts.js"
        return Markup(
            _environment()
            .get_template("charts.html")
            .render(
                charts=Markup(script_text(charts)),
                uplot_script=_uplot("uPlot.iife.js"),
                uplot_style=_uplot("uPlot.min.css"),
                script=Markup(script.read_text(encoding="utf-8")),
            )
        )

    return _environment().get_template(template).render(facts, place=place, charts=tail)


def write_document(path: Path, template: str, facts: Mapping[str, Any]) -> Path:
    """Write the page to ``path``, completely or not at all, and return the path."""
    write_text(path, render(template, facts))
    return path


def polylines(curves: Sequence[tuple[str, Sequence[tuple[float, float]]]], width: float, height: float) -> Markup:
    """An SVG drawing of curves without axes, ``width`` by ``height``: each is (class, points), with y upwards."""
    made = [
        Markup('<polyline class="{}" points="{}"/>').format(
            name, " ".join(f"{x:.1f},{height - y:.1f}" for x, y in points)
        )
        for name, points in curves
    ]
    return Markup('<svg viewBox="0 0 {} {}" aria-hidden="true">{}</svg>').format(
        f"{width:g}", f"{height:g}", Markup("").join(made)
    )
