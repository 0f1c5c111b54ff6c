"""Prints a sweep's result on a terminal."""

from __future__ import annotations

from smartshoe.report.numbers import plain
from smartshoe.report.tables import new_console, table_of
from smartshoe.runs.sweeps._drivers import drivers_of, main_figures, what_drives
from smartshoe.runs.sweeps._running import SweepResult


def print_sweep(result: SweepResult) -> None:
    """Print the counts, the main figures' median and range, what drives each, and the paths of the files."""
    found = result.main_table()
    shown = table_of("figures over the cases", ["figure", "median", "5 %", "95 %"])
    figures = main_figures(found, result.plan)
    for figure in figures:
        low, middle, high = (plain(float(found[figure].quantile(share))) for share in (0.05, 0.5, 0.95))
        shown.add_row(figure, middle, low, high)
    console = new_console()
    if figures:
        console.print(shown)
    for figure in figures:
        if result.plan.design.axes:
            driver = what_drives(figure, drivers_of(found, result.plan, [figure]))
            console.print(driver, soft_wrap=True, markup=False)
    computed = "" if result.computed == result.cases else f" ({result.computed} computed now)"
    cases = "1 case" if result.cases == 1 else f"{result.cases} cases"
    console.print(f"{cases}{computed}, {result.failed} failed", soft_wrap=True)
    for says, count in found.loc[found["status"] == "failed", "says"].value_counts().head(3).items():
        console.print(f"  {count} failed: {says}", soft_wrap=True, markup=False)
    console.print(f"table: {result.results}", soft_wrap=True, markup=False)
    console.print(f"report: {result.report}", soft_wrap=True, markup=False)
