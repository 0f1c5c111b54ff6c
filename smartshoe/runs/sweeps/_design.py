"""The design of a sweep: the values of the varied keys, and the seed, of each case."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import ScenarioError
from smartshoe.files.gate import limits

Path = tuple[str | int, ...]
Refuse = Callable[[Path, str], ScenarioError]

SPREADS = "a list, {from = A, to = B, count = N}, {uniform = [A, B]} or {log_uniform = [A, B]}"


@dataclass(frozen=True, slots=True)
class Axis:
    """The values of one key: ``values`` if they are listed, otherwise a range (``low``, ``high``), linear or log."""

    key: str
    values: tuple[Any, ...] = ()
    low: float = 0.0
    high: float = 0.0
    is_log: bool = False

    @property
    def is_range(self) -> bool:
        """Whether values are drawn from a range."""
        return not self.values

    def at(self, share: float) -> Any:
        """The value at ``share`` in [0, 1) of the axis."""
        if self.values:
            return self.values[int(share * len(self.values))]
        if self.is_log:
            return float(math.exp(math.log(self.low) + share * (math.log(self.high) - math.log(self.low))))
        return float(self.low + share * (self.high - self.low))

    def ends(self) -> tuple[Any, ...]:
        """The values with which the axis is checked before anything runs: all listed ones, or the range's ends."""
        return self.values or (self.low, self.high)


@dataclass(frozen=True)
class SweepDesign:
    """All cases in order: the grid of the axes (the last axis varies fastest) or random draws, each with every seed.

    The first cases of a random design do not change when its count grows.
    """

    axes: tuple[Axis, ...]
    seeds: tuple[int, ...]
    kind: Literal["grid", "random"]
    count: int
    draw: int

    def __len__(self) -> int:
        return self.count * len(self.seeds)

    @cached_property
    def _shares(self) -> Array:
        return np.random.default_rng(self.draw).random((self.count, len(self.axes)))

    def values(self, case: int) -> dict[str, Any]:
        """The varied keys of a case (0-based) and their values."""
        row = case // len(self.seeds)
        if self.kind == "random":
            return {axis.key: axis.at(float(self._shares[row, j])) for j, axis in enumerate(self.axes)}
        found: dict[str, Any] = {}
        for axis in reversed(self.axes):
            row, index = divmod(row, len(axis.values))
            found[axis.key] = axis.values[index]
        return {axis.key: found[axis.key] for axis in self.axes}

    def seed(self, case: int) -> int:
        """The seed of a case (0-based)."""
        return self.seeds[case % len(self.seeds)]


def design_of(table: Any, scenario_seed: int, refuse: Refuse) -> SweepDesign:
    """The design in a scenario's ``[sweep]`` table; ``refuse(path, reason)`` makes the error to raise."""
    if not isinstance(table, dict):
        raise refuse(("sweep",), "there is no [sweep] here: add one with seeds, and [sweep.vary] with keys to vary")
    for key in table:
        if key not in ("seeds", "design", "count", "draw", "vary"):
            raise refuse(("sweep", key), "this key is not known; there are seeds, design, count, draw and vary")
    kind = table.get("design", "grid")
    if kind not in ("grid", "random"):
        raise refuse(("sweep", "design"), f"give 'grid' or 'random' (it is {kind!r})")
    axes = tuple(_axis(key, given, refuse) for key, given in _flat(table.get("vary", {}), refuse))
    seeds = _seeds(table.get("seeds", [scenario_seed]), refuse)
    if kind == "grid":
        for key in ("count", "draw"):
            if key in table:
                raise refuse(("sweep", key), 'means nothing in a grid: remove it, or give design = "random"')
        for axis in axes:
            if axis.is_range:
                raise refuse(
                    ("sweep", "vary", axis.key),
                    'a range is drawn from in a random design only: list the values, or give design = "random"',
                )
        count = math.prod(len(axis.values) for axis in axes)
        _bounded(count * len(seeds), ("sweep", "vary"), refuse)
        return SweepDesign(axes, seeds, "grid", count, 0)
    if not axes:
        raise refuse(("sweep", "vary"), "a random design needs keys to draw: add them")
    count = _counted(table.get("count"), ("sweep", "count"), refuse)
    _bounded(count * len(seeds), ("sweep", "count"), refuse)
    return SweepDesign(axes, seeds, "random", count, _whole(table.get("draw", 0), ("sweep", "draw"), 0, refuse))


