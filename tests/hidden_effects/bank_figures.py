"""What a bank's rows come to: the figures asked for, the table by effect and strength, the confusion matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bank import GRID_PERCENT, INSIDE, OUTSIDE, Row
from bank_scoring import Named, Score
from numpy.typing import NDArray

from simulators.hidden_effects import EFFECTS

Array = NDArray[np.float64]

CLEAR_PERCENT = 0.29  # "0.3 % of full scale or more": strengths are reached to within 2 %
BINS = 10
SURE = 0.95
NO_NAME = "no name"
PRIOR = 1e-3  # of the logistic regression's slopes: a ridge, so that rows that are all right have an optimum


@dataclass(frozen=True)
class Figure:
    """One line of the table: ``value`` in ``unit`` over ``count`` cases; ``more_is_better``, and what is asked."""

    name: str
    value: float
    unit: str
    count: int
    floor: float | None = None
    reach: float | None = None
    more_is_better: bool = True

    @property
    def met(self) -> bool | None:
        """Whether the floor is met; None where there is none, False where nothing was counted."""
        if self.floor is None:
            return None
        if not self.count or not np.isfinite(self.value):
            return False
        return self.value >= self.floor if self.more_is_better else self.value <= self.floor

    @property
    def cells(self) -> tuple[str, ...]:
        """Name, floor, reach, reached."""

        def said(value: float | None) -> str:
            return "" if value is None else f"{value:.4g} {self.unit}".strip()

        reached = f"{self.value:.3g} {self.unit}".strip() if self.count else "-"
        if np.isinf(self.value):
            reached = f"above {GRID_PERCENT[-1]:g} {self.unit}"
        return self.name, said(self.floor), said(self.reach), f"{reached} (of {self.count})"


def scored(rows: Iterable[Row], *kinds: str) -> list[tuple[Row, Score]]:
    """Rows of these sets with their score; a diagnosis that failed scores nothing and is counted by `failures`."""
    return [(row, row.score) for row in rows if row.kind in kinds and row.score is not None]


def failures(rows: Iterable[Row]) -> list[Row]:
    """Rows whose diagnosis raised."""
    return [row for row in rows if row.error]


def singles(rows: Iterable[Row], least: float = CLEAR_PERCENT) -> list[tuple[Row, Score]]:
    """Cases of one effect of at least ``least`` percent of full scale."""
    return [(row, one) for row, one in scored(rows, "single", "grid") if min(row.reached.values()) >= least]


def percent(flags: Iterable[bool]) -> float:
    """How many are true; NaN of none."""
    found = list(flags)
    return 100.0 * sum(found) / len(found) if found else float("nan")


def figures(rows: Sequence[Row], cpu_s: Sequence[float] = ()) -> list[Figure]:
    """The issue's table, and what stands beside it; ``cpu_s`` of diagnoses of 73,000 samples."""
    one, pairs = singles(rows), scored(rows, "pair")
    none, outside = scored(rows, "none"), scored(rows, "outside")
    clear = [*one, *pairs]
    physical = [(row, s) for row, s in one if _physical(row)]
    parameters = [p for _, s in clear for p in s.parameters]
    removed = [s.removed for _, s in clear if s.removed is not None]
    named = confidences(rows)

    def share(name: str, of: list[tuple[Row, Score]], right: Callable[[Score], bool], *asked: float) -> Figure:
        return Figure(name, percent(right(s) for _, s in of), "%", len(of), *asked)

    smallest = smallest_strength(rows)
    return [
        share("one effect, 0.3 % or more: exact name", one, lambda s: s.exact, 92.0, 97.0),
        share("one effect, 0.3 % or more: family", one, lambda s: s.family, 97.0, 99.5),
        share("  exact, or among the equivalents", one, lambda s: s.within_equivalents),
        share("  physical effects alone: exact name", physical, lambda s: s.exact),
        share("  physical effects alone: family", physical, lambda s: s.family),
        share("two effects: the exact set", pairs, lambda s: s.exact, 90.0, 95.0),
        share("  exact, or among the equivalents", pairs, lambda s: s.within_equivalents),
        share("  both families", pairs, lambda s: s.family),
        Figure(
            "a name given on data without an effect", percent(bool(s.wrong) for _, s in none), "%", len(none),
            2.0, 0.5, more_is_better=False,
        ),
        Figure(
            "  a fault of the data given there", percent(bool(s.false_faults) for _, s in none), "%", len(none),
            more_is_better=False,
        ),
        share(
            "outside the catalogue: given no name", outside, lambda s: not s.wrong and not s.false_faults, 85.0, 95.0
        ),
        share("  faults of the data not counted", outside, lambda s: not s.wrong),
        Figure(
            "calibration error of the confidence", calibration_error(named), "", len(named), 0.05, 0.02,
            more_is_better=False,
        ),
        Figure(
            "explainable held-out variance removed, mean", 100.0 * _mean(removed), "%", len(removed), 90.0, 95.0
        ),
        Figure("  median", 100.0 * _median(removed), "%", len(removed)),
        Figure(
            "smallest strength named right (family, 95 %)", smallest, "%", len(scored(rows, "grid")), 0.1, 0.05,
            more_is_better=False,
        ),
        Figure(
            "one diagnosis of 73,000 samples, one core, median", _median(cpu_s), "s", len(cpu_s), 4.0, 2.0,
            more_is_better=False,
        ),
        share("held-out gain above zero", clear, lambda s: s.gain_percent > 0),
        Figure("parameters within interval or 10 %", percent(p.right for p in parameters), "%", len(parameters)),
    ]  # fmt: skip


