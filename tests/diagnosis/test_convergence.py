"""Fits and searches in turn end where nothing is worth another fit, or a state comes back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD, ToldEvidence, candidate, told_fit, worth

from smartshoe.diagnosis import _convergence
from smartshoe.diagnosis._state import State
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
ODDS = 10.0


@dataclass(frozen=True)
class _State:
    """A fit of some effects, one a letter, and the set that the search about it came to."""

    fitted: str
    found: str
    score_gain: float
    path: tuple[Any, ...] = ()
    score: float = 0.0
    noise_sd: float = 0.1
    best: Any = None

    thresholds = None
    banned = ()
    is_worth_a_fit = State.is_worth_a_fit

    @property
    def linearisation(self) -> _State:
        return self

    @property
    def fitted_members(self) -> str:
        return self.fitted

    @property
    def evidence(self) -> Any:
        about = {self.fitted: SimpleNamespace(score=self.score)}
        return SimpleNamespace(odds=ODDS, noise_sd=self.noise_sd, posterior=about.__getitem__)

    @property
    def fit(self) -> Any:
        return SimpleNamespace(model=_model(self.fitted), cost=0.0)

    @property
    def chosen(self) -> tuple[Any, ...]:
        return tuple(SimpleNamespace(name=name) for name in self.found)

    def likelihood(self) -> Any:
        return SimpleNamespace(sessions=(), thresholds=self.thresholds)

    @property
    def itself(self) -> tuple[str, str, float]:
        """What it is, however it was come to."""
        return self.fitted, self.found, self.score_gain


def _model(names: str) -> Any:
    return SimpleNamespace(names=tuple(names), parts=())


def _ends(
    monkeypatch: pytest.MonkeyPatch,
    first: _State,
    then: list[_State],
    known: _State | None = None,
    apart: float = 0.0,
    weighed: Callable[[_State, float], Any] = lambda given, noise_sd: given.evidence,
) -> tuple[Any, int]:
    """The state that it ends in, and how many fits that took; all models of the same effects are ``apart``."""
    coming = iter(then)
    fits: list[Any] = []

    def fitted(*given: Any) -> Any:
        fits.append(then[len(fits)].fit)
        return fits[-1]

    monkeypatch.setattr(_convergence, "_trial_sets", lambda state: [None])
    monkeypatch.setattr(_convergence, "fit_of_set", fitted)
    monkeypatch.setattr(_convergence, "rms_difference", lambda *given: apart)
    monkeypatch.setattr(_convergence, "state_at", lambda *given: next(coming))
    monkeypatch.setattr(_convergence, "Evidence", weighed)
    return _convergence.converged(first, lambda said: None, known), len(fits)  # type: ignore[arg-type]


def test_a_set_that_is_found_again_about_another_fit_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a large effect a rival was fitted in its place; about that fit the search finds it again."""
    last = _State("m", "m", 0.0)
    end, fits = _ends(monkeypatch, _State("", "m", 500.0), [_State("c", "m", 300.0), last])
    assert (end.itself, fits) == (last.itself, 2)
    assert [one.names for one in end.path] == [(), ("c",), ("m",)]


def test_a_state_that_comes_back_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    first, again = _State("a", "b", 30.0), _State("a", "b", 30.0)
    end, fits = _ends(monkeypatch, first, [_State("b", "a", 30.0), again, _State("b", "a", 30.0)])
    assert (end.itself, fits) == (again.itself, 2)


@pytest.mark.parametrize(("score_gain", "fits"), [(ODDS - 0.1, 0), (ODDS - 1e-9, 0), (ODDS + 1e-9, 0), (ODDS + 0.1, 1)])
def test_nothing_is_fitted_for_less_than_the_odds_against_a_name(
    monkeypatch: pytest.MonkeyPatch, score_gain: float, fits: int
) -> None:
    assert _ends(monkeypatch, _State("", "a", score_gain), [_State("a", "a", 0.0)])[1] == fits


