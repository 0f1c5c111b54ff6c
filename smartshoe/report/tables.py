"""Plain tables for the terminal; rich is imported when one is printed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import IO, TYPE_CHECKING, Any

from smartshoe.report.numbers import number, verdict, with_sd

if TYPE_CHECKING:
    from rich.console import Console


def _console(file: IO[str] | None) -> Console:
    from rich.console import Console

    found = Console(file=file, highlight=False, markup=False)
    return found if found.is_terminal else Console(file=file, highlight=False, markup=False, width=110)


def _print(console: Console, title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title), box=SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for index, name in enumerate(header):
        table.add_column(Text(name), justify="left" if index == 0 else "right", overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    console.print(table)


def print_identification(result: Mapping[str, Any], file: IO[str] | None = None) -> None:
    """Print a smartshoe.identification/1 object: parameters with error bars, fit and residual tests."""
    console = _console(file)
    rows = []
    named = {**result["parameters"], "delay": result["delay_s"]}
    named |= {f"offset of {name}": value for name, value in result.get("offsets", {}).items()}
    for name, parameter in named.items():
        low, high = parameter.get("ci95") or (None, None)
        interval = "–" if low is None or high is None else f"{number(low, 5)} to {number(high, 5)}"
        rows.append((name, with_sd(parameter), interval, str(parameter.get("unit", ""))))
    title = f"{result['unit'] or 'unit'}: {result['direction']}, {result['method']}"
    _print(console, title, ("parameter", "value ± sd", "95 % interval", "unit"), rows)
    settled = "settled" if result["converged"] else "NOT settled"
    error = result["rmse"]
    console.print(
        f"fit {number(result['fit_percent'], 4)} %, rmse {number(error['value'])} {error['unit']},"
        f" {settled} after {result['iterations']} iterations"
    )
    for name, test in result.get("residual_tests", {}).items():
        console.print(f"residuals, {name.replace('_', ' ')}: p = {number(test.get('p_value'), 2)}")
    for note in result.get("notes", ()):
        console.print(f"note: {note}")


_RATE_COLUMNS = (
    ("rmse_raw_n", "raw N"),
    ("rmse_static_n", "static N"),
    ("rmse_compensated_n", "comp. N"),
    ("improvement_percent", "P %"),
    ("improvement_over_static_percent", "over static %"),
    ("hysteresis_raw_percent", "hyst. raw %FS"),
    ("hysteresis_compensated_percent", "hyst. comp. %FS"),
    ("peak_error_n", "peak N"),
)


def rate_rows(result: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table by loading rate, the last row over everything."""
    header = ["rate N/s", "cycles", *(title for _, title in _RATE_COLUMNS), "delay ms"]
    rows = []
    for label, item in [
        *((number(item["rate_n_per_s"], 2), item) for item in result["rates"]),
        ("all", result["overall"]),
    ]:
        late = item.get("delay_s")
        cells = [number(item.get(key)) for key, _ in _RATE_COLUMNS]
        rows.append([label, str(item["cycles"]), *cells, number(None if late is None else 1e3 * late, 2)])
    return header, rows


def print_validation(result: Mapping[str, Any], file: IO[str] | None = None) -> None:
    """Print a smartshoe.validation/1 object: errors and hysteresis by loading rate."""
    console = _console(file)
    header, rows = rate_rows(result)
    _print(console, f"{result['unit'] or 'unit'}: rms errors by loading rate", header, rows)
    console.print(verdict(result["overall"]))


SUMMARY_HEADER = (
    "unit", "k1", "k2", "c", "raw N", "static N", "comp. N", "hyst. before %FS", "hyst. after %FS"
)  # fmt: skip


def summary_row(name: str, identification: Mapping[str, Any], validation: Mapping[str, Any]) -> list[str]:
    """A unit's line under `SUMMARY_HEADER`."""
    overall = validation["overall"]
    keys = ("rmse_raw_n", "rmse_static_n", "rmse_compensated_n")
    keys += ("hysteresis_raw_percent", "hysteresis_compensated_percent")  # type: ignore[assignment]
    parameters = [with_sd(identification["parameters"].get(key)) for key in ("k1", "k2", "c")]
    return [name, *parameters, *(number(overall.get(key)) for key in keys)]


def print_summary(units: Sequence[Mapping[str, Any]], file: IO[str] | None = None) -> None:
    """Print a line a unit from smartshoe.run/1's ``units`` (keys unit, identification, validation)."""
    rows = [summary_row(item["unit"], item["identification"], item["validation"]) for item in units]
    _print(_console(file), "units, rms errors in N", SUMMARY_HEADER, rows)
