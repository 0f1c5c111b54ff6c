"""``smartshoe simulate``."""

from __future__ import annotations

from contextlib import ExitStack

import click


@click.command("simulate", epilog="Example: smartshoe simulate scenarios/calibration.toml --out recordings")
@click.argument("scenario")
@click.option("--out", "out_folder", required=True, metavar="DIR", help="Where the recordings go.")
@click.option("--seed", type=click.IntRange(min=0), help="In the place of the scenario's own seed.")
def command(scenario: str, out_folder: str, seed: int | None) -> None:
    """Run only the devices of SCENARIO and write one plain table per unit and experiment, and the trial's.

    Of a simulated trial the true loads are written too, as NAME_truth.csv.
    """
    from smartshoe.cli._output import progress, require_writable

    require_writable(folder=out_folder, read=[scenario])
    with progress() as step, ExitStack() as stack:
        step("reading the scenario")
        from smartshoe.files.atomic import results_folder
        from smartshoe.files.logs import write
        from smartshoe.runs.scenario import load, simulate, simulate_trial

        loaded, source = load(scenario)
        if seed is not None:
            loaded = loaded.model_copy(update={"seed": seed})
        folder = stack.enter_context(results_folder(out_folder))
        pressed = sum(len(unit.recordings) or len(loaded.protocol) for unit in loaded.unit)
        step.of(2 * pressed + 2 * (loaded.trial is not None))  # each is simulated, then written
        made = simulate(loaded, source, step)
        for unit, recordings in made.items():
            for name, recording in recordings.items():
                step(f"{unit}: writing {name}")
                write(recording, folder / f"{unit}_{name}.csv")
        recorded = simulate_trial(loaded, source, step)
        trial = [] if recorded is None else [recorded.recording, recorded.true_loads()]
        of_trial = [recording for recording in trial if recording is not None]
        for recording in of_trial:
            step(f"writing {recording.name}")
            write(recording, folder / f"{recording.name}.csv")
    for recording in of_trial:
        click.echo(f"{folder / f'{recording.name}.csv'}: {len(recording)} samples, {recording.duration_s:.1f} s")
    for unit, recordings in made.items():
        for name, recording in recordings.items():
            click.echo(f"{folder / f'{unit}_{name}.csv'}: {len(recording)} samples, {recording.duration_s:.1f} s")
