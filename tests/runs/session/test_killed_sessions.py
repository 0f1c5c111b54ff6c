"""A session killed at any moment has lost nothing that it acknowledged, and goes on.

The long run: ``pytest -m bank tests/runs/session/test_killed_sessions.py -s`` (200 kills).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from smartshoe.errors import UsageError
from smartshoe.files.journal import read_journal
from smartshoe.runs.session import SessionFolder, analyse, conduct
from smartshoe.runs.session import _samples as samples
from smartshoe.runs.session._folder import SAMPLES
from smartshoe.units import MILLIBAR

HERE = Path(__file__).parent
NAMES = ("left_toe", "left_meta1", "left_meta4", "left_heel")


@dataclass
class _Host:
    """The process that forks the sessions."""

    process: subprocess.Popen[str]

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def killed_after(self, folder: Path, wait_s: float, what: str) -> tuple[list[str], float]:
        """The lines of a session in ``folder`` that is killed after ``wait_s`` (0: never), and how long it ran."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{wait_s} {what} {folder}\n")
        self.process.stdin.flush()
        began, lines = time.perf_counter(), []
        while (said := self.line()) != "ended":
            lines.append(said)
        return lines, time.perf_counter() - began


@pytest.fixture(scope="module")
def host() -> Iterator[_Host]:
    process = subprocess.Popen(
        [sys.executable, str(HERE / "killed_session.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    found = _Host(process)
    assert found.line() == "ready"
    yield found
    assert process.stdin is not None
    process.stdin.close()
    process.wait(10)
    assert process.stdout is not None
    process.stdout.close()


def _recovered(folder: Path) -> int:
    """How many samples the journal holds; time goes on without a hole."""
    blocks = [
        samples.unpacked(record.payload, NAMES, MILLIBAR)
        for record in read_journal(folder / "journal.smj").records
        if record.kind == SAMPLES
    ]
    if not blocks:
        return 0
    time_s = np.concatenate([block.time_s for block in blocks])
    np.testing.assert_allclose(np.diff(time_s), 0.005, rtol=1e-6)
    return int(time_s.size)


def _kill_and_go_on(host: _Host, root: Path, kills: int, seed: int, what: str) -> dict[str, int]:
    rng = np.random.default_rng(seed)
    _, whole_s = host.killed_after(root / "whole", 0.0, what)
    counts = {"before recording": 0, "while recording": 0, "after recording": 0, "after the end": 0}
    for kill in range(kills):
        folder = root / str(kill)
        lines, _ = host.killed_after(folder, float(rng.uniform(1e-3, whole_s)), what)
        acknowledged = max((int(line) for line in lines if line.isdigit()), default=0)
        try:
            session = SessionFolder.resume(folder)
        except UsageError:
            # Killed before the plan was on disk: there was nothing to lose, and the command can be given again.
            assert acknowledged == 0
            counts["before recording"] += 1
            continue
        with session:
            recovered = _recovered(folder)
            assert recovered >= acknowledged
            recorded = bool(session.accepted())
            conduct(session)
            assert list(session.accepted()) == ["short"]
            if what == "judged":
                assert analyse(session).identification.converged
        assert _whole_or_absent(folder)
        stage = "after the end" if "done" in lines else "after recording" if recorded else "while recording"
        counts[stage if acknowledged else "before recording"] += 1
    return counts


def _whole_or_absent(folder: Path) -> bool:
    """Results are there whole or not at all."""
    return all(json.loads(path.read_text()) for path in folder.glob("*.json"))


def test_a_session_killed_anywhere_loses_nothing_and_goes_on(host: _Host, tmp_path: Path) -> None:
    counts = _kill_and_go_on(host, tmp_path, kills=4, seed=1, what="recorded")
    assert sum(counts.values()) == 4


@pytest.mark.bank
def test_two_hundred_kills(host: _Host, tmp_path: Path) -> None:
    counts = _kill_and_go_on(host, tmp_path, kills=200, seed=2, what="judged")
    print(f"\n200 kills: {counts}; every acknowledged sample recovered, every session went on to its result")
    assert counts["while recording"] >= 20
