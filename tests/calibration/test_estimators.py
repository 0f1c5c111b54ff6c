"""Estimators of force with error bars: laws of the filters, and how far their error bars can be believed."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

import smartshoe
from simulators.people import Person, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.calibration.estimators import (
    Estimator,
    ForceEstimate,
    ForceRun,
    estimator,
    estimator_names,
    methods,
)
from smartshoe.calibration.estimators._kalman import filter_of
from smartshoe.calibration.estimators._reading_noise import reading_noise_sd
from smartshoe.calibration.estimators._state_space import contact_model, likely_density
from smartshoe.calibration.estimators.methods.imm import InteractingModels
from smartshoe.errors import InputError, UsageError
from smartshoe.models import StandardLinearSolid
from smartshoe.protocol import dynamic_protocol, static_protocol
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

RATE_HZ = 200.0
SENT = 210  # readings of a stream, 3.5 s at 60 Hz: more than the smoother waits for
LINEAR = tuple(name for name in estimator_names() if name != "inverse")


@cache
def calibrated(unit: str) -> Calibration:
    machine = smartshoe.open_machine("sim:instron", unit=unit, seed=7)
    with machine:
        return smartshoe.identify([machine.run(static_protocol()), machine.run(dynamic_protocol())]).calibration()


@cache
def walked() -> Any:
    return trial(Person(body_weight_n=700.0), Walk(speed_m_per_s=1.3), 12.0, np.random.default_rng(11))


def plain(**changes: Any) -> Calibration:
    given: dict[str, Any] = {"a1": 0.25, "b0": 3.6, "b1": 0.85, "reading_unit": MILLIBAR, **changes}
    return Calibration(**given)


def reading_of(load_n: np.ndarray, c: Calibration, rate_hz: float = RATE_HZ) -> np.ndarray:
    """The inverse of eq. (13) by another way than the estimators': the bilinear filter turned round."""
    numerator, denominator = smartshoe.models.discretise(c.a1, c.b0, c.b1, rate_hz, "bilinear")
    start = (denominator.sum() / numerator.sum() - denominator[0] / numerator[0]) * load_n[0]
    out, _ = lfilter(denominator, numerator, load_n, zi=np.array([start]))
    return np.asarray(out) + c.offset


@pytest.mark.parametrize("name", LINEAR)
@settings(max_examples=5)
@given(level=st.floats(20.0, 700.0), offset=st.floats(-5.0, 5.0))
def test_a_load_that_lasts_is_the_static_gain_times_its_reading(name: str, level: float, offset: float) -> None:
    c = plain(offset=offset)
    readings = np.full(80, level * c.a1 / c.b1 + offset)
    found = estimator(name, c, RATE_HZ, noise_sd=0.01).estimate(readings)
    assert found.force_n[-1] == pytest.approx(level, rel=2e-3)


@pytest.mark.parametrize("name", ["lead", "kalman", "smoother"])
def test_a_smooth_load_comes_back_where_there_is_hardly_any_noise(name: str) -> None:
    c = plain()
    time_s = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
    load_n = 300.0 * np.sin(np.pi * time_s / 2.0) ** 2
    found = estimator(name, c, RATE_HZ, noise_sd=1e-3).estimate(reading_of(load_n, c))
    assert np.max(np.abs(found.force_n - load_n)) < 0.5


@settings(max_examples=8)
@given(scale=st.floats(1e-3, 1e3), name=st.sampled_from(["static", "lead", "smoother"]))
def test_the_unit_of_the_reading_does_not_matter(scale: float, name: str) -> None:
    c = plain()
    rng = np.random.default_rng(5)
    readings = reading_of(200.0 * np.sin(np.linspace(0.0, 9.0, 300)) ** 2, c) + 0.2 * rng.standard_normal(300)
    other = plain(b0=c.b0 / scale, b1=c.b1 / scale)
    mine = estimator(name, c, RATE_HZ).estimate(readings)
    theirs = estimator(name, other, RATE_HZ).estimate(scale * readings)
    assert theirs.force_n == pytest.approx(mine.force_n, rel=1e-4, abs=1e-3)
    assert theirs.sd_n == pytest.approx(mine.sd_n, rel=1e-3)


@pytest.mark.parametrize("name", LINEAR)
def test_what_is_missing_is_never_looked_at_and_widens_the_error_bar(name: str) -> None:
    c = plain()
    rng = np.random.default_rng(3)
    readings = reading_of(200.0 * np.sin(np.linspace(0.0, 9.0, 400)) ** 2, c) + 0.1 * rng.standard_normal(400)
    missing = np.zeros(400, dtype=bool)
    missing[150:170] = True
    one, other = readings.copy(), readings.copy()
    one[missing], other[missing] = np.nan, 1e6
    chosen = estimator(name, c, RATE_HZ, noise_sd=0.1)
    first, second = chosen.estimate(one, missing), chosen.estimate(other, missing)
    assert np.array_equal(first.force_n, second.force_n)
    assert np.isfinite(first.force_n).all()
    assert np.isfinite(first.sd_n).all()
    if name in ("kalman", "smoother", "imm"):
        assert first.sd_n[160] > 2.0 * first.sd_n[140]


