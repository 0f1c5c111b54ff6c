"""A calibration's filter for firmware and other tools: C99, MATLAB/Octave, JSON, each with a test vector.

A target is a function that takes a `FilterModel` and gives its files; the model's ``kind`` names the templates, so a
further kind of model is a further `FilterModel` and its templates, and no change here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Literal, get_args

from smartshoe.atomic import make_folder, replacing
from smartshoe.compensation.calibration import Calibration
from smartshoe.compensation.export.c99 import c_files
from smartshoe.compensation.export.json_file import json_files
from smartshoe.compensation.export.matlab import matlab_files
from smartshoe.compensation.export.model import FilterModel
from smartshoe.errors import UsageError

Precision = Literal["double", "float"]

_TARGETS: Mapping[str, Callable[[FilterModel, str], dict[str, str]]] = {
    "c": c_files,
    "matlab": lambda model, _: matlab_files(model),
    "json": lambda model, _: json_files(model),
}
TARGETS = tuple(_TARGETS)


def export_files(
    calibration: Calibration, to: str, *, sample_rate_hz: float | None = None, precision: str = "double"
) -> dict[str, str]:
    """File name to text of ``calibration``'s filter for target ``to``, at its own rate where none is given.

    ``precision`` is that of the C code. Raises `UsageError` for an unknown target or precision, and for a rate that
    is not positive or too high for the filter to be written in double precision.
    """
    if to not in _TARGETS:
        raise UsageError(f"target {to!r} is not known: use {', '.join(TARGETS[:-1])} or {TARGETS[-1]}")
    if precision not in get_args(Precision):
        raise UsageError(f"precision {precision!r} is not known: use {' or '.join(get_args(Precision))}")
    if precision == "float" and to != "c":
        raise UsageError(f"precision float is for target c, {to} is always double: leave it away")
    return _TARGETS[to](FilterModel.of(calibration, sample_rate_hz), precision)


def write_files(files: Mapping[str, str], folder: Path | str) -> list[Path]:
    """Write ``files`` (name to text) into ``folder``, made where it is missing: all of them or none."""
    place = make_folder(folder)
    paths = [place / name for name in files]
    with ExitStack() as stack:
        for path, text in zip(paths, files.values(), strict=True):
            stack.enter_context(replacing(path)).write_text(text, encoding="utf-8", newline="\n")
    return paths


__all__ = ["TARGETS", "FilterModel", "Precision", "export_files", "write_files"]
