"""``smartshoe compensate``."""

from __future__ import annotations

import click

from smartshoe.cli._cautions import warn_of_a_past, warn_of_another_unit, warn_of_forces_beyond
from smartshoe.cli._inputs import column_options, read_all


@click.command(
    "compensate",
    epilog="Example: smartshoe compensate walk.csv --calibration left_toe.json --out walk_force.csv",
)
@click.argument("file")
@click.option("--calibration", "calibration_path", required=True, metavar="C.json", help="From identify.")
@click.option("--out", "out_path", metavar="OUT.csv", help="Write the recording with force_estimate_n added.")
@column_options
def command(
    file: str,
    calibration_path: str,
    out_path: str | None,
    time: str | None,
    force: str | None,
    sensors: tuple[str, ...],
    unit: str | None,
) -> None:
    """Force from the pressure in FILE, by a calibration."""
    from smartshoe.cli._output import note, progress, require_writable

    require_writable(out_path, read=[file, calibration_path])
    with progress(2 + (out_path is not None)) as step:
        step("reading")
        from smartshoe.calibration import Calibration, compensated
        from smartshoe.files.logs import write

        calibration = Calibration.load(calibration_path)
        (recording,) = read_all([file], time=time, force=force, sensors=sensors, unit=unit)
        warn_of_another_unit([recording], calibration)
        warn_of_a_past([recording], calibration)
        step("filtering")
        result = compensated(recording, calibration)
        if out_path is not None:
            step("writing")
            write(result, out_path)
    for said in result.notes[len(recording.notes) :]:
        note(said)
    estimate_n = result["force_estimate"].si
    warn_of_forces_beyond(result.label, result.time_s, estimate_n, calibration)
    click.echo(
        f"{result.label}: {len(result)} samples, force {estimate_n.min():.1f} to {estimate_n.max():.1f} N,"
        f" mean {estimate_n.mean():.1f} N" + (f"; written to {out_path}" if out_path else "; --out keeps them")
    )