def _physical(row: Row) -> bool:
    return all(EFFECTS[name].family not in ("noise", "data", "saturation") for name in row.reached)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")


def smallest_strength(rows: Iterable[Row]) -> float:
    """The grid's smallest strength from which on upwards the family is right in 95 %; infinity where none is."""
    smallest = float("inf")
    for strength in reversed(GRID_PERCENT):
        cell = [s.family for row, s in scored(rows, "grid") if strength in row.asked.values()]
        if not cell or sum(cell) < SURE * len(cell):
            break
        smallest = strength
    return smallest


# -- confidence ----------------------------------------------------------------------------------------------------
def confidences(rows: Iterable[Row], *kinds: str) -> list[Named]:
    """Every cause named in these sets, or in all but the one for calibrating."""
    kinds = kinds or ("grid", "single", "pair", "none", "outside")
    return [one for _, s in scored(rows, *kinds) for one in s.named]


def reliability(named: Sequence[Named]) -> list[tuple[float, float, int]]:
    """(mean confidence, share right, count) in each of ten even bins that is not empty."""
    place = np.array([min(int(one.confidence * BINS), BINS - 1) for one in named])
    found = []
    for k in range(BINS):
        here = [one for one, at in zip(named, place, strict=True) if at == k]
        if here:
            found.append((_mean([o.confidence for o in here]), _mean([float(o.right) for o in here]), len(here)))
    return found


def calibration_error(named: Sequence[Named]) -> float:
    """Expected calibration error (Naeini, Cooper and Hauskrecht 2015): bins' gaps weighted by their counts."""
    if not named:
        return float("nan")
    return sum(n * abs(sure - right) for sure, right, n in reliability(named)) / len(named)


def logistic(named: Sequence[Named]) -> Array:
    """(3,) intercept, slope on ln margin, slope on ln fall of "the name was right", as `confidence` takes them."""
    from scipy.optimize import minimize

    fall = np.array([max(one.fall, 1.0) for one in named])
    margin = np.array([max(one.margin if np.isfinite(one.margin) else one.fall, 1.0) for one in named])
    X = np.column_stack([np.ones(len(named)), np.log(margin), np.log(fall)])
    sign = np.where([one.right for one in named], 1.0, -1.0)

    def loss(beta: Array) -> float:
        return float(np.sum(np.logaddexp(0.0, -sign * (X @ beta))) + PRIOR * np.sum(beta[1:] ** 2))

    return np.asarray(minimize(loss, np.zeros(3), method="BFGS").x)


