"""What a bank's rows come to: the figures asked for in each world, by effect or law, and the misses."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from judging import OUTSIDE_KINDS, Judgement, judge

Row = dict[str, Any]
Judged = tuple[Row, Judgement]

CLEAR_PERCENT = 0.29  # "0.3 % of full scale": strengths are reached to within some hundredths
NONE_KINDS = frozenset({"none", "clean"})
ONE_KINDS = frozenset({"single", "worlds"})
BINS = 10
SHOWN = 60


@dataclass(frozen=True)
class Figure:
    """One line: ``value`` in ``unit`` over ``count``, with what is asked (floor, reach) where something is."""

    name: str
    value: float
    unit: str
    count: int
    interval: tuple[float, float] | None = None
    floor: float | None = None
    reach: float | None = None
    more_is_better: bool = True
    key: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the floor is met; None where there is none or nothing was counted."""
        if self.floor is None or not self.count or not math.isfinite(self.value):
            return None
        return self.value >= self.floor if self.more_is_better else self.value <= self.floor

    @property
    def line(self) -> str:
        """As a row of a Markdown table."""
        value = f"{self.value:.3g} {self.unit}".strip() if self.count and math.isfinite(self.value) else "-"
        within = f" ({self.interval[0]:.0f}-{self.interval[1]:.0f})" if self.interval and self.count else ""
        asked = ", ".join(f"{v:g}" for v in (self.floor, self.reach) if v is not None)
        return (
            f"| {self.name} | {asked} | {value}{within}, of {self.count}{' **short**' if self.met is False else ''} |"
        )


# Floor and reach of the table, by world.
ASKED: dict[str, dict[str, tuple[float, float]]] = {
    "own": {
        "exact": (90, 97), "family": (95, 99.5), "two_families": (90, 97), "two_exact": (80, 92), "verdict": (90, 97),
        "none": (2, 0.5), "outside": (90, 97), "calibration": (0.03, 0.02), "area": (0.8, 0.8),
        "explained": (92, 97), "worse": (0, 0), "median": (1, 1), "worst": (5, 5),
    },
    "second_lab": {
        "exact": (90, 95), "family": (95, 99), "two_families": (88, 96), "two_exact": (75, 90), "verdict": (90, 96),
        "none": (2, 1), "outside": (85, 95), "calibration": (0.05, 0.03), "area": (0.75, 0.75),
        "explained": (90, 95), "worse": (0, 0), "median": (1.5, 1.5), "worst": (8, 8),
    },
}  # fmt: skip


