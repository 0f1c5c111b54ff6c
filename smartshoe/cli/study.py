"""``smartshoe study``."""

from __future__ import annotations

import click


@click.command("study", epilog="Example: smartshoe study study.toml --out out/study")
@click.argument("study_file", metavar="STUDY")
@click.option("--out", "out_folder", required=True, metavar="DIR", help="Write study.html, study.json and the tables.")
@click.option("--jobs", type=click.IntRange(min=1), help="Processes on this machine (default: one a core).")
@click.option("--c3d", is_flag=True, help="Write each trial as C3D with its events too.")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON (- for stdout).")
def command(study_file: str, out_folder: str, jobs: int | None, c3d: bool, json_path: str | None) -> None:
    """Analyse the trials of STUDY by subject and condition, and compare conditions within subjects."""
    from smartshoe.cli._counting import counting
    from smartshoe.cli._output import emit_json, require_writable
    from smartshoe.runs.studies import study

    require_writable(json_path=json_path, folder=out_folder, read=[study_file])
    with counting("trials") as progress:
        result = study(study_file, out_folder, jobs=jobs, c3d=c3d, progress=progress)
    if emit_json(result.to_dict(), json_path):
        return
    from smartshoe.runs.studies.terminal import print_study

    print_study(result)
