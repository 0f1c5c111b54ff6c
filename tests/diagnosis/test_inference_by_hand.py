"""What an inference makes of fits and evidence that are told beforehand: what is simpler, tried, kept or refused."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD, WAVE, ToldEvidence, candidate, session_of, worth

from smartshoe.diagnosis import _inference
from smartshoe.diagnosis._inference import _is_simpler, _judged, _promising, _screening, _strengths, independent, infer
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


# -- inference --------------------------------------------------------------------------------------------------------
def _fit(cost: float, *names: str, share: float = 0.1) -> Any:
    parts = tuple(SimpleNamespace(name=name, effect=SimpleNamespace(parameters=())) for name in names)
    return SimpleNamespace(model=SimpleNamespace(parts=parts, names=names, relaxing_share=share, told=cost), cost=cost)


@pytest.mark.parametrize(
    ("new", "old", "near", "far"),
    [
        (_fit(100.0, "a"), _fit(90.0, "a", "b"), True, False),  # 110 and 110: no likelier, but fewer
        (_fit(99.9, "a"), _fit(90.0, "a", "b"), True, True),
        (_fit(80.0, "a", "b"), _fit(100.0, "a"), False, True),
        (_fit(95.0, "a"), _fit(96.0, "a"), True, True),
        (_fit(96.0, "a"), _fit(96.0, "a"), False, False),
        (_fit(100.0, "a", share=-0.1), _fit(105.0, "a"), False, False),  # an arm that falls is an effect
    ],
)
def test_the_simpler_is_taken_where_two_hardly_read_differently(
    monkeypatch: pytest.MonkeyPatch, new: Any, old: Any, near: bool, far: bool
) -> None:
    """Odds of ten against an effect; three times what is material apart."""
    likelihood = SimpleNamespace(cost=lambda model: model.told, sessions=())
    state: Any = SimpleNamespace(
        thresholds=STANDARD, likelihood=lambda sessions: likelihood, evidence=SimpleNamespace(odds=10.0), fit=old
    )
    bound = STANDARD.alike * STANDARD.material
    for by, told in ((0.999, near), (1.0, far), (1.001, far)):
        monkeypatch.setattr(_inference, "apart", lambda *given, by=by: by * bound)
        assert _is_simpler(new, state, []) is told


def test_rivals_are_fitted_beside_a_set_that_bends() -> None:
    candidates = [
        candidate("a", "x"), candidate("b"), candidate("c"), candidate("d"),
        candidate("curve", is_flexible=True, is_memoryless=True), candidate("lag", is_flexible=True),
        candidate("other", "x", is_flexible=True, is_memoryless=True),
        candidate("gone", is_flexible=True, is_memoryless=True), candidate("plain", is_memoryless=True),
    ]  # fmt: skip
    evidence: Any = ToldEvidence(candidates, worth(1.0, 6.0, 5.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    state: Any = SimpleNamespace(
        start=(0,), bends=True, best="best", given=evidence.given, evidence=evidence, banned=("gone",)
    )
    assert [found if found == "best" else found.members for found in _promising(state)] == [
        "best", (0, 1), (0, 2), (0, 4),
    ]  # fmt: skip
    state.bends = False
    assert _promising(state) == ["best"]
    state.bends, state.start = True, tuple(range(7))
    assert _promising(state) == ["best"]
    state.start = (0, 1, 2, 3, 5, 8)
    assert len(_promising(state)) > 1


def test_strengths_are_parameters_that_are_null_where_the_effect_is_not_there() -> None:
    model = MODEL.with_part("dead_band").with_part("sensor_nonlinearity")
    expected = sum(p.null is not None for name in model.names for p in effect(name).parameters)
    assert _strengths(model) == expected
    assert _strengths(MODEL) == 0


def test_what_can_be_left_out_is_a_recording_or_a_rise_of_a_single_one() -> None:
    rises = session_of(np.interp(np.arange(200), [0, 20, 40, 60, 80, 199], [0.0, 1.0, 0.2, 0.7, 0.1, 0.15]))
    none = session_of(WAVE, np.zeros(240, dtype=bool))
    assert independent([rises, none], STANDARD) == 2
    assert independent([rises, none, rises], STANDARD) == 2
    assert independent([session_of(np.full(50, 0.3))], STANDARD) == 0
    # A rise is more than 0.08 of the span.
    for high, count in ((0.179, 1), (0.181, 2)):
        twice = np.interp(np.arange(200), [0, 50, 100, 150, 199], [0.0, 1.0, 0.1, high, 0.05])
        assert independent([session_of(twice)], STANDARD) == count


def test_screening_is_what_each_effect_alone_takes_off() -> None:
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(12)], worth(*(float(k) for k in range(12))))
    found = _screening(evidence)
    assert found == tuple((f"n{k}", float(k)) for k in range(11, 1, -1))


@pytest.mark.parametrize(("odds", "chosen"), [(10.0, "plain"), (1.0, "curved")])
def test_of_what_promises_that_is_taken_which_is_likeliest_by_the_odds_against_its_strengths(
    monkeypatch: pytest.MonkeyPatch, odds: float, chosen: str
) -> None:
    """Of fits of six steps: each strength of an effect must be worth the odds."""
    counts = {"plain": 1, "curved": 3}
    costs = {"plain": 100.0, "curved": 95.0}

    def state(name: str, improved: float) -> Any:
        return SimpleNamespace(
            name=name, fit=SimpleNamespace(model=SimpleNamespace(names=(name,), parts=())), given="given",
            chosen=(SimpleNamespace(name="b_c"), SimpleNamespace(name="a")), improved=improved,
            evidence=SimpleNamespace(odds=odds), thresholds=STANDARD, banned=("z",), likelihood=lambda _: "likelihood",
        )  # fmt: skip

    monkeypatch.setattr(_inference, "_promising", lambda state: ["curved", "plain"])
    monkeypatch.setattr(_inference, "with_members", lambda given, one, model, likelihood: one)
    monkeypatch.setattr(_inference, "_strengths", lambda model: counts[model])
    monkeypatch.setattr(
        _inference, "fit", lambda _, model, steps: SimpleNamespace(model=model, cost=costs[model], steps=steps)
    )
    taken: list[Any] = []

    def stated(found: Any, sessions: Any, thresholds: Any, banned: Any) -> Any:
        taken.append((found.model, found.steps, banned))
        return state("next", 0.0)

    monkeypatch.setattr(_inference, "state_at", stated)
    monkeypatch.setattr(_inference, "replace", lambda one, **given: one)
    said: list[str] = []
    assert _inference._settled(state("first", 50.0), [], said.append).name == "next"  # type: ignore[attr-defined]
    assert (taken, said) == ([(chosen, 6, ("z",))], ["fitting a, b c"])


# -- the whole inference, by what each part answers -------------------------------------------------------------------
@pytest.fixture
def flow(monkeypatch: pytest.MonkeyPatch) -> Any:
    told = SimpleNamespace(
        independent=2, stretched=False, beyond=False, share=0.1, chosen=[], laws=[], lawful=None, said=[], scores={}
    )
    plain = _fit(100.0)

    def state(name: str) -> Any:
        fit = SimpleNamespace(model=SimpleNamespace(relaxing_share=told.share, name=name))
        return SimpleNamespace(
            name=name, chosen=told.chosen, fit=fit, banned=(), evidence=SimpleNamespace(odds=1.0), path=(),
            likelihood=lambda sessions: "likelihood",
        )  # fmt: skip

    def settled(one: Any, sessions: Any, progress: Any, known: Any = None) -> Any:
        return state(f"settled {one.name}")

    def named(name: str) -> Callable[..., Any]:
        return lambda one, *rest: state(f"{name} {one.name}")

    def judged(one: Any, plain: Any, sessions: Any) -> Any:
        return SimpleNamespace(
            members=lambda: (),
            fit=SimpleNamespace(model=one.name),
            likelihood="likelihood",
            refused=(),
            undone=(),
            is_stepped_down=False,
        )  # fmt: skip

    monkeypatch.setattr(_inference, "least_squares", lambda *given: plain)
    monkeypatch.setattr(
        _inference, "searched", lambda *given: ("given", SimpleNamespace(noise_sd=0.1), SimpleNamespace())
    )
    monkeypatch.setattr(_inference, "_screening", lambda evidence: "screening")
    monkeypatch.setattr(_inference, "independent", lambda *given: told.independent)
    monkeypatch.setattr(_inference, "Likelihood", lambda *given: "likelihood")
    monkeypatch.setattr(_inference, "is_stretched", lambda model: told.stretched)
    monkeypatch.setattr(_inference, "is_beyond_memory", lambda model, thresholds: told.beyond)
    monkeypatch.setattr(_inference, "State", lambda *given: state("first"))
    monkeypatch.setattr(_inference, "_settled", settled)
    monkeypatch.setattr(_inference, "replace", lambda one, **given: one)
    monkeypatch.setattr(_inference, "_simpler", lambda other, one, sessions: state(f"({other.name} or {one.name})"))
    monkeypatch.setattr(_inference, "with_a_latency", named("late"))
    monkeypatch.setattr(_inference, "with_a_usual_arm", named("usual"))
    monkeypatch.setattr(_inference, "with_another_pole", named("pole"))
    monkeypatch.setattr(_inference, "with_an_arm_that_creeps", named("creeping"))
    monkeypatch.setattr(_inference, "with_laws", lambda one, model, sessions: told.lawful or one)
    monkeypatch.setattr(_inference, "_judged", judged)
    monkeypatch.setattr(_inference, "likelier_laws", lambda members, banned: told.laws.pop() if told.laws else {})
    monkeypatch.setattr(_inference, "with_likelier_laws", lambda one, model, laws, sessions: state(f"law {one.name}"))
    monkeypatch.setattr(_inference, "_score", lambda model, likelihood, odds: told.scores.get(model, -len(model)))
    told.infer = lambda is_unit=True: infer(MODEL, [], STANDARD, told.said.append, is_unit)
    return told


def test_of_one_cycle_or_no_unit_nothing_is_inferred(flow: Any) -> None:
    assert flow.infer().fit.model == "settled first"
    for flow.independent, is_unit, can_validate in ((1, True, False), (2, False, True), (1, False, False)):
        found = flow.infer(is_unit)
        assert (found.members, found.refused, found.can_validate) == ((), (), can_validate)
        assert (found.screening, found.likelihood) == ("screening", "likelihood")
        assert found.baseline is found.fit


def test_what_the_first_fits_look_like_decides_what_else_is_tried(flow: Any) -> None:
    flow.stretched = True
    assert flow.infer().fit.model == "settled (late first or first)"
    flow.beyond = True  # from what the search began with
    assert flow.infer().fit.model == "(settled usual (late first or first) or settled (late first or first))"
    assert "beginning anew from arms as units have" in flow.said
    flow.stretched = False
    assert flow.infer().fit.model == "(settled usual first or settled first)"
    flow.beyond = False
    flow.chosen = [SimpleNamespace(effect=effect("dead_band"))]
    assert flow.infer().fit.model == "settled first"
    flow.chosen.append(SimpleNamespace(effect=effect("linear_leak")))
    assert flow.infer().fit.model == "(settled pole settled first or settled first)"
    flow.chosen, flow.share = [], -0.01
    assert flow.infer().fit.model == "(settled creeping settled first or settled first)"
    flow.share = 0.0
    assert flow.infer().fit.model == "settled first"
    flow.lawful = SimpleNamespace(name="lawful", banned=())
    assert flow.infer().fit.model == "settled lawful"
    flow.lawful, flow.laws = None, [{"a": "b"}, {"c": "d"}]
    assert flow.infer().fit.model == "law law settled first"


def test_a_likelier_law_that_leads_to_a_worse_set_leaves_the_one_that_is_better(flow: Any) -> None:
    laws = [{"a": "b"}, {"c": "d"}, {"e": "f"}]
    for last, kept, left in ((-19.001, "law law settled first", 0), (-18.0, "law settled first", 1)):
        flow.laws, flow.scores = list(laws), {"law settled first": -18.0, "law law settled first": last}
        flow.scores["law law law settled first"] = 0.0
        assert flow.infer().fit.model == kept
        assert len(flow.laws) == left  # nothing is tried beyond it


class _Judge:
    """Fits and errors as they are told, for `_judged`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.errors: dict[tuple[str, ...], float] = {(): 1.0}
        self.follows: tuple[str, ...] = ("a", "b")
        self.beyond: list[str] = []
        self.undone: list[list[str]] = []
        self.costs: dict[tuple[str, ...], float] = {}
        self.stands = True
        self.falls: list[tuple[str, ...]] = []
        self.left_out: dict[tuple[str, ...], float] = {}
        names = ("a", "b", "clock")
        self.candidates = [candidate(name) for name in names]
        self.evidence: Any = ToldEvidence(self.candidates, worth(1.0, 1.0, 1.0))
        self.evidence.noise_sd = 0.1
        self.plain: Any = SimpleNamespace(model=self.model())
        self.start = self.model("a", "b")
        judge = self

        class Left:
            def __init__(self, *given: Any) -> None: ...

            def following(self, found: Any) -> Any:
                return SimpleNamespace(model=judge.model(*judge.follows), how="followed")

            def stands(self, model: Any, plain: Any) -> bool:
                return judge.stands and model.names not in judge.falls

            def errors(self, model: Any) -> Any:
                return np.array([judge.left_out.get(model.names, 1.0)])

        monkeypatch.setattr(_inference, "error_of", lambda sessions, model: self.errors.get(model.names, 0.5))
        monkeypatch.setattr(_inference, "LeftOut", Left)
        monkeypatch.setattr(_inference, "with_members", lambda *given: self.model("a", "b"))
        monkeypatch.setattr(
            _inference,
            "fit",
            lambda likelihood, model, *steps: SimpleNamespace(
                model=model, how=steps, cost=self.costs.get(model.names, 0.0)
            ),
        )
        monkeypatch.setattr(_inference, "cancelling", lambda *given: self.undone.pop() if self.undone else [])
        monkeypatch.setattr(_inference, "begun_with", lambda one, model, likelihood: self.model(*model.names, one.name))
        monkeypatch.setattr(_inference, "extrapolating", lambda *given: self.beyond.pop() if self.beyond else None)
        self.weighed_about: list[Any] = []
        monkeypatch.setattr(_inference, "evidence_about", self.about)
        monkeypatch.setattr(
            _inference, "members_of", lambda evidence, best, refused, *rest: (best.members, tuple(refused))
        )

    def about(self, model: Any, sessions: Any, other: Any) -> Any:
        self.weighed_about.append(model.names)
        return other, other.posterior(tuple(k for k, one in enumerate(self.candidates) if one.name in model.names))

    def model(self, *names: str) -> Any:
        made = SimpleNamespace(names=names, parts=names)
        made.without = lambda name: self.model(*(one for one in names if one != name))
        return made

    def inference(self) -> Any:
        best = self.evidence.posterior((0, 1))
        state: Any = SimpleNamespace(
            given=self.evidence.given, evidence=self.evidence, best=best, thresholds=STANDARD,
            fit=SimpleNamespace(model=self.start), likelihood=lambda sessions: "likelihood",
        )  # fmt: skip
        return _judged(state, self.plain, [])

    def judged(self) -> tuple[Any, Any, Any]:
        found = self.inference()
        return found.fit, found.members(), found.refused


