"""A scenario's errors name the line on which the key stands."""

from __future__ import annotations

import tomllib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from smartshoe.runs.scenario.lines import line_of

TEXT = """\
title = "x"

[machine]
backend = "sim:instron"

[protocol.static]
hold_s = 5.0

[[unit]]
name = "a"
bladder = {k1 = 1.0}

[[unit]]
name = "b"
[unit.bladder]
k1 = 2.0
"""


def test_keys_are_found_where_they_stand() -> None:
    assert line_of(TEXT, ["title"]) == 1
    assert line_of(TEXT, ["protocol", "static", "hold_s"]) == 7
    assert line_of(TEXT, ["unit", 0, "bladder", "k1"]) == 11
    assert line_of(TEXT, ["unit", 1, "name"]) == 14
    assert line_of(TEXT, ["unit", 1, "bladder", "k1"]) == 16
    assert line_of(TEXT, ["unit", 1, "sensor"]) == 13
    assert line_of(TEXT, ["nowhere"]) is None


@given(st.lists(st.tuples(st.from_regex(r"[a-z]{1,6}", fullmatch=True), st.integers(0, 3)), min_size=1, max_size=6))
def test_every_key_of_generated_tables_is_found(tables: list[tuple[str, int]]) -> None:
    lines: list[str] = []
    expected: list[tuple[list[Any], int]] = []
    counts: dict[str, int] = {}
    for name, keys in tables:
        lines.append(f"[[{name}]]")
        index = counts[name] = counts.get(name, -1) + 1
        for key in range(keys):
            lines.append(f"k{key} = {key}")
            expected.append(([name, index, f"k{key}"], len(lines)))
    text = "\n".join(lines)
    parsed = tomllib.loads(text)
    for path, line in expected:
        assert parsed[path[0]][path[1]][path[2]] == int(path[2][1:])
        assert line_of(text, path) == line
