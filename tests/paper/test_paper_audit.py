"""The audit of the paper: figures from independent arithmetic, and a page that quotes what the script prints."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simulators import paper_audit
from simulators.paper import TABLE_1, TABLE_2


def test_constants() -> None:
    assert paper_audit.x_over_nrt() == pytest.approx(4e-6 / (4.2075e-9 * 8.3145 * 300), rel=1e-12)
    assert paper_audit.air_volume_m3() * 1e9 == pytest.approx(0.1036, abs=5e-5)


@pytest.mark.parametrize("unit", TABLE_1)
def test_poles_follow_from_k2_and_numerators_do_not_follow(unit: str) -> None:
    k1, k2, n0, _, d1 = TABLE_1[unit]
    follows = paper_audit.from_stiffness(k1, k2)
    # exp(-k2 T) is the exact pole; the bilinear one differs by (k2 T)^3/12.
    assert -follows.d1 == pytest.approx(np.exp(-k2 / 100), abs=1e-8)
    assert round(follows.d1, 4) == pytest.approx(d1, abs=1.01e-4)
    assert abs(follows.n0 - n0) > 0.4


@pytest.mark.parametrize("unit", TABLE_2)
def test_improvements_recompute(unit: str) -> None:
    for said, found in paper_audit.improvement(unit):
        assert found == pytest.approx(said, abs=0.006)


@pytest.mark.parametrize("unit", ["right_toe", "left_heel"])
def test_no_random_raw_signal_beats_the_bound(unit: str) -> None:
    rng = np.random.default_rng(0)
    bounds = paper_audit.least_filtered_rmse(unit)
    filter_ = paper_audit.printed(unit)
    for (rate, raw, _, _), bound in zip(TABLE_2[unit], bounds, strict=True):
        time_s = np.arange(0.0, 1600.0 / rate, 0.01)
        load = 800.0 - np.abs(time_s * rate - 800.0)
        for shape in (
            -load,
            load,
            -np.ones_like(load),
            rng.normal(size=load.size),
            np.cumsum(rng.normal(size=load.size)),
        ):
            u = load + shape * raw / np.sqrt(np.mean(shape**2))
            assert np.sqrt(np.mean((filter_.run(u) - load) ** 2)) >= bound * (1 - 1e-6)


def test_the_page_quotes_what_the_script_prints(root: Path) -> None:
    printed = "\n".join(paper_audit.report())
    page = (root / "docs" / "paper_audit.md").read_text(encoding="utf-8")
    for figure in ("0.38113", "0.1036", "15165", "27.0 mbar", "22.6 N", "0.866", "467", "0.637", "0.787", "2.2694"):
        assert figure in printed
        assert figure in page
    for unit in TABLE_2:
        bounds = ", ".join(f"{value:.0f}" for value in paper_audit.least_filtered_rmse(unit))
        if unit.startswith("right"):
            assert bounds in page
    assert re.search(r"rounding .*: 32 N", printed)
