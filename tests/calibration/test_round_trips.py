"""What docs/export.md says comes back of a trial and of a calibration is what comes back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import round_trips
from c_code import needs_compiler


@pytest.fixture(scope="module")
def said(root: Path) -> list[str]:
    """The lines of the page."""
    return (root / "docs" / "export.md").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("suffix", round_trips.TABLES)
def test_a_trial_comes_back_as_the_page_says(suffix: str, tmp_path: Path, said: list[str]) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    assert round_trips.table_row(suffix, tmp_path) in said


def test_a_trial_comes_back_of_c3d_as_the_page_says(tmp_path: Path, said: list[str]) -> None:
    pytest.importorskip("ezc3d")
    assert round_trips.c3d_row(tmp_path) in said


def test_a_trial_comes_back_of_motion_bids_as_the_page_says(tmp_path: Path, said: list[str]) -> None:
    assert round_trips.motion_bids_row(tmp_path) in said


@pytest.mark.parametrize(
    "row", [round_trips.calibration_row, round_trips.numbers_row, pytest.param(round_trips.c_row, marks=needs_compiler)]
)
def test_a_calibration_comes_back_as_the_page_says(row: Callable[[Path], str], tmp_path: Path, said: list[str]) -> None:
    assert row(tmp_path) in said
