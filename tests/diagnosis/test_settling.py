"""Fits and searches in turn end where nothing is worth another fit, or a state comes back."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from told_evidence import STANDARD

from smartshoe.diagnosis import _inference

ODDS = 10.0


@dataclass(frozen=True)
class _State:
    """A fit of some effects, one a letter, and the set that the search about it came to."""

    fitted: str
    found: str
    improved: float
    path: tuple[Any, ...] = ()
    best: str = ""

    thresholds = None
    banned = ()

    @property
    def given(self) -> str:
        return self.fitted

    @property
    def start(self) -> str:
        return self.fitted

    @property
    def evidence(self) -> Any:
        return SimpleNamespace(odds=ODDS, noise_sd=0.1, posterior=lambda members: f"posterior of {members}")

    @property
    def fit(self) -> Any:
        return SimpleNamespace(model=_model(self.fitted), cost=0.0)

    @property
    def chosen(self) -> tuple[Any, ...]:
        return tuple(SimpleNamespace(name=name) for name in self.found)

    def likelihood(self, sessions: Any) -> Any:
        return SimpleNamespace(sessions=sessions)

    @property
    def itself(self) -> tuple[str, str, float]:
        """What it is, however it was come to."""
        return self.fitted, self.found, self.improved


def _model(names: str) -> Any:
    return SimpleNamespace(names=tuple(names), parts=())


class _Scored:
    """The shorter the set that is fitted, the likelier; by how much goes with the noise, which is that of the last."""

    def __init__(self, given: str, noise_sd: float) -> None:
        assert noise_sd == 0.1
        self.given = given

    def posterior(self, members: str) -> Any:
        assert members == self.given
        return SimpleNamespace(score=float(len(members)))


def _ends(
    monkeypatch: pytest.MonkeyPatch, first: _State, then: list[_State], known: _State | None = None, apart: float = 0.0
) -> tuple[Any, int]:
    """The state that it ends in, and how many fits that took; all models of the same effects are ``apart``."""
    coming = iter(then)
    fits: list[Any] = []

    def fitted(*given: Any) -> Any:
        fits.append(then[len(fits)].fit)
        return fits[-1]

    monkeypatch.setattr(_inference, "_promising", lambda state: [None])
    monkeypatch.setattr(_inference, "with_members", lambda *given: None)
    monkeypatch.setattr(_inference, "fit", fitted)
    monkeypatch.setattr(_inference, "apart", lambda *given: apart)
    monkeypatch.setattr(_inference, "Evidence", _Scored)
    monkeypatch.setattr(_inference, "state_at", lambda *given: next(coming))
    return _inference._settled(first, [], lambda said: None, known), len(fits)  # type: ignore[arg-type]


def test_a_set_that_is_found_again_about_another_fit_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a large effect a rival was fitted in its place; about that fit the search finds it again."""
    last = _State("m", "m", 0.0)
    end, fits = _ends(monkeypatch, _State("", "m", 500.0), [_State("c", "m", 300.0), last])
    assert (end.itself, fits) == (last.itself, 2)
    assert [one.names for one in end.path] == [(), ("c",), ("m",)]


def test_of_states_that_lead_to_one_another_the_likeliest_is_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """And its own set is the answer: what it leads to has been fitted."""
    circle = [_State("bb", "c", 30.0), _State("c", "aaa", 31.0), _State("aaa", "bb", 32.0), _State("bb", "c", 33.0)]
    end, fits = _ends(monkeypatch, _State("aaa", "bb", 30.0), circle)
    assert (end.itself, end.best, fits) == (("c", "aaa", 31.0), "posterior of c", 3)


@pytest.mark.parametrize(("improved", "fits"), [(ODDS - 0.1, 0), (ODDS + 0.1, 1)])
def test_nothing_is_fitted_for_less_than_the_odds_against_a_name(
    monkeypatch: pytest.MonkeyPatch, improved: float, fits: int
) -> None:
    end, taken = _ends(monkeypatch, _State("", "a", improved), [_State("a", "a", ODDS - 0.1)])
    assert (taken, end.best) == (fits, "")  # what is worth less than another fit is still part of the answer


def test_it_ends_in_any_case(monkeypatch: pytest.MonkeyPatch) -> None:
    ever = [_State("ab"[k % 2] * (k + 1), "c", 500.0) for k in range(20)]
    end, fits = _ends(monkeypatch, _State("abc", "c", 500.0), ever)
    assert (end.fitted, fits) == ("a", _inference.ROUNDS)
    last = [*ever[: _inference.ROUNDS - 1], _State("c" * 9, "c", 0.0)]
    assert _ends(monkeypatch, _State("abc", "c", 500.0), last)[0].fitted == "c" * 9


@pytest.mark.parametrize(("names", "apart", "joins"), [("ba", 0.9, True), ("ba", 1.1, False), ("ac", 0.0, False)])
def test_a_fit_that_comes_upon_a_known_way_ends_where_that_did(
    monkeypatch: pytest.MonkeyPatch, names: str, apart: float, joins: bool
) -> None:
    """The same effects that read alike: what follows of one follows of the other."""
    alike = STANDARD.alike * STANDARD.material
    monkeypatch.setattr(_State, "thresholds", STANDARD)
    known = _State("abc", "abc", 0.0, (_model("x"), _model(names)))
    end, fits = _ends(monkeypatch, _State("", "ab", 500.0), [_State("ab", "ab", 0.0)], known, apart * alike)
    assert (end is known, fits) == (joins, 1)


def test_what_began_anew_is_weighed_once_and_its_way_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    state, begun = _State("a", "a", 0.0, (_model("a"),)), _State("", "b", 1.0)
    other = _State("b", "b", 0.0, (_model(""), _model("b")))
    for taken in (state, other):
        monkeypatch.setattr(_inference, "_settled", lambda *given: other)
        monkeypatch.setattr(_inference, "_simpler", lambda one, than, sessions, taken=taken: taken)
        found: Any = _inference._better_from(begun, state, [], lambda said: None)  # type: ignore[arg-type]
        assert (found.fitted, [one.names for one in found.path]) == (taken.fitted, [("a",), (), ("b",)])
    monkeypatch.setattr(_inference, "_settled", lambda *given: state)
    monkeypatch.setattr(_inference, "_simpler", lambda *given: pytest.fail("there is nothing to weigh"))
    assert _inference._better_from(begun, state, [], lambda said: None) is state  # type: ignore[arg-type, comparison-overlap]
