"""A calibration with an extended model: its file, its filter, and what compensates and validates with it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chains import BASELINE, EXACT, chain_of, some_conditions
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration, Compensator, ExtendedCompensator, compensated, extended_calibration
from smartshoe.calibration.validation import validate
from smartshoe.cli import run_command
from smartshoe.errors import InputError, UnitError
from smartshoe.files.logs import read, write
from smartshoe.models import Parameter
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

NAMES = ["play_hysteresis", "zero_drift", "linear_leak", "delay"]
MODEL = chain_of(NAMES, 7)
CALIBRATION = replace(
    extended_calibration(
        MODEL,
        unit="left_toe",
        serial_number="HT-0042",
        parameters={"a1": Parameter.from_sd(0.3, 0.01, "1/s")},
        covariance=((1e-4,),),
        created="2016-10-12",
    ),
    sources=({"name": "toe.csv", "sha256": "0123abcd"},),
)


def _recording(model: ExtendedModel, seed: int = 1) -> Recording:
    conditions = some_conditions(seed)
    return Recording.from_arrays(
        time_s=conditions.time_s, force_n=800.0 * conditions.load, pressure_mbar=model.reading(conditions), name="one"
    )


@given(names=st.lists(st.sampled_from(EXACT), max_size=3, unique=True), seed=st.integers(0, 999))
@settings(max_examples=10, deadline=None)
def test_the_filter_survives_the_file(tmp_path_factory: pytest.TempPathFactory, names: list[str], seed: int) -> None:
    calibration = extended_calibration(chain_of(names, seed), unit="left_toe")
    path = tmp_path_factory.mktemp("file") / "c.json"
    calibration.save(path)
    back = Calibration.load(path)
    assert back.to_dict() == calibration.to_dict()
    readings = _recording(calibration.model(), seed).sensor.values[:300]
    assert np.array_equal(back.compensator(100.0).apply(readings), calibration.compensator(100.0).apply(readings))


def test_the_file_adds_keys_only_where_they_are_needed() -> None:
    plain = replace(CALIBRATION, extended=None, serial_number="").to_dict()
    assert set(CALIBRATION.to_dict()) - set(plain) == {"extended", "serial_number"}
    assert "extended" not in plain
    assert CALIBRATION.to_dict()["serial_number"] == "HT-0042"
    assert set(CALIBRATION.to_dict()["extended"]["effects"]) == set(NAMES)


def test_a_file_says_when_drifts_are_held(tmp_path: Path) -> None:
    model = chain_of(["zero_drift", "gain_drift"], 3).held_after(300.0, ("gain_drift",))
    extended_calibration(model).save(tmp_path / "c.json")
    back = Calibration.load(tmp_path / "c.json").model()
    assert [back.part(name).until_s for name in ("zero_drift", "gain_drift")] == [300.0, math.inf]
    assert "held_after_s" not in chain_of(["zero_drift"], 3).to_dict()


def test_a_twin_simulates_and_does_not_compensate(tmp_path: Path) -> None:
    twin = chain_of(["play_hysteresis", "second_relaxation"], 3)
    calibration = replace(CALIBRATION, twin=twin)
    assert set(calibration.to_dict()) - set(CALIBRATION.to_dict()) == {"twin"}
    calibration.save(tmp_path / "c.json")
    back = Calibration.load(tmp_path / "c.json")
    assert back.to_dict() == calibration.to_dict()
    assert back.model().names == twin.names
    readings = _recording(MODEL).sensor.values[:300]
    assert np.array_equal(back.compensator(100.0).apply(readings), CALIBRATION.compensator(100.0).apply(readings))
    found = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    found["twin"]["gain"] = 0.0
    (tmp_path / "c.json").write_text(json.dumps(found), encoding="utf-8")
    with pytest.raises(InputError, match=r"twin\.gain"):
        Calibration.load(tmp_path / "c.json")


def test_the_kind_of_filter_follows_from_the_calibration() -> None:
    filter_ = CALIBRATION.compensator(250.0)
    assert isinstance(filter_, ExtendedCompensator)
    assert filter_.sample_rate_hz == 250.0
    assert filter_.reading_unit == MILLIBAR
    assert isinstance(replace(CALIBRATION, extended=None).compensator(), Compensator)


@given(gain=st.floats(0.1, 5.0), share=st.floats(0.01, 3.0), rate=st.floats(0.02, 5.0), offset=st.floats(-0.2, 0.2))
@settings(max_examples=20, deadline=None)
def test_the_linear_part_is_the_papers_equation_13(gain: float, share: float, rate: float, offset: float) -> None:
    model = ExtendedModel(gain, share, rate, 800.0, 180.0, "mbar")
    model = model.with_part(effect("zero_offset"), np.array([offset]))
    found = extended_calibration(model)
    conditions = some_conditions(2, 6, 1e-3)
    force_n = Compensator(found.a1, found.b0, found.b1, offset=found.offset, sample_rate_hz=1000.0).apply(
        model.reading(conditions)
    )
    # Bilinear against straight lines between samples: of second order, largest behind corners.
    assert np.max(np.abs(force_n / 800.0 - conditions.load)) < 2e-3 * share * rate
    assert found.scale == pytest.approx(found.b1 / found.a1, rel=1e-14)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"gain": 0.0}, "extended.gain"),
        ({"gain": "x"}, "extended.gain"),
        ({"relaxation_rate_per_s": -1.0}, "extended.relaxation_rate_per_s"),
        ({"full_scale_load_n": None}, "extended.full_scale_load_n"),
        ({"full_scale_reading": 0.0}, "extended.full_scale_reading"),
        ({"full_scale_reading": None}, "extended.full_scale_reading"),
        ({"reading_unit": 5}, "extended.reading_unit"),
        ({"surplus": 1.0}, "surplus"),
        ({"effects": []}, "extended.effects"),
        ({"effects": {"no_such_effect": {}}}, "no_such_effect"),
        ({"effects": {"linear_leak": {}}}, "leak_rate"),
        ({"effects": {"linear_leak": {"leak_rate": 0.1, "more": 1.0}}}, "extended.effects.linear_leak.more"),
        ({"held_after_s": []}, "extended.held_after_s"),
        ({"held_after_s": {"zero_drift": "x"}}, "extended.held_after_s.zero_drift"),
        ({"held_after_s": {NAMES[0]: -1.0}}, f"extended.held_after_s.{NAMES[0]}"),
        ({"effects": {"linear_leak": {"leak_rate": "x"}}}, "extended.effects.linear_leak.leak_rate"),
    ],
)
def test_a_damaged_model_is_refused_with_its_key(tmp_path: Path, change: dict[str, object], key: str) -> None:
    found = CALIBRATION.to_dict()
    found["extended"] = found["extended"] | change
    path = tmp_path / "c.json"
    path.write_text(json.dumps(found))
    with pytest.raises(InputError, match=key) as caught:
        Calibration.load(path)
    assert "c.json" in str(caught.value)


def test_a_recording_is_compensated_and_told_what_is_left() -> None:
    recording = _recording(MODEL)
    found = compensated(recording, CALIBRATION)
    error_n = found["force_estimate"].values - recording.force_n
    undelayed = compensated(_recording(MODEL.without("delay")), CALIBRATION)["force_estimate"].values
    assert np.max(np.abs(undelayed - recording.force_n)) < 1e-6
    assert np.sqrt(np.mean(error_n**2)) > 1.0
    assert any("delay is not compensated" in note for note in found.notes)
    assert any("linear_leak" in note for note in found.notes)


@pytest.mark.parametrize("late_s", [0.03, -0.05])
def test_a_calibrations_delay_is_the_time_by_which_the_reading_is_late(late_s: float) -> None:
    model = BASELINE.with_part(effect("delay"), np.array([late_s]))
    at = some_conditions(2)
    late, prompt = model.reading(at), BASELINE.reading(at)
    taken_back = np.interp(at.time_s + extended_calibration(model).delay_s, at.time_s, late)
    inside = slice(20, -20)
    assert np.max(np.abs(late - prompt)[inside]) > 1.0
    assert taken_back[inside] == pytest.approx(prompt[inside], abs=1e-6)


def test_a_calibrations_offset_is_the_reading_without_load() -> None:
    model = BASELINE.with_part(effect("zero_offset"), np.array([0.02]))
    rest = Conditions(0.01 * np.arange(5), np.zeros(5), 0.01)
    assert model.reading(rest) == pytest.approx(np.full(5, extended_calibration(model).offset), rel=1e-12)


def test_uneven_steps_give_the_same_force_whenever_the_recording_began() -> None:
    at = some_conditions(3, 4)
    uneven = np.flatnonzero(np.arange(at.time_s.size) % 7 != 3)
    readings = MODEL.reading(at)[uneven]
    now, later = (
        compensated(Recording.from_arrays(time_s=began_s + at.time_s[uneven], pressure_mbar=readings), CALIBRATION)[
            "force_estimate"
        ].values
        for began_s in (0.0, 1000.0)
    )
    assert np.ptp(now) > 100.0
    assert later == pytest.approx(now, abs=1e-6)


def test_uneven_steps_are_set_on_an_even_grid() -> None:
    conditions = some_conditions(3, 8, 1e-3)
    rng = np.random.default_rng(0)
    model = MODEL.without("delay")
    keep = np.unique(np.cumsum(rng.integers(6, 15, conditions.time_s.size // 12)))
    keep = np.concatenate([[0], keep[keep < conditions.time_s.size]])
    readings = model.reading(conditions)[keep]
    readings[40:43] = np.nan
    recording = Recording.from_arrays(time_s=conditions.time_s[keep], pressure_mbar=readings)
    found = compensated(recording, extended_calibration(model))
    error_n = found["force_estimate"].values - 800.0 * conditions.load[keep]
    # A corner between two samples is cut: half a step at 1600 N/s.
    assert np.max(np.abs(error_n)) < 16.0
    assert np.sqrt(np.mean(error_n**2)) < 1.0
    assert any("even grid" in note for note in found.notes)
    assert any("3 missing" in note for note in found.notes)


def test_the_extended_model_validates_better_than_its_linear_part() -> None:
    recording = _recording(MODEL.without("delay"))
    extended = validate(recording, CALIBRATION).overall.rmse_compensated_n
    plain = validate(recording, replace(CALIBRATION, extended=None)).overall.rmse_compensated_n
    assert extended < 1e-6
    assert plain > 1.0


def test_another_quantity_is_refused() -> None:
    with pytest.raises(UnitError, match="mbar"):
        compensated(Recording.from_arrays(time_s=[0.0, 0.01], pressure_v=[1.0, 2.0]), CALIBRATION)


@given(a1=st.floats(0.02, 5.0), gain=st.floats(0.3, 10.0), share=st.floats(0.01, 3.0), offset=st.floats(-20.0, 20.0))
@settings(max_examples=15, deadline=None)
def test_a_plain_calibration_simulates_forward_what_it_undoes(
    a1: float, gain: float, share: float, offset: float
) -> None:
    plain = Calibration(a1, gain * (1.0 + share), gain * a1, MILLIBAR, offset=offset, load_range_n=(0.0, 800.0))
    conditions = some_conditions(4, 5, 1e-3)
    force_n = plain.compensator(1000.0).apply(plain.model().reading(conditions))
    assert np.max(np.abs(force_n / 800.0 - conditions.load)) < 2e-3 * share * a1
    assert extended_calibration(plain.model()).offset == pytest.approx(offset)


def test_a_reading_that_falls_as_the_load_grows_is_compensated_by_its_file(tmp_path: Path) -> None:
    falling = replace(chain_of(["zero_offset", "play_hysteresis"], 7), full_scale_reading=-1200.0, reading_unit="ohm")
    path = tmp_path / "c.json"
    extended_calibration(falling).save(path)
    conditions = some_conditions(1)
    given = Recording.from_arrays(
        time_s=conditions.time_s,
        force_n=falling.full_scale_load_n * conditions.load,
        pressure_ohm=falling.reading(conditions),
    )
    assert given.sensor.values.min() < -600.0
    found = compensated(given, path)
    assert np.max(np.abs(found["force_estimate"].values - given.force_n)) < 1e-6
    assert validate([given], path).overall.rmse_compensated_n < 1e-6
    assert np.array_equal(Calibration.load(path).model().reading(conditions), falling.reading(conditions))


def test_coefficients_of_no_passive_solid_are_not_simulated() -> None:
    with pytest.raises(InputError, match="b0 and b1"):
        Calibration(0.2, 1.6, -0.3, MILLIBAR).model()
    assert BASELINE.parts == ()


def test_the_commands_take_an_extended_calibration_as_any_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    CALIBRATION.save("unit.json")
    write(_recording(MODEL.without("delay")), "walk.csv")
    assert run_command(["compensate", "walk.csv", "--calibration", "unit.json", "--out", "force.csv"]) == 0
    assert "delay is not compensated" in capsys.readouterr().err
    back = read("force.csv")
    assert np.max(np.abs(back["force_estimate"].values - back.force_n)) < 1e-3
    assert run_command(["validate", "walk.csv", "--calibration", "unit.json", "--json", "judged.json"]) == 0
    assert json.loads(Path("judged.json").read_text())["overall"]["rmse_compensated_n"] < 1e-3
    assert run_command(["export", "unit.json", "--to", "c", "--out", "c"]) == 0
    assert run_command(["export", "unit.json", "--to", "json", "--out", "json"]) == 0
    capsys.readouterr()
    assert run_command(["export", "unit.json", "--to", "matlab", "--out", "matlab"]) == 2
    assert "play_hysteresis" in capsys.readouterr().err.splitlines()[-1]
    assert not Path("matlab").exists()
