"""``smartshoe gait``."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click

from smartshoe.cli._output import figures_option

LEAST_WEIGHT_N = 150.0  # of a walking person: a smaller number is probably in kg


class _EstimatorOption(click.Option):
    """Lists the available estimators when help is requested; the registry is not read before that."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from smartshoe.calibration.estimators import estimator_names

        *others, last = estimator_names()
        self.help = (self.help or "").format(f"{', '.join(others)} or {last}")
        return super().get_help_record(ctx)


@click.command(
    "gait",
    epilog="Example: smartshoe gait walk.csv --calibration left_heel.json --calibration left_toe.json --out out/walk",
)
@click.argument("files", nargs=-1, required=True)
@click.option(
    "--calibration",
    "calibration_paths",
    multiple=True,
    metavar="C.json",
    help="A unit's calibration or a folder of them (repeatable); columns in N need none.",
)
@click.option("--body-weight", "body_weight_n", type=float, metavar="N", help="In newton; estimated where not given.")
@click.option(
    "--coverage", type=float, default=1.0, show_default=True, help="Share of the load that passes through the units."
)
@click.option(
    "--coverage-course",
    "course_path",
    metavar="midfoot|FILE",
    help="When in a stance the load passes beside the units: 'midfoot', or a file that learn_coverage gave; without it"
    " the same share throughout.",
)
@click.option(
    "--estimator",
    metavar="NAME",
    cls=_EstimatorOption,
    help="Forces with error bars, by {}; without it the calibrations' filter.",
)
@click.option("--time", metavar="COLUMN", help="The time column, by name or 1-based number: '1[ms]'.")
@click.option(
    "--sensor",
    "sensors",
    multiple=True,
    metavar="UNIT=COLUMN",
    help="Which column is which unit, where names do not tell (repeatable): left_heel='L_force[N]'.",
)
@click.option("--reference", metavar="FILE", help="A trial whose mean strides are the pattern to compare with.")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
@click.option("--c3d", "c3d_path", metavar="OUT.c3d", help="Write forces and events as C3D (needs ezc3d).")
@click.option("--out", "out_folder", metavar="DIR", help="Write gait.html, gait.json, events, strides, forces as CSV.")
@figures_option
@click.option(
    "--stream/--whole",
    "stream",
    default=None,
    help="In bounded memory, a day at a time: no page, no forces against time, no C3D. By itself for plain tables above"
    " 64 MB; --whole takes any size into memory.",
)
def command(
    files: tuple[str, ...],
    calibration_paths: tuple[str, ...],
    body_weight_n: float | None,
    coverage: float,
    course_path: str | None,
    estimator: str | None,
    time: str | None,
    reference: str | None,
    json_path: str | None,
    c3d_path: str | None,
    out_folder: str | None,
    stream: bool | None,
    figures: tuple[str, ...],
    sensors: tuple[str, ...],
) -> None:
    """Events, phases, strides and forces of a trial (FILE: both shoes; or one FILE for each shoe)."""
    from smartshoe.cli._output import emit_json, note, progress, require_writable, show_notes, warn

    with progress() as step:
        step("starting")
        from smartshoe.cli._gait_stream import gait_of_stream, is_streamed, refuse_with
        from smartshoe.cli._inputs import say_what_strikes, units_of, with_units
        from smartshoe.files.atomic import results_folder
        from smartshoe.files.logs import read
        from smartshoe.gait import Coverage, analyse

    if figures and out_folder is None:
        raise click.UsageError("--figures writes into --out DIR: give --out as well")
    require_writable(c3d_path, json_path=json_path, folder=out_folder, read=(*files, *calibration_paths))
    if body_weight_n is not None and 0.0 < body_weight_n < LEAST_WEIGHT_N:
        warn(
            f"a body weight of {body_weight_n:g} N is {body_weight_n / 9.80665:.1f} kg: if it is in kg, give"
            f" --body-weight {9.80665 * body_weight_n:.0f}"
        )
    streamed = is_streamed(files, stream)
    if streamed:
        refuse_with(
            {
                "--reference": reference,
                "--c3d": c3d_path,
                "--figures": figures[0] if figures else None,
                "--sensor": sensors[0] if sensors else None,
            }
        )
        if stream is None:
            note("a large recording goes through as a stream (--whole takes it into memory)")
    chosen = units_of(sensors)
    recordings = []
    with progress(len(files)) as step:
        for file in () if streamed else files:
            step(f"reading {Path(file).name}")
            recordings.append(with_units(read(file, time=time), chosen))
    show_notes(recordings)
    say_what_strikes(recordings)
    calibrations = []
    if calibration_paths:
        from smartshoe.calibration.folder import load_calibrations

        calibrations = load_calibrations(calibration_paths)
    if course_path == "midfoot":
        covered = Coverage.midfoot(coverage)
    else:
        covered = Coverage(coverage) if course_path is None else Coverage.load(course_path)
    written: dict[str, Path] = {}
    with ExitStack() as stack:
        folder = stack.enter_context(results_folder(out_folder)) if out_folder is not None else None
        if streamed:
            gait_of_stream(files, calibrations, body_weight_n, covered, time, json_path, folder, estimator)
            return
        step = stack.enter_context(progress(1 + (folder is not None)))
        step("events, strides, forces")
        wanted = None
        if reference is not None:
            wanted = analyse([read(reference, time=time)], calibrations, body_weight_n, covered, estimator=estimator)
        found = analyse(recordings, calibrations, body_weight_n, covered, wanted, estimator)
        title = ", ".join(recording.name for recording in recordings)
        if folder is not None:
            step("writing the report")
            from smartshoe.report.gait.folder import publish_gait

            written = publish_gait(
                folder, found, title, {"files": ", ".join(Path(file).name for file in files)}, figures
            )
        if c3d_path is not None:
            from smartshoe.gait import write_c3d

            write_c3d(c3d_path, found)
            written["c3d"] = Path(c3d_path)
    if json_path is not None and emit_json(found.to_dict(), json_path):
        return
    from smartshoe.report.gait.terminal import print_gait

    print_gait(found, title)
    for name, path in written.items():
        click.echo(f"{name}: {path}")
