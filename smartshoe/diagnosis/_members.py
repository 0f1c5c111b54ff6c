"""The effects that were found, each compared with what could stand in its place."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._baseline import has_arm_beyond_memory, has_extreme_arm
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._search import BREADTH, RIVALS, best_additions, is_admissible
from smartshoe.diagnosis._sensitivity import Candidate, available_effects, cosines, logged_channels
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._validation import contributed_rms, do_cancel
from smartshoe.models.effects import Effect, blocks, catalogue, told_apart_by
from smartshoe.models.extended import ExtendedModel

SIZES = (0.5, 5.0, 20.0)  # typical sizes that a fit starts from, a resolution: halved or doubled, no name changed


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another explanation of what one member explains: another ``effect``, or None for nothing at all.

    ``margin`` is by how much its -2 log evidence is higher (worse). ``fit`` is the fit of a law in the member's place,
    ``shape`` the most probable shape of an effect that was not fitted.
    """

    effect: str | None
    margin: float
    fit: Fit | None = None
    shape: Mapping[str, float] | None = None


@dataclass(frozen=True, eq=False)
class Member:
    """An effect that was found.

    ``size`` is the rms by which the reading moves when the effect is removed and all else refitted (``without``).
    ``likelihood_ratio`` is the statistic of that: the fall of -2 log likelihood that the effect brings.

    ``alternatives`` are ordered by evidence, nearest first. ``laws`` are the other laws of the family, each fitted in
    its place. ``confounded`` are laws of other kinds that nothing in this data distinguishes from it, fitted likewise
    (or the flexible block of their branch, if that follows better).

    ``departure_sds`` is how far its equation departs in the fit, in prior standard deviations; ``others_departure_rms``
    the rms by which the other members' equations depart. ``likeness`` is the largest cosine between its contribution
    and that of another member, at least 0.

    ``kin`` are members of its kind that ``size``, ``likelihood_ratio`` and ``without`` take together with it
    (`taken_together`).

    ``is_at_end_of_kind``: a shape lies where the effect turns into one of another kind. ``bends_too_little``: it is a
    curve at the end of its range.
    """

    effect: Effect
    size: float
    departure_sds: float
    alternatives: tuple[Alternative, ...]
    without: Fit
    laws: tuple[Alternative, ...]
    likelihood_ratio: float
    others_departure_rms: float = 0.0
    likeness: float = 0.0
    is_at_end_of_kind: bool = False
    confounded: tuple[Alternative, ...] = ()
    bends_too_little: bool = False
    kin: tuple[str, ...] = ()

    @property
    def is_any_curve(self) -> bool:
        """Whether it is a curve of no particular kind, so that its ``laws`` are all curves."""
        return _is_any_curve(self.effect, self.is_at_end_of_kind)

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name


def members_of(evidence: Evidence, best: Posterior, extended: Fit) -> tuple[Member, ...]:
    """The members of the set ``best``, largest first, each refitted without it and compared with alternatives.

    A tare, which only rests name, is none of them.
    """
    likelihood = extended.likelihood
    chosen, thresholds = [evidence.linearisation.candidates[member] for member in best.members], evidence.thresholds
    ended = [_is_at_end_of_kind(one.name, extended.model) for one in chosen]
    reduced = [
        fit(likelihood, _without(one.name, extended.model, is_at_end_of_kind=at_end), FEW_STEPS)
        for one, at_end in zip(chosen, ended, strict=True)
    ]
    sizes, likeness = _sizes_and_likeness(reduced, extended)
    departures = thresholds.departure * np.array(best.departure_sds) * sizes
    present = excitation_of(likelihood.sessions, thresholds).tells_apart
    made = []
    for k, (member, one) in enumerate(zip(best.members, chosen, strict=True)):
        if one.effect.shifts is not None:
            continue
        is_there = sizes[k] > thresholds.imperfection
        shapes = _shapes_beside(best, member, evidence)
        laws = _other_laws(one, reduced[k], extended, shapes, is_at_end_of_kind=ended[k]) if is_there else ()
        others = alternatives(evidence, best, member)
        rivals = [law for a in others if (law := _confounded_law(a, one.effect, present)) is not None]
        made.append(
            Member(
                one.effect,
                float(sizes[k]),
                best.departure_sds[k],
                others,
                reduced[k],
                laws,
                reduced[k].cost - extended.cost,
                float(np.linalg.norm(np.delete(departures, k))),
                float(likeness[k]),
                ended[k],
                tuple(_confounded_fit(law, reduced[k], extended) for law in rivals) if is_there else (),
                extended.model.part(one.name).bends_too_little,
            )
        )
    return tuple(sorted(made, key=lambda one: -one.size))


