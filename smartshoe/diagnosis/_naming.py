"""From members of the model to names: how sure each is, what is equivalent to it, and which members are causes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._members import Alternative, Member
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, catalogue

# Why a name is half sure at most.
BY_THE_CLOCK = "peak loads grow, or fall, with time, so that what goes with time and what goes with the load are alike"
BESIDE_A_BENT_CURVE = "it may be what a curve at the end of its range misses"


@dataclass(frozen=True, eq=False)
class Name:
    """A member with the ``effect`` it is named by.

    ``kind_probability`` is the probability that it is this effect or one of its ``equivalents``, which this data cannot
    distinguish. ``law_probability`` is that of this law against its nearest rival of the family, one half in a dead
    heat.

    ``kind_only``: only the family was found, since no equation of it follows better than the others. ``is_sure``: the
    kind has at least ``least_confidence``. ``law_in_place`` is the law fitted in the place of a flexible block, which
    names it although the block stays in the model. ``doubt``: why it is half sure at most, where it is for a reason of
    its own.
    """

    member: Member
    effect: Effect
    kind_probability: float
    law_probability: float
    equivalents: tuple[str, ...]
    kind_only: bool = False
    is_sure: bool = True
    law_in_place: Alternative | None = None
    doubt: str = ""


def names_of(
    members: Sequence[Member],
    residual_rms: float,
    thresholds: Thresholds,
    *,
    is_clocked: bool = False,
    doubt: str = "",
    best_single: Effect | None = None,
    together: Sequence[Member] = (),
) -> tuple[Name, ...]:
    """The causes among ``members``, largest first; ``residual_rms`` is the structure that no member explains.

    * If some are sure: these. If one of them has a law, also others above ``tolerable`` that are more probable than not
      (another effect's shadow is seldom that large), or that cannot be ruled out and exceed the usual departure of the
      sure ones' laws.
    * If none is sure: those that cannot be ruled out and exceed ``residual_rms``; failing these, one of the kind of
      ``best_single``, if it cannot be ruled out. Each is half sure at most.

    ``together``: members of one kind as one; where none of them is sure by itself but all of them are, they have one
    name, with the others as its equivalents.

    ``is_clocked``: peak loads rise or fall with time, so that effects that go with time imitate each other and curves;
    these are half sure at most. So is any memory effect together with a curve at the end of its range, since it may be
    what that curve misses. ``doubt``: why all are half sure at most, empty where they may be sure. Flexible blocks, and
    curves at the end of their kind, carry the name of the nearest law; no name is given twice.
    """
    named = [_named(one, residual_rms, thresholds) for one in members if one.size >= thresholds.material]
    for joint in (_named(one, residual_rms, thresholds) for one in together):
        kin = {joint.member.name, *joint.member.kin}
        if joint.is_sure and not any(one.is_sure for one in named if one.member.name in kin):
            named = [*(one for one in named if one.member.name not in kin), _with_kin(joint)]
    named = [_with_confounded(name, thresholds) for name in named]
    is_bent = any(one.bends_too_little for one in members)
    if doubt:
        named = [capped_at_half(name, doubt) for name in named]
    if is_clocked:
        named = [capped_at_half(one, BY_THE_CLOCK) if one.effect.goes_with_the_clock else one for one in named]
    if is_bent:
        named = [one if one.member.effect.is_memoryless else capped_at_half(one, BESIDE_A_BENT_CURVE) for one in named]
    # A block named after a law that is in the model itself is only that law's departure: one name.
    first: dict[str, Name] = {}
    for one in sorted(named, key=lambda one: (one.is_sure, one.member.size), reverse=True):
        first.setdefault(one.effect.name, one)
    named = [one for one in named if first[one.effect.name] is one]
    found = {one.effect.name for one in named}  # an effect that is in the model is no equivalent of another
    named = [replace(one, equivalents=tuple(name for name in one.equivalents if name not in found)) for one in named]
    odds = thresholds.equivalent_odds
    possible = [one for one in named if one.kind_probability > odds * (1.0 - one.kind_probability)]
    if sure := [one for one in named if one.is_sure]:
        is_firm = not all(one.kind_only for one in sure)  # not beside a kind that no law follows
        max_departure = thresholds.departure * math.hypot(*(one.member.size for one in sure))
        companions = [one for one in possible if one.member.size > thresholds.tolerable] if is_firm else []
        companions = [one for one in companions if confidence_of(one) > 0.5 or one.member.size > max_departure]
        return tuple(one for one in named if one in sure or one in companions)
    if larger := [one for one in possible if one.member.size > residual_rms]:
        return tuple(capped_at_half(one) for one in larger)
    if best_single is None:
        return ()
    by_itself = (one for one in possible if one.member.effect.kind == best_single.kind)
    return tuple(capped_at_half(one) for one in by_itself if one.member.size > thresholds.tolerable)


def _named(one: Member, residual_rms: float, thresholds: Thresholds) -> Name:
    """The name of one member."""
    kind = probability_of_kind(one, residual_rms, thresholds)
    is_sure = kind >= thresholds.least_confidence
    law_in_place = _law_in_its_place(one)
    if law_in_place is not None and law_in_place.margin <= thresholds.departure**2 * one.likelihood_ratio:
        # The block is how that law departs: its rivals are compared with that law.
        followed = catalogue()[str(law_in_place.effect)]
        # A curve that is alone in its kind has all other curves as rivals.
        kin = _other_laws_of_family(followed) or tuple(str(a.effect) for a in one.laws if a is not law_in_place)
        other_laws = tuple(replace(a, margin=a.margin - law_in_place.margin) for a in one.laws if a.effect in kin)
        as_law = replace(one, laws=other_laws, likelihood_ratio=one.likelihood_ratio - law_in_place.margin)
        return Name(one, followed, kind, *probability_of_law(as_law, thresholds), False, is_sure, law_in_place)
    if not (one.effect.is_flexible or one.is_any_curve):
        law, equivalents = probability_of_law(one, thresholds)
        return Name(one, one.effect, kind, law, equivalents, is_sure=is_sure)
    nearest = _nearest_of_kind(one) if law_in_place is None else catalogue()[str(law_in_place.effect)]
    # The laws fitted in its place are of the family, or for a curve all other curves.
    others = dict.fromkeys((*_other_laws_of_family(nearest), *(str(a.effect) for a in one.laws)))
    others.pop(nearest.name, None)
    # A law that follows less than half of it is no equivalent.
    ruled_out = {a.effect for a in one.laws if thresholds.clear * a.margin > one.likelihood_ratio}
    kin = tuple(name for name in others if name not in ruled_out)
    # One half at most: where all others are ruled out, it may still be a law that the catalogue does not have.
    return Name(one, nearest, kind, 1.0 / (1.0 + max(len(kin), 1)), kin, True, is_sure)


def _with_kin(name: Name) -> Name:
    """The name of members taken together: any of them may be the law, or several."""
    kin = [one for one in name.member.kin if one in catalogue()]
    law = min(name.law_probability, 1.0 / (1.0 + len(kin)))
    return replace(name, law_probability=law, equivalents=tuple(dict.fromkeys((*name.equivalents, *kin))))


def _with_confounded(name: Name, thresholds: Thresholds) -> Name:
    """The name with those confounded laws as equivalents that follow it as well as laws usually do.

    The bound is the square of the usual departure: a law follows what this equation departs by, and departs again
    itself.
    """
    member = name.member
    alike = [one for one in member.confounded if one.margin <= thresholds.departure**4 * member.likelihood_ratio]
    if not alike:
        return name
    others = dict.fromkeys((*name.equivalents, *(str(one.effect) for one in alike)))
    nearest = float(odds_of_law(min(one.margin for one in alike), member.likelihood_ratio, thresholds))
    law = min(name.law_probability, 1.0 / (1.0 + nearest))
    return replace(name, law_probability=law, equivalents=tuple(others))


def _law_in_its_place(one: Member) -> Alternative | None:
    """The law to name a block by: of a generic curve the nearest, of another block `_nearest_of_kind`."""
    if one.is_any_curve:
        return next(iter(one.laws), None)
    if not one.effect.is_flexible:
        return None
    nearest = _nearest_of_kind(one).name
    return next((a for a in one.laws if a.effect == nearest), None)


def _other_laws_of_family(law: Effect) -> tuple[str, ...]:
    """The other laws of a law's family, and those that count as its members.

    Without constant shifts: each recording has an offset of its own, so that what a model adds is none.
    """
    family = (one for one in catalogue().values() if one.kind == law.kind and one.shifts is None)
    return tuple(one.name for one in family if one is not law)


def _nearest_of_kind(block: Member) -> Effect:
    """The nearest law of a block's family, except for curves of the block's own stage.

    An effect that grows with the load borne is none that goes with time alone.
    """
    family = [e for e in catalogue().values() if e.family == block.effect.family]
    alike = [e for e in family if e.stage == block.effect.stage and not block.effect.is_memoryless]
    margins = {a.effect: a.margin for a in block.laws}
    return min(alike or family, key=lambda e: margins.get(e.name, math.inf))


def capped_at_half(name: Name, doubt: str = "") -> Name:
    """The name with a probability of one half at most, and not sure; the first ``doubt`` is kept."""
    return replace(name, kind_probability=min(name.kind_probability, 0.5), is_sure=False, doubt=name.doubt or doubt)


def probability_of_kind(one: Member, residual_rms: float, thresholds: Thresholds) -> float:
    """The probability that an effect of this family is there.

    A logistic of three dimensionless ratios, times the evidence against nothing in its place. The ratios are: what no
    equation follows over the effect's size (the ``residual_rms`` and the departures of the other effects), how far its
    own equation departs, and how alike it is to another effect.
    """
    intercept, per_left, per_departed, per_likeness = thresholds.kind_odds
    residual_rms = math.hypot(residual_rms, one.others_departure_rms)
    ratio = (residual_rms + thresholds.imperfection) / (one.size + thresholds.imperfection)
    score = intercept + per_left * math.log(ratio) + per_departed * one.departure_sds
    score += per_likeness * one.likeness
    nothing = next((a.margin for a in one.alternatives if a.effect is None), math.inf)
    return 1.0 / (1.0 + math.exp(-score)) / (1.0 + math.exp(-max(nothing, 0.0) / 2.0))


def confidence_of(name: Name) -> float:
    """The probability that it is what it is named, or one of its equivalents.

    At most one half where no law of the kind follows, since the law, or the kind, may be one that the catalogue does
    not have.
    """
    return min(name.kind_probability, 0.5) if name.kind_only else name.kind_probability


def probability_of_law(one: Member, thresholds: Thresholds) -> tuple[float, tuple[str, ...]]:
    """The probability of this law against its nearest rival, and the laws that this data cannot rule out."""
    odds = {
        a.effect: float(odds_of_law(a.margin, one.likelihood_ratio, thresholds))
        for a in one.laws
        if a.effect is not None
    }
    equivalents = tuple(name for name, other in odds.items() if other > thresholds.equivalent_odds)
    return 1.0 / (1.0 + max(odds.values(), default=0.0)), equivalents


def odds_of_law(margin: Array | float, likelihood_ratio: float, thresholds: Thresholds) -> Array:
    """Odds of a rival law that fits worse by ``margin``, where the named law brings ``likelihood_ratio``.

    No law is exact: a rival that misses no more than the squared usual departure of what this law explains is as good.
    So the margin is counted in units of that square plus one, the usual gain from noise alone.
    """
    unit = 2.0 * (1.0 + thresholds.departure**2 * max(likelihood_ratio, 0.0))
    return np.exp(-np.maximum(margin, 0.0) / unit)
