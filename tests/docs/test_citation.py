"""What CITATION.cff says is what is installed."""

from __future__ import annotations

import re
from pathlib import Path

import smartshoe


def test_the_citation_names_this_version(root: Path) -> None:
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", text, re.MULTILINE) == [smartshoe.__version__]
    assert re.search(r"^license: MIT$", text, re.MULTILINE)
    assert "DSCC2016-9920" in text
