"""``smartshoe sweep``."""

from __future__ import annotations

import click


def _shard(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int]:
    if text is None:
        return 1, 1
    part, slash, parts = text.partition("/")
    if not (slash and part.isdecimal() and parts.isdecimal() and 1 <= int(part) <= int(parts)):
        raise click.BadParameter(f"{text!r} is no shard: give K/N with K from 1 to N, as 3/10")
    return int(part), int(parts)


@click.command("sweep", epilog="Example: smartshoe sweep scenarios/sweep.toml --out out/sweep --jobs 2")
@click.argument("scenario")
@click.option("--out", "out_folder", required=True, metavar="DIR", help="The sweep's folder; the same again goes on.")
@click.option("--jobs", type=click.IntRange(min=1), help="Processes on this machine (default: one a core).")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler, tcp://host:8786, whose workers compute.")
@click.option("--shard", metavar="K/N", callback=_shard, help="Only the K-th of N parts, for a cluster's job array.")
@click.option("--json", "json_path", metavar="PATH", help="Write the counts as JSON (- for stdout).")
def command(
    scenario: str,
    out_folder: str,
    jobs: int | None,
    scheduler: str | None,
    shard: tuple[int, int],
    json_path: str | None,
) -> None:
    """Run SCENARIO for each case of its [sweep]: values of keys, and seeds. Each case is computed once."""
    from smartshoe.cli._counting import counting
    from smartshoe.cli._output import emit_json, require_writable
    from smartshoe.runs.sweeps import sweep

    require_writable(json_path=json_path, folder=out_folder, read=[scenario])
    with counting("cases") as progress:
        result = sweep(scenario, out_folder, jobs=jobs, scheduler=scheduler, shard=shard, progress=progress)
    if emit_json(result.to_dict(), json_path):
        return
    if result.results is None:
        click.echo(f"{result.computed} cases computed; {result.missing} of {result.cases} are other shards' or missing")
        return
    from smartshoe.runs.sweeps.terminal import print_sweep

    print_sweep(result)
