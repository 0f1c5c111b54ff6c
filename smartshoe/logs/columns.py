"""A sheet's columns to a recording's channels: the one place where a column becomes time, load or sensor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.logs.sheet import Column, Sheet
from smartshoe.recording import (
    COMMAND_NAME,
    LOAD_NAME,
    SENSOR_NAME,
    UNITS_OF_A_SHOE,
    Channel,
    Recording,
    Role,
)
from smartshoe.units import SECOND, Unit, declared, find_unit

Array = NDArray[np.float64]

_CHOICE = re.compile(r"(?P<base>.*?)\s*\[(?P<unit>[^\[\]]*)\]\s*", re.DOTALL)
_COMMANDS = re.compile(r"command(ed)?|demand|set[ _-]?point|target|soll(wert)?", re.IGNORECASE)
_ESTIMATE = re.compile(r"estimate", re.IGNORECASE)
_TIME_NAMES = frozenset({"time", "t", "x_value", "zeit", "czas", "temps", "tijd", "tiempo", "时间"})
_MACHINE_LOGS = frozenset({"bluehill", "labview", "tdms"})  # what a testing machine or its logger writes
_NEGATIVE_SHARE = 5.0  # a load that reaches this many times further below zero than above it is compression


@dataclass(frozen=True, slots=True)
class _Pick:
    index: int
    unit: Unit | None  # what the user's brackets say, else what the file says


def _unit_in_file(column: Column) -> Unit | None:
    text = column.unit.strip()
    if not text.strip("()[]{} "):
        return None
    return find_unit(text) or declared(text.strip("()[]{} "))


def _titles(sheet: Sheet) -> str:
    return ", ".join(column.label or column.name or "''" for column in sheet.columns)


def _named(columns: Sequence[Column], wanted: str) -> list[int]:
    """The columns of that name or header text: exactly, or else apart from case."""
    for alike in (str, str.casefold):
        found = [i for i, c in enumerate(columns) if alike(wanted) in (alike(c.label), alike(c.name)) and wanted]
        if found:
            return found
    return []


def _pick(sheet: Sheet, choice: str, option: str) -> _Pick:
    """The column that a user's ``choice`` names; raises `InputError` where none or several fit."""
    columns = sheet.columns
    bracket = _CHOICE.fullmatch(choice)
    base, said = choice.strip(), None
    found = _named(columns, base)
    if not found and bracket:
        base, said = bracket["base"].strip(), find_unit(bracket["unit"])
        if said is None:
            raise UnitError(
                f"{sheet.path}: unit {bracket['unit']!r} in {option} {choice!r} is not known: use one such as s, N,"
                " kN, mbar, bar, V, counts, ohm or mm"
            )
        found = _named(columns, base)
        if len(found) > 1:
            found = [i for i in found if _unit_in_file(columns[i]) == said] or found
    if len(found) > 1:
        raise InputError(
            f"{sheet.path}: {option} {choice!r} fits {len(found)} columns: add the unit in brackets, or rename one"
            f" of them (columns: {_titles(sheet)})"
        )
    if not found and base.isascii() and base.isdigit() and 1 <= int(base) <= len(columns):
        found = [int(base) - 1]
    if not found:
        raise MissingChannelError(
            f"{sheet.path} has no column {base!r} for {option}: choose one of its columns ({_titles(sheet)}) by name"
            f" or by number from 1 to {len(columns)}"
        )
    return _united(sheet, found[0], said, option)


def _united(sheet: Sheet, index: int, said: Unit | None, option: str) -> _Pick:
    column = sheet.columns[index]
    of_file = _unit_in_file(column)
    if said is not None and of_file is not None and of_file.quantity != "unknown" and said != of_file:
        raise UnitError(
            f"{sheet.path}: column {column.name!r} is in {of_file.symbol} by the file, {option} says {said.symbol}:"
            " leave the unit out"
        )
    return _Pick(index, said or of_file)


def _need_quantity(sheet: Sheet, pick: _Pick, option: str, quantity: str, example: str) -> Unit:
    column = sheet.columns[pick.index]
    if pick.unit is None:
        raise InputError(
            f"{sheet.path} gives column {column.name!r} no unit: add it in brackets, for example"
            f" {option} '{column.name}[{example}]'"
        )
    if pick.unit.quantity != quantity:
        raise UnitError(
            f"{sheet.path}: column {column.name!r} for {option} is in {pick.unit.symbol}, which is no {quantity}:"
            f" choose a column in a unit such as {example}"
        )
    return pick.unit


