"""``smartshoe identify``."""

from __future__ import annotations

import click

from smartshoe.cli.inputs import column_options, read_all


@click.command(
    "identify",
    epilog="Example: smartshoe identify left_toe_dynamic.csv --calibration left_toe.json",
)
@click.argument("files", nargs=-1, required=True)
@click.option(
    "--direction",
    type=click.Choice(["inverse", "forward"]),
    default="inverse",
    show_default=True,
    help="Which signal's error is minimised: the load's (inverse) or the reading's (forward).",
)
@click.option(
    "--method",
    type=click.Choice(["srivc", "gn", "lm", "trf"]),
    default="trf",
    show_default=True,
    help="SRIVC alone, or SRIVC then Gauss-Newton, Levenberg-Marquardt or trust region reflective.",
)
@click.option(
    "--structure",
    type=click.Choice(["free", "grey_box"]),
    default="free",
    show_default=True,
    help="a1, b0 and b1 free, or k1 and k2 with c = 1 as in the paper.",
)
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
@click.option("--calibration", "calibration_path", metavar="OUT.json", help="Write a calibration for compensate.")
@column_options
def command(
    files: tuple[str, ...],
    direction: str,
    method: str,
    structure: str,
    json_path: str | None,
    calibration_path: str | None,
    time: str | None,
    force: str | None,
    sensors: tuple[str, ...],
    unit: str | None,
) -> None:
    """Identify one unit from one or more experiments (one FILE each)."""
    from smartshoe.cli.output import emit_json
    from smartshoe.identification import identify
    from smartshoe.report.tables import print_identification

    recordings = read_all(files, time=time, force=force, sensors=sensors, unit=unit)
    found = identify(recordings, direction=direction, method=method, structure=structure)  # type: ignore[arg-type]
    if calibration_path is not None:
        import datetime

        today = datetime.datetime.now(datetime.UTC).date().isoformat()
        found.calibration(created=today).save(calibration_path)
    result = found.to_dict()
    if not emit_json(result, json_path):
        print_identification(result)
        if calibration_path is not None:
            click.echo(f"calibration: {calibration_path}")
