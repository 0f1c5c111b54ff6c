"""``smartshoe diagnose``."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from smartshoe.cli._inputs import column_options, read_all
from smartshoe.cli._output import figures_option
from smartshoe.cli._ranges import FiniteRange

if TYPE_CHECKING:
    from smartshoe.cli._output import ShownSteps
    from smartshoe.diagnosis import Diagnosis
    from smartshoe.recording import Recording

MOST_NOTES = 10
NOT_FITTED = "every third load cycle, or part of the time where there are few cycles, not fitted"
# Number of steps that usually follow one, without the report. Fits continue until one brings no improvement.
_USUALLY_LEFT = {"examining the data": 6, "fitting the baseline": 5, "weighing alternatives": 1}


@click.command(
    "diagnose",
    epilog="Example: smartshoe diagnose left_toe_1.csv left_toe_2.csv --hold-out left_toe_3.csv --out out/left_toe",
)
@click.argument("files", nargs=-1)
@click.option(
    "--hold-out",
    "held_out",
    multiple=True,
    metavar="FILE",
    help="An experiment to judge on and never to fit (repeatable); without it every third load cycle, or part of the"
    " time where there are few cycles.",
)
@click.option(
    "--material",
    type=FiniteRange(min=0.0, max=50.0, min_open=True),
    default=0.02,
    show_default=True,
    metavar="PERCENT",
    help="Smallest error of the reading that counts, of full scale: an effect that moves it less is not named, and what"
    " is left below it is not held against the simulation. More than usual changes nothing of what is found; less than"
    " usual expects as much less of what imperfections of a good unit add up to (0.15 % by itself).",
)
@click.option(
    "--design",
    "design_path",
    metavar="SCENARIO.toml",
    help="Before measuring: which effects the scenario's protocols show and tell apart (no FILE, and of the"
    " other options only --json).",
)
@click.option("--json", "json_path", metavar="PATH", help="Write the diagnosis as JSON (- for stdout).")
@click.option("--out", "out_folder", metavar="DIR", help="Write diagnosis.html, diagnosis.json and the next protocol.")
@click.option(
    "--calibration",
    "calibration_path",
    metavar="OUT.json",
    help="Write the extended model's calibration for compensate.",
)
@figures_option
@column_options
def command(
    files: tuple[str, ...],
    held_out: tuple[str, ...],
    material: float,
    json_path: str | None,
    out_folder: str | None,
    calibration_path: str | None,
    design_path: str | None,
    figures: tuple[str, ...],
    unit: str | None,
    **columns: Any,
) -> None:
    """What the simulation of a unit gets wrong, why, and what mending it gains (one FILE an experiment)."""
    from smartshoe.cli._output import emit_json, note, progress, require_writable, warn
    from smartshoe.display import first_names
    from smartshoe.errors import NotIdentifiableError, UsageError
    from smartshoe.files.atomic import results_folder

    read = (*files, *held_out, *([] if design_path is None else [design_path]))
    require_writable(calibration_path, json_path=json_path, folder=out_folder, read=read)
    if design_path is not None:
        if files or held_out:
            raise UsageError("--design asks about protocols, before anything is measured: name no FILE beside it")
        _refuse_beside_design()
        _design(design_path, json_path)
        return
    if not files:
        raise UsageError("diagnose needs FILES: name one experiment at least, or ask --design SCENARIO.toml")
    if figures and out_folder is None:
        raise UsageError("--figures writes into --out DIR: give --out as well")
    _check(files, held_out)
    with progress() as step, ExitStack() as stack:
        step("reading")
        from smartshoe.cli._cautions import warn_of_unused_hold_outs
        from smartshoe.diagnosis import diagnose

        recordings = read_all(files, unit=unit, **columns)
        others = read_all(held_out, unit=unit, **columns) if held_out else []
        folder = None if out_folder is None else stack.enter_context(results_folder(out_folder))
        step("examining the data")
        found = diagnose(
            recordings,
            hold_out=others,
            material=material / 100.0,
            progress=with_what_is_left(step, folder is not None),
        )
        fitted, judges = _used(found, recordings, others)
        warn_of_unused_hold_outs(others, judges, found.left_out)
        title = _title(fitted, unit)
        written: dict[str, Path] = {}
        if folder is not None:
            step("writing the report")
            from smartshoe.report.diagnosis.folder import publish_diagnosis

            written, taken_away = publish_diagnosis(
                folder, found, title, _facts(fitted, judges, is_refused=found.verdict == "refused"), figures
            )
            if taken_away:
                gone = first_names([path.name for path in taken_away])
                note(f"{folder}: {gone} of an earlier diagnosis taken away")
    refused = found.verdict == "refused"
    if calibration_path is not None and not refused:
        _save_calibration(calibration_path, found, fitted, unit)
    elif calibration_path is not None and Path(calibration_path).is_file():
        warn(f"{calibration_path} is left as it was: this diagnosis gives no calibration")
    taken = emit_json(found.to_dict(), json_path)
    if refused:
        for said in found.limits[1 : 1 + MOST_NOTES]:
            note(said)
        if (more := len(found.limits) - 1 - MOST_NOTES) > 0:
            note(f"and {more} more, which --json has under limits")
        raise NotIdentifiableError(found.limits[0] if found.limits else found.says)
    if taken:
        return
    from smartshoe.report.diagnosis.terminal import print_diagnosis

    print_diagnosis(found, title)
    for name, path in written.items():
        click.echo(f"{name}: {path}")
    if calibration_path is not None:
        click.echo(f"calibration: {calibration_path}")


def with_what_is_left(step: ShownSteps, with_report: bool) -> Callable[[str], None]:
    """``step``, extended to report how many steps usually remain: fits continue until none improves the result."""

    def show(text: str) -> None:
        step(text)
        if text in _USUALLY_LEFT:
            step.of(_USUALLY_LEFT[text] + with_report)

    return show


def _refuse_beside_design() -> None:
    """Raise `UsageError` for options that have no meaning for a design."""
    from smartshoe.errors import UsageError

    context = click.get_current_context()
    given = [
        one.opts[0]
        for one in context.command.params
        if one.name not in ("design_path", "json_path")
        and context.get_parameter_source(one.name or "") is click.core.ParameterSource.COMMANDLINE
    ]
    if given:
        raise UsageError(f"--design takes no {', '.join(given)}: only --json goes with it")


def _design(path: str, json_path: str | None) -> None:
    from smartshoe.cli._output import emit_json, note
    from smartshoe.devices import schemes
    from smartshoe.diagnosis.design import USUAL_NOISE_PERCENT, USUAL_RATE_HZ, design, too_short_of
    from smartshoe.report.diagnosis.terminal import print_design
    from smartshoe.runs.scenario import check_machines, checked, noise_of, protocols_of, read_tables, sample_rate_of

    tables, source = read_tables(path)
    unit = '[[unit]] and name = "left_toe" at its end'
    if not tables.get("protocol"):
        mend = "add a [protocol.dynamic]" + ("" if tables.get("unit") else f", and {unit}")
        raise source.error(("protocol",), f"there is none, and a design asks about protocols: {mend}")
    if not tables.get("unit"):
        raise source.error(("unit",), f"there is none, and a design takes noise and rate from units: add {unit}")
    scenario = checked(tables, source)
    protocols = protocols_of(scenario, source)
    named, percent = noise_of(scenario, source) or (None, USUAL_NOISE_PERCENT)
    said_by = "since no unit of the scenario states any above 0"
    if named is not None:
        said_by = f"the largest that a unit of the scenario states ({named})"
    rate_hz = sample_rate_of(scenario, source) or USUAL_RATE_HZ
    for name, protocol in protocols.items():
        if said := too_short_of(protocol, rate_hz):
            raise source.error(("protocol", name), said)
    if "sim" in schemes():  # a design needs no simulator; another machine's limits are not known
        check_machines(scenario, source)
    found = design(tuple(protocols.values()), noise_percent=percent, sample_rate_hz=rate_hz)
    note(f"noise of {percent:g} % of full scale, {said_by}; logged at {rate_hz:g} Hz")
    if not emit_json(found.to_dict(), json_path):
        print_design(found)


def _check(files: tuple[str, ...], held_out: tuple[str, ...]) -> None:
    from smartshoe.errors import UsageError

    fitted = {Path(file).resolve() for file in files}
    for file in held_out:
        if Path(file).resolve() in fitted:
            raise UsageError(f"{file} is to be fitted and held out at once: name it as FILE or with --hold-out")


def _title(recordings: list[Recording], unit: str | None) -> str:
    names = dict.fromkeys(recording.unit for recording in recordings if recording.unit)
    first, count = recordings[0].name, len(recordings)
    return unit or ", ".join(names) or (first if count == 1 else f"{first} and {count - 1} more")


def _used(
    found: Diagnosis, recordings: list[Recording], others: list[Recording]
) -> tuple[list[Recording], list[Recording]]:
    """The recordings that were fitted and those that judged, without excluded ones.

    All recordings where the diagnosis was refused.
    """
    if not found.traces:
        return recordings, others
    used = {trace.recording for trace in found.traces}
    kept = [one for k, one in enumerate([*recordings, *others]) if k in used]
    count = sum(k < len(recordings) for k in used)
    return kept[:count], kept[count:]


def _facts(recordings: list[Recording], others: list[Recording], *, is_refused: bool) -> dict[str, str]:
    from smartshoe.version import __version__

    if is_refused:
        return {"given": ", ".join(one.name for one in (*recordings, *others)), "smartshoe": __version__}
    facts = {"fitted": ", ".join(recording.name for recording in recordings)}
    facts["judged on"] = ", ".join(recording.name for recording in others) or NOT_FITTED
    return {**facts, "smartshoe": __version__}


def _save_calibration(path: str, found: Diagnosis, recordings: list[Recording], unit: str | None) -> None:
    import datetime

    from smartshoe.calibration.provenance import calibrated_on

    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    calibration = found.calibration(unit=unit or recordings[0].unit or "", created=today)
    calibrated_on(calibration, recordings).save(path)
