"""Every number of a whole diagnosis, of a unit that is known: what was put in comes out, in its units."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lsim

from smartshoe import Recording, compensate, diagnose, dynamic_protocol
from smartshoe.diagnosis import Diagnosis, Thresholds
from smartshoe.diagnosis._diagnose import _pulled_reason
from smartshoe.diagnosis._held_out import Errors
from smartshoe.diagnosis._lack_of_fit import LackOfFit
from smartshoe.diagnosis._procedure import _with_offset
from smartshoe.diagnosis._residual_structure import ResidualStructure
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._verdict import (
    held_out_excess,
    held_out_rms,
    names_in,
    sentence_of,
    unexplained_remark,
    untested_rms,
    verdict_of,
)
from smartshoe.diagnosis._zero import offsets
from smartshoe.errors import NotIdentifiableError
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

FULL_N, FULL_MBAR, STEP_S, NOISE, OFFSET_MBAR = 800.0, 140.0, 0.02, 0.001, 7.0
PLAIN = ExtendedModel(1.0, 0.08, 0.22, FULL_N, FULL_MBAR, "mbar")
LOST_N = 40.0
UNIT = PLAIN.with_part(effect("dead_band"), np.array([LOST_N / FULL_N, 0.2, 0.0]))


def _run(seed: int) -> Recording:
    """Four heights, each pressed three times, from a rest; the reading as it is logged, with its offset."""
    protocol = dynamic_protocol((100, 200, 400, 800), repeats=3, rest_s=4.0)
    time_s = np.arange(0.0, protocol.duration_s, STEP_S)
    load_n = protocol.load_at(time_s)
    share = UNIT.simulate(Conditions(time_s, load_n / FULL_N, STEP_S))
    share = share + NOISE * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(
        time_s=time_s + 5.0, force_n=load_n, pressure_mbar=OFFSET_MBAR + FULL_MBAR * share, name=f"run_{seed}"
    )


@pytest.fixture(scope="module")
def runs() -> list[Recording]:
    return [_run(seed) for seed in range(3)]


@pytest.fixture(scope="module")
def told() -> list[str]:
    """What is said on the way."""
    return []


@pytest.fixture(scope="module")
def found(runs: list[Recording], told: list[str]) -> Diagnosis:
    return diagnose(runs[:2], hold_out=runs[2], progress=told.append)


def test_what_was_put_in_is_named_and_nothing_else(found: Diagnosis) -> None:
    assert found.verdict == "explained"
    assert {one.name for one in found.causes} == {"dead_band", "zero_offset"}
    assert found.leftover is None
    assert found.unit == "mbar"
    assert found.full_scale_load_n == pytest.approx(FULL_N, rel=0.01)
    assert "with " in found.says
    assert [one.size for one in found.causes] == sorted((one.size for one in found.causes), reverse=True)


def test_what_is_being_done_is_said_on_the_way(found: Diagnosis, told: list[str]) -> None:
    assert found.causes
    assert told[0] == "fitting the baseline"
    assert told[-1] == "judging on held-out data"
    assert "weighing alternatives" in told
    assert any("curve of free form" in one for one in told if one.startswith("fitting "))
    assert any(one.startswith("trying laws in the place of curve of free form") for one in told)


def test_parameters_are_in_newtons_and_millibars_within_their_intervals(found: Diagnosis) -> None:
    of = {one.name: one.parameters for one in found.causes}
    lost, offset = of["dead_band"]["lost_load"], of["zero_offset"]["offset"]
    assert (lost.unit, offset.unit) == ("N", "mbar")
    assert lost.value == pytest.approx(LOST_N, rel=0.05)
    assert offset.value == pytest.approx(OFFSET_MBAR, abs=0.2)
    for one in (lost, offset):
        assert one.ci95[0] == pytest.approx(one.value - 1.96 * one.sd, rel=1e-4)
        assert one.ci95[1] == pytest.approx(one.value + 1.96 * one.sd, rel=1e-4)


def test_the_joint_parameters_are_those_of_the_model_and_their_covariance_holds_their_sds(found: Diagnosis) -> None:
    assert found.model is not None
    listed = list(found.parameters)
    inside = [one for one in found.model.parts if one.name != "zero_offset"]
    assert listed == [f"{part.name}.{one.name}" for part in inside for one in part.effect.parameters]
    sds = np.sqrt(np.diag(np.array(found.covariance)))
    assert sds == pytest.approx([found.parameters[name].sd for name in listed], rel=1e-9)
    part = next(one for one in found.model.parts if one.name == "dead_band")
    assert found.parameters["dead_band.lost_load"].value == pytest.approx(
        part.values[0] * found.full_scale_load_n, rel=1e-9
    )


def test_what_is_left_on_data_not_fitted_is_the_noise(found: Diagnosis, runs: list[Recording]) -> None:
    assert found.extended is not None
    assert found.baseline is not None
    assert found.gain is not None
    assert found.extended.rmse == pytest.approx(NOISE * FULL_MBAR, rel=0.03)
    assert found.baseline.rmse > 3.0 * found.extended.rmse
    assert (found.gain.rmse_before, found.gain.rmse_after) == (found.baseline.rmse, found.extended.rmse)
    ratio = found.extended.rmse / found.baseline.rmse
    assert found.gain.gain_percent == pytest.approx(100.0 * (1.0 - ratio))
    assert found.explained_percent == pytest.approx(100.0 * (1.0 - ratio**2))
    assert 98.0 < found.explainable_percent <= 100.0
    assert found.explained_percent <= found.explainable_percent + 1e-9
    spread = float(np.std(runs[2].sensor.values))
    for one in (found.baseline, found.extended):
        assert one.fit_percent == pytest.approx(100.0 * (1.0 - one.rmse / spread), abs=0.01)
        assert one.variance_explained_percent == pytest.approx(100.0 * (1.0 - (one.rmse / spread) ** 2), abs=0.01)
        assert one.unit == "mbar"
    # All that the baseline leaves beyond the noise is the dead band's, and repeats; the noise itself does not.
    beyond = float(np.sqrt(found.baseline.rmse**2 - found.extended.rmse**2))
    assert found.baseline.structure_rms == pytest.approx(beyond, rel=0.3)
    assert found.extended.structure_rms < 0.5 * found.extended.rmse


def test_the_compensated_force_is_wrong_by_the_noise_where_the_baselines_is_wrong_by_the_dead_band(
    found: Diagnosis,
) -> None:
    assert found.extended is not None
    assert found.baseline is not None
    # Within the band a little noise is many newtons; no more than the band.
    assert NOISE * FULL_N < found.extended.force_rmse_n < 0.3 * LOST_N
    assert found.baseline.force_rmse_n > 1.5 * found.extended.force_rmse_n


def test_without_the_cause_the_error_is_what_it_would_be(found: Diagnosis) -> None:
    assert found.baseline is not None
    cause = next(one for one in found.causes if one.name == "dead_band")
    # It is the only effect: without it there is the baseline.
    assert cause.held_out.rmse_before == pytest.approx(found.baseline.rmse, rel=0.05)
    assert cause.held_out.ci95[0] < cause.held_out.gain_percent < cause.held_out.ci95[1]
    beyond = np.sqrt(found.baseline.rmse**2 - (NOISE * FULL_MBAR) ** 2) / FULL_MBAR
    assert cause.size == pytest.approx(beyond, rel=0.15)
    said = {one.statistic: one for one in cause.evidence}
    assert said["size in percent of full scale"].value == pytest.approx(100.0 * cause.size)
    assert said["gain on held-out data in percent"].value == cause.held_out.gain_percent
    assert said["fall of -2 log evidence"].value > 100.0
    margins = [one.margin for one in cause.rivals]
    assert margins == sorted(margins)
    assert said["margin to the nearest rival"].value == margins[0]
    assert cause.rivals[0].effect.replace("_", " ") in said["margin to the nearest rival"].says
    lost_n = cause.parameters["lost_load"].value
    assert repr(cause).startswith(f"<Cause dead band, over 99 % sure: moves the reading by {100 * cause.size:.2g} % of")
    assert f"; lost_load {lost_n:.4g} N, " in repr(cause)


def test_an_offset_that_is_taken_away_is_an_error_of_its_size(found: Diagnosis) -> None:
    assert found.extended is not None
    cause = next(one for one in found.causes if one.name == "zero_offset")
    off = cause.parameters["offset"].value
    assert cause.size == pytest.approx(off / found.full_scale_reading, rel=0.02)
    assert cause.held_out.rmse_after == found.extended.rmse
    assert cause.held_out.rmse_before == pytest.approx(np.hypot(found.extended.rmse, off), rel=0.02)
    (seen,) = (one for one in cause.evidence if one.statistic == "deviations from nothing")
    assert seen.value == pytest.approx(off / cause.parameters["offset"].sd, rel=1e-6)


def test_traces_are_the_recordings_and_what_the_models_make_of_them(found: Diagnosis, runs: list[Recording]) -> None:
    assert [(one.name, one.recording) for one in found.traces] == [(one.name, k) for k, one in enumerate(runs)]
    assert found.extended is not None
    for one, run in zip(found.traces, runs, strict=True):
        assert one.time_s == pytest.approx(run.time_s, abs=1e-9)
        assert one.load_n == pytest.approx(run.force_n, abs=0.01 * FULL_N)
        assert one.reading == pytest.approx(run.sensor.values, abs=1e-9)
        assert one.usable.all()
        assert np.std(one.reading - one.extended) == pytest.approx(NOISE * FULL_MBAR, rel=0.05)
        assert np.std(one.reading - one.baseline) > 2.0 * NOISE * FULL_MBAR
    assert [bool(one.held_out.any()) for one in found.traces] == [False, False, True]
    last = found.traces[2]
    rms = np.sqrt(np.mean((last.reading - last.extended)[last.held_out] ** 2))
    assert rms == pytest.approx(found.extended.rmse, rel=1e-6)


def test_the_model_gives_readings_as_they_are_logged(found: Diagnosis, runs: list[Recording]) -> None:
    assert found.model is not None
    assert "zero_offset" in found.model.names
    load = runs[2].force_n / found.model.full_scale_load_n
    simulated = found.model.reading(Conditions(runs[2].time_s - 5.0, load, STEP_S))
    assert np.sqrt(np.mean((simulated - runs[2].sensor.values) ** 2)) < 2.0 * NOISE * FULL_MBAR


def test_a_calibration_of_it_gives_the_load_back(found: Diagnosis, runs: list[Recording]) -> None:
    made = found.calibration(unit="A", sample_rate_hz=1.0 / STEP_S)
    load_n, force_n = runs[2].force_n, compensate(runs[2], made)
    pressed = load_n > 2.0 * LOST_N
    assert np.sqrt(np.mean((force_n - load_n)[pressed] ** 2)) < 3.0 * NOISE * FULL_N


def test_as_json_it_says_the_same(found: Diagnosis) -> None:
    told = found.to_dict()
    assert told["schema"] == "smartshoe.diagnosis/1"
    assert found.extended is not None
    assert found.gain is not None
    assert told["extended"]["rmse"] == {"value": found.extended.rmse, "unit": "mbar"}
    assert told["held_out"]["ci95"] == list(found.gain.ci95)
    first = told["causes"][0]
    assert first["size_percent_of_full_scale"] == pytest.approx(100.0 * found.causes[0].size)
    assert set(first["parameters"]) == set(found.causes[0].parameters)
    assert told["model"]["full_scale_load_n"] == found.full_scale_load_n


# -- what is refused, or not explained --------------------------------------------------------------------------------
def test_a_load_that_pulls_as_much_as_it_presses_is_refused_in_newtons(runs: list[Recording]) -> None:
    pulled = Recording.from_arrays(
        time_s=runs[0].time_s, force_n=runs[0].force_n - 300.0, pressure_mbar=runs[0].sensor.values, name="pulled"
    )
    refused = diagnose(pulled)
    assert refused.verdict == "refused"
    assert refused.model is None
    assert refused.causes == ()
    assert "from -300 to" in refused.limits[0]
    assert refused.limits[0] in refused.says
    # What can be seen without a model is said all the same.
    assert any("over this load the pressure rises" in said for said in refused.limits)
    with pytest.raises(NotIdentifiableError, match="no model"):
        refused.calibration()
    with pytest.raises(NotIdentifiableError, match="no model"):
        refused.plot()
    assert refused.to_dict()["baseline"] == {"rmse": {}, "fit_percent": None, "force_rmse_n": None}
    # A tare that shows some newtons of pull is none.
    tared = Recording.from_arrays(
        time_s=runs[0].time_s, force_n=runs[0].force_n - 40.0, pressure_mbar=runs[0].sensor.values, name="tared"
    )
    assert _pulled_reason(tared, Thresholds()) is None


def _left(rms: float) -> ResidualStructure:
    nothing = LackOfFit(0.0, 0.0, 0, Thresholds())
    return ResidualStructure(LackOfFit(rms, 50.0, 9, Thresholds()), nothing, nothing, None, "", rms)


def test_a_verdict_is_a_sentence_of_what_is_good_named_and_left() -> None:
    limits = Thresholds()
    before, after = Errors(np.array([4e-4]), np.array([1.0]), 1.0), Errors(np.array([1e-4]), np.array([1.0]), 1.0)
    causes: Any = [SimpleNamespace(name=name, confidence=0.9) for name in ("dead_band", "delay", "zero_offset")]
    large, small = 10.0 * limits.tolerable, 0.1 * limits.material

    def said(causes: Any, left: float) -> tuple[str, str]:
        verdict = verdict_of(causes, _left(large if causes else left), _left(left), limits)
        rest = unexplained_remark(_left(left), 0.0, 0.0, limits)
        return verdict, sentence_of(verdict, names_in(causes, 0), before, after, rest, limits)

    good = "the baseline simulation is good to 2 % of full scale on data it was not fitted to"
    assert said([], small) == ("adequate", good)
    assert said(causes, small) == ("explained", f"{good}, and to 1 % with dead band, delay and zero offset")
    assert said(causes[:1], small)[1] == f"{good}, and to 1 % with dead band"
    rest = f"over all recordings {100 * large:.2g} % repeats and is not explained"
    assert said([], large) == (
        "unexplained", f"{good}; {rest}: the extended model is good to 1 %, with effects that are not named as causes"
    )  # fmt: skip
    assert said(causes[:2], large) == ("partly_explained", f"{good}, and to 1 % with dead band and delay; {rest}")
    # What laws usually depart by may be left, but not where no law of the kind follows.
    usual = 0.9 * limits.departure * large
    assert usual > limits.tolerable
    assert verdict_of(causes[:1], _left(large), _left(usual), limits) == "explained"
    assert verdict_of(causes[:1], _left(large), _left(usual), limits, is_lawful=False) == "partly_explained"
    between = 0.5 * (limits.material + limits.tolerable)
    assert said([], between) == (
        "adequate",
        f"{good}; over all recordings {100 * between:.2g} % repeats and is not explained, no more than small"
        " imperfections of a good unit add up to",
    )


def test_what_is_left_is_measured_by_what_was_wrong_before() -> None:
    """An effect departs from its equation by a share of its size: so much of a large one leaves nothing unexplained."""
    limits = Thresholds()
    causes: Any = [SimpleNamespace(name="dead_band")]
    left = 2.0 * max(limits.material, limits.tolerable)
    large, small = _left(1.5 * left / limits.departure), _left(0.5 * left / limits.departure)
    chance = replace(large, repeating=replace(large.repeating, z=0.0))
    assert verdict_of(causes, large, _left(left), limits) == "explained"
    assert verdict_of(causes, small, _left(left), limits) == "partly_explained"
    assert not chance.significant
    assert verdict_of(causes, chance, _left(left), limits) == "partly_explained"


def test_what_a_grid_adds_is_left_whatever_the_model() -> None:
    limits = Thresholds()
    left = 3.0 * limits.tolerable
    for fault_error, verdict in ((0.0, "unexplained"), (0.9 * left, "unexplained"), (1.1 * left, "adequate")):
        assert verdict_of([], _left(left), _left(left), limits, fault_error=fault_error) == verdict
    causes: Any = [SimpleNamespace(name="dead_band")]
    assert verdict_of(causes, _left(left), _left(left), limits) == "partly_explained"
    assert verdict_of(causes, _left(left), _left(left), limits, fault_error=1.1 * left) == "explained"


def test_the_offset_that_readings_have_stands_in_the_model_named_or_not(runs: list[Recording]) -> None:
    """So that it reads as was logged; once, whatever the gain at the chain's end."""
    usable = [run.sensor.present for run in runs]
    scale = full_scale(runs, usable, Thresholds())
    sessions = prepare(runs, usable, [False] * 3, scale, [4], Thresholds())
    model = replace(PLAIN, gain=1.25)
    (part,) = _with_offset(model, sessions, scale).parts
    assert part.name == "zero_offset"
    assert part.values[0] * model.gain == pytest.approx(float(np.mean(offsets(sessions, model))))


