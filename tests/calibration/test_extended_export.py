"""The exported extended filter: compiled C against `ExtendedCompensator.push`, MATLAB's numbers, JSON's model."""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from c_code import needs_compiler, run_filters
from chains import DRIFTS, EXACT, INVERTIBLE, chain_of, some_conditions
from export_page import require_stated
from hypothesis import given, settings
from hypothesis import strategies as st
from test_export import _run_c, _self_test

from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.export import FilterModel, export_files, export_shoe, write_files
from smartshoe.calibration.export._single import in_single
from smartshoe.errors import UsageError
from smartshoe.models.effects.effect import CStep
from smartshoe.models.extended import ExtendedModel

SAMPLES = 20_000
PIECES = [INVERTIBLE[k::4] for k in range(4)]  # together every effect with an inverse


def _readings(model: ExtendedModel, seed: int) -> np.ndarray:
    """Noisy readings, some missing."""
    rng = np.random.default_rng(seed)
    readings = model.reading(some_conditions(seed, 160))[:SAMPLES]
    readings = readings + rng.normal(0.0, 0.1, readings.size)
    readings[rng.integers(0, readings.size, 200)] = np.nan
    readings[:2] = np.nan, np.inf
    return readings


def _differs(calibration: Calibration, readings: np.ndarray) -> float:
    expected_n = calibration.compensator().apply(readings)
    assert np.isfinite(expected_n).all()
    with tempfile.TemporaryDirectory() as name:
        forces_n = _run_c(calibration, readings, Path(name))
    return float(np.max(np.abs(forces_n - expected_n)) / np.max(np.abs(expected_n)))


@needs_compiler
@pytest.mark.parametrize("names", PIECES, ids=" ".join)
def test_20_000_samples_of_c_are_the_filters(names: list[str]) -> None:
    calibration = extended_calibration(chain_of(names, 11))
    readings = _readings(calibration.model(), 5)
    assert readings.size == SAMPLES
    assert _differs(calibration, readings) <= 1e-12


