"""Which arms and laws are tried in the place of others, and which stay: by fits that are told beforehand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD

from smartshoe.diagnosis import _arms, _convergence, _laws
from smartshoe.diagnosis._arms import arms_of, effect_count
from smartshoe.diagnosis._baseline import has_arm_beyond_memory, has_extreme_arm
from smartshoe.diagnosis._laws import (
    _blocks_banned_for,
    _is_stretched,
    _with_another_curve,
    _with_distinct_branches,
    likelier_changes,
    with_laws,
)
from smartshoe.diagnosis._members import Alternative
from smartshoe.diagnosis._sensitivity import Candidate
from smartshoe.models.effects import blocks, catalogue, effect
from smartshoe.models.extended import ExtendedModel

MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")
NOTHING_FITTED = SimpleNamespace(sessions=())


# -- arms -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("share", "rate", "stretched"),
    [(0.1, 0.3, False), (-0.9, 0.3, True), (5.0, 0.3, True), (0.1, 0.01, True), (0.1, 50.0, True),
     (-0.899, 49.9, False), (4.99, 0.0101, False)],
)  # fmt: skip
def test_an_arm_at_a_bound_is_stretched(share: float, rate: float, stretched: bool) -> None:
    assert has_extreme_arm(ExtendedModel(1.0, share, rate, 800.0, 140.0, "mbar")) is stretched


@pytest.mark.parametrize(
    ("tau_s", "beyond"), [(0.299, True), (0.301, False), (3.0, False), (29.9, False), (30.1, True)]
)
def test_an_arm_is_beyond_memory_where_it_relaxes_faster_or_slower_than_laws_remember(
    tau_s: float, beyond: bool
) -> None:
    assert has_arm_beyond_memory(replace(MODEL, relaxation_rate_per_s=1.0 / tau_s), STANDARD) is beyond


class _Fitted(SimpleNamespace):
    __hash__ = object.__hash__


def test_a_usual_arm_is_tried_at_each_memory_with_the_few_effects_that_promise_most(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The best by cost and odds among fits whose arm stays one as units have; of all, where none does.

    The three best of either go on to their end, and there they are compared.
    """
    costs = {"best": 30.0, "a": 20.0, "b": 60.0}
    ends: dict[str, float] = {}  # where an effect takes the arm, if not nowhere
    tried: list[Any] = []
    half_way: dict[int, _Fitted] = {}
    gone_on: list[str] = []
    falls: dict[str, float] = {}
    posterior = SimpleNamespace(posterior=lambda members: "ab"[members[0]], linearisation="given")

    def fitted(likelihood: Any, given: Any, steps: int | None = None) -> Any:
        if steps is None:
            before = half_way[id(given)]
            gone_on.append(before.one)
            return _Fitted(model=given, cost=before.cost - falls.get(before.one, 0.0), one=before.one)
        start, one = given
        tried.append((start.names, start.relaxing_share, start.relaxation_rate_per_s, one, steps))
        rate = ends.get(one, start.relaxation_rate_per_s)
        cost = costs[one] + abs(start.relaxation_rate_per_s - 1.0 / 3.0)
        found = _Fitted(model=replace(start, relaxation_rate_per_s=rate), cost=cost, one=one, likelihood=None)
        half_way[id(found.model)] = found
        return found

    monkeypatch.setattr(_arms, "linearised_search", lambda start, sessions, thresholds: (posterior, "best"))
    monkeypatch.setattr(_arms, "best_additions", lambda evidence, members, breadth: [0, 1])
    monkeypatch.setattr(_arms, "with_members", lambda given, one, start, likelihood: (start, one))
    monkeypatch.setattr(_arms, "fit", fitted)
    monkeypatch.setattr(_arms, "state_at", lambda found, *given: found)
    state: Any = SimpleNamespace(
        fit=SimpleNamespace(model=replace(MODEL, relaxing_share=4.0, relaxation_rate_per_s=0.01)),
        likelihood=lambda: None, thresholds=STANDARD, evidence=SimpleNamespace(odds=10.0), linearisation=NOTHING_FITTED,
    )  # fmt: skip
    # The fastest and the slowest of memories are no more such themselves: of a usual arm is that between.
    for there, fall, taken, going_on in (
        ({"a": 50.0}, 0.0, "best", ["best", "b", "a", "a", "a"]),
        ({"a": 0.2}, 0.0, "a", ["a", "a", "a"]),
        (dict.fromkeys(costs, 0.01), 0.0, "a", ["a", "a", "a"]),
        ({"a": 50.0, "b": 0.2}, 40.0, "b", ["best", "b", "b", "a", "a", "a"]),  # it falls most on the way
    ):
        ends.clear()
        ends.update(there)
        falls.update(b=fall)
        gone_on.clear()
        found: Any = _arms.with_a_usual_arm(state)
        assert (found.one, gone_on) == (taken, going_on)
    arms = [((), 0.08, 1.0 / tau_s, one, 4) for tau_s in STANDARD.memory_s for one in ("best", "a", "b")]
    assert tried == arms * 4