def _whole(given: Any, path: Path, least: int, refuse: Refuse) -> int:
    if not isinstance(given, int) or isinstance(given, bool) or given < least:
        raise refuse(path, f"give a whole number from {least}" + ("" if given is None else f" (it is {given!r})"))
    return given


def _counted(given: Any, path: Path, refuse: Refuse) -> int:
    return _bounded(_whole(given, path, 1, refuse), path, refuse)


def _bounded(count: int, path: Path, refuse: Refuse) -> int:
    if count > limits().cases:
        raise refuse(path, f"more than {limits().cases} cases: give fewer, or raise the limit with --limit cases=N")
    return count


def _seeds(given: Any, refuse: Refuse) -> tuple[int, ...]:
    path: Path = ("sweep", "seeds")
    if isinstance(given, dict):
        if set(given) != {"from", "count"}:
            raise refuse(path, f"give a list, or {{from = 0, count = 100}} (it is {given!r})")
        first, count = _whole(given["from"], path, 0, refuse), _counted(given["count"], path, refuse)
        return tuple(range(first, first + count))
    if not isinstance(given, list) or not given:
        raise refuse(path, f"give a list of whole numbers, or {{from = 0, count = 100}} (it is {given!r})")
    seeds = tuple(_whole(seed, path, 0, refuse) for seed in given)
    if len(set(seeds)) < len(seeds):
        raise refuse(path, "a seed is there twice, which would be the same case: remove one")
    return seeds


def _flat(given: Any, refuse: Refuse, before: tuple[str, ...] = ()) -> list[tuple[str, Any]]:
    """The varied keys and their settings; a key may be a quoted text or, unquoted, dotted tables as TOML reads it."""
    if not isinstance(given, dict):
        raise refuse(("sweep", "vary", *before), f"give keys of the scenario with {SPREADS}")
    found: list[tuple[str, Any]] = []
    for name, inside in given.items():
        is_table = isinstance(inside, dict) and not ({"from", "uniform", "log_uniform"} & set(inside))
        if is_table and inside:
            found += _flat(inside, refuse, (*before, name))
        else:
            found.append((".".join((*before, name)), inside))
    return found


def _axis(key: str, given: Any, refuse: Refuse) -> Axis:
    path: Path = ("sweep", "vary", key)
    if key.split(".")[0] in ("seed", "sweep"):
        raise refuse(path, "cannot be varied here: seeds are given by seeds = [...] in [sweep]")
    if isinstance(given, list):
        if not given:
            raise refuse(path, "there is no value to take: list one at least")
        return Axis(key, tuple(given))
    if isinstance(given, Mapping):
        if set(given) == {"from", "to", "count"}:
            return Axis(key, _spaced(given, path, refuse))
        for name in ("uniform", "log_uniform"):
            if set(given) == {name}:
                low, high = _ends(given[name], path, name == "log_uniform", refuse)
                return Axis(key, (), low, high, name == "log_uniform")
    raise refuse(path, f"give {SPREADS} (it is {given!r})")


def _number(given: Any) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given)


def _spaced(given: Mapping[str, Any], path: Path, refuse: Refuse) -> tuple[Any, ...]:
    """``count`` evenly spaced values from ``from`` to ``to``; integers if both ends and the step are integers."""
    first, last = given["from"], given["to"]
    count = _counted(given["count"], path, refuse)
    if not (_number(first) and _number(last)):
        raise refuse(path, f"from and to must be numbers (they are {first!r} and {last!r})")
    if count == 1 and first != last:
        raise refuse(path, "one value cannot go from one number to another: give count = 2 or more")
    whole = isinstance(first, int) and isinstance(last, int) and (last - first) % max(count - 1, 1) == 0
    values = np.linspace(first, last, count).tolist()
    return tuple(round(value) for value in values) if whole else tuple(float(value) for value in values)


def _ends(given: Any, path: Path, is_log: bool, refuse: Refuse) -> tuple[float, float]:
    if not (isinstance(given, Sequence) and len(given) == 2 and all(_number(end) for end in given)):
        raise refuse(path, f"give two numbers [A, B] (it is {given!r})")
    low, high = (float(end) for end in given)
    if not low < high or (is_log and low <= 0.0):
        raise refuse(
            path, f"the first must be less than the second{', and above 0' if is_log else ''} (it is {given!r})"
        )
    return low, high