def test_what_does_not_follow_what_is_left_out_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("a", "b"), ((0, 1), ()), ())
    judge.follows = ("b",)
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), ((1,), ("a",)), ("a",))
    judge.follows, judge.beyond = ("a", "b"), ["b"]
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("a",), ((0,), ("b",)), ("b",))


def test_effects_are_weighed_about_the_model_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Anew where some were taken out: those had bent what the others were weighed about."""
    judge = _Judge(monkeypatch)
    judge.judged()
    assert judge.weighed_about == []
    judge.follows = ("b",)
    judge.judged()
    assert judge.weighed_about == [("b",)]
    judge.stands = False
    judge.judged()
    assert judge.weighed_about == [("b",)]


def test_of_effects_that_undo_one_another_the_idle_one_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without which the fit is likeliest, unless the squared error is clear of what it was: then each is needed."""
    judge = _Judge(monkeypatch)
    judge.costs, judge.undone = {("a",): 3.0, ("b",): 2.0}, [["a", "b"]]
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), ((1,), ("a",)), ("a",))
    enough = 0.5 * np.sqrt(STANDARD.clear)
    for error, is_needed in ((0.999 * enough, False), (1.001 * enough, True)):
        judge.errors[("b",)], judge.undone = error, [["a", "b"]]
        fit, members, refused = judge.judged()
        assert (fit.model.names == ("a", "b"), refused == ()) == (is_needed, is_needed)


