"""The options by which any command learns which columns of a file are what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from smartshoe.cli._output import warn
from smartshoe.recording import UNITS_OF_A_SHOE, Channel, Recording

if TYPE_CHECKING:
    from smartshoe.arrays import Array
    from smartshoe.calibration import Calibration

MISSING_SHARE = 0.05  # of a signal's samples, from which on it is reported
BEYOND = 1.1  # of the largest load that a calibration has seen
FASTER = 2.0  # than the fastest loading that it has seen
OFF_SHARE, OFF_TIMES = 0.05, 2.0  # of the largest load, and times what the fit left: more is worth a warning

_F = TypeVar("_F", bound=Callable[..., Any])


def column_options(command: _F) -> _F:
    """Add --time, --force, --sensor and --unit."""
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
    """Every experiment as a recording; a machine's log and a data logger's are joined. Notes go to stderr."""
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
            # One of two logs of a test may hold the load only, or the reading only.
            half = read(file, time=time, force=force, sensors=list(sensors), unit=unit, partly=True)
            if bool(half.of_role("load")) == bool(half.sensors):
                raise
            return half

    recordings = join_pairs([one(file) for file in _each_once(files)])
    show_notes(recordings)
    say_what_strikes(recordings)
    return recordings


def _each_once(files: Sequence[str]) -> list[str]:
    """``files`` without those named twice: the same samples again would be evidence that is not there."""
    found: dict[Path, str] = {}
    for file in files:
        place = Path(file).resolve()
        if place in found:
            warn(f"{file} is named twice and counts once")
        found.setdefault(place, file)
    return list(found.values())


def say_what_strikes(recordings: Sequence[Recording]) -> None:
    """A warning on stderr for each load that looks negated, and for each signal that lacks much of its samples."""
    from smartshoe.files.logs.columns import is_negative

    for recording in recordings:
        for channel in recording.loads_and_sensors:
            share = 0.0 if channel.missing is None else float(channel.missing.mean())
            if share > MISSING_SHARE:
                warn(f"{recording.label} lacks {100 * share:.0f} % of the samples of {channel.name}: they are left out")
            if channel.role == "load" and is_negative(channel):
                low, high = channel.values.min(), channel.values.max()
                warn(
                    f"the load of {recording.label} goes from {low:.4g} to {high:.4g} {channel.unit.symbol}:"
                    " compression is positive here, so turn its sign if it presses, by a minus before its column's name"
                    " (--force '-COLUMN')"
                )


def units_of(choices: Sequence[str]) -> dict[str, str]:
    """``UNIT=COLUMN`` choices as columns by unit; raises `UsageError` for a unit that no shoe has."""
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

    Raises `MissingChannelError` for one not there, `UnitError` for a unit that is not known or not the file's.
    """
    for unit, column in columns.items():
        channel = _channel_of(recording, column, unit)
        recording = recording.without(channel.name).with_channel(replace(channel, name=unit, role="sensor"))
    return recording


def _channel_of(recording: Recording, column: str, unit: str) -> Channel:
    """The channel that ``column`` names, in the unit that stands in brackets where the file gives none."""
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


def warn_of_a_past(recordings: Sequence[Recording], calibration: Calibration) -> None:
    """A warning on stderr for each recording that carries on from another, where the calibration has effects."""
    for recording in recordings:
        earlier = recording.metadata.get("continues")
        if earlier is not None and calibration.extended is not None:
            warn(
                f"{recording.label} continues {earlier}: the filter begins as after a rest, without what"
                " drift, set, softening and leak had done by then (join the two files to carry it over)"
            )


def warn_of_another_unit(recordings: Sequence[Recording], calibration: Calibration) -> None:
    """A warning on stderr for each recording that says it is of another unit, or whose load passes what was seen."""
    for recording in recordings:
        if recording.unit and calibration.unit and recording.unit != calibration.unit:
            warn(
                f"{recording.label} is of unit {recording.unit}, the calibration of {calibration.unit}: its"
                " forces mean nothing; give that unit's own calibration"
            )
    seen = calibration.load_range_n
    for recording in recordings:
        loads = recording.of_role("load")
        if seen is None or not loads:
            continue
        top_n = float(loads[0].si.max())
        if top_n > BEYOND * seen[1]:
            warn(
                f"{recording.label} is loaded to {top_n:.0f} N, the calibration has seen {seen[1]:.0f} N:"
                " the rest is extrapolated"
            )


def warn_of_forces_beyond(label: str, time_s: Array, force_n: Array, calibration: Calibration) -> None:
    """A warning on stderr where the forces (n,) that a calibration gave pass the loads, or the rates, it has seen."""
    from smartshoe.signals.loading import rate_range

    seen, top_n = calibration.load_range_n, float(force_n.max(initial=0.0))
    if seen is not None and top_n > BEYOND * seen[1]:
        warn(
            f"{label} comes to {top_n:.0f} N, the calibration has seen {seen[1]:.0f} N: the rest is"
            " extrapolated, or the calibration is another unit's"
        )
    rates, fastest = calibration.rate_range_n_per_s, rate_range([(time_s, force_n)])[1]
    if rates is not None and fastest > FASTER * rates[1] > 0.0:
        warn(
            f"{label} rises by {fastest:.0f} N/s, the calibration has seen {rates[1]:.0f} N/s: what the unit does at"
            " such rates is extrapolated (calibrate with triangles as fast)"
        )


def warn_of_use_from_rest(recordings: Sequence[Recording], calibration: Calibration, told_n: float) -> None:
    """A warning on stderr where a calibration is far off on the very recordings that it was fitted to.

    It begins each in a steady state and takes one zero for all, which a fit does not: where a unit leaks or drifts, a
    zero far off and a past that takes it back may fit best. ``told_n``: rms error in N by the fit, NaN where unknown.
    """
    import numpy as np

    from smartshoe.calibration import compensated

    off_n = [
        float(np.sqrt(np.mean((compensated(one, calibration)["force_estimate"].si - one.force_n) ** 2)))
        for one in recordings
    ]
    worst = max(range(len(recordings)), key=off_n.__getitem__)
    least_n = OFF_SHARE * float(np.max(np.abs(recordings[worst].force_n)))
    if off_n[worst] > max(least_n, 0.0 if np.isnan(told_n) else OFF_TIMES * told_n):
        warn(
            f"from rest and with one zero, as it is used, the calibration is off by {off_n[worst]:.0f} N (rms) on"
            f" {recordings[worst].label}: the unit does what no standard linear solid does, such as a leak or a drift"
            " (smartshoe diagnose says what, and makes a calibration of it)"
        )
