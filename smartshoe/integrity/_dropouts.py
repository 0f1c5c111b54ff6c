"""Dropouts: the reading falls to the unloaded value, or to nothing, while the load stays.

What is lost is the whole reading: it falls to one level, from whatever load. A reading that falls by one amount from
whatever load (a level that switches), or that falls and drifts back (a draught over a sensor), has not dropped out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._held import held
from smartshoe.integrity._spikes import isolated_beside
from smartshoe.integrity._view import View
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.masks import runs_of


def dropouts(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``dropouts``; masked. To nothing or to rest, and to the upper end, where a wire that breaks reads as well.

    A value that another recording of the unit dropped to (``view.ends``) needs no fall from a large load here.
    """
    if view.span == 0.0:
        return
    known = view.sign * view.ends.dropouts
    is_upper = known > float(view.curve[1].max())
    at = dropped(view)
    if at.any() and not _one_level(view, at):
        at[:] = False
    at, values = _with_others(view, at, known[~is_upper])
    if at.any():
        yield _finding(view, at, values)
    over = view.upside_down()
    up = dropped(over)
    # A pressure may jump and come back; a rail is one value.
    if up.any() and not (_one_value(over.reading.values[up], view.thresholds) and _one_level(over, up)):
        up[:] = False
    up, values = _with_others(over, up, -known[is_upper])
    if (up & ~at).any():
        yield _finding(over, up & ~at, values)


