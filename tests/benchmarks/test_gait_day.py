"""A day of walking through ``smartshoe gait``: 16 h, 200 Hz, eight units.

Times are this machine's and printed; memory and the number of strides are asserted.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from table import FigureTable

from simulators.people import Person, Stand, Walk, trial
from simulators.people import blocks as trial_blocks
from smartshoe.calibration import Calibration
from smartshoe.gait import analyse_stream
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

pytestmark = pytest.mark.benchmark
HOURS = 16.0
CASE = "gait, a day: 16 h, two shoes, 200 Hz"
# An hour of a day: walking at three speeds, standing between.
HOUR = ((Walk(1.3), 1500.0), (Stand(), 300.0), (Walk(0.9), 900.0), (Stand(), 300.0), (Walk(1.7), 600.0))


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The day's readings in mbar, through bladders, sensors and converter (some minutes to make)."""
    path = tmp_path_factory.mktemp("day") / "day.csv"
    made = trial_blocks(Person(), HOUR * round(HOURS), 3600.0 * HOURS, np.random.default_rng(1))
    for number, block in enumerate(made):
        frame = block.recording.to_frame()
        # Nine digits: those of 57599.995 s.
        frame.to_csv(path, mode="a", header=number == 0, index=False, float_format="%.9g", lineterminator="\n")
    return path


@pytest.mark.parametrize("calibrated", [False, True], ids=["events", "forces"])
def test_a_day_from_a_file(table: FigureTable, tmp_path: Path, day: Path, calibrated: bool) -> None:
    words = ["gait", str(day), "--coverage", "0.8", "--out", str(tmp_path / "out")]
    for side in ("left", "right"):
        for region in ("toe", "meta1", "meta4", "heel"):
            unit = f"{side}_{region}"
            Calibration(a1=0.2, b0=5.0, b1=1.0, reading_unit=MILLIBAR, unit=unit).save(tmp_path / f"{unit}.json")
            words += ["--calibration", str(tmp_path / f"{unit}.json")] if calibrated else []
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.perf_counter()
    measured = [sys.executable, "-c", MEASURED, *words]
    peak_mb = float(subprocess.run(measured, check=True, capture_output=True, text=True).stdout.split()[-1]) / 1024.0
    took_s = time.perf_counter() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    worked_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    strides = json.loads((tmp_path / "out" / "gait.json").read_text(encoding="utf-8"))["stream"]["strides"]
    what = "eight calibrations, forces" if calibrated else "readings alone, events"
    rate = 3600.0 * HOURS / took_s
    size_gb = day.stat().st_size / 1e9
    said = f"{rate:.0f} times real time ({took_s:.0f} s, {worked_s:.0f} s of processor time), {strides} strides"
    table.add(CASE, f"{size_gb:.1f} GB of CSV, {what}", said, asked="1000", met=rate >= 1000)
    table.add(CASE, f"memory, {what}", f"{peak_mb:.0f} MB at most", asked="500 MB", met=peak_mb < 500)
    assert peak_mb < 500
    assert strides > 60_000  # of 13 h on foot


MEASURED = """
import sys
from pathlib import Path
from smartshoe.cli import run_command

status = run_command(sys.argv[1:])
# Not getrusage: a child's peak there begins with that of the process that started it.
held = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines() if ":" in line)
print(held["VmHWM"].split()[0])
sys.exit(status)
"""


def test_a_day_of_blocks_in_memory(table: FigureTable) -> None:
    made = trial(Person(), Walk(1.3), 600.0, np.random.default_rng(1), sensors=False, noise_n=1.0).recording
    columns = {name: values for name, values in made.columns() if name != "time_s"}

    def blocks() -> Iterator[Recording]:
        for number in range(round(6.0 * HOURS)):
            yield Recording.from_arrays(time_s=made.time_s + 600.0 * number, name="day", **columns)

    started = time.perf_counter()
    found = analyse_stream(blocks(), coverage=0.8)
    rate = found.recorded_s / (time.perf_counter() - started)
    assert found.recorded_s == pytest.approx(3600.0 * HOURS, rel=1e-3)
    assert found.stride_count > 90_000
    said = f"{rate:.0f} times real time, {found.stride_count} strides"
    table.add(CASE, "blocks of 10 min in memory, forces in N", said, asked="1000", met=rate >= 1000)
