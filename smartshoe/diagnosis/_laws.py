"""Which law of a kind holds: equations compared by fits of the whole model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, evaluated, fit
from smartshoe.diagnosis._members import Alternative, Member, fit_with
from smartshoe.diagnosis._search import RIVALS, SWAPS, has_physical_sign
from smartshoe.diagnosis._sensitivity import Candidate, available_effects
from smartshoe.diagnosis._state import State, evidence_about, fit_of_set, state_at
from smartshoe.models.effects import Effect, blocks
from smartshoe.models.extended import ExtendedModel


def with_laws(initial: State, plain: ExtendedModel) -> State:
    """``initial`` with laws in the place of its flexible blocks, where a law follows nearly as well.

    No law is exact. The nearest is taken if it misses less than ``law_departure``² of what the block explains, or less
    than ``departure``² if one of its shapes is at a bound, beyond which the equation means something else. What the
    block explains is counted from a fit without it, which may leave no more than the ``plain`` model does.

    Both are fitted as whole models, since a linearisation bends a block earlier than a law. If the law misses less than
    ``departure``² the block is banned from then on: what is missed is no second curve.
    """
    state, about = initial, initial.fit.model
    flexible = [one for one in initial.chosen if one.effect.is_flexible]
    if not {one.name for one in flexible} <= {*about.names}:  # the last search chose a block that is not fitted yet
        about = fit_of_set(initial, initial.best, initial.likelihood(), FEW_STEPS).model
    for block in flexible:
        found = _law_of(block, state, about, plain, state.likelihood())
        if found is not None:
            missed, law = found
            banned = _blocks_banned_for(block.effect) if missed < state.thresholds.departure**2 else ()
            state, about = state_at(law, (*state.banned, *banned)), law.model
    return state


def _blocks_banned_for(block: Effect) -> tuple[str, ...]:
    """The block, and if it is a curve all flexible curves, since they follow the same shapes."""
    curves = [one.name for family in blocks().values() for one in family if one.is_memoryless]
    return tuple(curves) if block.is_memoryless else (block.name,)


def likelier_changes(found: Fit, evidence: Evidence, members: Sequence[Member]) -> Iterator[State]:
    """States after one change of ``found``, most probable first: a member removed, or replaced by a law or effect.

    The linearised search weighs all changes about one fit; here each is fitted and linearised again. ``evidence`` gives
    the noise for all. Only changes that gain more than the odds against an effect are returned.
    """
    tried: list[Fit] = []
    for one in members:
        if any(a.effect is None and a.margin < 0.0 for a in one.alternatives):
            tried.append(one.without)
        max_margin = evidence.thresholds.law_departure**2 * max(one.likelihood_ratio, 0.0)
        if not one.effect.why_unnamed:  # a behaviour without a law has been compared with those that come near
            tried += [a.fit for a in one.laws if a.fit is not None and a.margin < max_margin]
        other = _nearest_of_another_kind(one, found.model)
        if other is None or one.size <= evidence.thresholds.tolerable:
            continue
        if one.departure_sds > 1.0 or one.is_at_end_of_kind or other.margin < 0.0:
            # The effect may be of another kind if its equation departs unusually far, if it lies at the end of its
            # kind, or if the other kind is more probable although the search removed it beside this one.
            law = next(c.effect for c in evidence.linearisation.candidates if c.name == other.effect)
            tried.append(fit_with(law, one.without.model, found.likelihood, (other.shape or {},)))
    has_curve = any(one.effect.is_memoryless for one in members)
    if not (tried or has_curve):
        return
    about, own_posterior = evidence_about(found.model, evidence)
    if has_curve:
        tried += _with_another_curve(found, about, own_posterior, members)
        tried = [*_with_distinct_branches(tried, about.linearisation.candidates)]
    changed = []
    for fitted in tried:
        if evidence_about(fitted.model, evidence, about.linearisation)[1].score >= own_posterior.score:
            continue  # a rough score, by which most are ruled out
        anew, best = evidence_about(fitted.model, evidence)
        if own_posterior.score - best.score >= evidence.odds:
            changed.append(State(anew, best, fitted))
    yield from sorted(changed, key=lambda state: state.best.score)[:SWAPS]


def _with_another_curve(found: Fit, about: Evidence, own_posterior: Posterior, members: Sequence[Member]) -> list[Fit]:
    """Fits with one more curve of another branch, where the linearisation does not speak against it.

    The search allows one curve in a set, since curves bend for each other: only fits of both can tell, also beside the
    nearest laws of the first curve. A flexible curve is always replaced by laws here, since it bends for any second
    one. The second curve must gain more than the square of the usual departure explains.
    """
    candidates = about.linearisation.candidates
    present = [candidates[m] for m in own_posterior.members]
    slots, branches = {one.slot for one in present}, {one.branch for one in present}
    shapes: dict[Effect, list[Mapping[str, float]]] = {}
    for score, k, strengths in sorted(about.extensions(own_posterior.members), key=lambda extension: extension[0]):
        one = candidates[k]
        if score >= own_posterior.score or one.effect.is_flexible or not has_physical_sign(about, k, strengths):
            continue
        if one.slot in slots and one.branch not in branches:
            shapes.setdefault(one.effect, []).append(one.shape)
    curves = [one for one in members if one.effect.is_memoryless]
    bases = [] if any(one.effect.is_flexible for one in curves) else [found]
    bases += [a.fit for one in curves for a in one.laws[:RIVALS] if a.fit is not None]
    tried = [
        (one, fit_with(law, one.model, found.likelihood, few[:RIVALS]))
        for law, few in shapes.items()
        for one in bases
        if law.name not in one.model.names
    ]
    min_ratio = about.thresholds.departure**4 * max(one.likelihood_ratio for one in curves)
    return [both for one, both in tried if one.cost - both.cost > min_ratio]


def _with_distinct_branches(fits: Sequence[Fit], candidates: Sequence[Candidate]) -> Iterator[Fit]:
    """Fits without those in which two effects are of one branch."""
    branches = {one.name: one.branch for one in candidates}
    for one in fits:
        taken = [branches[name] for name in one.model.names if name in branches]
        if len({*taken}) == len(taken):
            yield one


def _nearest_of_another_kind(member: Member, model: ExtendedModel) -> Alternative | None:
    """The nearest alternative that is neither in the model nor fitted as a law of the member."""
    known = {*model.names, *(a.effect for a in member.laws)}
    return next((a for a in member.alternatives if a.shape is not None and a.effect not in known), None)


def _law_of(
    block: Candidate, state: State, about: ExtendedModel, plain: ExtendedModel, likelihood: Likelihood
) -> tuple[float, Fit] | None:
    """The law that follows a flexible block of ``about`` nearly as well, and the share of the block that it misses."""
    thresholds, is_curve = state.thresholds, block.effect.is_memoryless
    bare = about.without(block.name, *(part.name for part in about.parts if is_curve and part.effect.is_memoryless))
    without_block = fit(likelihood, bare, FEW_STEPS)
    flexible = evaluated(likelihood, about).cost
    explained = min(without_block.cost, likelihood.cost(plain)) - flexible
    misses: list[tuple[float, Fit]] = []
    for law in available_effects(likelihood.sessions, thresholds):
        if law.is_flexible or not (law.is_memoryless if is_curve else law.family == block.effect.family):
            continue
        # A law that is already beside the block may do without it.
        one = (
            without_block if law.name in bare.names else fit_with(law, without_block.model, likelihood, other_arm=bare)
        )
        # A law of another family is a further name, with the odds against one.
        other = state.evidence.odds if law.family != block.effect.family else 0.0
        max_missed = thresholds.departure if _is_stretched(one.model, law) else thresholds.law_departure
        missed = (one.cost + other - flexible) / max(explained, other, 1e-9)
        if missed < max_missed**2:
            misses.append((missed, one))
    return min(misses, key=lambda pair: pair[0]) if misses else None


def _is_stretched(model: ExtendedModel, law: Effect) -> bool:
    """Whether a shape of a law lies at a bound, beyond which the equation means something else."""
    return any(one.null is None and one.is_stretched(value) for one, value in model.part(law.name).valued)
