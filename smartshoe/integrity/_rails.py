"""Rails: many readings are exactly equal at the loaded end (saturation), or at the unloaded end while the load is on.

Readings that are tied at an end may also be a peak that stands on one level of the grid, or held samples. They are a
rail where the load goes on beyond it by more than a grid hides, or where noise stands still only there; where they are
tied under loads that are read differently elsewhere; or where another recording of the unit showed that its sensor ends
at that value.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.masks import runs_of


def saturation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``saturation``; masked: readings tied at the largest value while load goes on rising, or noise is still."""
    top = _rail(view, bad, -1.0)
    if top is None:
        return
    tied = _without_leaps(view, (view.reading.values == top) & ~bad)
    if not tied.any():
        return
    least = _least_hidden_span(view, tied)
    hidden = _hidden_span(view, tied, top, -1.0)
    stands = _noise_stands_still(view, tied, top, -1.0) or _ends_alike_under_unlike_loads(view, tied, least)
    if hidden <= least and not stands and not _is_known(view, top):
        return
    cut = f", and about {percent(hidden / view.span)} of the span is cut off" if hidden > least else ""
    yield Finding(
        "saturation",
        view.whole(tied),
        f"{int(tied.sum())} readings ({percent(float(tied.mean()))}) are exactly {view.sign * top:.6g}"
        f" {view.recording.sensor.unit.symbol} at the loaded end: the sensor or its converter saturates there{cut}",
        masks=True,
        rail=view.sign * top,
    )