def test_an_arm_that_creeps_is_one_of_a_share_above_nothing() -> None:
    for share, count in ((0.1, 1), (0.0, 0)):
        model = MODEL.with_part("second_relaxation", np.array([share, 5.0])).with_part("dead_band")
        assert len(arms_of(model)) == count
    assert effect_count(ExtendedModel(1.0, 0.0, 0.3, 800.0, 140.0, "mbar")) == 0


def test_a_latency_is_the_best_that_is_not_there_yet_beside_a_usual_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    late = [effect(name) for name in ("delay", "sensor_lag", "clock_drift", "linear_leak")]
    latencies = [one.name for one in late if one.is_latency]
    assert len(latencies) > 1
    begun: list[Any] = []

    def begin(one: Any, bare: ExtendedModel, likelihood: Any) -> Any:
        begun.append((one.name, bare.names, bare.relaxing_share, bare.relaxation_rate_per_s))
        return one.name

    monkeypatch.setattr(_arms, "available_effects", lambda sessions, thresholds: late)
    monkeypatch.setattr(_arms, "start_with", begin)
    monkeypatch.setattr(_arms, "fit", lambda likelihood, name: SimpleNamespace(model=name, cost=-len(name)))
    likelihood = SimpleNamespace(sessions=())
    stretched = ExtendedModel(1.0, 5.0, 50.0, 800.0, 140.0, "mbar").with_part("delay")
    state: Any = SimpleNamespace(
        fit=SimpleNamespace(model=stretched), likelihood=lambda: likelihood, thresholds=STANDARD
    )
    expected = [name for name in latencies if name != "delay"]
    assert _arms.latency_with_usual_arm(state).model == max(expected, key=len)  # type: ignore[comparison-overlap]
    assert begun == [(name, ("delay",), 0.08, 0.22) for name in expected]


def test_an_arm_that_creeps_is_tried_for_each_memory_and_each_effects_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    """The best by cost and odds against effects: an arm of the baseline's that falls is one."""
    model = ExtendedModel(1.0, -0.1, 0.3, 800.0, 140.0, "mbar").with_part("second_relaxation", np.array([0.2, 5.0]))
    starts: list[Any] = []
    leaks: list[float] = []

    def linearised_search(start: ExtendedModel, sessions: Any, thresholds: Any) -> Any:
        starts.append((start.names, start.relaxing_share, start.relaxation_rate_per_s))
        leaks.extend(float(part.values[0]) for part in start.parts)
        return SimpleNamespace(linearisation="given"), "best"

    costs = {1.0 / 0.3: 50.0, 1.0 / 3.0: 45.0, 1.0 / 30.0: 100.0, 0.2: 40.0}

    def fitted(likelihood: Any, start: ExtendedModel, steps: int = 25) -> Any:
        rate = start.relaxation_rate_per_s
        share = -0.1 if rate == 0.2 else 0.1  # it has come to fall
        ended = ExtendedModel(1.0, share, rate, 800.0, 140.0, "mbar")
        return SimpleNamespace(model=ended, cost=costs[rate], steps=steps, likelihood=likelihood)

    monkeypatch.setattr(_arms, "linearised_search", linearised_search)
    monkeypatch.setattr(_arms, "with_members", lambda given, best, start, likelihood: start)
    monkeypatch.setattr(_arms, "fit", fitted)
    monkeypatch.setattr(_arms, "state_at", lambda found, *given: found)
    for odds, rate in ((10.0, 1.0 / 3.0), (1.0, 0.2)):
        state: Any = SimpleNamespace(
            fit=SimpleNamespace(model=model), likelihood=lambda: None, thresholds=STANDARD,
            evidence=SimpleNamespace(odds=odds), linearisation=NOTHING_FITTED,
        )  # fmt: skip
        found: Any = _arms.with_creeping_arm(state)
        assert (found.model.relaxation_rate_per_s, found.steps) == (rate, 25)  # the best go on to their end
    memories = [((), 0.08, 1.0 / tau_s) for tau_s in STANDARD.memory_s]
    arms = [*memories, ((), pytest.approx(0.2), pytest.approx(0.2))]
    # Each arm by itself, and beside the effect that makes the reading of a hold fall.
    assert starts[:8] == [*arms, *((("linear_leak",), *arm[1:]) for arm in arms)]
    assert leaks == [pytest.approx(model.pole_per_s / (1.0 - 1.0 / model.wall_ratio))] * 8  # twice
    starts.clear()
    rates: list[float] = []

    def poled(likelihood: Any, start: ExtendedModel, steps: int) -> Any:
        rates.append(start.relaxation_rate_per_s)
        assert (start.names, start.relaxing_share, steps) == ((), 0.08, 4)
        return SimpleNamespace(model=start, cost=costs[start.relaxation_rate_per_s])

    monkeypatch.setattr(_arms, "fit", poled)
    best: Any = _arms.with_another_pole(state)
    assert rates == [1.0 / tau_s for tau_s in STANDARD.memory_s]
    assert best.model.relaxation_rate_per_s == 1.0 / 3.0


