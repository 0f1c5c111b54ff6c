"""The effects that were found, each weighed against what could stand in its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._baseline import is_beyond_memory, is_stretched
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of
from smartshoe.diagnosis._search import BREADTH, RIVALS, additions, allowed
from smartshoe.diagnosis._sensitivity import Candidate, available, cosines, logged_channels
from smartshoe.diagnosis._session import Session
from smartshoe.models.effects import Effect, blocks, catalogue, told_apart_by
from smartshoe.models.extended import ExtendedModel

SIZES = (0.5, 5.0, 20.0)  # typical ones, from which a fit begins, a resolution: halved or doubled, no name changed


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another explanation of what one member explains: ``effect``, None for nothing at all.

    ``margin`` is by how much -2 log of its evidence is worse. ``fit``: of a law that was fitted in a member's place;
    ``shape``: of an effect that was not, that at which it is likeliest.
    """

    effect: str | None
    margin: float
    fit: Fit | None = None
    shape: Mapping[str, float] | None = None


@dataclass(frozen=True, eq=False)
class Member:
    """An effect that was found.

    ``size``: rms by which the reading moves without it, all else fitted anew (``without``).
    ``departed``: how far the data asks its equation to depart, in standard deviations of the departure allowed.
    ``alternatives``: by evidence about the fit, nearest first. ``laws``: the family's other laws, each fitted in its
    place; margins, and the ``fall`` that the effect itself brings, of -2 log likelihood. ``others_depart``: rms by
    which the other members' equations are asked to depart. ``likeness``: largest cosine of what it adds to the reading
    with what another member adds, 0 where all pull against it. ``is_ended``: it lies where it turns into an effect of
    another kind. ``untold``: laws of other kinds that nothing in this data tells from it, each fitted in its place as
    the ``laws`` are, or the free form of its branch where that follows better. ``bends_too_little``: a curve at the end
    of its range.
    """

    effect: Effect
    size: float
    departed: float
    alternatives: tuple[Alternative, ...]
    without: Fit
    laws: tuple[Alternative, ...]
    fall: float
    others_depart: float = 0.0
    likeness: float = 0.0
    is_ended: bool = False
    untold: tuple[Alternative, ...] = ()
    bends_too_little: bool = False

    @property
    def is_any_curve(self) -> bool:
        """Whether it is a curve of no kind, whose ``laws`` are all curves; with `is_ended` all of them are one."""
        return _is_any_curve(self.effect, self.is_ended)

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name


def members_of(evidence: Evidence, best: Posterior, extended: Fit) -> tuple[Member, ...]:
    likelihood = extended.likelihood
    chosen, thresholds = [evidence.given.candidates[member] for member in best.members], evidence.thresholds
    ended = [_is_ended(one.name, extended.model) for one in chosen]
    less = [
        fit(likelihood, _without(one.name, extended.model, is_ended=at_end), FEW_STEPS)
        for one, at_end in zip(chosen, ended, strict=True)
    ]
    whole = _left(likelihood, extended)
    added = np.array([_left(likelihood, one) - whole for one in less]).reshape(len(less), whole.size)
    inner = added @ added.T
    sizes = np.sqrt(np.diag(inner) / max(whole.size, 1))
    likeness = cosines(inner)
    np.fill_diagonal(likeness, 0.0)
    departures = thresholds.departure * np.array(best.departed) * sizes
    present = excitation_of(likelihood.sessions, thresholds).tells_apart
    made = []
    for k, (member, one) in enumerate(zip(best.members, chosen, strict=True)):
        is_there = sizes[k] > thresholds.imperfection
        shapes = _shapes_beside(best, member, evidence)
        laws = _other_laws(one, less[k], extended, shapes, is_ended=ended[k]) if is_there else ()
        others = alternatives(evidence, best, member)
        rivals = [law for a in others if (law := _untold_law(a, one.effect, present)) is not None]
        made.append(
            Member(
                one.effect,
                float(sizes[k]),
                best.departed[k],
                others,
                less[k],
                laws,
                less[k].cost - extended.cost,
                float(np.linalg.norm(np.delete(departures, k))),
                float(likeness[k].max()),
                ended[k],
                tuple(_of_kind(law, less[k], extended) for law in rivals) if is_there else (),
                extended.model.part(one.name).bends_too_little,
            )
        )
    return tuple(sorted(made, key=lambda one: -one.size))


