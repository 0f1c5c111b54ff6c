"""Turns a sheet's columns into a recording's channels: decides which column is time, load or sensor."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from smartshoe.display import counted
from smartshoe.errors import InputError
from smartshoe.files.logs._sheet import Column, Sheet
from smartshoe.files.logs._times import check_increasing, counts_rows, time_of
from smartshoe.files.logs.picks import (
    Pick,
    names_a_column,
    need_quantity,
    need_unit,
    pick,
    stands_for_a_load,
    titles,
    unit_in_file,
)
from smartshoe.recording import (
    COMMAND_NAME,
    LOAD_NAME,
    SENSOR_NAME,
    TIME_NAME,
    UNITS_OF_A_SHOE,
    Channel,
    Recording,
    Role,
    only_reading,
)
from smartshoe.units import Unit, declared, on_one_cm2

_COMMANDS = re.compile(r"command(ed)?|demand|set[ _-]?point|target|soll(wert)?", re.IGNORECASE)
_ESTIMATE = re.compile(r"estimate", re.IGNORECASE)
_MACHINE_LOGS = frozenset({"bluehill", "labview", "tdms"})  # formats of testing machines and their loggers
_NEGATIVE_SHARE = 5.0  # a load that goes this many times further below zero than above is negated compression


def roles_of(names: Sequence[str], units: Sequence[Unit | None]) -> list[Role]:
    """The roles that follow from the channels' names and units alone (the plain table's names take precedence).

    A single channel in a unit of force is the load; names like ``command`` in a unit of force are commands. Named
    sensors (``pressure``, ``left_toe``) are the sensors, except for neighbours of a ``pressure``; without named ones,
    every channel in a unit of pressure is a sensor.
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
    if SENSOR_NAME in names:  # the unit under test; other named sensors of the shoe are its neighbours
        roles = [
            "auxiliary" if role == "sensor" and name != SENSOR_NAME else role
            for name, role in zip(names, roles, strict=True)
        ]
    load = [index for index in forces if names[index] == LOAD_NAME] or forces
    if len(load) == 1:
        roles[load[0]] = "load"
    if "sensor" not in roles:
        for index, unit_ in enumerate(units):
            if unit_ is not None and unit_.quantity == "pressure" and roles[index] == "auxiliary":
                roles[index] = "sensor"
    return roles


def _rename(
    names: list[str], roles: Sequence[Role], units: Sequence[Unit], is_declared: Sequence[bool], has_header: bool
) -> None:
    """Give load, command and a single pressure the plain table's names.

    Keep a name that ``is_declared`` by the file.
    """
    sensors = [i for i, role in enumerate(roles) if role == "sensor"]
    for index, role in enumerate(roles):
        if is_declared[index]:
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
    # "time" is reserved for the time base: a time column that was not chosen gets another name.
    taken: set[str] = {TIME_NAME}
    counts: Counter[str] = Counter()
    for index, name in enumerate(names):
        candidate = "time_other" if name == TIME_NAME else name or f"column_{index + 1}"
        while candidate in taken:
            counts[name] += 1
            candidate = f"{name or 'column'}_{counts[name] + 1}"
        taken.add(candidate)
        names[index] = candidate
    return names


def is_negative(load: Channel) -> bool:
    """Whether the load goes far below zero and hardly above it: compression that was logged as negative."""
    values = load.values[load.present]
    return bool(values.size and -values.min() > _NEGATIVE_SHARE * max(values.max(), 0.0))


def _turned(load: Channel) -> Channel:
    turned = 0.0 - load.values
    turned.flags.writeable = False
    return replace(load, values=turned)


def _channel(sheet: Sheet, name: str, column: Column, unit_: Unit, role: Role, notes: list[str]) -> Channel | None:
    infinite = int(np.count_nonzero(np.isinf(column.values)))
    if infinite:
        notes.append(f"Column {column.name} holds {counted(infinite, 'infinite sample')}, taken as missing.")
    channel = Channel.from_values(name, column.values, unit_, role)
    if channel.missing is not None and channel.missing.all():
        if role != "auxiliary":
            raise InputError(
                f"{sheet.place(0)}: every sample of column {column.name!r} is missing from here on: choose another"
                f" column (columns: {titles(sheet)})"
            )
        notes.append(f"Column {column.name} holds no sample and was left out.")
        return None
    return channel


