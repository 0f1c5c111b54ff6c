"""The force that a calibration gives back, and what is said of it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_diagnosis_parts import MODEL, recording, sessions_of
from told_diagnosis import name_of

from smartshoe.calibration import ExtendedCompensator
from smartshoe.diagnosis import Thresholds, _force
from smartshoe.diagnosis._force import (
    Compensation,
    ForceError,
    compensation,
    force_error,
    limit_calibration_off,
    limit_clipped,
    limit_drift_held,
    limit_force,
    limit_latency_left,
    limit_not_undone,
    limit_unsound_readings,
)
from smartshoe.diagnosis._procedure import _with_held_drifts
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._zero import mean_offset
from smartshoe.display import rounded
from smartshoe.models.effects import effect
from smartshoe.models.effects.saturation import MOST_LOST
from smartshoe.models.extended import ExtendedModel

STANDARD = Thresholds()


@pytest.fixture(scope="module")
def one() -> Session:
    """Without noise, all of it fitted, in the model's own shares."""
    clean = sessions_of(*(recording(seed=seed) for seed in (1, 2, 3)))[0][0]
    at = clean.conditions
    return replace(clean, reading=MODEL.simulate(at), held_out=np.zeros(at.load.size, dtype=bool))


def test_the_compensated_force_is_off_by_what_the_reading_is(one: Session) -> None:
    everything = np.ones(one.reading.size, dtype=bool)
    judged = replace(one, held_out=everything)
    assert force_error([judged], MODEL).held_out_n == pytest.approx(0.0, abs=1e-3 * 800.0)
    # A reading that is too large by a share makes a force that is so; its offset is the recording's own.
    more = replace(judged, reading=1.02 * one.reading + 0.3)
    rms = 0.02 * float(np.std(one.conditions.load)) * 800.0
    assert force_error([more], MODEL).held_out_n == pytest.approx(rms, rel=0.1)
    assert force_error([more, judged], MODEL).held_out_n == pytest.approx(rms / np.sqrt(2.0), rel=0.1)
    fitted = force_error([one], MODEL)
    assert (fitted.fitted_n, np.isnan(fitted.held_out_n)) == (pytest.approx(0.0, abs=1e-3 * 800.0), True)


def test_a_curve_that_hardly_rises_is_not_run_backwards(one: Session) -> None:
    """Its reading, an error of 8 % added, tells no load; a curve that bends a little still tells it."""
    noise = 0.08 * np.random.default_rng(1).standard_normal(one.reading.size)
    for slopes, is_run in ((np.linspace(0.0, -0.94, 6), False), (np.linspace(0.0, -0.3, 6), True)):
        bent = MODEL.with_part("flexible_curve", slopes)
        seen = replace(one, reading=bent.simulate(one.conditions) + noise)
        found = compensation([seen], replace(bent, noise=0.08), MODEL, STANDARD)
        assert found.model is MODEL or is_run
        assert found.is_plain is not is_run
        assert (found.before, found.whole) == tuple(force_error([seen], model) for model in (MODEL, bent))
        said = limit_force(found)
        assert (said == []) is is_run
        assert is_run or "the calibration corrects by the baseline; its twin simulates with the effects" in said[0]


def test_a_lag_is_not_undone_where_that_makes_more_of_the_noise_than_it_takes_off(one: Session) -> None:
    """The curve beside it is; of less noise both are."""
    bent = MODEL.with_part("gas_compression", np.array([0.4])).with_part("sensor_lag", np.array([0.1, 0.0]))
    for noise, left in ((0.03, ("sensor_lag",)), (0.003, ())):
        read = bent.simulate(one.conditions) + noise * np.random.default_rng(1).standard_normal(one.reading.size)
        seen = replace(one, reading=read)
        found = compensation([seen], replace(bent, noise=noise), MODEL, STANDARD)
        assert found.passed_over == left
        assert {*found.model.names} == {*bent.names} - {*left}
        assert found.error.fitted_n == pytest.approx(force_error([seen], found.model).fitted_n)
        assert found.error.fitted_n < found.before.fitted_n
        said = limit_force(found)
        assert bool(said) is bool(left)
        assert not left or said[0].startswith("the calibration does not correct sensor lag: that would amplify")


