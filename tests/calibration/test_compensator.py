"""The compensator, its bank and the calibration file."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration, Compensator, compensated, stack
from smartshoe.errors import InputError, UnitError, UsageError
from smartshoe.models import Parameter, discretise
from smartshoe.models.discretise import run_plainly
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

A1, B0, B1 = 0.215, 1.593, 0.3249
CALIBRATION = Calibration(
    A1, B0, B1, MILLIBAR, offset=1.5, unit="left_toe", created="2016-10-12",
    parameters={"a1": Parameter.from_sd(A1, 0.001, "1/s")}, covariance=((1e-6,),), load_range_n=(0.0, 800.0),
)  # fmt: skip
readings = st.lists(st.one_of(st.floats(-500, 500), st.just(float("nan")), st.just(float("inf"))), max_size=60)


@given(signal=readings, cuts=st.lists(st.integers(0, 60), max_size=6))
@settings(max_examples=60)
def test_any_chunking_gives_the_bits_of_apply(signal: list[float], cuts: list[int]) -> None:
    filter_ = Compensator(A1, B0, B1, offset=1.5)
    whole = filter_.apply(np.array(signal))
    parts = [filter_.push(part) for part in np.split(np.array(signal), sorted(cuts))]
    assert np.array_equal(np.concatenate(parts), whole)
    filter_.reset()
    assert [filter_.push(value) for value in signal] == whole.tolist()
    assert np.isfinite(whole).all()
    assert filter_.missing_count == int(np.count_nonzero(~np.isfinite(signal)))


@given(level=st.floats(-1e4, 1e4), offset=st.floats(-50, 50), rate=st.floats(1.0, 1000.0))
@settings(max_examples=40)
def test_a_static_load_is_compensated_without_bias_or_transient(level: float, offset: float, rate: float) -> None:
    force_n = Compensator(A1, B0, B1, offset=offset, sample_rate_hz=rate).apply(np.full(300, level))
    np.testing.assert_allclose(force_n, B1 / A1 * (level - offset), rtol=1e-9, atol=1e-8)


def test_the_filter_is_the_plain_loop() -> None:
    u = np.random.default_rng(0).standard_normal(500).cumsum()
    plain = run_plainly(*discretise(A1, B0, B1, 100.0), u)
    np.testing.assert_allclose(Compensator(A1, B0, B1).apply(u), plain, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(
    ("by", "is_refused"), [(1.0, False), (1.009, False), (0.991, False), (2.0, True), (0.98, True)]
)
def test_a_recording_at_another_rate_is_refused_and_its_own_named(by: float, is_refused: bool) -> None:
    time_s = np.arange(200) / (100.0 * by)
    walk = Recording.from_arrays(time_s=time_s, pressure_mbar=np.sin(time_s), name="walk")
    filter_ = CALIBRATION.compensator(100.0)
    if is_refused:
        with pytest.raises(UsageError, match=rf"walk has {100.0 * by:.5g} samples .* compensator\({100.0 * by:.5g}\)"):
            filter_.apply(walk)
    else:
        assert filter_.apply(walk) == pytest.approx(filter_.apply(np.sin(time_s)))


def test_what_is_no_reading_is_refused_and_leaves_the_stream_alone() -> None:
    one, other = Compensator(0.2, 5.0, 1.0), Compensator(0.2, 5.0, 1.0)
    for wrong in (None, "1", b"1", 1j, np.timedelta64(3, "s"), ["1", "2"]):
        with pytest.raises(InputError, match="readings: not all are real numbers"):
            one.push(wrong)  # type: ignore[call-overload]
    assert one.push([1.0, None]).tolist() == other.push(np.array([1.0, np.nan])).tolist()  # type: ignore[call-overload]
    assert (one.missing_count, one.push(2.0)) == (1, other.push(2.0))


def test_apply_leaves_the_stream_alone() -> None:
    one, other = Compensator(A1, B0, B1), Compensator(A1, B0, B1)
    first = one.push(np.array([1.0, 2.0]))
    one.apply(np.array([100.0, 5.0]))
    assert np.array_equal(np.append(first, one.push(3.0)), other.apply(np.array([1.0, 2.0, 3.0])))


def test_readings_before_the_first_give_no_force() -> None:
    assert Compensator(A1, B0, B1).apply(np.array([np.nan, np.nan, 10.0]))[:2].tolist() == [0.0, 0.0]


def test_a_bank_is_its_filters_side_by_side() -> None:
    filters = [Compensator(0.1 * n, B0, B1, offset=n) for n in (1, 2, 3, 4)]
    block = np.random.default_rng(1).standard_normal((50, 4))
    block[7, 2] = np.nan
    bank = stack(filters)
    ticks = np.stack([bank.push(tick) for tick in block])
    bank.reset()
    assert np.array_equal(bank.push(block), ticks)
    assert np.array_equal(ticks[:, 2], filters[2].apply(block[:, 2]))
    with pytest.raises(InputError, match=r"\(3,\)"):
        bank.push(np.zeros(3))
    with pytest.raises(UsageError):
        stack([])


def test_calibration_survives_its_file(tmp_path: Path) -> None:
    CALIBRATION.save(tmp_path / "c.json")
    assert Calibration.load(tmp_path / "c.json") == CALIBRATION


@given(cut=st.floats(0.0, 0.999))
@settings(max_examples=25)
def test_a_truncated_file_is_refused_by_name(tmp_path_factory: pytest.TempPathFactory, cut: float) -> None:
    path = tmp_path_factory.mktemp("cut") / "c.json"
    text = json.dumps(CALIBRATION.to_dict())
    path.write_text(text[: int(cut * len(text))])
    with pytest.raises(InputError, match=r"c\.json"):
        Calibration.load(path)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"schema": "other/1"}, "schema"),
        ({"model": {"kind": "extended"}}, "model.kind"),
        ({"model": {"kind": "first_order", "a1": "x", "b0": 1, "b1": 1}}, "model.a1"),
        ({"model": {"kind": "first_order", "a1": -1, "b0": 1, "b1": 1}}, "a1"),
        ({"offset": float("nan")}, "NaN"),
        ({"offset": None}, "offset"),
        ({"reading_unit": 3}, "reading_unit"),
        ({"covariance": [[1, 2]]}, "covariance"),
        ({"sources": 1}, "sources"),
        ({"parameters": {"a1": {"value": 1}}}, "parameters.a1"),
        ({"load_range_n": [1]}, "load_range_n"),
    ],
)
def test_a_foreign_or_damaged_file_is_refused_with_its_key(tmp_path: Path, change: dict[str, object], key: str) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(CALIBRATION.to_dict() | change))
    with pytest.raises(InputError, match=key) as caught:
        Calibration.load(path)
    assert "c.json" in str(caught.value)


def test_a_missing_reading_repeats_the_one_before_it_in_its_block_or_the_last() -> None:
    gappy, whole = Compensator(A1, B0, B1), Compensator(A1, B0, B1)
    for block, meant in (
        ([10.0, 20.0], [10.0, 20.0]),
        ([30.0, np.nan, np.inf, 40.0], [30.0, 30.0, 30.0, 40.0]),
        ([np.nan, 5.0, np.nan], [40.0, 5.0, 5.0]),
        ([np.nan], [5.0]),
    ):
        assert gappy.push(np.array(block)).tolist() == whole.push(np.array(meant)).tolist()
    assert gappy.missing_count == 5


@pytest.mark.parametrize("even", [True, False])
def test_a_recording_gains_a_finite_force_estimate(even: bool) -> None:
    rng = np.random.default_rng(2)
    time_s = np.arange(300) / 100 if even else np.cumsum(rng.uniform(0.005, 0.015, 300))
    force_n = 100 * np.sin(time_s) ** 2
    pressure = np.where(rng.random(300) < 0.1, np.nan, force_n)
    found = compensated(Recording.from_arrays(time_s=time_s, force_n=force_n, pressure_pa=pressure * 100), CALIBRATION)
    estimate = found["force_estimate"]
    assert np.isfinite(estimate.values).all()
    assert estimate.unit.symbol == "N"
    whole = compensated(Recording.from_arrays(time_s=time_s, pressure_pa=force_n * 100), CALIBRATION)
    assert np.max(np.abs(estimate.values - whole["force_estimate"].values)) < 20.0
    assert any("missing" in note for note in found.notes)


def test_volts_are_refused_by_a_calibration_for_pressure() -> None:
    recording = Recording.from_arrays(time_s=[0.0, 0.01], pressure_v=[1.0, 2.0])
    with pytest.raises(UnitError, match="mbar"):
        compensated(recording, CALIBRATION)
