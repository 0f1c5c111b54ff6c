"""A gain of each recording's own: marginalised exactly, weighed as one hypothesis more, told where it accounts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.signal import lfilter
from told_evidence import taken_for_exact

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds, _gains_and_zeros
from smartshoe.diagnosis._evidence import Evidence
from smartshoe.diagnosis._gains_and_zeros import (
    OwnGain,
    ZeroChange,
    _loaded_about,
    _OwnTerms,
    changes_of,
    gains_of,
    may_differ,
    predicts_better,
    time_of,
    with_changes,
    with_own_terms,
    zero_changes_of,
)
from smartshoe.diagnosis._jumps import MOMENTS, any_jumps, may_jump, moments_of, rounded_to
from smartshoe.diagnosis._likelihood import Likelihood, fit
from smartshoe.diagnosis._own_terms import own_terms_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._sensitivity import Linearised, linearised, nuisance_precision, nuisances
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._state import State, state_at
from smartshoe.diagnosis._step_columns import StepColumns
from smartshoe.diagnosis._validation import error_of
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STEP_S, SD, SPAN_MBAR = 0.1, 0.002, 140.0
STANDARD = Thresholds()
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, SPAN_MBAR, "mbar")
CURVED = MODEL.with_part(effect("gas_compression"), np.array([0.2]))
TIME_S = np.arange(0.0, 40.0, STEP_S)


def _run(number: int, gain: float, **metadata: str) -> Recording:
    rng = np.random.default_rng([number, 7])
    corners = np.zeros(9)
    corners[1::2] = rng.uniform(0.5, 1.0, 4)
    load = np.interp(TIME_S, 5.0 * np.arange(9), corners)
    share = (1.0 + gain) * CURVED.simulate(Conditions(TIME_S, load, STEP_S)) + SD * rng.standard_normal(TIME_S.size)
    return Recording.from_arrays(
        time_s=TIME_S, force_n=800.0 * load, pressure_mbar=SPAN_MBAR * share, name=f"run_{number}", metadata=metadata
    )


def _sessions(*runs: Recording, factor: int = 4) -> list[Session]:
    usable = [one.sensor.present for one in runs]
    return prepare(list(runs), usable, [False] * len(runs), Scale(800.0, SPAN_MBAR, MILLIBAR), [factor], STANDARD)


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    return _sessions(_run(0, 0.02), _run(1, -0.01), _run(2, -0.01))


@pytest.fixture(scope="module")
def gained(sessions: list[Session]) -> list[Session]:
    return [replace(one, own_gain_sd=STANDARD.strength_sd) for one in sessions]


def _wide(sessions: list[Session], model: ExtendedModel) -> tuple[Array, ...]:
    """Nuisances (n, 2 or 3) over what is fitted, a session each, times the standard deviations of their priors."""
    made = []
    for one in sessions:
        read = model.simulate(one.conditions)
        sds = np.concatenate([[1e3], np.diag(nuisance_precision(one, model))[1:] ** -0.5])
        made.append((nuisances(one, model.pole_per_s, read) * sds)[one.fitted])
    return tuple(made)


def _density(given: Linearised, sessions: list[Session], member: int | None) -> float:
    """-2 log density of the target, every prior written out in one covariance; the equation exact."""
    prior = np.full(given.rows[0].shape[1] - 1, STANDARD.imperfection)
    prior[: given.baseline_count] = 1.0
    for one in given.candidates:
        prior[[c - 1 for c in one.columns]] *= not one.effect.why_unnamed
    if member is not None:
        prior[[c - 1 for c in given.candidates[member].columns]] = STANDARD.strength_sd
    z = np.concatenate([rows[s.fitted, 1:] * prior for rows, s in zip(given.rows, sessions, strict=True)])
    y = np.concatenate([rows[s.fitted, 0] for rows, s in zip(given.rows, sessions, strict=True)])
    covariance = z @ z.T + SD**2 * np.eye(y.size)
    first = 0
    for wide in _wide(sessions, given.model):
        there = slice(first, first + wide.shape[0])
        covariance[there, there] += wide @ wide.T
        first += wide.shape[0]
    return float(y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance)[1])


def test_evidence_with_and_without_gains_differs_as_the_explicit_densities_do(
    sessions: list[Session], gained: list[Session]
) -> None:
    given = linearised(MODEL, sessions, STANDARD)
    (curve,) = (k for k, one in enumerate(given.candidates) if one.name == "gas_compression")
    plain, beside = Evidence(given, SD), Evidence(replace(given, sessions=tuple(gained)), SD)
    for member in (None, curve):
        members = () if member is None else (member,)
        # Of one equation that is taken for exact: departures are no matter of gains.
        fast = [one.comparable_score(members) - one.posterior(members).score + taken_for_exact(one, members).score
                for one in (plain, beside)]  # fmt: skip
        slow = [_density(given, some, member) for some in (sessions, gained)]
        assert fast[0] - fast[1] == pytest.approx(slow[0] - slow[1], abs=0.1 + 1e-4 * abs(slow[0] - slow[1]))


def test_a_fits_cost_is_the_squared_error_with_every_nuisance_written_out(gained: list[Session]) -> None:
    likelihood, expected = Likelihood(gained, SD, MODEL, STANDARD), 0.0
    for one, wide in zip(gained, _wide(gained, CURVED), strict=True):
        left = (one.reading - CURVED.simulate(one.conditions))[one.fitted]
        expected += float(left @ np.linalg.solve(wide @ wide.T + SD**2 * np.eye(left.size), left))
    assert likelihood.cost(CURVED) == pytest.approx(expected, rel=1e-3)


def test_gains_and_the_effect_beside_them_come_out_of_a_fit(gained: list[Session]) -> None:
    start = MODEL.with_part(effect("gas_compression"), effect("gas_compression").begun())
    found = fit(Likelihood(gained, SD, MODEL, STANDARD), start)
    gains = gains_of(gained, found.model, STANDARD)
    assert [one.recording for one in gains] == ["run_0", "run_1", "run_2"]
    shares = np.array([one.share for one in gains])
    assert_allclose(shares - shares.mean(), [0.02, -0.01, -0.01], atol=0.002)
    (value,) = found.model.part("gas_compression").values
    assert value == pytest.approx(0.2, abs=0.01)


def test_without_gains_the_offset_and_past_are_all_that_is_a_recordings_own(sessions: list[Session]) -> None:
    for one in sessions:
        own, added = own_terms_of(one, MODEL, one.reading - MODEL.simulate(one.conditions))
        assert own.size == 2
        assert added.shape == one.reading.shape


def _state(model: ExtendedModel, sessions: list[Session]) -> State:
    return state_at(fit(Likelihood(sessions, SD, model, STANDARD), model))


def test_gains_are_asked_for_where_more_is_left_than_imperfections_or_something_goes_with_cycles() -> None:
    apart, alike = _sessions(_run(0, 0.02), _run(1, -0.02)), _sessions(_run(0, 0.0), _run(1, 0.0))
    assert may_differ(_state(CURVED, apart), apart)
    assert not may_differ(_state(CURVED, alike), alike)
    assert may_differ(_state(CURVED.with_part("cycle_conditioning"), alike), alike)
    alone = _sessions(_run(0, 0.02))
    assert may_differ(_state(MODEL, alone), alone)  # its zero may jump
    assert with_own_terms(_state(MODEL, alone), alone) is None  # and it has no gain of its own
    in_place = _sessions(_run(0, 0.02), _run(1, -0.02, continues="run_0"))
    assert not may_differ(_state(CURVED, in_place), in_place)


@pytest.mark.parametrize(
    ("gains", "found", "is_told"),
    [
        ((0.014, -0.007, -0.007), MODEL, False),  # beside a curve that is not fitted they are not what is left
        ((0.014, -0.007, -0.007), CURVED, True),
        ((0.1, -0.05, -0.05), MODEL, True),
        ((0.0, 0.0, 0.0), CURVED, False),
        ((0.004, -0.002, -0.002), CURVED, False),  # no more than small imperfections add up to
    ],
)
def test_gains_are_told_where_they_account_for_most_of_what_is_left(
    gains: tuple[float, ...], found: ExtendedModel, is_told: bool
) -> None:
    sessions = _sessions(*(_run(k, gain) for k, gain in enumerate(gains)))
    state = _state(found, sessions)
    assert (with_own_terms(state, sessions) is not None) is is_told


def test_gains_take_the_place_of_drifts_that_make_no_more_of_the_data() -> None:
    """Of two recordings, a gain that goes with the time beside one that goes with the cycles is told no longer."""
    sessions = _sessions(_run(0, 0.015), _run(1, -0.015))
    model = CURVED.with_part("gain_drift").with_part("cycle_conditioning")
    state = _state(model, sessions)
    told = with_own_terms(state, sessions)
    assert told is not None
    assert all(one.own_gain_sd and not one.gain_changes for one in told)


def test_a_gain_that_changes_is_told_with_the_moment() -> None:
    """4 % more from 21 s of one recording on."""
    runs = [_run(k, 0.0) for k in range(3)]
    reading = runs[1].sensors[0]
    values = reading.values * np.where(runs[1].time_s >= 21.0, 1.04, 1.0)
    gained = _sessions(runs[0], runs[1].with_channel(replace(reading, values=values)), runs[2])
    while (likelier := with_own_terms(_state(CURVED, gained), gained)) is not None:
        gained = likelier  # gains of their own first, then in what is found beside them what changes
    assert [len(one.gain_changes) for one in gained] == [0, 1, 0]
    model = fit(Likelihood(gained, SD, CURVED, STANDARD), CURVED).model
    (change,) = changes_of(gains_of(gained, model, STANDARD))
    assert change.recording == "run_1"
    assert change.begins_s - change.unseen_s - 1.0 <= 21.0 <= change.begins_s + 1.0
    assert change.share == pytest.approx(0.04, abs=0.005)


def _conditioning(number: int) -> Recording:
    """The gain rises with each peak's height, by ever less, at once as the load has come back by a tenth from it."""
    rng = np.random.default_rng([number, 8])
    load = np.interp(TIME_S, np.arange(15) * 40.0 / 14.0, np.insert(np.repeat(rng.uniform(0.5, 1.0, 7), 2), 0, 0.0)
                     * np.array([0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1]))  # fmt: skip
    borne, turn, way, gain = 0.0, 0.0, 1.0, np.ones(load.size)
    for k, now in enumerate(load):
        turn = way * max(way * turn, way * now)
        if way * (turn - now) > 0.1:
            borne += turn**1.2 if way > 0.0 else 0.0
            turn, way = now, -way
        gain[k] += 0.2 * (1.0 - (1.0 + borne / 4.0) ** -1.2)
    share = gain * CURVED.simulate(Conditions(TIME_S, load, STEP_S)) + 0.2 * SD * rng.standard_normal(TIME_S.size)
    return Recording.from_arrays(
        time_s=TIME_S, force_n=800.0 * load, pressure_mbar=SPAN_MBAR * share, name=f"run_{number}"
    )


