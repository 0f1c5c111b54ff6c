"""``smartshoe export``."""

from __future__ import annotations

import click


@click.command(
    "export",
    epilog="Example: smartshoe export left_toe.json left_heel.json --to c --precision float --out firmware",
)
@click.argument("calibration_paths", metavar="C.json...", nargs=-1, required=True)
@click.option("--to", "target", required=True, metavar="c/matlab/json/fmu", help="What to write the filter as.")
@click.option("--out", "folder", required=True, metavar="DIR", help="Folder of the files; made where it is missing.")
@click.option("--name", "names", multiple=True, metavar="NAME",
              help="Of files and symbols. Default: smartshoe_filter, of several calibrations their units' names; "
              "of several, give it once for each, or once to go before the units' names.")  # fmt: skip
@click.option("--sample-rate", "sample_rate_hz", type=float, metavar="HZ", help="Default: the calibration's own.")
@click.option("--precision", default="double", show_default=True, metavar="double/float", help="Of the C code.")
@click.option("--fixed", metavar="q15/q31", help="C in integers of 16 or 32 bits in place of floating point.")
@click.option("--twin", is_flag=True, help="The unit itself, load in and reading out, with --to fmu.")
@click.option("--force", is_flag=True, help="Overwrite files that are there.")
def command(
    calibration_paths: tuple[str, ...],
    target: str,
    folder: str,
    names: tuple[str, ...],
    sample_rate_hz: float | None,
    precision: str,
    fixed: str | None,
    twin: bool,
    force: bool,
) -> None:
    """Write the compensators of calibrations (files, or folders of them) for firmware or other tools."""
    from smartshoe.calibration.export import export_shoe, export_twins, write_files
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.cli._output import require_writable

    require_writable(folder=folder)
    calibrations = load_calibrations(calibration_paths)
    if twin and target != "fmu":
        raise click.UsageError(f"--twin is for --to fmu, not for {target}: leave it away")
    if twin:
        files = export_twins(calibrations, sample_rate_hz=sample_rate_hz, names=names)
    else:
        files = export_shoe(
            calibrations, target, sample_rate_hz=sample_rate_hz, precision=precision, fixed=fixed, names=names
        )
    paths = write_files(files, folder, force=force)
    for calibration in calibrations:
        rate_hz = calibration.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
        ways = ("N", calibration.reading_unit.symbol) if twin else (calibration.reading_unit.symbol, "N")
        click.echo(f"{calibration.unit or 'unnamed unit'}: {' to '.join(ways)} at {rate_hz:g} Hz")
    width = max(len(str(path)) for path in paths)
    for path in paths:
        click.echo(f"  {path!s:<{width}}  {path.stat().st_size:>7} bytes")
