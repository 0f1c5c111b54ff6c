"""Edges of contact in a window of a foot's loads: heel strikes, toe offs, and the onset and release of each unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.gait._crossing import USUAL_POWER, bent_places, growth, level_places, rise_places, running_median
from smartshoe.gait._swing import Cut

BEARS = 0.02  # of body weight: above it a foot or a unit bears load; force plates are read at 10 to 20 N
UNIT_LEVEL = 0.06  # of a unit's own median peak: its lowest level
MOST_LEVEL = 0.12  # of the median peak: upper limit of the lowest level
LONGEST_SWING_S = 1.0  # in a longer swing the foot rests, and its mean load does not measure body weight
WALKING_STANCE_S = 0.4  # a runner's is shorter
RUNNING_PEAK = 2.5  # body weights; Munro et al. 1987 (J. Biomech. 20, 147-155): 2.5 at 3 m/s, 2.8 at 5 m/s
TOP = 5.0  # times the lowest level: above it the foot is certainly loaded
NOISES = 5.0
BEFORE_S, AFTER_S = 0.15, 0.15
UNIT_BEFORE_S, UNIT_AFTER_S = 0.08, 1.2
PEAKS = 5  # number of contacts over whose median peak a level is set
EARLY, LATE = (0.2, 0.5), (0.5, 0.85)  # of a swing (its first or last second at most): where its floor is read
LONGEST_FLOOR_S = 1.0
TINY = 1e-6  # of a sample: tolerance for the rounding of the rate


@dataclass(frozen=True, eq=False)
class Floors:
    """Mean loads (k, r) read in swings centred at ``place`` (k,) in samples: the drifting zero of each unit."""

    place: Array
    load: Array


@dataclass(frozen=True, eq=False)
class Edges:
    """Starts and ends of contact in order: approximate and exact place (k,) in samples, each unit's place (k, r).

    ``rises`` (k,) is True for a heel strike, False for a toe off. ``scale`` is the median peak above the floor.
    """

    coarse: Index
    rises: Mask
    place: Array
    units: Array
    scale: float


@dataclass
class Shapes:
    """Last known growth (`smartshoe.gait._crossing.growth`) of onsets and releases: of the foot, and of each unit."""

    foot: list[float]
    units: list[list[float]]

    @classmethod
    def usual(cls, regions: int) -> Shapes:
        """The shapes assumed before any contact was seen."""
        start = 2.0 ** (1.0 / USUAL_POWER)
        return cls([start, start], [[start] * regions, [start] * regions])


def floors_of(loads: Array, found: Cut, rate_hz: float) -> tuple[Floors, Floors]:
    """The early and the late floor (k, r) of each swing; NaN where the window's end cuts it short."""
    total = np.concatenate([np.zeros((1, loads.shape[1])), np.cumsum(loads, axis=0)])
    length = (found.stop - found.start).astype(float)
    used = np.minimum(length, LONGEST_FLOOR_S * rate_hz)
    least = max(2.0, 0.02 * rate_hz)
    floors = []
    for first, last in (
        (found.start + EARLY[0] * used, found.start + EARLY[1] * used),
        (found.stop - (1.0 - LATE[0]) * used, found.stop - (1.0 - LATE[1]) * used),
    ):
        low, high = np.ceil(first - TINY).astype(np.intp), np.ceil(last - TINY).astype(np.intp)
        good = (high - low) >= least
        count = np.where(good, high - low, 1)
        mean = (total[high] - total[low]) / count[:, None]
        floors.append(Floors(0.5 * (first + last), np.where(good[:, None], mean, np.nan)))
    return floors[0], floors[1]


def _filled(values: Array, other: Array) -> Array:
    """``values`` (k, r), with NaN replaced by those of ``other`` (k, r)."""
    return np.where(np.isfinite(values), values, other)


