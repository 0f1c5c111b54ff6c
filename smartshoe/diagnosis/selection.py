"""Which effects the data holds: forward selection with drop and swap over full fits of the extended model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.fitting import Evidence, Fit, fit
from smartshoe.diagnosis.screen import Screened, Screening, dictionary, noise_of, screen
from smartshoe.diagnosis.session import Session
from smartshoe.models.effects import catalogue, effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]
Progress = Callable[[str], None]

MATERIAL = 2e-4  # of the full-scale reading: what an effect must move the reading by to be a cause
SLIGHT = 5e-5  # what is significant but moves the reading by less is left alone
LEAST_FALL = 30.0  # of -2 log likelihood for an effect with one parameter
FALL_A_PARAMETER = 8.0
BEST_WHITENED, BEST_RAW = 4, 1
BEST_SWAPS = 3
MOST_PARTS = 6
QUICK_STEPS = 8
HALF_MATERIAL = 1e-4
LEAST_OF_LARGEST = 0.02  # no equation is exact: what is smaller than this beside another effect may be its error of shape
BETTER = 10.0  # of -2 log likelihood, for a swap
CANCELLING = 4.0  # times what an addition takes off the error: what it may move the reading by


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect in the place of a cause: ``margin`` is by how much -2 log likelihood is worse, penalty included."""

    effect: str
    margin: float
    fit: Fit


@dataclass(frozen=True, eq=False)
class Choice:
    """What was chosen. ``parts`` are all effects in the model; ``rivals`` of each, nearest first.

    ``without``: the best fit without each effect; ``sizes``: what the reading moves by when it is taken out and the
    rest is fitted anew. ``screening`` is that of the baseline.
    """

    fit: Fit
    baseline: Fit
    evidence: Evidence
    screening: Screening
    rivals: dict[str, tuple[Rival, ...]]
    without: dict[str, Fit]
    sizes: dict[str, float]
    falls: dict[str, float]

    @property
    def causes(self) -> tuple[str, ...]:
        """Effects that move the reading by more than the materiality threshold, largest first."""
        return tuple(sorted(self.sizes, key=lambda name: -self.sizes[name]))


def visible(evidence: Evidence, one: ExtendedModel, other: ExtendedModel) -> float:
    """Root mean square of the difference of two simulations over usable samples, share of full scale."""
    total, count = 0.0, 0
    for session in evidence.sessions:
        moved = (one.simulate(session.conditions) - other.simulate(session.conditions))[session.usable]
        total += float(moved @ moved)
        count += moved.size
    return float(np.sqrt(total / max(count, 1)))


def held_out_cost(evidence: Evidence, model: ExtendedModel) -> float:
    """Whitened squares over what was held out."""
    total = 0.0
    for session, residual in zip(evidence.sessions, evidence.residuals(model), strict=True):
        white = evidence.noise.whitened(residual)[evidence.noise.counted(session.judged)]
        total += float(white @ white)
    return total


def standing(evidence: Evidence, found: Fit) -> float:
    """What models with as many effects are compared by: the fit, and what the displacement says."""
    return found.cost + evidence.displacement_cost(found.model)


def held_out_square(evidence: Evidence, model: ExtendedModel) -> float:
    """Mean squared error over what was held out, as it is."""
    total, count = 0.0, 0
    for session, residual in zip(evidence.sessions, evidence.residuals(model), strict=True):
        left = residual[session.judged]
        total += float(left @ left)
        count += left.size
    return total / max(count, 1)


def penalty(name: str) -> float:
    """What -2 log likelihood must fall by for an effect to be taken in."""
    return LEAST_FALL + FALL_A_PARAMETER * (len(catalogue()[name].parameters) - 1)


def choose(
    start: ExtendedModel, sessions: Sequence[Session], rests: tuple[Array, float], material: float, progress: Progress
) -> Choice:
    """Forward selection, with drop and swap after each step, until nothing is left that an effect explains."""
    words = dictionary(start, sessions)
    evidence = Evidence(sessions, noise_of(words), *rests)
    current = fit(evidence, start)
    baseline = current.model
    screening: Screening | None = None
    seen: set[frozenset[str]] = {frozenset()}
    while True:
        words = dictionary(current.model, sessions)
        evidence = replace(evidence, noise=noise_of(words))
        current = fit(evidence, current.model)
        looked = screen(words, evidence.noise)
        screening = screening or looked
        if len(current.model.parts) >= MOST_PARTS:
            break
        added = _added(evidence, current, looked, progress)
        if added is None:
            break
        current = _settled(evidence, added, progress)
        names = frozenset(current.model.names)
        if names in seen:  # it goes in circles: what is here is as good as what was before
            break
        seen.add(names)
    return _concluded(evidence, current, baseline, screening, material, progress)


def _added(evidence: Evidence, current: Fit, looked: Screening, progress: Progress) -> Fit | None:
    tried = [_tried(evidence, current.model, one) for one in _worth_trying(looked)]
    tried.sort(key=lambda one: standing(evidence, one) + penalty(one.model.names[-1]))
    for attempt in tried:
        name = attempt.model.names[-1]
        why = _refusal(evidence, current, attempt)
        progress(f"  {name}: -2 log L falls by {current.cost - attempt.cost:.1f}{', ' + why if why else ''}")
        if why is None:
            progress(f"added {name}")
            return fit(evidence, attempt.model)
    return None