def test_it_ends_in_any_case(monkeypatch: pytest.MonkeyPatch) -> None:
    ever = [_State("ab"[k % 2] * (k + 1), "c", 500.0) for k in range(20)]
    end, fits = _ends(monkeypatch, _State("", "c", 500.0), ever)
    assert (end.itself, fits) == (ever[_convergence.ROUNDS - 1].itself, _convergence.ROUNDS)


@pytest.mark.parametrize("settles", [False, True])
@pytest.mark.parametrize("most", ["a", "b", "c"])
def test_where_a_search_goes_round_the_fitted_set_with_most_evidence_is_taken(
    monkeypatch: pytest.MonkeyPatch, most: str, settles: bool
) -> None:
    """Linearisations promise more than fits keep; where nothing more is promised, that is the end."""
    noises: list[float] = []
    scores = {"a": 3.0, "b": 2.0, "c": 1.0} | {most: 0.0}
    noise_sd = {"a": 0.3, "b": 0.1, "c": 0.05}
    first, *then = (
        _State(one, "x", 0.0 if settles and one == "c" else 2.0 * ODDS, (), scores[one], noise_sd[one]) for one in "abc"
    )

    def weighed(given: _State, noise_sd: float) -> Any:
        noises.append(noise_sd)
        return given.evidence

    monkeypatch.setattr(_convergence, "ROUNDS", 2)
    end, fits = _ends(monkeypatch, first, then, weighed=weighed)
    assert (end.fitted, fits, len(end.path)) == ("c" if settles else most, 2, 3)
    assert noises == [0.1, 0.1, 0.05, 0.05]  # of two states the lower
    if most != "c" and not settles:  # what is asked for about it is what was fitted, not what the search tried next
        assert end.best.score == 0.0


@pytest.mark.parametrize(("names", "apart", "joins"), [("ba", 0.9, True), ("ba", 1.1, False), ("ac", 0.0, False)])
def test_a_fit_that_comes_upon_a_known_way_ends_where_that_did(
    monkeypatch: pytest.MonkeyPatch, names: str, apart: float, joins: bool
) -> None:
    """The same effects that read alike: what follows of one follows of the other."""
    alike = STANDARD.alike * STANDARD.imperfection
    monkeypatch.setattr(_State, "thresholds", STANDARD)
    known = _State("abc", "abc", 0.0, (_model("x"), _model(names)))
    end, fits = _ends(monkeypatch, _State("", "ab", 500.0), [_State("ab", "ab", 0.0)], known, apart * alike)
    assert (end is known, fits) == (joins, 1)


def test_what_began_anew_is_weighed_once_and_its_way_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    state, begun = _State("a", "a", 0.0, (_model("a"),)), _State("", "b", 1.0)
    other = _State("b", "b", 0.0, (_model(""), _model("b")))
    for taken in (state, other):
        monkeypatch.setattr(_convergence, "converged", lambda *given: other)
        monkeypatch.setattr(_convergence, "simpler", lambda one, than, taken=taken: taken)
        found: Any = _convergence.simpler_from(begun, state, lambda said: None)  # type: ignore[arg-type]
        assert (found.fitted, [one.names for one in found.path]) == (taken.fitted, [("a",), (), ("b",)])
    monkeypatch.setattr(_convergence, "converged", lambda *given: state)
    monkeypatch.setattr(_convergence, "simpler", lambda *given: pytest.fail("there is nothing to weigh"))
    assert _convergence.simpler_from(begun, state, lambda said: None) is state  # type: ignore[arg-type, comparison-overlap]


