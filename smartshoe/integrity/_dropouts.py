"""Dropouts: a sensor or its wire loses contact, and the channel falls to one level while the other channel stays.

A dropout takes the whole reading: it falls abruptly to one level, from whatever load, stays there, and jumps back. A
reading that falls by one amount from whatever load (a level that switches), or that falls and drifts back (a draught
over a sensor), has not dropped out. A load may drop out in the same way, and is judged with the two signals swapped.
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
    """Kind ``dropouts``; masked: the reading falls to nothing or to rest, or leaps to its upper end.

    At the upper end reads a sensor whose wire is broken. There dropouts must take one value, since a pressure may leap
    and come back. A value to which another recording of the unit dropped (``view.ends``) needs no fall from a large
    load here.
    """
    if view.span == 0.0:
        return
    known = view.sign * view.ends.dropouts
    is_upper = known > float(view.curve[1].max())
    at = dropped(view)
    if at.any() and not _falls_to_one_level(view, at):
        at[:] = False
    at, values = _with_more_at_values(view, at, known[~is_upper])
    if at.any():
        yield _finding(view, at, values)
    flipped = view.upside_down()
    at_upper = dropped(flipped)
    if at_upper.any() and not (
        _one_value(flipped.reading.values[at_upper], view.thresholds) and _falls_to_one_level(flipped, at_upper)
    ):
        at_upper[:] = False
    at_upper, values = _with_more_at_values(flipped, at_upper, -known[is_upper])
    if (at_upper & ~at).any():
        yield _finding(flipped, at_upper & ~at, values)


def load_dropouts(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``dropouts``; masked: the load falls to nothing and comes back while the reading stands.

    A reading that lags may still rise when the load falls, so its fall is taken from its highest value so far. Where a
    noisy load takes one value throughout, which it does not at rest, the reading may fall by up to half (`clear`) of
    what the static curve has it fall. A load that often falls to that level, as one that is switched on and off, has
    not dropped out.
    """
    if view.span == 0.0 or view.load_span == 0.0:
        return
    swapped = view.swapped()
    at, reading = dropped(swapped), view.reading.values
    standing_limit = 2.0 * view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    lowest = float(view.curve[0][0])
    low_count = int(np.count_nonzero(view.load.values < lowest + view.thresholds.standing * view.load_span))
    for first, stop in zip(*runs_of(at), strict=True):
        comes_back = stop < reading.size and bool(swapped.jump[stop - 1] > 0.0)
        readings = reading[first - 1 : stop + 1]
        is_one = _is_no_load(view, view.load.values[first:stop], low_count)
        fall = float(view.expected[first - 1] - view.expected[first]) if is_one else 0.0
        limit = max(standing_limit, fall / view.thresholds.clear)
        at[first:stop] = comes_back and float(np.max(np.maximum.accumulate(readings) - readings)) < limit
    if at.any() and _is_no_load(view, view.load.values[at], low_count):
        at = view.load.values == view.load.values[at][0]  # also where it falls from little
    if not at.any() or not _falls_to_one_level(swapped, at) or _often_falls_there(swapped, at):
        return
    yield replace(_finding(swapped, at, np.zeros(0)), no_load=view.whole(at))


def _is_no_load(view: View, loads: Array, low_count: int) -> bool:
    """Whether ``loads`` (k,) are one value that a noisy load takes by a fault, not in most of ``low_count`` at rest."""
    if not view.load.is_noisy or np.ptp(loads) > 0.0:
        return False
    levels, count = view.load.levels
    return bool(view.thresholds.clear * count[np.searchsorted(levels, loads[0])] < low_count)


def _with_more_at_values(view: View, at: Mask, known: Array) -> tuple[Mask, Array]:
    """Samples ``at`` (m,) of dropouts, with more samples at their values or at ``known`` ones; and these values.

    More samples are looked for until none is found: with those found cut out, the noise is known better.
    """
    known = np.union1d(known, common_values(view.reading.values[at], view.thresholds))
    while (more := _more_at_values(view, at, known) & ~at).any():
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
    """Whether nearly all of ``values`` (k,) are equal."""
    count = np.unique(values, return_counts=True)[1]
    return bool(count.max() > (1.0 - thresholds.same) * values.size)


def dropped(view: View) -> Mask:
    """(m,) samples of runs that are low although the load is on, or below rest, and that begin and end abruptly.

    Both edges of a run must make up at least half (`clear`) of what is lost between the expected reading and the run's.
    A run whose end is not seen, or at whose end the load is off, counts where it fell from a load that is not small: a
    contact that lets go at a low load jumps as well. Two runs with one good sample between them begin and end as one.
    """
    y, given = view.reading.values, view.thresholds
    above = view.expected - view.rest
    margin = np.maximum(given.standing * view.span, view.reading.largest * view.reading.noise)
    is_loaded = above > given.clear * margin
    is_low = is_loaded & (y < view.rest + given.same * above)
    is_below_rest = y < view.rest - given.clear * margin
    has_dropped = np.zeros(y.size, dtype=bool)
    jump, gap = given.clear * view.jump, view.gap
    lost = np.where(is_below_rest, view.rest - y, view.expected - y)
    is_down = is_low | is_below_rest
    is_good_between = np.zeros(y.size, dtype=bool)
    is_good_between[1:-1] = ~is_down[1:-1] & is_down[:-2] & is_down[2:]
    is_good_between[1:-1] &= (jump[:-1] > lost[:-2]) & (jump[1:] < -lost[2:])
    for first, stop in zip(*runs_of(is_down | is_good_between), strict=True):
        ends_open = stop == y.size or bool(gap[stop - 1])
        # A spike just before or after the run is no edge: readings must have stood above it.
        falls = first > 0 and jump[first - 1] < -lost[first]
        falls = falls and _stood_above(y[max(first - given.few, 0) : first], y[first] + lost[first] / given.clear)
        rises = not ends_open and jump[stop - 1] > lost[stop - 1]
        rises = rises and _stood_above(y[stop : stop + given.few], y[stop - 1] + lost[stop - 1] / given.clear)
        if falls and rises:
            has_dropped[first:stop] = True
        elif falls and (ends_open or not is_loaded[stop]):
            has_dropped[first:stop] = above[first] > given.same * view.span or is_below_rest[first]
    return has_dropped & is_down


