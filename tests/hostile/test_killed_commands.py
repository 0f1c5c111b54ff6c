"""A command killed at any moment leaves each result as it was or whole, and does its work when called again.

The long run, over 500 kills of every command that writes: ``pytest -m bank tests/hostile/test_killed_commands.py -s``.
"""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from hosted_commands import KILLED, Host, Tried
from writing_commands import WRITING

from smartshoe.live._recorder import interrupted_at

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks the commands")
EVERYDAY = ("calibrations add", "identify", "stream")
MOST_STEPS, AT_RANDOM, LIVE_KILLS = 24, 8, 24  # kills a command


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_killed_command_leaves_results_whole(host: Host, inputs: Path, tmp_path: Path, name: str) -> None:
    tried = Tried(host, inputs, tmp_path, name)
    for step in (2, tried.steps):
        assert tried.stopped(step).status == KILLED


@pytest.mark.bank
@pytest.mark.parametrize("name", WRITING)
def test_every_command_killed_step_by_step_and_at_random(host: Host, inputs: Path, tmp_path: Path, name: str) -> None:
    tried = Tried(host, inputs, tmp_path, name)
    steps = sorted({round(step) for step in np.linspace(1, tried.steps, MOST_STEPS)})
    for step in steps:
        assert tried.stopped(step).status == KILLED
    rng, kills = np.random.default_rng(len(name)), 0
    began_s = time.perf_counter()
    tried.stopped(after_s=0.0)
    calm_s = time.perf_counter() - began_s
    while kills < AT_RANDOM:  # one that ended before its kill counts for nothing
        kills += tried.stopped(after_s=float(rng.uniform(1e-3, calm_s))).status == KILLED
    print(f"\n{name}: killed at {len(steps)} of {tried.steps} steps and {kills} times at random")


@pytest.mark.bank
def test_a_live_recording_killed_step_by_step_keeps_whole_rows_in_order(
    host: Host, inputs: Path, tmp_path: Path
) -> None:
    words = "live --shoe replay:W.csv --speed 2 --record o.csv"
    told = (inputs / "W.csv").read_text().splitlines()
    head = next(number for number, line in enumerate(told) if line.startswith("time_s"))
    sent = [float(line.split(",")[0]) for line in told[head + 1 :]]
    for step in range(1, LIVE_KILLS + 1):
        folder = tmp_path / str(step)
        shutil.copytree(inputs, folder)
        assert host.run(words, folder, step).status == KILLED
        left = interrupted_at(folder / "o.csv", [""])
        rows = (folder / "o.csv").read_text().splitlines() if (folder / "o.csv").exists() else []
        first = next((number for number, line in enumerate(rows) if line.startswith("time_s")), len(rows))
        times = [float(row.split(",")[0]) for row in rows[first + 1 :]]
        np.testing.assert_allclose(times, sent[: len(times)], atol=1e-9)
        assert (left is not None) == (step > 1)  # at the first nothing was made yet
    print(f"\nlive --record: killed at each of its first {LIVE_KILLS} steps")