def test_a_wall_that_conditions_as_its_load_turns_does_not_slip() -> None:
    """Its gain jumps in each cycle, and in every recording: no law of conditioning does so, and slips would fit."""
    sessions = _sessions(*(_conditioning(k) for k in range(3)), factor=1)
    gained = [replace(one, own_gain_sd=STANDARD.strength_sd) for one in sessions]
    conditioning = effect("cycle_conditioning")
    for some in (sessions, gained):
        start = CURVED.with_part(conditioning, conditioning.begun())
        state = state_at(fit(Likelihood(some, SD, start, STANDARD), start))
        told = with_own_terms(state, some) or some
        assert not any(one.gain_changes for one in told)


@pytest.mark.parametrize("slips", [pytest.param((0.0, 0.05, 0.0), marks=pytest.mark.long), (0.04, 0.05)])
def test_a_wall_that_conditions_slips_where_its_gain_changes_once_in_a_recording(slips: tuple[float, ...]) -> None:
    """Else it had no name, and its force on another recording was off by as much as the plain model's."""
    conditioned = CURVED.with_part("cycle_conditioning", [0.15, 3.0, 0.0, 1.0])
    time_s, moments_s = np.arange(0.0, 80.0, STEP_S), [21.0 + 20.0 * k for k in range(len(slips))]
    runs = []
    for k, slip in enumerate((*slips, 0.0)):
        rng = np.random.default_rng([1, k])
        corners = np.zeros(25)
        corners[1::2] = rng.uniform(0.4, 1.0, 12)
        load = np.interp(time_s, 80.0 / 24.0 * np.arange(25), corners)
        share = conditioned.simulate(Conditions(time_s, load, STEP_S))
        share = share * np.where(time_s >= [*moments_s, 0.0][k], 1.0 + slip, 1.0)
        share = share + 0.5 * SD * rng.standard_normal(time_s.size)
        runs.append(
            Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=SPAN_MBAR * share, name=f"run_{k}")
        )
    found = diagnose(runs[:-1], hold_out=runs[-1:])
    assert {cause.name for cause in found.causes} == {"cycle_conditioning", "gas_compression"}
    assert sum("because the unit slips" in said for said in found.limits) == 1
    assert found.baseline is not None
    assert found.extended is not None
    assert found.extended.force_rmse_n < 0.5 * found.baseline.force_rmse_n


