"""The HTML page: one file that needs nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from smartshoe.atomic import make_folder, write_text
from smartshoe.report.model import Report, UnitReport
from smartshoe.report.numbers import number, verdict, with_sd
from smartshoe.report.tables import SUMMARY_HEADER, rate_rows, summary_row


def _unit(unit: UnitReport, index: int) -> dict[str, Any]:
    from markupsafe import Markup

    from smartshoe.report.figures import unit_figures

    found = unit.validation.to_dict()
    header, rows = rate_rows(found)
    parameters = [
        (name, with_sd(item), str(item.get("unit", "")))
        for name, item in unit.identification_dict["parameters"].items()
    ]
    return {
        "name": unit.name,
        "anchor": f"unit-{index}",
        "verdict": verdict(found["overall"]),
        "summary": summary_row(unit.name, unit.identification_dict, found),
        "parameters": parameters,
        "fit": number(unit.identification_dict.get("fit_percent"), 4),
        "rate_header": header,
        "rate_rows": rows,
        "raw_scale": f"{number(found['raw_scale']['value'], 5)} N per reading unit ({found['raw_scale']['source']})",
        "full_scale": number(found["full_scale_n"]),
        "filter": [
            (key, [f"{v:.10g}" for v in unit.compensator_info[key]]) for key in ("numerator", "denominator")
        ],
        "rate_hz": f"{unit.compensator_info['rate']:g}",
        # matplotlib's own output, whose texts are escaped: the only markup that is not escaped again.
        "figures": [(caption, Markup(svg)) for caption, svg in unit_figures(unit, f"u{index}")],
        "notes": [*unit.notes, *(note for recording in unit.recordings for note in recording.notes)],
    }


def render(report: Report) -> str:
    """The page's HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    units = [_unit(unit, index + 1) for index, unit in enumerate(report.units)]
    return environment.get_template("report.html.j2").render(
        report=report, units=units, summary_header=SUMMARY_HEADER
    )


def write_report(folder: Path | str, report: Report, *, result_json: str | None = None) -> Path:
    """Write ``folder``/report.html, and ``result_json`` as result.json where given; returns the page's path.

    Raises `UsageError` where the folder cannot be made or written to.
    """
    target = make_folder(folder)
    page = target / "report.html"
    text = render(report)
    if result_json is not None:
        write_text(target / "result.json", result_json)
    write_text(page, text)
    return page
