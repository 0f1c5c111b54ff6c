"""``smartshoe export``."""

from __future__ import annotations

import click


@click.command(
    "export",
    epilog="Example: smartshoe export left_toe.json --to c --precision float --out firmware",
)
@click.argument("calibration_path", metavar="C.json")
@click.option("--to", "target", required=True, metavar="c/matlab/json", help="What to write the filter as.")
@click.option("--out", "folder", required=True, metavar="DIR", help="Folder of the files; made where it is missing.")
@click.option("--sample-rate", "sample_rate_hz", type=float, metavar="HZ", help="Default: the calibration's own.")
@click.option("--precision", default="double", show_default=True, metavar="double/float", help="Of the C code.")
def command(calibration_path: str, target: str, folder: str, sample_rate_hz: float | None, precision: str) -> None:
    """Write the compensator of a calibration for firmware or other tools."""
    from smartshoe.compensation import Calibration
    from smartshoe.compensation.export import export_files, write_files

    calibration = Calibration.load(calibration_path)
    files = export_files(calibration, target, sample_rate_hz=sample_rate_hz, precision=precision)
    paths = write_files(files, folder)
    rate_hz = calibration.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
    click.echo(f"{calibration.unit or 'unnamed unit'}: {calibration.reading_unit.symbol} to N at {rate_hz:g} Hz")
    width = max(len(str(path)) for path in paths)
    for path in paths:
        click.echo(f"  {path!s:<{width}}  {path.stat().st_size:>7} bytes")