def test_a_gain_that_changes_without_load_is_told_within_the_stretch_that_does_not_show_it() -> None:
    load = np.repeat([0.0, 0.5, 0.01, 0.7, 0.0], 10)
    session: Any = SimpleNamespace(conditions=SimpleNamespace(load=load))
    for at, about in ((25, (19, 30)), (20, (19, 30)), (30, (19, 30)), (15, (14, 15)), (3, (3, 10)), (45, (39, 45))):
        assert _loaded_about(session, at, STANDARD) == about
    assert time_of(OwnGain("a", 84.04, 0.02, True, 15.08)) == "between 68.96 and 84.04 s, without load"
    assert time_of(OwnGain("a", 84.04, 0.02, True)) == time_of(ZeroChange("a", 84.04, 0.02)) == "at 84.04 s"


def test_zeros_that_change_are_told_with_the_moment_and_are_no_gains() -> None:
    """1.5 % of full scale more from 14 s of one recording on, 1 % less from 28 s on."""
    runs = [_run(k, 0.0) for k in range(3)]
    reading, time_s = runs[1].sensors[0], runs[1].time_s
    values = reading.values + SPAN_MBAR * (0.015 * (time_s >= 14.0) - 0.01 * (time_s >= 28.0))
    sessions = _sessions(runs[0], runs[1].with_channel(replace(reading, values=values)), runs[2])
    told = with_own_terms(_state(CURVED, sessions), sessions)
    assert told is not None
    assert [len(one.zero_changes) for one in told] == [0, 2, 0]
    assert not any(one.own_gain_sd or one.gain_changes for one in told)
    assert with_own_terms(_state(CURVED, list(told)), told) is None
    model = fit(Likelihood(told, SD, CURVED, STANDARD), CURVED).model
    assert not gains_of(told, model, STANDARD)
    first, second = zero_changes_of(told, model)  # the largest first
    assert (first.recording, second.recording) == ("run_1", "run_1")
    assert (first.begins_s, first.share) == (pytest.approx(14.0, abs=4 * STEP_S), pytest.approx(0.015, abs=0.002))
    assert (second.begins_s, second.share) == (pytest.approx(28.0, abs=4 * STEP_S), pytest.approx(-0.01, abs=0.002))


