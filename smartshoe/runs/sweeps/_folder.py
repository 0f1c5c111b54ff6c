"""A sweep's folder: the sweep it belongs to, the cases that are done, and the table made from them."""

from __future__ import annotations

import csv
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smartshoe.errors import InputError, UsageError
from smartshoe.files.atomic import json_text, make_folder, replacing, write_text
from smartshoe.runs.sweeps._design import design_of
from smartshoe.runs.sweeps._plan import SweepPlan

SCHEMA = "smartshoe.sweep/1"
LEFT_OVER_S = 3600.0  # age after which an unfinished file is no longer being written, but left by a killed process


@dataclass(frozen=True, slots=True)
class SweepFolder:
    """The folder ``path`` with ``sweep.json``, ``cases/NAME.json`` and ``results.csv``."""

    path: Path

    @property
    def cases(self) -> Path:
        """The folder of the cases."""
        return self.path / "cases"

    def claim(self, plan: SweepPlan) -> None:
        """Assign the folder to this plan; raises `UsageError` if it belongs to another sweep or another version.

        A plan that contains all cases of the earlier one continues the folder; so a sweep can grow.
        """
        make_folder(self.cases)
        note = self.path / "sweep.json"
        mine = {
            "schema": SCHEMA,
            "scenario": plan.source.path.name,
            "version": plan.version,
            "cases": len(plan),
            "base": plan.base,
            "sweep": _table_of(plan),
        }
        if note.is_file():
            theirs = self._note(note)
            if theirs["version"] != plan.version:
                raise UsageError(
                    f"{self.path} holds a sweep of smartshoe {theirs['version']}, this is {plan.version}:"
                    " choose another --out"
                )
            if theirs != json.loads(json_text(_plain(mine))):
                self._refuse_another(plan, theirs)
        elif any(self.done()):
            raise UsageError(
                f"{self.cases} holds cases of an unknown sweep ({note.name} is gone): choose another --out"
            )
        write_text(note, json_text(_plain(mine)))
        self._remove_unfinished()

    def _note(self, note: Path) -> dict[str, Any]:
        try:
            theirs = json.loads(note.read_text(encoding="utf-8"))
        except ValueError as error:
            raise UsageError(f"{note} is no sweep's ({error}): choose another --out") from error
        if not isinstance(theirs, dict) or theirs.get("schema") != SCHEMA or "sweep" not in theirs:
            raise UsageError(f"{note} is no sweep's: choose another --out")
        return theirs

    def _refuse_another(self, plan: SweepPlan, theirs: dict[str, Any]) -> None:
        mine = set(plan.names())
        old = SweepPlan(
            plan.source, theirs["base"], design_of(theirs["sweep"], 0, plan.source.error), theirs["version"]
        )
        foreign = sum(name not in mine for name in set(old.names()))
        if foreign:
            begun = "" if self.done() else "none is computed yet: remove it, or "
            raise UsageError(
                f"{self.path} holds another sweep ({theirs['scenario']}; {foreign} of its {len(old)} cases are not in"
                f" this one): {begun}choose another --out"
            )

    def _remove_unfinished(self) -> None:
        """Remove unfinished files of killed processes."""
        with os.scandir(self.cases) as entries:
            for entry in entries:
                is_partial = entry.name.startswith(".") and ".partial" in entry.name
                if is_partial and time.time() - entry.stat().st_mtime > LEFT_OVER_S:
                    Path(entry.path).unlink(missing_ok=True)

    def done(self) -> set[str]:
        """The names of the cases that are done; an empty file, as a power failure may leave it, does not count."""
        with os.scandir(self.cases) as entries:
            cases = (e for e in entries if e.name.endswith(".json") and not e.name.startswith("."))
            return {e.name[:-5] for e in cases if e.stat().st_size > 0}

    def put(self, name: str, text: str) -> None:
        """Write a case completely or not at all, without waiting for the disk.

        A case that is lost in a power failure is computed again.
        """
        write_text(self.cases / f"{name}.json", text, durable=False)

    def holds(self, name: str) -> bool:
        """Whether a case is done."""
        try:
            return (self.cases / f"{name}.json").stat().st_size > 0
        except FileNotFoundError:
            return False

    def read(self, name: str) -> dict[str, Any]:
        """A case's JSON; raises `InputError` if it is damaged."""
        file = self.cases / f"{name}.json"
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            if not isinstance(found["figures"], dict):
                raise ValueError("figures is no object")
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{file} is damaged ({error}): remove it and give the same command again") from error
        return dict(found)


def _table_of(plan: SweepPlan) -> dict[str, Any]:
    """The design as a ``[sweep]`` table that would produce it again."""
    design = plan.design
    vary: dict[str, Any] = {}
    for axis in design.axes:
        spread = {"log_uniform" if axis.is_log else "uniform": [axis.low, axis.high]}
        vary[axis.key] = spread if axis.is_range else list(axis.values)
    seeds = list(design.seeds)
    table: dict[str, Any] = {"seeds": seeds, "design": design.kind, "vary": vary}
    if seeds == list(range(seeds[0], seeds[0] + len(seeds))):
        table["seeds"] = {"from": seeds[0], "count": len(seeds)}
    return table if design.kind == "grid" else {**table, "count": design.count, "draw": design.draw}


def _plain(content: dict[str, Any]) -> dict[str, Any]:
    """The content with dates and times converted to text."""
    return dict(json.loads(json.dumps(content, default=str)))


def write_results(plan: SweepPlan, folder: SweepFolder) -> dict[str, str]:
    """Write ``results.csv``, a row for each case in the design's order; returns the kind of each column by name.

    A kind is "bool", "int", "float" or "text". Cases are read one at a time, twice, since the header comes first.
    """
    keys = [axis.key for axis in plan.design.axes]
    kinds: dict[str, str] = {}
    for name in plan.names():
        for figure, value in folder.read(name)["figures"].items():
            kinds[figure] = _wider_kind(kinds.get(figure), value)
    figures = list(kinds)
    with replacing(folder.path / "results.csv") as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*keys, "seed", *figures, "status", "says", "case"])
        for number, name in enumerate(plan.names()):
            case, values = folder.read(name), plan.design.values(number)
            own = case["figures"]
            kinds.update({key: _wider_kind(kinds.get(key), values[key]) for key in keys})
            writer.writerow(
                [
                    *(_cell(values[key]) for key in keys),
                    plan.design.seed(number),
                    *(_cell(own.get(figure)) for figure in figures),
                    case["status"],
                    case["says"] or "",
                    name,
                ]
            )
    return {**kinds, "seed": "int", "status": "text", "says": "text", "case": "text"}


def _wider_kind(kind: str | None, value: Any) -> str:
    """The narrowest kind of column that can hold values of ``kind`` and ``value``."""
    if value is None:
        return kind or ""
    own = {bool: "bool", int: "int", float: "float"}.get(type(value), "text")
    if not kind or kind == own:
        return own
    return "float" if {kind, own} == {"int", "float"} else "text"


def _cell(value: Any) -> Any:
    """A value as a cell of the table: numbers in full precision, None as empty, other objects as JSON."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    return value if isinstance(value, int | str) else json.dumps(value, default=str, ensure_ascii=False)