def test_the_smoother_is_surer_than_the_filter_wherever_both_look() -> None:
    c = plain()
    rng = np.random.default_rng(4)
    readings = reading_of(300.0 * np.sin(np.linspace(0.0, 20.0, 600)) ** 2, c) + 0.2 * rng.standard_normal(600)
    past = estimator("kalman", c, RATE_HZ, noise_sd=0.2).estimate(readings)
    both = estimator("smoother", c, RATE_HZ, noise_sd=0.2).estimate(readings)
    assert (both.sd_n <= past.sd_n + 1e-12).all()
    assert both.sd_n[300] < 0.95 * past.sd_n[300]


@pytest.mark.parametrize("unit", ["left_heel", "left_toe"])
def test_on_a_walk_the_error_bars_hold_and_the_smoother_is_best(unit: str) -> None:
    """Truth from the simulators: their own physics, sensor lag, noise and converter. Two seconds settle."""
    c, made = calibrated(unit), walked()
    readings, load_n = made.recording.channels[unit].values, made.unit_n[unit]
    settled = slice(400, None)
    rmse, cover = {}, {}
    for name in ("static", "lead", "kalman", "smoother", "imm"):
        found = estimator(name, c, RATE_HZ).estimate(readings)
        error = (found.force_n - load_n)[settled]
        rmse[name] = float(np.sqrt(np.mean(error**2)))
        cover[name] = float(np.mean(np.abs(error) < 1.96 * found.sd_n[settled]))
    assert rmse["smoother"] < rmse["kalman"] < rmse["lead"] < rmse["static"]
    for name in ("kalman", "smoother", "imm"):
        assert 0.90 < cover[name] <= 1.0, (name, cover[name])


def test_the_probability_of_contact_follows_the_foot() -> None:
    c, made = calibrated("left_heel"), walked()
    readings = made.recording.channels["left_heel"].values
    there = np.zeros(readings.size, dtype=bool)
    mixed = InteractingModels(c, RATE_HZ).begin(readings, there)
    mixed.push(readings, there)
    load_n = made.unit_n["left_heel"]
    assert np.median(mixed.contact[load_n > 100.0]) > 0.99
    assert np.median(mixed.contact[(load_n == 0.0) & (np.arange(load_n.size) > 400)]) < 0.2


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), sd=st.floats(0.05, 2.0))
def test_the_noise_is_found_beside_a_load_that_comes_and_goes(seed: int, sd: float) -> None:
    rng = np.random.default_rng(seed)
    phase = np.arange(4000) / 220.0 % 1.0
    load = 100.0 * np.clip(np.sin(2.0 * np.pi * phase), 0.0, None)
    assert reading_noise_sd(load + sd * rng.standard_normal(4000)) == pytest.approx(sd, rel=0.12)


def test_the_likely_density_is_that_of_the_load() -> None:
    """A load drawn from the state space itself, through filterpy's own matrices."""
    c = plain()
    model = contact_model(c, RATE_HZ, 1e6, 0.1)
    rng = np.random.default_rng(8)
    root = np.linalg.cholesky(model.process + 1e-12 * np.eye(3))
    state, readings = np.zeros(3), np.empty(6000)
    for k in range(readings.size):
        state = model.transition @ state + root @ rng.standard_normal(3)
        readings[k] = model.output[0] @ state + 0.1 * rng.standard_normal()
    assert likely_density(c, RATE_HZ, readings, 0.1) == pytest.approx(1e6, rel=0.15)


def test_the_steady_filter_is_what_filterpy_settles_to() -> None:
    from smartshoe.calibration.estimators._state_space import _steady_innovations

    c = plain()
    model = contact_model(c, RATE_HZ, 1e6, 0.1)
    rng = np.random.default_rng(2)
    values = 20.0 + np.cumsum(rng.standard_normal(1500))
    innovation, variance = _steady_innovations(model, values)
    found = filter_of(model, c, values[0], float(np.max(np.abs(values))))
    seen = []
    for k, value in enumerate(values):
        if k:
            found.predict()
        found.update(value)
        seen.append(float(found.y[0, 0]))
    assert variance == pytest.approx(float(found.S[0, 0]), rel=1e-3)
    # What differs is the start, and it fades with the solid's own relaxation.
    assert np.abs(innovation - np.array(seen))[1000:].max() < 0.05 * np.sqrt(variance)


