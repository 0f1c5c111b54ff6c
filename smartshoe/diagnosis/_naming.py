"""From members of a model to names: how sure each is, what is equivalent to it, and which of them are causes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._members import Alternative, Member
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, catalogue


@dataclass(frozen=True, eq=False)
class Name:
    """``kind_probability``: by its odds, that it is this effect or one of ``equivalents``, which nothing tells from it.

    ``law_probability``: that it is this effect and not its nearest rival in the family, one half in a dead heat.
    ``kind_only``: its family is what was found; its equation follows no better than others of the family. ``is_sure``:
    that it is of this family. ``by``: the law as it was fitted in the place of a flexible block, which stays in the
    model, since the law departs by more than a little and by no more than laws do.
    """

    member: Member
    effect: Effect
    kind_probability: float
    law_probability: float
    equivalents: tuple[str, ...]
    kind_only: bool = False
    is_sure: bool = True
    by: Alternative | None = None


def names_of(
    members: Sequence[Member],
    left: float,
    thresholds: Thresholds,
    *,
    is_clocked: bool = False,
    is_unsteady: bool = False,
    alone: Effect | None = None,
) -> tuple[Name, ...]:
    """The causes among ``members``, largest first; ``left``: rms of the structure that no member explains.

    * Where some are sure: these. Beside them, where one of the sure has a law, others above ``tolerable`` that are
      likelier there than not (another effect's shadow is seldom so large), or that cannot be ruled out and are larger
      than what the laws of the sure ones usually depart by.
    * Where none is sure: those that cannot be ruled out and are larger than all that is left; else the one of
      the kind that does most ``alone``, if it cannot be ruled out. Each is half sure at most.

    ``is_clocked``: peak loads grow or fall with time, so that effects that go with it imitate each other, and curves:
    these are half sure at most. So is what is no curve beside one that would bend farther than its equation can, since
    it may be what that misses. ``is_unsteady``: zeros change at moments, of which some may not be seen and may imitate
    any effect: all are half sure at most. A flexible block, and a curve that lies where its kind ends, is named by the
    law that comes nearest; no name is told twice.
    """
    likely = [_named(one, left, thresholds) for one in members if one.size >= thresholds.material]
    likely = [_with_untold(name, thresholds) for name in likely]
    is_bent = any(one.bends_too_little for one in members)
    likely = [
        doubted(name)
        if is_unsteady
        or (is_clocked and name.effect.goes_with_the_clock)
        or (is_bent and not name.member.effect.is_memoryless)
        else name
        for name in likely
    ]
    # Beside a law a block of which it is the nearest is what that law departs by: one name.
    first: dict[str, Name] = {}
    for one in sorted(likely, key=lambda one: (one.is_sure, one.member.size), reverse=True):
        first.setdefault(one.effect.name, one)
    likely = [one for one in likely if first[one.effect.name] is one]
    found = {one.effect.name for one in likely}  # what is there itself stands for no other
    likely = [replace(one, equivalents=tuple(name for name in one.equivalents if name not in found)) for one in likely]
    odds = thresholds.equivalent_odds
    possible = [one for one in likely if one.kind_probability > odds * (1.0 - one.kind_probability)]
    if sure := [one for one in likely if one.is_sure]:
        is_firm = not all(one.kind_only for one in sure)  # not beside a kind that no law follows
        departed = thresholds.departure * math.hypot(*(one.member.size for one in sure))
        beside = [one for one in possible if one.member.size > thresholds.tolerable] if is_firm else []
        beside = [one for one in beside if confidence_of(one, thresholds) > 0.5 or one.member.size > departed]
        return tuple(one for one in likely if one in sure or one in beside)
    if larger := [one for one in possible if one.member.size > left]:
        return tuple(doubted(one) for one in larger)
    if alone is None:
        return ()
    by_itself = (one for one in possible if one.member.effect.kind == alone.kind)
    return tuple(doubted(one) for one in by_itself if one.member.size > thresholds.tolerable)


def _named(one: Member, left: float, thresholds: Thresholds) -> Name:
    kind = probability_of_kind(one, left, thresholds)
    is_sure = kind >= thresholds.least_confidence
    by = _law_in_its_place(one)
    if by is not None and by.margin <= thresholds.departure**2 * one.fall:
        # The block is how that law departs: the others are weighed against it.
        followed = catalogue()[str(by.effect)]
        kin = _kin_of(followed) or tuple(str(a.effect) for a in one.laws if a is not by)  # of a curve, any other one
        beside = tuple(replace(a, margin=a.margin - by.margin) for a in one.laws if a.effect in kin)
        as_law = replace(one, laws=beside, fall=one.fall - by.margin)
        return Name(one, followed, kind, *probability_of_law(as_law, thresholds), False, is_sure, by)
    if not (one.effect.is_flexible or one.is_any_curve):
        law, equivalents = probability_of_law(one, thresholds)
        return Name(one, one.effect, kind, law, equivalents, is_sure=is_sure)
    nearest = _nearest_of_kind(one) if by is None else catalogue()[str(by.effect)]
    others = dict.fromkeys((*_kin_of(nearest), *(str(a.effect) for a in one.laws)))  # of a curve any other one
    others.pop(nearest.name, None)
    # One that follows less than half of it is none that it may be.
    ruled_out = {a.effect for a in one.laws if thresholds.clear * a.margin > one.fall}
    kin = tuple(name for name in others if name not in ruled_out)
    return Name(one, nearest, kind, 1.0 / (1.0 + len(kin)), kin, True, is_sure)


def _with_untold(name: Name, thresholds: Thresholds) -> Name:
    """Also equivalent are laws of other kinds that nothing tells from it and that follow it as its own would.

    A law of its kind, or the free form, follows what its equation departs by, and misses what that departs by again.
    """
    member = name.member
    alike = [one for one in member.untold if one.margin <= thresholds.departure**4 * member.fall]
    if not alike:
        return name
    others = dict.fromkeys((*name.equivalents, *(str(one.effect) for one in alike)))
    nearest = float(odds_of_law(min(one.margin for one in alike), member.fall, thresholds))
    law = min(name.law_probability, 1.0 / (1.0 + nearest))
    return replace(name, law_probability=law, equivalents=tuple(others))


def _law_in_its_place(one: Member) -> Alternative | None:
    """The law that is named where it misses little: of any curve the nearest, of another block `_nearest_of_kind`."""
    if one.is_any_curve:
        return next(iter(one.laws), None)
    if not one.effect.is_flexible:
        return None
    nearest = _nearest_of_kind(one).name
    return next((a for a in one.laws if a.effect == nearest), None)


def _kin_of(law: Effect) -> tuple[str, ...]:
    """The other laws of its family, and of those that count as its members."""
    return tuple(one.name for one in catalogue().values() if one.kind == law.kind and one is not law)


def _nearest_of_kind(block: Member) -> Effect:
    """The law of a block's family that comes nearest; of no curve one of another stage.

    What grows with the load borne is none that goes with the clock.
    """
    family = [e for e in catalogue().values() if e.family == block.effect.family]
    alike = [e for e in family if e.stage == block.effect.stage and not block.effect.is_memoryless]
    margins = {a.effect: a.margin for a in block.laws}
    return min(alike or family, key=lambda e: margins.get(e.name, math.inf))


def doubted(name: Name) -> Name:
    """The name, half sure at most."""
    return replace(name, kind_probability=min(name.kind_probability, 0.5), is_sure=False)


def probability_of_kind(one: Member, left: float, thresholds: Thresholds) -> float:
    """That an effect of this family is there: a logistic of three ratios, each without a unit, and the evidence for it.

    What no equation follows over the effect's size: structure that is ``left``, and what the other effects' equations
    are asked to depart by (one that is as small as that is likely another's shadow). How far its own equation is asked
    to depart. How alike what it adds is to what another effect adds.
    """
    intercept, per_left, per_departed, per_likeness = thresholds.kind_odds
    left = math.hypot(left, one.others_depart)
    ratio = (left + thresholds.imperfection) / (one.size + thresholds.imperfection)
    score = intercept + per_left * math.log(ratio) + per_departed * one.departed
    score += per_likeness * one.likeness
    nothing = next((a.margin for a in one.alternatives if a.effect is None), math.inf)
    return 1.0 / (1.0 + math.exp(-score)) / (1.0 + math.exp(-max(nothing, 0.0) / 2.0))


def confidence_of(name: Name, thresholds: Thresholds) -> float:
    """That it is what it is named, or one of its equivalents: more than by its odds where it is sure, else no more.

    Half at most where no law of the kind follows: it may be of a law, or a kind, that the catalogue does not have.
    """
    kind = name.kind_probability
    if name.kind_only:
        return min(kind, 0.5)
    if not name.is_sure:
        return kind
    return kind / (kind + (1.0 - kind) * math.exp(-thresholds.named_odds))


def probability_of_law(one: Member, thresholds: Thresholds) -> tuple[float, tuple[str, ...]]:
    """That it is this law of its family, and the laws that this data cannot tell from it.

    It is held against its nearest rival: one half in a dead heat.
    """
    odds = {a.effect: float(odds_of_law(a.margin, one.fall, thresholds)) for a in one.laws if a.effect is not None}
    equivalents = tuple(name for name, other in odds.items() if other > thresholds.equivalent_odds)
    return 1.0 / (1.0 + max(odds.values(), default=0.0)), equivalents


def odds_of_law(margin: Array | float, fall: float, thresholds: Thresholds) -> Array:
    """Odds of another law in the place of one that brings ``fall`` of -2 log likelihood and follows ``margin`` better.

    No law is exact: another one that explains all but the square of the usual departure, of what this one explains, is
    as good. So the margin is counted in units of that square, and of one look at noise.
    """
    unit = 2.0 * (1.0 + thresholds.departure**2 * max(fall, 0.0))
    return np.exp(-np.maximum(margin, 0.0) / unit)
