"""Prints a study's result on a terminal."""

from __future__ import annotations

from smartshoe.report.numbers import plain
from smartshoe.report.tables import new_console, table_of
from smartshoe.runs.studies._page import SHOWN, careful, headline, is_clear, shown_figures
from smartshoe.runs.studies._running import StudyResult


def print_study(result: StudyResult) -> None:
    """Print figures by condition, clear differences, trials left out, and the path of the page."""
    console = new_console()
    table = table_of("mean over subjects ± sd", ["figure", *result.conditions])
    for name in shown_figures(result):
        cells = []
        for figures in result.conditions.values():
            mean = figures.get(name)
            spread = "" if mean is None or mean.sd is None else f" ± {plain(mean.sd, 2)}"
            cells.append("–" if mean is None else f"{plain(mean.mean, 4)}{spread}")
        table.add_row(SHOWN[name], *cells)
    console.print(table)
    console.print(headline(result), soft_wrap=True, markup=False)
    for each in result.differences:
        if is_clear(each.change) and each.change.ci95 is not None and each.figure in shown_figures(result):
            low, high = each.change.ci95
            change = f"{plain(each.change.mean)} ({plain(low)} … {plain(high)}), {each.change.subjects} subjects"
            console.print(f"  {SHOWN[each.figure]}, {each.start} to {each.end}: {change}", soft_wrap=True, markup=False)
    for file, says in [
        *((trial.entry.file, f"left out: {trial.left_out}") for trial in result.left_out),
        *result.flags,
        *careful(result),
    ]:
        console.print(f"{file}: {says}", soft_wrap=True, markup=False)
    used = "1 trial" if len(result.trials) == 1 else f"{len(result.trials)} trials"
    console.print(f"{used} used, {len(result.left_out)} left out")
    console.print(f"report: {result.report}", soft_wrap=True, markup=False)
