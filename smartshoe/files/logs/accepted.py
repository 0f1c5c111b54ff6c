"""Accepts recordings in any form that public functions take: a `Recording`, a file's path, or a pandas DataFrame."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

import numpy as np

from smartshoe.errors import InputError, UsageError
from smartshoe.recording import TIME_NAME, Recording

if TYPE_CHECKING:
    import pandas as pd

RecordingLike: TypeAlias = Union[Recording, str, "os.PathLike[str]", "pd.DataFrame"]


def recording_of(given: Any, argument: str = "recording") -> Recording:
    """``given`` as a recording.

    A path is read as by `smartshoe.read`, a DataFrame as a plain table with the same columns (``time_s`` may be its
    index). Raises `UsageError` for anything else, naming ``argument`` and the type, and the errors of reading.
    """
    if isinstance(given, Recording):
        return given
    if isinstance(given, (str, os.PathLike)):
        from smartshoe.files.logs import read

        return read(Path(given))
    if _is_frame(given):
        return _from_frame(given, argument)
    raise UsageError(
        f"{argument} is of type {type(given).__name__}: give a Recording, a path or a DataFrame with a plain table's"
        " columns"
    )


def recordings_of(given: Any, argument: str = "recordings") -> list[Recording]:
    """One recording, or several in any iterable, as a list; raises the errors of `recording_of`."""
    several = isinstance(given, Iterable) and not isinstance(
        given, (Recording, str, bytes, os.PathLike, Mapping, np.ndarray)
    )
    if not several or _is_frame(given):
        return [recording_of(given, argument)]
    return [recording_of(one, f"{argument}[{index}]") for index, one in enumerate(given)]


def unit_of(
    recordings: Sequence[Recording], do: str, called: Callable[[Recording], str | None] = lambda one: one.unit
) -> str:
    """The name of the one unit of ``recordings``, given by ``called``; empty where no recording states it.

    Raises `UsageError`, naming a recording of each, where there are several units: the action ``do`` applies to one
    unit at a time.
    """
    first_of = {unit: one.label for one in reversed(recordings) if (unit := called(one))}
    if len(first_of) > 1:
        units = ", ".join(f"{unit} in {first_of[unit]}" for unit in sorted(first_of))
        raise UsageError(f"recordings of different units ({units}): {do} one unit at a time")
    return next(iter(first_of), "")


def _is_frame(given: Any) -> bool:
    pandas = sys.modules.get("pandas")  # if it has not been imported, nothing can be a DataFrame
    return pandas is not None and isinstance(given, pandas.DataFrame)


def _from_frame(frame: pd.DataFrame, argument: str) -> Recording:
    from smartshoe.files.logs._sheet import Column, Sheet, require_sound
    from smartshoe.files.logs._text import plain_title
    from smartshoe.files.logs.columns import recording_from

    if f"{TIME_NAME}_s" not in frame.columns and frame.index.name == f"{TIME_NAME}_s":
        frame = frame.reset_index()
    if f"{TIME_NAME}_s" not in frame.columns:
        raise InputError(f"{argument}: the DataFrame has no column time_s: give the time in seconds under that name")
    if not frame.columns.is_unique:
        raise InputError(
            f"{argument}: the DataFrame has a column {frame.columns[frame.columns.duplicated()][0]!r} twice"
        )
    columns = []
    for label in frame.columns:
        name, unit = plain_title(str(label))
        columns.append(Column(name, unit, _numbers(frame, label, argument), label=str(label)))
    sheet = Sheet(Path(argument), "plain", columns)
    require_sound(sheet)
    return replace(recording_from(sheet, name="recording"), source="")


def _numbers(frame: pd.DataFrame, label: Any, argument: str) -> Any:
    kind = getattr(frame[label].dtype, "kind", "O")
    try:
        if kind not in "iufbO":
            raise TypeError(str(frame[label].dtype))
        return np.array(frame[label].to_numpy(dtype=float, na_value=np.nan))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{argument}: column {label!r} of the DataFrame holds no numbers ({frame[label].dtype}): convert or drop it"
        ) from error


__all__ = ["RecordingLike", "recording_of", "recordings_of"]