def _worth_trying(looked: Screening) -> list[Screened]:
    white = [one for one in looked.ranked if one.fall > LEAST_FALL / 2][:BEST_WHITENED]
    raw = sorted(looked.ranked, key=lambda one: -one.raw_share)[:BEST_RAW]
    return [*white, *(one for one in raw if one not in white and one.raw_share > 0)]


def _tried(evidence: Evidence, model: ExtendedModel, one: Screened) -> Fit:
    added = one.candidate.effect
    return fit(evidence, model.with_part(added, one.candidate.start(one.strengths)), QUICK_STEPS)


def _refusal(evidence: Evidence, current: Fit, attempt: Fit) -> str | None:
    fall = current.cost - attempt.cost
    if fall < penalty(attempt.model.names[-1]):
        return "too little"
    size = visible(evidence, attempt.model, current.model)
    if size < SLIGHT:
        return f"slight ({100 * size:.3f} % of full scale)"
    if held_out_cost(evidence, attempt.model) >= held_out_cost(evidence, current.model):
        return "no gain on held-out data"
    added = attempt.model.parts[-1]
    alone = visible(evidence, attempt.model, _nulled(attempt.model, added.name))
    if alone > CANCELLING * size and any(effect(one).family == added.effect.family for one in current.model.names):
        return "it only cancels one of its family"
    return None


def _nulled(model: ExtendedModel, name: str) -> ExtendedModel:
    """The model with one effect taken out and everything else as it is."""
    return model.without(name)


def _settled(evidence: Evidence, current: Fit, progress: Progress) -> Fit:
    """Drop what has become needless; swap what another effect does better."""
    while len(current.model.parts) > 1:
        without = {name: fit(evidence, current.model.without(name), QUICK_STEPS) for name in current.model.names}
        name = _needless(evidence, current, without)
        if name is None:
            break
        progress(f"dropped {name}")
        current = without[name]
    if len(current.model.parts) > 1:
        for name in current.model.names[:-1]:
            better = _best_swap(evidence, current, fit(evidence, current.model.without(name), QUICK_STEPS), name)
            if better and better[0][1] < -BETTER:
                current = fit(evidence, better[0][0].model)
                progress(f"swapped {name} for {current.model.names[-1]}")
    return current


def _needless(evidence: Evidence, current: Fit, without: dict[str, Fit]) -> str | None:
    """The effect that is missed least, where it is not missed enough: by the likelihood, or by what the reading moves."""
    sizes = {name: visible(evidence, less.model, current.model) for name, less in without.items()}
    judged = held_out_square(evidence, current.model)
    missed = {
        name: less.cost - current.cost
        for name, less in without.items()
        if less.cost - current.cost < penalty(name)
        or sizes[name] < _least_size(name, sizes)
        or held_out_square(evidence, less.model) <= judged
    }
    return min(missed, key=lambda name: missed[name] - penalty(name)) if missed else None


def _least_size(name: str, sizes: dict[str, float]) -> float:
    """Timing is kept even where it is slight: the baseline absorbs most of it, and other effects would imitate it."""
    if effect(name).family == "timing":
        return SLIGHT
    return max(HALF_MATERIAL, LEAST_OF_LARGEST * max(sizes.values()))


def _best_swap(evidence: Evidence, current: Fit, less: Fit, name: str) -> list[tuple[Fit, float]]:
    """Fits with another effect in the place of ``name``, and how much worse each is, nearest first."""
    looked = screen(dictionary(less.model, evidence.sessions), evidence.noise)
    others = [one for one in looked.ranked if one.candidate.effect.name != name and one.fall > 0]
    tried = [_tried(evidence, less.model, one) for one in others[:BEST_SWAPS]]
    own = standing(evidence, current) + penalty(name)
    margins = [standing(evidence, one) + penalty(one.model.names[-1]) - own for one in tried]
    return sorted(zip(tried, margins, strict=True), key=lambda pair: pair[1])


def _concluded(
    evidence: Evidence, current: Fit, baseline: ExtendedModel, screening: Screening, material: float, progress: Progress
) -> Choice:
    while True:
        without = {name: fit(evidence, current.model.without(name)) for name in current.model.names}
        sizes = {name: visible(evidence, less.model, current.model) for name, less in without.items()}
        name = _needless(evidence, current, without)
        if name is None:
            break
        progress(f"dropped {name}")
        current = without[name]
    rivals = {}
    for name, less in without.items():
        found = _best_swap(evidence, current, less, name)
        if found and found[0][1] < -BETTER:
            progress(f"swapped {name} for {found[0][0].model.names[-1]}")
            return _concluded(evidence, fit(evidence, found[0][0].model), baseline, screening, material, progress)
        rivals[name] = tuple(Rival(one.model.names[-1], float(margin), one) for one, margin in found)
    named = {name: size for name, size in sizes.items() if size >= material}
    falls = {name: less.cost - current.cost for name, less in without.items()}
    return Choice(current, fit(evidence, baseline), evidence, screening, rivals, without, named, falls)
