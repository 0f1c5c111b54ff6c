"""A trial's sentences: a correction that makes it worse says so."""

from __future__ import annotations

from typing import Any

import pytest

from smartshoe.report.trial import notes


def _result(raw_n: float, corrected_n: float) -> dict[str, Any]:
    against = {"rmse_total_n": {"raw": raw_n, "corrected": corrected_n}, "order": None, "events": {}}
    return {"against_truth": against, "gait": {"flags": []}}


@pytest.mark.parametrize(("raw_n", "corrected_n", "worse"), [(10.0, 12.0, True), (10.0, 8.0, False)])
def test_a_correction_that_makes_a_trial_worse_says_so(raw_n: float, corrected_n: float, worse: bool) -> None:
    assert any("makes this trial worse" in note for note in notes(_result(raw_n, corrected_n))) == worse
