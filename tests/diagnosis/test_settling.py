"""Fits and searches in turn end where nothing is worth another fit, or a state comes back."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from smartshoe.diagnosis import _inference

ODDS = 10.0


def _state(fitted: str, chosen: str, improved: float) -> Any:
    """A fit of some effects, and the set that the search about it came to."""
    return SimpleNamespace(
        fit=SimpleNamespace(model=SimpleNamespace(names=tuple(fitted), parts=()), cost=0.0),
        chosen=tuple(SimpleNamespace(name=name) for name in chosen),
        improved=improved,
        evidence=SimpleNamespace(odds=ODDS),
        given=None,
        thresholds=None,
        banned=(),
        likelihood=lambda sessions: None,
    )


def _ends(monkeypatch: pytest.MonkeyPatch, first: Any, then: list[Any]) -> tuple[Any, int]:
    """The state that it ends in, and how many fits that took."""
    coming = iter(then)
    monkeypatch.setattr(_inference, "_promising", lambda state: [None])
    monkeypatch.setattr(_inference, "with_members", lambda *given: None)
    monkeypatch.setattr(_inference, "fit", lambda *given: SimpleNamespace(model=SimpleNamespace(parts=()), cost=0.0))
    monkeypatch.setattr(_inference, "state_at", lambda *given: next(coming))
    end = _inference._settled(first, [], lambda said: None)
    return end, len(then) - len(list(coming))


def test_a_set_that_is_found_again_about_another_fit_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a large effect a rival was fitted in its place; about that fit the search finds it again."""
    last = _state("m", "m", 0.0)
    assert _ends(monkeypatch, _state("", "m", 500.0), [_state("c", "m", 300.0), last]) == (last, 2)


def test_a_state_that_comes_back_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    first, again = _state("a", "b", 30.0), _state("a", "b", 30.0)
    assert _ends(monkeypatch, first, [_state("b", "a", 30.0), again, _state("b", "a", 30.0)]) == (again, 2)


@pytest.mark.parametrize(("improved", "fits"), [(ODDS - 0.1, 0), (ODDS + 0.1, 1)])
def test_nothing_is_fitted_for_less_than_the_odds_against_a_name(
    monkeypatch: pytest.MonkeyPatch, improved: float, fits: int
) -> None:
    assert _ends(monkeypatch, _state("", "a", improved), [_state("a", "a", 0.0)])[1] == fits


def test_it_ends_in_any_case(monkeypatch: pytest.MonkeyPatch) -> None:
    ever = [_state("ab"[k % 2] * (k + 1), "c", 500.0) for k in range(20)]
    assert _ends(monkeypatch, _state("", "c", 500.0), ever)[1] == _inference.ROUNDS
