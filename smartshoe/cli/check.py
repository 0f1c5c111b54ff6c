"""``smartshoe check``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from smartshoe.cli._ranges import FiniteRange

if TYPE_CHECKING:
    from smartshoe.gait.field import CheckResult
    from smartshoe.gait.field.examination import Examination


@click.command(
    "check",
    epilog="Example: smartshoe check walk.csv --calibration left_heel.json --body-weight 519.4",
)
@click.argument("files", nargs=-1, required=True)
@click.option(
    "--calibration", "calibration_paths", multiple=True, metavar="C.json", help="Of a unit, or a folder (repeatable)."
)
@click.option(
    "--body-weight", "body_weight_n", type=FiniteRange(min=0.0, min_open=True), metavar="N",
    help="Check the mean total force against it.",
)  # fmt: skip
@click.option(
    "--coverage", type=FiniteRange(0.0, 1.0, min_open=True), default=1.0, show_default=True, metavar="SHARE",
    help="The share of the load that passes through the units.",
)  # fmt: skip
@click.option("--time", metavar="COLUMN", help="The time column, by name or 1-based number: '1[ms]'.")
@click.option("--strict", is_flag=True, help="End with exit status 5 where anything is at fault.")
@click.option("--json", "json_path", metavar="PATH", help="Write the findings as JSON (- for stdout).")
def command(
    files: tuple[str, ...],
    calibration_paths: tuple[str, ...],
    body_weight_n: float | None,
    coverage: float,
    time: str | None,
    strict: bool,
    json_path: str | None,
) -> None:
    """Check a shoe in the field: every unit answers, the zero holds, the forces add up to body weight.

    Each FILE is a trial of one or two shoes; two FILES of one shoe each are weighed together. A rest of two seconds
    before the first step lets the zero be checked.
    """
    from smartshoe.cli._output import emit_json, progress, require_writable
    from smartshoe.errors import RefusedError

    require_writable(json_path=json_path, read=(*files, *calibration_paths))
    with progress(2) as step:
        step("reading")
        from smartshoe.calibration.folder import load_calibrations
        from smartshoe.cli._inputs import read_all
        from smartshoe.gait.field.examination import examine_trial

        calibrations = load_calibrations(calibration_paths)
        recordings = read_all(files, time=time, force=None, sensors=(), unit=None)
        step("checking")
        found = examine_trial(recordings, calibrations, body_weight_n=body_weight_n, coverage=coverage)
    verdicts = {item.verdict for item in found}
    verdict = next(said for said in ("fault", "warning", "ok", "unknown") if said in verdicts)
    result = {"schema": "smartshoe.check/1", "verdict": verdict, "recordings": [item.to_dict() for item in found]}
    if not emit_json(result, json_path):
        for item in found:
            _print(item)
    if strict and verdict == "fault":
        first = next(finding for item in found for finding in item.findings if finding.verdict == "fault")
        raise RefusedError(first.says)


def _print(found: Examination) -> None:
    """Print one row per finding; good results are one row per kind, with the one furthest off."""
    from smartshoe.report.tables import new_console, table_of

    table = table_of(f"{found.name}: {found.verdict}", ["check", "unit", "verdict"])
    table.add_column("what is found", justify="left")
    well: dict[str, list[CheckResult]] = {}
    for finding in found.findings:
        if finding.verdict == "ok":
            well.setdefault(finding.kind, []).append(finding)
        else:
            table.add_row(finding.kind.replace("_", " "), finding.unit or "all", finding.verdict, finding.says)
    for kind, findings in well.items():
        furthest = max(findings, key=lambda finding: abs(next(iter(finding.numbers.values()), 0.0)))
        units = [finding.unit for finding in findings if finding.unit]
        many = f"{len(units)} units" if len(units) > 1 else "".join(units) or "all"
        says = f"furthest off: {furthest.says}" if len(findings) > 1 else furthest.says
        table.add_row(kind.replace("_", " "), many, "ok", says)
    new_console().print(table)
