"""A scenario's result as files: the report, the result and a calibration for each unit."""

from __future__ import annotations

from pathlib import Path

import smartshoe
from smartshoe.atomic import make_folder, write_text
from smartshoe.report.page import UnitReport, write_page
from smartshoe.scenario.run import ScenarioResult


def publish(result: ScenarioResult, folder: Path, result_json: str) -> Path:
    """Write ``report.html``, ``result.json`` and ``calibrations/UNIT.json`` below ``folder``; returns the report."""
    calibrations = make_folder(folder / "calibrations")
    for unit in result.units:
        unit.calibration.save(calibrations / f"{unit.name}.json")
    write_text(folder / "result.json", result_json)
    facts = {
        "scenario": result.source.name,
        "seed": str(result.scenario.seed),
        "smartshoe": smartshoe.__version__,
    }
    units = [
        UnitReport(
            unit.name,
            unit.identification.to_dict(),
            unit.validation,
            list(unit.recordings.values()),
            unit.fitted,
            unit.judged,
        )
        for unit in result.units
    ]
    return write_page(folder / "report.html", result.scenario.title, result.scenario.about, facts, units)