@pytest.mark.parametrize(("k1", "k2"), [(1.873, 0.119), (2.045, 0.159), (1.341, 0.215), (2.025, 0.316)])
def test_at_one_step_a_second_the_papers_filter_is_nearly_a_pure_gain(k1: float, k2: float) -> None:
    """Table 1's units: (13) leads by 0.03 to 0.18 degrees at 1 Hz; there its gain is the fast one, b0, already."""
    solid = StandardLinearSolid(k1, k2, 1.0)
    omega = 2.0 * np.pi
    response = (solid.b0 * 1j * omega + solid.b1) / (1j * omega + solid.a1)
    assert 0.02 < np.degrees(np.angle(response)) < 0.2
    assert abs(response) == pytest.approx(solid.b0, rel=0.001)


REFUSED = [
    (lambda: estimator("median", plain()), UsageError, "lead, smoother, static"),
    (lambda: estimator("inverse", plain()), UsageError, "no extended model"),
    (lambda: estimator("kalman", plain(), 0.0), UsageError, "rate above 0"),
    (lambda: estimator("kalman", plain(b0=-1.0), 100.0).estimate(np.ones(9)), InputError, "b0 and b1"),
    (lambda: estimator("lead", plain()).estimate([1.0, np.nan]), InputError, "reading 1 is not finite"),
    (lambda: estimator("lead", plain()).estimate([1.0, 2.0], np.array([True])), InputError, "shape"),
    (lambda: estimator("imm", plain()).estimate([1.0, 2.0], np.array([True, True])), InputError, "every reading"),
    (lambda: estimator("lead", plain()).estimate([]), InputError, "at least one"),
]


@pytest.mark.parametrize(("call", "error", "says"), REFUSED)
def test_what_cannot_be_estimated_is_refused(call: Any, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        call()


@pytest.mark.parametrize("name", LINEAR)
@settings(max_examples=6)
@given(cuts=st.lists(st.integers(0, SENT), max_size=4), seed=st.integers(0, 99))
def test_a_stream_gives_the_forces_of_the_whole_whatever_its_blocks(name: str, cuts: list[int], seed: int) -> None:
    c, rng = plain(), np.random.default_rng(seed)
    load_n = 200.0 * np.sin(np.linspace(0.0, 25.0, SENT)) ** 2
    readings = reading_of(load_n, c, 60.0) + 0.1 * rng.standard_normal(SENT)
    missing = np.zeros(SENT, dtype=bool)
    missing[90:95] = True
    chosen = estimator(name, c, 60.0, noise_sd=0.1)
    whole, run = chosen.estimate(readings, missing), chosen.begin(readings, missing)
    blocks = [slice(a, b) for a, b in pairwise([0, *sorted(cuts), SENT])]
    found = np.concatenate([*(run.push(readings[k], missing[k]).force_n for k in blocks), run.finish().force_n])
    # A smoother's stream waits two seconds for what comes after a reading; the others are the same to the bit.
    assert found == pytest.approx(whole.force_n, abs=1e-4 if name == "smoother" else 0.0)


class Halved(Estimator):
    """What another package may offer: half the reading, known one block later."""

    def begin(self, readings: np.ndarray, missing: np.ndarray) -> ForceRun:
        return HalvedRun()


class HalvedRun(ForceRun):
    def __init__(self) -> None:
        self._last = np.zeros(0)

    def push(self, readings: np.ndarray, missing: np.ndarray) -> ForceEstimate:
        self._last, now = 0.5 * readings, self._last
        return ForceEstimate(now, np.ones(now.size))

    def finish(self) -> ForceEstimate:
        return ForceEstimate(self._last, np.ones(self._last.size))


def test_another_package_offers_an_estimator_by_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    offered = {"halved": f"{__name__}:Halved", "broken": f"{__name__}:nothing", "wrong": f"{__name__}:MILLIBAR"}
    entries = [EntryPoint(name, value, methods.GROUP) for name, value in offered.items()]
    monkeypatch.setattr(methods, "entry_points", lambda group: entries if group == methods.GROUP else [])
    assert {"halved", "smoother"} <= set(estimator_names())
    assert estimator("halved", plain(), RATE_HZ).estimate([2.0, 4.0]).force_n.tolist() == [1.0, 2.0]
    readings = 400.0 * np.sin(np.arange(2000) / 30.0) ** 2
    walk = Recording.from_arrays(time_s=np.arange(2000) / RATE_HZ, left_heel_mbar=readings)
    found = smartshoe.gait.analyse(walk, [plain(unit="left_heel")], estimator="halved")
    assert found.feet["left"].load.max() == pytest.approx(200.0, abs=5.0)
    with pytest.raises(UsageError, match=r"broken .* cannot be loaded"):
        estimator("broken", plain())
    with pytest.raises(UsageError, match=r"wrong .* is no class"):
        estimator("wrong", plain())