@pytest.mark.parametrize(("simpler", "ends"), [(True, "tried b"), (False, "first")])
def test_in_the_end_an_effects_arm_is_tried_in_the_baselines_place(
    monkeypatch: pytest.MonkeyPatch, simpler: bool, ends: str
) -> None:
    tried: list[Any] = []

    def swapped(model: Any, arm: Any) -> Any:
        tried.append((model, arm))
        return f"{model} {arm}"

    def state(name: str) -> Any:
        model = SimpleNamespace(names=(), parts=(), without=lambda other: f"without {other}")
        return SimpleNamespace(
            name=name, fit=SimpleNamespace(model=model), chosen=(), is_worth_a_fit=False, thresholds=None,
            banned=("z",), evidence=SimpleNamespace(odds=10.0), likelihood=lambda: None,
        )  # fmt: skip

    banned: list[Any] = []

    def stated(found: Any, without: Any) -> Any:
        banned.append(without)
        return state(f"tried {found[-1]}")

    monkeypatch.setattr(_convergence, "arms_of", lambda model: [("a", "arm a"), ("b", "arm b")])
    monkeypatch.setattr(_convergence, "with_arm", swapped)
    monkeypatch.setattr(_convergence, "fit", lambda likelihood, model: model)
    monkeypatch.setattr(_convergence, "_is_simpler", lambda *given: simpler)
    monkeypatch.setattr(_convergence, "state_at", stated)
    monkeypatch.setattr(_convergence, "replace", lambda one, **given: one)
    assert _convergence.converged(state("first"), lambda said: None).name == ends  # type: ignore[attr-defined]
    assert tried == [("without a", "arm a"), ("without b", "arm b")]
    assert banned == [("z",), ("z",)] * simpler


# -- laws -------------------------------------------------------------------------------------------------------------
def test_a_law_takes_its_blocks_place_and_bans_it_where_it_misses_little(monkeypatch: pytest.MonkeyPatch) -> None:
    curve = next(one for family in blocks().values() for one in family if one.is_memoryless)
    other = next(one for family in blocks().values() for one in family if not one.is_memoryless)
    curves = {one.name for family in blocks().values() for one in family if one.is_memoryless}
    assert set(_blocks_banned_for(curve)) == curves
    assert _blocks_banned_for(other) == (other.name,)
    chosen = tuple(SimpleNamespace(effect=one, name=one.name) for one in (curve, effect("dead_band"), other))
    about: Any = SimpleNamespace(model=MODEL.with_part(curve).with_part(other))
    state: Any = SimpleNamespace(chosen=chosen, fit=about, thresholds=STANDARD, banned=("z",), likelihood=lambda: None)
    lawful: Any = SimpleNamespace(model=MODEL)
    asked: list[Any] = []
    bound = STANDARD.departure**2
    for missed, banned in ((0.999 * bound, _blocks_banned_for(curve)), (bound, ())):
        asked.clear()

        def law_of(block: Any, one: Any, at: Any, plain: Any, likelihood: Any, missed: float = missed) -> Any:
            asked.append(block.effect)
            assert plain is MODEL
            assert at is (about.model if block.effect is curve else lawful.model)
            return (missed, lawful) if block.effect is curve else None

        monkeypatch.setattr(_laws, "_law_of", law_of)
        monkeypatch.setattr(
            _laws, "state_at",
            lambda law, without: SimpleNamespace(
                law=law, banned=without, thresholds=STANDARD, likelihood=lambda: None
            ),
        )  # fmt: skip
        found: Any = with_laws(state, MODEL)
        assert (found.law, found.banned) == (lawful, ("z", *banned))
        assert asked == [curve, other]
    monkeypatch.setattr(_laws, "_law_of", lambda *given: None)
    assert with_laws(state, MODEL) is state