def taken_together(members: Sequence[Member], evidence: Evidence, best: Posterior, extended: Fit) -> tuple[Member, ...]:
    """For each kind of which there are several ``members``, these as one, called by the largest.

    Where a delay stands beside a clock drift either takes most of the other's part, so that each alone does little,
    while what both do may be the largest cause of all. Not those that undo one another, which follow what neither is,
    nor curves: two of them in a row follow what any curve does, and are compared with that (`Member.is_any_curve`).
    """
    likelihood, departure = extended.likelihood, evidence.thresholds.departure
    made = []
    for kind in dict.fromkeys(one.effect.kind for one in members):
        own = [one for one in members if one.effect.kind == kind]
        others = [one for one in members if one.effect.kind != kind]
        names = [one.name for one in own]
        if len(own) < 2 or all(one.effect.is_memoryless for one in own):
            continue
        if do_cancel(*contributed_rms(likelihood.sessions, extended.model, names), evidence.thresholds):
            continue
        largest = max(own, key=lambda one: (not one.effect.is_flexible, one.size))
        without = fit(likelihood, extended.model.without(*names), FEW_STEPS)
        sizes, likeness = _sizes_and_likeness([without, *(one.without for one in others)], extended)
        left = tuple(m for m in best.members if evidence.linearisation.candidates[m].effect.kind != kind)
        made.append(
            replace(
                largest,
                size=float(sizes[0]),
                likelihood_ratio=without.cost - extended.cost,
                without=without,
                alternatives=(Alternative(None, _margin_to(left, evidence, best)),),
                others_departure_rms=departure * math.hypot(*(one.departure_sds * one.size for one in others)),
                likeness=float(likeness[0]),
                kin=tuple(one.name for one in own if one is not largest),
            )
        )
    return tuple(made)


def _sizes_and_likeness(reduced: Sequence[Fit], extended: Fit) -> tuple[Array, Array]:
    """(k,) rms of what each fit of ``reduced`` lacks of ``extended``, and its largest cosine with that of another.

    The cosine is at least 0.
    """
    whole = _residuals(extended.likelihood, extended)
    added = np.array([_residuals(extended.likelihood, one) - whole for one in reduced])
    inner = added.reshape(len(reduced), whole.size) @ added.reshape(len(reduced), whole.size).T
    likeness = cosines(inner)
    np.fill_diagonal(likeness, 0.0)
    return np.sqrt(np.diag(inner) / max(whole.size, 1)), likeness.max(axis=1, initial=0.0)


def _margin_to(reduced: tuple[int, ...], evidence: Evidence, best: Posterior) -> float:
    """By how much the set ``reduced`` has less evidence than ``best``: the smallest of three margins.

    With the model error of the search and the two wider ones (`Evidence`).
    """
    return min(
        weighed.posterior(reduced, of_any_law=wider).score - weighed.posterior(best.members, of_any_law=wider).score
        for weighed, wider in ((evidence, False), (evidence, True), (evidence.of_whole_effects, False))
    )


