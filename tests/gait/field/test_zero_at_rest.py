"""A zero is taken of a shoe that is unloaded, still and settled, and of no other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoes import RATE_HZ, foot_n, made

from smartshoe.errors import RefusedError, UsageError
from smartshoe.gait.field import check_zero, zero

NAMES = ("toe", "meta1", "meta4", "heel")
RANGE_MBAR = 200.0
NOISE_MBAR = 0.1
TIME_S = np.arange(600) / RATE_HZ


def still(offset: object = 0.0, seed: int = 0, noise: float = NOISE_MBAR) -> np.ndarray:
    return np.asarray(offset) + noise * np.random.default_rng(seed).standard_normal((TIME_S.size, 4))


def verdicts(readings: np.ndarray, **more: object) -> list[str]:
    return [item.verdict for item in check_zero(TIME_S, readings, NAMES, full_scale=RANGE_MBAR, **more)]  # type: ignore[arg-type]


def test_a_shoe_that_lies_there_is_zeroed() -> None:
    found = zero(TIME_S, still([1.0, -2.0, 0.5, 0.0]), NAMES, full_scale=RANGE_MBAR)
    # 600 samples of 0.1 mbar: 0.004 mbar, five of them.
    assert found == pytest.approx([1.0, -2.0, 0.5, 0.0], abs=0.02)


@given(st.integers(0, 10_000), st.floats(0.01, 1000.0))
def test_scale_does_not_matter(seed: int, factor: float) -> None:
    readings = still([0.0, 3.0, 0.0, 20.0], seed)
    ours = check_zero(TIME_S, readings, NAMES, full_scale=RANGE_MBAR)
    theirs = check_zero(TIME_S, readings * factor, NAMES, full_scale=RANGE_MBAR * factor)
    for one, other in zip(ours, theirs, strict=True):
        assert one.verdict == other.verdict
        assert other.reading / factor == pytest.approx(one.reading, rel=1e-6, abs=1e-6)


def test_the_sd_is_what_repeats_show() -> None:
    found = [check_zero(TIME_S, still(seed=k), NAMES, full_scale=RANGE_MBAR)[0] for k in range(200)]
    spread = np.std([item.reading for item in found])
    # An sd from 200 draws is known to 5 %, that of 12 blocks each to 21 %; their mean to 1.5 %.
    assert np.mean([item.sd for item in found]) == pytest.approx(spread, rel=0.2)


def test_a_foot_in_the_shoe_is_refused() -> None:
    standing = foot_n(made("stand", 10.0), "left")[-600:] / 800.0 * 170.0
    found = check_zero(TIME_S, standing + still(), NAMES, full_scale=RANGE_MBAR)
    assert any(item.verdict == "fault" for item in found)
    with pytest.raises(RefusedError, match="weight off"):
        zero(TIME_S, standing + still(), NAMES, full_scale=RANGE_MBAR)


def test_weight_on_one_unit_is_told_from_warm_air_on_all() -> None:
    assert verdicts(still([0.0, 0.0, 0.0, 20.0])) == ["ok", "ok", "ok", "fault"]
    # 8 K: 27 mbar on each.
    warm = check_zero(TIME_S, still(27.0), NAMES, full_scale=RANGE_MBAR)
    assert [item.verdict for item in warm] == ["warning"] * 4
    assert "as warm air would" in warm[0].says
    assert verdicts(still(60.0)) == ["fault"] * 4


def test_a_single_unit_has_no_neighbours_to_lean_on() -> None:
    (found,) = check_zero(TIME_S, still(27.0)[:, 0], ("heel",), full_scale=RANGE_MBAR)
    assert found.verdict == "fault"
    (found,) = check_zero(TIME_S, still(27.0)[:, 0], ("heel",), full_scale=RANGE_MBAR, expected=26.0)
    assert found.verdict == "ok"


def test_sway_is_refused() -> None:
    sway = 2.0 * np.sin(2.0 * np.pi * 0.5 * TIME_S)[:, None]
    found = check_zero(TIME_S, still() + sway, NAMES, full_scale=RANGE_MBAR)
    assert all("sways" in item.says for item in found)


def test_a_tube_that_still_settles_is_refused() -> None:
    settling = -1.2 * TIME_S[:, None] / TIME_S[-1]
    found = check_zero(TIME_S, still() + settling, NAMES, full_scale=RANGE_MBAR)
    assert all("settles" in item.says for item in found)


def test_a_reading_that_stands_still_on_its_lattice_is_a_zero() -> None:
    assert verdicts(still(0.05, noise=0.0)) == ["ok"] * 4


@pytest.mark.parametrize("count", [0, 1, 19, 150])
def test_too_little_is_said_and_not_used(count: int) -> None:
    found = check_zero(TIME_S[:count], still()[:count], NAMES, full_scale=RANGE_MBAR)
    assert {item.verdict for item in found} == {"unknown"}
    with pytest.raises(RefusedError, match="too short"):
        zero(TIME_S[:count], still()[:count], NAMES, full_scale=RANGE_MBAR)
    assert found[0].finding().to_dict()["numbers"]["reading"] is None


def test_a_unit_that_sends_nothing_is_said() -> None:
    readings = still()
    readings[:, 1] = np.nan
    found = check_zero(TIME_S, readings, NAMES, full_scale=RANGE_MBAR)
    assert [item.verdict for item in found] == ["ok", "fault", "ok", "ok"]
    assert "meta1 sent 0 samples" in found[1].says


def test_wrong_shapes_are_said() -> None:
    with pytest.raises(UsageError, match="shape"):
        check_zero(TIME_S, still()[:, :3], NAMES, full_scale=RANGE_MBAR)
    with pytest.raises(UsageError, match="full_scale"):
        check_zero(TIME_S, still(), NAMES, full_scale=0.0)
