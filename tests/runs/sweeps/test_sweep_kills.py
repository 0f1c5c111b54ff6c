"""Kill -9 of workers and of the whole sweep, then the same command: the table is as if nothing had happened."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from small_sweeps import SMALL, empty, write_scenario

from smartshoe.runs.sweeps._case import computed
from smartshoe.runs.sweeps._places import Compute
from smartshoe.runs.sweeps._plan import read_plan
from smartshoe.runs.sweeps._running import sweep_plan

HERE = Path(__file__).parent
LATEST_S = 600.0  # until some case must have been done


def _children(pid: int) -> list[int]:
    """The sweep's workers: processes that loky started (not its resource tracker)."""
    found = []
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        words = Path(f"/proc/{child}/cmdline").read_bytes()
        if b"popen_loky" in words:
            found.append(int(child))
    return found


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").split() if path.exists() else []


def _start(scenario: Path, out: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    words = [sys.executable, str(HERE / "killed_sweep.py"), str(scenario), str(out)]
    return subprocess.Popen(words, env={**os.environ, **environment}, start_new_session=True, stderr=subprocess.PIPE)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill the sweep and what it started, as a machine that goes down does."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def _killed_again_and_again(tmp_path: Path, seeds: int, kills: int, compute: Compute) -> tuple[float, float]:
    """Shares of cases begun, and computed to the end, more than once."""
    scenario = write_scenario(tmp_path, SMALL.replace("[0, 1]", f"{{from = 0, count = {seeds}}}"))
    plan = read_plan(scenario)
    calm = sweep_plan(plan, tmp_path / "calm", compute=compute)
    out, began, ended = tmp_path / "out", tmp_path / "began", tmp_path / "ended"
    environment = {"SWEEP_BEGAN": str(began), "SWEEP_ENDED": str(ended)}
    if compute is empty:
        environment["SWEEP_EMPTY"] = "yes"
    rng = np.random.default_rng(kills)
    process = _start(scenario, out, environment)
    for number in range(kills):
        # Spread over the sweep, at a time that falls anywhere in a case's 20 ms.
        wanted = (number + 1) * len(plan) // (kills + 2)
        until = time.monotonic() + LATEST_S
        while len(_lines(ended)) < wanted:
            assert time.monotonic() < until, process.stderr.read() if process.poll() is not None else "no progress"
            time.sleep(0.005)
        time.sleep(float(rng.uniform(0.0, 0.04)))
        workers = _children(process.pid)
        if workers and number % 2 == 0:
            os.kill(int(rng.choice(workers)), signal.SIGKILL)
        else:
            _end(process)
            process = _start(scenario, out, environment)
    _, said = process.communicate(timeout=600)
    assert process.returncode == 0, said.decode()
    assert (out / "results.csv").read_bytes() == calm.results.read_bytes()
    assert len(list((out / "cases").glob("[!.]*.json"))) == len(plan)
    return tuple(len(_lines(path)) / len(plan) - 1.0 for path in (began, ended))


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="the workers are found in /proc")
def test_a_worker_and_then_the_sweep_killed_end_as_an_undisturbed_one(tmp_path: Path) -> None:
    begun_again, _ = _killed_again_and_again(tmp_path, 6, 2, computed)
    assert begun_again <= 2 * 2 / 12  # at most what the two workers had in hand at each kill


@pytest.mark.bank
def test_two_hundred_kills_repeat_under_two_percent(tmp_path: Path) -> None:
    begun_again, ended_again = _killed_again_and_again(tmp_path, 10_000, 200, empty)
    print(f"\n200 kills in 20,000 cases: {100 * begun_again:.2f} % begun again, {100 * ended_again:.3f} % ended again")
    assert begun_again < 0.02
