"""Norms given by a laboratory: ranges of figures with their source, and which subjects lie outside them."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from smartshoe.errors import InputError

COLUMNS = ("figure", "low", "high", "source")


@dataclass(frozen=True, slots=True)
class Norm:
    """A norm: ``figure`` lies from ``low`` to ``high`` according to ``source``, under one ``condition`` or any ('')."""

    figure: str
    low: float
    high: float
    source: str
    condition: str = ""


@dataclass(frozen=True, slots=True)
class Compared:
    """A norm and the number of ``subjects`` compared with it under ``condition``; ``outside`` names those beyond it."""

    norm: Norm
    condition: str
    subjects: int
    outside: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """The comparison as an object for JSON."""
        outside = {"subjects": self.subjects, "within": self.subjects - len(self.outside), "outside": [*self.outside]}
        return {**asdict(self.norm), "condition": self.condition, **outside}


def read_norms(path: Path, conditions: Sequence[str]) -> list[Norm]:
    """The norms in a CSV file with columns figure, low, high, source and, optionally, condition.

    Raises `InputError`, naming the line, for an invalid row, and for a condition that is none of ``conditions``.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = csv.DictReader(file)
            lacking = [name for name in COLUMNS if name not in (rows.fieldnames or [])]
            if lacking:
                raise InputError(f"{path} lacks column {', '.join(lacking)}: give {', '.join(COLUMNS)}")
            found = [_norm(row, f"{path}, line {rows.line_num}") for row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} cannot be read as a table of norms ({error}): give a CSV file") from error
    for norm in found:
        if norm.condition and norm.condition not in conditions:
            raise InputError(f"{path}: no trial has condition {norm.condition!r}; there are {', '.join(conditions)}")
    return found


def _norm(row: Mapping[str, str | None], where: str) -> Norm:
    text = {name: (row.get(name) or "").strip() for name in (*COLUMNS, "condition")}
    try:
        low, high = float(text["low"]), float(text["high"])
    except ValueError as error:
        raise InputError(f"{where}: low and high are {text['low']!r} and {text['high']!r}: give two numbers") from error
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise InputError(f"{where}: from {low:g} to {high:g} is no range: give low, then high")
    for name in ("figure", "source"):
        if not text[name]:
            raise InputError(
                f"{where}: {name} is empty: " + ("name it" if name == "figure" else "say whose norm it is")
            )
    return Norm(text["figure"], low, high, text["source"], text["condition"])


def compared(norms: Sequence[Norm], means: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[Compared]:
    """Compare each norm with the subjects' means, given by condition, figure and subject.

    A norm whose figure no trial has is listed once, with 0 subjects.
    """
    found: list[Compared] = []
    for norm in norms:
        of = [norm.condition] if norm.condition else list(means)
        own = {condition: means[condition][norm.figure] for condition in of if norm.figure in means[condition]}
        for condition, subjects in own.items():
            outside = tuple(subject for subject, mean in subjects.items() if not norm.low <= mean <= norm.high)
            found.append(Compared(norm, condition, len(subjects), outside))
        if not own:
            found.append(Compared(norm, norm.condition, 0, ()))
    return found
