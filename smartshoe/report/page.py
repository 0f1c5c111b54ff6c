"""The HTML report: one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smartshoe.atomic import write_text
from smartshoe.recording import Recording
from smartshoe.report import figures
from smartshoe.report.numbers import plain, with_sd
from smartshoe.report.trial import COLUMNS, TrialSection
from smartshoe.validation import Validation


@dataclass(frozen=True, slots=True)
class DiagnosisLink:
    """A diagnosis in a sentence, and where its own page lies (relative to this one)."""

    says: str
    page: str


@dataclass(frozen=True, eq=False)
class UnitReport:
    """What the page says of one unit; ``identification`` is `Identification.to_dict()`."""

    name: str
    identification: Mapping[str, Any]
    validation: Validation
    recordings: Sequence[Recording]
    fitted: Sequence[str]
    judged: Sequence[str]
    diagnosis: DiagnosisLink | None = None


def verdict(unit: UnitReport) -> str:
    """One sentence: what compensation gains over a static line, and what is left."""
    overall = unit.validation.overall
    gain = overall.improvement_over_static_percent
    left = 100.0 * overall.rmse_compensated_n / unit.validation.full_scale_n
    if gain is None:
        return "a static line leaves no error here"
    said = f"compensation leaves {plain(overall.rmse_compensated_n)} N ({plain(left, 2)} % of full scale)"
    if gain < 5.0:
        return f"{said}, hardly less than the best static line ({plain(overall.rmse_static_n)} N)"
    return f"{said} where the best static line leaves {plain(overall.rmse_static_n)} N: {plain(gain, 2)} % less"


def _drawn(unit: UnitReport) -> list[tuple[str, Markup]]:
    discrete, parameters = unit.identification["discrete"], unit.identification["parameters"]
    a1, b0, b1 = (parameters[name]["value"] for name in ("a1", "b0", "b1"))
    pictures = [
        ("Load and reading against time", figures.signals(unit.recordings)),
        ("Estimate against load, raw and compensated", figures.loops(unit.validation.traces)),
        (
            "The compensating filter",
            figures.bode(a1, b0, b1, discrete["sample_rate_hz"], discrete["numerator"], discrete["denominator"]),
        ),
        ("What compensation leaves", figures.residuals(unit.validation.traces)),
    ]
    # The SVG comes from matplotlib, which escapes the texts it draws.
    return [(title, Markup(svg)) for title, svg in pictures if svg is not None]


def write_page(
    path: Path,
    title: str,
    about: str,
    facts: Mapping[str, str],
    units: Sequence[UnitReport],
    trial: TrialSection | None = None,
) -> Path:
    """Write the report to ``path``, whole or not at all, and return it."""
    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters.update(plain=plain, with_sd=with_sd)
    page = environment.get_template("report.html").render(
        title=title,
        about=about,
        facts=facts,
        units=[(unit, verdict(unit), unit.validation.overall, _drawn(unit)) for unit in units],
        trial=trial,
        trial_columns=COLUMNS,
    )
    write_text(path, page)
    return path
