"""`sweep`: runs a scenario over its design, each case once, even if processes are killed in between."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from smartshoe.errors import UsageError
from smartshoe.runs.sweeps._case import computed
from smartshoe.runs.sweeps._folder import SweepFolder, write_results
from smartshoe.runs.sweeps._places import Compute
from smartshoe.runs.sweeps._plan import SweepPlan, read_plan
from smartshoe.runs.sweeps._queue import Progress, compute_all, place_of, shard_of
from smartshoe.runs.sweeps._results import main_results, read_results, write_parquet

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class SweepResult:
    """The result of a sweep: the numbers of ``cases``, of those ``computed`` now, still ``missing``, and ``failed``.

    While cases are missing (another shard may compute them), ``failed``, ``results`` and ``report`` are None.
    """

    plan: SweepPlan
    folder: Path
    cases: int
    computed: int
    missing: int
    failed: int | None
    results: Path | None
    report: Path | None

    def table(self) -> pd.DataFrame:
        """``results.csv``, one row a case in the design's order; raises `UsageError` while cases are missing."""
        return read_results(self._results)

    def main_table(self) -> pd.DataFrame:
        """Only the varied keys, seed, main figures, status and sentence of `table`, which need less memory."""
        return main_results(self._results, self.plan)

    @property
    def _results(self) -> Path:
        if self.results is None:
            raise UsageError(f"{self.folder} still misses {self.missing} of {self.cases} cases: run the other shards")
        return self.results

    def to_dict(self) -> dict[str, Any]:
        """The counts as an object for JSON, in schema smartshoe.sweep_summary/1."""
        return {
            "schema": "smartshoe.sweep_summary/1",
            "scenario": self.plan.source.path.name,
            "version": self.plan.version,
            "cases": self.cases,
            "computed": self.computed,
            "missing": self.missing,
            "failed": self.failed,
            "results": None if self.results is None else str(self.results),
            "report": None if self.report is None else str(self.report),
        }


def sweep(
    scenario: Path | str,
    out: Path | str,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    shard: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> SweepResult:
    """Run a scenario for each case of its ``[sweep]``, and gather the figures in one table.

    Each case is computed once: the same call again continues where the last one stopped.

    Parameters
    ----------
    scenario
        The scenario's file, with a table ``[sweep]``.
    out
        The sweep's folder. ``cases/`` gets a JSON file for each case, ``results.csv`` (and ``.parquet`` if pyarrow is
        installed) a row for each case, and ``sweep.html`` shows what drives the figures.
    jobs
        Number of processes on this machine; None means one for each core, 1 this process.
    scheduler
        Address of a Dask scheduler (``tcp://host:8786``) whose workers compute instead.
    shard
        (k, n): compute only every n-th case from the k-th on (1-based), as one of n runs that share the folder.
    progress
        Called with the number of cases done and to do in this run.

    Raises
    ------
    ScenarioError
        The scenario or its ``[sweep]`` is wrong.
    UsageError
        The folder belongs to another sweep, or cannot be written.
    DeviceError
        The scheduler cannot be reached or was lost, or workers are killed again and again.
    """
    return sweep_plan(read_plan(scenario), Path(out), jobs, scheduler, shard, progress)


def sweep_plan(
    plan: SweepPlan,
    out: Path,
    jobs: int | None = 1,
    scheduler: str | None = None,
    shard: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
    compute: Compute = computed,
) -> SweepResult:
    """`sweep` for a plan that was read already; ``compute`` turns a case into its JSON text."""
    mine = shard_of(len(plan), shard)
    if jobs is not None and jobs < 1:
        raise UsageError(f"jobs is {jobs}: give 1 or more")
    folder = SweepFolder(out)
    folder.claim(plan)
    count = compute_all(plan, folder, mine, place_of(jobs, scheduler, len(mine)), compute, progress)
    missing = _missing(plan, folder)
    if missing:
        return SweepResult(plan, out, len(plan), count, missing, None, None, None)
    return _concluded(plan, folder, count)


def _missing(plan: SweepPlan, folder: SweepFolder) -> int:
    done = folder.done()
    return len({name for name in plan.names() if name not in done})


def _concluded(plan: SweepPlan, folder: SweepFolder, count: int) -> SweepResult:
    """Write the table and the page from the cases."""
    from smartshoe.runs.sweeps._page import write_page

    folder.claim(plan)  # if two sweeps took the folder at the same moment, the first one to end notices it here
    kinds = write_results(plan, folder)
    results = folder.path / "results.csv"
    report = folder.path / "sweep.html"
    result = SweepResult(plan, folder.path, len(plan), count, 0, 0, results, report)
    if importlib.util.find_spec("pyarrow") is not None:
        write_parquet(results, kinds, folder.path / "results.parquet")
    table = result.main_table()
    write_page(report, plan, table)
    failed = int((table["status"] == "failed").sum())
    return SweepResult(plan, folder.path, len(plan), count, 0, failed, results, report)