def test_effects_that_others_undo_without_the_idle_one_stay_and_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    judge.undone = [["b"], ["a", "b"]]  # without the idle one, at first
    found = judge.inference()
    assert (found.fit.model.names, found.refused, found.undone) == (("a", "b"), (), ("a", "b"))
    judge.undone, judge.follows = [["b"], ["a", "b"]], ("b",)  # what has gone for another reason is not told
    assert judge.inference().undone == ("b",)
    judge.undone, judge.follows, judge.errors[("b",)] = [["a", "b"]], ("a", "b"), 0.9  # each is needed
    found = judge.inference()
    assert (found.fit.model.names, found.refused, found.undone) == (("a", "b"), (), ())
    judge.undone = []
    assert judge.inference().undone == ()


@pytest.mark.parametrize("error", [1.0, 1.5])
def test_a_model_that_others_had_bent_is_begun_anew_from_the_plain_one(
    monkeypatch: pytest.MonkeyPatch, error: float
) -> None:
    """Where it leaves as much as the plain one does; and the plain one is taken where the new one does so too."""
    judge = _Judge(monkeypatch)
    judge.follows, judge.errors[("b",)] = ("b",), error
    fit, members, refused = judge.judged()
    assert (fit, members, refused) == (judge.plain, ((), ("a", "b")), ("a", "b"))
    judge.errors[("b",)] = 0.9999
    assert judge.judged()[0].how == "followed"
    judge.follows, judge.errors[("a", "b")] = ("a", "b"), error
    judge.evidence.given.candidates[1] = candidate("c")
    fit, members, refused = judge.judged()
    assert (fit.model.names, fit.how) == (("a", "c"), ())


def test_of_a_set_that_does_not_stand_as_much_is_kept_as_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """That goes first without which what is left out is foreseen best."""
    judge = _Judge(monkeypatch)
    judge.falls, judge.left_out = [("a", "b")], {("a",): 2.0, ("b",): 1.0}
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), ((1,), ("a",)), ("a",))
    assert judge.inference().is_stepped_down
    found = judge.inference().with_nothing_but(judge.plain)
    assert (found.fit, found.members(), found.refused) == (judge.plain, ((), ("a", "b")), ("a", "b"))
    judge.falls.append(("b",))
    fit, members, refused = judge.judged()
    assert (fit, members, refused) == (judge.plain, ((), ("a", "b")), ("a", "b"))
    judge.falls = []
    assert not judge.inference().is_stepped_down


def test_what_went_astray_leaves_the_plain_model_and_what_that_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    judge.stands = False
    assert judge.judged()[:2] == (judge.plain, ((), ("a", "b")))
    judge.plain.model = judge.model("b")
    assert judge.judged()[:2] == (judge.plain, ((1,), ("a",)))
    judge.stands, judge.follows = True, ("b",)
    fit, members, _ = judge.judged()
    assert (fit, members) == (judge.plain, ((1,), ("a",)))
