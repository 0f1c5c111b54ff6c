"""A session's result as files: report, result, calibrations, recordings, diagnosis; and its entry in the store."""

from __future__ import annotations

from pathlib import Path

import smartshoe
from smartshoe.atomic import json_text, make_folder, write_text
from smartshoe.logs import write
from smartshoe.recording import Recording
from smartshoe.report.calibration import DiagnosisLink, UnitReport, write_page
from smartshoe.session.analysis import SessionResult
from smartshoe.session.folder import kept_on_disk


def publish(result: SessionResult, folder: Path) -> dict[str, Path]:
    """Write everything below ``folder`` and, where there is a serial number, into the store.

    Returns what to tell of, by what it is.
    """
    with kept_on_disk(folder):
        written = _write(result, folder)
    if result.plan.serial_number:
        from smartshoe.store import CalibrationStore

        written["stored"] = CalibrationStore(result.plan.store).add(result.calibration).path
    return written


def _write(result: SessionResult, folder: Path) -> dict[str, Path]:
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
    about = (
        f"Pressed by {', '.join(result.recordings)}. Load and reading were put on one time base by the load itself"
        f" ({'; '.join(_clocks(name, recording) for name, recording in result.recordings.items())})."
    )
    facts = {"shoe": plan.shoe, "machine": plan.machine, "serial number": plan.serial_number or "not given",
             "date": plan.created, "smartshoe": smartshoe.__version__}  # fmt: skip
    written["report"] = write_page(folder / "report.html", f"Calibration of {plan.unit}", about, facts, [unit])
    return written


def _clocks(name: str, recording: Recording) -> str:
    said = {key: float(recording.metadata[f"join_{key}"]) for key in ("delay_s", "delay_sd_s", "rate", "rate_sd")}
    return (
        f"{name}: machine's clock ahead of the shoe's by {said['delay_s']:.4f} ± {said['delay_sd_s']:.4f} s,"
        f" {1e6 * said['rate']:.1f} ± {1e6 * said['rate_sd']:.1f} ppm fast"
    )


def _publish_diagnosis(result: SessionResult, folder: Path) -> DiagnosisLink | None:
    """The diagnosis in a folder of its own, and its extended calibration beside the plain one."""
    from smartshoe.report.diagnosis.folder import publish_diagnosis

    found, plan = result.diagnosis, result.plan
    if found is None:
        return None
    own = make_folder(folder / "diagnosis")
    page = publish_diagnosis(own, found, plan.unit, {"smartshoe": smartshoe.__version__})["report"]
    if found.model is not None:
        first = next(iter(result.recordings.values()))
        extended = found.calibration(unit=plan.unit, sample_rate_hz=first.sample_rate_hz, created=plan.created)
        extended.save(folder / f"{plan.unit}_extended.json")
    left_n = found.to_dict()["extended"].get("force_rmse_n")
    return DiagnosisLink(found.says, page.relative_to(folder).as_posix(), left_n)