def _after_a_hold(period_s: float, share: float, seed: int) -> Recording:
    """Triangles of a standard linear solid that had stood under 600 N for minutes, and begins with all of it."""
    before_s, after_s, rate_per_s = 120.0, 60.0, 0.22
    time_s = np.arange(-before_s, after_s, STEP_S)
    triangles_n = 300.0 + 500.0 * (1.0 - np.abs(2.0 * np.mod(time_s, period_s) / period_s - 1.0))
    load_n = np.where(time_s < 0.0, 600.0, triangles_n)
    solid = ([1.0, rate_per_s], [1.0 + share, rate_per_s])  # the paper's, equation 2
    _, reading_mbar, _ = lsim(solid, load_n / FULL_N * FULL_MBAR, time_s + before_s)
    logged = time_s >= 0.0
    noise_mbar = 0.02 * np.random.default_rng(seed).standard_normal(int(logged.sum()))
    return Recording.from_arrays(
        time_s=time_s[logged], force_n=load_n[logged], pressure_mbar=reading_mbar[logged] + noise_mbar, name=f"r{seed}"
    )


@pytest.mark.parametrize("share", [0.15, 0.5])
def test_what_a_loaded_unit_brings_along_fades_with_its_pole_and_is_no_effect(share: float) -> None:
    fitted = [_after_a_hold(8.0, share, 1), _after_a_hold(3.0, share, 2)]
    found = diagnose(fitted, hold_out=[_after_a_hold(5.0, share, 3)])
    assert found.verdict == "adequate"
    assert found.model is not None
    assert found.model.relaxing_share == pytest.approx(share, rel=0.02)
    assert found.model.relaxation_rate_per_s == pytest.approx(0.22, rel=0.02)
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(0.02, rel=0.1)