@needs_compiler
@given(
    names=st.lists(st.sampled_from(INVERTIBLE), max_size=4, unique=True),
    seed=st.integers(0, 1000), hz=st.sampled_from([50.0, 100.0, 333.0]),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_drawn_chains_in_c_are_the_filters(names: list[str], seed: int, hz: float) -> None:
    model = chain_of(names, seed)
    assert _differs(extended_calibration(model, sample_rate_hz=hz), _readings(model, seed)[:3000]) <= 1e-12


@needs_compiler
@given(
    names=st.lists(st.sampled_from([*INVERTIBLE, "delay"]), max_size=3, unique=True),
    seed=st.integers(0, 1000), text=st.text(max_size=10),
)  # fmt: skip
@settings(max_examples=6, deadline=None)
def test_the_self_test_passes_for_any_chain_and_name(names: list[str], seed: int, text: str) -> None:
    with tempfile.TemporaryDirectory() as name:
        write_files(export_files(extended_calibration(chain_of(names, seed), unit=text + "*//"), "c"), name)
        done = _self_test(Path(name))
    assert done.returncode == 0, done.stdout


@needs_compiler
@pytest.mark.parametrize("rail", [0.5, 1.0])
@pytest.mark.parametrize("knee", [1e-3, 0.08])
def test_a_bend_at_the_end_of_the_range_is_undone_in_c(knee: float, rail: float) -> None:
    model = chain_of([], 1).with_part("saturation", [0.5, 0.55, knee, rail])
    assert _differs(extended_calibration(model), _readings(model, 5)) <= 1e-12


@needs_compiler
@pytest.mark.parametrize(("precision", "most"), [("double", 1e-12), ("float", 1e-5)])
def test_drifts_that_are_held_are_so_in_c(precision: str, most: float, tmp_path: Path) -> None:
    calibration = extended_calibration(chain_of(DRIFTS, 11).held_after(20.0, ()))
    readings = _readings(calibration.model(), 5).astype(np.float32).astype(float)
    expected_n = calibration.compensator().apply(readings)
    forces_n = _run_c(calibration, readings, tmp_path, precision)
    assert np.max(np.abs(forces_n - expected_n)) <= most * np.max(np.abs(expected_n))
    going_on_n = extended_calibration(chain_of(DRIFTS, 11)).compensator().apply(readings)
    assert np.max(np.abs(going_on_n - expected_n)) > 100.0 * most * np.max(np.abs(expected_n))


@needs_compiler
def test_the_self_test_fails_for_another_strength(tmp_path: Path) -> None:
    model = chain_of(["play_hysteresis"], 1)
    moved = model.at(model.theta * np.where(np.arange(model.theta.size) == 3, 1.001, 1.0))
    files, other = (export_files(extended_calibration(one), "c") for one in (model, moved))
    write_files(files | {"smartshoe_filter.c": other["smartshoe_filter.c"]}, tmp_path)
    assert _self_test(tmp_path).returncode == 1


def test_a_header_says_what_is_in_the_filter_and_what_is_not() -> None:
    header = export_files(extended_calibration(chain_of(["linear_leak", "delay"], 1)), "c")["smartshoe_filter.h"]
    assert re.search(r"effect linear_leak: leak_rate = \S+ 1/s", header)
    assert "not compensated, delay:" in header
    assert "caution, linear_leak:" in header


@needs_compiler
def test_20_000_samples_of_every_block_in_single_precision(tmp_path: Path) -> None:
    calibrations = {name: extended_calibration(chain_of([name], 1), unit=name) for name in INVERTIBLE}
    write_files(export_shoe(list(calibrations.values()), "c", precision="float"), tmp_path)
    readings = {name: _readings(one.model(), 5).astype(np.float32).astype(float) for name, one in calibrations.items()}
    worst_n = {}
    for name, forces_n in run_filters(tmp_path, readings).items():
        expected_n = calibrations[name].compensator().apply(readings[name])
        worst_n[name] = float(np.max(np.abs(forces_n - expected_n)))
        assert worst_n[name] <= FilterModel.of(calibrations[name]).tolerance_n("float"), name
    print({name: f"{value:.2g} N" for name, value in worst_n.items()})
    assert max(worst_n.values()) <= 3e-4
    in_integers = {name for name in worst_n if "int64_t" in (tmp_path / f"{name}.c").read_text()}
    assert in_integers == {
        "rate_gain", "bouc_wen_hysteresis", "dead_band", "flexible_loop", "load_unload_asymmetry", "flexible_asymmetry",
        "flexible_softening", "flexible_set", "flexible_lag",
    }  # fmt: skip
    require_stated("chains with rate gain", 1, max(worst_n[name] for name in in_integers))
    require_stated("network, offsets", 1, max(value for name, value in worst_n.items() if name not in in_integers))


@needs_compiler
def test_the_self_test_in_single_precision_knows_another_strength(tmp_path: Path) -> None:
    model = chain_of(["play_hysteresis", "orifice_leak", "gas_compression"], 1)
    files = export_files(extended_calibration(model), "c", precision="float")
    write_files(files, tmp_path / "same")
    assert _self_test(tmp_path / "same").returncode == 0
    moved = model.at(model.theta * np.where(np.arange(model.theta.size) == 3, 1.01, 1.0))
    other = export_files(extended_calibration(moved), "c", precision="float")
    write_files({**files, "smartshoe_filter.c": other["smartshoe_filter.c"]}, tmp_path / "moved")
    assert _self_test(tmp_path / "moved").returncode == 1


@needs_compiler
def test_time_goes_on_before_the_first_reading_of_a_steep_chain(tmp_path: Path) -> None:
    """The test vector begins with missing readings; the integers' clock stood still for them."""
    calibration = extended_calibration(chain_of(["dead_band", "flexible_gain_drift"], 1))
    write_files(export_files(calibration, "c", precision="float"), tmp_path)
    assert "int64_t" in (tmp_path / "smartshoe_filter.c").read_text()
    done = _self_test(tmp_path)
    assert done.returncode == 0, done.stdout


def test_sums_over_a_session_carry_what_single_precision_rounds_away() -> None:
    # 0.1 N/s of leak at 1 kHz, an hour long: each increment is below half the spacing of a float at its end.
    step = CStep({"lost": 0.0}, "f->lost += 1e-07 * x;\nx += f->lost;")
    body = in_single(step).body
    assert "f->lost_carry" in body
    assert "double" not in body
    assert "1e-07f" in body
    assert in_single(CStep({"place": 0.0}, "x += f->place;")).states == {"place": 0.0}


def test_matlab_refuses_other_effects_by_name() -> None:
    with pytest.raises(UsageError, match=r"play_hysteresis.*--to c"):
        export_files(extended_calibration(chain_of(["play_hysteresis", "linear_leak"], 1)), "matlab")


def _matlab_number(text: str, name: str) -> np.ndarray:
    found = re.search(rf"^  {name} = (.*);$", text, re.MULTILINE)
    assert found is not None
    return np.array([[float(value) for value in row.split(",")] for row in found[1].strip("[]").split(";")])


def test_matlabs_numbers_give_the_filters_forces() -> None:
    calibration = extended_calibration(
        chain_of(["linear_leak", "gas_heat", "second_relaxation", "zero_offset", "load_cell_tare"], 2)
    )
    files = export_files(calibration, "matlab")
    text = files["smartshoe_filter.m"]
    names = ("transition", "drive", "read", "start")
    transition, drive, read, start = (_matlab_number(text, name) for name in names)
    names = ("direct", "reading_per_share", "full_scale_load", "reading_shift", "load_shift")
    direct, per_share, full_scale_n, offset, tare = (_matlab_number(text, name).item() for name in names)
    readings = _readings(calibration.model(), 3)[2:2000]
    readings = readings[np.isfinite(readings)]
    pressure = readings / per_share - offset
    state, forces_n = start * pressure[0], []
    for p in pressure:
        load = (p - (read @ state).item()) / direct
        state = transition @ state + drive * load
        forces_n.append(full_scale_n * (load - tare))
    np.testing.assert_allclose(forces_n, calibration.compensator().apply(readings), rtol=1e-10, atol=1e-9)


def test_json_holds_the_whole_model() -> None:
    calibration = extended_calibration(chain_of([*EXACT[:3], "delay"], 4))
    found = json.loads(
        export_files(calibration, "json")["smartshoe_filter.json"],
        parse_constant=lambda word: pytest.fail(f"{word} in JSON"),
    )
    model = ExtendedModel.from_dict(found["extended"]["model"])
    assert model.to_dict() == calibration.model().to_dict()
    assert found["kind"] == "extended"
    assert list(found["extended"]["not_inverted"]) == ["delay"]
    vector = found["test_vector"]
    readings = np.array([np.nan if value is None else value for value in vector["reading"]])
    assert extended_calibration(model).compensator().apply(readings).tolist() == vector["force_n"]