def test_beside_gains_an_extension_must_follow_and_beside_changes_it_must_foresee() -> None:
    """A curve that is there is worth more either way, a set that is not there is worth no quarter of what is left."""
    runs = [_run(k, gain) for k, gain in enumerate((0.01, -0.005, -0.005))]
    sessions = _sessions(*runs)
    gained = [replace(one, own_gain_sd=STANDARD.strength_sd) for one in sessions]
    changing = [replace(one, zero_changes=(one.reading.size // 2,), zero_sd=STANDARD.strength_sd) for one in sessions]
    state = _state(MODEL, sessions)
    curved, wrong = (fit(Likelihood(sessions, SD, MODEL, STANDARD), MODEL.with_part(effect(name), values), 1).model
                     for name, values in (("gas_compression", [0.2]), ("permanent_set", [0.002, 1.0])))  # fmt: skip
    for beside in (gained, changing):
        assert predicts_better(curved, MODEL, state, sessions, beside)
    worse = MODEL.with_part(effect("permanent_set"), np.array([0.02, 1.0]))
    assert not predicts_better(worse, MODEL, state, sessions, gained)
    assert predicts_better(wrong, MODEL, state, sessions, gained) is (
        error_of(sessions, wrong) < error_of(sessions, MODEL)
    )
    assert not predicts_better(wrong, MODEL, state, sessions, changing)  # it does away with a part of a quarter at most


def test_what_one_load_cycle_reads_otherwise_is_no_zero_that_changes_and_changes_back() -> None:
    runs = [_run(k, 0.0) for k in range(3)]
    reading, time_s = runs[1].sensors[0], runs[1].time_s
    beside = SPAN_MBAR * 0.03 * ((time_s >= 12.0) & (time_s < 18.0))  # its load comes and goes from 10 to 20 s
    one_cycle = runs[1].with_channel(replace(reading, values=reading.values + beside))
    sessions = _sessions(runs[0], one_cycle, runs[2])
    told = with_own_terms(_state(CURVED, sessions), sessions) or sessions
    for one in told:
        assert len({*one.cycle[list(one.zero_changes)]}) == len(one.zero_changes)


@pytest.mark.parametrize(("of_step", "is_jump"), [(0.0, False), (0.2, False), (0.7, True), (1.0, True), (-1.0, True)])
def test_what_creeps_is_no_zero_that_jumps(of_step: float, is_jump: bool) -> None:
    """2 % of full scale more within 25 s of a recording, and so much of it at 17 s."""
    run = _run(1, 0.0)
    reading, time_s = run.sensors[0], run.time_s
    more = (1.0 - abs(of_step)) * np.clip((time_s - 5.0) / 25.0, 0.0, 1.0) + of_step * (time_s >= 17.0)
    (session,) = _sessions(run.with_channel(replace(reading, values=reading.values + SPAN_MBAR * 0.02 * more)))
    at = int(np.searchsorted(session.conditions.time_s, 17.0))
    changed = replace(session, zero_changes=(at,), zero_sd=STANDARD.strength_sd)
    assert may_jump(changed, at, CURVED, 0.0, STANDARD) is is_jump


@pytest.mark.parametrize(("of_step", "is_jump"), [(0.0, False), (1.0, True)])
def test_what_creeps_at_the_very_beginning_is_no_zero_that_jumps(of_step: float, is_jump: bool) -> None:
    """Less lies before it than between two moments: all that there is tells what was before."""
    run = _run(1, 0.0)
    reading, time_s, at = run.sensors[0], run.time_s, TIME_S.size // (MOMENTS + 1) // 2
    more = (1.0 - of_step) * np.clip(time_s / 25.0, 0.0, 1.0) + of_step * (time_s >= TIME_S[at])
    moved = run.with_channel(replace(reading, values=reading.values + SPAN_MBAR * 0.02 * more))
    (session,) = _sessions(moved, factor=1)
    changed = replace(session, zero_changes=(at,), zero_sd=STANDARD.strength_sd)
    assert may_jump(changed, at, CURVED, 0.0, STANDARD) is is_jump


def test_where_nothing_jumps_no_moment_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    run = _run(1, 0.0)
    values = run.sensors[0].values + SPAN_MBAR * 0.015 * (run.time_s >= 14.0)
    sessions = _sessions(_run(0, 0.0), run.with_channel(replace(run.sensors[0], values=values)), _run(2, 0.0))
    state = _state(CURVED, sessions)
    found = _OwnTerms(sessions, Evidence(state.evidence.linearisation, SD), state.fitted_members)
    assert with_changes(state, found, of_zero=True) is not found
    monkeypatch.setattr(_gains_and_zeros, "may_jump", lambda *given: False)
    assert with_changes(state, found, of_zero=True) is found


def test_a_zero_that_changes_costs_what_its_prior_asks() -> None:
    """The score with its column is what the step's own evidence says, not the prior's logarithm more."""
    sessions = _sessions(_run(0, 0.0), _run(1, 0.0))
    given, at, sd = linearised(CURVED, sessions, STANDARD), sessions[0].reading.size // 3, STANDARD.strength_sd
    moments = [np.array([at]), np.array([], dtype=int)]
    steps = [
        StepColumns.of(one, np.full(one.reading.size, sd), own) for one, own in zip(sessions, moments, strict=True)
    ]
    changed = replace(given, sessions=(replace(sessions[0], zero_changes=(at,), zero_sd=sd), sessions[1]))
    (fall,) = Evidence(given, SD).bayes_factors_of_steps((), steps)
    before, after = (Evidence(one, SD).comparable_score(()) for one in (given, changed))
    assert fall == pytest.approx(before - after, abs=0.01)


@pytest.mark.parametrize("by", [0.0, 0.002])
def test_zeros_that_hardly_change_are_not_told(by: float) -> None:
    runs = [_run(k, 0.0) for k in range(3)]
    reading = runs[1].sensors[0]
    values = reading.values + SPAN_MBAR * by * (runs[1].time_s >= 14.0)
    sessions = _sessions(runs[0], runs[1].with_channel(replace(reading, values=values)), runs[2])
    assert with_own_terms(_state(CURVED, sessions), sessions) is None


@pytest.mark.parametrize("is_changed", [True, False])
def test_what_a_step_takes_off_a_score_is_what_the_score_with_it_says(is_changed: bool) -> None:
    """A step beside a gain, or two gains apart, whose priors differ a little: nearly the same evidence."""
    run = _run(0, 0.02)
    grown = run.sensors[0].values * np.where((run.time_s >= run.time_s[-1] / 3.0) & is_changed, 1.02, 1.0)
    sessions = _sessions(run.with_channel(replace(run.sensors[0], values=grown)), _run(1, -0.01))
    gained = tuple(replace(one, own_gain_sd=STANDARD.strength_sd) for one in sessions)
    given = replace(linearised(MODEL, sessions, STANDARD), sessions=gained)
    (curve,) = (k for k, one in enumerate(given.candidates) if one.name == "gas_compression")
    at = gained[0].reading.size // 3
    by = [STANDARD.strength_sd * MODEL.simulate(one.conditions) for one in gained]
    steps = [StepColumns.of(one, own, np.array([at])) for one, own in zip(gained, by, strict=True)]
    changed = replace(given, sessions=(replace(gained[0], gain_changes=(at,)), gained[1]))
    for members in ((), (curve,)):
        fall, _ = Evidence(given, SD).bayes_factors_of_steps(members, steps)
        before, after = (Evidence(one, SD).comparable_score(members) for one in (given, changed))
        assert fall == pytest.approx(before - after, abs=2.0 + 0.05 * abs(fall))
        assert bool(fall > 20.0) is is_changed


def test_of_many_recordings_no_changes_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A column for each moment of each recording would be too many."""
    sessions = _sessions(*(_run(k, 0.0) for k in range(13)))
    state = _state(CURVED, sessions)
    monkeypatch.setattr(Evidence, "bayes_factors_of_steps", lambda *given: pytest.fail("asked for"))
    gained = _OwnTerms.of(state, [replace(one, own_gain_sd=STANDARD.strength_sd) for one in sessions], SD)
    assert with_changes(state, gained) is gained


# -- what steps follow, and is no jump --------------------------------------------------------------------------------
def _recorded(number: int, load: Array, reading_mbar: Array) -> Recording:
    return Recording.from_arrays(time_s=TIME_S, force_n=800.0 * load, pressure_mbar=reading_mbar, name=f"run_{number}")


def _is_told_to_jump(runs: list[Recording], factor: int = 4) -> bool:
    sessions = _sessions(*runs, factor=factor)
    told = with_own_terms(_state(CURVED, sessions), sessions)
    return told is not None and any(one.zero_changes for one in told)


def _changed(run: Recording, begins_s: float, share: float) -> Recording:
    values = run.sensors[0].values + SPAN_MBAR * share * (run.time_s >= begins_s)
    return run.with_channel(replace(run.sensors[0], values=values))


def _curved(number: int, by: float, power: float, above: float) -> Recording:
    """Pressed once and let go: above a load that differs a little by recording it reads more, by a power."""
    load = 1.0 - 2.0 * np.abs(TIME_S / TIME_S[-1] - 0.5)
    beyond = np.clip((load - above - 0.02 * number) / (1.0 - above), 0.0, None)
    share = CURVED.simulate(Conditions(TIME_S, load, STEP_S)) + by * (1.0 + 0.2 * number) * beyond**power
    noise = 0.001 * np.random.default_rng([number, 1]).standard_normal(TIME_S.size)
    return _recorded(number, load, SPAN_MBAR * (share + noise))


def _held(number: int, step_mbar: float, creeps: float) -> Recording:
    """Held once and let go, with a creep of no law of the model, in whole steps of the reading."""
    load = np.interp(
        TIME_S, [0.0, 1.0, 1.1, 15.0 - 3 * (number % 2), 15.1 - 3 * (number % 2), 40.0], [0, 0, 1, 1, 0, 0]
    )
    left = np.exp(-STEP_S / (6.0 + 2.0 * number))
    share = CURVED.simulate(Conditions(TIME_S, load, STEP_S)) + creeps * lfilter([1.0 - left], [1.0, -left], load)
    return _recorded(number, load, step_mbar * np.round(SPAN_MBAR * share / step_mbar))


def _wandering(number: int, sd: float, memory_s: float, seed: int) -> Recording:
    """Noise that remembers: the next sample is a share of the last one, and something new."""
    run = _run(number, 0.0)
    new = np.random.default_rng([number, seed]).standard_normal(TIME_S.size + 2000)
    level = lfilter([1.0], [1.0, -np.exp(-STEP_S / memory_s)], new)[2000:]
    return run.with_channel(
        replace(run.sensors[0], values=run.sensors[0].values + SPAN_MBAR * sd * level / level.std())
    )


@pytest.mark.parametrize(("power", "above"), [(8.0, 0.0), (8.0, 0.9), (20.0, 0.0), (20.0, 0.9)])
def test_recordings_of_fewer_samples_than_moments_are_asked_at_fewer(power: float, above: float) -> None:
    """58 samples: moments fell together, or no sample lay between two, and that alone was told for noise."""
    runs = [_curved(k, 0.2, power, above) for k in range(3)]
    (session, *_) = _sessions(*runs, factor=7)
    assert session.reading.size < MOMENTS
    apart = np.diff([0, *moments_of(session, STANDARD), session.reading.size])
    assert apart.min() >= STANDARD.few
    assert not _is_told_to_jump(runs, factor=7)


@pytest.mark.parametrize("size", [0, 4, 9, 10, 57, 304, 305, 306, 12_000])
def test_between_two_moments_are_enough_samples_to_tell_the_noise(size: int) -> None:
    session: Any = SimpleNamespace(reading=np.zeros(size))
    moments = moments_of(session, STANDARD)
    assert moments.size == max(min(MOMENTS, size // STANDARD.few - 1), 0)
    assert np.all(np.diff([0, *moments, max(size, STANDARD.few)]) >= STANDARD.few)


@pytest.mark.parametrize(
    ("by", "power", "above", "factor"),
    [(0.1, 4.0, 0.0, 1), (0.1, 8.0, 0.9, 1), (0.2, 8.0, 0.9, 1), (0.2, 4.0, 0.9, 4), (0.2, 20.0, 0.9, 1)],
)
def test_what_a_curve_reads_at_the_highest_loads_is_no_jump(by: float, power: float, above: float, factor: int) -> None:
    assert not _is_told_to_jump([_curved(k, by, power, above) for k in range(3)], factor)


@pytest.mark.parametrize(("step_mbar", "creeps"), [(1.4, 0.03), (2.8, 0.03), (2.8, 0.1)])
@pytest.mark.parametrize("factor", [1, 4])
def test_a_reading_that_creeps_in_its_own_steps_does_not_jump(step_mbar: float, creeps: float, factor: int) -> None:
    assert not _is_told_to_jump([_held(k, step_mbar, creeps) for k in range(4)], factor)


def test_a_change_must_be_clear_of_the_step_a_reading_is_rounded_to() -> None:
    """Of 1.4 mbar, 1 % of full scale, whatever the load does; noise as large takes it out in the mean."""
    (session,) = _sessions(_held(0, 1.4, 0.1), factor=1)
    assert rounded_to(session, CURVED, STANDARD) == pytest.approx(0.01, rel=1e-6)
    in_bar = replace(CURVED, full_scale_reading=1e-3 * SPAN_MBAR, reading_unit="bar")
    assert rounded_to(session, in_bar, STANDARD) == pytest.approx(0.01, rel=1e-6)
    for one in (_run(0, 0.0), _run(1, 0.0)):
        (fine,) = _sessions(one)
        assert rounded_to(fine, CURVED, STANDARD) == 0.0
    with_one_far_off = _held(0, 1.4, 0.1)
    values = np.where(np.arange(TIME_S.size) % 190 == 7, 280.0, with_one_far_off.sensors[0].values)
    (far,) = _sessions(with_one_far_off.with_channel(replace(with_one_far_off.sensors[0], values=values)), factor=1)
    assert rounded_to(far, CURVED, STANDARD) == pytest.approx(0.01, rel=1e-6)
    (jumped,) = _sessions(_changed(_run(0, 0.0), 14.0, 0.015), factor=1)
    at = int(np.searchsorted(jumped.conditions.time_s, 14.0))
    changed = replace(jumped, zero_changes=(at,), zero_sd=STANDARD.strength_sd)
    assert may_jump(changed, at, CURVED, 0.007, STANDARD)
    assert not may_jump(changed, at, CURVED, 0.008, STANDARD)


@pytest.mark.parametrize(
    ("sd", "memory_s", "seed"), [(0.01, 3.0, 2), (0.01, 10.0, 0), (0.02, 3.0, 0), (0.03, 3.0, 2), (0.03, 10.0, 0)]
)
def test_noise_that_remembers_does_not_jump(sd: float, memory_s: float, seed: int) -> None:
    assert not _is_told_to_jump([_wandering(k, sd, memory_s, seed) for k in range(3)])


@pytest.mark.parametrize(("share", "is_told"), [(0.02, True), (0.0, False)])
def test_a_zero_jumps_beside_noise_that_remembers_where_it_is_clear_of_that(share: float, is_told: bool) -> None:
    runs = [_wandering(k, 0.002, 1.0, 5) for k in range(3)]
    assert _is_told_to_jump([runs[0], _changed(runs[1], 14.0, share), runs[2]], factor=1) is is_told


def _at_once(session: Session, *begins_s: float) -> Session:
    at = tuple(int(one) for one in np.searchsorted(session.conditions.time_s, begins_s))
    return replace(session, zero_changes=at, zero_sd=STANDARD.strength_sd)


def test_a_jump_is_there_again_at_a_load_that_moves_as_before() -> None:
    """3 % more from a moment on; of one press at loads above 60 %, as a curve has it, or as it is let go, as a loop."""
    presses, press = (np.interp(TIME_S, np.linspace(0.0, 40.0, 2 * k + 1), [0, *[1, 0] * k]) for k in (4, 1))
    for load, more, begins_s, jumps in (
        (presses, TIME_S >= 14.0, (14.0,), True),
        (press, TIME_S >= 14.0, (14.0,), False),
        (press, press > 0.6, (12.0, 28.0), False),
        (press, TIME_S >= 20.0, (20.0,), False),
    ):
        share = CURVED.simulate(Conditions(TIME_S, load, STEP_S)) + 0.03 * more
        (session,) = _sessions(_recorded(0, load, SPAN_MBAR * share), factor=1)
        assert any_jumps([_at_once(session, *begins_s)], CURVED, STANDARD) is jumps
    alone = replace(session, zero_changes=tuple(range(1, 2 * MOMENTS, 2)), zero_sd=STANDARD.strength_sd)
    assert not any_jumps([alone], CURVED, STANDARD)  # no moment is left that tells what it is elsewhere


def test_what_is_elsewhere_as_large_or_is_more_than_its_share_is_no_jump() -> None:
    """3 % more from 14 s on, where the reading wanders as far; and for 4 s of a recording that is as before then."""
    (quiet,) = _sessions(_changed(_run(0, 0.0), 14.0, 0.03), factor=1)
    (loud,) = _sessions(_changed(_wandering(0, 0.03, 3.0, 1), 14.0, 0.03), factor=1)
    assert any_jumps([_at_once(quiet, 14.0)], CURVED, STANDARD)
    assert not any_jumps([_at_once(loud, 14.0)], CURVED, STANDARD)
    (passing,) = _sessions(_changed(_changed(_run(0, 0.0), 24.0, 0.03), 28.0, -0.03), factor=1)
    assert not any_jumps([_at_once(passing, 24.0)], CURVED, STANDARD)
    assert any_jumps([_at_once(passing, 24.0), _at_once(quiet, 14.0)], CURVED, STANDARD)