def test_another_unit_held_out_leaves_nothing_good_enough(runs: list[Recording], found: Diagnosis) -> None:
    other = Recording.from_arrays(
        time_s=runs[2].time_s, force_n=runs[2].force_n, pressure_mbar=0.7 * runs[2].sensor.values, name="other"
    )
    again = diagnose(runs[:2], hold_out=other)
    assert [one.name for one in again.causes] == [one.name for one in found.causes]
    assert (found.verdict, again.verdict) == ("explained", "partly_explained")
    (said,) = [limit for limit in again.limits if limit.startswith("held-out recordings are off by")]
    assert "another unit" in said
    share = float(np.std(0.3 * runs[2].sensor.values) / FULL_MBAR)
    assert again.extended is not None
    assert again.extended.rmse / FULL_MBAR == pytest.approx(share, rel=0.2)


def _fitted_and_held_out(time_s: Array, limits: Thresholds) -> list[Session]:
    run = Recording.from_arrays(time_s=time_s, force_n=100.0 + time_s, pressure_mbar=10.0 + time_s, name="r")
    usable = np.ones(time_s.size, dtype=bool)
    scale = full_scale([run], [usable], limits)
    return prepare([run, run], [usable, usable], [False, True], scale, [1], limits)


def test_what_is_off_elsewhere_is_beyond_noise_and_clear_of_what_was_fitted() -> None:
    limits, time_s = Thresholds(), STEP_S * np.arange(2000)
    fitted, apart = _fitted_and_held_out(time_s, limits)
    wave = np.sqrt(2.0) * np.sin(time_s)
    noise = np.random.default_rng(1).standard_normal(time_s.size)
    for size, within, off in (
        (2.1 * limits.tolerable, 0.0, 2.1 * limits.tolerable),
        (1.9 * limits.tolerable, 0.0, 0.0),
        (0.02, 0.011, 0.0),
        (0.02, 0.009, 0.02),
    ):
        told = held_out_excess([fitted, apart], [10.0 * wave, size * wave + 0.001 * noise], within, limits)
        assert told == pytest.approx(off, rel=0.05)
    assert held_out_excess([fitted], [wave], 0.0, limits) == 0.0  # every recording is fitted in part
    assert held_out_excess([fitted, apart], [wave, 0.05 * noise], 0.0, limits) == 0.0


