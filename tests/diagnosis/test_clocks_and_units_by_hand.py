"""Clocks, kinds of noise and parameters' units: by numbers that are put in, at the very bounds that decide."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm
from told_noise import kinds_of_noise

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._aligned import _on_one_clock
from smartshoe.diagnosis._parameters import _scaled, joint_parameters, parameters_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.effects.effect import EffectParameter
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Channel, Recording
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(0.8, 0.1, 0.22, 800.0, 140.0, "mbar")
SCALE = Scale(800.0, 140.0, MILLIBAR)
MANY = float(norm.isf(0.5 * STANDARD.false_alarm))


# -- clocks -----------------------------------------------------------------------------------------------------------
T = 0.05 * np.arange(400)


def _run(name: str = "run", size: int = 400) -> Recording:
    return Recording.from_arrays(time_s=T[:size] + 3.0, force_n=T[:size], pressure_mbar=10.0 * T[:size], name=name)


def test_a_reading_is_moved_by_its_lag_about_the_middle_and_masked_where_none_was_taken() -> None:
    """Its clock shows the middle late by the lag, and runs fast by the rate; a wild sample lies between two others."""
    kept = np.ones(400, dtype=bool)
    kept[200] = False
    run = _run()
    wild = replace(run.sensor, values=np.where(kept, run.sensor.values, 1e6))
    for offset_s, rate in ((0.52, 0.0), (-0.52, 0.0), (0.2, 0.01), (-0.2, -0.02)):
        moved, usable = _on_one_clock(run.with_channel(wild), kept, offset_s, rate)
        middle = 0.5 * (T[0] + T[-1])
        source = T + offset_s + rate * (T - middle)
        inside = (source >= 0.0) & (source <= T[-1])
        assert moved.sensor.values[usable] == pytest.approx(10.0 * source[usable])
        assert list(usable) == list(inside & (np.abs(source - T[200]) >= T[1] - 1e-9))
        assert list(moved.sensor.present) == list(inside)
        assert list(moved.force_n) == list(run.force_n)


def test_what_is_missing_stays_so_where_a_reading_is_moved() -> None:
    run = _run()
    holed = Channel.from_values("pressure", np.where(np.arange(400) == 200, np.nan, run.sensor.values), MILLIBAR)
    moved, _ = _on_one_clock(run.with_channel(replace(holed, role="sensor")), holed.present, 0.52, 0.0)
    there = moved.sensor.present
    assert moved.sensor.values[there] == pytest.approx(10.0 * (T[there] + 0.52))
    assert list(np.flatnonzero(~there[:380])) == [189, 190]


# -- kinds of noise ---------------------------------------------------------------------------------------------------
def _fine(index: int, usable: bool = True) -> Any:
    kept = np.ones(20, dtype=bool)
    kept[3] = usable
    run = SimpleNamespace(time_s=np.array([5.0, 6.0]), label=f"run {index}")
    conditions = SimpleNamespace(step_s=0.1, time_s=0.1 * np.arange(20))
    return SimpleNamespace(
        index=index, usable=kept, conditions=conditions, reading=np.full(20, 3.0), recording=run, fitted=kept
    )


def _kinds(monkeypatch: pytest.MonkeyPatch, sessions: list[Any], **given: Any) -> list[Any]:
    asked: list[Any] = []

    def evidence(kind: str, strength: float) -> Any:
        def told(self: Any, residual: Array, conditions: Any, prediction: Array) -> Any:
            asked.append((float(residual[0]), float(prediction[0]), conditions.step_s))
            return SimpleNamespace(strength=strength, says=f"says {kind}", lines_hz=())

        return told

    strengths = {"hum": 0.5, "timing_jitter": 0.1, "heteroscedastic_noise": 0.0999, "coloured_noise": 0.3}
    for kind, strength in strengths.items():
        monkeypatch.setattr(type(effect(kind)), "evidence", evidence(kind, strength))
    model: Any = SimpleNamespace(simulate=lambda conditions: np.full(20, 1.0))
    asked_with = {"known": [], "explained": True, "material": 0.1, "memory": None, **given}
    found = kinds_of_noise(sessions, model, **asked_with)
    assert set(asked) <= {(2.0, 1.0, 0.1)}
    return found


def test_kinds_as_strong_as_what_counts_are_told_throughout(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _kinds(monkeypatch, [_fine(4)])
    assert [one.kind for one in found] == ["hum", "timing_jitter", "coloured_noise"]
    assert (found[0].recording, found[0].says, found[0].severity) == (4, "says hum", "minor")
    assert (found[0].start_s, found[0].stop_s, found[0].share) == (5.0, pytest.approx(6.9), 1.0)
    unexplained = _kinds(monkeypatch, [_fine(4)], explained=False)
    assert [one.kind for one in unexplained] == ["hum", "timing_jitter"]


def test_where_a_fault_imitates_noise_none_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fault(kind: str, recording: int = 4) -> Any:
        return SimpleNamespace(kind=kind, recording=recording, lines_hz=())

    for kind in ("held_samples", "dropouts", "spikes", "gaps", "uneven_sampling"):
        assert _kinds(monkeypatch, [_fine(4)], known=[fault(kind)]) == []
        assert len(_kinds(monkeypatch, [_fine(4)], known=[fault(kind, 3)])) == 3
    assert [one.kind for one in _kinds(monkeypatch, [_fine(4)], known=[fault("hum")])] == [
        "timing_jitter", "coloured_noise",
    ]  # fmt: skip
    assert _kinds(monkeypatch, [_fine(4, usable=False)]) == []


def test_noise_that_remembers_is_told_where_it_was_not_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = SimpleNamespace(is_noise=True, rms=0.1, tau_s=1.23)
    held = _fine(7)
    held.fitted[:] = False
    torn = _fine(6, usable=False)
    sessions = [_fine(4), torn, held]
    found = _kinds(monkeypatch, sessions, memory=memory, explained=False)
    assert [one.recording for one in found if one.kind == "coloured_noise"] == [4, 6]
    assert "about 1.2 s" in found[-1].says
    assert "10 % of full scale" in found[-1].says
    known = _kinds(monkeypatch, sessions, memory=memory)
    assert [one.recording for one in known if one.kind == "coloured_noise"] == [4, 6]
    assert known[2].says == "says coloured_noise"
    for changes in ({"is_noise": False}, {"rms": 0.0999}):
        less = SimpleNamespace(**{**vars(memory), **changes})
        assert "coloured_noise" not in [one.kind for one in _kinds(monkeypatch, sessions, memory=less, explained=False)]


# -- units ------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("unit", "expected"),
    [("FS_reading", (0.5 * 140.0, "mbar")), ("FS_reading/s", (70.0, "mbar/s")), ("FS_load", (800.0, "N")),
     ("1/FS_load", (1.0 / 800.0, "1/N")), ("FS_reading/FS_load", (70.0 / 800.0, "mbar/N")), ("s", (1.0, "s"))],
)  # fmt: skip
def test_shares_come_to_units(unit: str, expected: tuple[float, str]) -> None:
    strength = EffectParameter("strength", unit, "", 0.0, -1.0, 1.0, 0.1)
    factor, told = _scaled(strength, SCALE, 0.5)
    assert (factor, told) == (pytest.approx(expected[0]), expected[1])
    assert _scaled(strength, replace(SCALE, reading=math.inf), 0.5)[0] == (1.0 if "reading" in unit else factor)
    # Of a reading that falls as the load grows: what moves it has its sign, a width or a level is a size.
    falling = replace(SCALE, reading=-140.0)
    assert _scaled(strength, falling, 0.5)[0] == (-factor if "reading" in unit else factor)
    assert _scaled(replace(strength, null=None), falling, 0.5)[0] == factor


def test_parameters_come_with_their_covariance_in_the_same_units_and_order() -> None:
    model = MODEL.with_part("zero_drift", np.array([1e-4, 2e-3, 60.0, 1.0])).with_part(
        "dead_band", np.array([0.05, 0.2, 0.0])
    )
    rng = np.random.default_rng(1)
    root = 1e-3 * rng.standard_normal((10, 10))
    covariance = root @ root.T
    covariance[4, 4] = -1e-9  # by rounding
    logged = SimpleNamespace(conditions=Conditions(np.zeros(1), np.zeros(1), 0.01, temperature_k=np.zeros(1)))
    unlogged = SimpleNamespace(conditions=Conditions(np.zeros(1), np.zeros(1), 0.01))
    fit: Any = SimpleNamespace(
        model=model, covariance=covariance, likelihood=SimpleNamespace(sessions=[logged, unlogged])
    )
    assert list(joint_parameters(fit, SCALE)[0]) == [
        "zero_drift.drift_rate",
        "zero_drift.exponent",
        "dead_band.lost_load",
        "dead_band.softness",
        "dead_band.onset",
    ]
    without = np.array([3, 6, 7, 8, 9])
    factors = np.array([0.8 * 140.0, 1.0, 800.0, 1.0, 1.0])
    expected = covariance[np.ix_(without, without)] * np.outer(factors, factors)
    assert np.array(joint_parameters(fit, SCALE)[1]) == pytest.approx(expected)
    fit.likelihood = SimpleNamespace(sessions=[logged])
    found, joint = joint_parameters(fit, SCALE)
    assert list(found) == [
        "zero_drift.drift_rate",
        "zero_drift.temperature_coefficient",
        "zero_drift.temperature_lag",
        "zero_drift.exponent",
        "dead_band.lost_load",
        "dead_band.softness",
        "dead_band.onset",
    ]
    factors = np.array([0.8 * 140.0, 0.8 * 140.0, 1.0, 1.0, 800.0, 1.0, 1.0])
    assert np.array(joint) == pytest.approx(covariance[3:, 3:] * np.outer(factors, factors))
    drift = parameters_of(fit, "zero_drift", SCALE)
    assert list(drift) == ["drift_rate", "temperature_coefficient", "temperature_lag", "exponent"]
    one = drift["drift_rate"]
    sd = math.sqrt(covariance[3, 3])
    assert (one.value, one.sd) == (pytest.approx(112.0 * 1e-4), pytest.approx(112.0 * sd))
    bounds = effect("zero_drift").parameters[0]
    low, high = max(1e-4 - 1.959963984540054 * sd, bounds.lower), min(1e-4 + 1.959963984540054 * sd, bounds.upper)
    assert one.ci95 == pytest.approx((112.0 * low, 112.0 * high))
    assert drift["temperature_coefficient"].sd == 0.0
    falling, told = joint_parameters(fit, replace(SCALE, reading=-140.0))
    signs = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert np.array(told) == pytest.approx(np.array(joint) * np.outer(signs, signs))
    turned = falling["zero_drift.drift_rate"]
    assert (turned.value, turned.sd) == (-one.value, one.sd)
    assert turned.ci95 == (-one.ci95[1], -one.ci95[0])
    covariance[7, 7] = 1e6
    limits = effect("dead_band").parameters[0]
    wide = parameters_of(fit, "dead_band", SCALE)["lost_load"]
    assert wide.ci95 == pytest.approx((800.0 * limits.lower, 800.0 * limits.upper))
