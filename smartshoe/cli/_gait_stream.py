"""``smartshoe gait`` on recordings too large for memory."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.gait import Coverage

LARGE_BYTES = 64 << 20  # some forty minutes of two shoes, which take about a gigabyte in memory


def is_streamed(files: Sequence[str], chosen: bool | None) -> bool:
    """Whether the trial in ``files`` is processed as a stream: as ``chosen``, by default where the files are large."""
    if chosen is not None:
        return chosen
    from smartshoe.files.logs import detect

    large = [path for file in files if (path := Path(file)).is_file() and path.stat().st_size > LARGE_BYTES]
    return any(detect(path).name == "plain" for path in large)


def refuse_with(options: dict[str, str | None]) -> None:
    """Raise `UsageError` for options that need the whole trial in memory."""
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise UsageError(
            f"{given[0]} needs the whole trial in memory, and this one goes through as a stream: leave it out, or give"
            " --whole"
        )


def gait_of_stream(
    files: Sequence[str],
    calibrations: Sequence[Calibration],
    body_weight_n: float | None,
    coverage: Coverage,
    time: str | None,
    json_path: str | None,
    folder: Path | None,
    estimator: str | None,
) -> None:
    """Analyse ``files`` in bounded memory, then print and write the results."""
    from smartshoe.cli._output import emit_json, progress
    from smartshoe.files.atomic import json_text, write_text
    from smartshoe.files.logs.blocks import read_blocks
    from smartshoe.gait import Event, Stride, analyse_stream
    from smartshoe.gait.day_tables import tables

    written: dict[str, Path] = {}
    with progress() as step, ExitStack() as stack:
        step("events, strides, forces")
        write = None if folder is None else stack.enter_context(tables(folder))

        def report(events: Sequence[Event], strides: Sequence[Stride]) -> None:
            if events:
                step(f"events, strides, forces: {events[-1].time_s / 3600.0:.2f} h")
            if write is not None:
                write(events, strides)

        sources = [read_blocks(file, time=time) for file in files]
        found = analyse_stream(sources, calibrations, body_weight_n, coverage, report, estimator)
    if folder is not None:
        written = {"result": folder / "gait.json"} | {name: folder / f"{name}.csv" for name in ("strides", "events")}
        write_text(written["result"], json_text(found.to_dict()))
    if emit_json(found.to_dict(), json_path):
        return
    from smartshoe.report.gait.terminal import print_gait

    print_gait(found, ", ".join(Path(file).name for file in files))
    click.echo(
        f"{found.recorded_s / 3600.0:.2f} h recorded, {found.stride_count} strides, {found.event_count} events"
        + ("" if written or found.listed_s is None else ": --out DIR writes all of them")
    )
    for name, path in written.items():
        click.echo(f"{name}: {path}")