# -- by effect -----------------------------------------------------------------------------------------------------
def by_effect(rows: Iterable[Row]) -> list[tuple[str, list[str]]]:
    """For each effect and strength of the grid: exact/family/count; the last column holds the set `single`'s."""
    rows = list(rows)
    table = []
    for name in INSIDE:
        cells = [
            _cell([s for row, s in scored(rows, "grid") if row.asked.get(name) == strength])
            for strength in GRID_PERCENT
        ]
        cells.append(_cell([s for row, s in scored(rows, "single") if min(row.reached.get(name, 0.0), 10) >= 0.29]))
        table.append((name, cells))
    return table


def _cell(found: Sequence[Score]) -> str:
    return f"{sum(s.exact for s in found)}/{sum(s.family for s in found)}/{len(found)}" if found else "-"


def given_names(row: Row, one: Score) -> set[str]:
    """What the case was called, nuisances that are there left out; `NO_NAME` where nothing is left."""
    names = {n.effect for n in one.named if n.effect in row.asked or not n.right} | set(one.false_faults)
    names |= {name for name in row.asked if name in one.faults}
    return names or {NO_NAME}


def confusion(rows: Iterable[Row]) -> tuple[list[str], list[str], Array]:
    """Truths (r,), names (c,) and the share (r, c) of a truth's cases, of 0.3 % and more, that were given a name."""
    found: dict[str, list[set[str]]] = {name: [] for name in (*INSIDE, *OUTSIDE, "no effect")}
    for row, one in [*singles(rows), *scored(rows, "outside"), *scored(rows, "none")]:
        found[next(iter(row.asked), "no effect")].append(given_names(row, one))
    said = {name for cases in found.values() for names in cases for name in names}
    columns = [*INSIDE, *sorted(said - set(INSIDE) - {NO_NAME}), NO_NAME]
    truths = [name for name, cases in found.items() if cases]
    share = np.array([[_mean([float(c in names) for names in found[t]]) for c in columns] for t in truths])
    return truths, columns, share.reshape(len(truths), len(columns))


def draw_confusion(rows: Iterable[Row], folder: Path) -> list[Path]:
    """The confusion matrix as confusion.png and confusion.svg in ``folder``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    truths, names, share = confusion(rows)
    canvas = Canvas(figsize=(0.3 * len(names) + 3.0, 0.28 * len(truths) + 3.2), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.add_subplot()
    right = np.array([[t == n or (n == NO_NAME and t not in INSIDE) for n in names] for t in truths])
    # Right names in blues, wrong ones in reds.
    for mask, colours in ((right, "Blues"), (~right, "Reds")):
        axes.pcolormesh(
            np.ma.masked_where(~mask | (share == 0), share), cmap=colours, vmin=-0.25, vmax=1.0, edgecolors="white"
        )
    for (r, c), value in np.ndenumerate(share):
        if value > 0:
            tone = "white" if value > 0.6 else "black"
            axes.text(c + 0.5, r + 0.5, f"{100 * value:.0f}", ha="center", va="center", size=6, color=tone)
    axes.set_xticks(np.arange(len(names)) + 0.5, [n.replace("_", " ") for n in names], rotation=90, size=8)
    axes.set_yticks(np.arange(len(truths)) + 0.5, [t.replace("_", " ") for t in truths], size=8)
    axes.set(xlim=(0, len(names)), ylim=(len(truths), 0), xlabel="name given", ylabel="truth")
    axes.set_title("Percent of a truth's cases (0.3 % of full scale and more) in which a name was given;\n"
                   "blue: right, red: wrong; nuisances that are there are left out", size=9)  # fmt: skip
    axes.tick_params(length=0)
    axes.set_facecolor("0.96")
    paths = [folder / "confusion.png", folder / "confusion.svg"]
    for path in paths:
        canvas.savefig(path, dpi=150)
    return paths
