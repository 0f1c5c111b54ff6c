"""Tables on a terminal, made from the objects that ``--json`` writes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from smartshoe.report.numbers import plain, with_sd

USUAL, NARROWEST = 120, 40  # widths in characters


def new_console() -> Console:
    """A console as wide as the terminal; in a pipe as wide as ``COLUMNS``, or 120 characters."""
    # Without markup, since names of files may look like it.
    console = Console(highlight=False, markup=False)
    if console.is_terminal:
        return console
    given = os.environ.get("COLUMNS", "")
    width = int(given) if given.isdigit() and int(given) >= NARROWEST else USUAL
    return Console(highlight=False, markup=False, width=width)


def table_of(title: str, columns: Sequence[str]) -> Table:
    """An empty table with a title on the left; all columns but the first are right-aligned."""
    table = Table(
        title=title, title_justify="left", header_style="bold", box=box.SIMPLE_HEAD, show_edge=False, padding=0
    )
    for index, column in enumerate(columns):
        longest = max((len(line) for line in column.splitlines()), default=1)
        # Cells are folded, never cut: what does not fit continues on the next line.
        table.add_column(column, min_width=longest, justify="left" if index == 0 else "right", overflow="fold")
    return table


def print_identification(result: Mapping[str, Any]) -> None:
    """Print the parameters with error bars, the fit and its tests."""
    table = table_of(
        f"{result.get('unit') or 'unit'}: {result['direction']} fit by {result['method']},"
        f" {result['estimator'].replace('_', ' ')}",
        ["parameter", "value ± sd", "95 % interval", "unit"],
    )
    for name, parameter in result["parameters"].items():
        low, high = parameter["ci95"]
        table.add_row(name, with_sd(parameter), f"{plain(low, 5)} … {plain(high, 5)}", parameter["unit"])
    delay = result["delay_s"]
    table.add_row("delay", with_sd(delay), "", delay["unit"])
    for name, offset in result["offsets"].items():
        table.add_row(f"offset ({name})", with_sd(offset), "", offset["unit"])
    console = new_console()
    console.print(table)
    rmse, tests = result["rmse"], result["residual_tests"]
    console.print(
        f"fit {result['fit_percent']:.2f} %, RMSE {plain(rmse['value'])} {rmse['unit']},"
        f" {'converged' if result['converged'] else 'NOT converged'} in {result['iterations']} iterations;"
        f" residual: whiteness p = {plain(tests['whiteness']['p_value'], 2)},"
        f" input independence p = {plain(tests['input_independence']['p_value'], 2)}"
    )
    if result.get("consistency"):
        console.print(f"c = 1, the paper's form: {result['consistency']['says']}", soft_wrap=True)
    for check in ("lack_of_fit", "leave_one_rate_out"):
        if check in result:
            console.print(f"{check.replace('_', ' ')}: {result[check]['says']}", soft_wrap=True)
    for fold in result.get("leave_one_rate_out", {}).get("folds", ()):
        console.print(
            f"  without {plain(fold['rate_n_per_s'])} N/s: "
            + (
                fold["refused"]
                or f"{plain(fold['rmse_left_out_n'])} N there, {plain(fold['rmse_fitted_n'])} N elsewhere"
            ),
            soft_wrap=True,
        )
    for note in result.get("notes", ()):
        console.print(f"note: {note}", soft_wrap=True)


def print_validation(result: Mapping[str, Any], *, is_diagnosed: bool = False) -> None:
    """Print the errors at each loading rate; ``is_diagnosed`` means that the calibration comes from a diagnosis."""
    table = table_of(
        f"{result.get('unit') or 'unit'}: errors in N over {plain(result['full_scale_n'])} N; loops in % of it",
        ["rate\nN/s", "cycles", "raw", "static", "comp.", "P %", "vs\nstat. %", "loop\nraw", "loop\ncomp.",
         "peak\nerror", "delay\nms"],
    )  # fmt: skip
    for rate in (*result["rates"], result["overall"]):
        delay = rate["delay_s"]
        table.add_row(
            "all" if rate["rate_n_per_s"] is None else f"{rate['rate_n_per_s']:g}",
            str(rate["cycles"]),
            plain(rate["rmse_raw_n"]),
            plain(rate["rmse_static_n"]),
            plain(rate["rmse_compensated_n"]),
            plain(rate["improvement_percent"]),
            plain(rate["improvement_over_static_percent"]),
            plain(rate["hysteresis_raw_percent"], 2),
            plain(rate["hysteresis_compensated_percent"], 2),
            plain(rate["peak_error_n"]),
            "–" if delay is None else f"{1e3 * delay:.1f}",
        )
    console = new_console()
    console.print(table)
    console.print(
        "raw: the reading on the calibration's scale; static: the best gain and offset on this data;"
        " P% (the paper's) compares with raw",
        soft_wrap=True,
    )
    worse = worse_than_a_line(result["overall"], is_diagnosed=is_diagnosed)
    if worse:
        console.print(worse, style="bold", soft_wrap=True)


def worse_than_a_line(overall: Mapping[str, Any], *, is_diagnosed: bool = False) -> str | None:
    """A sentence if the filter's error is larger than that of the best static line; None otherwise.

    ``is_diagnosed`` means that the calibration comes from a diagnosis, so that another one would not help.
    """
    static_n, left_n = overall["rmse_static_n"], overall["rmse_compensated_n"]
    if static_n is None or left_n is None or left_n <= static_n:
        return None
    return (
        f"The filter makes it worse: {plain(left_n)} N are left (rms), {plain(static_n)} N by the best straight line"
        " through the reading. Is the calibration this unit's, and is the load's sign right? If so, "
        + ("zero the load cell and the sensor before each recording." if is_diagnosed else "diagnose the unit.")
    )


def print_summary(units: Sequence[Mapping[str, Any]], headline: str, grades: Mapping[str, str]) -> None:
    """Print a scenario's result: the verdict, and each unit's grade (by name), errors and parameters."""
    console = new_console()
    console.print(headline, style="bold", soft_wrap=True)
    errors = table_of(
        "errors in N on what was judged; loops in % of full scale",
        ["unit", "grade", "static", "comp.", "less %", "loop\nraw", "loop\ncomp."],
    )
    fits = table_of("parameters ± sd", ["unit", "k1", "k2", "c", "fit %"])
    for unit in units:
        parameters, overall = unit["identification"]["parameters"], unit["validation"]["overall"]
        errors.add_row(
            unit["unit"],
            grades[unit["unit"]],
            plain(overall["rmse_static_n"]),
            plain(overall["rmse_compensated_n"]),
            plain(overall["improvement_over_static_percent"]),
            plain(overall["hysteresis_raw_percent"], 2),
            plain(overall["hysteresis_compensated_percent"], 2),
        )
        fits.add_row(
            unit["unit"],
            *(with_sd(parameters[name]).replace(" ± ", "±") for name in ("k1", "k2", "c")),
            f"{unit['identification']['fit_percent']:.2f}",
        )
    console.print(errors)
    console.print(fits)