def _weighed(
    name: str,
    *laws: tuple[str, float],
    nothing: float = 50.0,
    departure_sds: float = 0.5,
    size: float = 0.01,
    is_at_end_of_kind: bool = False,
) -> Any:
    fits: dict[str, Any] = {law: SimpleNamespace(model=f"{law} for {name}") for law, _ in laws}
    made = tuple(Alternative(law, margin, fits[law]) for law, margin in laws)
    others = [Alternative(other, 1.0, shape={"at": 3.0}) for other in ("delay", "near", "dead_band", "gas_heat")]
    return SimpleNamespace(
        name=name, likelihood_ratio=100.0, departure_sds=departure_sds, laws=made,
        alternatives=(Alternative(None, nothing), *others),
        without=SimpleNamespace(model=f"without {name}"), size=size, is_at_end_of_kind=is_at_end_of_kind,
        effect=SimpleNamespace(why_unnamed="", is_memoryless=False),
    )  # fmt: skip


def test_a_unit_has_one_curve_of_each_branch() -> None:
    branches = {"wall_hardening": "static_curve", "contact_area": "static_curve", "saturation": "end of range"}
    candidates: Any = [SimpleNamespace(name=name, branch=branch) for name, branch in branches.items()]
    sets = [("wall_hardening", "saturation", "zero_offset"), ("wall_hardening", "contact_area"), ("contact_area",)]
    fits: Any = [SimpleNamespace(model=SimpleNamespace(names=names)) for names in sets]
    assert [one.model.names for one in _with_distinct_branches(fits, candidates)] == [sets[0], sets[2]]


@pytest.mark.parametrize(
    ("curve", "beside"),
    [
        ("wall_hardening", ["found", "first", "second"]),
        ("flexible_curve", ["first", "second"]),
        ("saturation", []),
    ],
)
@pytest.mark.parametrize(("share", "is_another"), [(0.9, False), (1.1, True)])
def test_a_curve_of_another_branch_is_tried_beside_a_law_and_beside_the_nearest_in_its_place(
    monkeypatch: pytest.MonkeyPatch, curve: str, beside: list[str], share: float, is_another: bool
) -> None:
    """It takes off more than what the first departs by from where evidence lets it depart.

    A free form of several pieces was told an end of the range, and its law was half sure for that; a stop of 4 % had no
    name beside a bow of 0.1 %.
    """
    stop, fall = effect("saturation"), 1000.0
    there = effect(curve) if curve in catalogue() else next(b for b in blocks()["static_curve"] if b.name == curve)
    given: Any = SimpleNamespace(candidates=[Candidate(there, {}, (1,)), Candidate(stop, {"level": 0.9}, (2, 3))])
    about: Any = SimpleNamespace(
        linearisation=given, thresholds=STANDARD, extensions=lambda members: [(5.0, 1, np.array([0.1, 0.1]))]
    )

    def fitted(is_of: str, *names: str, cost: float = 5000.0) -> Any:
        return SimpleNamespace(model=SimpleNamespace(names=names, is_of=is_of), likelihood=None, cost=cost)

    def with_law(law: Any, model: Any, likelihood: Any, shapes: Any) -> Any:
        assert shapes == [{"level": 0.9}]
        return fitted(model.is_of, law.name, cost=5000.0 - share * STANDARD.departure**4 * fall)

    monkeypatch.setattr(_laws, "fit_with", with_law)
    laws = [Alternative(name, 1.0, fitted(name)) for name in ("first", "second", "third")]
    member: Any = SimpleNamespace(effect=there, laws=laws, likelihood_ratio=fall)
    own: Any = SimpleNamespace(members=(0,), score=10.0)
    tried = _with_another_curve(fitted("found", curve), about, own, [member])
    assert [(one.model.is_of, one.model.names) for one in tried] == [  # type: ignore[attr-defined]
        (is_of, ("saturation",)) for is_of in beside if is_another
    ]
    if there.is_flexible:  # none beside itself
        member.laws = [Alternative("saturation", 1.0, fitted("an end", "saturation"))]
        assert _with_another_curve(fitted("found", curve), about, own, [member]) == []


