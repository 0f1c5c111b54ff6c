"""``smartshoe convert``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from smartshoe.cli._inputs import column_options, read_all

if TYPE_CHECKING:
    from smartshoe.recording import Recording

PLAIN = (".csv", ".txt")
# Units that the plain table can name; for each quantity, others are converted to the first.
WRITABLE_UNITS = {"force": ("N",), "pressure": ("mbar", "Pa", "kPa", "bar"), "length": ("mm",), "temperature": ("°C",)}


@click.command("convert", epilog="Example: smartshoe convert Specimen_RawData_1.csv left_toe.h5")
@click.argument("source")
@click.argument("target")
@column_options
def command(
    source: str, target: str, time: str | None, force: str | None, sensors: tuple[str, ...], unit: str | None
) -> None:
    """Convert SOURCE to TARGET; the target's ending says the format (.csv, .lvm, .tdms, .mat, .h5, .parquet)."""
    from smartshoe.cli._output import progress, require_writable
    from smartshoe.display import counted, first_names
    from smartshoe.files.logs import write

    require_writable(target, read=[source])
    with progress(2) as step:
        step("reading")
        (recording,) = read_all([source], time=time, force=force, sensors=sensors, unit=unit)
        if Path(target).suffix.casefold() in PLAIN:
            recording = in_contract_units(recording)
        step("writing")
        write(recording, target)
    names = first_names([f"{c.name} [{c.unit.symbol}]" for c in recording.channels.values()])
    click.echo(f"{target}: {counted(len(recording), 'sample')} over {recording.duration_s:g} s of {names}")


def in_contract_units(recording: Recording) -> Recording:
    """The recording in the units of the plain table's columns (``force_n``, ``pressure_mbar``, ``displacement_mm``)."""
    from smartshoe.units import find_unit

    for channel in list(recording.channels.values()):
        writable = WRITABLE_UNITS.get(channel.unit.quantity, (channel.unit.symbol,))
        wanted = find_unit(writable[0])
        if channel.unit.symbol in writable or wanted is None:
            continue
        values = channel.unit.convert(channel.values, wanted)
        values.flags.writeable = False
        ranged = channel.range_ and tuple(channel.unit.convert(list(channel.range_), wanted).tolist())
        resolution = channel.resolution and channel.resolution * channel.unit.scale / wanted.scale
        recording = recording.with_channel(
            replace(channel, values=values, unit=wanted, range_=ranged, resolution=resolution)
        )
    return recording
