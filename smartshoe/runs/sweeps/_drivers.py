"""Finds which varied key drives which figure, by rank correlations over the cases of a sweep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.runs.sweeps._plan import SweepPlan

if TYPE_CHECKING:
    import pandas as pd

MAIN = ("rmse_compensated_n", "trial.rmse_total_n.corrected", "explained_percent")
CLEAR = 0.01  # p value below which a dependence is reported
LOW_IS_BAD = ("explained_percent", "fit_percent", "improvement_percent", "improvement_over_static_percent")


@dataclass(frozen=True, slots=True)
class Driver:
    """How a figure depends on a key.

    ``strength`` is Spearman's rank correlation in [-1, 1] if the key is a number (``is_signed``), otherwise the
    correlation ratio of the figure's ranks over the key's values, in [0, 1]. ``p_value`` is that of no dependence
    (Spearman's test, or that of Kruskal and Wallis), with the other keys treated as chance.
    """

    key: str
    figure: str
    strength: float
    is_signed: bool
    p_value: float


def figures_in(table: pd.DataFrame, plan: SweepPlan) -> list[str]:
    """The columns that hold numeric figures which differ between cases."""
    own = {axis.key for axis in plan.design.axes} | {"seed", "status", "says", "case"}
    import pandas as pd

    numeric = [name for name in table.columns if name not in own and pd.api.types.is_numeric_dtype(table[name])]
    return [name for name in numeric if table[name].nunique() > 1]


def main_figures(table: pd.DataFrame, plan: SweepPlan) -> list[str]:
    """The figures at the top of the page: each unit's error after compensation, and the trial's."""
    there = figures_in(table, plan)
    return [name for name in there if name.endswith(MAIN)] or there[:1]


def drivers_of(table: pd.DataFrame, plan: SweepPlan, figures: list[str]) -> list[Driver]:
    """A `Driver` for each figure and key that take more than one value, the strongest first."""
    found: list[Driver] = []
    for figure in figures:
        for axis in plan.design.axes:
            there = table[[axis.key, figure]].dropna()
            if there[axis.key].nunique() > 1 and there[figure].nunique() > 1:
                found.append(_driver(there, axis.key, figure))
    return sorted(found, key=lambda driver: -abs(driver.strength))


def _driver(there: pd.DataFrame, key: str, figure: str) -> Driver:
    import pandas as pd
    from scipy.special import chdtrc, stdtr  # scipy.stats has both tests, but takes a second and 50 MB to import

    ranks, count = there[figure].rank(), len(there)
    if pd.api.types.is_numeric_dtype(there[key]) and not pd.api.types.is_bool_dtype(there[key]):
        rho = float(np.corrcoef(there[key].rank(), ranks)[0, 1])
        t = abs(rho) / np.sqrt(max((1.0 - rho**2) / max(count - 2, 1), np.finfo(float).tiny))
        p_value = float(2.0 * stdtr(count - 2, -t)) if count > 2 else float("nan")
        return Driver(key, figure, rho, True, p_value)
    groups = [own.to_numpy() for _, own in ranks.groupby(there[key])]
    between = sum(own.size * (own.mean() - ranks.mean()) ** 2 for own in groups)
    share = float(between / ((ranks - ranks.mean()) ** 2).sum())
    # With mid-ranks this is the statistic of Kruskal and Wallis, corrected for ties.
    return Driver(key, figure, float(np.sqrt(share)), False, float(chdtrc(len(groups) - 1, (count - 1) * share)))


def what_drives(figure: str, drivers: list[Driver]) -> str:
    """What drives the figure, as one clause; ``drivers`` are sorted, the strongest first."""
    clear = [driver for driver in drivers if driver.p_value < CLEAR]
    if not clear:
        return f"no varied key drives {figure} beyond chance"
    strongest = clear[0]
    way = "with" if strongest.strength > 0 else "against"
    if not strongest.is_signed:
        return f"{figure} depends most on {strongest.key} (correlation ratio {strongest.strength:.2f})"
    return f"{figure} goes most {way} {strongest.key} (rank correlation {strongest.strength:+.2f})"


def worst_first(table: pd.DataFrame, figure: str, count: int) -> pd.DataFrame:
    """The ``count`` rows with the worst values of ``figure``, the worst first."""
    ordered = table[figure].dropna().sort_values(ascending=figure.endswith(LOW_IS_BAD), kind="stable")
    return table.loc[ordered.index[:count]]
