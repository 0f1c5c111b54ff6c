"""The plan of a sweep: the scenario of each case, and a name made from its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from smartshoe.errors import ScenarioError
from smartshoe.runs.scenario import (
    ScenarioKeyError,
    ScenarioText,
    Tables,
    check_simulated,
    checked,
    read_tables,
    with_values,
)
from smartshoe.runs.sweeps._design import SweepDesign, design_of
from smartshoe.version import __version__

UNSEEN = ("sweep", "title", "about")  # keys of a scenario that no figure depends on
NAME_DIGITS = 24  # of a case's name: 96 bits, so that names do not collide among 100,000 cases


@dataclass(frozen=True, slots=True)
class Case:
    """One case with everything that is needed to compute it in any process."""

    name: str
    source: str
    text: str
    tables: Tables
    values: Mapping[str, Any]
    seed: int
    version: str


@dataclass(frozen=True)
class SweepPlan:
    """A scenario and its design; ``base`` are the scenario's tables without ``[sweep]``."""

    source: ScenarioText
    base: Tables
    design: SweepDesign
    version: str = field(default_factory=lambda: __version__)
    _digests: dict[str, str] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.design)

    def tables(self, case: int) -> Tables:
        """The complete scenario of a case."""
        return {**with_values(self.base, self.design.values(case)), "seed": self.design.seed(case)}

    def name(self, case: int) -> str:
        """The case's name: a hash of its scenario, the files that it reads, its seed and the version of smartshoe."""
        return self._name_of(self.tables(case))

    def names(self) -> Iterator[str]:
        """The names of all cases, in the design's order; equal cases have equal names."""
        return (self.name(case) for case in range(len(self)))

    def case(self, number: int) -> Case:
        """The case as an object that can be sent to a worker."""
        tables = self.tables(number)
        return Case(
            self._name_of(tables),
            str(self.source.path.resolve()),
            self.source.text,
            tables,
            self.design.values(number),
            self.design.seed(number),
            self.version,
        )

    def _name_of(self, tables: Tables) -> str:
        seen = {key: value for key, value in tables.items() if key not in UNSEEN}
        files = {name: self._digest(name) for name in _files_of(tables)}
        return _hash({"scenario": seen, "files": files, "version": self.version})[:NAME_DIGITS]

    def _digest(self, name: str) -> str:
        if name not in self._digests:
            path = self.source.path.parent / name
            found = hashlib.sha256()
            for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
                if file.is_file():
                    found.update(file.read_bytes())
            self._digests[name] = found.hexdigest()
        return self._digests[name]

    def check(self) -> None:
        """Check each value of each key on its own by opening the scenario's devices; of a range, both ends.

        Raises `ScenarioError`, which names the key.
        """
        for axis in self.design.axes:
            try:
                with_values(self.base, {axis.key: None})
            except ScenarioError as error:
                raise self.source.error(("sweep", "vary", axis.key), str(error)) from error
        first = self.tables(0)
        for axis in self.design.axes:
            for value in axis.ends():
                try:
                    tables = with_values(first, {axis.key: value})
                    check_simulated(checked(tables, self.source), self.source)
                except ScenarioKeyError as error:
                    raise self._blame(axis.key, value, error) from error
                except ScenarioError as error:
                    raise self.source.error(("sweep", "vary", axis.key), str(error)) from error
        if not self.design.axes:
            check_simulated(checked(first, self.source), self.source)

    def _blame(self, key: str, value: Any, error: ScenarioKeyError) -> ScenarioError:
        """Attribute the error to ``key``, unless the scenario has the same error with its own value of that key."""
        others = {axis.key: axis.ends()[0] for axis in self.design.axes if axis.key != key}
        try:
            check_simulated(checked(with_values(self.base, others), self.source), self.source)
        except ScenarioError as other:
            if not isinstance(other, ScenarioKeyError) or other.reason == error.reason:
                return error
        return self.source.error(("sweep", "vary", key), f"with {value!r}, {error.reason}")


def read_plan(path: Path | str) -> SweepPlan:
    """Read and check the sweep in a scenario file; raises `ScenarioError`."""
    tables, source = read_tables(path)
    base = {key: value for key, value in tables.items() if key != "sweep"}
    seed = base.get("seed", 0)
    design = design_of(tables.get("sweep"), seed if isinstance(seed, int) else 0, source.error)
    plan = SweepPlan(source, base, design)
    plan.check()
    return plan


def _files_of(tables: Tables) -> list[str]:
    """The files that a scenario reads, as it names them: recordings, twins, and devices of type replay and log."""
    found: list[Any] = []
    for unit in tables.get("unit", []):
        found += unit.get("recordings", [])
        bladder = unit.get("bladder")
        found.append(bladder.get("twin") if isinstance(bladder, dict) else None)
    for table, key in (("machine", "backend"), ("trial", "shoe")):
        scheme, _, target = str(tables.get(table, {}).get(key, "")).partition(":")
        found.append(target if scheme in ("log", "replay") else None)
    return [name for name in found if isinstance(name, str)]


def _hash(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, default=str, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
