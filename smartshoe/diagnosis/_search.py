"""The set of effects with the most evidence: forward, with drops and swaps, over one linearisation."""

from __future__ import annotations

from collections.abc import Collection

from smartshoe.arrays import Array
from smartshoe.diagnosis._evidence import Evidence, Members, Posterior

# Resolutions of the search: half and twice of each changed no name in two cases.
MOST_MEMBERS = 7
BREADTH = 5  # of the likeliest, that are weighed beside a set
SWAPS = 3  # that are weighed in the place of each member; and fits of whole models that are gone on with
RIVALS = 2  # that are fitted as whole models beside the best, or shapes from which one is
DEAD_HEAT = 1e-6  # of -2 log evidence: what differs by less is a dead heat


def allowed(evidence: Evidence, found: Posterior) -> bool:
    """Whether every member's strengths lie on the side that physics allows, and no two cancel each other.

    Members that are each far larger than all of them together fit by their difference, which is neither's.
    """
    if sum(size**2 for size in found.sizes) > (evidence.thresholds.clear * found.together) ** 2:
        return False
    return all(has_its_sign(evidence, m, s) for m, s in zip(found.members, found.strengths, strict=True))


def has_its_sign(evidence: Evidence, member: int, strengths: Array) -> bool:
    """Whether the one strength of a candidate lies where physics allows; of what is in the model, its bounds saw to it.

    Of several (k,) the linear estimates may lie beyond: a fit holds them within their bounds.
    """
    one = evidence.given.candidates[member]
    return len(strengths) != 1 or one.name in evidence.given.model.names or one.has_sign_of(strengths)


def additions(evidence: Evidence, members: Members, breadth: int = BREADTH, banned: Collection[str] = ()) -> list[int]:
    """Candidates that promise most beside ``members``, one shape an effect, best first."""
    taken = {evidence.given.candidates[m].slot for m in members}
    best: dict[str, tuple[float, int]] = {}
    for score, k, strengths in evidence.extensions(members):
        one = evidence.given.candidates[k]
        if one.slot in taken or one.name in banned:
            continue
        if not has_its_sign(evidence, k, strengths):
            continue
        if one.name not in best or score < best[one.name][0]:
            best[one.name] = (score, k)
    return [k for _, k in sorted(best.values())[:breadth]]


def step(evidence: Evidence, start: Members = (), banned: Collection[str] = ()) -> Posterior:
    """The best set that one addition, drop or swap makes of ``start``, or ``start`` itself."""
    best = evidence.posterior(start)
    sets: list[Members] = []
    if len(best.members) < MOST_MEMBERS:
        sets += [(*best.members, k) for k in additions(evidence, best.members, BREADTH, banned)]
    for member in best.members:
        less = best.without(member)
        sets += [less, *((*less, k) for k in additions(evidence, less, SWAPS, banned))]
    evidence.make_ready({member for members in sets for member in members})
    trials = (evidence.posterior(members) for members in sets)
    return min([best, *(one for one in trials if allowed(evidence, one))], key=lambda one: one.score)


def search(evidence: Evidence, start: Members = (), banned: Collection[str] = ()) -> Posterior:
    """The best set that forward steps, drops and swaps find from ``start``."""
    best = evidence.posterior(start)
    while True:
        found = step(evidence, best.members, banned)
        if found.score >= best.score - DEAD_HEAT:
            return best
        best = found


def needed(evidence: Evidence, members: Members) -> Members:
    """``members`` without those of which one after the other has less evidence for it than against it."""
    best = evidence.posterior(members)
    while best.members:
        fewer = (evidence.posterior(best.without(gone)) for gone in best.members)
        less = min(fewer, key=lambda one: one.score)
        if less.score >= best.score:
            break
        best = less
    return best.members
