"""``smartshoe identify``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from smartshoe.cli._cautions import warn_of_use_from_rest
from smartshoe.cli._inputs import column_options, read_all
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from smartshoe.identification import Identification
    from smartshoe.recording import Recording


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
    help="a1, b0 and b1 free, or k1 and k2 with c = 1 as in the paper (see --fix, --bound).",
)
@click.option(
    "--estimator",
    type=click.Choice(["auto", "output_error", "errors_in_variables", "command", "cycles"]),
    default="auto",
    show_default=True,
    help="Whose noise is allowed for: auto goes beyond the output's where the input's would bias the result.",
)
@click.option("--offset", metavar="READING", help="Fix the reading at no load (default: estimated).")
@click.option(
    "--delay", metavar="SECONDS", help="Fix the delay, reading later than load positive (default: estimated)."
)
@click.option(
    "--initial-state",
    type=click.Choice(["estimate", "steady"]),
    default="estimate",
    show_default=True,
    help="Estimate each experiment's start, or start in the steady state of its first reading.",
)
@click.option("--fix", "fixed", multiple=True, metavar="NAME=VALUE", help="Grey box: fix k1, k2, c or x_over_nrt.")
@click.option("--bound", "bounds", multiple=True, metavar="NAME=LOW:HIGH", help="Grey box: keep a parameter within.")
@click.option(
    "--checks",
    is_flag=True,
    help="Also fit without each loading rate, and test what repeats over cycles for lack of fit.",
)
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
@click.option("--calibration", "calibration_path", metavar="OUT.json", help="Write a calibration for compensate.")
@column_options
def command(
    files: tuple[str, ...],
    json_path: str | None,
    calibration_path: str | None,
    time: str | None,
    force: str | None,
    sensors: tuple[str, ...],
    unit: str | None,
    offset: str | None,
    delay: str | None,
    fixed: tuple[str, ...],
    bounds: tuple[str, ...],
    checks: bool,
    **choices: Any,
) -> None:
    """Identify one unit from one or more experiments (one FILE each)."""
    from smartshoe.cli._output import emit_json, progress, require_writable
    from smartshoe.report.tables import print_identification

    require_writable(calibration_path, json_path=json_path, read=files)
    options: dict[str, Any] = {
        "offset": "estimate" if offset is None else _number("--offset", offset),
        "delay": "estimate" if delay is None else _number("--delay", delay),
        "fixed": dict(_named("--fix", text) for text in fixed) or None,
        "bounds": {
            name: _range("--bound", name, limits) for name, limits in (_split("--bound", text) for text in bounds)
        },
        **choices,
    }
    with progress(2 + 2 * checks) as step:
        step("reading")
        from smartshoe.identification import identify

        recordings = read_all(files, time=time, force=force, sensors=sensors, unit=unit)
        step("fitting")
        found = identify(recordings, **options)
        result = found.to_dict()
        if checks:
            result |= _checks(found, recordings, options, step)
    if calibration_path is not None:
        import datetime

        today = datetime.datetime.now(datetime.UTC).date().isoformat()
        calibration = found.calibration(created=today)
        calibration.save(calibration_path)
        warn_of_use_from_rest(recordings, calibration, found.rmse if found.direction == "inverse" else math.nan)
    if not emit_json(result, json_path):
        print_identification(result)
        if calibration_path is not None:
            click.echo(f"calibration: {calibration_path}")


def _number(option: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{option} is {text!r}: give a number") from None


def _split(option: str, text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise UsageError(f"{option} is {text!r}: write NAME=VALUE, for example k1=1.3")
    return name.strip(), value.strip()


def _named(option: str, text: str) -> tuple[str, float]:
    name, value = _split(option, text)
    return name, _number(f"{option} {name}", value)


def _range(option: str, name: str, text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    if not colon:
        raise UsageError(f"{option} {name} is {text!r}: write NAME=LOW:HIGH, either side empty for no limit")
    return (
        _number(f"{option} {name}", low or "-inf"),
        _number(f"{option} {name}", high or "inf"),
    )


def _checks(
    found: Identification, recordings: list[Recording], options: dict[str, Any], step: Callable[[str], None]
) -> dict[str, Any]:
    """Lack of fit and leave-one-rate-out as JSON objects, or the reason why the data cannot decide."""
    from smartshoe.errors import NotIdentifiableError
    from smartshoe.identification.lack_of_fit import lack_of_fit
    from smartshoe.identification.leave_out import leave_one_rate_out

    result: dict[str, Any] = {}
    for name, check in (
        ("lack_of_fit", lambda: lack_of_fit(found, recordings)),
        ("leave_one_rate_out", lambda: leave_one_rate_out(recordings, **options)),
    ):
        step("testing for lack of fit" if name == "lack_of_fit" else "fitting without each loading rate")
        try:
            result[name] = check().to_dict()
        except NotIdentifiableError as reason:
            result[name] = {"says": f"not tested: {reason}"}
    return result
