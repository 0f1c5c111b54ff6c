"""The columns that inference works on, the baseline's grid and held-out errors, against written-out sums."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import t as student
from told_evidence import WAVE, session_of

from smartshoe import Recording
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._baseline import (
    POLES_PER_S,
    SHARE,
    USUAL,
    _wall_ratio,
    baseline_of,
    is_turned_over,
    with_usual_arm,
)
from smartshoe.diagnosis._force import force_error
from smartshoe.diagnosis._held_out import Errors, errors, gain, own_of, residual_of
from smartshoe.diagnosis._noise import FLOOR, correlated_sd
from smartshoe.diagnosis._prepared import prepared
from smartshoe.diagnosis._scale import Scale, full_scale
from smartshoe.diagnosis._sensitivity import (
    Candidate,
    Linearised,
    _factors,
    available,
    departures,
    directions,
    lagged,
    linearised,
    marginal,
    nuisance_precision,
    nuisances,
    where,
)
from smartshoe.diagnosis._session import prepare
from smartshoe.integrity import examine
from smartshoe.models.core import USUAL_WALL_RATIO
from smartshoe.models.effects import Conditions, effect, is_told_from_its_family
from smartshoe.models.effects.exposure import WORDS
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR, VOLT

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")
SCALE = Scale(800.0, 140.0, MILLIBAR)
STEP_S = 0.1


def _session(load: Array, reading: Array, seed: int = 0, lost: float = 0.2, held: Any = None) -> Any:
    rng = np.random.default_rng([seed, 9])
    usable = rng.random(load.size) >= lost
    held_out = np.zeros(load.size, dtype=bool) if held is None else held
    told = SimpleNamespace(metadata={}, sensor=SimpleNamespace(unit=MILLIBAR))
    return SimpleNamespace(
        conditions=Conditions(STEP_S * np.arange(load.size), load, STEP_S), reading=reading, usable=usable,
        held_out=held_out, fitted=usable & ~held_out, judged=usable & held_out,
        cycle=np.arange(load.size) * 7 // load.size, recording=told, unknown_past=0.05,
        own_gain_sd=0.0, gain_parts=(), zero_changes=(), zero_sd=0.0, gap_ends=(), thinned=1, resting=load <= 0.0,
    )  # fmt: skip


def _load(size: int, seed: int) -> Array:
    rng = np.random.default_rng([seed, 4])
    return np.interp(np.arange(size), np.linspace(0, size, 20), rng.uniform(0.0, 1.0, 20))


def _past(session: Any, rate_per_s: float) -> Array:
    return np.array([[1.0, math.exp(-rate_per_s * at)] for at in session.conditions.time_s])


def _sessions(model: ExtendedModel, noise: float = 0.01, sizes: tuple[int, ...] = (300, 220)) -> list[Any]:
    made = []
    for seed, size in enumerate(sizes):
        load = _load(size, seed)
        at = Conditions(STEP_S * np.arange(size), load, STEP_S)
        off = noise * np.random.default_rng(seed).standard_normal(size)
        made.append(_session(load, 0.05 * seed + model.simulate(at) + off, seed))
    return made


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
        assert tuple(one.has_sign_of(np.array([by])) for by in (1.0, 0.0, -1.0)) == told
    both = _candidate((0.0, 0.0, 5.0), (0.0, -5.0, 0.0))
    assert both.has_sign_of(np.array([1.0, -1.0]))
    assert not both.has_sign_of(np.array([1.0, 1.0]))
    assert not both.has_sign_of(np.array([-1.0, -1.0]))


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
        return {one.name for one in available(sessions, STANDARD)}

    assert told(beside) - told(bare) == {"cross_talk"}
    assert told(beside, bare) == told(bare)
    assert told(warm) >= told(bare)
    for one in available([bare], STANDARD):
        assert one.is_physical
        assert one.shifts is None
        assert not one.is_refinement
        assert not one.needs


def test_what_only_later_load_cycles_show_is_not_looked_for_where_no_recording_has_any() -> None:
    """A strip that is pulled once a file shows nothing of softening, nor of a gain that settles or drifts."""
    once = session_of(np.interp(np.arange(200), [0, 100, 199], [0.0, 1.0, 0.0]))
    twice = session_of(np.interp(np.arange(200), [0, 50, 100, 150, 199], [0.0, 1.0, 0.1, 0.6, 0.0]))

    def told(*sessions: Any) -> set[str]:
        return {one.name for one in available(sessions, STANDARD)}

    memories = {
        "mullins_softening", "cycle_conditioning", "gain_drift", "flexible_softening", "flexible_gain_drift",
        "flexible_lag",
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
    signal, keep = _load(30, 1), math.exp(-0.1 / 0.7)
    seen = [signal[0]]
    for value in signal[1:]:
        seen.append(keep * seen[-1] + (1.0 - keep) * value)
    assert lagged(signal, 0.1, 0.7) == pytest.approx(seen)


def test_departures_are_factors_and_lags_of_the_signatures_own_rms() -> None:
    sessions = _sessions(MODEL)
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
    (session, _) = _sessions(MODEL)
    rows = np.random.default_rng(2).standard_normal((300, 3))
    past = _past(session, 0.3)[session.fitted]
    seen = rows[session.fitted]
    left = seen - past @ np.linalg.lstsq(past, seen, rcond=None)[0]
    assert marginal(rows, session, MODEL.relaxation_rate_per_s) == pytest.approx(left.T @ left, rel=1e-7, abs=1e-7)
    # A past that never fades is no other than an offset.
    about = seen - seen.mean(axis=0)
    ever = replace(MODEL, relaxation_rate_per_s=0.0)
    assert marginal(rows, session, ever.relaxation_rate_per_s) == pytest.approx(about.T @ about, rel=1e-6, abs=1e-6)


def test_what_no_column_reaches_is_the_noise() -> None:
    sessions = _sessions(MODEL, noise=0.05)
    rng = np.random.default_rng(3)
    rows = tuple(np.column_stack([one.reading, one.conditions.load, rng.standard_normal(one.reading.size)])
                 for one in sessions)  # fmt: skip
    given = Linearised(MODEL, tuple(sessions), rows, np.ones(3), 2, (), STANDARD)
    wide = []
    for k, (one, row) in enumerate(zip(sessions, rows, strict=True)):
        own = np.zeros((row.shape[0], 4))
        own[:, 2 * k : 2 * k + 2] = _past(one, MODEL.pole_per_s)
        wide.append(np.column_stack([row, own])[one.fitted])
    whole = np.concatenate(wide)
    found = np.linalg.lstsq(whole[:, 1:], whole[:, 0], rcond=None)[0]
    left = []
    for k, (one, row) in enumerate(zip(sessions, rows, strict=True)):
        left.append(row[:, 0] - row[:, 1:] @ found[:2] - _past(one, MODEL.pole_per_s) @ found[2 + 2 * k : 4 + 2 * k])
    expected = correlated_sd(left, [one.fitted for one in sessions])
    assert given.noise_sd() == pytest.approx(expected, rel=1e-6)
    parts = [marginal(r, one, MODEL.pole_per_s) for r, one in zip(rows, sessions, strict=True)]
    assert given.gram[0, 0] == pytest.approx(sum(part[0, 0] for part in parts))


@pytest.mark.parametrize(("share", "begun"), [(0.2, 0.5), (0.2, 0.01), (-0.2, -0.5), (0.0, 1.0)])
def test_the_prior_of_a_past_is_of_what_the_arm_may_hold(share: float, begun: float) -> None:
    session = _session(np.full(5, begun), np.zeros(5))
    sd = max(abs(share) * 1.1 * max(abs(begun), 0.05), 1e-6)
    found = nuisance_precision(session, replace(MODEL, relaxing_share=share))
    assert found == pytest.approx(np.diag([0.0, sd**-2]))
    turned = nuisance_precision(session, replace(MODEL, relaxing_share=share, gain=-1.1))
    assert turned == pytest.approx(found)


def test_after_each_long_gap_the_arm_holds_what_nobody_knows_and_forgets_it_by_its_pole() -> None:
    """Beside what is the recording's own otherwise, in that order: gains, changes of its zero, gaps."""
    session = _session(_load(60, 3), np.zeros(60))
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
    session = _session(load, np.zeros(5))
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
    sessions = _sessions(model, sizes=(150, 120))
    by, anew = linearised(other, sessions, STANDARD), linearised(model, sessions, STANDARD)
    found = linearised(model, sessions, STANDARD, by)
    told, expected = ([(one.name, one.shape, one.columns) for one in each.candidates] for each in (found, anew))
    assert (told, found.own, found.model) == (expected, anew.own, model)
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
    sessions = _sessions(model, sizes=(150, 120))
    nothing = _session(_load(50, 5), np.zeros(50), lost=1.1)
    found = linearised(model, [sessions[0], nothing, sessions[1]], STANDARD)
    assert found.sessions == tuple(sessions)
    assert (found.own, found.scales[0]) == (3, 1.0)
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