def find_edges(loads: Array, found: Cut, floors: tuple[Floors, Floors], rate_hz: float, shapes: Shapes) -> Edges:
    """The edges of all contacts in a window of loads (n, r). Updates ``shapes``."""
    size = loads.shape[0]
    early, late = _filled(floors[0].load, floors[1].load), _filled(floors[1].load, floors[0].load)
    inner_start, inner_stop = found.start > 0, found.stop < size
    # Contact j lies between swing j - 1 and swing j; those at the window's ends are open.
    begins = np.concatenate([[0], found.stop])
    ends = np.concatenate([found.start, [size]])
    before, after = np.vstack([late[:1] if late.size else early[:1], late]), np.vstack([early, early[-1:]])
    real = ends > begins
    begins, ends, before, after = begins[real], ends[real], before[real], after[real]
    has_rise = np.concatenate([[False], inner_stop])[real] if found.stop.size else np.zeros(begins.size, bool)
    has_rise = (begins > 0) & has_rise
    has_fall = (ends < size) & np.concatenate([inner_start, [False]])[real]
    floor = 0.5 * (_filled(before, after) + _filled(after, before))
    bounds = np.column_stack([begins, np.minimum(ends, size - 1)]).ravel()
    peaks = np.maximum.reduceat(loads, bounds, axis=0)[::2] - floor
    whole = loads.sum(axis=1)
    whole_peaks = np.maximum.reduceat(whole, bounds)[::2] - floor.sum(axis=1)
    usual_whole = running_median(np.where(has_rise | has_fall, whole_peaks, np.nan), PEAKS)
    usual = np.column_stack([running_median(column, PEAKS) for column in peaks.T]) if peaks.size else peaks
    impulses = np.add.reduceat(whole, bounds)[::2] - (ends - begins) * floor.sum(axis=1)
    bears = BEARS * _body_weights(begins, ends, np.where(has_rise & has_fall, impulses, np.nan), usual_whole, rate_hz)
    parts = []
    for side, (has, at, base) in enumerate(((has_rise, begins, before), (has_fall, ends, after))):
        index = np.flatnonzero(has)
        lengths = (ends - begins)[index]
        ends_here = _Ends(at[index], lengths, base[index], bears[index], usual_whole[index], usual[index])
        parts.append(_located(loads, ends_here, found.noise, rate_hz, shapes, side))
    coarse = np.concatenate([part[0] for part in parts])
    rises = np.concatenate([np.ones(parts[0][0].size, bool), np.zeros(parts[1][0].size, bool)])
    place = np.concatenate([part[1] for part in parts])
    units = np.vstack([part[2] for part in parts])
    order = np.lexsort((~rises, coarse))
    good = np.isfinite(usual_whole)
    scale = float(np.median(usual_whole[good])) if good.any() else 0.0
    return Edges(coarse[order], rises[order], place[order], units[order], scale)


@dataclass(frozen=True, eq=False)
class _Ends:
    """The starts, or the ends, of k contacts.

    ``at`` is the approximate place and ``length`` that of the contact, both (k,) in samples; ``base`` (k, r) is the
    floor of the swing next to it, ``bears`` (k,) the level above which the foot bears load, ``usual_whole`` (k,) and
    ``usual`` (k, r) the usual peaks of the foot and of its units.
    """

    at: Index
    length: Index
    base: Array
    bears: Array
    usual_whole: Array
    usual: Array


def _body_weights(begins: Index, ends: Index, impulses: Array, peaks: Array, rate_hz: float) -> Array:
    """Body weight (k,) in the loads' unit near each contact [``begins``, ``ends``), from the foot's own loads.

    Over whole strides a foot carries half of the body weight, so the weight is twice the impulse (k,), NaN for a
    contact that is cut off, divided by the time from contact to contact. A contact between rests has no stride: there
    the weight is the usual peak (k,) of a walking foot, or the peak of a running foot divided by `RUNNING_PEAK`. (A
    threshold at a share of the peak alone would be reached later by a runner.)
    """
    swings = np.where(begins[1:] - ends[:-1] <= LONGEST_SWING_S * rate_hz, begins[1:] - ends[:-1], np.inf)
    swings = np.minimum(np.append(swings, np.inf), np.append(np.inf, swings))
    lengths = ends - begins
    means = np.where(np.isfinite(swings), 2.0 * impulses / (lengths + swings), np.nan)
    means = running_median(means, PEAKS)
    otherwise = np.where(lengths < WALKING_STANCE_S * rate_hz, peaks / RUNNING_PEAK, peaks)
    return np.where(np.isfinite(means), means, otherwise)


