"""The filter in integers: the bound holds, the C is the integers' own arithmetic, ends saturate."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from c_code import needs_compiler, run_filters
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration
from smartshoe.calibration.export import FilterModel, export_files, write_files
from smartshoe.calibration.export._fixed_point import FixedPoint, Scaled
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

widths = st.sampled_from(["q15", "q31"])
calibrations = st.builds(
    lambda a1, high, ratio, offset, rate, load_n: Calibration(
        a1, high, a1 * high * ratio, MILLIBAR, offset=offset, sample_rate_hz=rate, load_range_n=(0.0, load_n)
    ),
    st.floats(0.05, 60.0),
    st.floats(0.1, 10.0) | st.floats(-10.0, -0.1),
    st.floats(0.3, 2.0),
    st.floats(-20.0, 20.0),
    st.floats(20.0, 1000.0),
    st.floats(50.0, 2000.0),
)
LEFT_TOE = Calibration(0.215, 1.593, 0.3249, MILLIBAR, offset=1.5, unit="left_toe", load_range_n=(0.0, 800.0))


def _shifted(product: int, shift: int) -> int:
    half = (1 << shift) >> 1
    assert abs(product) + half < 2**63
    return -((half - product) >> shift) if product < 0 else (product + half) >> shift


def _forces(fixed: FixedPoint, steps: list[int]) -> np.ndarray:
    """The slow twin of the C: Python's integers, which have no ends."""

    def times(constant: Scaled, value: int) -> int:
        return _shifted(constant.mantissa * value, constant.shift)

    state, out = times(fixed.start, steps[0]), []
    for step in steps:
        force = _shifted(times(fixed.direct, step) + state - fixed.bias, fixed.fraction)
        high = abs(state) >> fixed.split if state >= 0 else -(abs(state) >> fixed.split)
        low = state - (high << fixed.split)
        leaked = _shifted(fixed.leak.mantissa * high, fixed.leak.shift - fixed.split) + times(fixed.leak, low)
        state += times(fixed.feed, step) - leaked
        out.append(min(max(force, -fixed.most - 1), fixed.most))
    return np.array(out)


def _walk(fixed: FixedPoint, n: int, seed: int) -> np.ndarray:
    """Steps all over the range, held, drifting and jumping."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0.0, 0.02, n)) + np.repeat(rng.uniform(-1.0, 1.0, n // 100 + 1), 100)[:n]
    return np.rint(fixed.most * np.clip(walk, -1.0, 1.0)).astype(np.int64)


@given(calibration=calibrations, width=widths, seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_the_stated_bound_holds_for_any_calibration(calibration: Calibration, width: str, seed: int) -> None:
    try:
        fixed = FixedPoint.of(FilterModel.of(calibration), width)
    except UsageError:
        return  # said to be beyond the arithmetic: the next test says which are not
    steps = _walk(fixed, 1500, seed)
    exact_n = calibration.compensator().apply(steps * fixed.input_lsb)
    forces = _forces(fixed, steps.tolist())
    inside = np.abs(forces) < fixed.most
    error_n = np.abs(forces * fixed.output_lsb - exact_n)[inside]
    # The filter in double rounds too: by 2^-53 of its terms at each sample of its memory.
    double_n = 1e-12 * np.max(np.abs(exact_n)) / (1.0 - abs(FilterModel.of(calibration).denominator[1]))
    assert np.max(error_n, initial=0.0) <= fixed.rounding_n + double_n
    rng = np.random.default_rng(seed)
    between = steps * fixed.input_lsb + rng.uniform(-0.5, 0.5, steps.size) * fixed.input_lsb
    off_n = np.abs(forces * fixed.output_lsb - calibration.compensator().apply(between))[inside]
    assert np.max(off_n, initial=0.0) <= fixed.error_bound_n + double_n


@given(calibration=calibrations)
@settings(max_examples=100, deadline=None)
def test_32_bits_hold_any_calibration_to_a_millionth_of_its_load(calibration: Calibration) -> None:
    assert calibration.load_range_n is not None
    fixed = FixedPoint.of(FilterModel.of(calibration), "q31")
    assert fixed.error_bound_n <= 1e-6 * calibration.load_range_n[1]


@needs_compiler
@pytest.mark.parametrize("width", ["q15", "q31"])
@pytest.mark.parametrize(
    "calibration",
    [LEFT_TOE, Calibration(40.0, -3.0, -200.0, MILLIBAR, offset=-7.0, sample_rate_hz=25.0, load_range_n=(0.0, 300.0))],
    ids=["left_toe", "ringing"],
)
def test_the_c_is_the_integers_own_arithmetic_to_the_last_bit(calibration: Calibration, width: str) -> None:
    fixed = FixedPoint.of(FilterModel.of(calibration), width)
    steps = np.concatenate([_walk(fixed, 20_000, 3), [fixed.most] * 50, [-fixed.most - 1] * 50])
    with tempfile.TemporaryDirectory() as name:
        write_files(export_files(calibration, "c", fixed=width), name)
        assert "double" not in (Path(name) / "smartshoe_filter.c").read_text()
        (forces,) = run_filters(Path(name), {"smartshoe_filter": steps}).values()
    assert np.array_equal(forces, _forces(fixed, steps.tolist()))


@needs_compiler
def test_a_force_beyond_the_range_stays_at_its_end(tmp_path: Path) -> None:
    # Its direct gain is above its static one: a jump of readings that a load could still hold is beyond 16 bits.
    calibration = Calibration(0.2, 3.0, 0.2, MILLIBAR, load_range_n=(0.0, 800.0))
    fixed = FixedPoint.of(FilterModel.of(calibration), "q15")
    write_files(export_files(calibration, "c", fixed="q15"), tmp_path)
    (forces,) = run_filters(tmp_path, {"smartshoe_filter": np.array([0, 32767, -32768])}).values()
    assert forces.tolist() == [0, 32767, -32768]
    exact_n = calibration.compensator().apply(np.array([0, 32767, -32768]) * fixed.input_lsb)
    assert exact_n[1] > 32767 * fixed.output_lsb
    assert exact_n[2] < -32768 * fixed.output_lsb


def test_what_integers_cannot_hold_is_refused() -> None:
    # An offset of a thousand times the full scale leaves 16 bits no step for the load.
    with pytest.raises(UsageError, match=r"q15 cannot hold .* up to 2\d\.\d N: use --fixed q31"):
        FixedPoint.of(FilterModel.of(Calibration(**{**vars(LEFT_TOE), "offset": 5e5})), "q15")
    for to, options in (("json", {}), ("c", {"precision": "float"})):
        with pytest.raises(UsageError, match="leave it away"):
            export_files(LEFT_TOE, to, fixed="q15", **options)
    with pytest.raises(UsageError, match="q7"):
        export_files(LEFT_TOE, "c", fixed="q7")
