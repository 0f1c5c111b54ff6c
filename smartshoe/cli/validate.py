"""``smartshoe validate``."""

from __future__ import annotations

import click

from smartshoe.cli._cautions import warn_of_a_past, warn_of_another_unit
from smartshoe.cli._inputs import column_options, read_all


@click.command(
    "validate",
    epilog="Example: smartshoe validate left_toe_check.csv --calibration left_toe.json",
)
@click.argument("files", nargs=-1, required=True)
@click.option("--calibration", "calibration_path", required=True, metavar="C.json", help="From identify.")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
@column_options
def command(
    files: tuple[str, ...],
    calibration_path: str,
    json_path: str | None,
    time: str | None,
    force: str | None,
    sensors: tuple[str, ...],
    unit: str | None,
) -> None:
    """Judge a calibration on recordings: errors raw, after the best static gain, and compensated, per rate."""
    from smartshoe.cli._output import emit_json, progress, require_writable

    require_writable(json_path=json_path, read=(*files, calibration_path))
    with progress(2) as step:
        step("reading")
        from smartshoe.calibration import Calibration
        from smartshoe.calibration.validation import validate
        from smartshoe.report.tables import print_validation

        calibration = Calibration.load(calibration_path)
        recordings = read_all(files, time=time, force=force, sensors=sensors, unit=unit)
        warn_of_another_unit(recordings, calibration)
        warn_of_a_past(recordings, calibration)
        step("judging")
        result = validate(recordings, calibration).to_dict()
    if not emit_json(result, json_path):
        print_validation(result, is_diagnosed=calibration.extended is not None)