def _residuals(likelihood: Likelihood, found: Fit) -> Array:
    """(n,) residuals of all fitted samples, without each recording's own offset."""
    return np.concatenate([residual_of(one, found.model)[one.fitted] for one in likelihood.sessions])


def _is_any_curve(effect: Effect, is_at_end_of_kind: bool) -> bool:
    """Whether a curve is flexible or at the end of its kind."""
    return effect.is_memoryless and (effect.is_flexible or is_at_end_of_kind)


def _is_at_end_of_kind(name: str, model: ExtendedModel) -> bool:
    """Whether an effect's shape lies where it turns into another kind of effect.

    Not where another curve of its kind stands beside it: as a generic curve it would be no other than that one.
    """
    part = model.part(name)
    of_its_kind = sum(one.effect.is_memoryless and one.effect.kind == part.effect.kind for one in model.parts)
    return bool(part.kind_ends_at) and of_its_kind < 2


def _without(name: str, model: ExtendedModel, *, is_at_end_of_kind: bool) -> ExtendedModel:
    """``model`` without an effect; without any curve if it is a curve at the end of its kind, since it bends others."""
    if not (model.part(name).effect.is_memoryless and is_at_end_of_kind):
        return model.without(name)
    return model.without(*(one.name for one in model.parts if one.effect.is_memoryless))


def _shapes_beside(best: Posterior, member: int, evidence: Evidence) -> dict[str, list[Mapping[str, float]]]:
    """The shapes of each effect in a member's place, most probable first."""
    reduced = best.without(member)
    shapes: dict[str, list[Mapping[str, float]]] = {}
    for _, k, _ in sorted(evidence.extensions(reduced), key=lambda extension: extension[0]):
        one = evidence.linearisation.candidates[k]
        shapes.setdefault(one.name, []).append(one.shape)
    return shapes


def _other_laws(
    one: Candidate,
    reduced: Fit,
    extended: Fit,
    shapes: Mapping[str, Sequence[Mapping[str, float]]],
    *,
    is_at_end_of_kind: bool,
) -> tuple[Alternative, ...]:
    """The other laws of a member's family, each fitted in its place, nearest first; for a generic curve all curves."""
    likelihood, of_curves = reduced.likelihood, _is_any_curve(one.effect, is_at_end_of_kind)
    base, found = _without(one.name, extended.model, is_at_end_of_kind=is_at_end_of_kind), []
    for law in available_effects(likelihood.sessions, likelihood.thresholds):
        is_other = law.is_memoryless if of_curves else law.kind == one.effect.kind
        if law.is_flexible or not is_other or law.name in (one.name, *reduced.model.names):
            continue
        fitted = fit_with(law, reduced.model, likelihood, shapes.get(law.name, ())[:RIVALS], base)
        if law.name in fitted.model.ended:
            fitted = fit(likelihood, fitted.model.freed(law.name), FEW_STEPS)
        is_bent = has_arm_beyond_memory(fitted.model, likelihood.thresholds) and not has_extreme_arm(extended.model)
        if is_bent and has_extreme_arm(fit(likelihood, fitted.model).model):
            # An arm that no wall has follows what the law misses: compare the law beside the arm that was found
            # instead.
            held = base.with_part(law, fitted.model.part(law.name).values)
            fitted = fit(likelihood, held, FEW_STEPS, only_effect=law.name)
        part = fitted.model.part(law.name)
        if law.is_null(part.values):
            continue  # others took its place in the fit, so that it follows nothing
        if of_curves and part.kind_ends_at:
            continue  # it is at the end of its kind, too
        found.append(Alternative(law.name, fitted.cost - extended.cost, fitted))
    return tuple(sorted(found, key=lambda a: a.margin))


def _confounded_law(other: Alternative, one: Effect, present: frozenset[str]) -> Effect | None:
    """The alternative's law if it is of another kind and nothing in ``present`` distinguishes it from ``one``.

    Two curves are compared by their laws instead, since a flexible curve follows any of them.
    """
    if other.effect is None or (law := catalogue()[other.effect]).kind == one.kind:
        return None
    if law.is_memoryless and one.is_memoryless:
        return None
    words = told_apart_by(one, law)
    return law if words and not words & present else None