@pytest.mark.parametrize(("held_out_n", "is_plain"), [(9.1, False), (9.3, True), (np.nan, False)])
def test_a_force_that_is_worse_on_what_is_held_out_is_the_plain_models(
    one: Session, monkeypatch: pytest.MonkeyPatch, held_out_n: float, is_plain: bool
) -> None:
    bent = MODEL.with_part("gas_compression", np.array([0.1]))
    before, extended = ForceError(9.0, 9.0), ForceError(5.0, held_out_n)
    monkeypatch.setattr(_force, "force_error", lambda _, model: extended if model.parts else before)
    found = compensation([one], bent, MODEL, STANDARD)
    assert found.is_plain is is_plain
    assert found.model is (MODEL if is_plain else bent)
    assert found.rejected == (extended if is_plain else None)
    assert found.error == (before if is_plain else extended)
    told = "worse than by the baseline (error 9.3 N instead of 9 N): the calibration corrects by the baseline"
    assert (told in str(limit_force(found))) is is_plain


def test_no_force_is_asked_of_samples_that_are_clipped(one: Session) -> None:
    """A linear unit that is clipped at 60 % was compensated by a line through its clipped samples."""
    lost = effect("saturation").start({"level": 0.6, "knee": 0.002})
    lost[0] = 1.0
    clipped = MODEL.with_part("saturation", lost)
    seen = replace(one, reading=clipped.simulate(one.conditions))
    bent = replace(MODEL, gain=0.8 * MODEL.gain)  # a line through all of it
    found = compensation([seen], clipped, bent, STANDARD)
    assert not found.is_plain
    assert found.error.fitted_n < 0.1 * found.before.fitted_n
    assert force_error([seen], clipped).fitted_n > 10.0 * found.error.fitted_n  # with the clipped ones
    (said,) = limit_clipped(found)
    lost_share = np.mean(np.abs(MODEL.simulate(one.conditions) - seen.reading) >= STANDARD.tolerable)
    assert said.startswith(f"errors of the force leave out {100.0 * lost_share:.2g} % of the samples")
    assert limit_clipped(compensation([one], MODEL, MODEL, STANDARD)) == []
    # Nor do they move the zero, though the filter does not undo the clipping: without it the zero lies below.
    assert found.zero == pytest.approx(0.0, abs=1e-4)
    assert mean_offset([seen], found.model.without("saturation")) < -0.01


@pytest.mark.parametrize("lost", [0.1, MOST_LOST])
def test_a_bend_tells_a_load_and_is_undone(one: Session, lost: float) -> None:
    """Nothing is left out for it, and nothing said to be lost."""
    bent = MODEL.with_part("saturation", [lost, 0.6, 0.01, 0.0])
    seen = replace(one, reading=bent.simulate(one.conditions))
    found = compensation([seen], bent, MODEL, STANDARD)
    assert (found.clipped, found.is_plain, limit_clipped(found)) == (0.0, False, [])
    assert limit_not_undone(found.model, one.conditions.step_s) == []
    assert found.error.fitted_n < 1e-3 * 800.0 < found.before.fitted_n


def test_what_is_moved_where_most_of_the_slope_is_left_counts(one: Session) -> None:
    """The foot of a wide knee, though all above it is clipped and nothing undone; nor does it move the zero."""
    clipped = MODEL.with_part("saturation", [1.0, 0.6, 0.05, 0.0])
    seen = replace(one, reading=clipped.simulate(one.conditions))
    found = compensation([seen], clipped, MODEL, STANDARD)
    straight = MODEL.simulate(one.conditions)
    moved = np.abs(straight - seen.reading) >= STANDARD.tolerable
    assert found.clipped == pytest.approx(np.mean(straight > 0.6), abs=2e-3)
    assert found.clipped < np.mean(moved) - 0.05
    assert found.whole.fitted_n > STANDARD.tolerable * 800.0
    assert found.zero == pytest.approx(0.0, abs=1e-4)


def test_a_reading_is_clipped_where_its_effect_has_no_inverse() -> None:
    """The share of the slope is one number, in the model as in the record."""
    assert MOST_LOST * STANDARD.clear == 1.0


@pytest.mark.parametrize(("more", "is_plain"), [(0.999, False), (1.001, True), (np.nan, True)])
def test_a_force_that_is_hardly_worse_decides_nothing(
    one: Session, monkeypatch: pytest.MonkeyPatch, more: float, is_plain: bool
) -> None:
    bent, most = MODEL.with_part("gas_compression", np.array([0.1])), 9.0 * (1.0 + STANDARD.standing)
    errors = {len(MODEL.parts): ForceError(9.0, 9.0), len(bent.parts): ForceError(more * most, 8.0)}
    monkeypatch.setattr(_force, "force_error", lambda fine, model: errors[len(model.parts)])
    assert compensation([one], bent, MODEL, STANDARD).is_plain is is_plain