# -- the baseline -----------------------------------------------------------------------------------------------------
def _slow_baseline(sessions: list[Any]) -> tuple[float, float, float]:
    best = (math.inf, 0.0, 0.0, 0.0)
    for pole in np.geomspace(0.01, 50.0, 35):
        rows = []
        for one in (one for one in sessions if one.fitted.any()):
            load = one.conditions.load
            kept = one.fitted
            seen = np.column_stack([one.reading, load, lagged(load, STEP_S, 1.0 / pole)])[kept]
            past = _past(one, pole)[kept]
            rows.append(seen - past @ np.linalg.lstsq(past, seen, rcond=1e-10)[0])
        whole = np.concatenate(rows)
        fast, slow = np.linalg.lstsq(whole[:, 1:], whole[:, 0], rcond=None)[0]
        within = -0.9 <= slow / fast <= 50.0
        for share in (slow / fast,) if within else (-0.9, 50.0):
            column = (whole[:, 1:2] + share * whole[:, 2:]) / (1.0 + share)
            (total,), square, *_ = np.linalg.lstsq(column, whole[:, 0], rcond=None)
            if total > 0.0:
                best = min(best, (float(square[0]), total, share, pole))
    _, total, share, pole = best
    return total, share, pole * (1.0 + share)


@pytest.mark.parametrize(("share", "rate"), [(0.1, 0.3), (0.5, 2.0), (-0.3, 0.5), (1.5, 0.1)])
def test_the_baseline_is_the_best_of_written_out_least_squares(share: float, rate: float) -> None:
    sessions = _sessions(replace(MODEL, relaxing_share=share, relaxation_rate_per_s=rate), noise=0.003)
    sessions.append(_session(_load(60, 8), np.zeros(60), lost=1.1))
    found = baseline_of(sessions, SCALE)
    told = found.gain, found.relaxing_share, found.relaxation_rate_per_s
    assert told == pytest.approx(_slow_baseline(sessions), rel=1e-5)
    assert (found.full_scale_load_n, found.full_scale_reading, found.reading_unit) == (800.0, 140.0, "mbar")
    assert found.wall_ratio == USUAL_WALL_RATIO


