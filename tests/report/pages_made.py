"""One page of each kind, from little data: what the pages' tests share."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np
from scipy import signal

from simulators.people import Person, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.calibration.store.drift import drift
from smartshoe.calibration.validation import validate
from smartshoe.files.logs import write
from smartshoe.gait import GaitResult, analyse
from smartshoe.identification import identify
from smartshoe.models.parameter import Parameter
from smartshoe.recording import Recording
from smartshoe.report.calibration import UnitReport, write_page
from smartshoe.report.drift import write_drift
from smartshoe.report.gait._page import write_gait_page
from smartshoe.report.gait.charts import mean_strides
from smartshoe.report.trial import TrialSection, total_chart
from smartshoe.runs.studies import study
from smartshoe.units import MILLIBAR

NAME = "<script>alert(1)</script>"
RATES = (100.0, 400.0, 800.0)


def recorded(name: str, friction: float, seed: int) -> Recording:
    """Triangles at `RATES` through a lag, and through a share of play as friction leaves it."""
    corners_s, corners_n = [0.0, 2.0], [0.0, 0.0]
    for rate in RATES:
        corners_s += [corners_s[-1] + 800 / rate, corners_s[-1] + 1600 / rate, corners_s[-1] + 1600 / rate + 3]
        corners_n += [800.0, 0.0, 0.0]
    time_s = np.arange(0, corners_s[-1], 0.01)
    load_n = np.interp(time_s, corners_s, corners_n)
    held = load_n.copy()
    for k in range(1, held.size):  # play of 60 N either way
        held[k] = min(max(held[k - 1], load_n[k] - 60.0), load_n[k] + 60.0)
    _, reading, _ = signal.lsim(([1, 0.2], [1.6, 0.3]), load_n + friction * (held - load_n), time_s)
    noise = np.random.default_rng(seed).normal(0, 0.05, time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading + noise, name=name)


def unit_of(name: str, friction: float = 0.0) -> UnitReport:
    """A unit that was fitted on one recording and judged on another."""
    fitted, judged = recorded("dynamic", friction, 1), recorded("check", friction, 2)
    found = identify([fitted])
    report = validate([judged], found.calibration())
    return UnitReport(name, found.to_dict(), report, [fitted, judged], ("dynamic",), ("check",),
                      files=[("calibration", "calibrations/a.json")], diagnose="smartshoe diagnose a.csv")  # fmt: skip


@cache
def two_units() -> tuple[UnitReport, ...]:
    """One that is good and one with friction."""
    return unit_of(NAME), unit_of("left_heel", friction=0.5)


def _recorded_walk(seconds: float, speed: float = 1.3, seed: int = 1) -> Recording:
    rng = np.random.default_rng(seed)
    return trial(Person(), Walk(speed), seconds, rng, sensors=False, noise_n=1.0, name="walk").recording


@cache
def walked() -> GaitResult:
    """A walk of both feet."""
    return analyse([_recorded_walk(12.0)])


def calibration_page(folder: Path) -> Path:
    """Two units, with the command that made them."""
    commands = ["smartshoe run a.toml"]
    return write_page(folder / "report.html", "A & B", "about", {"seed": "1"}, two_units(), commands=commands)


def session_page(folder: Path) -> Path:
    """One unit, with what its session's card says."""
    card = [
        ("unit", "left_toe, serial number S9"),
        ("pressed: dynamic", "accepted at attempt 1, no fault found"),
        ("each attempt is searched for", "; ".join(["the reading stands at the end of the sensor's range"] * 7)),
        ("stored", f"/srv/biomechanics/laboratory/smartshoe/store/units/S9/2026-11-22_{'a79d93da6825d308' * 2}.json"),
    ]
    return write_page(folder / "report.html", "Session", "about", {"shoe": "sim"}, two_units()[1:], session=card)


def treadmill_page(folder: Path) -> Path:
    """A unit and the trial that it measured, beside the truth."""
    found = walked()
    total = np.asarray(found.total_n)
    totals = {"truth": total, "raw": 1.05 * total, "corrected": 1.01 * total}
    charts = [total_chart(found, np.asarray(found.total_time_s), totals), *mean_strides(found)]
    rows = [("mean total over whole strides (N)", ["519.4", "523.6", "520.1"])]
    notes = ["beyond calibrated rate: 8 units are loaded faster than they were calibrated."]
    section = TrialSection("walk", "Walking, 12 s", rows, notes, charts, "trial/gait.html")
    return write_page(folder / "report.html", "Treadmill", "about", {"seed": "1"}, two_units()[:1], section)


def gait_page(folder: Path) -> Path:
    """A walk of both feet."""
    return write_gait_page(folder / "gait.html", walked(), "Gait: walk", {"files": "walk.csv"})


def drift_page(folder: Path) -> Path:
    """A unit whose gain falls, with a repair."""
    store = CalibrationStore(folder / "store")
    rng = np.random.default_rng(3)
    sds = (2e-4, 2e-3, 2e-3)
    for k in range(6):
        values = np.array([0.215, 9.92, 2.022]) * (1.0, 1.0 - 0.01 * k, 1.0 - 0.01 * k) + rng.normal(0.0, sds)
        created = (datetime(2025, 1, 6, tzinfo=UTC) + timedelta(days=40 * k)).date().isoformat()
        units = ("1/s", "N/mbar", "N/(mbar s)")
        parameters = {
            name: Parameter.from_sd(float(value), sd, unit)
            for name, value, sd, unit in zip(("a1", "b0", "b1"), values, sds, units, strict=True)
        }
        store.add(
            Calibration(*(float(value) for value in values), MILLIBAR, unit="left_toe", parameters=parameters,
                        covariance=tuple(map(tuple, np.diag(np.square(sds)).tolist())), load_range_n=(0.0, 800.0),
                        created=created, serial_number="S1")
        )  # fmt: skip
    store.repair("S1", "2025-04-10", "a new tube under the heel")
    return write_drift(folder / "drift", drift(store, "S1"))["report"]


def study_page(folder: Path) -> Path:
    """Two subjects under two conditions, one file that is not there."""
    entries = ['title = "Slow and fast"']
    for number, subject in enumerate(("Anna", "Ben")):
        for condition, speed in (("slow", 1.0), ("fast", 1.5)):
            file = f"{subject}_{condition}.csv"
            write(_recorded_walk(8.0, speed, number), folder / file)
            reference = f'reference = "{file}"\n' if condition == "slow" else ""
            entries.append(f'[[trial]]\nfile = "{file}"\nsubject = "{subject}"\ncondition = "{condition}"\n{reference}')
    entries.append('[[trial]]\nfile = "nowhere.csv"\nsubject = "Anna"\ncondition = "slow"')
    (folder / "study.toml").write_text("\n".join(entries))
    made = study(folder / "study.toml", folder / "out", jobs=1).report
    assert made is not None
    return made


PAGES = {
    "calibration": calibration_page,
    "session": session_page,
    "treadmill": treadmill_page,
    "gait": gait_page,
    "drift": drift_page,
    "study": study_page,
}
