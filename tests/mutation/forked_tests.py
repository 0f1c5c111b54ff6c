"""Runs tests of a copied checkout in forks of this process, which has imported the libraries and nothing of ours."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import signal
import sys
import threading
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

WALL = 6.0  # times the processor time that is let pass by the clock, for tests that wait and a machine that is busy


@dataclass(frozen=True, slots=True)
class Ended:
    """How the tests ended: pytest's status (None: out of time), the first that failed, processor time, what they call.

    ``calls`` are files and first lines of our functions.
    """

    status: int | None
    failed: str
    cpu_s: float
    calls: frozenset[tuple[str, int]] = frozenset()


class _Notes:
    """A pytest plugin: the first test that fails; with ``below``, which functions of that folder are called (slow)."""

    def __init__(self, below: str) -> None:
        self.failed = ""
        self.calls: set[tuple[str, int]] = set()
        self._below = below

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.failed:  # it cannot even be imported
            self.failed = report.nodeid

    def pytest_sessionstart(self) -> None:
        from hypothesis import Phase, settings

        # That an example fails is enough: it need not be made small.
        settings.register_profile("mutants", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("mutants")
        if self._below:
            sys.setprofile(self._called)
            threading.setprofile(self._called)

    def _called(self, frame: Any, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(self._below):
            self.calls.add((frame.f_code.co_filename[len(self._below) :], frame.f_code.co_firstlineno))


def import_libraries() -> None:
    """What every child would import: done once, before the forks."""
    import hypothesis
    import numba
    import pandas
    import pydantic
    import pytest
    import rich.console
    import scipy.interpolate
    import scipy.optimize
    import scipy.signal
    import scipy.stats

    assert all((hypothesis, numba, pandas, pydantic, pytest, rich, scipy))


def run_tests(checkout: Path, tests: list[str], cpu_s: float, calls: bool = False) -> Ended:
    """Run ``tests`` of ``checkout`` until the first fails; what outlives ``cpu_s`` of processor time is killed.

    Programs that they start import the copy as well.
    """
    mine, its = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(mine)
            _child(checkout, tests, cpu_s, calls, its)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(its)
    said = _said_within(child, mine, WALL * cpu_s)
    # What the tests have left behind goes too; the child is not waited for yet, so that its number is its own.
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)
    _, _, used = os.wait4(child, 0)
    os.close(mine)
    took_s = used.ru_utime + used.ru_stime
    if not said:
        return Ended(None, "", took_s)
    status, failed, called = json.loads(said)
    return Ended(status, failed, took_s, frozenset((name, line) for name, line in called))


def _child(checkout: Path, tests: list[str], cpu_s: float, calls: bool, answer: int) -> None:
    os.setsid()
    os.chdir(checkout)
    resource.setrlimit(resource.RLIMIT_CPU, (int(cpu_s) + 1, int(cpu_s) + 2))
    quiet = os.open(checkout / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    os.environ["PYTHONPATH"] = str(checkout)
    sys.path.insert(0, str(checkout))
    import pytest

    notes = _Notes(f"{checkout}/" if calls else "")
    words = ["-x", "-p", "no:cacheprovider", "-p", "no:randomly", "--tb=short", f"--basetemp={checkout / 'made'}"]
    words += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of hypothesis, which is imported already
    status = int(pytest.main([*words, *tests], plugins=[notes]))
    sys.setprofile(None)
    sys.stdout.flush()
    with os.fdopen(answer, "w") as file:
        json.dump([status, notes.failed, sorted(notes.calls)], file)


def _said_within(child: int, pipe: int, wall_s: float) -> bytes:
    """What the child writes until it ends; nothing where it takes longer."""
    said, until = b"", time.monotonic() + wall_s
    while time.monotonic() < until:
        if not select.select([pipe], [], [], 1.0)[0]:
            continue
        piece = os.read(pipe, 1 << 16)
        if not piece:
            return said
        said += piece
    return b""