def _located(
    loads: Array, ends: _Ends, noise: float, rate_hz: float, shapes: Shapes, side: int
) -> tuple[Index, Array, Array]:
    """Locate rises (``side`` 0) or falls (1).

    Returns approximate places (k,), exact places (k,) and the places of the units (k, r), all in samples.
    """
    at, base, bears = ends.at, ends.base, ends.bears
    count, regions = at.size, loads.shape[1]
    units = np.full((count, regions), np.nan)
    if count == 0:
        return at, np.zeros(0), units
    unit_noise = float(np.sqrt(noise**2 / regions))
    turn = 1 if side == 0 else -1
    first = at - turn * round(BEFORE_S * rate_hz) - (0 if side == 0 else 1)
    width = round((BEFORE_S + AFTER_S) * rate_hz) + 1
    rows = _rows(loads.sum(axis=1), first, turn, width) - base.sum(axis=1)[:, None]
    # Where noise allows, the first level is the wanted one itself, and nothing is extrapolated.
    levels, top = _levels(bears, ends.usual_whole, noise)
    places = rise_places(rows, levels, top)
    shapes.foot[side] = growth(_resolved(rows, places[:, 0], bears, ends.usual_whole, noise), shapes.foot[side])
    ratio = shapes.foot[side]
    lowest = bent_places(rows, levels[:, 0], places[:, 0], ratio)
    met = lowest - places[:, 0] + level_places(places, ratio, bears / np.maximum(levels[:, 0], 1e-12))
    place = np.where(np.isfinite(met), first + turn * met, at.astype(float))
    # A unit is loaded only while the foot is down; beyond the contact's other end its load is another stance's.
    first = at - turn * round(UNIT_BEFORE_S * rate_hz) - (0 if side == 0 else 1)
    margin = round(UNIT_BEFORE_S * rate_hz)
    reach = np.minimum(ends.length + 2 * margin, margin + round(UNIT_AFTER_S * rate_hz))
    width = int(reach.max())
    outside = np.arange(width)[None, :] >= reach[:, None]
    for region in range(regions):
        rows = _rows(loads[:, region], first, turn, width) - base[:, region, None]
        rows[outside] = -np.inf
        usual = ends.usual[:, region]
        levels, top = _levels(UNIT_LEVEL * usual, usual, unit_noise)
        places = rise_places(rows, levels, top)
        shapes.units[side][region] = growth(places, shapes.units[side][region])
        share = bears / np.maximum(levels[:, 0], 1e-12)
        units[:, region] = first + turn * level_places(places, shapes.units[side][region], share)
    return at, place, units


def _resolved(rows: Array, lowest: Array, bears: Array, usual: Array, noise: float) -> Array:
    """Where (k, 3) rows cross doubling levels that lie samples apart, so that the growth can be read from them."""
    next_place = np.minimum(np.floor(np.nan_to_num(lowest)).astype(np.intp) + 1, rows.shape[1] - 1)
    step = float(np.median(rows[np.arange(len(rows)), next_place]))
    return rise_places(rows, *_levels(np.maximum(bears, np.minimum(step, MOST_LEVEL * usual)), usual, noise))


def _levels(least: Array, usual: Array, noise: float) -> tuple[Array, Array]:
    """Three doubling levels (k, 3), the lowest ``least`` (k,) or above the noise, and the top level (k,)."""
    lowest = np.clip(NOISES * noise, least, np.maximum(MOST_LEVEL * usual, least))
    return lowest[:, None] * np.array([1.0, 2.0, 4.0]), TOP * lowest


def _rows(signal: Array, first: Index, turn: int, width: int) -> Array:
    """Segments (k, width) of the signal from ``first`` on, forwards (``turn`` 1) or backwards (-1), end values held."""
    index = first[:, None] + turn * np.arange(width)[None, :]
    return np.asarray(signal[np.clip(index, 0, signal.size - 1)])