@pytest.mark.parametrize(("fast", "slow"), [(0.1, 2.0), (5.0, -4.9)])
def test_a_share_beyond_what_a_wall_can_have_is_held_at_its_bound(fast: float, slow: float) -> None:
    sessions = _sessions(MODEL)
    for one in sessions:
        load = one.conditions.load
        one.reading = fast * load + slow * lagged(load, STEP_S, 1.0 / 0.5)
    found = baseline_of(sessions, SCALE)
    told = found.gain, found.relaxing_share, found.relaxation_rate_per_s
    assert SHARE.lower <= found.relaxing_share <= SHARE.upper
    assert told == pytest.approx(_slow_baseline(sessions), rel=1e-5)


def test_a_unit_that_is_slower_than_its_load_is_not_turned_over() -> None:
    """Under three steps it rises still where the load has fallen; its static gain tells its sign."""
    time_s = 0.2 * np.arange(180)
    load_n = np.select([time_s < 1.0, time_s < 15.0, time_s < 30.0], [0.0, 80.0, 20.0], 70.0)
    heated = 20.0 + 0.9 * lagged(lagged(load_n, 0.2, 18.0), 0.2, 1.0)
    for sign in (1.0, -1.0):
        one = Recording.from_arrays(time_s=time_s, force_n=load_n, heater_v=sign * heated)
        usable = [np.ones(len(one), dtype=bool)]
        scale = full_scale([one], usable, STANDARD)
        assert scale.reading * sign < 0.0  # what goes together at once tells the other sign
        sessions = prepare([one], usable, None, scale, [1], STANDARD)
        assert is_turned_over(sessions, STANDARD)
        assert not is_turned_over([replace(one, reading=-one.reading) for one in sessions], STANDARD)
        assert prepared([one], 1, examine([one], STANDARD), STANDARD).scale.reading * sign > 0.0


