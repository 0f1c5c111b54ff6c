"""What cannot be told apart: the catalogue's plain equations, fitted to an effect alone and without noise."""

from __future__ import annotations

from typing import Any

from simulators.hidden_cases import BankCase


def with_what_cannot_be_told(case: BankCase) -> dict[str, Any]:
    """The case's truth with ``cannot_be_told_from`` and ``departure`` of each effect."""
    return case.truth
