"""The bank over a sweep's queue: a folder with one content-named file a case, for clusters and for kills.

A case is named by its world, kind and index and by the code that answers it: after a change of the diagnosis the same
command in the same folder computes anew, and mixes nothing.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import smartshoe
from smartshoe.runs.sweeps._folder import SweepFolder
from smartshoe.runs.sweeps._queue import compute_all, place_of, shard_of

HERE = Path(__file__).resolve().parent
NAME_DIGITS = 24


@dataclass(frozen=True)
class BankCase:
    """One case, whole; ``home`` is where its code lies, for a process that has not loaded it."""

    name: str
    home: str
    job: dict[str, Any]


@dataclass(frozen=True)
class BankCases:
    """The jobs by number, with the names that content gives them."""

    jobs: Sequence[Any]

    @cached_property
    def code(self) -> str:
        """The digest of all code that a case's answer depends on."""
        package = Path(smartshoe.__file__).parent
        rooms = [package, package.parent / "simulators", HERE]
        rooms += sorted({Path(job.folder) for job in self.jobs if job.folder})
        found = hashlib.sha256()
        for room in rooms:
            for file in sorted(room.rglob("*.py")):
                if file.name == "_version.py":  # made anew by each installation
                    continue
                found.update(file.relative_to(room).as_posix().encode() + b"\0" + file.read_bytes())
        return found.hexdigest()

    def name(self, number: int) -> str:
        """The name of a case."""
        text = json.dumps([*self.jobs[number].key, self.code])
        return hashlib.sha256(text.encode()).hexdigest()[:NAME_DIGITS]

    def case(self, number: int) -> BankCase:
        """The case as it is sent to where it is computed."""
        return BankCase(self.name(number), str(HERE), asdict(self.jobs[number]))


def computed(case: BankCase) -> str:
    """The row of a case, as JSON text."""
    if case.home not in sys.path:
        sys.path.insert(0, case.home)
    from bank_worlds import Job, run

    return json.dumps(run(Job(**case.job))) + "\n"


def rows_over(
    jobs: Sequence[Any],
    folder: Path,
    workers: int,
    shard: tuple[int, int] = (1, 1),
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
    compute: Callable[[BankCase], str] = computed,
) -> Iterator[dict[str, Any]]:
    """Compute what the folder does not have of this shard, then give the rows of all jobs that are there, in order.

    ``scheduler`` is the address of a Dask scheduler; it and its workers need this folder on their PYTHONPATH.
    """
    cases, queue = BankCases(jobs), SweepFolder(folder)
    queue.cases.mkdir(parents=True, exist_ok=True)
    mine = shard_of(len(jobs), shard)
    compute_all(cases, queue, mine, place_of(workers, scheduler, len(mine)), compute, progress)
    for number in range(len(jobs)):
        name = cases.name(number)
        if queue.holds(name):
            yield json.loads((queue.cases / f"{name}.json").read_text(encoding="utf-8"))