# -- time ----------------------------------------------------------------------------------------------------
def _time_column(sheet: Sheet, units: Sequence[Unit | None], choice: str | None) -> _Pick:
    if choice is not None:
        return _pick(sheet, choice, "--time")
    of_time = [i for i, u in enumerate(units) if u is not None and u.quantity == "time"]
    named = [i for i in of_time if sheet.columns[i].name.casefold() in _TIME_NAMES]
    for found in (named[:1], [0] if 0 in of_time else [], of_time if len(of_time) == 1 else []):
        if found:
            return _Pick(found[0], units[found[0]])
    for index, column in enumerate(sheet.columns):
        if units[index] is None and (column.name == "t" or column.name.casefold() in _TIME_NAMES - {"t"}):
            if sheet.format == "labview" and column.name.casefold() == "x_value":
                return _Pick(index, SECOND)  # LabVIEW's X_Dimension is time in seconds unless the file says more
            return _Pick(index, None)
    example = "NAME[s]" if sheet.has_header else "1[ms]"
    raise InputError(
        f"{sheet.path} has no column that is time by its unit: name it, for example --time '{example}'"
        f" (columns: {_titles(sheet)})"
    )


def _seconds(sheet: Sheet, column: Column, in_unit: Unit) -> Array:
    values = column.values
    absent = ~np.isfinite(values)
    if absent.any():
        raise InputError(
            f"{sheet.place(int(np.argmax(absent)))} has no time in column {column.name!r}: give every row a time,"
            " or remove that row"
        )
    if in_unit.scale < 1.0:
        return values / (1.0 / in_unit.scale)  # 11 ms is 0.011 s to the last bit; a product may miss it
    return in_unit.to_si(values)


def _check_increasing(sheet: Sheet, time_s: Array) -> None:
    step = np.diff(time_s)
    if step.size and not (step > 0).all():
        at = int(np.argmax(~(step > 0)))
        fault = "repeats" if step[at] == 0 else "goes back"
        raise InputError(
            f"{sheet.place(at + 1)}: time {fault} ({time_s[at]:.9g} s, then {time_s[at + 1]:.9g} s): remove or"
            " re-time that row"
        )


# -- roles ---------------------------------------------------------------------------------------------------
def roles_of(names: Sequence[str], units: Sequence[Unit | None]) -> list[Role]:
    """The roles that channels have by name and unit alone (the plain table's names first).

    A single channel in a unit of force is the load; names like ``command`` in a unit of force are commands. Named
    sensors (``pressure``, ``left_toe``) are the sensors; where there is none, every channel in a unit of pressure.
    """
    roles: list[Role] = ["auxiliary"] * len(names)
    forces: list[int] = []
    for index, (name, unit_) in enumerate(zip(names, units, strict=True)):
        if name == SENSOR_NAME or name in UNITS_OF_A_SHOE:
            roles[index] = "sensor"
        elif name == COMMAND_NAME or (unit_ is not None and unit_.quantity == "force" and _COMMANDS.search(name)):
            roles[index] = "command"
        elif unit_ is not None and unit_.quantity == "force" and not _ESTIMATE.search(name):
            forces.append(index)
    load = [index for index in forces if names[index] == LOAD_NAME] or forces
    if len(load) == 1:
        roles[load[0]] = "load"
    if "sensor" not in roles:
        for index, unit_ in enumerate(units):
            if unit_ is not None and unit_.quantity == "pressure" and roles[index] == "auxiliary":
                roles[index] = "sensor"
    return roles


def _rename(
    names: list[str], roles: Sequence[Role], units: Sequence[Unit], told: Sequence[bool], has_header: bool
) -> None:
    """Give load, command and a single pressure the plain table's names; those that the file has ``told`` stay."""
    sensors = [i for i, role in enumerate(roles) if role == "sensor"]
    for index, role in enumerate(roles):
        if told[index]:
            continue
        wanted = {"load": LOAD_NAME, "command": COMMAND_NAME}.get(role)
        if role == "sensor":
            if names[index] in UNITS_OF_A_SHOE:
                continue
            if len(sensors) == 1 and units[index].quantity == "pressure":
                wanted = SENSOR_NAME
            elif not has_header:
                wanted = "sensor" if len(sensors) == 1 else f"sensor_{names[index]}"
        if wanted is None or names[index] == wanted:
            continue
        if wanted in names:
            names[names.index(wanted)] = f"{wanted}_other"
        names[index] = wanted


def _unique(names: list[str]) -> list[str]:
    taken: set[str] = set()
    for index, name in enumerate(names):
        candidate, count = name or f"column_{index + 1}", 1
        while candidate in taken:
            count += 1
            candidate = f"{name or 'column'}_{count}"
        taken.add(candidate)
        names[index] = candidate
    return names


def _compression_positive(load: Channel) -> Channel:
    """The load with compression positive where a machine logged it negative."""
    values = load.values[load.present]
    if values.size == 0 or not -values.min() > _NEGATIVE_SHARE * max(values.max(), 0.0):
        return load
    turned = 0.0 - load.values
    turned.flags.writeable = False
    return replace(load, values=turned)


