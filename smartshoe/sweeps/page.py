"""The page of a sweep: what drives the figures, how, and the worst cases with the command that repeats each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smartshoe.atomic import write_text
from smartshoe.report.numbers import plain
from smartshoe.sweeps import figures
from smartshoe.sweeps.drivers import Driver, drivers_of, main_figures, worst_first
from smartshoe.sweeps.plan import Plan
from smartshoe.sweeps.repeating import command_of

if TYPE_CHECKING:
    import pandas as pd

WORST = 8
SENTENCES = 10
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Section:
    """One figure of merit: its quantiles over the cases, what drives it, pictures, the worst cases."""

    figure: str
    quantiles: list[str]
    drivers: list[Driver]
    pictures: list[tuple[str, Markup]]
    worst: list[tuple[str, str]]


def write_page(path: Path, plan: Plan, table: pd.DataFrame) -> None:
    """Write the page to ``path``, whole or not at all; ``table`` is ``results.csv``."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("smartshoe.sweeps"), PackageLoader("smartshoe.report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters.update(plain=plain)
    main = main_figures(table, plan)
    failed = table[table["status"] == "failed"]
    sentences = failed.groupby("says", sort=False)["case"].agg(["size", "first"]).sort_values("size", ascending=False)
    page = environment.get_template("sweep.html").render(
        title=str(plan.base.get("title", "scenario")),
        about=str(plan.base.get("about", "")),
        facts={
            "scenario": plan.source.path.name,
            "design": plan.design.kind,
            "cases": str(len(plan)),
            "seeds": str(len(plan.design.seeds)),
            "smartshoe": plan.version,
        },
        keys=[(axis.key, _range_of(table, axis.key)) for axis in plan.design.axes],
        quantiles=[f"{100 * share:.0f} %" for share in QUANTILES],
        failed=len(failed),
        sentences=[
            (str(says), int(row["size"]), _command(plan, table, str(row["first"])))
            for says, row in sentences.head(SENTENCES).iterrows()
        ],
        sections=[_section(plan, table, figure) for figure in main],
    )
    write_text(path, page)


def _range_of(table: pd.DataFrame, key: str) -> str:
    """What a key takes, in a few words."""
    values = table[key].dropna().unique().tolist()
    if len(values) > 6 and all(isinstance(value, int | float) for value in values):
        return f"{plain(float(min(values)))} … {plain(float(max(values)))}"
    shown = ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values[:6])
    return shown + (" …" if len(values) > 6 else "")


def _command(plan: Plan, table: pd.DataFrame, case: str) -> str:
    return command_of(plan, int(table.index[table["case"] == case][0]))


def _section(plan: Plan, table: pd.DataFrame, figure: str) -> Section:
    found = drivers_of(table, plan, [figure])
    keys = [driver.key for driver in found]
    # The SVG comes from matplotlib, which escapes the texts it draws.
    pictures = [
        (caption, Markup(drawn))
        for caption, drawn in (
            ("Against each key: cases, median and quartiles.", figures.one_at_a_time(table, keys, figure)),
            ("Median over pairs of keys, the strongest first.", figures.pair_maps(table, keys, figure)),
        )
        if drawn is not None
    ]
    worst = [
        (plain(float(row[figure]), 4), command_of(plan, int(str(number))))
        for number, row in worst_first(table, figure, WORST).iterrows()
    ]
    quantiles = [plain(float(table[figure].quantile(share)), 4) for share in QUANTILES]
    return Section(figure, quantiles, found, pictures, worst)
