"""``smartshoe run``."""

from __future__ import annotations

from contextlib import ExitStack

import click

from smartshoe.cli._output import figures_option


@click.command("run", epilog="Example: smartshoe run scenarios/calibration.toml --out out/calibration")
@click.argument("scenario")
@click.option("--seed", type=click.IntRange(min=0), help="In the place of the scenario's own seed.")
@click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="KEY=VALUE",
    help="In the place of the scenario's own value (repeatable): unit.left_toe.bladder.k1=1.5.",
)
@click.option("--out", "out_folder", metavar="DIR", help="Write report.html, result.json and the calibrations.")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
@figures_option
def command(
    scenario: str,
    seed: int | None,
    assignments: tuple[str, ...],
    out_folder: str | None,
    json_path: str | None,
    figures: tuple[str, ...],
) -> None:
    """Run SCENARIO: devices (simulated, replayed or logged), protocol, identification, validation."""
    from smartshoe.cli._output import emit_json, progress, require_writable

    if figures and out_folder is None:
        raise click.UsageError("--figures writes into --out DIR: give --out as well")
    require_writable(json_path=json_path, folder=out_folder, read=[scenario])
    with progress() as step, ExitStack() as stack:
        step("reading the scenario")
        from smartshoe.kernels import warm_up

        warm_up.begin()
        from smartshoe.files.atomic import json_text, results_folder
        from smartshoe.report.tables import print_summary
        from smartshoe.runs.scenario import load, parse_assignments, run, steps_of
        from smartshoe.runs.scenario.publish import judged, publish

        loaded, source = load(scenario, parse_assignments(assignments))
        if seed is not None:
            loaded = loaded.model_copy(update={"seed": seed})
        folder = stack.enter_context(results_folder(out_folder)) if out_folder is not None else None
        step.of(steps_of(loaded) + (folder is not None))
        result = run(loaded, source, step)
        whole = result.to_dict()
        report = None
        if folder is not None:
            step("writing the report")
            report = publish(result, folder, json_text(whole), figures)
    if not emit_json(whole, json_path):
        print_summary(whole["units"], *judged(result))
        for unit in result.units:
            if unit.diagnosis is not None:
                from smartshoe.report.diagnosis.terminal import print_diagnosis

                print_diagnosis(unit.diagnosis, unit.name)
        if "trial" in whole:
            from smartshoe.report.trial import print_trial

            print_trial(whole["trial"])
        if report is not None:
            click.echo(f"report: {report}")
