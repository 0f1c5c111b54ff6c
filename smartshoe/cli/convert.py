"""``smartshoe convert``."""

from __future__ import annotations

import click

from smartshoe.cli.inputs import column_options, read_all


@click.command("convert", epilog="Example: smartshoe convert Specimen_RawData_1.csv left_toe.h5")
@click.argument("source")
@click.argument("target")
@column_options
def command(
    source: str, target: str, time: str | None, force: str | None, sensors: tuple[str, ...], unit: str | None
) -> None:
    """Convert SOURCE to TARGET; the target's ending says the format (.csv, .lvm, .tdms, .mat, .h5, .parquet)."""
    from smartshoe.logs import write

    (recording,) = read_all([source], time=time, force=force, sensors=sensors, unit=unit)
    write(recording, target)
    names = ", ".join(f"{c.name} [{c.unit.symbol}]" for c in recording.channels.values())
    click.echo(f"{target}: {len(recording)} samples over {recording.duration_s:g} s of {names}")