def low_rail(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``low_rail``; masked: readings tied at the smallest value under a rising load, where noise would untie them.

    Without noise beside the rail nothing is reported, since a rail at zero and a dead band of the contact look the
    same. Tied readings at rest are no fault, but are left out as well: the value read there is no zero.
    """
    bottom = _rail(view, bad, 1.0)
    if bottom is None:
        return
    tied = (view.reading.values == bottom) & ~bad
    hidden, least = _hidden_span(view, tied, bottom, 1.0), _least_hidden_span(view, tied)
    if not _is_known(view, bottom) and (hidden <= least or not _noise_stands_still(view, tied, bottom, 1.0)):
        return
    is_loaded = tied & (view.load.values > view.curve[0][0] + view.thresholds.standing * view.load_span)
    starts, stops = runs_of(tied)
    size = stops - starts
    # The load at which readings leave the rail.
    leaves_n = float(np.median(view.load.values[stops[size >= min(view.thresholds.few, size.max())] - 1]))
    cut_off = "its zero is cut off"
    if leaves_n > 0.0:
        cut_off += f", and loads below about {leaves_n:.2g} N are not seen"
    there, when = (is_loaded, "while the load is on") if is_loaded.any() else (tied, "at rest")
    yield Finding(
        "low_rail",
        view.whole(is_loaded),
        f"{int(there.sum())} readings are exactly {view.sign * bottom:.6g} {view.recording.sensor.unit.symbol} {when}:"
        f" the sensor cannot go lower, so that {cut_off}",
        masks=True,
        cut_off=view.whole(tied & ~is_loaded),
        rail=view.sign * bottom,
    )


def _is_known(view: View, rail: float) -> bool:
    """Whether another recording of the unit shows that its sensor ends at ``rail``."""
    return bool(np.isin(view.sign * rail, view.ends.rails))


def _without_leaps(view: View, tied: Mask) -> Mask:
    """(m,) the ``tied`` readings, without runs to which the reading leaps, and back, from what the load would make it.

    A reading that leaps to its end drops out there.
    """
    remaining = tied.copy()
    limit = view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    for first, stop in zip(*runs_of(tied), strict=True):
        if first == 0 or stop == tied.size or not view.jump[first - 1] > 0.0 > view.jump[stop - 1]:
            continue
        leap = view.reading.values[first] - float(np.median(view.expected[first:stop]))
        remaining[first:stop] = leap < limit
    return remaining


def _least_hidden_span(view: View, tied: Mask) -> float:
    """How much of the reading must be cut off for a rail to be told from a peak that stands on one level."""
    reading, given = view.reading, view.thresholds
    step = float(reading.local_step[tied][0])
    return given.clear * step + reading.largest * reading.quiet_noise + given.material * view.span


def _rail(view: View, bad: Mask, inward: float) -> float | None:
    """The outermost value at which readings tie, with hardly any beyond it; None where there is none.

    ``inward``: 1 for the smallest readings, -1 for the largest.
    """
    if view.span == 0.0 or bad.all():
        return None
    levels, count = view.reading.levels if not bad.any() else np.unique(view.reading.values[~bad], return_counts=True)
    if inward < 0.0:
        levels, count = levels[::-1], count[::-1]
    given = view.thresholds
    most_beyond = given.faulty_share * count.sum()  # spikes may lie beyond the rail
    tied = np.flatnonzero(count >= given.few)
    if tied.size == 0 or count[: tied[0]].sum() > most_beyond:
        return None
    # On a grid the converter's noise ties readings beyond the rail as well, but nowhere as often as at the rail.
    outer = count[: 1 + int(np.searchsorted(np.cumsum(count), most_beyond))]
    commonest = int(np.argmax(outer))
    at = commonest if outer[commonest] > given.few * count[tied[0]] else int(tied[0])
    # A rail cuts noise off. Where readings lie just beyond, within the noise, the tied ones are held or on a grid.
    beyond = np.abs(levels[:at] - levels[at]) <= view.reading.largest * view.reading.quiet_noise
    return float(levels[at]) if count[:at][beyond].sum() <= given.faulty_share * count[at] else None


def _noise_stands_still(view: View, tied: Mask, rail: float, inward: float) -> bool:
    """Whether readings stay tied for long at the ``rail``, although there is as much noise beside it as elsewhere.

    Not where readings repeat as long elsewhere too (the logger holds), or in one run only, which may be one held
    sample.
    """
    given = view.thresholds
    noisy_run = round(given.clear * given.few)  # ties in a row at which noise does not come to rest by chance
    starts, stops = runs_of(tied)
    size = stops - starts
    # A sensor with a soft knee ties readings beside its rail as well: these are not counted as elsewhere.
    is_away = np.abs(view.reading.values - rail) > view.reading.largest * view.reading.quiet_noise
    elsewhere = runs_of((np.diff(view.reading.values, prepend=np.nan) == 0.0) & is_away)
    if int(((elsewhere[1] - elsewhere[0]) >= noisy_run - 1).sum()) >= int((size >= noisy_run).sum()):
        return False
    if not view.reading.is_noisy or (size >= given.few).sum() < 2 or int(size.max()) < noisy_run:
        return False
    from_rail = inward * (view.reading.values - rail)
    is_beside = (from_rail > given.standing * view.span) & (from_rail < given.same * view.span)
    noise = view.noise_at_load
    is_upper = (view.expected > view.rest + 0.5 * view.span) & ~tied
    if min(is_beside.sum(), is_upper.sum()) < given.local // 4:
        return False
    return bool(given.clear * np.median(noise[is_beside]) > np.median(noise[is_upper]))


def _ends_alike_under_unlike_loads(view: View, tied: Mask, least: float) -> bool:
    """Whether runs of ``tied`` readings that are no peaks come under loads that are read farther apart than ``least``.

    That is by the mean gain, since a slow unit may come to its rail as its load falls and is nowhere near its curve. A
    load that stands, or friction, holds a reading as well, but under another load at another value. Nor is such a run
    the top of a smooth peak: of one that stays within a step of the grid for a while, what lies beside it, as long
    again, is no more than eight steps lower (a parabola's).
    """
    reading, given = view.reading, view.thresholds
    y, lowest = reading.values, given.clear * 8.0 * float(reading.local_step[tied][0])
    lowest += reading.largest * reading.quiet_noise
    highest_n = []
    for first, stop in zip(*runs_of(tied), strict=True):
        size = stop - first
        if given.few <= size <= min(first, y.size - stop):
            beside = max(float(y[first - size : first].min()), float(y[stop : stop + size].min()))
            if y[first] - beside > lowest:
                highest_n.append(float(view.load.values[first:stop].max()))
    gain = float(np.polyfit(view.load.values, y, 1)[0])
    return bool(highest_n) and gain * float(np.ptp(highest_n)) > least


def _hidden_span(view: View, tied: Mask, rail: float, inward: float) -> float:
    """How much farther the reading would have gone while ``tied``, in its unit: the load's rise by the curve's slope.

    The slope is the static curve's beside the rail. Only load that rises within a run counts, since friction holds the
    reading at its peak while load falls.
    """
    left_out, band = view.thresholds.few, view.thresholds.same
    starts, stops = runs_of(tied)
    is_long = stops - starts >= left_out
    starts, stops = starts[is_long], stops[is_long]
    if starts.size == 0:
        return 0.0
    load = view.load.values
    # The reading may answer a corner of the load a little late: samples are left out at both ends of a run.
    begins = np.minimum(starts + left_out, stops - 1)
    pairs = np.stack([begins, np.maximum(stops - left_out, begins + 1)], axis=1).ravel()
    peaks = np.maximum.reduceat(np.append(load, load[-1]), pairs)[::2]
    rise = peaks - load[begins] - view.load.largest * view.load.quiet_noise
    loads, readings = view.curve
    is_beside = inward * (readings - rail) > band * view.span
    if not is_beside.any():
        return 0.0
    inner_load = loads[np.flatnonzero(is_beside)[-1 if inward < 0 else 0]]
    edge_load = float(np.median(load[starts])) if inward < 0 else float(np.median(load[stops - 1]))
    slope = band * view.span / max(abs(edge_load - inner_load), band * view.load_span)
    return float(slope * rise.max())
