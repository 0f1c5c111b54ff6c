"""Writes a trial's result as files: the page, the result as JSON, and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.gait import GaitResult
from smartshoe.report.gait._page import write_gait_page

DIGITS = 9  # of a number in the tables of strides and events
TIME_FORMAT, FORMAT = "%.9g", "%.6g"  # formats of the table of forces, whose loads are not known to a millionth


def publish_gait(
    folder: Path, found: GaitResult, title: str, facts: Mapping[str, str], figures: Sequence[str] = ()
) -> dict[str, Path]:
    """Write ``gait.html``, ``gait.json``, ``strides.csv``, ``events.csv`` and ``forces.csv`` below ``folder``.

    ``figures`` are the endings (svg, pdf, png) of figures for papers. Returns the paths by what they are.
    ``forces.csv`` is a plain table, which ``smartshoe gait`` can read as a trial.
    """
    from smartshoe.version import __version__

    names = {"report": "gait.html", "result": "gait.json"}
    names |= {table: f"{table}.csv" for table in ("strides", "events", "forces")}
    written = {what: folder / name for what, name in names.items()}
    write_text(written["result"], json_text(found.to_dict()))
    for table in ("strides", "events"):
        frame = found.to_frame("strides" if table == "strides" else "events")
        text = frame.to_csv(index=False, float_format=f"%.{DIGITS}g", lineterminator="\n")
        write_text(written[table], text)
    write_text(written["forces"], forces_text(found.columns()))
    write_gait_page(written["report"], found, f"Gait: {title}", {**facts, "smartshoe": __version__})
    if figures:
        from smartshoe.report.paper.gait import write_figures

        written["figures"] = make_folder(folder / "figures")
        write_figures(written["figures"], found, figures)
    return written


def forces_text(columns: Mapping[str, Any]) -> str:
    """The columns, of equal length with time first, as a plain table; cells are empty where a number is NaN.

    One format string serves the whole table; pandas formats number by number and takes four times as long.
    """
    numbers = np.column_stack([np.asarray(values, dtype=float) for values in columns.values()])
    row = ",".join([TIME_FORMAT] + [FORMAT] * (numbers.shape[1] - 1)) + "\n"
    body = (row * len(numbers)) % tuple(numbers.ravel())
    return ",".join(columns) + "\n" + body.replace("nan", "")