def _stood_above(neighbours: Array, level: float) -> bool:
    """Whether the readings beside a run, ``neighbours`` (k,), stood above a ``level``.

    The second largest decides, since the largest may be a spike and others may have dropped out as well.
    """
    return bool(np.sort(neighbours)[max(neighbours.size - 2, 0)] > level)


def _more_at_values(view: View, at: Mask, known: Array) -> Mask:
    """(m,) more samples at the level or the ``known`` values of dropouts, where the load is too low to tell by itself.

    These are isolated samples near that level, and at exactly a known value held runs and runs clear of the noise.
    """
    y = view.reading.values
    is_known = np.isin(y, known)
    is_near = is_known | _is_near(view, float(np.median(y[at]))) if at.any() else is_known
    if not is_near.any():
        return is_near
    repeated = held(view, at)
    repeated[:-1] |= repeated[1:] & (y[1:] == y[:-1])
    return (is_near & isolated_beside(view, at)) | (is_known & repeated) | _stands_clear_below(view, is_known)


def _stands_clear_below(view: View, is_known: Mask) -> Mask:
    """(m,) runs of samples at known values, ``is_known`` (m,), that stand below all beside them, clear of noise."""
    y, few = view.reading.values, view.thresholds.few
    is_clear = np.zeros(y.size, dtype=bool)
    noise_reach = view.reading.largest * view.reading.noise
    for first, stop in zip(*runs_of(is_known), strict=True):
        neighbours = np.concatenate([y[max(first - few, 0) : first], y[stop : stop + few]])
        is_clear[first:stop] = neighbours.size > 0 and float(np.min(neighbours)) > y[first] + noise_reach[first]
    return is_clear


def common_values(y: Array, thresholds: Thresholds) -> Array:
    """Those values among ``y`` (k,) that many dropouts take exactly: a rail, a zero, an error code; or none."""
    values, count = np.unique(y, return_counts=True)
    return values[count > max(thresholds.faulty_share * y.size, 2)]


def _is_near(view: View, level: float) -> Mask:
    """(m,) readings within the noise and what counts as standing still of a ``level``."""
    within = view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    return np.abs(view.reading.values - level) <= within


def _often_falls_there(view: View, at: Mask) -> bool:
    """Whether the runs ``at`` (m,) are at most half (`clear`) of all sudden falls to their level."""
    starts, _ = runs_of(_is_near(view, float(np.median(view.reading.values[at]))))
    falls = starts[starts > 0]
    falls = falls[view.jump[falls - 1] < 0.0]
    return bool(view.thresholds.clear * at[falls].sum() <= falls.size)


def _falls_to_one_level(view: View, at: Mask) -> bool:
    """Whether the runs ``at`` (m,) are falls to one level, whatever the load was.

    1. Most samples lie near the runs' median level, and most runs stay there. Edges may be caught halfway.
    2. The largest loss is a share (`same`) of the span at least.
    3. Of three runs and more the levels scatter less than the losses do, or no more than noise.
    4. Runs of one or two samples must be three at least and from different loads, since a spike may fall anywhere.
    """
    from scipy.stats import median_abs_deviation

    y, given = view.reading.values, view.thresholds
    most = 1.0 - given.same
    starts, stops = runs_of(at)
    if _is_near(view, float(np.median(y[at])))[at].mean() < most:
        return False
    stays = [_stays_there(y[a:b], view) for a, b in zip(starts, stops, strict=True)]
    if float(np.average(stays, weights=stops - starts)) < most:
        return False
    before = y[np.maximum(starts - 1, 0)]
    levels = np.array([float(np.median(y[a:b])) for a, b in zip(starts, stops, strict=True)])
    lost = np.maximum(before, view.expected[starts]) - levels
    noise = view.reading.quiet_noise + view.reading.step
    if lost.max() < given.same * view.span or (
        starts.size > 2 and median_abs_deviation(levels) > max(median_abs_deviation(lost), noise)
    ):
        return False
    short = int((stops - starts).max()) <= 2
    return not short or (starts.size > 2 and float(np.ptp(view.expected[at])) > given.same * view.span)


def _stays_there(part: Array, view: View) -> bool:
    """Whether the readings ``part`` (k,) of a dropout stay where they fell to, and are not on their way back."""
    third = part.size // 3
    if third < 2:
        return True
    moved = abs(float(part[-third:].mean() - part[:third].mean()))
    noise = view.reading.largest * view.reading.quiet_noise * (2.0 / third) ** 0.5
    return bool(moved <= noise + view.thresholds.standing * view.span)