def _confounded_fit(law: Effect, reduced: Fit, extended: Fit) -> Alternative:
    """A law in a member's place, or the flexible block of its branch if that follows better, fitted to convergence."""
    free = (one for one in blocks().get(law.family, ()) if one.branch == law.branch)
    fits = [fit_with(one, reduced.model, reduced.likelihood) for one in (law, *free)]
    found = fit(reduced.likelihood, min(fits, key=lambda one: one.cost).model)
    return Alternative(law.name, found.cost - extended.cost, found)


def start_with(law: Effect, model: ExtendedModel, likelihood: Likelihood) -> ExtendedModel:
    """``model`` with a law at the most probable of its shapes, from which a fit starts."""
    logged = logged_channels(likelihood.sessions)
    starts = (law.begun(shape, logged=logged) for shape in law.shapes_with(logged))
    return min((model.with_part(law, values) for values in starts), key=likelihood.cost)


def alternatives(evidence: Evidence, best: Posterior, member: int) -> tuple[Alternative, ...]:
    """What could stand in a member's place, nearest first: every other effect at its best shape, or nothing."""
    reduced = best.without(member)
    found = [Alternative(None, _margin_to(reduced, evidence, best))]
    for k in best_additions(evidence, reduced, 2 * BREADTH):
        one = evidence.linearisation.candidates[k]
        if one.name == evidence.linearisation.candidates[member].name or one.effect.is_flexible:
            continue
        other = evidence.posterior((*reduced, k))
        if is_admissible(evidence, other):
            found.append(Alternative(one.name, other.score - best.score, shape=one.shape))
    return tuple(sorted(found, key=lambda one: one.margin))


def fit_with(
    law: Effect,
    model: ExtendedModel,
    likelihood: Likelihood,
    shapes: Sequence[Mapping[str, float]] = (),
    other_arm: ExtendedModel | None = None,
) -> Fit:
    """``model`` with a law: the best of fits from ``shapes`` (default all shapes of the law), each at several sizes.

    Several sizes, since a corner below the lowest load or a bend above the highest has no gradient. If the arm of
    ``other_arm`` is clearly another one, fits also start there, since an arm can imitate a lag.
    """
    logged = logged_channels(likelihood.sessions)
    starts = [law.begun(shape, sizes, logged) for shape in shapes or law.shapes_with(logged) for sizes in SIZES]
    tried = []
    for base in (model, *_of_another_arm(other_arm, model, likelihood)):
        slopes = [rows_of(base, session)[:, 1:] for session in likelihood.sessions]
        for start in (base.with_part(law, values) for values in starts):
            known = zip(likelihood.sessions, slopes, strict=True)
            tried.append(fit(likelihood, start, 1, [_with_own(start, law.name, one, own) for one, own in known]))
    return fit(likelihood, min(tried, key=lambda f: f.cost).model, FEW_STEPS)


def _of_another_arm(
    other_arm: ExtendedModel | None, model: ExtendedModel, likelihood: Likelihood
) -> Sequence[ExtendedModel]:
    """``other_arm`` if its relaxation rate differs clearly from that of ``model``."""
    if other_arm is None:
        return ()
    lower, upper = sorted((other_arm.relaxation_rate_per_s, model.relaxation_rate_per_s))
    return (other_arm,) if upper > likelihood.thresholds.clear * lower else ()


def _with_own(model: ExtendedModel, name: str, session: Session, slopes: Array) -> Array:
    """`rows_of` a model whose last effect is ``name``; the ``slopes`` of all else are known."""
    trace = model.trace(session.conditions)
    own = model.own_sensitivities(name, session.conditions, trace)
    return np.column_stack([session.reading - trace[0], slopes, own])
