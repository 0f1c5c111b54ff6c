"""The same examples come whatever is loaded: a failure seen once is seen again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

DRAWS = """
import hashlib
from hypothesis import HealthCheck, given, settings, strategies as st

drawn = []

@settings(max_examples=150, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(), st.floats())
def test_draw(whole, number):
    drawn.append(repr((whole, number)))

def test_digest(record_property):
    {load}
    test_draw()
    print("digest", hashlib.sha256("".join(drawn).encode()).hexdigest())
"""
CONSTANTS = "VALUES = (982451653, 'a very unusual text', 1234.5678, b'unusual bytes')\n"


def _digests(folder: Path, conftest: str) -> list[str]:
    """What is drawn without and with a module of the project loaded."""
    (folder / "conftest.py").write_text(conftest)
    (folder / "constants_of_ours.py").write_text(CONSTANTS)
    digests = []
    for load in ("pass", "import constants_of_ours"):
        (folder / "test_drawn.py").write_text(DRAWS.format(load=load))
        ran = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", "test_drawn.py::test_digest"],
            cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stdout
        digests.append(next(line for line in ran.stdout.splitlines() if "digest" in line))
    return digests


def test_a_module_that_was_loaded_before_changes_no_example(root: Path, tmp_path: Path) -> None:
    without, with_ = _digests(tmp_path, (root / "tests" / "conftest.py").read_text())
    assert without == with_


def test_left_alone_it_would(tmp_path: Path) -> None:
    """Else the test above could not fail."""
    providers = pytest.importorskip("hypothesis.internal.conjecture.providers")
    if not hasattr(providers, "_get_local_constants"):
        pytest.skip("this Hypothesis takes no constants from modules")
    without, with_ = _digests(tmp_path, "")
    assert without != with_