def test_a_sign_that_tells_little_stays_as_it_is() -> None:
    sessions = _sessions(MODEL, noise=0.0)
    for sign, is_turned in ((1.0, False), (-1.0, True)):
        for one in sessions:
            one.reading = sign * one.conditions.load
        assert is_turned_over(sessions, STANDARD) is is_turned
    rng = np.random.default_rng(1)
    for one in sessions:
        one.reading = rng.standard_normal(one.reading.size) - 0.1 * one.conditions.load
    assert not is_turned_over(sessions, STANDARD)


def test_a_reading_that_falls_under_load_has_a_plain_baseline() -> None:
    sessions = _sessions(MODEL, noise=0.0)
    for one in sessions:
        one.reading = -one.conditions.load
    found = baseline_of(sessions, SCALE)
    assert (found.gain, found.relaxing_share, found.relaxation_rate_per_s) == (1.0, 0.0, 0.2)
    usual = with_usual_arm(found)
    assert (usual.gain, usual.relaxing_share, usual.relaxation_rate_per_s) == (1.0, 0.08, 0.22)
    # A unit as the paper's are: what a held full scale of 800 N reads is all of it.
    assert (USUAL.gain, USUAL.full_scale_load_n, USUAL.full_scale_reading) == (1.0, 800.0, 100.0)
    assert POLES_PER_S[[0, -1]] == pytest.approx([0.01, 50.0])


@pytest.mark.parametrize(("ratio", "is_told"), [(1.019, False), (1.021, True), (49.9, True), (50.1, False)])
def test_a_declared_area_tells_the_walls_ratio_within_what_can_be(ratio: float, is_told: bool) -> None:
    pascal_per_newton = 1.1 * 140.0 * 100.0 / 800.0
    area = {"effective_area_m2": str(1.0 / (ratio * pascal_per_newton))}
    recording = Recording.from_arrays(
        time_s=np.arange(3.0), force_n=np.ones(3), pressure_mbar=np.ones(3), metadata=area
    )
    session: Any = SimpleNamespace(recording=recording)
    found = _wall_ratio([session], 1.1, SCALE)
    assert found == pytest.approx(ratio if is_told else USUAL_WALL_RATIO)
    assert _wall_ratio([session], 1.1, replace(SCALE, unit=VOLT)) == USUAL_WALL_RATIO
    # One recording of the unit says it for all, wherever it stands among them.
    bare: Any = SimpleNamespace(recording=replace(recording, metadata={}))
    for sessions in ([bare, session], [session, bare], [bare, session, bare]):
        assert _wall_ratio(sessions, 1.1, SCALE) == found
    assert _wall_ratio([bare, bare], 1.1, SCALE) == USUAL_WALL_RATIO


# -- what is held out -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("share", [0.1, -0.1, 0.0])
def test_an_offset_and_a_past_are_ridge_estimates_of_what_was_fitted(share: float) -> None:
    model = replace(MODEL, relaxing_share=share)
    for held in (np.arange(220) > 150, np.ones(220, dtype=bool)):
        one = _session(_load(220, 3), np.zeros(220), 3, held=held)
        residual = 0.3 + 0.1 * np.random.default_rng(6).standard_normal(220)
        mask = one.fitted if one.fitted.any() else one.usable
        past = _past(one, 0.3 / (1.0 + share))
        holds = max(abs(share) * 1.1, 1e-6)
        spread = np.std(residual[mask])
        wide = np.concatenate([past[mask], [[0.0, spread / holds]]])
        expected = np.linalg.lstsq(wide, np.append(residual[mask], 0.0), rcond=None)[0]
        found, added = own_of(one, model, residual)
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
        assert added == pytest.approx(past @ expected)
    lost = _session(_load(50, 3), np.zeros(50), lost=1.1)
    assert own_of(lost, model, np.ones(50))[0] == pytest.approx([0.0, 0.0])


