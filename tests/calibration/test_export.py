"""The exported filter: compiled C against `Compensator.push`, MATLAB's and JSON's numbers, what a header says."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from c_code import compiled, needs_compiler, run_filters
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from smartshoe.calibration import Calibration
from smartshoe.calibration.export import TARGETS, FilterModel, export_files, write_files
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

K1, K2, X = 1.341, 0.215, 0.38113  # the paper's left toe, Chinimilli 2016, Table 1
LEFT_TOE = Calibration(
    K2, 1.0 + (K1 + K2) * X, K2 * (1.0 + K1 * X), MILLIBAR, offset=1.5, unit="left_toe", load_range_n=(0.0, 800.0),
    sources=({"name": "left_toe_dynamic.csv", "sha256": "0123abcd"},),
)  # fmt: skip
calibrations = st.builds(
    lambda a1, high, ratio, offset, rate: Calibration(
        a1, high, a1 * high * ratio, MILLIBAR, offset=offset, sample_rate_hz=rate, load_range_n=(0.0, 800.0)
    ),
    st.floats(0.01, 20.0),
    st.floats(0.1, 10.0),
    st.floats(0.3, 2.0),
    st.floats(-50.0, 50.0),
    st.floats(10.0, 1000.0),
)


def _self_test(folder: Path) -> subprocess.CompletedProcess[str]:
    sources = [folder / "smartshoe_filter.c", folder / "smartshoe_filter_test.c"]
    return subprocess.run([compiled(sources, folder / "check")], capture_output=True, text=True, check=False)


def _run_c(calibration: Calibration, readings: np.ndarray, folder: Path, precision: str = "double") -> np.ndarray:
    """Forces of the compiled filter, one push a sample."""
    write_files(export_files(calibration, "c", precision=precision), folder)
    return run_filters(folder, {"smartshoe_filter": readings})["smartshoe_filter"]


def _walk(n: int, seed: int = 3) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return 250.0 + np.cumsum(generator.normal(0.0, 4.0, n)) + 200.0 * np.sin(np.arange(n) / 40.0)


@needs_compiler
def test_20_000_samples_of_double_c_are_the_compensators(tmp_path: Path) -> None:
    readings = _walk(20_000)
    readings[:3] = np.nan, np.inf, -np.inf
    readings[np.random.default_rng(4).integers(0, 20_000, 300)] = np.nan
    filter_ = LEFT_TOE.compensator()
    expected_n = np.array([filter_.push(float(value)) for value in readings])
    forces_n = _run_c(LEFT_TOE, readings, tmp_path)
    assert np.all(forces_n[:3] == 0.0)
    assert np.max(np.abs(forces_n - expected_n)) <= 1e-12 * np.max(np.abs(expected_n))


@needs_compiler
@given(calibration=calibrations, seed=st.integers(0, 1000))
@settings(max_examples=12)
def test_double_c_is_the_compensator_for_any_calibration(calibration: Calibration, seed: int) -> None:
    readings = _walk(2000, seed)
    expected_n = calibration.compensator().push(readings)
    with tempfile.TemporaryDirectory() as name:
        forces_n = _run_c(calibration, readings, Path(name))
    assert np.max(np.abs(forces_n - expected_n)) <= 1e-12 * np.max(np.abs(expected_n))


@needs_compiler
@given(calibration=calibrations, precision=st.sampled_from(["double", "float"]), text=st.text(max_size=20))
@settings(max_examples=12)
def test_the_self_test_passes_for_any_calibration_and_name(calibration: Calibration, precision: str, text: str) -> None:
    named = Calibration(**{**vars(calibration), "unit": text, "sources": ({"name": text + "*//*??/", "sha256": None},)})
    with tempfile.TemporaryDirectory() as name:
        write_files(export_files(named, "c", precision=precision), name)
        done = _self_test(Path(name))
    assert done.returncode == 0, done.stdout


@needs_compiler
def test_the_self_test_fails_for_another_filter(tmp_path: Path) -> None:
    files = export_files(LEFT_TOE, "c", precision="float")
    other = export_files(Calibration(**{**vars(LEFT_TOE), "b1": LEFT_TOE.b1 * 1.001}), "c", precision="float")
    write_files(files | {"smartshoe_filter.c": other["smartshoe_filter.c"]}, tmp_path)
    done = _self_test(tmp_path)
    assert done.returncode == 1
    assert done.stdout.startswith("FAILED")


def _slow_signal() -> np.ndarray:
    """Half an hour at 100 Hz of slow ramps and holds up to 800 N, in mbar, in single precision."""
    level = [0.0, 1.0, 1.0, 0.3, 0.3, 0.8, 0.8, 0.0]
    at = np.interp(np.arange(180_000), np.linspace(0, 180_000, len(level)), level)
    return (1.5 + at * 800.0 / 1.511).astype(np.float32).astype(float)


@needs_compiler
def test_float_c_keeps_what_rounded_coefficients_lose(tmp_path: Path) -> None:
    readings = _slow_signal()
    filter_ = LEFT_TOE.compensator()
    expected_n = filter_.push(readings)
    worst_n = np.max(np.abs(_run_c(LEFT_TOE, readings, tmp_path, "float") - expected_n))

    def rounded(numerator: np.ndarray, denominator: np.ndarray) -> float:
        forces_n = lfilter(numerator, denominator, readings - 1.5, zi=[0.0])[0]
        return float(np.max(np.abs(forces_n - expected_n)))

    single_n = rounded(filter_.numerator.astype(np.float32), filter_.denominator.astype(np.float32))
    decimals_n = rounded(np.round(filter_.numerator, 4), np.round(filter_.denominator, 4))
    print(f"direct term plus state {worst_n:.2g} N, single {single_n:.2g} N, four decimals {decimals_n:.2g} N")
    # Below 1024 N single precision rounds by 3e-5 N: direct, its product, the offset's difference, the sum, the state.
    assert worst_n < 3e-4
    assert single_n > 30.0 * worst_n
    assert decimals_n > 10.0


@given(calibration=calibrations)
@settings(max_examples=30)
def test_direct_term_plus_state_is_the_same_filter(calibration: Calibration) -> None:
    model = FilterModel.of(calibration)
    readings = _walk(500)
    state, forces_n = model.state_gain * (readings[0] - calibration.offset), []
    for u in readings - calibration.offset:
        forces_n.append(model.numerator[0] * u + state)
        state += model.feed * u - model.leak * state
    assert np.allclose(forces_n, calibration.compensator().push(readings), rtol=0, atol=1e-9 * max(np.abs(forces_n)))


def test_json_holds_every_form_in_full(tmp_path: Path) -> None:
    text = export_files(LEFT_TOE, "json", sample_rate_hz=250.0)["smartshoe_filter.json"]
    found = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    filter_ = LEFT_TOE.compensator(250.0)
    assert found["schema"] == "smartshoe.export/1"
    assert found["sample_rate_hz"] == 250.0
    assert found["continuous"] == {"a1": LEFT_TOE.a1, "b0": LEFT_TOE.b0, "b1": LEFT_TOE.b1}
    assert found["discrete"]["numerator"] == filter_.numerator.tolist()
    assert found["discrete"]["denominator"] == filter_.denominator.tolist()
    assert found["sources"][0]["sha256"] == "0123abcd"
    form, u = found["direct_and_state"], 100.0
    assert form["direct"] * u + form["feed"] / form["leak"] * u == pytest.approx(100.0 * LEFT_TOE.b1 / LEFT_TOE.a1)
    readings = [float("nan") if value is None else value for value in found["test_vector"]["reading"]]
    assert filter_.push(np.array(readings)).tolist() == found["test_vector"]["force_n"]


@pytest.mark.parametrize("target", ["c", "matlab"])
def test_the_vector_beside_the_filter_is_the_compensators(target: str) -> None:
    text = export_files(LEFT_TOE, target)["smartshoe_filter_test.csv"]
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    readings = np.array([float(row["reading_mbar"]) for row in rows])
    forces_n = LEFT_TOE.compensator().push(readings)
    assert forces_n.tolist() == [float(row["force_n"]) for row in rows]
    assert np.isnan(readings).any()
    assert np.ptp(forces_n) > 700.0


def _matlab_numbers(text: str, name: str) -> list[float]:
    (found,) = re.findall(rf"^  {name} = \[?([^\];]+)\]?;", text, re.MULTILINE)
    return [float(word) for word in found.split(",")]


def test_matlab_holds_the_compensators_numbers() -> None:
    files = export_files(LEFT_TOE, "matlab")
    text, filter_ = files["smartshoe_filter.m"], LEFT_TOE.compensator()
    assert _matlab_numbers(text, "numerator") == filter_.numerator.tolist()
    assert _matlab_numbers(text, "denominator") == filter_.denominator.tolist()
    assert _matlab_numbers(text, "offset") == [1.5]
    for script in (files["smartshoe_filter.m"], files["smartshoe_filter_test.m"]):
        code = "\n".join(line for line in script.splitlines() if not line.lstrip().startswith("%"))
        assert len(re.findall(r"^\s*(?:function|if)\b", code, re.MULTILINE)) == len(re.findall(r"^\s*end$", code, re.M))
        assert all(code.count(a) == code.count(b) for a, b in ("()", "[]"))


@pytest.mark.parametrize("target", [target for target in TARGETS if target != "fmu"])
def test_every_file_says_where_it_comes_from(target: str) -> None:
    for text in export_files(LEFT_TOE, target, sample_rate_hz=50.0).values():
        for word in ("left_toe", "50.0 Hz", "0123abcd", "mbar", "smartshoe 0"):
            assert word in text


@pytest.mark.parametrize("rate_hz", [0.0, -5.0, float("nan"), float("inf"), 1e14])
def test_a_rate_that_cannot_be_run_is_refused(rate_hz: float) -> None:
    with pytest.raises(UsageError, match="sample_rate_hz"):
        export_files(LEFT_TOE, "c", sample_rate_hz=rate_hz)


def test_a_coefficient_beyond_single_precision_is_refused() -> None:
    with pytest.raises(UsageError, match="--precision double"):
        export_files(Calibration(**{**vars(LEFT_TOE), "b0": 1e39}), "c", precision="float")


def test_all_files_or_none(tmp_path: Path) -> None:
    (tmp_path / "b.h").mkdir()
    with pytest.raises(UsageError, match=r"b\.h"):
        write_files({"a.c": "1", "b.h": "2"}, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["b.h"]
