"""Writes a long trial's events and strides as tables while they are found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import astuple
from pathlib import Path
from typing import Any

from smartshoe.files.atomic import replacing
from smartshoe.gait._events import Event
from smartshoe.gait._strides import Stride

DIGITS = 9  # of a number, as in the tables of a short trial


@contextmanager
def tables(folder: Path) -> Iterator[Callable[[Sequence[Event], Sequence[Stride]], None]]:
    """Write what `smartshoe.gait.analyse_stream` reports to ``events.csv`` and ``strides.csv`` in ``folder``.

    Yields the function to pass as ``report``. The files appear, complete, when the block ends without an error.
    """
    with ExitStack() as stack:
        files = []
        for name, row in (("events", Event), ("strides", Stride)):
            path = stack.enter_context(replacing(folder / f"{name}.csv"))
            files.append(stack.enter_context(path.open("w", encoding="utf-8", newline="\n")))
            files[-1].write(",".join(row.__dataclass_fields__) + "\n")

        def report(events: Sequence[Event], strides: Sequence[Stride]) -> None:
            for file, rows in zip(files, (events, strides), strict=True):
                file.writelines(map(_line, rows))

        yield report


def _line(row: Any) -> str:
    return ",".join(_cell(value) for value in astuple(row)) + "\n"


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