def test_what_no_compensator_takes_off_is_said_with_the_reason() -> None:
    late = MODEL.with_part("delay", np.array([0.2])).with_part("dead_band", np.array([0.05, 0.2, 0.0]))
    (said,) = limit_not_undone(late, 0.02)
    late_by = "no compensator can correct the delay in the extended model: a stream of readings cannot be moved to"
    assert said.startswith(late_by)
    (said,) = limit_not_undone(MODEL.with_part("clock_drift", np.array([0.004])), 0.02)
    assert said.startswith("no compensator can correct the clock drift in the extended model: ")
    assert limit_not_undone(late.without("delay"), 0.02) == []


def test_a_drift_that_is_held_is_said_to_be(one: Session) -> None:
    """0.0002 of full scale a second is 4 % in 200 s, through the gain that follows it."""
    drift = np.array([2e-4, 0.0, 0.0, 1.0])
    drifting = MODEL.with_part("zero_drift", drift)

    def told(model: ExtendedModel) -> list[str]:
        nothing = ForceError(0.0, 0.0)
        undone_by = ExtendedCompensator(model, 1.0 / one.conditions.step_s)
        return limit_drift_held(Compensation([one], model, nothing, nothing, nothing, undone_by), STANDARD)

    (said,) = told(drifting.held_after(200.0, ()))
    assert "up to the end of the fitted data at 200 s: there it moves a full-scale force (zero drift by -4 %);" in said
    assert told(drifting) == []  # a cause is told as one, and goes on
    assert told(MODEL.with_part("zero_drift", 0.2 * drift).held_after(200.0, ())) == []  # hardly anything
    assert told(MODEL) == []


def test_a_drift_that_is_no_named_law_is_held_from_the_end_of_what_was_fitted_on(one: Session) -> None:
    """What is held out goes on for longer: nothing that was fitted tells how such a drift goes on."""
    drifting = MODEL.with_part("gain_drift").with_part("zero_drift").with_part("linear_leak")
    named: Any = SimpleNamespace(names=[name_of("zero_drift")])
    longer = replace(
        one,
        conditions=replace(one.conditions, time_s=one.conditions.time_s + 100.0),
        held_out=np.ones_like(one.held_out),
    )
    held = _with_held_drifts(drifting, named, [one, longer])
    assert {part.name: part.until_s for part in held.parts} == {
        "gain_drift": one.conditions.time_s[-1], "zero_drift": math.inf, "linear_leak": math.inf,
    }  # fmt: skip
    last = replace(one, held_out=np.arange(one.reading.size) >= 100)  # a load cycle that judges
    assert _with_held_drifts(drifting, named, [last]).part("gain_drift").until_s == one.conditions.time_s[99]
    carried_on = replace(one, conditions=replace(one.conditions, before={"time_s": 50.0}))
    held = _with_held_drifts(drifting, named, [one, carried_on])
    assert held.part("gain_drift").until_s == 50.0 + one.conditions.time_s[-1]
    of_free_form: Any = SimpleNamespace(names=[name_of("gain_drift")])
    free = MODEL.with_part("flexible_gain_drift")
    assert _with_held_drifts(free, of_free_form, [one]).parts[0].until_s == one.conditions.time_s[-1]


def test_a_lag_that_is_undone_in_part_and_loads_that_feel_it_are_told(one: Session) -> None:
    """What is held out is slow: its figure is none for what was fitted."""
    late = MODEL.with_part("sensor_lag", np.array([0.2, 0.3]))
    nothing, few = ForceError(0.0, 0.0), ForceError(0.0, 0.1)
    undone_by = ExtendedCompensator(late, 1.0 / one.conditions.step_s)
    (left_s,) = undone_by.lags_left_s.values()
    found = Compensation([one], late, nothing, nothing, nothing, undone_by)
    (said,) = limit_latency_left(found)
    assert said.startswith(f"the calibration leaves {1e3 * left_s:.3g} ms of the sensor lag")
    assert limit_latency_left(replace(found, filter=ExtendedCompensator(MODEL, 1.0 / one.conditions.step_s))) == []
    quick = replace(one, reading=late.simulate(one.conditions))
    found = replace(found, fine=[quick], error=few)
    (said,) = limit_calibration_off(found, STANDARD)
    off_n = force_error([quick], late).fitted_n
    assert off_n > STANDARD.clear * STANDARD.tolerable * late.full_scale_load_n
    assert said.startswith(f"the force of {one.recording.name} is off by {off_n:.2g} N (rms): the 0.1")
    for held_n in (off_n / STANDARD.clear * 1.01, np.nan):  # nearly as far off as what is held out, or none is
        assert limit_calibration_off(replace(found, error=ForceError(0.0, held_n)), STANDARD) == []


