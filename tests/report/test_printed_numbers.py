"""Numbers as a person reads them."""

from __future__ import annotations

import pytest

from smartshoe.report.numbers import plain, with_sd


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1234.5, 3, "1234"),
        (0.012345, 3, "0.0123"),
        (0, 3, "0"),
        (None, 3, "–"),
        (float("nan"), 3, "–"),
        (9.996, 3, "10.00"),
    ],
)
def test_numbers_are_short(value: float | None, digits: int, text: str) -> None:
    assert plain(value, digits) == text


def test_an_error_bar_sets_the_digits() -> None:
    assert with_sd({"value": 1.34098765, "sd": 0.000612}) == "1.34099 ± 0.00061"
    assert with_sd({"value": 2.0, "sd": None}) == "2.0000"
