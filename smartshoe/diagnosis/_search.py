"""The set of effects with the most evidence in one linearisation: stepwise additions, removals and swaps."""

from __future__ import annotations

from collections.abc import Collection

from smartshoe.arrays import Array
from smartshoe.diagnosis._evidence import Evidence, Members, Posterior

# Resolutions of the search. Half and twice of each changed no name in two cases.
MOST_MEMBERS = 7
BREADTH = 5  # most probable additions that are weighed for a set
SWAPS = 3  # additions that are weighed in the place of each member; also whole-model fits that are pursued
RIVALS = 2  # rivals fitted as whole models beside the best one; also shapes that a fit starts from
SCORE_TOLERANCE = 1e-6  # of -2 log evidence: scores that differ by less are equal


def is_admissible(evidence: Evidence, found: Posterior) -> bool:
    """Whether each strength has a physical sign and the members do not cancel one another.

    Members that are each far larger than their sum fit by their difference, which is neither's effect.
    """
    if sum(size**2 for size in found.sizes) > (evidence.thresholds.clear * found.together) ** 2:
        return False
    return all(has_physical_sign(evidence, m, s) for m, s in zip(found.members, found.strengths, strict=True))


def has_physical_sign(evidence: Evidence, member: int, strengths: Array) -> bool:
    """Whether a candidate's strength has the sign that physics allows.

    Asked only of a candidate with one strength that is not in the model yet: a fit keeps the others within their
    bounds, although the linear estimates of several strengths (k,) may lie beyond.
    """
    one = evidence.linearisation.candidates[member]
    return len(strengths) != 1 or one.name in evidence.linearisation.model.names or one.allows_sign_of(strengths)


def best_additions(
    evidence: Evidence, members: Members, breadth: int = BREADTH, banned: Collection[str] = ()
) -> list[int]:
    """The candidates that lower the score of ``members`` most, at most ``breadth``, each effect at its best shape."""
    taken_slots = {evidence.linearisation.candidates[m].slot for m in members}
    best: dict[str, tuple[float, int]] = {}
    for score, k, strengths in evidence.extensions(members):
        one = evidence.linearisation.candidates[k]
        if one.slot in taken_slots or one.name in banned:
            continue
        if not has_physical_sign(evidence, k, strengths):
            continue
        if one.name not in best or score < best[one.name][0]:
            best[one.name] = (score, k)
    return [k for _, k in sorted(best.values())[:breadth]]


def best_step(evidence: Evidence, start: Members = (), banned: Collection[str] = ()) -> Posterior:
    """The best set that one addition, removal or swap makes of ``start``, or ``start`` itself."""
    best = evidence.posterior(start)
    sets: list[Members] = []
    if len(best.members) < MOST_MEMBERS:
        sets += [(*best.members, k) for k in best_additions(evidence, best.members, BREADTH, banned)]
    for member in best.members:
        without_member = best.without(member)
        sets += [
            without_member,
            *((*without_member, k) for k in best_additions(evidence, without_member, SWAPS, banned)),
        ]
    evidence.prepare_departures({member for members in sets for member in members})
    trials = (evidence.posterior(members) for members in sets)
    return min([best, *(one for one in trials if is_admissible(evidence, one))], key=lambda one: one.score)


def search(evidence: Evidence, start: Members = (), banned: Collection[str] = ()) -> Posterior:
    """The best set that repeated steps reach from ``start``."""
    best = evidence.posterior(start)
    while True:
        found = best_step(evidence, best.members, banned)
        if found.score >= best.score - SCORE_TOLERANCE:
            return best
        best = found


def backward_eliminated(evidence: Evidence, members: Members) -> Members:
    """``members`` after backward elimination: the member whose removal lowers the score most goes, while any does."""
    best = evidence.posterior(members)
    while best.members:
        fewer = (evidence.posterior(best.without(gone)) for gone in best.members)
        less = min(fewer, key=lambda one: one.score)
        if less.score >= best.score:
            break
        best = less
    return best.members
