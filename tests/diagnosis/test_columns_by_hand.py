"""The columns that inference works on, against written-out sums."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from told_columns import MODEL, STANDARD, STEP_S, past_columns, session_under, sessions_under, some_load
from told_evidence import WAVE, session_of

from smartshoe.diagnosis._noise import FLOOR, effective_noise_sd
from smartshoe.diagnosis._sensitivity import (
    Candidate,
    Linearised,
    _factors,
    available_effects,
    departures,
    directions,
    lagged,
    linearised,
    marginal,
    nuisance_precision,
    nuisances,
)
from smartshoe.models.effects import Conditions, effect, is_told_from_its_family
from smartshoe.models.effects.exposure import WORDS

Array = NDArray[np.float64]


# -- candidates -------------------------------------------------------------------------------------------------------
def _candidate(*bounds: tuple[float, float, float]) -> Candidate:
    """An effect of a shape and of strengths with such (null, lower, upper)."""
    shape = SimpleNamespace(name="shape", null=None, lower=0.1, upper=9.0)
    strengths = [SimpleNamespace(name=f"s{k}", null=n, lower=lo, upper=up) for k, (n, lo, up) in enumerate(bounds)]
    one: Any = SimpleNamespace(
        name="one", family="family", imitates="", parameters=(shape, *strengths),
        start=lambda at: np.array([at["shape"], *(n for n, _, _ in bounds)]),
    )  # fmt: skip
    return Candidate(one, {"shape": 4.0}, tuple(range(len(bounds))))


def test_strengths_begin_from_their_nulls_within_their_bounds() -> None:
    one = _candidate((1.0, 0.5, 2.0), (0.0, -3.0, 3.0), (0.0, -1.0, 1.0))
    assert list(one.start(np.array([0.25, -1.5, 0.5]))) == [4.0, 1.25, -1.5, 0.5]
    assert list(one.start(np.array([9.0, -9.0, 9.0]))) == [4.0, 2.0, -3.0, 1.0]
    assert list(one.start(np.array([-9.0, 9.0, 0.0]))) == [4.0, 0.5, 3.0, 0.0]


def test_a_strength_has_the_sign_that_its_bounds_allow() -> None:
    up, down, either = _candidate((0.0, 0.0, 5.0)), _candidate((0.0, -5.0, 0.0)), _candidate((0.0, -5.0, 5.0))
    for one, told in ((up, (True, True, False)), (down, (False, True, True)), (either, (True, True, True))):
        assert tuple(one.allows_sign_of(np.array([by])) for by in (1.0, 0.0, -1.0)) == told
    both = _candidate((0.0, 0.0, 5.0), (0.0, -5.0, 0.0))
    assert both.allows_sign_of(np.array([1.0, -1.0]))
    assert not both.allows_sign_of(np.array([1.0, 1.0]))
    assert not both.allows_sign_of(np.array([-1.0, -1.0]))


def test_of_a_family_or_the_one_that_is_imitated_there_is_one_but_for_branches_that_the_data_tells() -> None:
    def slot(name: str, is_apart: bool = True) -> str:
        return Candidate(effect(name), {}, (), is_apart).slot

    assert {slot("saturation"), slot("contact_area"), effect("saturation").kind} == {"static_curve"}
    assert (slot("linear_leak"), _candidate((0.0, 0.0, 5.0)).name) == ("leak", "one")
    for family in (("delay", "sensor_lag", "clock_drift"), ("permanent_set", "zero_drift")):
        assert len({slot(name) for name in family}) == len(family)
        assert {slot(name, False) for name in family} == {effect(family[0]).family}
    assert (slot("flexible_set"), slot("flexible_lag")) == (slot("permanent_set"), slot("sensor_lag"))
    assert slot("warm_up") == slot("zero_drift")


def test_what_tells_a_branch_from_its_family_is_what_separates_any_of_its_laws_from_others() -> None:
    for name, words in (
        ("permanent_set", {"pauses", "shuffled_loads"}),
        ("flexible_set", {"pauses", "shuffled_loads"}),
        ("mullins_softening", {"shuffled_loads"}),
        ("clock_drift", {"repeats", "steps"}),
    ):
        told = {word for word in WORDS if is_told_from_its_family(effect(name), frozenset({word}))}
        assert told == words
        assert not is_told_from_its_family(effect(name), frozenset())
    assert not is_told_from_its_family(effect("linear_leak"), WORDS)  # its family has no branches


def test_an_effect_needs_its_channel_in_every_session() -> None:
    def session(**more: Any) -> Any:
        told = session_of(WAVE)
        return replace(told, conditions=replace(told.conditions, **more))

    bare, beside, warm = session(), session(neighbour=WAVE), session(temperature_k=WAVE)

    def told(*sessions: Any) -> set[str]:
        return {one.name for one in available_effects(sessions, STANDARD)}

    assert told(beside) - told(bare) == {"cross_talk"}
    assert told(beside, bare) == told(bare)
    assert told(warm) >= told(bare)
    for one in available_effects([bare], STANDARD):
        assert one.is_physical
        assert one.shifts is None
        assert not one.is_refinement
        assert not one.needs


def test_what_only_later_load_cycles_show_is_not_looked_for_where_no_recording_has_any() -> None:
    """A strip that is pulled once a file shows nothing of softening, nor of a gain that settles or drifts."""
    once = session_of(np.interp(np.arange(200), [0, 100, 199], [0.0, 1.0, 0.0]))
    twice = session_of(np.interp(np.arange(200), [0, 50, 100, 150, 199], [0.0, 1.0, 0.1, 0.6, 0.0]))

    def told(*sessions: Any) -> set[str]:
        return {one.name for one in available_effects(sessions, STANDARD)}

    memories = {
        "mullins_softening", "cycle_conditioning", "gain_drift", "flexible_softening", "flexible_gain_drift",
        "flexible_lag", "flexible_thixotropy",
    }  # fmt: skip
    assert told(twice) - told(once, once) == memories
    assert told(once, twice) == told(twice)
    assert all(effect(name).needs_cycles for name in memories)
    # Peaks of many heights show a curve as well, but so does every loading.
    assert not effect("sensor_nonlinearity").needs_cycles


# -- columns ----------------------------------------------------------------------------------------------------------
def test_factors_are_of_load_direction_speed_and_time() -> None:
    load = np.array([0.0, 0.1, 0.4, 0.8, 0.8, 0.8, 0.3])
    time_s = 0.5 * np.arange(7)
    session: Any = SimpleNamespace(conditions=Conditions(time_s, load, 0.5))
    rate = np.gradient(load, 0.5)
    for k in range(7):
        x, e, v = 2.0 * load[k] - 1.0, 2.0 * time_s[k] / 3.0 - 1.0, rate[k]
        expected = [x, 0.5 * (3.0 * x * x - 1.0), v / math.hypot(v, 0.004), math.log10((0.004 + abs(v)) / 0.004) - 1.0,
                    e, 0.5 * (3.0 * e * e - 1.0)]  # fmt: skip
        assert _factors(session, STANDARD)[k] == pytest.approx(expected)
    single: Any = SimpleNamespace(conditions=Conditions(np.zeros(1), np.ones(1), 0.5))
    assert _factors(single, STANDARD)[0, 4] == -1.0


def test_a_lag_is_that_of_its_recursion() -> None:
    signal, keep = some_load(30, 1), math.exp(-0.1 / 0.7)
    seen = [signal[0]]
    for value in signal[1:]:
        seen.append(keep * seen[-1] + (1.0 - keep) * value)
    assert lagged(signal, 0.1, 0.7) == pytest.approx(seen)


def test_departures_are_factors_and_lags_of_the_signatures_own_rms() -> None:
    sessions = sessions_under(MODEL)
    given: Any = SimpleNamespace(
        sessions=sessions, thresholds=STANDARD, factors=tuple(_factors(one, STANDARD) for one in sessions)
    )
    own = [np.random.default_rng(k).standard_normal(one.reading.size) for k, one in enumerate(sessions)]
    found = departures(given, own)
    size = sum(float(np.sum(one[s.fitted] ** 2)) for one, s in zip(own, sessions, strict=True))
    for column in range(9):
        parts = []
        for one, session in zip(own, sessions, strict=True):
            if column < 6:
                parts.append(one * _factors(session, STANDARD)[:, column])
            else:
                parts.append(lagged(one, STEP_S, STANDARD.memory_s[column - 6]) - one)
        power = sum(float(np.sum(one[s.fitted] ** 2)) for one, s in zip(parts, sessions, strict=True))
        for made, part in zip(found, parts, strict=True):
            assert made[:, column] == pytest.approx(part * math.sqrt(size / power))
    assert directions(STANDARD) == 9
    assert directions(replace(STANDARD, memory_s=(1.0,))) == 7
    nothing = departures(given, [0.0 * one for one in own])
    assert all(not part.any() for part in nothing)


def test_inner_products_are_of_what_the_nuisances_leave() -> None:
    (session, _) = sessions_under(MODEL)
    rows = np.random.default_rng(2).standard_normal((300, 3))
    past = past_columns(session, 0.3)[session.fitted]
    seen = rows[session.fitted]
    left = seen - past @ np.linalg.lstsq(past, seen, rcond=None)[0]
    assert marginal(rows, session, MODEL.relaxation_rate_per_s) == pytest.approx(left.T @ left, rel=1e-7, abs=1e-7)
    # A past that never fades is no other than an offset.
    about = seen - seen.mean(axis=0)
    ever = replace(MODEL, relaxation_rate_per_s=0.0)
    assert marginal(rows, session, ever.relaxation_rate_per_s) == pytest.approx(about.T @ about, rel=1e-6, abs=1e-6)


def test_what_no_column_reaches_is_the_noise() -> None:
    sessions = sessions_under(MODEL, noise=0.05)
    rng = np.random.default_rng(3)
    rows = tuple(np.column_stack([one.reading, one.conditions.load, rng.standard_normal(one.reading.size)])
                 for one in sessions)  # fmt: skip
    given = Linearised(MODEL, tuple(sessions), rows, np.ones(3), 2, (), STANDARD)
    wide = []
    for k, (one, row) in enumerate(zip(sessions, rows, strict=True)):
        own = np.zeros((row.shape[0], 4))
        own[:, 2 * k : 2 * k + 2] = past_columns(one, MODEL.pole_per_s)
        wide.append(np.column_stack([row, own])[one.fitted])
    whole = np.concatenate(wide)
    found = np.linalg.lstsq(whole[:, 1:], whole[:, 0], rcond=None)[0]
    left = []
    for k, (one, row) in enumerate(zip(sessions, rows, strict=True)):
        left.append(
            row[:, 0] - row[:, 1:] @ found[:2] - past_columns(one, MODEL.pole_per_s) @ found[2 + 2 * k : 4 + 2 * k]
        )
    expected = effective_noise_sd(left, [one.fitted for one in sessions])
    assert given.noise_sd() == pytest.approx(expected, rel=1e-6)
    parts = [marginal(r, one, MODEL.pole_per_s) for r, one in zip(rows, sessions, strict=True)]
    assert given.gram[0, 0] == pytest.approx(sum(part[0, 0] for part in parts))


def test_without_some_candidates_the_columns_of_all_others_stay_as_they_are() -> None:
    sessions = sessions_under(MODEL, noise=0.05)
    whole = linearised(MODEL, sessions, STANDARD)
    usual: Any = [SimpleNamespace(**{**vars(one), "without_catch_alls": True}) for one in sessions]
    less, anew = whole.without({"flexible_thixotropy"}, usual), linearised(MODEL, usual, STANDARD)
    assert [(one.name, one.shape, one.columns) for one in less.candidates] == [
        (one.name, one.shape, one.columns) for one in anew.candidates
    ]
    for one, other in zip(less.rows, anew.rows, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(less.scales, anew.scales)
    assert less.noise_sd() == anew.noise_sd()
    assert {one.name for one in whole.candidates} - {one.name for one in less.candidates} == {"flexible_thixotropy"}


@pytest.mark.parametrize(("share", "begun"), [(0.2, 0.5), (0.2, 0.01), (-0.2, -0.5), (0.0, 1.0)])
def test_the_prior_of_a_past_is_of_what_the_arm_may_hold(share: float, begun: float) -> None:
    session = session_under(np.full(5, begun), np.zeros(5))
    sd = max(abs(share) * 1.1 * max(abs(begun), 0.05), 1e-6)
    found = nuisance_precision(session, replace(MODEL, relaxing_share=share))
    assert found == pytest.approx(np.diag([0.0, sd**-2]))
    turned = nuisance_precision(session, replace(MODEL, relaxing_share=share, gain=-1.1))
    assert turned == pytest.approx(found)


def test_after_each_long_gap_the_arm_holds_what_nobody_knows_and_forgets_it_by_its_pole() -> None:
    """Beside what is the recording's own otherwise, in that order: gains, changes of its zero, gaps."""
    session = session_under(some_load(60, 3), np.zeros(60))
    assert nuisances(session, 0.3).shape == (60, 2)
    session.gap_ends = (20, 45)
    first = np.arange(60) < 30
    session.own_gain_sd, session.gain_parts = 0.03, (first, ~first)
    session.zero_changes, session.zero_sd = (50,), 0.02
    read = np.linspace(1.0, 2.0, 60)
    found = nuisances(session, 0.3, read)
    for k in range(60):
        after = [math.exp(-0.3 * STEP_S * (k - end)) if k >= end else 0.0 for end in (20, 45)]
        gains = [0.03 * read[k] * one for one in (k < 30, k >= 30)]
        assert found[k] == pytest.approx([1.0, math.exp(-0.3 * STEP_S * k), *gains, 0.02 * (k >= 50), *after])