def wilson(hits: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share, percent (Wilson 1927)."""
    if not count:
        return 0.0, 100.0
    p, z = hits / count, 1.96
    below = 1.0 + z * z / count
    middle = (p + z * z / (2 * count)) / below
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / below
    return 100.0 * (middle - half), 100.0 * (middle + half)


def calibration_error(names: Sequence[tuple[float, bool]]) -> float:
    """Mean gap of confidence and share that is right over ten bins (Naeini, Cooper and Hauskrecht 2015)."""
    if not names:
        return float("nan")
    bins: dict[int, list[tuple[float, bool]]] = defaultdict(list)
    for confidence, right in names:
        bins[min(int(BINS * confidence), BINS - 1)].append((confidence, right))
    return sum(abs(sum(c for c, _ in b) - sum(r for _, r in b)) for b in bins.values()) / len(names)


def area_under_curve(names: Sequence[tuple[float, bool]]) -> float:
    """The chance that a right name has more confidence than a wrong one, ties by half; NaN without one of either."""
    right = np.array([c for c, is_right in names if is_right])
    wrong = np.array([c for c, is_right in names if not is_right])
    if not right.size or not wrong.size:
        return float("nan")
    above = (right[:, None] > wrong[None, :]).mean() + 0.5 * (right[:, None] == wrong[None, :]).mean()
    return float(above)


def judged(rows: Iterable[Row]) -> list[Judged]:
    """Every row with its judgement, in the order of kinds and indices."""
    ordered = sorted(rows, key=lambda row: (row["world"], row["kind"], row["index"]))
    return [(row, judge(row)) for row in ordered]


def is_clear(row: Row) -> bool:
    """Whether every hidden effect has 0.3 % of full scale (a fault of data has no such measure)."""
    effects = row["truth"]["effects"]
    return all(e["strength_percent"] >= CLEAR_PERCENT or e["family"] == "data" for e in effects)


def is_zero_alone(row: Row) -> bool:
    """Whether nothing but a tare or an offset is hidden: the baseline's own offset has it, imperfections are left."""
    return {e["id"] for e in row["truth"]["effects"]} <= {"zero_offset", "load_cell_tare"}


def mean_share(shares: Sequence[float]) -> float:
    """Mean of shares explained in percent, each between -1 and 1."""
    return 100.0 * float(np.mean(np.clip(shares, -1, 1))) if shares else float("nan")


def figures(world: str, cases: Sequence[Judged]) -> list[Figure]:
    """The issue's table for one world."""
    asked = ASKED.get(world, {})
    one = [(r, j) for r, j in cases if r["kind"] in ONE_KINDS and is_clear(r)]
    two = [(r, j) for r, j in cases if r["kind"] == "two"]
    three = [(r, j) for r, j in cases if r["kind"] == "three"]
    alike = [(r, j) for r, j in cases if r["kind"] == "alike"]
    family = [(r, j) for r, j in cases if r["kind"] == "family"]
    hidden = [(r, j) for r, j in cases if r["kind"] in {*ONE_KINDS, "two", "three"} and is_clear(r)]
    none = [(r, j) for r, j in cases if r["kind"] in NONE_KINDS]
    outside = [(r, j) for r, j in cases if r["kind"] in OUTSIDE_KINDS]

    def share(
        name: str, key: str, of: Sequence[Judged], right: Callable[[Judgement], bool], down: bool = False
    ) -> Figure:
        hits = sum(right(j) for _, j in of)
        value = 100.0 * hits / len(of) if of else float("nan")
        return Figure(name, value, "%", len(of), wilson(hits, len(of)), *asked.get(key, (None, None)), not down, key)

    names = [pair for _, j in cases for pair in j.names]
    said = [pair for _, j in cases for pair in j.said_names]
    laws = [pair for _, j in cases for pair in j.laws]
    explained = [j.explained for _, j in hidden if j.explained is not None]
    beside_zeros = [j.explained for r, j in hidden if j.explained is not None and not is_zero_alone(r)]
    held = [j for r, j in cases if "verdict" in r["found"]]
    cpu = sorted(r["cpu_s"] for r, _ in cases)

    def plain(name: str, key: str, value: float, unit: str, count: int, down: bool) -> Figure:
        return Figure(name, value, unit, count, None, *asked.get(key, (None, None)), not down, key)

    return [
        share("one effect >= 0.3 %: exact, or among true equivalents", "exact", one, lambda j: j.exact),
        share("one effect >= 0.3 %: family", "family", one, lambda j: j.family),
        share("two effects: both families", "two_families", two, lambda j: j.family),
        share("two effects: exact set", "two_exact", two, lambda j: j.exact),
        share("two effects: all named", "", two, lambda j: j.all_named),
        share("three effects: all families", "", three, lambda j: j.family),
        share("three effects: exact set", "", three, lambda j: j.exact),
        share("two that imitate each other: both families", "", alike, lambda j: j.family),
        share("two that imitate each other: exact set", "", alike, lambda j: j.exact),
        share("two of one family: both named", "", family, lambda j: j.all_named),
        share("two of one family: exact set", "", family, lambda j: j.exact),
        share("verdict right", "verdict", [*one, *two, *three, *alike, *family, *none, *outside], lambda j: j.verdict),
        share("a name on data without an effect", "none", none, lambda j: bool(j.false), down=True),
        share("outside: flagged, and no name above 0.5", "outside", outside, lambda j: j.exact),
        share("cases with a false name", "", [*one, *two, *three], lambda j: bool(j.false), down=True),
        plain("calibration error of the confidence", "calibration", calibration_error(names), "", len(names), True),
        plain("area under its curve", "area", area_under_curve(names), "", len(names), False),
        plain("the same, of the name or its equivalents: error", "", calibration_error(said), "", len(said), True),
        plain("the same, of the name or its equivalents: area", "", area_under_curve(said), "", len(said), False),
        plain("the same of the law's: error", "", calibration_error(laws), "", len(laws), True),
        plain("the same of the law's: area", "", area_under_curve(laws), "", len(laws), False),
        plain("held-out variance explained, of what could be (mean)", "explained", mean_share(explained), "%",
              len(explained), False),
        plain("the same, without cases of a tare or an offset alone", "", mean_share(beside_zeros), "%",
              len(beside_zeros), False),
        share("an extension that makes held-out data worse", "worse", [(r, j) for r, j in cases if j in held],
              lambda j: j.worse, down=True),
        share("an extension rejected since it would", "", [(r, j) for r, j in cases if j in held],
              lambda j: j.rejected, down=True),
        plain("processor time, median", "median", float(np.median(cpu)) if cpu else float("nan"), "s", len(cpu), True),
        plain("processor time, worst", "worst", cpu[-1] if cpu else float("nan"), "s", len(cpu), True),
        share("a diagnosis that raised", "", cases, lambda j: j.raised, down=True),
    ]  # fmt: skip


def label(truth: Row) -> str:
    """A case in one line."""
    hidden = " + ".join(_effect(e) for e in truth["effects"]) or "nothing"
    small = ", ".join(
        v["effect"] + (f" {v['strength_percent']:.2f}" if v["strength_percent"] is not None else "")
        for v in [*truth["nuisances"], *truth["conditions"]]
    )
    files = "+".join(str(v).removesuffix(".csv") for v in truth["fit"])
    logged = f"{files}, zero {truth['zero']}, {truth['sample_rate_hz']:.0f} Hz"
    return f"{truth['kind']} {truth['index']}: {hidden} | {small} | {logged}"


def _effect(e: Row) -> str:
    departs = e.get("departure")
    like = f" ~{','.join(e['cannot_be_told_from'])}" if e["cannot_be_told_from"] else ""
    return (
        f"{e['id']}/{e['law']} {e['strength_percent']:.2f} %"
        + (f" dep {departs:.2f}" if departs is not None else "")
        + like
    )


def groups(cases: Sequence[Judged], by: str) -> list[tuple[str, list[Judged]]]:
    """Cases with effects by effect, by effect and law, or all by condition."""
    found: dict[str, list[Judged]] = defaultdict(list)
    for row, j in cases:
        truth = row["truth"]
        if by == "condition":
            for word in {f"zero {truth['zero']}", f"{truth['sample_rate_hz']:.0f} Hz",
                         *(f"with {v['effect']}" for v in truth["conditions"])}:  # fmt: skip
                found[word].append((row, j))
            continue
        for effect in truth["effects"]:
            found[f"{effect['id']} {effect['law']}" if by == "law" else effect["id"]].append((row, j))
    return sorted(found.items())


def report(rows: Sequence[Row], by: str = "effect") -> None:
    """Print the tables, each world apart."""
    every = judged([row for row in rows if row["world"] != "measured"])
    for world in dict.fromkeys(row["world"] for row, _ in every):
        cases = [(row, j) for row, j in every if row["world"] == world]
        print(f"\n## {world}: {len(cases)} cases\n\n| figure | asked | reached |\n| --- | --- | --- |")
        for figure in figures(world, cases):
            print(figure.line)
        for kind in dict.fromkeys(row["kind"] for row, _ in cases):
            here = [(row, j) for row, j in cases if row["kind"] == kind]
            verdicts = Counter(row["found"].get("verdict", "raised") for row, _ in here)
            says = ", ".join(f"{v} {k}" for v, k in verdicts.most_common())
            print(f"\n{kind}: {len(here)} cases; {says}; exact {sum(j.exact for _, j in here)}, family"
                  f" {sum(j.family for _, j in here)}, verdict right {sum(j.verdict for _, j in here)}, false names"
                  f" {sum(bool(j.false) for _, j in here)}, companions {sum(len(j.companions) for _, j in here)},"
                  f" faults of data that are not there {sum(bool(j.false_faults) for _, j in here)}")  # fmt: skip
        print(f"\n| {by} | cases | exact | family | verdict |\n| --- | --- | --- | --- | --- |")
        for name, here in groups(cases, by):
            print(f"| {name} | {len(here)} | {sum(j.exact for _, j in here)} | {sum(j.family for _, j in here)} |"
                  f" {sum(j.verdict for _, j in here)} |")  # fmt: skip
        missed = [(row, j) for row, j in cases if not (j.exact and j.verdict) or j.false]
        print(f"\nmisses ({len(missed)}):")
        for row, j in missed[:SHOWN]:
            flags = [w for w in ("exact", "family", "verdict") if not getattr(j, w)]
            missing, false = ", ".join(flags) or "-", ", ".join(j.false) or "-"
            print(f"- {label(row['truth'])}\n    not {missing}; false: {false}; said {j.said}")
    told = [row for row in rows if row["world"] == "measured"]
    if told:
        from bank_measured import table

        print(table(told))
