"""Which law a kind has: equations compared by fits of the whole model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, weighed
from smartshoe.diagnosis._members import Alternative, Member, fit_with
from smartshoe.diagnosis._search import RIVALS, SWAPS, has_its_sign
from smartshoe.diagnosis._sensitivity import Candidate, available
from smartshoe.diagnosis._state import State, evidence_about, fit_of, state_at
from smartshoe.models.effects import Effect, blocks
from smartshoe.models.extended import ExtendedModel


def with_laws(given: State, plain: ExtendedModel) -> State:
    """``given`` with a law in the place of a flexible block, where one follows nearly as well.

    No law is exact: the nearest is taken that leaves less than ``law_departure``² of what the block explains, or less
    than ``departure``² where one of its shapes lies at a bound, beyond which the equation means something else. Below
    ``departure``² the block is banned from then on: what the law misses is no other curve. Both are fitted as whole
    models, since a linearisation bends a block earlier than a law. What the block explains is counted from no effect in
    its place, which leaves no more than the ``plain`` model does.
    """
    state, about = given, given.fit.model
    flexible = [one for one in given.chosen if one.effect.is_flexible]
    if not {one.name for one in flexible} <= {*about.names}:  # the last search asked for one that is not fitted yet
        about = fit_of(given, given.best, given.likelihood(), FEW_STEPS).model
    for block in flexible:
        found = _law_of(block, state, about, plain, state.likelihood())
        if found is not None:
            missed, law = found
            banned = _replaced_with(block.effect) if missed < state.thresholds.departure**2 else ()
            state, about = state_at(law, (*state.banned, *banned)), law.model
    return state


def _replaced_with(block: Effect) -> tuple[str, ...]:
    """A block, and for a curve all of them, which follow the same."""
    curves = [one.name for family in blocks().values() for one in family if one.is_memoryless]
    return tuple(curves) if block.is_memoryless else (block.name,)


def likelier(found: Fit, evidence: Evidence, members: Sequence[Member]) -> Iterator[State]:
    """What one change makes of a fit, the likeliest first: a member left out, another law or effect in its place.

    The linearised search weighs all changes about one fit; here each is fitted as a whole model and linearised anew.
    ``evidence`` gives the noise, which all of them share. None of what is not worth another fit.
    """
    tried: list[Fit] = []
    for one in members:
        if any(a.effect is None and a.margin < 0.0 for a in one.alternatives):
            tried.append(one.without)
        most = evidence.thresholds.law_departure**2 * max(one.fall, 0.0)
        if not one.effect.why_unnamed:  # what no law does has been weighed against those that come near
            tried += [a.fit for a in one.laws if a.fit is not None and a.margin < most]
        other = _nearest_of_another_kind(one, found.model)
        if other is None or one.size <= evidence.thresholds.tolerable:
            continue
        if one.departed > 1.0 or one.is_ended or other.margin < 0.0:
            # What departs by more than equations do, or lies where its kind ends, may be of another kind; or where that
            # is the likelier, and was taken out beside this one.
            law = next(c.effect for c in evidence.given.candidates if c.name == other.effect)
            tried.append(fit_with(law, one.without.model, found.likelihood, (other.shape or {},)))
    has_curve = any(one.effect.is_memoryless for one in members)
    if not (tried or has_curve):
        return
    about, own = evidence_about(found.model, evidence)
    if has_curve:
        tried += _with_another_curve(found, about, own, members)
        tried = [*_with_a_branch_each(tried, about.given.candidates)]
    changed = []
    for fitted in tried:
        if evidence_about(fitted.model, evidence, about.given)[1].score >= own.score:
            continue  # roughly, and most are far from it
        anew, best = evidence_about(fitted.model, evidence)
        if own.score - best.score >= evidence.odds:
            changed.append(State(anew, best, fitted))
    yield from sorted(changed, key=lambda state: state.best.score)[:SWAPS]


def _with_another_curve(found: Fit, about: Evidence, own: Posterior, members: Sequence[Member]) -> list[Fit]:
    """A fit with one more curve beside its own, of another branch, where the linearisation does not speak against it.

    The search has one curve in a set: each bends for the other, which only fits of both can tell, also with the nearest
    laws in its place; only so for a curve of free form, which bends for any. Evidence lets an equation depart in a few
    directions; from these it departs again, by the square of that share of its size, which is no other curve.
    """
    candidates = about.given.candidates
    there = [candidates[m] for m in own.members]
    slots, branches = {one.slot for one in there}, {one.branch for one in there}
    shapes: dict[Effect, list[Mapping[str, float]]] = {}
    for score, k, strengths in sorted(about.extensions(own.members), key=lambda extension: extension[0]):
        one = candidates[k]
        if score >= own.score or one.effect.is_flexible or not has_its_sign(about, k, strengths):
            continue
        if one.slot in slots and one.branch not in branches:
            shapes.setdefault(one.effect, []).append(one.shape)
    curves = [one for one in members if one.effect.is_memoryless]
    beside = [] if any(one.effect.is_flexible for one in curves) else [found]
    beside += [a.fit for one in curves for a in one.laws[:RIVALS] if a.fit is not None]
    tried = [
        (one, fit_with(law, one.model, found.likelihood, few[:RIVALS]))
        for law, few in shapes.items()
        for one in beside
        if law.name not in one.model.names
    ]
    least = about.thresholds.departure**4 * max(one.fall for one in curves)
    return [both for one, both in tried if one.cost - both.cost > least]


def _with_a_branch_each(fits: Sequence[Fit], candidates: Sequence[Candidate]) -> Iterator[Fit]:
    """Fits but for those in which a law in the place of one curve is of the branch of another."""
    branches = {one.name: one.branch for one in candidates}
    for one in fits:
        taken = [branches[name] for name in one.model.names if name in branches]
        if len({*taken}) == len(taken):
            yield one


def _nearest_of_another_kind(member: Member, model: ExtendedModel) -> Alternative | None:
    """The nearest effect that is not in the model, and no law that was fitted in the member's place."""
    known = {*model.names, *(a.effect for a in member.laws)}
    return next((a for a in member.alternatives if a.shape is not None and a.effect not in known), None)


