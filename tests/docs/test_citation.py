"""What CITATION.cff says, and that what is installed knows its version."""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path

from packaging.version import Version

import smartshoe


def test_the_citation_names_licence_and_paper(root: Path) -> None:
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    assert not re.search(r"^version:", text, re.MULTILINE)  # it would be another one than the tag's
    assert re.search(r"^license: MIT$", text, re.MULTILINE)
    assert "DSCC2016-9920" in text


def test_the_installed_version_is_the_builds() -> None:
    assert Version(smartshoe.__version__) == Version(version("smartshoe"))
