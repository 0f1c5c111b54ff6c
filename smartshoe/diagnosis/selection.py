"""Which effects the data holds: forward selection with drop and swap over full fits of the extended model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.baseline import has_idle_arm
from smartshoe.diagnosis.fitting import MOST_STEPS, QUICK_STEPS, Evidence, Fit, fit
from smartshoe.diagnosis.margins import LATE, LEAST_FALL, Rival, is_better, margin, penalty, visible
from smartshoe.diagnosis.naming import Settled, named, with_companions
from smartshoe.diagnosis.noise import white
from smartshoe.diagnosis.screen import TARE, Board, Screened, Screening, board, dictionary, noise_of, screen
from smartshoe.diagnosis.session import Session
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel, Part

Array = NDArray[np.float64]
Progress = Callable[[str], None]

SLIGHT = 5e-5  # what is significant but moves the reading by less is left alone
BEST_WHITENED, BEST_OF_FAMILY, BEST_RAW = 6, 2, 1
BEST_SWAPS = 3
MOST_PARTS = 6
LITTLE = 0.01  # of the strengths that the screen expects
FIRST_STEPS = 2
CLOSE = 0.1  # of what the best candidate takes off the cost
MOST_MERGED = 4
WORTH_A_MERGER = 0.9
WORTH_A_SWAP = 0.7  # of what an effect takes off: what another must promise by itself to be tried in its place
HALF_MATERIAL = 1e-4
# No equation is exact: what is smaller than this beside another effect may be its error of shape.
LEAST_OF_LARGEST = 0.02
MERGED_SHAPE_ERROR = 0.02
ARM = "second_relaxation"
ARM_SHARE, ARM_RATES_PER_S = 0.08, np.geomspace(0.03, 10.0, 7)
BETTER = 6.0  # of -2 log likelihood, for a swap
SECOND_OF_FAMILY = 0.05  # of what the first one moves the reading by
CANCELLING_OTHERS = 25.0
CANCELLING = 4.0  # times what an addition takes off the error: what it may move the reading by


@dataclass(frozen=True, eq=False)
class Choice:
    """What was chosen: ``rivals`` of each effect in the model, nearest first, and the best fit ``without`` each.

    ``sizes``, of those that are causes: what the reading moves by when one is taken out and the rest is fitted anew.
    ``screening`` is that of the baseline.
    """

    fit: Fit
    baseline: Fit
    evidence: Evidence
    screening: Screening
    rivals: dict[str, tuple[Rival, ...]]
    without: dict[str, Fit]
    sizes: dict[str, float]

    def fall(self, name: str) -> float:
        """How much worse -2 log likelihood is without an effect."""
        return self.without[name].cost - self.fit.cost

    @property
    def causes(self) -> tuple[str, ...]:
        """Effects that move the reading by more than the materiality threshold, largest first."""
        return tuple(sorted(self.sizes, key=lambda name: -self.sizes[name]))


def part_of(model: ExtendedModel, name: str) -> Part:
    """The part that holds an effect."""
    return next(part for part in model.parts if part.name == name)


def choose(
    start: ExtendedModel,
    sessions: Sequence[Session],
    rests: tuple[Array, float],
    kept: frozenset[str],
    material: float,
    progress: Progress,
) -> Choice:
    """Forward selection, with drop and swap after each step, until nothing is left that an effect explains.

    ``kept`` are effects of the ``start`` that are known from elsewhere, and stay.
    """
    evidence = Evidence(sessions, white(1.0), *rests, kept)
    words = dictionary(start, evidence.fitted)
    evidence = replace(evidence, noise=noise_of(words))
    current = _restarted(evidence, fit(evidence, start))
    screening: Screening | None = None
    seen: set[frozenset[str]] = set()
    while True:
        words = dictionary(current.model, evidence.fitted)
        evidence = replace(evidence, noise=noise_of(words))
        current = fit(evidence, current.model)
        looked = screen(words, evidence.noise, evidence.rests(current.model))
        screening = screening or looked
        if len(current.model.parts) >= MOST_PARTS:
            break
        added = _added(evidence, current, looked, progress)
        if added is None:
            break
        current = _settled(evidence, added, seen, progress).fit
        names = frozenset(current.model.names)
        if names in seen:  # it goes in circles: what is here is as good as what was before
            break
        seen.add(names)
    settled = _settled(evidence, current, set(), progress)
    return _concluded(evidence, settled, fit(evidence, replace(start, parts=())), screening, material)


def _added(evidence: Evidence, current: Fit, looked: Screening, progress: Progress) -> Fit | None:
    tried = _raced(evidence, current, _worth_trying(looked))
    if not tried:
        return None
    first = min(tried, key=lambda one: one.cost)
    tried.sort(key=lambda one: margin(evidence, one, first, current) if one is not first else 0.0)
    for attempt in tried:
        name = attempt.model.names[-1]
        why = _refusal(evidence, current, attempt)
        progress(f"  {name}: -2 log L falls by {current.cost - attempt.cost:.1f}{', ' + why if why else ''}")
        if why is None:
            progress(f"added {name}")
            return _restarted(evidence, fit(evidence, attempt.model))
    return None


def _restarted(evidence: Evidence, current: Fit) -> Fit:
    """The fit with its baseline's arm begun anew over a grid, where it had come to stand for something else."""
    if not has_idle_arm(current.model):
        return current
    begun = [
        fit(evidence, replace(current.model, relaxing_share=ARM_SHARE, relaxation_rate_per_s=float(rate)), FIRST_STEPS)
        for rate in ARM_RATES_PER_S
    ]
    again = fit(evidence, min(begun, key=lambda one: one.cost).model)
    return again if again.cost < current.cost else current


