"""Which law a kind has: equations compared by fits of the whole model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of
from smartshoe.diagnosis._members import Member, begun_with
from smartshoe.diagnosis._sensitivity import Candidate, available, logged_channels
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._state import State, state_at, with_members
from smartshoe.models.effects import Effect, blocks, catalogue
from smartshoe.models.extended import ExtendedModel

SIZES = (0.5, 5.0, 20.0)  # typical ones, from which a fit begins, a resolution: halved or doubled, no name changed


def with_laws(given: State, plain: ExtendedModel, sessions: Sequence[Session]) -> State:
    """``given`` with a law in the place of a flexible block, where one follows nearly as well.

    No law is exact: one that leaves less than the square of the usual departure, of what the flexible block explains,
    is the law; of the mean departure, where a shape lies at a bound, beyond which the equation means something else.
    One that leaves less than the mean departure's stays: what it misses is no other curve. A block is bent before a law
    is, so that only fits of the whole model compare them fairly. Nothing in its place leaves no more than the ``plain``
    model does.
    """
    state, about = given, given.fit.model
    flexible = [one for one in given.chosen if one.effect.is_flexible]
    if not {one.name for one in flexible} <= {*about.names}:  # the last search asked for one that is not fitted yet
        likelihood = given.likelihood(sessions)
        about = fit(likelihood, with_members(given.given, given.best, about, likelihood), FEW_STEPS).model
    for block in flexible:
        found = _law_of(block, state, about, plain, state.likelihood(sessions))
        if found is not None:
            missed, law = found
            banned = _replaced_with(block.effect) if missed < state.thresholds.departure**2 else ()
            state, about = state_at(law, sessions, state.thresholds, (*state.banned, *banned)), law.model
    return state


def _replaced_with(block: Effect) -> tuple[str, ...]:
    """A block, and for a curve all of them, which follow the same."""
    curves = [one.name for family in blocks().values() for one in family if one.is_memoryless]
    return tuple(curves) if block.is_memoryless else (block.name,)


def likelier_laws(members: Sequence[Member], banned: Sequence[str]) -> dict[str, str]:
    """Members, and the law of its family that follows better in the place of each: fits of the whole model tell.

    The linearised search prefers what comes nearest to all equations of the family.
    """
    nearest = ((one, next(iter(one.laws), None)) for one in members if not one.effect.is_flexible)
    return {
        one.name: str(law.effect)
        for one, law in nearest
        if law is not None and law.margin < 0.0 and law.effect not in banned
    }


def with_likelier_laws(
    state: State, model: ExtendedModel, laws: Mapping[str, str], sessions: Sequence[Session]
) -> State:
    """``state`` at ``model`` with each of ``laws`` in its member's place, and not the other way round again."""
    likelihood = state.likelihood(sessions)
    for name, law in laws.items():
        if law not in model.names:  # it may follow better in the place of more than one
            model = begun_with(catalogue()[law], model.without(name), likelihood)
    return state_at(fit(likelihood, model), sessions, state.thresholds, (*state.banned, *laws))


def _law_of(
    block: Candidate, state: State, about: ExtendedModel, plain: ExtendedModel, likelihood: Likelihood
) -> tuple[float, Fit] | None:
    """The law that follows nearly as well as a flexible block of ``about``, and what share of it that law misses."""
    thresholds, is_curve = state.thresholds, block.effect.is_memoryless
    bare = about.without(block.name)
    for part in bare.parts:
        if is_curve and part.effect.is_memoryless:
            bare = bare.without(part.name)
    nothing = fit(likelihood, bare, FEW_STEPS)
    flexible = likelihood.cost(about)
    explained = min(nothing.cost, likelihood.cost(plain)) - flexible
    misses: list[tuple[float, Fit]] = []
    for law in available(likelihood.sessions, thresholds):
        if law.is_flexible or not (law.is_memoryless if is_curve else law.family == block.effect.family):
            continue
        # A law that stands beside the block may do without it.
        one = nothing if law.name in bare.names else _begun(law, nothing.model, likelihood)
        # A law of another family is another name, with the odds against one.
        other = state.evidence.odds if law.family != block.effect.family else 0.0
        most = thresholds.departure if _is_stretched(one.model, law) else thresholds.law_departure
        missed = (one.cost + other - flexible) / max(explained, other, 1e-9)
        if missed < most**2:
            misses.append((missed, one))
    return min(misses, key=lambda pair: pair[0]) if misses else None


def _begun(law: Effect, model: ExtendedModel, likelihood: Likelihood) -> Fit:
    """``model`` with a law: the best of fits from all its shapes, small and large.

    A corner below the least load, or a bend beyond the largest, has no slope towards where it belongs.
    """
    logged = logged_channels(likelihood.sessions)
    begun = (law.begun(shape, sizes, logged) for shape in law.shapes_with(logged) for sizes in SIZES)
    slopes = [rows_of(model, session)[:, 1:] for session in likelihood.sessions]
    tried = []
    for start in (model.with_part(law, values) for values in begun):
        rows = [_with_own(start, law.name, one, known) for one, known in zip(likelihood.sessions, slopes, strict=True)]
        tried.append(fit(likelihood, start, 1, rows))
    return fit(likelihood, min(tried, key=lambda f: f.cost).model, FEW_STEPS)


def _with_own(model: ExtendedModel, name: str, session: Session, slopes: Array) -> Array:
    """`rows_of` a model whose last effect is ``name``: the ``slopes`` of all else are as they are without it."""
    trace = model.trace(session.conditions)
    own = model.own_sensitivities(name, session.conditions, trace)
    return np.column_stack([session.reading - trace[0], slopes, own])


def _is_stretched(model: ExtendedModel, law: Effect) -> bool:
    """Whether a shape of a law lies at a bound: beyond it the equation means something else."""
    last = model.part(law.name)
    return any(
        parameter.null is None and parameter.is_stretched(float(value))
        for parameter, value in zip(last.effect.parameters, last.values, strict=True)
    )
