"""Exports a calibration's filter for firmware and other tools: C99, MATLAB/Octave, JSON, FMI 3.0 (`fmu`).

A target is a function from a `FilterModel` to its files. The model's ``kind`` names the templates, so a new kind of
model needs a new `FilterModel` and its templates, but no change here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from smartshoe.calibration._calibration import Calibration
from smartshoe.calibration.export._c99 import c_files
from smartshoe.calibration.export._fmu import fmu_files, twin_files
from smartshoe.calibration.export._json_file import json_files
from smartshoe.calibration.export._matlab import matlab_files
from smartshoe.calibration.export._model import FilterModel
from smartshoe.calibration.export._names import DEFAULT_NAME, TWIN_NAME, names_of
from smartshoe.calibration.export._twin import TwinModel
from smartshoe.errors import UsageError
from smartshoe.files.atomic import make_folder, replacing

Precision = Literal["double", "float"]
Fixed = Literal["q15", "q31"]
Files = Mapping[str, str | bytes]


@dataclass(frozen=True)
class Arithmetic:
    """The arithmetic of the C code; ``apart`` puts its self-tests into a folder of their own."""

    precision: str = "double"
    fixed: str | None = None
    apart: bool = False


_TARGETS: Mapping[str, Callable[[FilterModel, Arithmetic], Files]] = {
    "c": lambda model, a: c_files(model, a.precision, a.fixed, apart=a.apart),
    "matlab": lambda model, _: matlab_files(model),
    "json": lambda model, _: json_files(model),
    "fmu": lambda model, _: fmu_files(model),
}
TARGETS = tuple(_TARGETS)


def export_files(
    calibration: Calibration,
    to: str,
    *,
    sample_rate_hz: float | None = None,
    precision: str = "double",
    fixed: str | None = None,
    name: str = DEFAULT_NAME,
) -> Files:
    """The files (name to text) of ``calibration``'s filter for target ``to``, by default at the calibration's rate.

    ``precision`` is that of the C code; ``fixed`` ("q15", "q31") selects integer arithmetic instead; ``name`` is that
    of files and symbols. Raises `UsageError` for an unknown target or arithmetic, for a name that is no C identifier,
    and for a rate that is not positive or too high for the filter to be written in double precision.
    """
    return export_shoe(
        [calibration], to, sample_rate_hz=sample_rate_hz, precision=precision, fixed=fixed, names=[name]
    )  # fmt: skip


def export_shoe(
    calibrations: Sequence[Calibration],
    to: str,
    *,
    sample_rate_hz: float | None = None,
    precision: str = "double",
    fixed: str | None = None,
    names: Sequence[str] = (),
) -> Files:
    """Like `export_files`, for several units whose C code links into one program: file name to text.

    ``names``: one name per unit, or one prefix for the units' names, or none: then the units' names (for a single
    calibration ``smartshoe_filter``). The self-tests of several units are in the folder ``self_test``. Also raises
    `UsageError` for two equal names.
    """
    if to not in _TARGETS:
        raise UsageError(f"target {to!r} is not known: use {', '.join(TARGETS[:-1])} or {TARGETS[-1]}")
    if precision not in get_args(Precision):
        integers = f", or --fixed {precision} for integers" if precision in get_args(Fixed) else ""
        raise UsageError(f"precision {precision!r} is not known: use {' or '.join(get_args(Precision))}{integers}")
    if precision == "float" and to != "c":
        raise UsageError(f"precision float is for target c, {to} is always double: leave it away")
    if fixed is not None and fixed not in get_args(Fixed):
        raise UsageError(f"fixed point {fixed!r} is not known: use {' or '.join(get_args(Fixed))}")
    if fixed is not None and (to != "c" or precision == "float"):
        against = "--precision float" if to == "c" else f"target {to}"
        raise UsageError(f"fixed point {fixed} is for target c without --precision, not for {against}: leave it away")
    arithmetic = Arithmetic(precision, fixed, apart=len(calibrations) > 1)
    found: dict[str, str | bytes] = {}
    for calibration, name in zip(calibrations, names_of(calibrations, names), strict=True):
        found |= _TARGETS[to](FilterModel.of(calibration, sample_rate_hz, name), arithmetic)
    return found


def export_twins(
    calibrations: Sequence[Calibration], *, sample_rate_hz: float | None = None, names: Sequence[str] = ()
) -> Files:
    """The units themselves as FMI 3.0 units, load in and reading out: file name to bytes.

    ``names`` as for `export_shoe`, by default ``smartshoe_twin``. Raises `UsageError` for an effect that cannot be
    exported forward, `InputError` for coefficients that do not describe a passive solid.
    """
    found: dict[str, str | bytes] = {}
    for calibration, name in zip(calibrations, names_of(calibrations, names, TWIN_NAME), strict=True):
        rate_hz = FilterModel.of(calibration, sample_rate_hz).sample_rate_hz
        found |= twin_files(TwinModel(calibration, rate_hz, name))
    return found


def write_files(files: Mapping[str, str | bytes], folder: Path | str, *, force: bool = False) -> list[Path]:
    """Write ``files`` (name to text or bytes) into ``folder``, created where it is missing: all of them or none.

    Raises `UsageError` naming a file that already exists, unless ``force`` allows replacing it.
    """
    paths = [Path(folder) / name for name in files]
    there = [path for path in paths if path.is_file()]
    if there and not force:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise UsageError(f"{there[0]}{more} would be overwritten: choose another --out or --name, or give --force")
    for place in dict.fromkeys(path.parent for path in paths):
        make_folder(place)
    with ExitStack() as stack:
        for path, content in zip(paths, files.values(), strict=True):
            # Text is written unchanged, without the platform's line endings.
            stack.enter_context(replacing(path)).write_bytes(content.encode() if isinstance(content, str) else content)
    return paths


__all__ = ["TARGETS", "FilterModel", "Fixed", "Precision", "export_files", "export_shoe", "export_twins", "write_files"]
