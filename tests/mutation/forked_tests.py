"""Tests of a copied checkout in forks of processes that have loaded what they need.

The process that calls has imported the libraries and nothing of ours. A fork of it loads a room's tests once; each bug
is a fork of that one, with other code in its functions. Only a bug in what an import runs needs a fork of the first.
"""

from __future__ import annotations

import ast
import contextlib
import gc
import json
import math
import os
import resource
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

WALL = 30.0  # times the processor time that is let pass by the clock, for tests that wait and a machine that is busy
LEAST_S, SLOWER = 4.0, 4.0  # a test hangs that takes this many times its usual processor time, and never less
LEAST_WALL_S = 120.0  # by the clock: a test that waits so long for what never comes hangs too
Costs = dict[str, float]  # by test, processor time in s
NOT_SWAPPED, UNDECIDED = "not swapped", "undecided"


class Bug(Protocol):
    """A small bug in one file, and the tests that are to notice it, in their order."""

    @property
    def file(self) -> str: ...

    @property
    def costs(self) -> Costs: ...

    def tree(self) -> ast.Module:
        """The file with the bug in it."""
        ...


@dataclass(frozen=True, slots=True)
class Ended:
    """How the tests ended, the first that failed, and their processor time in s.

    ``outcome`` is "killed", "survived", "hung" (they ended their process, or a test took or waited far too long),
    `UNDECIDED` (the clock ran out for all of them together, which a busy machine brings about as well) or
    `NOT_SWAPPED`.
    """

    outcome: str
    failed: str = ""
    cpu_s: float = 0.0


class Watch:
    """A pytest plugin: the first test that fails, and an end to each that takes too long."""

    def __init__(self, costs: Costs) -> None:
        self.failed = ""
        self._costs = costs

    def pytest_runtest_logstart(self, nodeid: str, location: object) -> None:
        cost_s = self._costs.get(nodeid, 0.0)
        signal.setitimer(signal.ITIMER_PROF, LEAST_S + SLOWER * cost_s)
        signal.setitimer(signal.ITIMER_REAL, LEAST_WALL_S + WALL * SLOWER * cost_s)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.failed:  # it cannot even be imported
            self.failed = report.nodeid


