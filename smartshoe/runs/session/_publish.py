"""Writes a session's result: report, JSON, calibrations, recordings, diagnosis; and stores the calibration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from smartshoe.calibration.provenance import calibrated_on
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.files.logs import write
from smartshoe.report.calibration import DiagnosisLink, UnitReport, write_page
from smartshoe.runs.session._analysis import SessionResult
from smartshoe.runs.session._checks import AT_THE_END
from smartshoe.runs.session._folder import writing_to_disk
from smartshoe.version import __version__

if TYPE_CHECKING:
    from smartshoe.calibration.store import Entry


def publish(result: SessionResult, folder: Path) -> dict[str, Path]:
    """Write everything below ``folder`` and, with a serial number, add the calibration to the store.

    Returns the paths to report, by what they are.
    """
    with writing_to_disk(folder):
        unit, written = _write(result, folder)
    entry = _stored(result)
    with writing_to_disk(folder):
        written["report"] = _write_page(result, folder, unit, entry)
    return written if entry is None else {**written, "stored": entry.path}


def _stored(result: SessionResult) -> Entry | None:
    """Add the calibration to the store and return its entry; None without a serial number."""
    plan = result.plan
    if not plan.serial_number:
        return None
    from smartshoe.calibration.store import CalibrationStore

    return CalibrationStore(plan.store).add(result.calibration, valid_for_days=plan.valid_for_days)


def _write(result: SessionResult, folder: Path) -> tuple[UnitReport, dict[str, Path]]:
    """Write everything except the page; returns the page's part about the unit, and the paths by what they are."""
    plan = result.plan
    make_folder(folder / "recordings")
    for name, recording in result.recordings.items():
        write(recording, folder / "recordings" / f"{name}.csv")
    calibration = folder / f"{plan.unit}.json"
    result.calibration.save(calibration)
    written = {"calibration": calibration}
    link = _publish_diagnosis(result, folder)
    write_text(folder / "result.json", json_text(result.to_dict()))
    unit = UnitReport(
        plan.unit,
        result.identification.to_dict(),
        result.validation,
        list(result.recordings.values()),
        list(result.recordings),
        list(result.recordings),
        link,
        [
            (f"calibration of {plan.unit}", calibration.name),
            ("result as JSON", "result.json"),
            *((f"recording {name}", f"recordings/{name}.csv") for name in result.recordings),
        ],
        "" if link else f"smartshoe diagnose {' '.join(f'recordings/{name}.csv' for name in result.recordings)}",
    )
    return unit, written


def _write_page(result: SessionResult, folder: Path, unit: UnitReport, entry: Entry | None) -> Path:
    plan = result.plan
    about = (
        f"Pressed: {', '.join(result.recordings)}. Load and reading were put on one time base by the load itself"
        f" ({'; '.join(result.clocks_said)})."
    )
    facts = {"shoe": plan.shoe, "machine": plan.machine, "serial number": plan.serial_number or "not given",
             "date": plan.created, "smartshoe": __version__}  # fmt: skip
    title = f"Calibration of {plan.unit}"
    return write_page(folder / "report.html", title, about, facts, [unit], session=_card(result, entry))


def _card(result: SessionResult, entry: Entry | None) -> list[tuple[str, str]]:
    """The rows at the top of the page: what was pressed, checked and stored, the clocks, and the validity."""
    plan = result.plan
    rows = [("unit", f"{plan.unit}, serial number {plan.serial_number or 'not given'}")]
    for name in result.recordings:
        tries = [attempt for attempt in result.attempts if attempt.experiment == name]
        said = f"accepted at attempt {next(attempt.number for attempt in tries if attempt.state == 'accepted')}"
        found = [f"attempt {attempt.number}: {one['says']}" for attempt in tries for one in attempt.findings]
        rows.append((f"pressed: {name}", "; ".join([said, *found]) if found else f"{said}, no fault found"))
    looked_for = [(check.__doc__ or "").split("\n")[0].rstrip(".") for check in AT_THE_END]
    rows.append(
        ("faults that each attempt is searched for", "; ".join(f"{one[0].lower()}{one[1:]}" for one in looked_for))
    )
    rows += [("clocks", said) for said in result.clocks_said]
    if entry is None:
        return [*rows, ("stored", "only in this folder: with --serial-number it goes into the store")]
    until = "no expiry was set: --valid-for-days sets one"
    if entry.expires is not None:
        until = f"until {entry.expires.date().isoformat()} ({entry.valid_for_days:g} days), or a repair"
    return [*rows, ("stored", f"{entry.path}"), ("valid", until)]


def _publish_diagnosis(result: SessionResult, folder: Path) -> DiagnosisLink | None:
    """Write the diagnosis into a folder of its own, and its extended calibration next to the plain one."""
    from smartshoe.report.diagnosis.folder import publish_diagnosis

    found, plan = result.diagnosis, result.plan
    if found is None:
        return None
    own = make_folder(folder / "diagnosis")
    page = publish_diagnosis(own, found, plan.unit, {"smartshoe": __version__}).paths["report"]
    if found.model is not None:
        extended = found.calibration(unit=plan.unit, created=plan.created)
        calibrated_on(extended, list(result.recordings.values())).save(folder / f"{plan.unit}_extended.json")
    left_n = found.to_dict()["extended"].get("force_rmse_n")
    return DiagnosisLink(found.says, page.relative_to(folder).as_posix(), left_n)
