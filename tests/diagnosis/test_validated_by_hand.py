"""Which effects survive validation, by fits and errors that are told beforehand: refused, idle, kept or reduced."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD, ToldEvidence, candidate, worth

from smartshoe.diagnosis import _inference
from smartshoe.diagnosis._inference import _validated


class _Judge:
    """Fits and errors as they are told, for `_validated`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.errors: dict[tuple[str, ...], float] = {(): 1.0}
        self.follows: tuple[str, ...] = ("a", "b")
        self.beyond: list[str] = []
        self.undone: list[list[str]] = []
        self.costs: dict[tuple[str, ...], float] = {}
        self.is_validated = True
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

            def consistent(self, found: Any) -> Any:
                return SimpleNamespace(model=judge.model(*judge.follows), how="followed")

            def is_validated(self, model: Any, plain: Any) -> bool:
                return judge.is_validated and model.names not in judge.falls

            def errors(self, model: Any) -> Any:
                return np.array([judge.left_out.get(model.names, 1.0)])

        monkeypatch.setattr(_inference, "error_of", lambda sessions, model: self.errors.get(model.names, 0.5))
        monkeypatch.setattr(_inference, "LeftOut", Left)
        monkeypatch.setattr(_inference, "fit_of_set", lambda *given: SimpleNamespace(model=self.model("a", "b")))
        monkeypatch.setattr(
            _inference,
            "fit",
            lambda likelihood, model, *steps: SimpleNamespace(
                model=model, how=steps, cost=self.costs.get(model.names, 0.0), likelihood=likelihood
            ),
        )
        monkeypatch.setattr(_inference, "evaluated", lambda *given: self.plain)
        monkeypatch.setattr(_inference, "cancelling_effects", lambda *given: self.undone.pop() if self.undone else [])
        monkeypatch.setattr(
            _inference, "extrapolating_effect", lambda *given: self.beyond.pop() if self.beyond else None
        )
        self.weighed_about: list[Any] = []
        monkeypatch.setattr(_inference, "evidence_about", self.about)
        monkeypatch.setattr(_inference, "members_of", lambda evidence, best, fit: best.members)

    def about(self, model: Any, other: Any) -> Any:
        self.weighed_about.append(model.names)
        return other, other.posterior(tuple(k for k, one in enumerate(self.candidates) if one.name in model.names))

    def model(self, *names: str) -> Any:
        made = SimpleNamespace(names=names, parts=names)
        made.without = lambda name: self.model(*(one for one in names if one != name))
        return made

    def inference(self) -> Any:
        best = self.evidence.posterior((0, 1))
        state: Any = SimpleNamespace(
            linearisation=self.evidence.linearisation, evidence=self.evidence, best=best, thresholds=STANDARD,
            fit=SimpleNamespace(model=self.start), likelihood=lambda: "likelihood",
        )  # fmt: skip
        return _validated(state, self.plain, [])

    def judged(self) -> tuple[Any, Any, Any]:
        found = self.inference()
        return found.fit, found.members(), found.refused


def test_what_does_not_follow_what_is_left_out_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("a", "b"), (0, 1), ())
    judge.follows = ("b",)
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), (1,), ("a",))
    judge.follows, judge.beyond = ("a", "b"), ["b"]
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("a",), (0,), ("b",))


def test_effects_are_weighed_about_the_model_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Anew where some were taken out: those had bent what the others were weighed about."""
    judge = _Judge(monkeypatch)
    judge.judged()
    assert judge.weighed_about == []
    judge.follows = ("b",)
    judge.judged()
    assert judge.weighed_about == [("b",)]
    judge.is_validated = False
    judge.judged()
    assert judge.weighed_about == [("b",)]


def test_of_effects_that_undo_one_another_the_idle_one_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without which the fit is likeliest, unless the squared error is clear of what it was: then each is needed."""
    judge = _Judge(monkeypatch)
    judge.costs, judge.undone = {("a",): 3.0, ("b",): 2.0}, [["a", "b"]]
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), (1,), ("a",))
    enough = 0.5 * np.sqrt(STANDARD.clear)
    for error, is_needed in ((0.999 * enough, False), (1.001 * enough, True)):
        judge.errors[("b",)], judge.undone = error, [["a", "b"]]
        fit, members, refused = judge.judged()
        assert (fit.model.names == ("a", "b"), refused == ()) == (is_needed, is_needed)


def test_effects_that_others_undo_without_the_idle_one_stay_and_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    judge.undone = [["b"], ["a", "b"]]  # without the idle one, at first
    found = judge.inference()
    assert (found.fit.model.names, found.refused, found.cancelling_names) == (("a", "b"), (), ("a", "b"))
    judge.undone, judge.follows = [["b"], ["a", "b"]], ("b",)  # what has gone for another reason is not told
    assert judge.inference().cancelling_names == ("b",)
    judge.undone, judge.follows, judge.errors[("b",)] = [["a", "b"]], ("a", "b"), 0.9  # each is needed
    found = judge.inference()
    assert (found.fit.model.names, found.refused, found.cancelling_names) == (("a", "b"), (), ())
    judge.undone = []
    assert judge.inference().cancelling_names == ()


@pytest.mark.parametrize("error", [1.0, 1.5])
def test_a_model_that_leaves_as_much_as_the_plain_one_is_none(monkeypatch: pytest.MonkeyPatch, error: float) -> None:
    """Nor is one that others had bent: what of it is less wrong without them stays."""
    judge = _Judge(monkeypatch)
    judge.follows, judge.errors[("b",)] = ("b",), error
    fit, members, refused = judge.judged()
    assert (fit, members, refused) == (judge.plain, (), ("a", "b"))
    judge.errors[("b",)] = 0.9999
    assert judge.judged()[0].how == "followed"
    judge.follows, judge.errors[("a", "b")] = ("a", "b"), error
    judge.left_out = {("b",): 0.5}
    fit, members, refused = judge.judged()
    assert (fit.model.names, refused) == (("b",), ("a",))


def test_of_a_set_that_does_not_stand_as_much_is_kept_as_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """That goes first without which what is left out is foreseen best."""
    judge = _Judge(monkeypatch)
    judge.falls, judge.left_out = [("a", "b")], {("a",): 2.0, ("b",): 1.0}
    fit, members, refused = judge.judged()
    assert (fit.model.names, members, refused) == (("b",), (1,), ("a",))
    assert judge.inference().is_reduced
    found = judge.inference().reduced_to(judge.plain)
    assert (found.fit, found.members(), found.refused) == (judge.plain, (), ("a", "b"))
    judge.falls.append(("b",))
    fit, members, refused = judge.judged()
    assert (fit, members, refused) == (judge.plain, (), ("a", "b"))
    judge.falls = []
    assert not judge.inference().is_reduced


def test_what_went_astray_leaves_the_plain_model_and_what_that_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = _Judge(monkeypatch)
    judge.is_validated = False
    assert judge.judged()[:2] == (judge.plain, ())
    judge.plain.model = judge.model("b")
    assert judge.judged()[:2] == (judge.plain, (1,))
    judge.is_validated, judge.follows = True, ("b",)
    fit, members, _ = judge.judged()
    assert (fit, members) == (judge.plain, (1,))
