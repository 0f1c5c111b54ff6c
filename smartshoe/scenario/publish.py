"""A scenario's result as files: the report, the result and a calibration for each unit."""

from __future__ import annotations

from pathlib import Path

import smartshoe
from smartshoe.atomic import make_folder, write_text
from smartshoe.report.page import DiagnosisLink, UnitReport, write_page
from smartshoe.scenario.run import ScenarioResult, UnitResult


def _publish_diagnosis(unit: UnitResult, folder: Path, result: ScenarioResult) -> DiagnosisLink | None:
    """The unit's diagnosis in a folder of its own, and its extended calibration beside the plain one."""
    from smartshoe.report.diagnosis.folder import publish_diagnosis

    found = unit.diagnosis
    if found is None:
        return None
    own = make_folder(folder / "diagnosis" / unit.name)
    facts = {"scenario": result.source.name, "seed": str(result.scenario.seed), "smartshoe": smartshoe.__version__}
    page = publish_diagnosis(own, found, unit.name, facts)["report"]
    if found.model is not None:
        rate_hz = next(iter(unit.recordings.values())).sample_rate_hz
        saved = found.calibration(unit=unit.name, sample_rate_hz=rate_hz)
        saved.save(folder / "calibrations" / f"{unit.name}_extended.json")
    return DiagnosisLink(found.says, page.relative_to(folder).as_posix())


def publish(result: ScenarioResult, folder: Path, result_json: str) -> Path:
    """Write ``report.html``, ``result.json`` and ``calibrations/UNIT.json`` below ``folder``; returns the report."""
    calibrations = make_folder(folder / "calibrations")
    for unit in result.units:
        unit.calibration.save(calibrations / f"{unit.name}.json")
    write_text(folder / "result.json", result_json)
    diagnosed = {unit.name: _publish_diagnosis(unit, folder, result) for unit in result.units if unit.diagnosis}
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
            diagnosed.get(unit.name),
        )
        for unit in result.units
    ]
    return write_page(folder / "report.html", result.scenario.title, result.scenario.about, facts, units)
