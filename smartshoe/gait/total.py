"""The whole force: a foot's above its floor, both feet's on one time base, and the body weight that it gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait.contact import Contacts
from smartshoe.gait.strides import MOST_MISSING, Stride
from smartshoe.gait.trial import Foot

if TYPE_CHECKING:
    from smartshoe.gait.result import FootCourse

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ONE_SHOE_SHARE_SD = 0.05  # of body weight: what one foot may bear more than half
LEAST_STANDING_S = 2.0
SETTLED_S = 0.5
SWAY_S = 2.0  # stretches of a stance whose means count as independent
WIDE_SD = 0.05  # of the force, where a single stride or stretch shows no spread


@dataclass(frozen=True, slots=True)
class BodyWeight:
    """Body weight in N with its sd; ``source`` is "given", "strides", "standing" or "one_shoe"."""

    value: float
    sd: float
    source: str


@dataclass(frozen=True, slots=True)
class StandingForce:
    """The mean total of standing in N, its sd by its own wander, and how long it was seen in s."""

    mean_n: float
    sd_n: float
    length_s: float


def above_floor(foot: Foot, contacts: Contacts) -> Array:
    """Loads (n, r) above what each unit reads in swing, straight lines between one swing's floor and the next.

    Where no swing was seen the loads are taken as they are.
    """
    load = foot.load
    if contacts.floor_time_s.size == 0:
        return load
    for column in range(load.shape[1]):
        load[:, column] -= np.interp(foot.time_s, contacts.floor_time_s, contacts.floor[:, column])
    return load


def total_of(feet: Mapping[str, Foot], forces: Mapping[str, Array]) -> tuple[Array, Array]:
    """Times (n,) of the first foot that all feet share, and the sum (n,) of the feet's forces there."""
    first = next(iter(feet))
    time_s = feet[first].time_s
    begin = max(foot.time_s[0] for foot in feet.values())
    end = min(foot.time_s[-1] for foot in feet.values())
    keep = (time_s >= begin) & (time_s <= end)
    time_s = time_s[keep]
    total = np.zeros(time_s.size)
    for name, foot in feet.items():
        total += forces[name][keep] if name == first else np.interp(time_s, foot.time_s, forces[name])
    return time_s, total


def standing_spans(
    feet: Mapping[str, Foot], contacts: Mapping[str, Contacts], loaded: Mapping[str, bool]
) -> list[tuple[float, float]]:
    """Begin and end in s of the stretches in which every foot stays down for 2 s or more."""
    spans: list[tuple[float, float]] | None = None
    for name, foot in feet.items():
        own = [
            (
                float(strike if np.isfinite(strike) else foot.time_s[0]),
                float(off if np.isfinite(off) else foot.time_s[-1]),
            )
            for strike, off in zip(contacts[name].strike_s, contacts[name].toe_off_s, strict=True)
        ]
        if not own and not loaded[name]:
            continue  # a foot that bears nothing takes no part: standing on the other leg
        if not own:
            own = [(float(foot.time_s[0]), float(foot.time_s[-1]))]
        own = [span for span in own if span[1] - span[0] >= LEAST_STANDING_S]
        spans = own if spans is None else _shared(spans, own)
    return [span for span in spans or [] if span[1] - span[0] >= LEAST_STANDING_S]