def test_errors_are_sums_over_held_out_cycles_and_deviations_from_each_mean() -> None:
    sessions = _sessions(MODEL, noise=0.05)
    held = []
    for one in sessions:
        held.append(_session(one.conditions.load, one.reading, 4, held=np.isin(one.cycle, [1, 4, 6])))
    held[1].cycle[:] = np.minimum(held[1].cycle, 5)
    found = errors([*held, sessions[0]], MODEL)
    squares, counts, spread = [], [], 0.0
    for one in held:
        residual = residual_of(one, MODEL)
        for number in range(7):
            inside = [k for k in range(residual.size) if one.judged[k] and one.cycle[k] == number]
            if inside:
                squares.append(sum(residual[k] ** 2 for k in inside))
                counts.append(len(inside))
        values = one.reading[one.judged]
        spread += float(np.sum((values - np.mean(values)) ** 2))
    assert found.squares == pytest.approx(squares)
    assert list(found.counts) == counts
    assert found.spread == pytest.approx(math.sqrt(spread / sum(counts)))
    expected = math.sqrt(sum(squares) / sum(counts))
    assert found.rmse == pytest.approx(expected)
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - expected / found.spread))
    level = replace(found, spread=0.0)
    assert (level.fit_percent, level.variance_explained_percent) == (0.0, 0.0)


def test_a_gain_is_of_norms_and_its_interval_of_cycles_left_out_in_turn() -> None:
    rng = np.random.default_rng(3)
    before = Errors(rng.uniform(1.0, 2.0, 12), np.full(12, 5.0), 1.0)
    after = Errors(rng.uniform(0.1, 1.0, 12), np.full(12, 5.0), 1.0)

    def gained(log_ratio: float) -> float:
        return 100.0 * (1.0 - math.exp(0.5 * log_ratio))

    for count in (12, 3, 2):
        a, b = after.squares[:count], before.squares[:count]
        found = gain(replace(before, squares=b), replace(after, squares=a), SCALE, STANDARD)
        whole = math.log(sum(a) / sum(b))
        assert found.gain_percent == pytest.approx(gained(whole))
        kept = [[k for k in range(count) if k != out] for out in range(count)]
        logs = [math.log(sum(a[k]) / sum(b[k])) for k in kept]
        sd = math.sqrt((count - 1) / count * sum((one - sum(logs) / count) ** 2 for one in logs))
        reach = float(student.isf(0.025, count - 1)) * sd
        assert found.ci95 == pytest.approx((gained(whole + reach), gained(whole - reach)))
        assert found.ci95[0] < found.gain_percent < found.ci95[1]


def test_no_error_at_all_is_a_number_too() -> None:
    none, some = (Errors(np.full(3, size), np.full(3, 5.0), 1.0) for size in (0.0, 1.0))
    one = replace(some, squares=np.array([1.0, 0.0, 0.0]))
    assert gain(none, none, SCALE, STANDARD).gain_percent == 0.0
    assert gain(some, none, SCALE, STANDARD).gain_percent == pytest.approx(100.0)
    for before, after in ((none, some), (one, some), (some, one)):
        found = gain(before, after, SCALE, STANDARD)
        assert np.isfinite([found.gain_percent, *found.ci95]).all()


