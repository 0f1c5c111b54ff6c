"""A pytest plugin that notes of each test which lines of some files it runs, what it costs, and whether it passes.

What tests share (a fixture of a module, a function that remembers its answer) is run in the first of them alone; it
counts for each that uses it.
"""

from __future__ import annotations

import functools
import os
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from coverage import Coverage

TOO_LONG_S = 30.0  # of processor time: a test that takes longer is left out


@dataclass(slots=True)
class Span:
    """What ran between two moments: the numbers of the spans in it, processor time in s, was a program started."""

    number: int
    inner: set[int] = field(default_factory=set)
    cost_s: float = 0.0
    started: bool = False

    def take(self, other: Span) -> None:
        """All of ``other`` ran in here too."""
        self.inner |= other.inner | {other.number}
        self.started |= other.started


class Recorder:
    """The plugin. ``below``: the folder of the checkout; ``files``: those whose lines are wanted.

    It is made before anything of the checkout is imported, so that its functions that remember are seen.
    """

    def __init__(self, below: str, files: list[str]) -> None:
        self._below, self._files = below, files
        self._coverage = Coverage(data_file=None, include=[f"{below}/{name}" for name in files], config_file=False)
        self._open = [Span(0)]
        self._last = 0
        self._of_fixture: dict[int, Span] = {}
        self._tests: dict[str, Span] = {}
        self._outcomes: dict[str, str] = {}
        functools.lru_cache = self._remembering(functools.lru_cache)  # type: ignore[assignment]
        functools.cache = functools.lru_cache(maxsize=None)  # type: ignore[assignment]
        sys.addaudithook(self._heard)
        self._coverage.start()
        self._coverage.switch_context("0")

    def found(self) -> dict[str, Any]:
        """Of each test its outcome, cost, whether it starts programs, and its lines by file; the lines of imports."""
        self._coverage.stop()
        data = self._coverage.get_data()
        by_span: dict[int, dict[str, list[int]]] = {}
        for name in self._files:
            for line, contexts in data.contexts_by_lineno(f"{self._below}/{name}").items():
                for context in filter(None, contexts):
                    by_span.setdefault(int(context), {}).setdefault(name, []).append(line)
        tests = {}
        for test, span in self._tests.items():
            lines: dict[str, set[int]] = {}
            for number in {span.number, *span.inner}:
                for name, own in by_span.get(number, {}).items():
                    lines.setdefault(name, set()).update(own)
            about = {"outcome": self._outcomes.get(test, "passed"), "cost_s": round(span.cost_s, 3)}
            sorted_lines = {name: sorted(own) for name, own in lines.items()}
            tests[test] = {**about, "started": span.started, "lines": sorted_lines}
        return {"tests": tests, "imported": [[name, line] for name, own in by_span.get(0, {}).items() for line in own]}

    def _heard(self, event: str, _: tuple[object, ...]) -> None:
        if event in ("subprocess.Popen", "os.posix_spawn", "os.fork"):
            self._open[-1].started = True

    def _remembering(self, plain: Callable[..., Any]) -> Callable[..., Any]:
        """`functools.lru_cache` whose functions of the checkout tell what they ran when they answer from memory."""

        def lru_cache(maxsize: Any = 128, typed: bool = False) -> Any:
            return wrapped(maxsize, 128) if callable(maxsize) else functools.partial(wrapped, size=maxsize)

        def wrapped(function: Callable[..., Any], size: int | None) -> Callable[..., Any]:
            remembers = plain(size)(function)
            code = getattr(function, "__code__", None)
            if code is None or not code.co_filename.startswith(self._below):
                return remembers
            spans: dict[Any, Span] = {}

            @functools.wraps(function)
            def answer(*values: Any, **named: Any) -> Any:
                key = (values, tuple(sorted(named.items())))
                if key in spans and remembers.cache_info().currsize:
                    self._open[-1].take(spans[key])
                    return remembers(*values, **named)
                with self._span() as spans[key]:
                    return remembers(*values, **named)

            answer.cache_clear, answer.cache_info = remembers.cache_clear, remembers.cache_info  # type: ignore[attr-defined]
            return answer

        return lru_cache

    def _give_up(self, *_: object) -> None:
        self._gave_up = True
        raise TimeoutError(f"more than {TOO_LONG_S:g} s of processor time")

    def _span(self) -> _Opened:
        self._last += 1
        return _Opened(self._open, Span(self._last), lambda span: self._coverage.switch_context(str(span.number)))

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        with self._span() as self._of_fixture[id(fixturedef)]:
            return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        signal.signal(signal.SIGPROF, self._give_up)
        self._gave_up = False
        with self._span() as span:
            signal.setitimer(signal.ITIMER_PROF, TOO_LONG_S)
            try:
                answer = yield
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
        for fixtures in item._fixtureinfo.name2fixturedefs.values():
            for one in fixtures:
                if id(one) in self._of_fixture:
                    span.take(self._of_fixture[id(one)])
        self._tests[item.nodeid] = span
        if self._gave_up:
            self._outcomes[item.nodeid] = "too long"
        return answer

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.outcome != "passed":
            self._outcomes[report.nodeid] = report.outcome


class _Opened:
    """A span that is open; what ran in it ran in the one around it too."""

    def __init__(self, spans: list[Span], own: Span, switch: Callable[[Span], None]) -> None:
        self._spans, self._own, self._switch = spans, own, switch
        self._began_s = cpu_s()

    def __enter__(self) -> Span:
        self._spans.append(self._own)
        self._switch(self._own)
        return self._own

    def __exit__(self, *_: object) -> None:
        self._spans.remove(self._own)
        self._own.cost_s = cpu_s() - self._began_s
        self._spans[-1].take(self._own)
        self._switch(self._spans[-1])


def cpu_s() -> float:
    """Processor time of this process and of the programs that it has waited for, in s."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system
