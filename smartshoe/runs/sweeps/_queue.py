"""Uses a sweep's folder as a queue: cases that are not in it are computed and written before they are reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from smartshoe.errors import DeviceError, UsageError
from smartshoe.runs.sweeps import _places as places
from smartshoe.runs.sweeps._folder import SweepFolder
from smartshoe.runs.sweeps._places import Compute, Named, Task, WorkerLostError

Progress = Callable[[int, int], None]

LOST_WITHOUT_PROGRESS = 5  # number of workers killed in a row, without a case done, after which the sweep gives up


class Cases(Protocol):
    """A numbered (0-based) set of cases."""

    def name(self, number: int) -> str:
        """The case's name; equal cases have equal names."""

    def case(self, number: int) -> Named:
        """The case as an object that can be sent to a worker."""


Place = Callable[[Iterator[Task]], Iterator[tuple[str, str | None]]]


def place_of(jobs: int | None, scheduler: str | None, cases: int) -> Place:
    """Where to compute cases: a Dask scheduler's workers, this process, or ``jobs`` processes (None: one a core)."""
    if scheduler is not None:
        return lambda tasks: places.on_a_cluster(tasks, scheduler)
    if jobs is None:
        from joblib import cpu_count

        jobs = int(cpu_count())
    wanted = min(jobs, cases)
    if wanted <= 1:
        return places.in_this_process
    return lambda tasks: places.in_processes(tasks, wanted)


def shard_of(cases: int, shard: tuple[int, int]) -> range:
    """The cases of part k of n: every n-th from the k-th on (1-based); raises `UsageError` if there is no such part."""
    part, parts = shard
    if not 1 <= part <= parts:
        raise UsageError(f"shard {part}/{parts} is none: give K/N with K from 1 to N")
    return range(part - 1, cases, parts)


def compute_all(
    cases: Cases,
    folder: SweepFolder,
    mine: Sequence[int],
    place: Place,
    compute: Compute,
    progress: Progress | None = None,
) -> int:
    """Compute those of ``mine`` that are not in the folder, and return their number.

    Raises `DeviceError` if workers are killed again and again, or if the cluster is lost.
    """
    to_do = _to_do(cases, folder, mine)
    there = SweepFolder(folder.path.resolve())  # an absolute path, since workers may run in another working folder
    whole = len(to_do)
    counted = lost = 0
    while to_do:
        before = counted
        try:
            for name, text in place(Task(cases.case(number), there, compute) for number in to_do):
                if text is not None:
                    folder.put(name, text)
                counted += 1
                if progress is not None:
                    progress(counted, whole)
        except WorkerLostError as error:
            lost = lost + 1 if counted == before else 1
            if lost >= LOST_WITHOUT_PROGRESS:
                raise DeviceError(
                    f"{error}, {lost} times in a row; {len(to_do)} cases are left, the first is"
                    f" {cases.name(to_do[0])}: the same command goes on where this one stopped"
                ) from error
            to_do = _to_do(cases, folder, mine)
            counted = whole - len(to_do)
        else:
            break
    return counted


def _to_do(cases: Cases, folder: SweepFolder, mine: Sequence[int]) -> list[int]:
    """The numbers of the cases that are not done; of equal cases only the first."""
    seen = folder.done()
    found: list[int] = []
    for number in mine:
        name = cases.name(number)
        if name not in seen:
            seen.add(name)
            found.append(number)
    return found