@pytest.mark.parametrize("count", [2, 3, 4, 6, 12])
def test_models_that_are_alike_differ_beyond_chance_as_often_as_an_interval_says(count: int) -> None:
    """About one in forty on either side. Cycles of unlike sizes, and errors of which the models share a half."""
    rng = np.random.default_rng(count)
    drawn = 2000
    size = rng.uniform(0.5, 1.5, (drawn, count, 1))
    shared, own, other = size * rng.standard_normal((3, drawn, count, 10))
    times = np.ones(count)
    losses = gains = certain = 0
    for first, second in zip(np.sum((shared + own) ** 2, 2), np.sum((shared + other) ** 2, 2), strict=True):
        found = gain(Errors(first, times, 1.0), Errors(second, times, 1.0), SCALE, STANDARD)
        losses += found.ci95[1] < 0.0
        gains += found.ci95[0] > 0.0
        certain += found.is_loss
    assert 0.015 * drawn < min(losses, gains)
    assert max(losses, gains) < 0.04 * drawn
    assert certain == (losses if count >= STANDARD.few else 0)


@pytest.mark.parametrize(("count", "grows", "is_loss"), [(5, 1.001, True), (4, 1.001, False), (5, 0.999, False)])
def test_a_loss_is_of_what_is_material_and_of_more_than_a_few_cycles(count: int, grows: float, is_loss: bool) -> None:
    rmse = 0.01 + grows * STANDARD.material
    cycles = np.linspace(0.9, 1.1, count)
    before, after = (Errors(cycles * square, np.ones(count), 1.0) for square in (1e-4, rmse**2))
    found = gain(before, after, SCALE, STANDARD)
    assert found.ci95[1] < 0.0
    assert found.is_loss is is_loss
    coarse = replace(STANDARD, material=2.0 * STANDARD.material)
    assert not gain(before, after, SCALE, coarse).is_loss


@pytest.mark.parametrize(("before", "after", "grown"), [(3.0, 5.0, 4.0), (5.0, 3.0, 0.0), (2.0, 2.0, 0.0)])
def test_an_error_grows_by_the_root_of_what_its_square_does(before: float, after: float, grown: float) -> None:
    """Of one cycle as of many: it is what verdicts ask, certain or not."""
    first, second = (Errors(np.array([(0.001 * rms) ** 2]), np.ones(1), 1.0) for rms in (before, after))
    assert gain(first, second, SCALE, STANDARD).growth(SCALE) == pytest.approx(0.001 * grown)


def test_a_forces_error_is_that_of_the_compensated_reading() -> None:
    """Of a model without an arm the force is the reading over the gain; its offset is the recording's own."""
    plain = replace(MODEL, relaxing_share=0.0)
    squares = {"fitted": 0.0, "judged": 0.0}
    counts = {"fitted": 0, "judged": 0}
    held = []
    for seed, size in enumerate((200, 150)):
        load = _load(size, seed)
        noise = 0.02 * np.random.default_rng(seed).standard_normal(size)
        one = _session(load, 1.1 * load + 0.2 + noise, seed, held=np.arange(size) > 0.4 * size)
        held.append(one)
        _, own = own_of(one, plain, one.reading - plain.simulate(one.conditions))
        off = 800.0 * ((one.reading - own) / 1.1 - load)
        for which in squares:
            part = off[getattr(one, which)]
            squares[which] += float(part @ part)
            counts[which] += part.size
    unjudged = _session(_load(80, 1), np.zeros(80))
    fitted_n, judged_n = (math.sqrt(squares[which] / counts[which]) for which in squares)
    assert force_error(held, plain).fitted_n == pytest.approx(fitted_n, rel=1e-6)
    assert force_error([held[0], unjudged, held[1]], plain).held_out_n == pytest.approx(judged_n, rel=1e-6)
    assert math.isnan(force_error([unjudged], plain).held_out_n)


def test_rows_of_cycles_of_scattered_samples_and_of_none_are_those_of_the_mask() -> None:
    columns = np.asfortranarray(np.random.default_rng(3).standard_normal((600, 4)))
    masks = [np.arange(600) // 200 != 1, np.arange(600) % 3 > 0, np.zeros(600, dtype=bool), np.arange(600) == 7]
    for mask in masks:
        found = where(mask, columns)
        np.testing.assert_array_equal(found, columns[mask])
        assert found.flags.f_contiguous
    assert where(np.ones(600, dtype=bool), columns) is columns