@pytest.mark.parametrize(("name", "remembers"), [("mullins_softening", True), ("gas_compression", False)])
def test_a_spike_that_a_filter_remembers_is_told(name: str, remembers: bool) -> None:
    """One sample of twice the load before the first cycle: all that follow are read as of a wall that it softened."""
    model = MODEL.with_part(name, effect(name).start({}) + np.eye(1, len(effect(name).parameters))[0] * 0.1)
    clean = recording(model, noise=0.0)
    at = int(np.argmax(clean.force_n > 100.0)) - 5
    spiked = clean.sensor.values + np.where(np.arange(len(clean)) == at, 2.0 * model.full_scale_reading, 0.0)
    logged = clean.with_channel(replace(clean.sensor, values=spiked))
    sound = np.arange(len(clean)) != at
    scale = full_scale([logged], [sound], STANDARD)
    fine = prepare([logged], [sound], [False], scale, [1], STANDARD)
    model = replace(model, full_scale_reading=scale.reading, gain=model.gain * model.full_scale_reading / scale.reading)
    found = compensation(fine, model, model, STANDARD)
    said = limit_unsound_readings(found, scale, STANDARD)
    assert len(said) == remembers
    assert not remembers or said[0].startswith("a filter takes faulty samples, such as spikes, for loads")
    whole = prepare([clean], [sound | True], [False], scale, [1], STANDARD)
    assert limit_unsound_readings(replace(found, fine=whole), scale, STANDARD) == []


@pytest.mark.parametrize(
    ("name", "values"), [("zero_drift", [0.001, 0.0, 60.0, 1.0]), ("gain_drift", [0.0005, 0.0, 60.0, 0.0, 1.0])]
)
def test_the_force_of_what_continues_a_recording_is_by_a_clock_that_goes_on(
    one: Session, name: str, values: list[float]
) -> None:
    """A gain that drifted for ten minutes, or a zero, is where it has come to."""
    later = replace(one.conditions, before={"time_s": 600.0}, cache={})
    drifting = MODEL.with_part(name, np.array(values))
    on = replace(one, conditions=later, reading=drifting.simulate(later))
    assert force_error([on], drifting).fitted_n < 1e-3 * 800.0


@pytest.mark.parametrize(
    ("name", "values"),
    [("second_relaxation", [0.2, 12.0]), ("cycle_conditioning", [0.1, 3.0, 0.0, 1.0]), ("permanent_set", [1e-4, 1.0])],
)
def test_what_earlier_recordings_did_to_a_unit_is_no_part_of_the_force(
    one: Session, name: str, values: list[float]
) -> None:
    earlier = 0.5 + 0.5 * np.sin(0.05 * np.arange(600))
    before = {"time_s": 600.0, "cycles": 2.0, "dose": 300.0, "largest_load": 1.0}
    later = replace(one.conditions, before=before, earlier=earlier, cache={})
    model = MODEL.with_part(name, np.array(values))
    on = replace(one, conditions=later, reading=model.simulate(later))
    assert force_error([on], model).fitted_n < 1e-3 * 800.0


def test_a_compensator_undoes_all_but_what_it_passes_over(one: Session) -> None:
    late = MODEL.with_part("delay", np.array([0.2])).with_part("dead_band", np.array([0.05, 0.2, 0.0]))
    nothing = ForceError(0.0, 0.0)
    for model, names in ((late, ("dead_band",)), (MODEL, ())):
        undone_by = ExtendedCompensator(model, 1.0 / one.conditions.step_s)
        found = Compensation([one], model, nothing, nothing, nothing, undone_by)
        assert found.undone.names == names
    assert found.undone is MODEL


@pytest.mark.parametrize(("force_n", "said"), [(0.0384, "0.038"), (3.3, "3.3"), (149.6, "150"), (1234.0, "1,200")])
def test_a_force_is_said_to_two_digits_without_an_exponent(force_n: float, said: str) -> None:
    assert rounded(force_n) == said