def _law_of(
    block: Candidate, state: State, about: ExtendedModel, plain: ExtendedModel, likelihood: Likelihood
) -> tuple[float, Fit] | None:
    """The law that follows nearly as well as a flexible block of ``about``, and what share of it that law misses."""
    thresholds, is_curve = state.thresholds, block.effect.is_memoryless
    bare = about.without(block.name, *(part.name for part in about.parts if is_curve and part.effect.is_memoryless))
    nothing = fit(likelihood, bare, FEW_STEPS)
    flexible = weighed(likelihood, about).cost
    explained = min(nothing.cost, likelihood.cost(plain)) - flexible
    misses: list[tuple[float, Fit]] = []
    for law in available(likelihood.sessions, thresholds):
        if law.is_flexible or not (law.is_memoryless if is_curve else law.family == block.effect.family):
            continue
        # A law that stands beside the block may do without it.
        one = nothing if law.name in bare.names else fit_with(law, nothing.model, likelihood, beside=bare)
        # A law of another family is another name, with the odds against one.
        other = state.evidence.odds if law.family != block.effect.family else 0.0
        most = thresholds.departure if _is_stretched(one.model, law) else thresholds.law_departure
        missed = (one.cost + other - flexible) / max(explained, other, 1e-9)
        if missed < most**2:
            misses.append((missed, one))
    return min(misses, key=lambda pair: pair[0]) if misses else None


def _is_stretched(model: ExtendedModel, law: Effect) -> bool:
    """Whether a shape of a law lies at a bound: beyond it the equation means something else."""
    return any(one.null is None and one.is_stretched(value) for one, value in model.part(law.name).valued)