@pytest.mark.parametrize("share", [0.2, -0.2, 0.0])
def test_what_the_arm_may_hold_after_a_gap_is_of_the_largest_load(share: float) -> None:
    load = np.array([0.0, 0.1, 0.7, 0.6, 0.0])
    session = session_under(load, np.zeros(5))
    past, gap = (max(abs(share) * 1.1 * most, 1e-6) ** -2 for most in (0.05, 0.7))
    session.gap_ends = (2, 4)
    for by in (1.1, -1.1):
        found = nuisance_precision(session, replace(MODEL, relaxing_share=share, gain=by))
        assert found == pytest.approx(np.diag([0.0, past, gap, gap]))
    every = np.ones(5, dtype=bool)
    session.own_gain_sd, session.gain_parts, session.zero_changes = 0.03, (every,), (3,)
    found = nuisance_precision(session, replace(MODEL, relaxing_share=share))
    assert found == pytest.approx(np.diag([0.0, past, 1.0, 1.0, gap, gap]))


def test_columns_of_a_model_nearby_serve_for_what_is_in_neither() -> None:
    model = MODEL.with_part("dead_band", np.array([0.05, 0.3, 0.1])).with_part("delay", np.array([0.12]))
    other = MODEL.with_part("delay", np.array([0.11])).with_part("saturation")
    sessions = sessions_under(model, sizes=(150, 120))
    by, anew = linearised(other, sessions, STANDARD), linearised(model, sessions, STANDARD)
    found = linearised(model, sessions, STANDARD, by)
    told, expected = ([(one.name, one.shape, one.columns) for one in each.candidates] for each in (found, anew))
    assert (told, found.baseline_count, found.model) == (expected, anew.baseline_count, model)
    assert "saturation" in {one.name for one in found.candidates}  # it is in one of them
    for rows, whole, known in zip(found.rows, anew.rows, by.rows, strict=True):
        assert rows[:, :6] * found.scales[:6] == pytest.approx(whole[:, :6] * anew.scales[:6], abs=1e-12)
        for one in found.candidates[2:]:
            columns = list(one.columns)
            exact = whole[:, columns] * anew.scales[columns]
            place = by.places.get((one.name, tuple(one.shape.values())))
            if place is not None:
                exact = known[:, list(place)] * by.scales[list(place)]
            assert rows[:, columns] * found.scales[columns] == pytest.approx(exact, abs=1e-12)