@dataclass(eq=False)
class _Assignment:
    """The assignment of columns: ``units`` and ``roles`` by column, and the ``chosen`` ones that the user named."""

    sheet: Sheet
    units: list[Unit | None]
    roles: list[Role | None]
    notes: list[str]
    chosen: set[int] = field(default_factory=set)
    is_turned: bool = False
    is_pressed_all_over: bool = False

    def choose_load(self, force: str) -> None:
        """Make the column that the user names the reference load; a minus before the name reverses its sign."""
        self.is_turned = force.startswith("-") and not names_a_column(self.sheet, force)
        force = force[1:] if self.is_turned else force
        found = pick(self.sheet, force, "--force")
        in_unit = need_unit(self.sheet, found, "--force", "N")
        of_file = unit_in_file(self.sheet.columns[found.index])
        if of_file is not None and stands_for_a_load(of_file, in_unit, "--force"):
            self.notes.append(
                f"Column {self.sheet.columns[found.index].name} is in {of_file.symbol} by the file: its numbers are"
                f" taken for {in_unit.symbol}, as --force says."
            )
        if in_unit.quantity == "pressure":
            name = self.sheet.columns[found.index].name
            self.notes.append(f"Column {name} is a pressure: as the load it is taken for the force on 1 cm².")
            found, self.is_pressed_all_over = Pick(found.index, on_one_cm2(in_unit)), True
        self.units[found.index] = need_quantity(self.sheet, found, "--force", "force", "N")
        self._take(found.index, "load")

    def choose_sensors(self, sensors: Sequence[str], at_time: int | None) -> None:
        """Make the columns that the user names the readings, and no others."""
        self.roles = [None if role == "sensor" else role for role in self.roles]
        for choice in sensors:
            found = pick(self.sheet, choice, "--sensor")
            name = self.sheet.columns[found.index].name
            if found.index in self.chosen or found.index == at_time:
                raise InputError(f"{self.sheet.path}: column {name!r} is chosen twice: choose another for --sensor")
            in_unit = need_unit(self.sheet, found, "--sensor", "mbar")
            self.units[found.index] = in_unit
            self.roles[found.index] = "sensor"
            self.chosen.add(found.index)
            if self.is_pressed_all_over and in_unit.quantity == "force":
                self.notes.append(
                    f"Column {name}, a force, is the reading, and the load a pressure: exchange --force and --sensor if"
                    " it is the other way round."
                )

    def _take(self, index: int, role: Role) -> None:
        self.roles = [None if each == role else each for each in self.roles]
        self.roles[index] = role
        self.chosen.add(index)

    def tell_the_rest(self, columns: Sequence[int], *, sensors_chosen: bool) -> None:
        """Assign roles to the columns that the user did not name, by their names and units."""
        free = [index for index in columns if index not in self.chosen]
        guessed = roles_of([self.sheet.columns[i].name for i in free], [self.units[i] for i in free])
        for index, role in zip(free, guessed, strict=True):
            taken = (role == "load" and "load" in self.roles) or (role == "sensor" and sensors_chosen)
            self.roles[index] = self.roles[index] or ("auxiliary" if taken else role)
        only = only_reading([self.roles[index] for index in columns], [self.units[index] for index in columns])
        if only is not None and not sensors_chosen:
            column = self.sheet.columns[columns[only]]
            if column.role is None and np.isfinite(column.values).any():
                self.roles[columns[only]] = "sensor"
                self.notes.append(f"Column {column.name}, the only one beside the load, is the reading.")

    def names(self, columns: Sequence[int]) -> list[str]:
        """The channels' names: the plain table's for load, command and reading, unless the file's own are kept."""
        sheet = self.sheet
        names = [sheet.columns[index].name for index in columns]
        units = [self.units[index] or declared("") for index in columns]
        roles: list[Role] = [self.roles[index] or "auxiliary" for index in columns]
        if sheet.format == "bluehill":
            lengths = [at for at, unit_ in enumerate(units) if unit_.quantity == "length"]
            if lengths and roles[lengths[0]] == "auxiliary" and "displacement" not in names:
                names[lengths[0]] = "displacement"
        # The names in a plain table, and in a file that stores roles, are the user's own.
        is_declared = [
            index not in self.chosen and (sheet.format == "plain" or sheet.columns[index].role is not None)
            for index in columns
        ]
        _rename(names, roles, units, is_declared, sheet.has_header)
        return _unique(names)

    def channels(self, columns: Sequence[int], names: Sequence[str]) -> dict[str, Channel]:
        """The channels by name; a load that a machine logged as negative is negated."""
        channels: dict[str, Channel] = {}
        for index, name in zip(columns, names, strict=True):
            column = self.sheet.columns[index]
            unit_, role = self.units[index] or declared(""), self.roles[index] or "auxiliary"
            channel = _channel(self.sheet, name, column, unit_, role, self.notes)
            if channel is None:
                continue
            if channel.role == "load":
                channel = self._signed(channel, column)
            channels[channel.name] = channel
        return channels

    def _signed(self, load: Channel, column: Column) -> Channel:
        """The load with compression positive, negated where the user or the machine's format says so."""
        if self.is_turned:
            return _turned(load)
        if column.role is None and self.sheet.format in _MACHINE_LOGS and is_negative(load):
            self.notes.append(f"Column {column.name} logs compression as negative load; its sign was turned.")
            return _turned(load)
        return load


