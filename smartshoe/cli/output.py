"""What commands share on their way out: JSON, notes, progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from smartshoe.recording import Recording


figures_option = click.option(
    "--figures", type=click.Choice(["svg", "pdf", "png"]), help="Write figures for papers as well, below DIR/figures."
)


def emit_json(result: dict[str, Any], path: str | None) -> bool:
    """Write ``result`` to ``path`` (``-``: stdout) where one is given; True where stdout is taken by it."""
    if path is None:
        return False
    from smartshoe.atomic import json_text, write_text

    if path == "-":
        click.echo(json_text(result), nl=False)
        return True
    write_text(path, json_text(result))
    return False


def show_notes(recordings: list[Recording]) -> None:
    """What readers did to the files, on stderr."""
    for recording in recordings:
        for note in recording.notes:
            click.echo(f"note: {recording.label}: {note}", err=True)


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """A spinner with the step's name on a terminal; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    with Progress(
        SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn(),
        console=Console(stderr=True), transient=True,
    ) as bar:  # fmt: skip
        task = bar.add_task("starting", total=None)
        yield lambda text: bar.update(task, description=text)