def _channel(sheet: Sheet, name: str, column: Column, unit_: Unit, role: Role, notes: list[str]) -> Channel | None:
    infinite = int(np.count_nonzero(np.isinf(column.values)))
    if infinite:
        notes.append(f"Column {column.name} holds {infinite} infinite samples, which count as missing.")
    channel = Channel.from_values(name, column.values, unit_, role)
    if channel.missing is not None and channel.missing.all():
        if role != "auxiliary":
            raise InputError(
                f"{sheet.place(0)}: every sample of column {column.name!r} is missing from here on: choose another"
                f" column (columns: {_titles(sheet)})"
            )
        notes.append(f"Column {column.name} holds no sample and was left out.")
        return None
    return channel


def recording_from(
    sheet: Sheet,
    *,
    time: str | None = None,
    force: str | None = None,
    sensors: Sequence[str] = (),
    unit: str | None = None,
    name: str | None = None,
) -> Recording:
    """The recording that ``sheet`` holds; the choices are those of `smartshoe.logs.read`.

    Raises `MissingChannelError` for a chosen column that is not there, `UnitError` for a unit of another quantity,
    `InputError` for a unit that is missing, for no rows, and for time that repeats or goes back.
    """
    if not sheet.columns or sheet.columns[0].values.size == 0:
        raise InputError(f"{sheet.path} holds no samples below its header: give a file with data rows")
    units: list[Unit | None] = [_unit_in_file(column) for column in sheet.columns]
    roles: list[Role | None] = [column.role for column in sheet.columns]
    notes = list(sheet.notes)

    time_pick = _time_column(sheet, units, time)
    time_unit = _need_quantity(sheet, time_pick, "--time", "time", "s")
    at_time = time_pick.index
    time_s = _seconds(sheet, sheet.columns[at_time], time_unit)

    chosen: set[int] = set()
    if force is not None:
        pick = _pick(sheet, force, "--force")
        units[pick.index] = _need_quantity(sheet, pick, "--force", "force", "N")
        roles = [None if role == "load" else role for role in roles]
        roles[pick.index] = "load"
        chosen.add(pick.index)
    if sensors:
        roles = [None if role == "sensor" else role for role in roles]
    for choice in sensors:
        pick = _pick(sheet, choice, "--sensor")
        column = sheet.columns[pick.index]
        if pick.unit is None:
            raise InputError(
                f"{sheet.path} gives column {column.name!r} no unit: add it in brackets, for example"
                f" --sensor '{column.name}[mbar]'"
            )
        if pick.index in chosen or pick.index == at_time:
            raise InputError(f"{sheet.path}: column {column.name!r} is chosen twice: choose another for --sensor")
        units[pick.index], roles[pick.index] = pick.unit, "sensor"
        chosen.add(pick.index)

    columns = [i for i in range(len(sheet.columns)) if i != at_time]
    free = [i for i in columns if i not in chosen]
    guessed = roles_of([sheet.columns[i].name for i in free], [units[i] for i in free])
    for index, role in zip(free, guessed, strict=True):
        taken = (role == "load" and "load" in roles) or (role == "sensor" and bool(sensors))
        roles[index] = roles[index] or ("auxiliary" if taken else role)

    names = [sheet.columns[i].name for i in columns]
    final_units = [units[i] or declared("") for i in columns]
    final_roles: list[Role] = [roles[i] or "auxiliary" for i in columns]
    if sheet.format == "bluehill":
        lengths = [i for i, u in enumerate(final_units) if u.quantity == "length"]
        if lengths and final_roles[lengths[0]] == "auxiliary" and "displacement" not in names:
            names[lengths[0]] = "displacement"
    # A plain table's names are the user's own, and so are those in a file that stores roles.
    told = [i not in chosen and (sheet.format == "plain" or sheet.columns[i].role is not None) for i in columns]
    _rename(names, final_roles, final_units, told, sheet.has_header)
    _unique(names)

    keep = slice(None)
    if sheet.format == "bluehill" and time_s.size > 2 and time_s[0] == time_s[1]:
        notes.append(f"The first row, a second one at t = {time_s[0]:g} s, was dropped.")
        keep = slice(1, None)
        sheet = replace(
            sheet,
            first_line=None if sheet.first_line is None else sheet.first_line + 1,
            lines=None if sheet.lines is None else sheet.lines[1:],
        )
    time_s = time_s[keep]
    _check_increasing(sheet, time_s)

    channels: dict[str, Channel] = {}
    for position, index in enumerate(columns):
        column = sheet.columns[index]
        column = replace(column, values=column.values[keep])
        channel = _channel(sheet, names[position], column, final_units[position], final_roles[position], notes)
        if channel is None:
            continue
        if channel.role == "load" and column.role is None and sheet.format in _MACHINE_LOGS:
            turned = _compression_positive(channel)
            if turned is not channel:
                notes.append(f"Column {column.name} logs compression as negative load; its sign was turned.")
                channel = turned
        channels[channel.name] = channel
    return Recording(
        time_s,
        channels,
        name=name or sheet.recording_name or sheet.path.stem,
        unit=unit or sheet.unit_name,
        metadata=sheet.metadata,
        source=str(sheet.path),
        notes=tuple(notes),
    )


__all__ = ["recording_from", "roles_of"]
