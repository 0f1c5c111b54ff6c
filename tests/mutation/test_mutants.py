"""The small bugs that `run_mutants` puts in: what they are, and that tests are told apart by them."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from mutants import changed, changes

HERE = Path(__file__).parent
SOURCE = '''
import os

BOUND = 0.5


def kept(values: list[float], handle: int, strict: bool = True) -> list[float]:
    """No docstring is changed: 1 < 2."""
    if not values or len(values) < 3:
        raise ValueError(f"{len(values) + 1} values: give 3")
    os.fsync(handle)
    return [value * 2.0 for value in values if value >= BOUND]
'''


def test_every_kind_of_small_bug_is_there_and_messages_are_left_alone() -> None:
    said = {(change.before, change.after) for change in changes(SOURCE)}
    for before, after in (
        ("BOUND = 0.5", "BOUND = 1.0"),
        ("os.fsync(handle)", "None"),
        ("if not values or len(values) < 3:", "if not values and len(values) < 3:"),
        ("if not values or len(values) < 3:", "if values or len(values) < 3:"),
        ("if not values or len(values) < 3:", "if not values or len(values) <= 3:"),
        ("if not values or len(values) < 3:", "if not values or len(values) < 4:"),
        ("return [value * 2.0 for value in values if value >= BOUND]", "return None"),
    ):
        assert (before, after) in said
    assert not [before for before, _ in said if "raise" in before or "docstring" in before or "import" in before]
    assert len(said) == 11


def test_each_change_is_made_alone_and_parses() -> None:
    plain = ast.unparse(ast.parse(SOURCE)).split("\n")
    for change in changes(SOURCE):
        lines = ast.unparse(changed(SOURCE, change.number)).split("\n")
        assert sum(old != new for old, new in zip(plain, lines, strict=True)) == 1


@pytest.mark.bank
def test_every_listed_bug_is_noticed_by_its_tests() -> None:
    words = [sys.executable, str(HERE / "run_mutants.py"), "--listed"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    print(done.stdout)
    assert "100 %" in done.stdout
    assert done.stderr == ""


def test_each_equivalent_mutant_is_one_of_the_source() -> None:
    """A line that is edited makes another mutant: then its entry goes, or is argued for anew."""
    entries = re.findall(r"([\w/]+\.py): (`[^`]*` → `[^`]*`)", (HERE / "equivalent.md").read_text(encoding="utf-8"))
    package = HERE.parent.parent / "smartshoe"
    files = {file for file, _ in entries}
    known = {file: {str(one) for one in changes((package / file).read_text("utf-8"))} for file in files}
    assert [f"{file}: {shown}" for file, shown in entries if shown not in known[file]] == []
