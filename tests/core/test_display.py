"""How names stand in a sentence."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from smartshoe.display import LONGEST_NAME, MOST_LETTERS, MOST_NAMES, counted, first_names

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


def test_one_of_a_kind_has_no_plural() -> None:
    assert [counted(k, "infinite sample") for k in (0, 1, 2)] == [
        "0 infinite samples", "1 infinite sample", "2 infinite samples"
    ]  # fmt: skip
