"""A scenario's values by dotted key, as ``unit.left_toe.bladder.k1`` or ``protocol.dynamic.peak_n``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from smartshoe.errors import ScenarioError

Tables = dict[str, Any]
KeyPath = tuple[str | int, ...]


def path_of(tables: Mapping[str, Any], key: str) -> KeyPath:
    """The path of ``key`` in a scenario's tables: names of tables, and for a unit its index instead of its name.

    The last table and the key itself need not exist yet. Raises `ScenarioError` for a unit that does not exist.
    """
    parts = key.split(".")
    if not all(parts):
        raise ScenarioError(f"{key!r} is no key: give names with points between them, as unit.left_toe.bladder.k1")
    if parts[0] != "unit":
        return tuple(parts)
    units = tables.get("unit", [])
    names = [unit.get("name") if isinstance(unit, dict) else None for unit in units]
    if len(parts) < 3 or parts[1] not in names:
        there = ", ".join(str(name) for name in names)
        raise ScenarioError(f"{key!r} names no unit's key: give unit.NAME.KEY with a NAME of {there}")
    return ("unit", names.index(parts[1]), *parts[2:])


def with_values(tables: Tables, values: Mapping[str, Any]) -> Tables:
    """A copy of ``tables`` with ``values`` by key; missing tables are created.

    Raises `ScenarioError` for a key below a value that is not a table.
    """
    for key, value in values.items():
        tables = _replaced(tables, path_of(tables, key), value, key)
    return tables


def _replaced(inside: Any, path: Sequence[str | int], value: Any, key: str) -> Any:
    if not path:
        return value
    first, rest = path[0], path[1:]
    if isinstance(inside, list) and isinstance(first, int):
        return [*inside[:first], _replaced(inside[first], rest, value, key), *inside[first + 1 :]]
    if not isinstance(inside, dict):
        raise ScenarioError(f"{key!r} stands below a value, not a table: mend its spelling")
    return {**inside, first: _replaced(inside.get(first, {}) if rest else None, rest, value, key)}


def parse_assignments(assignments: Sequence[str]) -> dict[str, Any]:
    """Values by key from texts ``KEY=VALUE``; a value is read as TOML, or as plain text if it is none.

    Raises `ScenarioError` for a text without ``=``.
    """
    found: dict[str, Any] = {}
    for text in assignments:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"{text!r} sets nothing: give KEY=VALUE, as unit.left_toe.bladder.k1=1.5")
        try:
            found[key.strip()] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[key.strip()] = value.strip()
    return found