def _worth_trying(looked: Screening) -> list[Screened]:
    white: list[Screened] = []
    families: dict[str, int] = {}
    for one in looked.ranked:
        # To a screen a lag and a delay are one.
        family = "late" if one.candidate.effect.name in LATE else one.candidate.effect.family
        if one.fall > LEAST_FALL / 2 and len(white) < BEST_WHITENED and families.get(family, 0) < BEST_OF_FAMILY:
            white.append(one)
            families[family] = families.get(family, 0) + 1
    raw = sorted(looked.ranked, key=lambda one: -one.raw_share)[:BEST_RAW]
    return [*white, *(one for one in raw if one not in white and one.raw_share > 0)]


def _raced(evidence: Evidence, current: Fit, candidates: Sequence[Screened]) -> list[Fit]:
    """Fits with one more effect each: all begun, and the ones that may still win carried to their end."""
    begun = []
    for one in candidates:
        added = one.candidate.effect
        attempt = fit(evidence, current.model.with_part(added, one.candidate.start(one.strengths)), FIRST_STEPS)
        if attempt.cost > current.cost:  # the screen's linear estimate led astray: from next to nothing then
            little = current.model.with_part(added, one.candidate.start(LITTLE * one.strengths))
            attempt = min(attempt, fit(evidence, little, MOST_STEPS), key=lambda other: other.cost)
        begun.append(attempt)
    if not begun:
        return []
    best = min(one.cost for one in begun)
    close = best + CLOSE * max(current.cost - best, 0.0) + LEAST_FALL
    return [one if one.cost > close else fit(evidence, one.model, QUICK_STEPS) for one in begun]


def _refusal(evidence: Evidence, current: Fit, attempt: Fit) -> str | None:
    fall = current.cost - attempt.cost
    if fall < penalty(attempt.model.names[-1]):
        return "too little"
    if attempt.model.names[-1] == TARE:  # told by the rests: an offset hides it from everything else
        return None
    size = visible(evidence, attempt.model, current.model)
    if size < SLIGHT:
        return f"slight ({100 * size:.3f} % of full scale)"
    if evidence.held_out_cost(attempt.model) >= evidence.held_out_cost(current.model):
        return "no gain on held-out data"
    added = attempt.model.parts[-1]
    alone = visible(evidence, attempt.model, attempt.model.without(added.name))
    related = [name for name in current.model.names if effect(name).family == added.effect.family]
    if any(size < SECOND_OF_FAMILY * visible(evidence, current.model, current.model.without(n)) for n in related):
        return "one of its family is there, of which it may be the error of shape"
    if alone > (CANCELLING if related else CANCELLING_OTHERS) * size:
        return "it mostly cancels what is there"
    return None


