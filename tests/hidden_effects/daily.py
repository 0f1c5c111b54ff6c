"""Which of a test's cases run every day: of each kind one, chosen by its kind; the others are long, or of the bank."""

from __future__ import annotations

from collections.abc import Container, Iterable

import pytest


def first_and_bank(values: Iterable[object], first: Container[object]) -> list[object]:
    """Parameters of which all but ``first`` are of the bank."""
    return [value if value in first else pytest.param(value, marks=pytest.mark.bank) for value in values]


def first_and_long(values: Iterable[object], first: Container[object]) -> list[object]:
    """Parameters of which all but ``first`` are long: what they ask, others of the suite ask too."""
    return [value if value in first else pytest.param(value, marks=pytest.mark.long) for value in values]