def _left(likelihood: Likelihood, found: Fit) -> Array:
    """(n,) of all that is fitted: what a model leaves, each recording's own offset aside."""
    return np.concatenate([residual_of(one, found.model)[one.fitted] for one in likelihood.sessions])


def _is_any_curve(effect: Effect, is_ended: bool) -> bool:
    return effect.is_memoryless and (effect.is_flexible or is_ended)


def _is_ended(name: str, model: ExtendedModel) -> bool:
    """Whether an effect lies where it turns into one of another kind; beside a curve no other curve of its kind does.

    It would be a curve as any, and that is there itself.
    """
    part = model.part(name)
    of_its_kind = sum(one.effect.is_memoryless and one.effect.kind == part.effect.kind for one in model.parts)
    return bool(part.kind_ends_at) and of_its_kind < 2


def _without(name: str, model: ExtendedModel, *, is_ended: bool) -> ExtendedModel:
    """``model`` without an effect; without any curve where it is one that lies where its kind ends: it bends others."""
    if not (model.part(name).effect.is_memoryless and is_ended):
        return model.without(name)
    return model.without(*(one.name for one in model.parts if one.effect.is_memoryless))


def _shapes_beside(best: Posterior, member: int, evidence: Evidence) -> dict[str, list[Mapping[str, float]]]:
    """The shapes of each effect in a member's place, the likeliest first."""
    less = best.without(member)
    shapes: dict[str, list[Mapping[str, float]]] = {}
    for _, k, _ in sorted(evidence.extensions(less), key=lambda extension: extension[0]):
        one = evidence.given.candidates[k]
        shapes.setdefault(one.name, []).append(one.shape)
    return shapes


def _other_laws(
    one: Candidate,
    less: Fit,
    extended: Fit,
    shapes: Mapping[str, Sequence[Mapping[str, float]]],
    *,
    is_ended: bool,
) -> tuple[Alternative, ...]:
    """The other laws of a member's family, each fitted in its place, nearest first; of any curve all curves."""
    likelihood, of_curves = less.likelihood, _is_any_curve(one.effect, is_ended)
    beside, found = _without(one.name, extended.model, is_ended=is_ended), []
    for law in available(likelihood.sessions, likelihood.thresholds):
        is_other = law.is_memoryless if of_curves else law.kind == one.effect.kind
        if law.is_flexible or not is_other or law.name in (one.name, *less.model.names):
            continue
        fitted = fit_with(law, less.model, likelihood, shapes.get(law.name, ())[:RIVALS], beside)
        is_bent = is_beyond_memory(fitted.model, likelihood.thresholds) and not is_stretched(extended.model)
        if is_bent and is_stretched(fit(likelihood, fitted.model).model):
            # An arm as no wall has follows what the law does not: it is weighed beside the arm that was found.
            held = beside.with_part(law, fitted.model.part(law.name).values)
            fitted = fit(likelihood, held, FEW_STEPS, only=law.name)
        if of_curves and fitted.model.part(law.name).kind_ends_at:
            continue  # as little a law as what it would stand for
        found.append(Alternative(law.name, fitted.cost - extended.cost, fitted))
    return tuple(sorted(found, key=lambda a: a.margin))


def _untold_law(other: Alternative, one: Effect, present: frozenset[str]) -> Effect | None:
    """An alternative of another kind that the catalogue knows how to tell from ``one``, by nothing that is present.

    Curves are weighed against one another by their laws: the free form of one follows any.
    """
    if other.effect is None or (law := catalogue()[other.effect]).kind == one.kind:
        return None
    if law.is_memoryless and one.is_memoryless:
        return None
    words = told_apart_by(one, law)
    return law if words and not words & present else None