def _settled(evidence: Evidence, current: Fit, seen: set[frozenset[str]], progress: Progress) -> Settled:
    """Drop what has become needless; swap what another effect does better, for a set that was not ``seen`` before.

    Ends at the best of the sets that it came by: a swap that fits better may lead nowhere.
    """
    tried = set(seen)
    best: Settled | None = None
    merged: str | None = None
    while True:
        without = {name: _fit_without(evidence, current.model, name) for name in current.model.names}
        sizes = {name: visible(evidence, less.model, current.model) for name, less in without.items()}
        name = _needless(evidence, current, without, sizes)
        if name is not None and name == merged and best is not None:
            return best  # the merger was no gain
        if name is not None:
            progress(f"dropped {name}")
            current = without[name]
            continue
        tried.add(frozenset(current.model.names))
        words = _board(evidence, current, without)
        rivals = {name: tuple(_swaps(evidence, current, less, words, name)) for name, less in without.items()}
        here = Settled(current, without, sizes, rivals)
        if best is None or merged is not None or is_better(evidence, current, best.fit):
            best, merged = here, None
        following = _better(evidence, here, tried)
        if following is None:
            one = _merged(evidence, current, without, words, tried)
            if one is None:
                return best
            following, merged = one, one.model.names[-1]
        gone = " and ".join(sorted(set(current.model.names) - set(following.model.names)))
        progress(
            f"{'merged' if merged else 'swapped'} {gone} {'into' if merged else 'for'} {following.model.names[-1]}"
        )
        current = fit(evidence, following.model)


def _fit_without(evidence: Evidence, model: ExtendedModel, name: str) -> Fit:
    """The best fit without an effect; a relaxation may have taken the place of the baseline's own arm."""
    less = fit(evidence, model.without(name), QUICK_STEPS)
    if name != ARM:
        return less
    share, time_constant_s = (float(value) for value in part_of(model, name).values[:2])
    arm = replace(model.without(name), relaxing_share=share, relaxation_rate_per_s=1.0 / time_constant_s)
    return min(less, fit(evidence, arm, QUICK_STEPS), key=lambda one: one.cost)


def _better(evidence: Evidence, here: Settled, tried: set[frozenset[str]]) -> Fit | None:
    """The swap that gains most, to a set that was not tried and of which the newcomer would not be dropped again."""
    found = [
        (rival.margin, rival.fit, here.without[name])
        for name, rivals in here.rivals.items()
        for rival in rivals
        if rival.fit is not None
        and rival.margin < (0.0 if {name, rival.effect} == LATE else -BETTER)
        and frozenset(rival.fit.model.names) not in tried
        # What was found before any fit may only turn into its like.
        if name not in evidence.kept or effect(rival.effect).family == effect(name).family
    ]
    for _, one, less in sorted(found, key=lambda entry: entry[0]):
        gains = evidence.held_out_square(one.model) < evidence.held_out_square(less.model)
        if gains and visible(evidence, one.model, less.model) >= HALF_MATERIAL:
            return one
        tried.add(frozenset(one.model.names))
    return None