def test_a_likelier_set_is_a_fit_without_a_member_or_with_another_in_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of those that are worth another fit the likeliest three, the best first."""
    scores = {"found": 100.0}
    asked: list[str] = []
    anew: list[str] = []

    def about(model: Any, evidence: Any, beside: Any = None) -> Any:
        name = model if isinstance(model, str) else "found"
        if beside is None and name != "found":  # linearised anew, and for all that it is
            anew.append(name)
        else:
            assert beside == (None if name == "found" else "given found")
            asked.append(name)
        return SimpleNamespace(linearisation=f"given {name}"), SimpleNamespace(score=scores.get(name, 100.0))

    def with_law(law: Any, model: Any, likelihood: Any, shapes: Any) -> Any:
        assert shapes == ({"at": 3.0},)
        return SimpleNamespace(model=f"{law.name} {model}")

    monkeypatch.setattr(_laws, "evidence_about", about)
    monkeypatch.setattr(_laws, "fit_with", with_law)
    found: Any = SimpleNamespace(model=SimpleNamespace(names=("delay", "leak")), likelihood=None)
    laws = [SimpleNamespace(name=name, effect=law) for name, law in catalogue().items()]
    evidence: Any = SimpleNamespace(thresholds=STANDARD, odds=10.0, linearisation=SimpleNamespace(candidates=laws))

    def told(*members: Any) -> list[str]:
        asked.clear()
        anew.clear()
        states = [*likelier_changes(found, evidence, members)]
        assert {state.linearisation for state in states} <= {f"given {name}" for name in anew}
        return [state.fit.model for state in states]  # type: ignore[misc]

    assert told() == told(_weighed("leak")) == []
    assert asked == []  # nothing to be weighed
    most = 100.0 * STANDARD.law_departure**2
    members = _weighed("leak", ("near", 0.99 * most), ("far", 1.01 * most)), _weighed("lag", nothing=-0.1)
    assert told(*members) == []
    assert asked == ["found", "near for leak", "without lag"]
    port = _weighed("port", ("near", 0.0))
    port.effect.why_unnamed = "the reading comes later one way than the other"
    assert told(port) == []
    assert asked == []  # no law does what it does
    assert anew == []
    scores |= {"near for leak": 90.0, "without lag": 90.1}
    assert told(*members) == ["near for leak"]
    assert anew == ["near for leak", "without lag"]  # what is roughly likelier at all is weighed by columns of its own
    scores["without lag"] = 80.0
    assert told(*members) == ["without lag", "near for leak"]
    # One whose equation is far from what it follows, or which lies where its kind ends, may be of another kind where it
    # is large: the nearest effect that is neither there nor tried.
    other = "dead_band without leak"
    for departure_sds, is_at_end_of_kind, size, is_tried in (
        (1.0, False, 0.01, False), (1.01, False, STANDARD.tolerable, False), (1.01, False, 0.01, True),
        (0.0, True, STANDARD.tolerable, False), (0.0, True, 0.01, True),
    ):  # fmt: skip
        assert (
            told(
                _weighed(
                    "leak", ("near", 99.0), departure_sds=departure_sds, size=size, is_at_end_of_kind=is_at_end_of_kind
                )
            )
            == []
        )
        assert (asked == ["found", other]) is is_tried
    # Or where that is likelier in its place, as what was taken out beside it may be.
    rival = _weighed("leak", ("near", 99.0), size=0.01)
    for margin, is_tried in ((0.0, False), (-0.1, True)):
        near = (replace(one, margin=margin) if one.effect == "dead_band" else one for one in rival.alternatives)
        rival.alternatives = tuple(near)
        assert told(rival) == []
        assert (asked == ["found", other]) is is_tried
    scores |= {other: 70.0, "near for lag": 60.0}
    more = _weighed("leak", ("near", 99.0), departure_sds=2.0), _weighed("lag", ("near", 1.0))
    assert told(*members, *more) == ["near for lag", other, "without lag"]


def test_only_a_shape_within_its_bounds_is_not_stretched() -> None:
    law = next(one for one in catalogue().values() if any(p.null is None for p in one.parameters))
    k, shape = next((k, p) for k, p in enumerate(law.parameters) if p.null is None)
    for value, stretched in ((shape.lower, True), (shape.upper, True), (0.5 * (shape.lower + shape.upper), False)):
        values = law.start()
        for j, parameter in enumerate(law.parameters):
            if parameter.null is None:
                values[j] = 0.5 * (parameter.lower + parameter.upper)
        values[k] = value
        assert _is_stretched(MODEL.with_part(law, values), law) is stretched


@pytest.mark.parametrize("tau_s", [0.3, 3.0, 30.0])
def test_of_one_usual_time_constant_every_arm_is_beyond(tau_s: float) -> None:
    one = replace(STANDARD, memory_s=(3.0,))
    assert has_arm_beyond_memory(replace(MODEL, relaxation_rate_per_s=1.0 / tau_s), one)
