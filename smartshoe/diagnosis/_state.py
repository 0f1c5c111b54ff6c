"""Where an inference stands: a fit, the linearisation about it and the best set of effects in that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from smartshoe.diagnosis._evidence import Evidence, Members, Posterior
from smartshoe.diagnosis._likelihood import MOST_STEPS, Fit, Likelihood, fit
from smartshoe.diagnosis._search import DEAD_HEAT, search, step
from smartshoe.diagnosis._sensitivity import Candidate, Linearised, linearised
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

LENGTHS = (1.0, 0.5, 0.2, 0.05)  # of a first step, a resolution: halved or doubled, no name changed


@dataclass(frozen=True, eq=False)
class State:
    """A linearisation about ``fit``, and the best set in it; ``banned`` are blocks that a law has replaced.

    ``path``: models that it has been settled through.
    """

    evidence: Evidence
    best: Posterior
    fit: Fit
    banned: tuple[str, ...] = ()
    path: tuple[ExtendedModel, ...] = ()

    @property
    def given(self) -> Linearised:
        """The linearisation."""
        return self.evidence.given

    @property
    def thresholds(self) -> Thresholds:
        """What decides."""
        return self.given.thresholds

    @property
    def improved(self) -> float:
        """By how much the best set has more evidence than that of the fit."""
        return self.evidence.posterior(self.start).score - self.best.score

    @property
    def is_worth_a_fit(self) -> bool:
        """Whether the best set has more evidence than that of the fit by more than the odds against an effect.

        By just these, but for rounding, it gains where an effect that does nothing goes, which asks for no other fit.
        """
        return self.improved > self.evidence.odds + DEAD_HEAT

    @property
    def start(self) -> Members:
        """The set of the fit."""
        return _set_of(self.fit.model, self.given)

    @property
    def bends(self) -> bool:
        """Whether a new effect is so large that it bends the linearisation."""
        return _bends(self.best, self.start, self.thresholds)

    @property
    def chosen(self) -> tuple[Candidate, ...]:
        """The candidates of the best set."""
        return tuple(self.given.candidates[m] for m in self.best.members)

    def likelihood(self) -> Likelihood:
        """That of models near the fit."""
        return Likelihood(self.given.sessions, self.evidence.noise_sd, self.fit.model, self.thresholds)


def state_at(found: Fit, banned: tuple[str, ...] = (), given: Linearised | None = None) -> State:
    """The linearisation about a fit, ``given`` where it is known, and the best set in it without what is ``banned``."""
    of = found.likelihood
    return State(*searched(found.model, of.sessions, of.thresholds, banned, given), found, banned)


def searched(
    model: ExtendedModel,
    sessions: Sequence[Session],
    thresholds: Thresholds,
    banned: Sequence[str] = (),
    given: Linearised | None = None,
) -> tuple[Evidence, Posterior]:
    """A linearisation and the best set in it; one change only where the next effect is so large that it bends it."""
    given = linearised(model, sessions, thresholds) if given is None else given
    evidence = Evidence(given, given.noise_sd())
    start = _set_of(model, given)
    first = step(evidence, start, banned)
    if _bends(first, start, thresholds):
        return evidence, first
    return evidence, search(evidence, first.members, banned)


def evidence_about(
    model: ExtendedModel, other: Evidence, beside: Linearised | None = None
) -> tuple[Evidence, Posterior]:
    """The evidence about a model, of the sessions and under the noise of the ``other``, and the model's own set in it.

    ``beside``: the linearisation about a model nearby, whose columns serve for effects that are in neither model: these
    count as imperfections only.
    """
    evidence = Evidence(linearised(model, other.given.sessions, other.thresholds, beside), other.noise_sd)
    return evidence, evidence.posterior(_set_of(model, evidence.given))


def _set_of(model: ExtendedModel, given: Linearised) -> Members:
    """The candidates that stand in a model."""
    return tuple(k for k, one in enumerate(given.candidates) if one.name in model.names)


def _bends(found: Posterior, start: Members, thresholds: Thresholds) -> bool:
    """Whether an effect that is not in ``start`` is so large that it bends the linearisation."""
    new = [size for m, size in zip(found.members, found.sizes, strict=True) if m not in start]
    return max(new, default=0.0) > thresholds.linear


def fit_of(state: State, found: Posterior, likelihood: Likelihood, steps: int = MOST_STEPS) -> Fit:
    """A fit of the set ``found``, from the model of ``state``."""
    return fit(likelihood, with_members(state.given, found, state.fit.model, likelihood), steps)


def with_members(given: Linearised, found: Posterior, model: ExtendedModel, likelihood: Likelihood) -> ExtendedModel:
    """``model`` with exactly the effects that were found; new ones on the way to their linear estimates.

    As far as is best of several lengths: a curve that is far from straight is far from its linear estimate.
    """
    model = model.without(*({*model.names} - {given.candidates[m].name for m in found.members}))
    new = [
        (given.candidates[member], strengths / given.scales[list(given.candidates[member].columns)])
        for member, strengths in zip(found.members, found.strengths, strict=True)
        if given.candidates[member].name not in model.names
    ]

    def begun(length: float) -> ExtendedModel:
        out = model
        for one, strengths in new:
            out = out.with_part(one.effect, one.start(length * strengths))
        return out

    return min((begun(length) for length in LENGTHS), key=likelihood.cost) if new else model