# -- of several which -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("new", "old", "near", "far"),
    [
        (told_fit(100.0, "a"), told_fit(90.0, "a", "b"), True, False),  # 110 and 110: no likelier, but fewer
        (told_fit(99.9, "a"), told_fit(90.0, "a", "b"), True, True),
        (told_fit(80.0, "a", "b"), told_fit(100.0, "a"), False, True),
        (told_fit(95.0, "a"), told_fit(96.0, "a"), True, True),
        (told_fit(96.0, "a"), told_fit(96.0, "a"), False, False),
        (told_fit(100.0, "a", share=-0.1), told_fit(105.0, "a"), False, False),  # an arm that falls is an effect
    ],
)
def test_the_simpler_is_taken_where_two_hardly_read_differently(
    monkeypatch: pytest.MonkeyPatch, new: Any, old: Any, near: bool, far: bool
) -> None:
    """Odds of ten against an effect; three times what is material apart."""
    likelihood = SimpleNamespace(cost=lambda model: model.told, sessions=(), thresholds=STANDARD)
    state: Any = SimpleNamespace(
        thresholds=STANDARD, likelihood=lambda: likelihood, evidence=SimpleNamespace(odds=10.0), fit=old
    )
    bound = STANDARD.alike * STANDARD.imperfection
    for by, told in ((0.999, near), (1.0, far), (1.001, far)):
        monkeypatch.setattr(_convergence, "rms_difference", lambda *given, by=by: by * bound)
        assert _convergence._is_simpler(new, state) is told


@pytest.mark.parametrize(
    ("law", "near", "far"),
    [
        (told_fit(99.0, "a"), (True, True), (True, False)),
        (told_fit(99.0, "a", "b"), (True, False), (True, False)),  # a law that needs company
    ],
)
def test_a_block_stays_where_there_is_more_evidence_for_it_than_for_a_law(
    monkeypatch: pytest.MonkeyPatch, law: Any, near: tuple[bool, ...], far: tuple[bool, ...]
) -> None:
    """Not where a law with no more effects leaves no more beside it than a good unit's imperfections do."""
    given = SimpleNamespace(sessions=())
    state: Any = SimpleNamespace(thresholds=STANDARD, fit=told_fit(1.0, "c"), linearisation=given)
    lawful: Any = SimpleNamespace(fit=law)
    for by, told in ((0.999, near), (1.001, far)):
        left = {law.model.names: np.hypot(0.01, by * STANDARD.tolerable), ("c",): 0.01}
        monkeypatch.setattr(_convergence, "error_of", lambda sessions, model, left=left: left[model.names])
        for has, is_law in zip((True, False), told, strict=True):
            monkeypatch.setattr(
                _convergence, "_has_as_much_evidence", lambda *of, has=has: has == (of == (lawful, state))
            )
            assert (_convergence.law_or_block(lawful, state) is lawful) is is_law


def test_evidence_is_weighed_under_the_lower_of_two_noises(monkeypatch: pytest.MonkeyPatch) -> None:
    scores = {("law", 2.0): 9.0, ("block", 2.0): 7.0, ("law", 3.0): 5.0, ("block", 3.0): 7.0}
    monkeypatch.setattr(
        _convergence,
        "Evidence",
        lambda given, sd: SimpleNamespace(
            posterior=lambda start: SimpleNamespace(score=scores[given, sd] + len(start))
        ),
    )

    def state(given: str, noise_sd: float, members: int = 1) -> Any:
        return SimpleNamespace(
            linearisation=given, evidence=SimpleNamespace(noise_sd=noise_sd), fitted_members=(0,) * members
        )

    for own, others, is_enough in ((2.0, 3.0, False), (3.0, 2.0, False), (3.0, 3.0, True)):
        assert _convergence._has_as_much_evidence(state("law", own), state("block", others)) is is_enough
    assert _convergence._has_as_much_evidence(state("law", 3.0, 3), state("block", 3.0))  # as much is enough
    assert not _convergence._has_as_much_evidence(state("law", 3.0, 4), state("block", 3.0))


