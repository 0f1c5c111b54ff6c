"""The state of an inference: a fit, the linearisation about it and the best set of effects in that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from smartshoe.diagnosis._evidence import Evidence, Members, Posterior
from smartshoe.diagnosis._likelihood import MOST_STEPS, Fit, Likelihood, fit
from smartshoe.diagnosis._search import SCORE_TOLERANCE, best_step, search
from smartshoe.diagnosis._sensitivity import Candidate, Linearised, linearised
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

STEP_LENGTHS = (
    1.0,
    0.5,
    0.2,
    0.05,
)  # a resolution: halved or doubled, no name changed


@dataclass(frozen=True, eq=False)
class State:
    """A ``fit``, the ``evidence`` linearised about it, and the ``best`` set of candidates in that.

    ``banned`` are flexible blocks that a law has replaced. ``path`` are the models that led here, the latest last.
    """

    evidence: Evidence
    best: Posterior
    fit: Fit
    banned: tuple[str, ...] = ()
    path: tuple[ExtendedModel, ...] = ()

    @property
    def linearisation(self) -> Linearised:
        """The linearisation about the fit."""
        return self.evidence.linearisation

    @property
    def thresholds(self) -> Thresholds:
        """The numbers that decide."""
        return self.linearisation.thresholds

    @property
    def score_gain(self) -> float:
        """By how much the score of the best set is lower than that of the fitted set."""
        return self.evidence.posterior(self.fitted_members).score - self.best.score

    @property
    def is_worth_a_fit(self) -> bool:
        """Whether the best set gains more than the odds against one effect, so that it should be fitted.

        Equality does not count: that is the gain of removing an effect that does nothing, which needs no other fit.
        """
        return self.score_gain > self.evidence.odds + SCORE_TOLERANCE

    @property
    def fitted_members(self) -> Members:
        """The candidates that are in the fitted model."""
        return set_of(self.fit.model, self.linearisation)

    @property
    def exceeds_linear_range(self) -> bool:
        """Whether a new effect of the best set is too large for the linearisation."""
        return _exceeds_linear_range(self.best, self.fitted_members, self.thresholds)

    @property
    def chosen(self) -> tuple[Candidate, ...]:
        """The candidates of the best set."""
        return tuple(self.linearisation.candidates[m] for m in self.best.members)

    def likelihood(self) -> Likelihood:
        """The likelihood of models near the fit."""
        return Likelihood(self.linearisation.sessions, self.evidence.noise_sd, self.fit.model, self.thresholds)


def state_at(found: Fit, banned: tuple[str, ...] = (), linearisation: Linearised | None = None) -> State:
    """The state about a fit; ``linearisation`` where it is known already. ``banned`` effects are not searched."""
    of = found.likelihood
    return State(*linearised_search(found.model, of.sessions, of.thresholds, banned, linearisation), found, banned)


def linearised_search(
    model: ExtendedModel,
    sessions: Sequence[Session],
    thresholds: Thresholds,
    banned: Sequence[str] = (),
    linearisation: Linearised | None = None,
) -> tuple[Evidence, Posterior]:
    """The evidence about ``model`` and the best set in it.

    Only one step is made where the next effect is too large for the linearisation: then a fit must follow first.
    """
    linearisation = linearised(model, sessions, thresholds) if linearisation is None else linearisation
    evidence = Evidence(linearisation, linearisation.noise_sd())
    start = set_of(model, linearisation)
    first = best_step(evidence, start, banned)
    if _exceeds_linear_range(first, start, thresholds):
        return evidence, first
    return evidence, search(evidence, first.members, banned)


def evidence_about(
    model: ExtendedModel, other: Evidence, nearby: Linearised | None = None
) -> tuple[Evidence, Posterior]:
    """The evidence about ``model``, with the sessions and the noise of ``other``, and the set that is in the model.

    ``nearby``: the linearisation about a similar model. Its columns are reused for effects that are in neither model,
    which count only as small imperfections.
    """
    evidence = Evidence(linearised(model, other.linearisation.sessions, other.thresholds, nearby), other.noise_sd)
    return evidence, evidence.posterior(set_of(model, evidence.linearisation))


def set_of(model: ExtendedModel, linearisation: Linearised) -> Members:
    """The candidates that are in ``model``."""
    return tuple(k for k, one in enumerate(linearisation.candidates) if one.name in model.names)


def _exceeds_linear_range(found: Posterior, start: Members, thresholds: Thresholds) -> bool:
    """Whether an effect that is not in ``start`` is larger than the linear range (threshold ``linear``)."""
    new = [size for m, size in zip(found.members, found.sizes, strict=True) if m not in start]
    return max(new, default=0.0) > thresholds.linear


def fit_of_set(state: State, found: Posterior, likelihood: Likelihood, steps: int = MOST_STEPS) -> Fit:
    """The full model fitted with the effects of ``found``, starting from the model of ``state``."""
    return fit(likelihood, with_members(state.linearisation, found, state.fit.model, likelihood), steps)


def with_members(
    linearisation: Linearised, found: Posterior, model: ExtendedModel, likelihood: Likelihood
) -> ExtendedModel:
    """``model`` with exactly the effects of ``found``, the new ones at a fraction of their linear estimates.

    The fraction is the best of `STEP_LENGTHS`: for a strongly curved effect the linear estimate is far off.
    """
    model = model.without(*({*model.names} - {linearisation.candidates[m].name for m in found.members}))
    new = [
        (
            linearisation.candidates[member],
            strengths / linearisation.scales[list(linearisation.candidates[member].columns)],
        )
        for member, strengths in zip(found.members, found.strengths, strict=True)
        if linearisation.candidates[member].name not in model.names
    ]

    def initial(length: float) -> ExtendedModel:
        out = model
        for one, strengths in new:
            out = out.with_part(one.effect, one.start(length * strengths))
        return out

    return min((initial(length) for length in STEP_LENGTHS), key=likelihood.cost) if new else model
