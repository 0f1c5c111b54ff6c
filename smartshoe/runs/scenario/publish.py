"""Writes a scenario's result: the report, the result as JSON and a calibration for each unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from smartshoe.calibration.provenance import calibrated_on
from smartshoe.files.atomic import make_folder, write_text
from smartshoe.report.calibration import DiagnosisLink, UnitReport, headline, judge, write_page
from smartshoe.report.wording import sentence
from smartshoe.runs.scenario._run import ScenarioResult, UnitResult, diagnosed_on
from smartshoe.version import __version__

if TYPE_CHECKING:
    from smartshoe.report.trial import TrialSection


def _publish_diagnosis(
    unit: UnitResult, folder: Path, result: ScenarioResult, figures: Sequence[str]
) -> DiagnosisLink | None:
    """Write the unit's diagnosis into a folder of its own, and its extended calibration next to the plain one."""
    from smartshoe.report.diagnosis.folder import publish_diagnosis

    found, settings = unit.diagnosis, result.scenario.diagnose
    if found is None or settings is None:
        return None
    own = make_folder(folder / "diagnosis" / unit.name)
    facts = {"scenario": result.source.name, "seed": str(result.scenario.seed), "smartshoe": __version__}
    page = publish_diagnosis(own, found, unit.name, facts, figures).paths["report"]
    if found.model is not None:
        saved = calibrated_on(found.calibration(unit=unit.name), diagnosed_on(unit.recordings, settings))
        saved.save(folder / "calibrations" / f"{unit.name}_extended.json")
    left_n = found.to_dict()["extended"].get("force_rmse_n")
    return DiagnosisLink(found.says, page.relative_to(folder).as_posix(), left_n)


def _publish_trial(result: ScenarioResult, folder: Path) -> TrialSection | None:
    """Write the trial's recording, true loads and own page into a folder of their own."""
    trial = result.trial
    if trial is None:
        return None
    from smartshoe.files.logs import write
    from smartshoe.report.gait.folder import publish_gait
    from smartshoe.report.trial import section

    own = make_folder(folder / "trial")
    write(trial.recording, own / f"{trial.name}.csv")
    true = trial.recorded.true_loads()
    if true is not None:
        write(true, own / f"{trial.name}_truth.csv")
    facts = {"scenario": result.source.name, "seed": str(result.scenario.seed), "shoe": trial.shoe}
    page = publish_gait(own, trial.gait, trial.name, facts)["report"]
    return section(
        trial.to_dict(), trial.gait, trial.recording.time_s, trial.totals_n(), page.relative_to(folder).as_posix()
    )


def publish(result: ScenarioResult, folder: Path, result_json: str, figures: Sequence[str] = ()) -> Path:
    """Write ``report.html``, ``result.json`` and ``calibrations/UNIT.json`` below ``folder``; returns the report.

    ``figures`` are the endings (svg, pdf, png) of figures for papers.
    """
    calibrations = make_folder(folder / "calibrations")
    for unit in result.units:
        unit.calibration.save(calibrations / f"{unit.name}.json")
    write_text(folder / "result.json", result_json)
    diagnosed = {
        unit.name: _publish_diagnosis(unit, folder, result, figures) for unit in result.units if unit.diagnosis
    }
    facts = {
        "scenario": result.source.name,
        "seed": str(result.scenario.seed),
        "smartshoe": __version__,
    }
    units = [_unit_report(result, unit, diagnosed.get(unit.name)) for unit in result.units]
    title, about, trial = result.scenario.title, result.scenario.about, _publish_trial(result, folder)
    commands = [f"smartshoe run {result.source} --seed {result.scenario.seed} --out {folder}"]
    if any(not unit.recordings for unit in result.scenario.unit):
        commands.append(f"smartshoe simulate {result.source} --seed {result.scenario.seed} --out recordings")
    if figures:
        from smartshoe.report.paper.calibration import write_figures

        write_figures(make_folder(folder / "figures"), units, figures)
    return write_page(folder / "report.html", title, about, facts, units, trial, commands)


def judged(result: ScenarioResult) -> tuple[str, dict[str, str]]:
    """The verdict on all units as one sentence, and each unit's grade by its name."""
    judgements = [judge(_unit_report(result, unit, None)) for unit in result.units]
    return sentence(headline(judgements)[1]), {one.unit: one.grade for one in judgements}


def _unit_report(result: ScenarioResult, unit: UnitResult, diagnosed: DiagnosisLink | None) -> UnitReport:
    """The report on ``unit``, with the command that would diagnose it if it was not diagnosed."""
    sources = {name: recording.source for name, recording in unit.recordings.items()}
    simulated = not any(Path(source).is_file() for source in sources.values())
    files = [("calibration", f"calibrations/{unit.name}.json"), ("result as JSON", "result.json")]
    if simulated:
        sources = {name: f"recordings/{unit.name}_{name}.csv" for name in sources}
    else:
        files += [(f"recording {name}", Path(source).resolve().as_uri()) for name, source in sources.items()]
    fitted = [sources[name] for name in unit.fitted]
    unseen = [f"--hold-out {sources[name]}" for name in unit.judged if name not in unit.fitted]
    command = " ".join(["smartshoe diagnose", *fitted, *unseen, f"--out diagnosis/{unit.name}"])
    if simulated:
        command = f"smartshoe simulate {result.source} --seed {result.scenario.seed} --out recordings && {command}"
    return UnitReport(
        unit.name,
        unit.identified,
        unit.validation,
        list(unit.recordings.values()),
        unit.fitted,
        unit.judged,
        diagnosed,
        files,
        "" if diagnosed else command,
    )
