"""The time of a sheet's rows: finds its column and unit, and checks that it increases."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import InputError
from smartshoe.files.logs._sheet import Column, Sheet
from smartshoe.files.logs.picks import Pick, names_a_column, need_quantity, pick, titles
from smartshoe.units import SECOND, Unit

_TIME_NAMES = frozenset({"time", "t", "x_value", "zeit", "czas", "temps", "tijd", "tiempo", "时间"})


# 'rows[49Hz]': the rows have that rate; 'NAME[49Hz]': the column counts samples of that rate.
_AT_A_RATE = re.compile(r"(?P<base>.*?)\s*\[\s*(?P<rate>\d+(\.\d*)?([eE]\d+)?)\s*(?P<kilo>k?)hz\s*\]\s*", re.IGNORECASE)
_ROWS = frozenset({"rows", ""})
_WITHOUT_UNIT = re.compile(r"rows\s*(\[[\s\d.]*\])?\s*", re.IGNORECASE)


def time_of(sheet: Sheet, units: Sequence[Unit | None], choice: str | None) -> tuple[int | None, Array]:
    """The index of the time column (None where the rows themselves are the time), and the time (n,) in s.

    ``choice`` is a column by name or number with its unit, ``rows[49Hz]`` for rows at that rate, or ``NAME[49Hz]`` for
    a column that counts samples. Raises `InputError` and its subclasses for a column that is not a time.
    """
    at_rate = _AT_A_RATE.fullmatch(choice) if choice is not None else None
    if choice is not None and _WITHOUT_UNIT.fullmatch(choice) and not names_a_column(sheet, choice):
        raise _no_rate(sheet, choice)
    if at_rate is None:
        found = _time_column(sheet, units, choice)
        return found.index, _seconds(
            sheet, sheet.columns[found.index], need_quantity(sheet, found, "--time", "time", "s")
        )
    rate_hz = float(at_rate["rate"]) * (1e3 if at_rate["kilo"] else 1.0)
    if rate_hz <= 0.0:
        raise _no_rate(sheet, str(choice))
    if at_rate["base"].casefold() in _ROWS:
        return None, np.arange(sheet.columns[0].values.size) / rate_hz
    counting = pick(sheet, at_rate["base"], "--time").index
    return counting, _complete(sheet, sheet.columns[counting]) / rate_hz


def _no_rate(sheet: Sheet, choice: str) -> InputError:
    """The error of a choice of rows, or of a column that counts them, without a rate."""
    return InputError(f"{sheet.path}: --time {choice!r} has no rate above 0: write it like 'rows[49Hz]'")


def counts_rows(choice: str) -> bool:
    """Whether a user's choice of time is the row number at a given rate rather than a column."""
    at_rate = _AT_A_RATE.fullmatch(choice)
    return at_rate is not None and at_rate["base"].casefold() in _ROWS


def _time_column(sheet: Sheet, units: Sequence[Unit | None], choice: str | None) -> Pick:
    if choice is not None:
        return pick(sheet, choice, "--time")
    of_time = [i for i, u in enumerate(units) if u is not None and u.quantity == "time"]
    named = [i for i in of_time if sheet.columns[i].name.casefold() in _TIME_NAMES]
    for found in (named[:1], [0] if 0 in of_time else [], of_time if len(of_time) == 1 else []):
        if found:
            return Pick(found[0], units[found[0]])
    for index, column in enumerate(sheet.columns):
        if units[index] is None and (column.name == "t" or column.name.casefold() in _TIME_NAMES - {"t"}):
            if sheet.format == "labview" and column.name.casefold() == "x_value":
                return Pick(index, SECOND)  # LabVIEW's X_Dimension is time in seconds unless stated otherwise
            return Pick(index, None)
    example = "NAME[s]" if sheet.has_header else "1[ms]"
    raise InputError(
        f"{sheet.path} has no column that is time by its unit: name it, for example --time '{example}', or give the"
        f" rows' rate, --time 'rows[100Hz]' (columns: {titles(sheet)})"
    )


def _complete(sheet: Sheet, column: Column) -> Array:
    absent = ~np.isfinite(column.values)
    if absent.any():
        raise InputError(
            f"{sheet.place(int(np.argmax(absent)))} has no time in column {column.name!r}: give every row a time,"
            " or remove that row"
        )
    return column.values


def _seconds(sheet: Sheet, column: Column, in_unit: Unit) -> Array:
    values = _complete(sheet, column)
    if in_unit.scale < 1.0:
        return values / (1.0 / in_unit.scale)  # makes 11 ms equal 0.011 s to the last bit; a product may not
    return in_unit.to_si(values)


def check_increasing(sheet: Sheet, time_s: Array) -> None:
    """Raise `InputError` for the first row of the sheet whose time (n,) in s repeats or decreases."""
    step = np.diff(time_s)
    if step.size and not (step > 0).all():
        at = int(np.argmax(~(step > 0)))
        fault = "repeats" if step[at] == 0 else "goes back"
        more = int(np.count_nonzero(~(step > 0))) - 1
        where, which = (f", as in {more} more", "those rows") if more else ("", "that row")
        if not more and at + 2 < time_s.size and step[at] < 0 and time_s[at + 2] < time_s[at]:
            which = "that row and those after it"  # the clock was set back
        by_rate = ""
        if more and (step >= 0.0).all() and time_s[-1] > time_s[0]:  # typical of rounded times
            by_rate = f", or read all by their rate (--time 'rows[{step.size / (time_s[-1] - time_s[0]):.4g}Hz]')"
        raise InputError(
            f"{sheet.place(at + 1)}: time {fault} ({time_s[at]:.9g} s, then {time_s[at + 1]:.9g} s){where}: remove or"
            f" re-time {which}{by_rate}"
        )