class FirstExample:
    """A pytest plugin: that an example fails is enough, it need not be made small."""

    def pytest_sessionstart(self) -> None:
        from hypothesis import Phase, settings

        settings.register_profile("mutants", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("mutants")


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


def run_pytest(checkout: Path, tests: list[str], plugins: list[object]) -> int:
    """Pytest over ``tests`` of ``checkout``, in this process, which a child is; programs that they start import it."""
    os.chdir(checkout)
    quiet = os.open(checkout / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    os.environ["PYTHONPATH"] = str(checkout)
    sys.path.insert(0, str(checkout))
    import pytest

    words = ["-x", "-p", "no:cacheprovider", "-p", "no:randomly", "--tb=line", f"--basetemp={checkout / 'made'}"]
    words += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of hypothesis, which is imported already
    return int(pytest.main([*words, *tests], plugins=[FirstExample(), *plugins]))


def in_child(work: Callable[[], object], wall_s: float) -> tuple[Any, float]:
    """What ``work`` gives in a fork of this process, and its processor time in s.

    None where its process ended before, `UNDECIDED` where it took longer by the clock.
    """
    mine, its = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(mine)
            os.setsid()
            for ended_by in (signal.SIGPROF, signal.SIGALRM):
                signal.signal(ended_by, signal.SIG_DFL)
            said = json.dumps(work()).encode()
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            with os.fdopen(its, "wb") as file:
                file.write(said)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(its)
    said = _said_within(mine, wall_s)
    # What the tests have left behind goes too; the child is not waited for yet, so that its number is its own.
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)
    _, _, used = os.wait4(child, 0)
    os.close(mine)
    answer = UNDECIDED if said is None else json.loads(said) if said else None
    return answer, used.ru_utime + used.ru_stime


def _said_within(pipe: int, wall_s: float) -> bytes | None:
    """What the child writes until it ends; None where it takes longer."""
    said, until = b"", time.monotonic() + wall_s
    while time.monotonic() < until:
        if not select.select([pipe], [], [], 1.0)[0]:
            continue
        piece = os.read(pipe, 1 << 16)
        if not piece:
            return said
        said += piece
    return None


def _wall_s(costs: Costs) -> float:
    return 600.0 + WALL * (sum(costs.values()) + SLOWER * max(costs.values(), default=0.0))


def _ended(answer: tuple[Any, float]) -> Ended:
    said, cpu_s = answer
    if said is None or said == UNDECIDED:
        return Ended(said or "hung", "", cpu_s)
    return Ended(said[0], said[1], cpu_s)


def run_fresh(checkout: Path, bug: Bug, plain_python: bool) -> Ended:
    """Run the tests of ``bug`` in a process that imports the checkout anew, until the first fails."""

    def work() -> tuple[str, str]:
        _limit(plain_python)
        watch = Watch(bug.costs)
        status = run_pytest(checkout, list(bug.costs), [watch])
        return ("survived" if status == 0 else "killed"), watch.failed

    with written(checkout / bug.file, bug.tree()):
        return _ended(in_child(work, _wall_s(bug.costs)))


def _limit(plain_python: bool) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if plain_python:
        import numba

        numba.config.DISABLE_JIT = True
        os.environ["NUMBA_DISABLE_JIT"] = "1"


def record(checkout: Path, tests: list[str], files: list[str], plain_python: bool) -> dict[str, Any]:
    """What each of ``tests`` runs of ``files``: its lines, cost in s, outcome; and the lines that imports run."""

    def work() -> dict[str, Any] | None:
        from recording import Recorder

        _limit(plain_python)
        recorder = Recorder(str(checkout), files)
        status = run_pytest(checkout, ["--maxfail=1000000", *tests], [recorder])
        return recorder.found() if status <= 1 else None  # beyond it not even their files could be read

    said, _ = in_child(work, 7200.0)
    if not isinstance(said, dict):
        raise SystemExit(
            f"the tests end their process, or cannot be read:\n{(checkout / 'said.txt').read_text()[-3000:]}"
        )
    return said


class _Serving:
    """A pytest plugin whose run of the collected tests is a loop over bugs, each in a fork."""

    def __init__(self, checkout: Path, bugs: list[Bug], answer: Callable[[Bug, Ended], None]) -> None:
        self._checkout, self._bugs, self._answer = checkout, bugs, answer

    def pytest_runtestloop(self, session: Any) -> bool:
        from swapping import Loaded

        loaded = Loaded(str(self._checkout))
        every = {item.nodeid: item for item in session.items}
        gc.collect()
        gc.freeze()
        for bug in self._bugs:
            self._answer(bug, self._tried(session, loaded, every, bug))
        return True

    def _tried(self, session: Any, loaded: Any, every: dict[str, Any], bug: Bug) -> Ended:
        path = self._checkout / bug.file
        text, tree = path.read_text(encoding="utf-8"), bug.tree()

        def work() -> tuple[str, str]:
            if not loaded.is_swapped(str(path), text, tree):
                return NOT_SWAPPED, ""
            from _pytest.main import pytest_runtestloop

            watch = Watch(bug.costs)
            session.config.pluginmanager.register(watch)
            session.items = [every[name] for name in bug.costs]
            with contextlib.suppress(session.Failed):
                pytest_runtestloop(session)
            return ("killed" if session.testsfailed else "survived"), watch.failed

        with written(path, tree):
            return _ended(in_child(work, _wall_s(bug.costs)))


def serve(
    checkout: Path, tests: list[str], bugs: list[Bug], plain_python: bool, answer: Callable[[Bug, Ended], None]
) -> None:
    """Load ``tests`` once in a child, and ``answer`` there how each of ``bugs`` ends."""

    def work() -> int:
        _limit(plain_python)
        return run_pytest(checkout, tests, [_Serving(checkout, bugs, answer)])

    in_child(work, math.inf)


@contextlib.contextmanager
def written(path: Path, tree: ast.Module) -> Iterator[None]:
    """The file as the tree has it, for programs that tests start, and then as it was."""
    text, state = path.read_text(encoding="utf-8"), path.stat()
    path.write_text(ast.unparse(tree) + "\n", encoding="utf-8")
    try:
        yield
    finally:
        path.write_text(text, encoding="utf-8")
        os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
