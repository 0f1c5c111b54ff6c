"""How names stand in a sentence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.display import LONGEST_NAME, MOST_LETTERS, MOST_NAMES, counted, duration, first_names

NAME = st.text("abcdef_xyz", min_size=1, max_size=2 * LONGEST_NAME)


@given(st.lists(NAME, min_size=1, max_size=3 * MOST_NAMES))
def test_of_many_names_the_first_are_told_and_how_many_more_in_bounded_length(names: list[str]) -> None:
    told, _, more = first_names(names).partition(" and ")
    shown = told.split(", ")
    assert len(shown) + int(more.removesuffix(" more") or 0) == len(names)
    assert len(shown) <= MOST_NAMES
    assert len(told) <= max(MOST_LETTERS, LONGEST_NAME + 3)
    for name, as_told in zip(names, shown, strict=False):
        assert as_told == name if len(name) <= LONGEST_NAME else name.startswith(as_told.partition("...")[0])


@given(st.lists(st.text("abcde", min_size=1, max_size=7), min_size=1, max_size=MOST_NAMES))
def test_a_few_short_names_are_all_told(names: list[str]) -> None:
    assert first_names(names) == ", ".join(names)


@pytest.mark.parametrize(
    ("time_s", "told"),
    [(0.25, "0.25 s"), (52.2, "52.2 s"), (119.0, "119 s"), (120.0, "2 min"), (3000.0, "50 min"), (9000.0, "2.5 h")],
)
def test_a_duration_is_told_in_a_unit_of_its_size(time_s: float, told: str) -> None:
    assert duration(time_s) == told


def test_one_of_a_kind_has_no_plural() -> None:
    assert [counted(k, "infinite sample") for k in (0, 1, 2)] == [
        "0 infinite samples", "1 infinite sample", "2 infinite samples"
    ]  # fmt: skip