def _shared(first: Sequence[tuple[float, float]], second: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    both = [(max(a, c), min(b, d)) for a, b in first for c, d in second if min(b, d) > max(a, c)]
    return sorted(both)


def whole_strides(time_s: Array, missing: Mask, strides: Sequence[Stride]) -> list[Stride]:
    """Those within ``time_s`` (n,) during which neither foot misses more than `MOST_MISSING` of its samples.

    ``missing`` (n,) is either foot's: while one lacks a unit the total is too small, whichever foot steps.
    """
    gone = np.concatenate([[0.0], np.cumsum(missing)])
    places = np.arange(gone.size)

    def lost(stride: Stride) -> float:
        first, last = np.interp(np.searchsorted(time_s, [stride.start_s, stride.end_s]), places, gone)
        return float(last - first)

    step = (time_s[-1] - time_s[0]) / max(time_s.size - 1, 1)
    return [
        s
        for s in strides
        if s.start_s >= time_s[0]
        and s.end_s <= time_s[-1]
        and not s.gap
        and lost(s) * step <= MOST_MISSING * (s.end_s - s.start_s)
    ]


def stride_means(time_s: Array, total_n: Array, missing: Mask, strides: Sequence[Stride]) -> tuple[Array, Array]:
    """Mean (m,) of the total over each of the `whole_strides`, and its duration (m,)."""
    step = (time_s[-1] - time_s[0]) / max(time_s.size - 1, 1)
    gathered = np.concatenate([[0.0], np.cumsum(0.5 * (total_n[1:] + total_n[:-1])) * step])
    whole = whole_strides(time_s, missing, strides)
    start, end = np.array([s.start_s for s in whole]), np.array([s.end_s for s in whole])
    if not whole:
        return np.zeros(0), np.zeros(0)
    impulse = np.interp(end, time_s, gathered) - np.interp(start, time_s, gathered)
    return impulse / (end - start), end - start


def standing_mean(
    time_s: Array, total_n: Array, missing: Mask, spans: Sequence[tuple[float, float]]
) -> StandingForce | None:
    """The total over the standing stretches, half a second left out at either end; None where nothing is left."""
    kept = np.zeros(time_s.size, dtype=bool)
    for start, end in spans:
        kept |= (time_s >= start + SETTLED_S) & (time_s <= end - SETTLED_S)
    kept &= ~missing
    if not kept.any():
        return None
    step = float(time_s[1] - time_s[0])
    kept_n = total_n[kept]
    mean_n, length_s = float(kept_n.mean()), kept_n.size * step
    size = max(1, round(SWAY_S / step))
    blocks = kept_n[: kept_n.size // size * size].reshape(-1, size).mean(axis=1)
    sd_n = float(blocks.std(ddof=1) / np.sqrt(blocks.size)) if blocks.size > 1 else WIDE_SD * mean_n
    return StandingForce(mean_n, sd_n, length_s)


def body_weight_of(
    feet: Mapping[str, Foot],
    courses: Mapping[str, FootCourse],
    stride_n: Array,
    stride_s: Array,
    standing: StandingForce | None,
    given_n: float | None,
    coverage: float,
) -> BodyWeight | None:
    """Body weight: as given, or the mean total over whole strides, or standing, whichever lasts longer.

    Over whole strides the body neither gains nor loses vertical momentum, so the mean total is its weight. The sd
    holds the spread of strides, the gains' sd and the floors'; with one shoe twice its mean, and what that assumes.
    """
    if given_n is not None:
        return BodyWeight(given_n, 0.0, "given")
    moving_s = float(stride_s.sum())
    if moving_s == 0.0 and standing is None:
        return None
    if standing is not None and standing.length_s >= moving_s:
        value, spread, source = standing.mean_n, standing.sd_n, "standing"
    else:
        value = float(np.average(stride_n, weights=stride_s))
        spread = float(stride_n.std(ddof=1) / np.sqrt(stride_n.size)) if stride_n.size > 1 else WIDE_SD * value
        source = "strides"
    variance = spread**2
    for name, foot in feet.items():
        course = courses[name]
        mean_n = course.load.mean(axis=0) / coverage
        variance += float(np.sum((np.array([unit.gain_sd for unit in foot.units]) * mean_n) ** 2))
        variance += _floor_variance(course) / coverage**2
    if len(feet) == 1:
        value, variance = 2.0 * value, 4.0 * (variance + (ONE_SHOE_SHARE_SD * value) ** 2)
        source = "one_shoe"
    return BodyWeight(float(value), float(np.sqrt(variance)), source)


def _floor_variance(course: FootCourse) -> float:
    """Variance in N^2 of a foot's mean floor: how much the floors of one swing's two ends differ, over all swings."""
    floor = course.contacts.floor.sum(axis=1)
    if floor.size < 4:
        return 0.0
    return float(np.var(np.diff(floor)) / 2.0 / floor.size)


def rmse_of(feet: Mapping[str, Foot], courses: Mapping[str, FootCourse], coverage: float) -> float | None:
    """The error in N to expect of the whole force.

    It is what the feet read in swing, where the true force is zero, and the gains' sd over the load they bear.
    None where no swing was seen. What a load leaves behind in a unit while it lasts is in neither.
    """
    variance = 0.0
    for name, foot in feet.items():
        course = courses[name]
        swing = (course.state == 0) & ~course.missing
        if course.contacts.floor_time_s.size == 0 or not swing.any():
            return None
        variance += float(np.mean(course.load[swing].sum(axis=1) ** 2))
        gain = np.array([unit.gain_sd for unit in foot.units])
        variance += float(np.sum(gain**2 * np.mean(course.load**2, axis=0)))
    return float(np.sqrt(variance)) / coverage