def _of_kind(law: Effect, less: Fit, extended: Fit) -> Alternative:
    """A law in a member's place, or the free form of its branch where that follows better, fitted to its end."""
    free = (one for one in blocks().get(law.family, ()) if one.branch == law.branch)
    fits = [fit_with(one, less.model, less.likelihood) for one in (law, *free)]
    found = fit(less.likelihood, min(fits, key=lambda one: one.cost).model)
    return Alternative(law.name, found.cost - extended.cost, found)


def begun_with(law: Effect, model: ExtendedModel, likelihood: Likelihood) -> ExtendedModel:
    """``model`` with a law at the likeliest of its shapes, from where a fit begins."""
    logged = logged_channels(likelihood.sessions)
    begun = (law.begun(shape, logged=logged) for shape in law.shapes_with(logged))
    return min((model.with_part(law, values) for values in begun), key=likelihood.cost)


def alternatives(evidence: Evidence, best: Posterior, member: int) -> tuple[Alternative, ...]:
    """What could stand in a member's place: every other effect at its best shape, also what was refused; or nothing.

    The margin to nothing is the least of three: the other members' equations depart as in the search, towards all laws
    of their families, or in all that their effects add.
    """
    less = best.without(member)
    margins = [
        weighed.posterior(less, of_any_law=wider).score - weighed.posterior(best.members, of_any_law=wider).score
        for weighed, wider in ((evidence, False), (evidence, True), (evidence.of_whole_effects, False))
    ]
    found = [Alternative(None, min(margins))]
    for k in additions(evidence, less, 2 * BREADTH):
        one = evidence.given.candidates[k]
        if one.name == evidence.given.candidates[member].name or one.effect.is_flexible:
            continue
        other = evidence.posterior((*less, k))
        if allowed(evidence, other):
            found.append(Alternative(one.name, other.score - best.score, shape=one.shape))
    return tuple(sorted(found, key=lambda one: one.margin))


def fit_with(
    law: Effect,
    model: ExtendedModel,
    likelihood: Likelihood,
    shapes: Sequence[Mapping[str, float]] = (),
    beside: ExtendedModel | None = None,
) -> Fit:
    """``model`` with a law: the best of fits from ``shapes``, all of its own where none is given, small and large.

    A corner below the least load, or a bend beyond the largest, has no slope towards where it belongs. Nor has a lag
    about an arm that imitates it: where the arm of ``beside`` is clearly another one, fits begin there as well.
    """
    logged = logged_channels(likelihood.sessions)
    begun = [law.begun(shape, sizes, logged) for shape in shapes or law.shapes_with(logged) for sizes in SIZES]
    tried = []
    for base in (model, *_of_another_arm(beside, model, likelihood)):
        slopes = [rows_of(base, session)[:, 1:] for session in likelihood.sessions]
        for start in (base.with_part(law, values) for values in begun):
            known = zip(likelihood.sessions, slopes, strict=True)
            tried.append(fit(likelihood, start, 1, [_with_own(start, law.name, one, own) for one, own in known]))
    return fit(likelihood, min(tried, key=lambda f: f.cost).model, FEW_STEPS)


def _of_another_arm(
    beside: ExtendedModel | None, model: ExtendedModel, likelihood: Likelihood
) -> Sequence[ExtendedModel]:
    if beside is None:
        return ()
    lower, upper = sorted((beside.relaxation_rate_per_s, model.relaxation_rate_per_s))
    return (beside,) if upper > likelihood.thresholds.clear * lower else ()


def _with_own(model: ExtendedModel, name: str, session: Session, slopes: Array) -> Array:
    """`rows_of` a model whose last effect is ``name``: the ``slopes`` of all else are as they are without it."""
    trace = model.trace(session.conditions)
    own = model.own_sensitivities(name, session.conditions, trace)
    return np.column_stack([session.reading - trace[0], slopes, own])