def test_columns_are_what_each_strength_does_to_the_reading() -> None:
    model = MODEL.with_part("dead_band", np.array([0.05, 0.3, 0.1])).with_part("delay", np.array([0.12]))
    sessions = sessions_under(model, sizes=(150, 120))
    nothing = session_under(some_load(50, 5), np.zeros(50), lost=1.1)
    found = linearised(model, [sessions[0], nothing, sessions[1]], STANDARD)
    assert found.sessions == tuple(sessions)
    assert (found.baseline_count, found.scales[0]) == (3, 1.0)
    assert [one.columns for one in found.candidates[:2]] == [(4,), (5,)]
    assert [one.name for one in found.candidates[:2]] == ["dead_band", "delay"]
    assert (dict(found.candidates[0].shape), dict(found.candidates[1].shape)) == ({"softness": 0.3, "onset": 0.1}, {})
    outside = found.candidates[2:]
    assert not {one.name for one in outside} & {"dead_band", "delay"}
    place = 6
    for one in outside:
        count = sum(p.null is not None for p in one.effect.parameters)
        assert one.columns == tuple(range(place, place + count))
        place += count
    assert found.rows[0].shape[1] == place == found.scales.size
    for name in {one.name for one in outside}:
        own = [dict(one.shape) for one in outside if one.name == name]
        assert own == [dict(shape) for shape in effect_of(outside, name).shapes_with(())]
    assert found.shapes["second_relaxation"] == len(effect("second_relaxation").shapes)
    for row, session in zip(found.rows, sessions, strict=True):
        at = session.conditions
        plain = model.simulate(at)
        within = [plain - model.without(name).simulate(at) for name in ("dead_band", "delay")]
        assert row[:, 0] == pytest.approx(session.reading - plain + within[0] + within[1])
        told = row * found.scales
        slopes = model.sensitivities(at)[1]
        assert told[:, 1:4] == pytest.approx(slopes[:, :3])
        assert told[:, 4:6] == pytest.approx(np.column_stack(within))
        for one in (one for one in outside if one.name in ("second_relaxation", "sensor_nonlinearity")):
            start = one.effect.start(one.shape)
            beside = model.extended_by(one.effect, start)
            expected = model.column_of(beside, at, model.trace(at))
            assert told[:, list(one.columns)] == pytest.approx(expected)
    whole = np.concatenate([row[one.fitted] for row, one in zip(found.rows, sessions, strict=True)])
    rms = np.sqrt(np.mean(whole[:, 1:] ** 2, axis=0))
    # What moves the reading by less than any noise is rounding, which is left as small as it is.
    is_there = rms * found.scales[1:] >= FLOOR
    assert 0 < np.sum(~is_there) < np.sum(is_there)
    assert rms[is_there] == pytest.approx(1.0)
    assert (found.scales[1:][~is_there] == 1.0).all()


def effect_of(candidates: Any, name: str) -> Any:
    return next(one.effect for one in candidates if one.name == name)