def _merged(
    evidence: Evidence, current: Fit, without: dict[str, Fit], words: Board, tried: set[frozenset[str]]
) -> Fit | None:
    """One effect in the place of two, where it does as well: two that lean on each other may have come in by turns."""
    names = sorted(set(without) - evidence.kept, key=lambda one: without[one].cost)[:MOST_MERGED]
    for pair in combinations(names, 2):
        looked = words.screen(pair)
        worth = [one for one in _newcomers(looked, current, pair) if one.fall >= WORTH_A_MERGER * looked.total]
        if not worth:
            continue
        rest = current.model.without(pair[0]).without(pair[1])
        less = fit(evidence, rest, QUICK_STEPS)
        whole = less.cost - current.cost
        saved = penalty(pair[0]) + penalty(pair[1]) + MERGED_SHAPE_ERROR**2 * whole
        for one in _raced(evidence, replace(less, model=rest), worth[:BEST_SWAPS]):
            worse = one.cost - current.cost + penalty(one.model.names[-1])
            if worse < saved and frozenset(one.model.names) not in tried:
                return one
    return None


def _board(evidence: Evidence, current: Fit, without: dict[str, Fit]) -> Board:
    """The screen's inner products, with what each part adds to the reading (everything else fitted anew)."""
    shares = {
        name: [
            current.model.simulate(session.conditions) - less.model.simulate(session.conditions)
            for session in evidence.fitted
        ]
        for name, less in without.items()
    }
    rests = evidence.rests(current.model, {name: less.model for name, less in without.items()})
    return board(dictionary(current.model, evidence.fitted), evidence.noise, shares, rests)


def _newcomers(looked: Screening, current: Fit, gone: Sequence[str]) -> list[Screened]:
    """Candidates in the place of ``gone``: one member a family, beside those that stay."""
    families = {effect(name).family for name in current.model.names if name not in gone}
    return [
        one
        for one in looked.ranked
        if one.fall > 0 and one.candidate.effect.name not in gone and one.candidate.effect.family not in families
    ]


def _needless(evidence: Evidence, current: Fit, without: dict[str, Fit], sizes: dict[str, float]) -> str | None:
    """The effect that is missed least, if too little: by the likelihood, or by what the reading moves."""
    judged = evidence.held_out_square(current.model)
    missed = {
        name: less.cost - current.cost
        for name, less in without.items()
        if name not in evidence.kept
        and (
            less.cost - current.cost < penalty(name)
            or (name != TARE and sizes[name] < _least_size(name, sizes))
            or (name != TARE and evidence.held_out_square(less.model) <= judged)
        )
    }
    return min(missed, key=lambda name: missed[name] - penalty(name)) if missed else None


def _least_size(name: str, sizes: dict[str, float]) -> float:
    """Timing is kept even where it is slight: the baseline absorbs most of it, and other effects would imitate it."""
    if effect(name).family == "timing":
        return SLIGHT
    return max(HALF_MATERIAL, LEAST_OF_LARGEST * max(sizes.values()))


def _swaps(evidence: Evidence, current: Fit, less: Fit, words: Board, name: str) -> list[Rival]:
    """Other effects in the place of ``name`` and how much worse each is, nearest first; ``less``: the fit without."""
    looked = words.screen((name,))
    others = _newcomers(looked, current, (name,))
    whole = less.cost - current.cost
    near = [one for one in others if one.fall >= WORTH_A_SWAP * looked.total][:BEST_SWAPS]
    # Everything else is where it was: fitted anew it would have moved to take the missing effect's place.
    rest = current.model.without(name)
    raced = _raced(evidence, replace(less, model=rest), near)
    part = part_of(current.model, name)
    own = replace(current, model=rest.with_part(part.effect, part.values))
    rivals = [Rival(one.model.names[-1], float(margin(evidence, one, own, less)), one) for one in raced]
    rivals.sort(key=lambda rival: rival.margin)
    far = [one for one in others[:BEST_SWAPS] if one not in near]
    return rivals + [
        Rival(one.candidate.effect.name, float(whole * (1.0 - one.fall / max(looked.total, 1e-9))), None) for one in far
    ]


def _concluded(evidence: Evidence, settled: Settled, baseline: Fit, screening: Screening, material: float) -> Choice:
    settled = with_companions(evidence, settled)
    sizes = named(evidence, settled, material)
    return Choice(settled.fit, baseline, evidence, screening, settled.rivals, settled.without, sizes)
