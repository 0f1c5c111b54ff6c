"""Places where cases are computed: this process, processes on this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from smartshoe.errors import DeviceError, UsageError
from smartshoe.runs.sweeps._folder import SweepFolder

Compute = Callable[[Any], str]  # from a case to its JSON text

ANSWER_S = 10.0  # time within which a scheduler, and then one of its workers, must answer
AHEAD = "4*n_jobs"  # number of cases handed out in advance to the workers


class Named(Protocol):
    """A case with the name by which the folder knows it."""

    @property
    def name(self) -> str:
        """The name, made from the case's content."""


@dataclass(frozen=True, slots=True)
class Task:
    """A case to compute, and the sweep's folder, to which it is written if this process can write there."""

    case: Named
    folder: SweepFolder
    compute: Compute

    def __call__(self) -> tuple[str, str | None]:
        """Compute the case; returns its name, and its text if the caller has to write it.

        A case is written before it is reported as done, so that a kill costs no more than the cases under way.
        """
        if self.folder.holds(self.case.name):
            return self.case.name, None
        text = self.compute(self.case)
        if self.folder.cases.is_dir():
            self.folder.put(self.case.name, text)
            return self.case.name, None
        return self.case.name, text


def in_this_process(tasks: Iterable[Task]) -> Iterator[tuple[str, str | None]]:
    """Compute the tasks one after the other in this process."""
    return (task() for task in tasks)


def in_processes(tasks: Iterable[Task], jobs: int) -> Iterator[tuple[str, str | None]]:
    """Compute the tasks in ``jobs`` processes on this machine; raises `WorkerLostError` if one of them is killed."""
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import BrokenProcessPool

    parallel = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch=AHEAD)
    try:
        yield from parallel(delayed(Task.__call__)(task) for task in tasks)
    except BrokenProcessPool as error:
        raise WorkerLostError("a process was killed (by hand, or for want of memory)") from error


class WorkerLostError(DeviceError):
    """A worker was lost in the middle of a case."""


@contextmanager
def _client_of(address: str) -> Iterator[Any]:
    """A client of the Dask scheduler at ``address``; raises `UsageError` or `DeviceError` if it cannot be reached."""
    try:
        from distributed import Client
        from distributed.comm.addressing import get_address_host_port
    except ImportError as error:
        raise UsageError("--scheduler needs Dask: pip install 'smartshoe[cluster]'") from error
    try:
        # Checked before a client connects: a client that fails takes long to end and prints errors of its own.
        get_address_host_port(address)
    except (ValueError, NotImplementedError) as error:
        raise UsageError(f"--scheduler {address} is no address ({error}): give one like tcp://host:8786") from error
    open_client: Any = Client  # typed or not, depending on whether Dask is installed
    try:
        client = open_client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, TimeoutError) as error:
        raise DeviceError(f"no Dask scheduler answers at {address}: start one, or mend --scheduler") from error
    with client:
        yield client


def on_a_cluster(tasks: Iterable[Task], address: str) -> Iterator[tuple[str, str | None]]:
    """Compute the tasks on the workers of a Dask scheduler, through joblib's backend."""
    with _client_of(address) as client:
        from distributed import CancelledError, KilledWorker
        from distributed.comm.core import CommClosedError
        from joblib import Parallel, delayed, parallel_config

        with parallel_config(backend="dask", client=client, wait_for_workers_timeout=ANSWER_S):
            parallel = Parallel(n_jobs=-1, return_as="generator_unordered", batch_size=1, pre_dispatch=AHEAD)
            try:
                yield from parallel(delayed(Task.__call__)(task) for task in tasks)
            except TimeoutError as error:
                raise DeviceError(f"the scheduler at {address} has no workers: start some") from error
            except KilledWorker as error:
                raise WorkerLostError("workers of the cluster were killed, each with the same case") from error
            except (CancelledError, CommClosedError) as error:
                raise DeviceError(
                    f"the Dask scheduler at {address} went away: start it, and the same command goes on"
                ) from error
