"""Output shared by commands: JSON, notes, warnings, progress."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

if TYPE_CHECKING:
    from smartshoe.recording import Recording


figures_option = click.option(
    "--figures",
    type=click.Choice(["svg", "pdf", "png"]),
    multiple=True,
    help="Write figures for papers as well, below DIR/figures (repeatable).",
)


def require_writable(
    *files: str | None, json_path: str | None = None, folder: str | None = None, read: Iterable[str] = ()
) -> None:
    """Raise `UsageError`, before anything is computed, for outputs that cannot or should not be written.

    ``files`` and ``json_path`` are to be written (None: not requested; ``-`` is stdout, for ``json_path`` only), some
    of them perhaps in ``folder``, which is created where it is missing. None may be one of the input files ``read``,
    which it would replace, or equal another output.
    """
    from smartshoe.errors import UsageError

    _refuse_no_name(*files, None if json_path == "-" else json_path)
    if folder in ("", "-"):
        raise UsageError(f"--out is {folder!r}, which names no folder: give the name of one (. for this one)")
    made = None if folder is None else Path(folder).absolute()
    if made is not None:
        there = next(place for place in (made, *made.parents) if place.exists())
        if not there.is_dir():
            raise UsageError(f"{folder} cannot be made a folder, {there} is a file: choose another --out")
    taken = {Path(path).resolve(): "is read, and the result would replace it" for path in read}
    for path in (*files, json_path):
        if path is None or path == "-":
            continue
        parent = Path(path).absolute().parent
        if not parent.is_dir() and (made is None or parent not in (made, *made.parents)):
            raise UsageError(f"{path} cannot be written, there is no folder {parent}: choose one that exists")
        if Path(path).is_dir():
            raise UsageError(f"{path} is a directory: give the name of a file to write")
        place = Path(path).resolve()
        if place in taken and (place.is_file() or not place.exists()):  # a device may be written to twice
            raise UsageError(f"{path} {taken[place]}: give another name to write to")
        taken[place] = "is to hold two results"


def _refuse_no_name(*files: str | None) -> None:
    """Raise `UsageError` for ``-`` and for an empty name, as of a script's variable that was never set."""
    from smartshoe.errors import UsageError

    if "" in files:
        raise UsageError("the name of a file to write is empty: give one")
    if "-" in files:
        raise UsageError(
            "- is standard output, which only --json writes to: give the name of a file (./- for one of that name)"
        )


def emit_json(result: dict[str, Any], path: str | None) -> bool:
    """Write ``result`` to ``path`` (``-``: stdout) where one is given; returns whether stdout is used for it."""
    if path is None:
        return False
    from smartshoe.files.atomic import json_text, write_text

    if path == "-":
        click.echo(json_text(result), nl=False)
        return True
    write_text(path, json_text(result))
    return False


def show_notes(recordings: list[Recording]) -> None:
    """Print on stderr what readers changed in the files."""
    for recording in recordings:
        for said in recording.notes:
            note(f"{recording.label}: {said}")


Talk = Literal["quiet", "usual", "verbose"]
talk: ContextVar[Talk] = ContextVar("talk", default="usual")


def printable(text: str) -> str:
    """``text`` as one line without control characters, since names and cells of files appear in messages."""
    line = " ".join(text.split())
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)


def note(text: str) -> None:
    """Print a note for the user on stderr, unless ``--quiet``."""
    if talk.get() != "quiet":
        click.echo(f"note: {printable(text)}", err=True)


def warn(text: str) -> None:
    """Print on stderr what the user should know before using the result."""
    click.echo(f"warning: {printable(text)}", err=True)


def _nothing(_: object) -> None:
    """Ignore a step where no progress is shown."""


@dataclass(frozen=True, slots=True)
class ShownSteps:
    """Passes the name of each step to ``show``; ``of`` sets how many are still to come, for the remaining time."""

    show: Callable[[str], None] = _nothing
    of: Callable[[int], None] = _nothing

    def __call__(self, text: str) -> None:
        """Begin a step."""
        self.show(text)


@contextmanager
def progress(total: int | None = None) -> Iterator[ShownSteps]:
    """A bar with the step's name on a terminal, and the remaining time where the ``total`` of steps is known.

    Elsewhere nothing, or with ``--verbose`` one line per step with the seconds since the command began. The bar appears
    at once, so a command's slow imports belong inside this context.
    """
    if talk.get() == "verbose":
        began = time.monotonic()
        yield ShownSteps(lambda text: click.echo(f"{time.monotonic() - began:6.1f} s  {text}", err=True))
        return
    if talk.get() == "quiet" or not sys.stderr.isatty():
        yield ShownSteps()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    left = (BarColumn(20), TextColumn("left"), TimeRemainingColumn())
    with Progress(*columns, *(left if total else ()), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=total)
        done = -1

        def show(text: str) -> None:
            nonlocal done
            done += 1
            bar.update(task, description=text, completed=done, total=max(total, done + 1) if total else None)

        def of(whole: int) -> None:
            nonlocal total
            if not total:
                bar.columns = (*columns, *left)
            total = done + 1 + whole
            bar.update(task, total=total)

        yield ShownSteps(show, of)