def test_rivals_are_fitted_beside_a_set_that_bends() -> None:
    candidates = [
        candidate("a", "x"), candidate("b"), candidate("c"), candidate("d"),
        candidate("curve", is_flexible=True, is_memoryless=True), candidate("lag", is_flexible=True),
        candidate("other", "x", is_flexible=True, is_memoryless=True),
        candidate("gone", is_flexible=True, is_memoryless=True), candidate("plain", is_memoryless=True),
    ]  # fmt: skip
    evidence: Any = ToldEvidence(candidates, worth(1.0, 6.0, 5.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    state: Any = SimpleNamespace(
        fitted_members=(0,),
        exceeds_linear_range=True,
        best="best",
        linearisation=evidence.linearisation,
        evidence=evidence,
        banned=("gone",),
    )
    assert [found if found == "best" else found.members for found in _convergence._trial_sets(state)] == [
        "best", (0, 1), (0, 2), (0, 4),
    ]  # fmt: skip
    state.exceeds_linear_range = False
    assert _convergence._trial_sets(state) == ["best"]
    state.exceeds_linear_range, state.fitted_members = True, tuple(range(7))
    assert _convergence._trial_sets(state) == ["best"]
    state.fitted_members = (0, 1, 2, 3, 5, 8)
    assert len(_convergence._trial_sets(state)) > 1


def test_strengths_are_parameters_that_are_null_where_the_effect_is_not_there() -> None:
    model = MODEL.with_part("dead_band").with_part("sensor_nonlinearity")
    expected = sum(p.null is not None for name in model.names for p in effect(name).parameters)
    assert _convergence._strengths(model) == expected
    assert _convergence._strengths(MODEL) == 0


@pytest.mark.parametrize(
    ("evidence", "chosen"),
    [
        ({"plain": 50.0, "curved": 40.0}, "curved"),
        ({"plain": 40.0, "curved": 50.0}, "plain"),
        ({"plain": 50.0, "curved": 40.0, "bent": 0.0}, "curved"),  # of as many strengths fits alone decide
    ],
)
def test_of_as_many_strengths_the_likeliest_is_taken_and_more_of_them_where_the_evidence_is_for_it(
    monkeypatch: pytest.MonkeyPatch, evidence: dict[str, float], chosen: str
) -> None:
    """Of fits of six steps: one strength more always fits better."""
    counts = {"plain": 1, "curved": 3, "bent": 3}
    costs = {"plain": 100.0, "curved": 95.0, "bent": 96.0}

    def state(name: str, score_gain: float) -> Any:
        return SimpleNamespace(
            name=name, fit=SimpleNamespace(model=SimpleNamespace(names=(name,), parts=())), linearisation="given",
            chosen=(SimpleNamespace(name="b_c"), SimpleNamespace(name="a")), is_worth_a_fit=score_gain > 10.0,
            evidence=SimpleNamespace(odds=10.0), thresholds=STANDARD, banned=("z",), likelihood=lambda: "likelihood",
        )  # fmt: skip

    monkeypatch.setattr(_convergence, "_trial_sets", lambda state: sorted(evidence))
    monkeypatch.setattr(_convergence, "_strengths", lambda model: counts[model])
    monkeypatch.setattr(
        _convergence,
        "fit_of_set",
        lambda _, model, __, steps: SimpleNamespace(model=model, cost=costs[model], steps=steps),
    )
    monkeypatch.setattr(
        _convergence,
        "evidence_about",
        lambda model, *rest: (SimpleNamespace(linearisation=f"about {model}"), SimpleNamespace(score=evidence[model])),
    )
    taken: list[Any] = []

    def stated(found: Any, banned: Any, given: Any) -> Any:
        taken.append((found.model, found.steps, banned, given))
        return state("next", 0.0)

    monkeypatch.setattr(_convergence, "state_at", stated)
    monkeypatch.setattr(_convergence, "replace", lambda one, **given: one)
    monkeypatch.setattr(_convergence, "_has_as_much_evidence", lambda state, other: True)
    said: list[str] = []
    assert _convergence.converged(state("first", 50.0), said.append).name == "next"  # type: ignore[attr-defined]
    assert (taken, said) == ([(chosen, 6, ("z",), f"about {chosen}")], ["fitting a, b c"])