def load_dropouts(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``dropouts``; masked: the load falls to nothing and comes back while the reading stands.

    A reading that lags may still rise by then, so that it is asked whether it falls from where it is highest. Nor has a
    load dropped out that falls there as a matter of course, as one that is switched on and off.
    """
    if view.span == 0.0 or view.load_span == 0.0:
        return
    swapped = view.swapped()
    at, y = dropped(swapped), view.reading.values
    still = 2.0 * view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    for first, stop in zip(*runs_of(at), strict=True):
        comes_back = stop < y.size and bool(swapped.jump[stop - 1] > 0.0)
        there = y[first - 1 : stop + 1]
        at[first:stop] = comes_back and float(np.max(np.maximum.accumulate(there) - there)) < still
    if not at.any() or not _one_level(swapped, at) or _as_a_matter_of_course(swapped, at):
        return
    yield replace(_finding(swapped, at, np.zeros(0)), no_load=view.whole(at))


def _with_others(view: View, at: Mask, known: Array) -> tuple[Mask, Array]:
    """Samples ``at`` which the reading is gone, with others at their values or at ``known`` ones, and these values."""
    known = np.union1d(known, common_values(view.reading.values[at], view.thresholds))
    while (more := _also_gone(view, at, known) & ~at).any():  # with those known cut out the noise is known better
        at = at | more
    return at, known


def _finding(view: View, at: Mask, known: Array) -> Finding:
    starts, stops = runs_of(at)
    what, unit, others = "reading", view.recording.sensor.unit.symbol, "load stays"
    if view.is_swapped:
        what, unit, others = "reference load", "N", "reading stays"
    return Finding(
        "dropouts",
        view.whole(at),
        f"the {what} drops out {'once, for' if starts.size == 1 else f'{starts.size} times, for up to'}"
        f" {float(np.max(view.time_s[stops - 1] - view.time_s[starts])) + view.step_s:.3g} s,"
        f" to about {float(np.median(view.sign * view.reading.values[at])):.4g}"
        f" {unit}, while the {others}: {int(at.sum())} samples are left out",
        masks=True,
        values=view.sign * known,
    )


def _one_value(values: Array, thresholds: Thresholds) -> bool:
    """Whether nearly all of ``values`` are one."""
    count = np.unique(values, return_counts=True)[1]
    return bool(count.max() > (1.0 - thresholds.same) * values.size)


def dropped(view: View) -> Mask:
    """(m,) samples of runs that are low although the load is on, or below rest, and begin and end abruptly."""
    y, given = view.reading.values, view.thresholds
    above = view.expected - view.rest
    least = np.maximum(given.standing * view.span, view.reading.largest * view.reading.noise)
    loaded = above > given.clear * least
    low = loaded & (y < view.rest + given.same * above)
    below = y < view.rest - given.clear * least
    out = np.zeros(y.size, dtype=bool)
    jump, gap = given.clear * view.jump, view.gap
    lost = np.where(below, view.rest - y, view.expected - y)
    for first, stop in zip(*runs_of(low | below), strict=True):
        ends_open = stop == y.size or bool(gap[stop - 1])
        # Both edges make up most of what is lost. A spike just before or after is no edge.
        falls = first > 0 and jump[first - 1] < -lost[first]
        falls = falls and _stood(y[max(first - given.few, 0) : first], y[first] + lost[first] / given.clear)
        rises = not ends_open and jump[stop - 1] > lost[stop - 1]
        rises = rises and _stood(y[stop : stop + given.few], y[stop - 1] + lost[stop - 1] / given.clear)
        if falls and rises:
            out[first:stop] = True
        elif falls and (ends_open or not loaded[stop]):
            # The load went while the reading was gone. A contact that lets go at a low load jumps too.
            out[first:stop] = above[first] > given.same * view.span or below[first]
    return out


def _stood(beside: Array, level: float) -> bool:
    """Whether readings stood above a level: the second largest did, since one may be a spike and others be gone."""
    return bool(np.sort(beside)[max(beside.size - 2, 0)] > level)


def _also_gone(view: View, at: Mask, known: Array) -> Mask:
    """(m,) samples at the level of known dropouts where load is too low to tell: isolated ones and held runs."""
    y = view.reading.values
    exact = np.isin(y, known)
    near = exact | _near(view, float(np.median(y[at]))) if at.any() else exact
    if not near.any():
        return near
    repeated = held(view, at)
    repeated[:-1] |= repeated[1:] & (y[1:] == y[:-1])
    return (near & isolated_beside(view, at)) | (exact & repeated) | _fallen(view, exact)


def _fallen(view: View, exact: Mask) -> Mask:
    """(m,) runs of ``exact`` values that stand clear of the noise of what is beside them."""
    y, few = view.reading.values, view.thresholds.few
    out = np.zeros(y.size, dtype=bool)
    clear = view.reading.largest * view.reading.noise
    for first, stop in zip(*runs_of(exact), strict=True):
        beside = np.concatenate([y[max(first - few, 0) : first], y[stop : stop + few]])
        out[first:stop] = beside.size > 0 and float(np.min(beside)) > y[first] + clear[first]
    return out


def common_values(y: Array, thresholds: Thresholds) -> Array:
    """The values that dropouts take exactly, where they do: a rail, a zero, an error code."""
    values, count = np.unique(y, return_counts=True)
    return values[count > max(thresholds.faulty_share * y.size, 2)]


def _near(view: View, level: float) -> Mask:
    within = view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    return np.abs(view.reading.values - level) <= within


def _as_a_matter_of_course(view: View, at: Mask) -> bool:
    """Whether of all sudden falls to the level of those ``at`` no more than half (`clear`) are among these."""
    starts, _ = runs_of(_near(view, float(np.median(view.reading.values[at]))))
    falls = starts[starts > 0]
    falls = falls[view.jump[falls - 1] < 0.0]
    return bool(view.thresholds.clear * at[falls].sum() <= falls.size)


def _one_level(view: View, at: Mask) -> bool:
    """Whether falls end at one level, whatever the load was: the levels scatter less than what was lost.

    One fall, or several from much the same load, must have taken most of a large reading. Short falls must be several
    and from different loads: a spike may fall anywhere.
    """
    y, given = view.reading.values, view.thresholds
    most = 1.0 - given.same  # edges may be caught halfway
    starts, stops = runs_of(at)
    if _near(view, float(np.median(y[at])))[at].mean() < most:
        return False
    still = [_stands(y[a:b], view) for a, b in zip(starts, stops, strict=True)]
    if float(np.average(still, weights=stops - starts)) < most:
        return False
    before = y[np.maximum(starts - 1, 0)]
    after = np.array([float(np.median(y[a:b])) for a, b in zip(starts, stops, strict=True)])
    lost = np.maximum(before, view.expected[starts]) - after
    noise = view.reading.quiet_noise + view.reading.step
    if lost.max() < given.same * view.span or (starts.size > 2 and _scatter(after) > max(_scatter(lost), noise)):
        return False
    short = int((stops - starts).max()) <= 2
    return not short or (starts.size > 2 and float(np.ptp(view.expected[at])) > given.same * view.span)


def _stands(part: Array, view: View) -> bool:
    """Whether the reading stays where it fell to: it has lost its sensor, and is not on its way back."""
    third = part.size // 3
    if third < 2:
        return True
    moved = abs(float(part[-third:].mean() - part[:third].mean()))
    noise = view.reading.largest * view.reading.quiet_noise * (2.0 / third) ** 0.5
    return bool(moved <= noise + view.thresholds.standing * view.span)


def _scatter(values: Array) -> float:
    return float(np.median(np.abs(values - np.median(values))))
