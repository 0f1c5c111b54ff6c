"""What a sweep costs beside its cases, and what a case costs.

Times are this machine's and printed; that each case costs the same, however many there are, is asserted.
"""

from __future__ import annotations

import json
import resource
import time
from pathlib import Path

import pytest
from table import FigureTable

from smartshoe.runs.sweeps._case import computed
from smartshoe.runs.sweeps._plan import Case, read_plan
from smartshoe.runs.sweeps._running import sweep_plan

pytestmark = pytest.mark.benchmark
SIZES = (10_000, 100_000)
CASES = 20
SCENARIO = """\
[machine]
backend = "sim:instron"
[protocol.static]
[protocol.dynamic]
repeats = 2
[[unit]]
name = "left_toe"
[sweep]
design = "random"
count = %d
[sweep.vary]
"unit.left_toe.bladder.k1" = {uniform = [1.0, 2.0]}
"unit.left_toe.bladder.k2" = {log_uniform = [0.1, 0.4]}
"""


def empty(case: Case) -> str:
    figures = {f"left_toe.figure_{number}": case.values["unit.left_toe.bladder.k1"] + number for number in range(20)}
    return json.dumps({"status": "done", "says": None, "figures": figures})


def test_bookkeeping(table: FigureTable, tmp_path: Path) -> None:
    each_ms = []
    for count in SIZES:
        (tmp_path / "s.toml").write_text(SCENARIO % count, encoding="utf-8")
        plan = read_plan(tmp_path / "s.toml")
        started = time.process_time()
        found = sweep_plan(plan, tmp_path / str(count), compute=empty)
        each_ms.append(1e3 * (time.process_time() - started) / count)
        assert (found.computed, found.missing, found.failed) == (count, 0, 0)
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # pytest's own 10 MB among them
        said = f"{each_ms[-1]:.2f} ms of processor time a case, {peak_mb:.0f} MB at most"
        table.add("sweep", f"bookkeeping of {count} empty cases", said, asked="1 ms, 300 MB", met=each_ms[-1] < 1.0)
    assert each_ms[1] < 2.0 * each_ms[0]


def test_a_calibration(table: FigureTable, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SCENARIO % (CASES + 1), encoding="utf-8")
    plan = read_plan(tmp_path / "s.toml")
    computed(plan.case(CASES))  # the first one compiles
    started = time.process_time()
    found = sweep_plan(plan, tmp_path / "out")
    assert (found.computed, found.failed) == (CASES + 1, 0)
    each_s = (time.process_time() - started) / (CASES + 1)
    said = f"{each_s:.2f} s of processor time"
    table.add("sweep", "a calibration, static and dynamic", said, asked="0.4 s", met=each_s < 0.4)
