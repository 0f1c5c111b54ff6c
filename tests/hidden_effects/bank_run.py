"""The bank as a command, for developing a diagnosis: run cases, keep the rows, print the figures per world.

    python tests/hidden_effects/bank_run.py single:0-40 two:0-20 --workers 2 --rows rows.jsonl
    python tests/hidden_effects/bank_run.py single:0-35 --world second_lab --second-lab ../shared/lab --rows lab.jsonl
    python tests/hidden_effects/bank_run.py --world measured --measured ../shared/data/sensors --rows measured.jsonl
    python tests/hidden_effects/bank_run.py worlds:0-81 --laws 0,1           laws to develop on; 2 is left out
    python tests/hidden_effects/bank_run.py --again rows.jsonl --by law      judge earlier answers anew
    python tests/hidden_effects/bank_run.py single:0-5000 two:0-5000 --queue FOLDER --shard 3/100

The first index is included, the last is not. A run that was interrupted goes on where it stopped: rows that are in
the file are not run again. With --queue the cases lie in a folder, one file each, as those of `smartshoe sweep`: it
takes any number of workers and of job arrays (--shard K/N), the workers of a Dask cluster (--scheduler ADDRESS), and
any number of kills.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

from bank_queue import rows_over  # noqa: E402
from bank_tables import report  # noqa: E402  threads are set before numpy comes
from bank_worlds import THERE, WORLDS, Job, run  # noqa: E402

SECOND_LAB = "SMARTSHOE_SECOND_LAB"


def jobs_of(ranges: Iterable[str], world: str, folder: str, laws: tuple[int, ...] | None) -> list[Job]:
    """The cases of ranges such as ``single:0-40``; of `worlds` only those of ``laws`` where these are given."""
    jobs = []
    for text in ranges:
        kind, _, span = text.partition(":")
        first, _, last = span.partition("-")
        if not (kind and first.isdigit() and last.isdigit()):
            raise SystemExit(f"{text!r} is no range of cases: write KIND:FROM-TO, such as single:0-40")
        kind = THERE.get(kind, kind) if world == "second_lab" else kind
        jobs += [
            Job(world, kind, index, folder)
            for index in range(int(first), int(last))
            if laws is None or kind != "worlds" or index % 3 in laws
        ]
    return jobs


def rows_of(path: Path | None) -> list[dict[str, Any]]:
    """Rows that an earlier run left; a last line that was cut short is dropped."""
    if path is None or not path.exists():
        return []
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            print(f"{path}: a row that was cut short is run again", file=sys.stderr)
    return rows


def run_all(jobs: list[Job], workers: int, path: Path | None) -> Iterator[dict[str, Any]]:
    """Earlier rows of these jobs first, then new ones as they come, each appended to the file."""
    from joblib import Parallel, delayed

    wanted = {job.key for job in jobs}
    done = [row for row in rows_of(path) if (row["world"], row["kind"], row["index"]) in wanted]
    yield from done
    left = [job for job in jobs if job.key not in {(row["world"], row["kind"], row["index"]) for row in done}]
    if not left:
        return
    if path is not None and path.exists() and not path.read_bytes().endswith(b"\n"):
        with path.open("a", encoding="utf-8") as file:
            file.write("\n")  # a row that was cut short ends here
    pool = Parallel(n_jobs=workers, return_as="generator_unordered", inner_max_num_threads=1, backend="loky")
    for row in pool(delayed(run)(job) for job in left):
        if path is not None:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        yield row


def _over_the_queue(jobs: list[Job], given: argparse.Namespace) -> list[dict[str, Any]]:
    part, _, parts = given.shard.partition("/")
    if not (part.isdecimal() and parts.isdecimal()):
        raise SystemExit(f"--shard {given.shard} is none: give K/N")

    def tell(done: int, to_do: int) -> None:
        print(f"\r{done} of {to_do}", end="", file=sys.stderr, flush=True)

    shard = int(part), int(parts)
    rows = list(rows_over(jobs, given.queue, given.workers, shard, given.scheduler, tell))
    print(f"\n{len(rows)} of {len(jobs)} cases are there", file=sys.stderr)
    if given.rows:
        given.rows.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    return rows


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ranges", nargs="*", metavar="KIND:FROM-TO")
    parser.add_argument("--world", choices=WORLDS, default="own")
    parser.add_argument(
        "--second-lab", default=os.environ.get(SECOND_LAB, ""), help=f"its folder (default: {SECOND_LAB})"
    )
    parser.add_argument("--measured", default="", help="the folder of the measured sensors")
    parser.add_argument("--laws", help="of `worlds`: which of the three laws to run, such as 0,1")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--rows", type=Path, help="append every row here, and go on from what is there")
    parser.add_argument("--queue", type=Path, help="a folder that takes the cases, and goes on from there")
    parser.add_argument("--shard", default="1/1", metavar="K/N", help="with --queue: only the K-th of N parts")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="with --queue: a Dask scheduler whose workers compute")
    parser.add_argument("--again", type=Path, nargs="+", help="judge these rows instead of running anything")
    parser.add_argument("--by", choices=("effect", "law", "condition"), default="effect")
    given = parser.parse_args()
    if given.again:
        report([row for path in given.again for row in rows_of(path)], given.by)
        return
    laws = tuple(int(k) for k in given.laws.split(",")) if given.laws else None
    folder = {"own": "", "second_lab": given.second_lab, "measured": given.measured}[given.world]
    if given.world != "own" and not Path(folder or "-").is_dir():
        parser.error(f"the world {given.world} needs its folder: give --{given.world.replace('_', '-')}")
    if given.world == "measured":
        from bank_measured import SETS

        jobs = [Job("measured", name, 0, folder) for name in given.ranges or SETS]
    else:
        jobs = jobs_of(given.ranges, given.world, folder, laws)
    if not jobs:
        parser.error("give a range such as single:0-40, or --again")
    if given.queue:
        report(_over_the_queue(jobs, given), given.by)
        return
    rows = []
    for row in run_all(jobs, given.workers, given.rows):
        rows.append(row)
        print(f"\r{len(rows)} of {len(jobs)}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    report(rows, given.by)


if __name__ == "__main__":
    main()
