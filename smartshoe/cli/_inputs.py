"""Reads the input files of commands, with the options that choose their columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import click

from smartshoe.cli._output import warn
from smartshoe.recording import UNITS_OF_A_SHOE, Channel, Recording

MISSING_SHARE = 0.05  # of a signal's samples: more missing ones are reported

_F = TypeVar("_F", bound=Callable[..., Any])


def column_options(command: _F) -> _F:
    """Add the options --time, --force, --sensor and --unit to a command."""
    for decorate in (
        click.option("--unit", metavar="NAME", help="The sensing unit's name, for example left_toe."),
        click.option(
            "--sensor",
            "sensors",
            multiple=True,
            metavar="COLUMN",
            help="A sensor's column (repeatable): '6[bar]'.",
        ),
        click.option(
            "--force",
            metavar="COLUMN",
            help="The reference load's column: '7[N]', 'Load[kN]'; '-7[N]' where compression is negative.",
        ),
        click.option(
            "--time",
            metavar="COLUMN",
            help="The time column, by name or 1-based number, with its unit: '1[ms]'; 'rows[49Hz]' for none.",
        ),
    ):
        command = decorate(command)
    return command


def read_all(
    files: Sequence[str], *, time: str | None, force: str | None, sensors: Sequence[str], unit: str | None
) -> list[Recording]:
    """Every experiment as a recording; a machine's log and a data logger's are joined. Prints notes to stderr."""
    from smartshoe.cli._output import show_notes
    from smartshoe.devices.joining import join_pairs
    from smartshoe.errors import MissingChannelError
    from smartshoe.files.logs import read

    def one(file: str) -> Recording:
        try:
            return read(file, time=time, force=force, sensors=list(sensors), unit=unit)
        except MissingChannelError:
            if len(files) == 1:
                raise
            # One of two logs of a test may contain only the load, or only the reading.
            half = read(file, time=time, force=force, sensors=list(sensors), unit=unit, partly=True)
            if bool(half.of_role("load")) == bool(half.sensors):
                raise
            return half

    recordings = join_pairs([one(file) for file in _each_once(files)])
    show_notes(recordings)
    say_what_strikes(recordings)
    return recordings


def _each_once(files: Sequence[str]) -> list[str]:
    """``files`` without repetitions, since the same samples are not independent evidence."""
    found: dict[Path, str] = {}
    for file in files:
        place = Path(file).resolve()
        if place in found:
            warn(f"{file} is named twice and counts once")
        found.setdefault(place, file)
    return list(found.values())


def say_what_strikes(recordings: Sequence[Recording]) -> None:
    """Warn on stderr for each load that looks negated, and for each signal that lacks many of its samples."""
    from smartshoe.files.logs.columns import is_negative

    for recording in recordings:
        for channel in recording.loads_and_sensors:
            share = 0.0 if channel.missing is None else float(channel.missing.mean())
            if share > MISSING_SHARE:
                lacks = f"{recording.label} lacks {100 * share:.0f} % of the samples of {channel.name}"
                warn(f"{lacks}: in fits they do not count")
            if channel.role == "load" and is_negative(channel):
                low, high = channel.values.min(), channel.values.max()
                warn(
                    f"the load of {recording.label} goes from {low:.4g} to {high:.4g} {channel.unit.symbol}:"
                    " compression is positive here, so turn its sign if it presses, by a minus before its column's name"
                    " (--force '-COLUMN')"
                )


def units_of(choices: Sequence[str]) -> dict[str, str]:
    """Choices ``UNIT=COLUMN`` as columns by unit; raises `UsageError` for a unit that no shoe has."""
    from smartshoe.errors import UsageError

    found: dict[str, str] = {}
    for choice in choices:
        unit, _, column = choice.partition("=")
        if unit not in UNITS_OF_A_SHOE or not column:
            raise UsageError(f"--sensor {choice!r} names no unit and column: write it like left_heel='L_force'")
        found[unit] = column
    return found


def with_units(recording: Recording, columns: Mapping[str, str]) -> Recording:
    """The recording with the named columns as the units' readings; a column may have its unit in brackets.

    Raises `MissingChannelError` for a missing column, `UnitError` for an unknown unit or one that is not the file's.
    """
    for unit, column in columns.items():
        channel = _channel_of(recording, column, unit)
        recording = recording.without(channel.name).with_channel(replace(channel, name=unit, role="sensor"))
    return recording


def _channel_of(recording: Recording, column: str, unit: str) -> Channel:
    """The channel that ``column`` names; its unit is that in brackets where the file gives none."""
    from smartshoe.display import first_names
    from smartshoe.errors import MissingChannelError, UnitError
    from smartshoe.units import find_unit

    if column in recording.channels:
        return recording.channels[column]
    base, _, symbol = (part.strip() for part in column.removesuffix("]").partition("["))
    channel = recording.channels.get(base)
    if channel is None:
        names = first_names(list(recording.channels))
        raise MissingChannelError(f"{recording.label} has no column {base!r} for {unit}; it has {names}")
    said = find_unit(symbol)
    if said is None:
        raise UnitError(f"unit {symbol!r} in --sensor {unit}={column!r} is not known: use one such as N, kPa or mbar")
    if channel.unit.quantity != "unknown" and channel.unit != said:
        raise UnitError(
            f"{recording.label}: column {base!r} is in {channel.unit.symbol} by the file, --sensor says {said.symbol}:"
            " leave the unit out"
        )
    return replace(channel, unit=said)
