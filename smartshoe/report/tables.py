"""Tables on a terminal, from the same objects that ``--json`` writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from smartshoe.report.numbers import plain, with_sd


def new_console() -> Console:
    """A console that cuts nothing where nobody looks at its width."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


def table_of(title: str, columns: Sequence[str]) -> Table:
    """An empty table with a title on the left, numbers right-aligned."""
    table = Table(title=title, title_justify="left", header_style="bold")
    for index, column in enumerate(columns):
        table.add_column(column, min_width=len(column), justify="left" if index == 0 else "right", no_wrap=True)
    return table


def print_identification(result: Mapping[str, Any]) -> None:
    """The parameters with error bars, the fit and its tests."""
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


def print_validation(result: Mapping[str, Any]) -> None:
    """Errors per loading rate."""
    table = table_of(
        f"{result.get('unit') or 'unit'}: errors in N over {plain(result['full_scale_n'])} N; loops in % of it",
        ["rate (N/s)", "cycles", "raw", "static", "compensated", "P %", "vs static %", "loop raw", "loop comp.",
         "peak error", "delay (ms)"],
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


def print_summary(units: Sequence[Mapping[str, Any]]) -> None:
    """One row a unit of a scenario's result."""
    table = table_of(
        "units: parameters ± sd; errors in N on what was judged",
        ["unit", "k1", "k2", "c", "fit %", "static", "compensated", "gain %", "loop raw %", "loop comp. %"],
    )
    for unit in units:
        parameters, overall = unit["identification"]["parameters"], unit["validation"]["overall"]
        table.add_row(
            unit["unit"],
            *(with_sd(parameters[name]) for name in ("k1", "k2", "c")),
            f"{unit['identification']['fit_percent']:.2f}",
            plain(overall["rmse_static_n"]),
            plain(overall["rmse_compensated_n"]),
            plain(overall["improvement_over_static_percent"]),
            plain(overall["hysteresis_raw_percent"], 2),
            plain(overall["hysteresis_compensated_percent"], 2),
        )
    new_console().print(table)
