"""What an inference makes of fits and evidence that are told beforehand: what is simpler, tried, kept or refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD, WAVE, ToldEvidence, candidate, session_of, told_fit, worth

from smartshoe.diagnosis import _inference
from smartshoe.diagnosis._inference import (
    _best_single,
    _is_likelier,
    _redundant,
    _screening,
    _Validated,
    _where_a_catch_all_leads,
    _without_redundant,
    independent_count,
    infer,
)
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


# -- inference --------------------------------------------------------------------------------------------------------
def test_what_can_be_left_out_is_a_recording_or_a_rise_of_a_single_one() -> None:
    rises = session_of(np.interp(np.arange(200), [0, 20, 40, 60, 80, 199], [0.0, 1.0, 0.2, 0.7, 0.1, 0.15]))
    none = session_of(WAVE, np.zeros(240, dtype=bool))
    assert independent_count([rises, none], STANDARD) == 2
    assert independent_count([rises, none, rises], STANDARD) == 2
    assert independent_count([session_of(np.full(50, 0.3))], STANDARD) == 0
    # A rise is more than 0.08 of the span.
    for high, count in ((0.179, 1), (0.181, 2)):
        twice = np.interp(np.arange(200), [0, 50, 100, 150, 199], [0.0, 1.0, 0.1, high, 0.05])
        assert independent_count([session_of(twice)], STANDARD) == count


def test_screening_is_what_each_effect_alone_takes_off() -> None:
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(12)], worth(*(float(k) for k in range(12))))
    evidence.likeness = lambda alone: list(alone)
    found, alike = _screening(evidence)
    assert found == tuple((f"n{k}", float(k)) for k in range(11, 1, -1))
    assert alike == list(range(11, 1, -1))  # in the same order


def test_what_catches_all_is_sought_only_where_it_does_more_than_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    block, law, delay = (
        SimpleNamespace(name=name, effect=effect(name)) for name in ("flexible_thixotropy", "rate_gain", "delay")
    )
    dropped: list[Any] = []

    def about(*candidates: Any) -> Any:
        def without(names: Any, sessions: Any) -> str:
            dropped.append(({*names}, [one.without_catch_alls for one in sessions]))
            return "without"

        return SimpleNamespace(candidates=candidates, noise_sd=lambda: 0.1, without=without)

    def asked(evidence: Any, members: Any, breadth: int) -> list[int]:
        assert (members, breadth) == ((0,), 1)  # beside the delay, which is in the plain model
        return leading

    monkeypatch.setattr(_inference, "Evidence", lambda given, noise_sd: "evidence")
    monkeypatch.setattr(_inference, "best_additions", asked)
    plain: Any = SimpleNamespace(model=MODEL.with_part("delay", np.array([0.01])))
    sessions = [session_of(WAVE)]
    leading: list[int] = []
    for candidates, best, is_sought in (
        ((delay, law, block), 2, True),
        ((delay, law, block), 1, False),
        ((delay, law), 1, True),
    ):
        leading[:] = [best]
        given = about(*candidates)
        monkeypatch.setattr(_inference, "linearised", lambda *of, given=given: given)
        found, linearisation = _where_a_catch_all_leads(plain, sessions, STANDARD)
        assert (found is sessions, linearisation is given) == (is_sought, is_sought)
        assert not any(one.without_catch_alls for one in sessions)
    assert dropped == [({"flexible_thixotropy"}, [True])]


# -- the whole inference, by what each part answers -------------------------------------------------------------------
class _Model(str):
    @property
    def name(self) -> str:
        return str(self)

    parts: tuple[Any, ...] = ()
    ended: tuple[str, ...] = ()


class _Sure(float):
    """A member, told as how sure it is."""

    name = "member"


@pytest.fixture
def flow(monkeypatch: pytest.MonkeyPatch) -> Any:
    told = SimpleNamespace(
        independent=2, folds=2, stretched=False, beyond=False, share=0.1, chosen=[], changes=[], lawful=None, said=[],
        unlikely=(), changeable=[], names={}, refused={}, errors={}, stepped=(), is_law=True, members=(), parts={},
        best_single=None, weighed=[], ended={}, counts={},
    )  # fmt: skip
    plain = told_fit(100.0)

    def state(name: str) -> Any:
        names = tuple(told.names.get(name, ()))
        fit = SimpleNamespace(model=SimpleNamespace(relaxing_share=told.share, name=name, names=names))
        return SimpleNamespace(
            name=name, chosen=told.chosen, fit=fit, banned=(), evidence=SimpleNamespace(odds=1.0), thresholds=STANDARD,
            likelihood=lambda: "likelihood",
        )  # fmt: skip

    def converged(one: Any, progress: Any) -> Any:
        return state(f"converged {one.name}")

    def simpler_from(begun: Any, one: Any, progress: Any) -> Any:
        return state(f"(converged {begun.name} or {one.name})")

    def named(name: str) -> Callable[..., Any]:
        return lambda one, *rest: state(f"{name} {one.name}")

    def is_stretched(model: Any) -> bool:
        return told.stretched is True or (bool(told.stretched) and getattr(model, "name", "") == told.stretched)

    def judged(one: Any, plain: Any, sessions: Any) -> Any:
        model = _Model(one.name)
        model.parts, model.ended = told.parts.get(one.name, ()), told.ended.get(one.name, ())
        return SimpleNamespace(
            members=lambda: told.members,
            together=lambda members: (tuple(members), "together"),
            fit=SimpleNamespace(model=model, likelihood="likelihood"),
            evidence="evidence",
            refused=told.refused.get(one.name, ()),
            cancelling_names=(),
            is_reduced=one.name in told.stepped,
            reduced_to=lambda plain: judged(one, plain, ()),
        )

    def likelier_changes(found: Any, evidence: Any, members: Any) -> Any:
        told.changeable.append([one.name for one in members])
        return iter([state(f"{change} {found.model}") for change in (told.changes.pop() if told.changes else ())])

    def without_redundant(found: Any, given: Any) -> Any:
        told.weighed.append((found.fit.model, given is plain))
        return found, found.members()

    monkeypatch.setattr(_inference, "error_of", lambda sessions, model: told.errors.get(model, 1.0))
    monkeypatch.setattr(_inference, "least_squares", lambda *given: plain)
    monkeypatch.setattr(_inference, "_where_a_catch_all_leads", lambda plain, sessions, thresholds: (sessions, "about"))
    evidence = SimpleNamespace(noise_sd=0.1)
    monkeypatch.setattr(_inference, "linearised_search", lambda *given, linearisation: (evidence, SimpleNamespace()))
    monkeypatch.setattr(_inference, "_screening", lambda evidence: ("screening", "likeness"))
    monkeypatch.setattr(_inference, "independent_count", lambda *given: told.independent)
    monkeypatch.setattr(_inference, "folds_of", lambda *given: ["fold"] * told.folds)
    monkeypatch.setattr(_inference, "Likelihood", lambda *given: "likelihood")
    monkeypatch.setattr(_inference, "evaluated", lambda *given: plain)
    monkeypatch.setattr(_inference, "has_extreme_arm", lambda model: is_stretched(model))
    monkeypatch.setattr(_inference, "has_arm_beyond_memory", lambda model, thresholds: told.beyond)
    monkeypatch.setattr(_inference, "State", lambda *given: state("first"))
    monkeypatch.setattr(_inference, "converged", converged)
    monkeypatch.setattr(_inference, "simpler_from", simpler_from)
    monkeypatch.setattr(_inference, "simpler", lambda other, one: state(f"({other.name} or {one.name})"))
    monkeypatch.setattr(_inference, "simpler_than", lambda late, one, progress: state(f"<{late.name} or {one.name}>"))
    monkeypatch.setattr(_inference, "effect_count", lambda model: told.counts.get(model.name, 0))
    monkeypatch.setattr(_inference, "latency_with_usual_arm", named("late"))
    monkeypatch.setattr(_inference, "latency_for_arm", named("lag for the arm of"))
    monkeypatch.setattr(_inference, "state_at", lambda late, banned=(): late)
    monkeypatch.setattr(_inference, "with_a_usual_arm", named("usual"))
    monkeypatch.setattr(_inference, "with_another_pole", named("pole"))
    monkeypatch.setattr(_inference, "with_creeping_arm", named("creeping"))
    monkeypatch.setattr(_inference, "with_laws", lambda one, model: told.lawful or one)
    monkeypatch.setattr(_inference, "law_or_block", lambda lawful, one: lawful if told.is_law else one)
    monkeypatch.setattr(_inference, "beyond_bounds", lambda one, progress: state(f"freed {one.model}"))
    monkeypatch.setattr(_inference, "with_own_terms", lambda state, sessions: None)
    monkeypatch.setattr(_inference, "_validated", judged)
    monkeypatch.setattr(_inference, "_without_redundant", without_redundant)
    monkeypatch.setattr(_inference, "_best_single", lambda *given: told.best_single)
    monkeypatch.setattr(_inference, "_nearest_single_law", lambda *given: "nearest")
    monkeypatch.setattr(_inference, "probability_of_kind", lambda one, left, thresholds: one if left == 0.0 else 0.0)
    monkeypatch.setattr(_inference, "likelier_changes", likelier_changes)
    monkeypatch.setattr(_inference, "_is_likelier", lambda other, found: other.fit.model not in told.unlikely)
    told.state, told.plain = state, plain
    told.infer = lambda is_unit=True: infer(MODEL, [], STANDARD, told.said.append, is_unit)
    return told


def test_of_one_cycle_or_no_unit_nothing_is_inferred(flow: Any) -> None:
    assert flow.infer().fit.model == "converged first"
    for flow.independent, is_unit, can_validate in ((1, True, False), (2, False, True), (1, False, False)):
        found = flow.infer(is_unit)
        assert (found.members, found.refused, found.can_validate) == ((), (), can_validate)
        assert (found.screening, found.likeness) == ("screening", "likeness")
        assert found.nearest_law is None  # nothing may be named, whatever fits
        assert found.baseline is found.fit


@pytest.mark.parametrize("folds", [0, 1])
def test_what_can_be_left_out_in_one_way_only_validates_nothing(flow: Any, folds: int) -> None:
    """As of a recording whose later load cycles all lie in a gap."""
    flow.folds = 2
    assert flow.infer().can_validate
    flow.folds = folds
    found = flow.infer()
    assert (found.can_validate, found.members, found.refused) == (False, (), ())
    assert found.baseline is found.fit


def test_what_is_told_is_without_what_another_effect_makes_immaterial(flow: Any) -> None:
    """The first set, and each that a likelier one leads to; from the plain fit on."""
    flow.infer()
    assert flow.weighed == [("converged first", True)]
    flow.weighed, flow.changes = [], [["law"], ["other"]]
    flow.infer()
    assert flow.weighed == [
        ("converged first", True),
        ("other converged first", True),
        ("law other converged first", True),
    ]


def test_changes_are_tried_until_one_leads_to_a_likelier_set(flow: Any) -> None:
    flow.members, flow.changes = (_Sure(0.9),), [["c", "d"], ["a", "b"]]
    flow.unlikely = ("a converged first", "c b converged first", "d b converged first")
    assert flow.infer().fit.model == "b converged first"
    assert flow.changeable == [["member"], ["member"]]
    flow.plain.model.names, flow.changeable = ("member",), []  # a clock, told before any model
    flow.infer()
    assert flow.changeable == [[]]


def _sized(name: str, size: float) -> Any:
    return SimpleNamespace(effect=effect(name), name=name, size=size, without=SimpleNamespace(model=f"without {name}"))


def test_of_two_of_a_family_the_smaller_is_redundant_where_it_is_immaterial() -> None:
    """A lag and a delay; of a drift of the zero and a warming up that shift alike."""
    small, most = 0.999 * STANDARD.imperfection, STANDARD.imperfection
    plain: Any = SimpleNamespace(model=SimpleNamespace(names=()))

    def redundant(*members: Any, known: tuple[str, ...] = ()) -> str | None:
        plain.model.names = known
        found = _redundant(members, plain, STANDARD)
        return None if found is None else str(found.name)

    lag, delay, leak = _sized("sensor_lag", small), _sized("delay", 0.5 * small), _sized("linear_leak", 1e-6)
    assert redundant(lag, delay) == redundant(delay, lag) == "delay"
    assert redundant(lag, leak) is None  # each alone of its family
    assert redundant(_sized("sensor_lag", 0.01), _sized("delay", most)) is None
    assert redundant(_sized("sensor_lag", 0.01), delay, leak) == "delay"
    assert redundant(_sized("sensor_lag", 0.01), delay, known=("delay",)) is None  # a clock, told before any model
    assert redundant(lag, delay, known=("delay",)) == "sensor_lag"
    assert redundant() is None
    plain.model.names = ()
    assert _redundant((lag, delay), plain, replace(STANDARD, imperfection=0.4 * small)) is None
    coarser = replace(STANDARD, material=0.5)  # what is asked for is no matter of what is there
    assert _redundant((_sized("sensor_lag", 0.01), _sized("delay", most)), plain, coarser) is None


def test_what_is_redundant_is_taken_out_one_by_one_and_the_rest_weighed_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    size = 0.5 * STANDARD.imperfection
    sets = {
        "whole": (_sized("delay", 0.01), _sized("sensor_lag", size), _sized("clock_drift", 0.5 * size)),
        "without clock_drift": (_sized("delay", 0.01), _sized("sensor_lag", 2.1 * size)),
    }
    asked: list[Any] = []

    def fit(likelihood: Any, model: Any) -> Any:
        asked.append((likelihood, model))
        return SimpleNamespace(model=model, likelihood=likelihood)

    def about(model: Any, evidence: Any) -> Any:
        return SimpleNamespace(thresholds=STANDARD, of=model, before=evidence.of), f"best of {model}"

    monkeypatch.setattr(_inference, "fit", fit)
    monkeypatch.setattr(_inference, "evidence_about", about)
    monkeypatch.setattr(_inference, "members_of", lambda evidence, best, fit: sets[fit.model])
    plain: Any = SimpleNamespace(model=SimpleNamespace(names=()))
    first: Any = SimpleNamespace(thresholds=STANDARD, of="whole")
    whole: Any = SimpleNamespace(model="whole", likelihood="likelihood")
    begun = _Validated(first, "best", whole, ("refused",), ("undone",), True)  # type: ignore[arg-type]

    def without() -> tuple[Any, Any]:
        return _without_redundant(begun, plain)  # type: ignore[arg-type]

    found, members = without()
    assert asked == [("likelihood", "without clock_drift")]  # of what is left the lag is not immaterial any more
    assert members == sets["without clock_drift"]
    assert (found.fit.model, found.best) == ("without clock_drift", "best of without clock_drift")
    assert (found.evidence.of, found.evidence.before) == ("without clock_drift", "whole")
    assert (found.refused, found.cancelling_names, found.is_reduced) == (("refused",), ("undone",), True)
    sets["without clock_drift"] = (_sized("delay", 0.01), _sized("sensor_lag", 0.9 * size))
    sets["without sensor_lag"] = (_sized("delay", 0.01),)
    found, members = without()
    assert (found.fit.model, members) == ("without sensor_lag", sets["without sensor_lag"])
    sets["whole"] = sets["without sensor_lag"]
    found, members = without()
    assert (found is begun, members) == (True, sets["whole"])


def test_recordings_that_are_told_gains_of_their_own_are_gone_through_with_them(
    flow: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    gains: Any = {"shared": "own", "own": "changing", "changing": None}

    def likelier_changes(state: Any, sessions: Any) -> Any:
        asked.append(sessions)
        return gains[sessions]

    monkeypatch.setattr(_inference, "with_own_terms", likelier_changes)
    monkeypatch.setattr(_inference, "gains_of", lambda sessions, model, thresholds: (sessions, model))
    monkeypatch.setattr(_inference, "zero_changes_of", lambda sessions, model: ())
    flow.members = (_Sure(0.9),)
    is_validated = [True, True, True]  # of each that is told, from the innermost on
    monkeypatch.setattr(_inference, "predicts_better", lambda *given: is_validated.pop())
    found = infer(MODEL, "shared", STANDARD, flow.said.append)  # type: ignore[arg-type]
    assert found.own_gains == ("changing", "converged first")  # those that were told at last
    assert asked == ["shared", "own", "changing"]
    assert "going through it again beside what recordings have of their own" in flow.said
    assert (found.fit.model, found.members) == ("converged first", (0.9,))
    is_validated = [False, True]
    other = infer(MODEL, "shared", STANDARD, flow.said.append)  # type: ignore[arg-type]
    assert (other.fit, other.members, other.own_gains) == (other.baseline, (), found.own_gains)
    gains["shared"] = None
    assert infer(MODEL, "shared", STANDARD, flow.said.append).own_gains == ()  # type: ignore[arg-type]


def test_what_the_first_fits_look_like_decides_what_else_is_tried(flow: Any) -> None:
    flow.stretched = True
    assert flow.infer().fit.model == "converged (late first or first)"
    flow.beyond = True  # from what the search began with
    assert flow.infer().fit.model == "(converged usual (late first or first) or converged (late first or first))"
    assert "beginning anew from arms as units have" in flow.said
    flow.stretched = False
    assert flow.infer().fit.model == "(converged usual first or converged first)"
    flow.beyond = False
    # An arm as no wall has beside effects is a lag in a free form, and one delay may do what several effects do.
    flow.stretched = "converged first"
    assert (
        flow.infer().fit.model
        == "(converged lag for the arm of converged first or converged lag for the arm of converged first)"
    )
    assert "trying a lag in the place of an arm that no wall has" in flow.said
    flow.is_law = False  # it has no more evidence, but may be simpler
    assert flow.infer().fit.model == "(converged lag for the arm of converged first or converged first)"
    flow.stretched, flow.is_law = False, True
    flow.counts = {"converged first": 1}
    assert flow.infer().fit.model == "<late first or converged first>"
    flow.counts = {"converged first": 1, "first": 1}
    assert flow.infer().fit.model == "converged first"
    flow.counts = {}
    flow.chosen = [SimpleNamespace(effect=effect("dead_band"))]
    assert flow.infer().fit.model == "converged first"
    flow.chosen.append(SimpleNamespace(effect=effect("linear_leak")))
    assert flow.infer().fit.model == "(converged pole converged first or converged first)"
    flow.chosen, flow.share = [], -0.01
    assert flow.infer().fit.model == "(converged creeping converged first or converged first)"
    flow.share = 0.0
    assert flow.infer().fit.model == "converged first"
    flow.lawful = flow.state("lawful")
    assert flow.infer().fit.model == "converged lawful"
    flow.is_law = False
    assert flow.infer().fit.model == "converged first"
    flow.lawful, flow.changes = None, [["law"], ["other"]]
    assert flow.infer().fit.model == "law other converged first"


def test_what_ended_at_a_bound_goes_on_beyond_it_where_that_is_validated_and_leaves_less(flow: Any) -> None:
    flow.ended, flow.errors = {"converged first": ("creep",)}, {"freed converged first": 0.9}
    assert flow.infer().fit.model == "freed converged first"
    flow.changes = [["law"], []]
    assert flow.infer().fit.model == "law freed converged first"
    flow.stepped = ("freed converged first",)
    assert flow.infer().fit.model == "converged first"
    flow.stepped, flow.errors = (), {"freed converged first": 1.0}
    assert flow.infer().fit.model == "converged first"
    # It may leave as much with fewer effects, or a little more.
    flow.counts = {"converged first": 2, "first": 2, "freed converged first": 1}
    assert flow.infer().fit.model == "freed converged first"
    flow.errors = {"freed converged first": math.sqrt(1.0 + 1.01 * STANDARD.tolerable**2)}
    assert flow.infer().fit.model == "converged first"
    flow.errors = {"freed converged first": math.sqrt(1.0 + 0.99 * STANDARD.tolerable**2)}
    assert flow.infer().fit.model == "freed converged first"
    flow.counts, flow.ended, flow.errors = {}, {}, {"freed converged first": 0.9}
    assert flow.infer().fit.model == "converged first"


def test_where_none_is_sure_that_is_told_which_does_most_alone(flow: Any) -> None:
    """And it is the answer where nothing else is left."""
    least = STANDARD.least_confidence
    flow.members, flow.refused = (_Sure(0.1), _Sure(0.99 * least)), {"converged first": ("b", "curve")}
    assert flow.infer().best_single is None
    part = SimpleNamespace(effect="a curve")
    judged = SimpleNamespace(
        fit=SimpleNamespace(model=SimpleNamespace(parts=(part,), names=("curve",))),
        cancelling_names=(), members=lambda: ("curve",), together=lambda members: "a curve alone",
    )  # fmt: skip
    flow.best_single = "a curve", judged
    found = flow.infer()
    assert (found.best_single, found.fit, found.members) == ("a curve", judged.fit, ("curve",))
    assert found.together == "a curve alone"
    assert found.refused == ("b",)
    flow.parts = {"converged first": (part, part)}
    found = flow.infer()
    assert (found.best_single, found.fit.model, found.members) == ("a curve", "converged first", flow.members)
    assert found.together == (flow.members, "together")
    flow.members = (_Sure(0.1), _Sure(least))
    assert flow.infer().best_single is None


def test_of_two_sets_that_is_likelier_which_has_more_evidence_about_its_own_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scores, stretched = {"a": 5.0, "b": 5.0, "c": 4.9, "d": 4.9}, {"d"}

    def about(model: Any, evidence: Any) -> Any:
        assert evidence == "of found"  # under one noise
        return None, SimpleNamespace(score=scores[model])

    monkeypatch.setattr(_inference, "evidence_about", about)
    monkeypatch.setattr(_inference, "has_extreme_arm", lambda model: model in stretched)

    def judged(name: str, evidence: str = "of other") -> Any:
        return SimpleNamespace(fit=SimpleNamespace(model=name), evidence=evidence)

    told = [_is_likelier(judged(other), judged("a", "of found")) for other in "abcd"]
    assert told == [False, False, True, False]  # the last needs an arm as no wall has
    stretched.add("a")
    assert _is_likelier(judged("d"), judged("a", "of found"))


def test_of_effects_alone_that_stand_the_one_is_taken_that_foresees_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the five likeliest for which there is evidence; what it does away with is more than is tolerable."""
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(7)], worth(9.0, 8.0, 7.0, 6.0, 5.0, 4.0, -1.0))
    evidence.noise_sd = 0.1
    stepped, left_out = set[str](), {"n0": 3.0, "n1": 1.0, "n2": 2.0, "n3": 0.5, "n4": 2.5, "n5": 0.1, "n6": 0.1}
    errors = {"plain": 0.01, **dict.fromkeys(left_out, 0.009)}
    monkeypatch.setattr(_inference, "error_of", lambda sessions, model: errors[model])
    monkeypatch.setattr(_inference, "fit_of_set", lambda state, best, _: SimpleNamespace(model=f"n{best.members[0]}"))
    monkeypatch.setattr(_inference, "State", lambda evidence, best, fit: fit)
    monkeypatch.setattr(
        _inference,
        "_validated",
        lambda one, plain, sessions: SimpleNamespace(fit=one, is_reduced=one.model in stepped),
    )

    class Left:
        def __init__(self, *given: Any) -> None: ...

        def errors(self, model: Any) -> Any:
            return np.array([left_out[model]])

    monkeypatch.setattr(_inference, "LeftOut", Left)
    begun: Any = SimpleNamespace(
        linearisation=evidence.linearisation, evidence=evidence, fitted_members=(),
        thresholds=STANDARD, likelihood=lambda: None,
        fit=SimpleNamespace(model="plain"),
    )  # fmt: skip
    plain: Any = SimpleNamespace(model="plain")

    def found() -> str | None:
        one = _best_single(begun, plain, [])
        assert one is None or one[0].name == one[1].fit.model  # the effect that was added, and what it was judged to be
        return None if one is None else str(one[1].fit.model)

    assert found() == "n3"
    stepped.add("n3")
    assert found() == "n1"
    errors["n1"] = float(np.sqrt(errors["plain"] ** 2 - 0.99 * STANDARD.tolerable**2))
    assert found() == "n2"
    errors["plain"] = STANDARD.tolerable
    assert found() is None


@pytest.mark.parametrize(
    ("refused", "stepped", "error", "kept"),
    [
        ("law", (), 0.9, "converged first"),
        ("law", (), 1.1, "converged lawful"),  # the block follows no better
        ("law", ("converged first",), 0.9, "converged lawful"),  # nor does it stand
        ("other", (), 0.9, "converged lawful"),
        ("other", ("converged lawful",), 0.9, "converged first"),  # what stands, for what does not
    ],
)
def test_where_a_law_is_not_the_same_in_each_recording_its_block_stays(
    flow: Any, refused: str, stepped: tuple[str, ...], error: float, kept: str
) -> None:
    flow.names = {"converged first": ("block", "other"), "lawful": ("law", "other")}
    flow.lawful, flow.refused, flow.stepped = flow.state("lawful"), {"converged lawful": (refused,)}, stepped
    flow.errors = {"converged first": error}
    assert flow.infer().fit.model == kept
