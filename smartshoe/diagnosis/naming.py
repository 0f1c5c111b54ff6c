"""Which effects of a settled model are named: not what is too small, nor what may be another's error of shape."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from smartshoe.diagnosis.fitting import QUICK_STEPS, Evidence, Fit, fit
from smartshoe.diagnosis.margins import Rival, visible
from smartshoe.diagnosis.screen import TARE
from smartshoe.models.effects import effect

MATERIAL = 2e-4  # of the full-scale reading: what an effect must move the reading by to be a cause
NEIGHBOURING = (
    frozenset({"hysteresis", "asymmetry", "rate"}),
    frozenset({"softening", "gain_drift"}),
    frozenset({"relaxation", "gas_heat", "timing"}),
    frozenset({"rate", "asymmetry", "hysteresis", "timing"}),
    frozenset({"leak", "zero"}),
    frozenset({"static_curve", "dead_band", "saturation"}),
)
SHAPE_OF_NEIGHBOUR = 0.1
LIKE_NO_OTHER = 0.5  # of what an effect takes off: what every other must fall short by
NAMED_OF_LARGEST = 0.05


@dataclass(frozen=True, eq=False)
class Settled:
    """A fit of which no part is needless and none is better replaced; the fits without each part, and the rivals.

    ``sizes``: what the reading moves by without each part, the rest fitted anew.
    """

    fit: Fit
    without: dict[str, Fit]
    sizes: dict[str, float]
    rivals: dict[str, tuple[Rival, ...]]


def named(evidence: Evidence, settled: Settled, material: float) -> dict[str, float]:
    """The sizes of the effects that are causes; ``settled`` as `with_companions` leaves it."""
    sizes = settled.sizes
    # What is known from elsewhere leaves no error of shape behind.
    fitted = {name: size for name, size in sizes.items() if name not in evidence.kept}
    least = max(material, NAMED_OF_LARGEST * max(fitted.values(), default=0.0))
    return {
        name: size
        for name, size in sizes.items()
        if size >= least
        and (name in evidence.kept or not _is_shape_error(name, fitted) or _is_like_no_other(name, settled))
    }


def _neighbours(name: str, names: Iterable[str]) -> list[str]:
    """Those of ``names`` whose equation, a little wrong, leaves behind what looks like the effect ``name``."""
    family = effect(name).family
    like = {one for group in NEIGHBOURING if family in group for one in group}
    return [other for other in names if other != name and effect(other).family in like]


def _is_shape_error(name: str, sizes: dict[str, float]) -> bool:
    """Whether an effect is small beside one whose error of shape it may be."""
    near = [sizes[other] for other in _neighbours(name, sizes)]
    return bool(near) and sizes[name] < SHAPE_OF_NEIGHBOUR * max(near)


def _is_like_no_other(name: str, settled: Settled) -> bool:
    """Whether no effect of another family takes off as much as half of what this one does.

    An error of shape is followed by one curve about as well as by another; or by two of one family, one against the
    other.
    """
    if any(effect(other).family == effect(name).family for other in settled.sizes if other != name):
        return False
    fall = settled.without[name].cost - settled.fit.cost
    others = [one.margin for one in settled.rivals[name] if effect(one.effect).family != effect(name).family]
    return min(others, default=fall) > LIKE_NO_OTHER * fall


def with_companions(evidence: Evidence, settled: Settled) -> Settled:
    """The sizes anew where a small effect is the error of shape of a large one: both are taken out for the large one's.

    With the large one alone taken out, the small one would grow into its place, and hide how large it is. So would
    an offset in the place of a tare, which only the rests tell from it: there all but the baseline stays as it is.
    """
    without, sizes, whole = dict(settled.without), dict(settled.sizes), settled.fit
    if "zero_offset" in sizes and TARE in sizes:
        without[TARE] = fit(evidence, whole.model.without(TARE), QUICK_STEPS, still=whole.model.names)
        sizes[TARE] = visible(evidence, without[TARE].model, whole.model)
    for name in sorted(sizes, key=lambda one: -settled.without[one].cost):
        for other in _neighbours(name, sizes):
            if settled.without[other].cost >= settled.without[name].cost:
                continue
            less = fit(evidence, settled.without[name].model.without(other), QUICK_STEPS)
            size = visible(evidence, less.model, whole.model)
            if settled.sizes[other] < SHAPE_OF_NEIGHBOUR * size and size > sizes[name]:
                without[name], sizes[name] = less, size
    return replace(settled, without=without, sizes=sizes)
