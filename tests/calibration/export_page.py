"""The figures of docs/export.md, for the tests that make them."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "export.md"
NUMBER = re.compile(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?(?![\w.])")


def stated(row: str, column: int = 1) -> list[float]:
    """The numbers in a cell of the page's one table row whose first cell begins with ``row``."""
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {row}")]
    assert len(rows) == 1, f"{PAGE.name} has {len(rows)} rows that begin with {row!r}"
    cell = rows[0].strip("| ").split("|")[column]
    return [float(number.replace(",", "")) for number in NUMBER.findall(cell)]


def require_stated(row: str, column: int, worst: float) -> None:
    """The page's largest number of the cell is ``worst``, rounded up to one digit or two and not by half."""
    told = max(stated(row, column))
    assert 0.5 * told <= worst <= 1.05 * told, f"{PAGE.name}, {row}: {told:g} is stated, {worst:g} was measured"