def test_what_is_not_shown_to_be_noise_is_all_beyond_white_noise_that_is_more_than_tolerable() -> None:
    limits, time_s = Thresholds(), STEP_S * np.arange(2000)
    sessions = _fitted_and_held_out(time_s, limits)
    wave = np.sqrt(2.0) * np.sin(time_s)
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, time_s.size))
    untested, tested = _left(0.0), SimpleNamespace(is_noise=True)
    for size, left in ((0.9 * limits.tolerable, 0.0), (1.1 * limits.tolerable, 1.1 * limits.tolerable)):
        residuals = [size * wave + one for one in noise]  # of what was fitted and of what was not
        assert untested_rms(sessions, residuals, untested, limits) == pytest.approx(left, rel=0.1)
        assert untested_rms(sessions, residuals, tested, limits) == 0.0  # type: ignore[arg-type]
        # Beside causes it is no more than laws depart by of what was wrong.
        for ratio, is_left in ((0.9, True), (1.1, False)):
            wrong = [ratio / limits.departure * one for one in residuals]
            found = untested_rms(sessions, residuals, untested, limits, 0.0, wrong)  # type: ignore[arg-type]
            assert found == pytest.approx(left if is_left else 0.0, rel=0.1)
    elsewhere = [noise[0], 0.02 * wave + noise[1]]
    half = untested_rms(sessions, elsewhere, untested, limits)
    assert half == pytest.approx(0.02 / np.sqrt(2.0), rel=0.05)
    # The most that a better model could do away with is what is left of it where it is judged.
    assert held_out_rms(sessions, elsewhere, limits) == pytest.approx(0.02, rel=0.02)
    assert held_out_rms(sessions, elsewhere[::-1], limits) < 3e-4
    assert held_out_rms(sessions[:1], elsewhere[1:], limits) == 0.0  # nothing of it is held out


def test_what_the_baseline_leaves_open_is_not_said_to_be_mended() -> None:
    """A zero offset: of each recording's own zero the baseline knows nothing, with the cause or without."""
    causes: Any = [SimpleNamespace(name="zero_offset", confidence=0.9)]
    both = Errors(np.array([1e-4]), np.array([1.0]), 1.0)
    assert sentence_of("explained", names_in(causes, 0), both, both, None, Thresholds()) == (
        "the baseline simulation is good to 1 % of full scale on data it was not fitted to, with each"
        " recording's own zero and clock allowed for; found in these: zero offset"
    )
