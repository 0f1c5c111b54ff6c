"""Candidates, evidence and sessions as they are told, for tests of what is made of them."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._evidence import Evidence, Members, Posterior
from smartshoe.diagnosis._session import DenoisedLoad, Session
from smartshoe.models.effects import Conditions
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()


def candidate(name: str, slot: str = "", sign: float = 1.0, **of: Any) -> Any:
    """Of a strength that may be as large as it likes on one side of null only."""
    made = SimpleNamespace(name=name, is_flexible=False, is_memoryless=False, parameters=(), why_unnamed="")
    made.__dict__.update(of)
    return SimpleNamespace(
        name=name, slot=slot or name, effect=made, columns=(1,), shape={},
        allows_sign_of=lambda strengths: bool(sign * float(strengths[0]) >= 0.0),
    )  # fmt: skip


class ToldEvidence:
    """Scores of sets as they are told; a candidate's strength is 1."""

    def __init__(
        self, candidates: list[Any], score: Callable[[tuple[int, ...]], float], inside: tuple[str, ...] = ()
    ) -> None:
        self.linearisation: Any = SimpleNamespace(candidates=candidates, model=SimpleNamespace(names=inside))
        self.thresholds, self.odds, self._score = STANDARD, 10.0, score
        self.strengths: dict[int, Array] = {}
        self.of_any_law = score  # where equations may depart towards their families' others
        self.of_whole_effects = self  # where they may depart in all that their effects add

    def posterior(self, members: tuple[int, ...], *, of_any_law: bool = False) -> Posterior:
        members = tuple(sorted(members))
        count = len(members)
        strengths = tuple(self.strengths.get(m, np.ones(1)) for m in members)
        score = self.of_any_law if of_any_law else self._score
        return Posterior(members, score(members), strengths, (1.0,) * count, (0.5,) * count, float(count))

    def prepare_departures(self, members: set[int]) -> None:
        """Nothing is to be made before it is told."""

    def extensions(self, members: tuple[int, ...]) -> list[tuple[float, int, Array]]:
        return [
            (self._score(tuple(sorted((*members, k)))), k, self.strengths.get(k, np.ones(1)))
            for k in range(len(self.linearisation.candidates))
            if k not in members
        ]


def worth(*worths: float) -> Callable[[tuple[int, ...]], float]:
    """A set is worth the sum of its members'."""
    return lambda members: 100.0 - sum(worths[m] for m in members)


def session_of(load: Array, fitted: Any = None, cycle: Any = None, reading: Any = None) -> Any:
    kept = np.ones(load.size, dtype=bool) if fitted is None else fitted
    at = Conditions(0.1 * np.arange(load.size), load, 0.1)
    told: Any = SimpleNamespace(metadata={}, sensor=SimpleNamespace(unit=MILLIBAR))
    return Session(
        told, 0, at, load.copy() if reading is None else reading, np.ones(load.size, dtype=bool), ~kept,
        np.zeros(load.size, dtype=np.intp) if cycle is None else cycle, load < 0.02, 1,
        DenoisedLoad(load, 0.0, 0.0, np.ones(load.size)),
    )  # fmt: skip


WAVE = np.abs((np.arange(240) / 10.0) % 2.0 - 1.0)


def told_fit(cost: float, *names: str, share: float = 0.1) -> Any:
    """A fit of a model with these effects and this share of its arm, which costs what it is told."""
    parts = tuple(SimpleNamespace(name=name, effect=SimpleNamespace(parameters=())) for name in names)
    return SimpleNamespace(model=SimpleNamespace(parts=parts, names=names, relaxing_share=share, told=cost), cost=cost)


def taken_for_exact(evidence: Evidence, members: Members) -> Posterior:
    """The evidence of a set whose equations are taken for exact."""
    return evidence._posterior_of(members, *evidence._set_solution(members, None))
