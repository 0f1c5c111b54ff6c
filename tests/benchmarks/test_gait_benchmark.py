"""``smartshoe gait`` as a person waits for it, and the detector as a stream meets it.

Times are this machine's and printed; that all strides are found is asserted.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from table import FigureTable

from simulators.people import Person, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.files.logs import write
from smartshoe.gait import ContactDetector
from smartshoe.units import MILLIBAR

pytestmark = pytest.mark.benchmark
ROUNDS = 5
CASE = "gait, two shoes, 200 Hz"


@pytest.mark.parametrize("report", [False, True], ids=["table and JSON", "with page and tables"])
def test_two_minutes(table: FigureTable, tmp_path: Path, report: bool) -> None:
    made = trial(Person(), Walk(1.3), 120.0, np.random.default_rng(1))
    write(made.recording, tmp_path / "walk.csv")
    words = ["gait", str(tmp_path / "walk.csv"), "--coverage", "0.8", "--json", str(tmp_path / "gait.json")]
    for unit in made.unit_n:
        Calibration(a1=0.2, b0=5.0, b1=1.0, reading_unit=MILLIBAR, unit=unit).save(tmp_path / f"{unit}.json")
        words += ["--calibration", str(tmp_path / f"{unit}.json")]
    if report:
        words += ["--out", str(tmp_path / "out")]
    took_s, worked_s = [], []
    for _ in range(ROUNDS):
        started, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "smartshoe", *words], check=True, capture_output=True)
        took_s.append(time.perf_counter() - started)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        worked_s.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    strides = json.loads((tmp_path / "gait.json").read_text(encoding="utf-8"))["strides"]
    strikes = sum(made.times_s(foot, "heel_strike").size for foot in ("left", "right"))
    assert len(strides) == pytest.approx(strikes, abs=4)
    what = "2 min, a new process" + (", page and tables" if report else "")
    said = f"{min(took_s):.2f} s ({min(worked_s):.2f} s of processor time)"
    table.add(CASE, what, said, asked="2 s", met=min(took_s) <= 2.0)


def test_the_detector_on_a_stream(table: FigureTable) -> None:
    made = trial(Person(), Walk(1.3), 1200.0, np.random.default_rng(1), sensors=False, noise_n=1.0)
    regions = ("toe", "meta1", "meta4", "heel")
    feet = [
        np.column_stack([made.recording[f"{side}_{region}"].values for region in regions]) for side in ("left", "right")
    ]
    detectors = [ContactDetector(200.0) for _ in feet]
    found = 0
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.perf_counter()
    for _ in range(3):
        for start in range(0, len(feet[0]), 2000):
            for detector, loads in zip(detectors, feet, strict=True):
                found += len(detector.push(loads[start : start + 2000]))
    rate = 3 * 1200.0 / (time.perf_counter() - started)
    strikes = sum(made.times_s(foot, "heel_strike").size for foot in ("left", "right"))
    assert found == pytest.approx(3 * strikes, rel=0.05)  # the last ones wait for what comes after them
    more_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb) / 1024.0
    table.add(
        CASE, "events of a stream", f"{rate:.0f} times real time, {more_mb:.0f} MB more", asked="1000", met=rate > 1000
    )
