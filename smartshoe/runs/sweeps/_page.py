"""The page of a sweep: what drives the figures, and the worst cases with the commands that repeat them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from smartshoe.report.charts import Chart
from smartshoe.report.document import write_document
from smartshoe.report.numbers import plain
from smartshoe.runs.sweeps._charts import against_key, over_pairs
from smartshoe.runs.sweeps._drivers import Driver, drivers_of, main_figures, what_drives, worst_first
from smartshoe.runs.sweeps._plan import SweepPlan
from smartshoe.runs.sweeps._repeating import command_of

if TYPE_CHECKING:
    import pandas as pd

WORST = 8
SENTENCES = 10
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Section:
    """One figure of merit: its quantiles over the cases, its drivers, charts, and the worst cases."""

    figure: str
    quantiles: list[str]
    says: str
    drivers: list[Driver]
    alone: Sequence[Chart]
    pairs: Sequence[Chart]
    worst: list[tuple[str, str]]


def write_page(path: Path, plan: SweepPlan, table: pd.DataFrame) -> None:
    """Write the page to ``path``, completely or not at all; ``table`` is ``results.csv``, or its main columns."""
    main = main_figures(table, plan)
    failed = table[table["status"] == "failed"]
    numbered = failed["says"].index.to_series().groupby(failed["says"], sort=False)
    sentences = numbered.agg(["size", "first"]).sort_values("size", ascending=False)
    sections = [_section(plan, table, figure) for figure in main]
    done = f"{len(plan) - len(failed)} of {len(plan)} cases done" if len(failed) else f"All {len(plan)} cases done"
    done = "The one case is done" if len(plan) == 1 and not len(failed) else done
    write_document(
        path,
        "sweep.html",
        {
            "title": str(plan.base.get("title", "scenario")),
            "about": str(plan.base.get("about", "")),
            "grade": "look" if len(failed) else "good",
            "headline": "; ".join([done, *(section.says for section in sections[:1])]),
            "facts": {
                "scenario": plan.source.path.name,
                "design": plan.design.kind,
                "cases": str(len(plan)),
                "seeds": str(len(plan.design.seeds)),
                "smartshoe": plan.version,
            },
            "keys": [(axis.key, _range_of(table, axis.key)) for axis in plan.design.axes],
            "shares": [f"{100 * share:.0f} %" for share in QUANTILES],
            "failed": len(failed),
            "sentences": [
                (str(says), int(row["size"]), command_of(plan, int(row["first"])))
                for says, row in sentences.head(SENTENCES).iterrows()
            ],
            "sections": sections,
            "command": f"smartshoe sweep {plan.source.path} --out {path.parent}",
        },
    )


def _range_of(table: pd.DataFrame, key: str) -> str:
    """The values of a key, as short text."""
    values = table[key].dropna().unique().tolist()
    if len(values) > 6 and all(isinstance(value, int | float) for value in values):
        return f"{plain(float(min(values)))} … {plain(float(max(values)))}"
    shown = ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values[:6])
    return shown + (" …" if len(values) > 6 else "")


def _section(plan: SweepPlan, table: pd.DataFrame, figure: str) -> Section:
    found = drivers_of(table, plan, [figure])
    keys = [driver.key for driver in found]
    worst = [
        (plain(float(row[figure]), 4), command_of(plan, int(str(number))))
        for number, row in worst_first(table, figure, WORST).iterrows()
    ]
    quantiles = [plain(float(table[figure].quantile(share)), 4) for share in QUANTILES]
    alone = [against_key(table, key, figure) for key in keys]
    return Section(figure, quantiles, what_drives(figure, found), found, alone, over_pairs(table, keys, figure), worst)