def _without_first_row(sheet: Sheet) -> Sheet:
    return replace(
        sheet,
        columns=[replace(column, values=column.values[1:]) for column in sheet.columns],
        first_line=None if sheet.first_line is None else sheet.first_line + 1,
        lines=None if sheet.lines is None else sheet.lines[1:],
    )


def recording_from(
    sheet: Sheet,
    *,
    time: str | None = None,
    force: str | None = None,
    sensors: Sequence[str] = (),
    unit: str | None = None,
    name: str | None = None,
    partly: bool = False,
) -> Recording:
    """The recording in ``sheet``; the choices are those of `smartshoe.files.logs.read`.

    Raises `MissingChannelError` for a chosen column that does not exist, `UnitError` for a unit of another quantity,
    `InputError` for a missing unit, for no rows, and for time that repeats or decreases.
    """
    if not sheet.columns or sheet.columns[0].values.size == 0:
        raise InputError(f"{sheet.path} holds no samples below its header: give a file with data rows")
    sensors_chosen = bool(sensors)
    if partly:
        time = time if time and (counts_rows(time) or names_a_column(sheet, time)) else None
        force = force if force and names_a_column(sheet, force.removeprefix("-")) else None
        sensors = [choice for choice in sensors if names_a_column(sheet, choice)]
    units = [unit_in_file(column) for column in sheet.columns]
    at_time, time_s = time_of(sheet, units, time)

    notes = list(sheet.notes)
    if sheet.format == "bluehill" and time_s.size > 2 and time_s[0] == time_s[1]:
        notes.append(f"The first row, a second one at t = {time_s[0]:g} s, was dropped.")
        sheet, time_s = _without_first_row(sheet), time_s[1:]
    check_increasing(sheet, time_s)

    assigned = _Assignment(sheet, units, [column.role for column in sheet.columns], notes)
    if force is not None:
        assigned.choose_load(force)
    if sensors:
        assigned.choose_sensors(sensors, at_time)
    columns = [index for index in range(len(sheet.columns)) if index != at_time]
    assigned.tell_the_rest(columns, sensors_chosen=sensors_chosen)
    channels = assigned.channels(columns, assigned.names(columns))
    return Recording(
        time_s,
        channels,
        name=name or sheet.recording_name or sheet.path.stem,
        unit=unit or sheet.unit_name,
        metadata=sheet.metadata,
        source=str(sheet.path),
        notes=tuple(notes),
    )


__all__ = ["is_negative", "recording_from", "roles_of"]
