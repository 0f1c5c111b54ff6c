"""Rails: readings tied exactly at the loaded end (saturation) or at the unloaded end while the load is on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.masks import runs_of


def saturation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``saturation``; masked: ties at the largest reading while the load goes on rising, or noise stands still."""
    top = _rail(view, bad, -1.0)
    if top is None:
        return
    tied = _without_leaps(view, (view.reading.values == top) & ~bad)
    if not tied.any():
        return
    least = _least_hidden(view, tied)
    hidden = _hidden(view, tied, top, -1.0)
    stands = _noise_stands_still(view, tied, top, -1.0)
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
    """Kind ``low_rail``; masked: ties at the smallest reading under a rising load, where noise should untie them.

    Without noise beside the rail, one at zero and a dead band of the contact are the same: nothing is said then.
    Left out at rest as well, where it is no fault: what is read there is no zero.
    """
    bottom = _rail(view, bad, 1.0)
    if bottom is None:
        return
    tied = (view.reading.values == bottom) & ~bad
    hidden, least = _hidden(view, tied, bottom, 1.0), _least_hidden(view, tied)
    if not _is_known(view, bottom) and (hidden <= least or not _noise_stands_still(view, tied, bottom, 1.0)):
        return
    on = tied & (view.load.values > view.curve[0][0] + view.thresholds.standing * view.load_span)
    # The load at which readings leave the rail; where load and reading have changed places there is none.
    starts, stops = runs_of(tied)
    size = stops - starts
    leaves_n = float(np.median(view.load.values[stops[size >= min(view.thresholds.few, size.max())] - 1]))
    cut_off = "its zero is cut off"
    if leaves_n > 0.0 and not view.is_swapped:
        cut_off += f", and loads below about {leaves_n:.2g} N are not seen"
    yield Finding(
        "low_rail",
        view.whole(on),
        f"{int(on.sum())} readings are exactly {view.sign * bottom:.6g} {view.recording.sensor.unit.symbol} while the"
        f" load is on: the sensor cannot go lower, so that {cut_off}",
        masks=True,
        cut_off=view.whole(tied & ~on),
        rail=view.sign * bottom,
    )


def _is_known(view: View, rail: float) -> bool:
    """Whether another recording of the unit shows that its sensor ends there."""
    return bool(np.isin(view.sign * rail, view.ends.rails))


def _without_leaps(view: View, tied: Mask) -> Mask:
    """(m,) those ``tied`` at the largest reading to which it did not leap, and back, from what the load makes it.

    A reading that does drops out to its end.
    """
    out = tied.copy()
    clear = view.reading.largest * view.reading.quiet_noise + view.thresholds.standing * view.span
    for first, stop in zip(*runs_of(tied), strict=True):
        if first == 0 or stop == tied.size or not view.jump[first - 1] > 0.0 > view.jump[stop - 1]:
            continue
        beyond = view.reading.values[first] - float(np.median(view.expected[first:stop]))
        out[first:stop] = beyond < clear
    return out


def _least_hidden(view: View, tied: Mask) -> float:
    """How much of the reading must be cut off for a rail to be told from a peak that stands on one level."""
    reading, given = view.reading, view.thresholds
    step = float(reading.local_step[tied][0])
    return given.clear * step + reading.largest * reading.quiet_noise + given.material * view.span


def _rail(view: View, bad: Mask, inward: float) -> float | None:
    """The outermost value at which readings tie, hardly any lying beyond; None where there is none."""
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
    # On a grid the converter's noise ties beyond the rail too, but nowhere as often as at it.
    outer = count[: 1 + int(np.searchsorted(np.cumsum(count), most_beyond))]
    most = int(np.argmax(outer))
    at = most if outer[most] > given.few * count[tied[0]] else int(tied[0])
    # A rail cuts noise off: where readings lie just beyond, those that tie are held or lie on a grid.
    beyond = np.abs(levels[:at] - levels[at]) <= view.reading.largest * view.reading.quiet_noise
    return float(levels[at]) if count[:at][beyond].sum() <= given.faulty_share * count[at] else None


def _noise_stands_still(view: View, tied: Mask, rail: float, inward: float) -> bool:
    """Whether readings tie for long although there is noise, and as much of it beside the rail as elsewhere."""
    given = view.thresholds
    noisy_run = round(given.clear * given.few)  # ties in a row at which noise does not come to rest by chance
    starts, stops = runs_of(tied)
    size = stops - starts
    # A soft knee ties beside its rail too.
    far = np.abs(view.reading.values - rail) > view.reading.largest * view.reading.quiet_noise
    elsewhere = runs_of((np.diff(view.reading.values, prepend=np.nan) == 0.0) & far)
    if int(((elsewhere[1] - elsewhere[0]) >= noisy_run - 1).sum()) >= int((size >= noisy_run).sum()):
        return False  # the logger holds, at the rail as elsewhere
    if not view.reading.is_noisy or (size >= given.few).sum() < 2 or int(size.max()) < noisy_run:
        return False  # a single run may be one held sample
    inside = inward * (view.reading.values - rail)
    beside = (inside > given.standing * view.span) & (inside < given.same * view.span)
    noise = view.noise_at_load
    upper = (view.expected > view.rest + 0.5 * view.span) & ~tied
    if min(beside.sum(), upper.sum()) < given.local // 4:
        return False
    return bool(given.clear * np.median(noise[beside]) > np.median(noise[upper]))


def _hidden(view: View, tied: Mask, rail: float, inward: float) -> float:
    """How far the reading would have gone on within the runs of ties, by the static curve's slope beside the rail.

    Only load that rises within a run counts: friction holds the reading at its peak while load falls.
    """
    late, band = view.thresholds.few, view.thresholds.same
    starts, stops = runs_of(tied)
    long = stops - starts >= late
    starts, stops = starts[long], stops[long]
    if starts.size == 0:
        return 0.0
    load = view.load.values
    # The echo of a corner may come a little late: so many samples are left out at both ends of a run.
    later = np.minimum(starts + late, stops - 1)
    pairs = np.stack([later, np.maximum(stops - late, later + 1)], axis=1).ravel()
    peaks = np.maximum.reduceat(np.append(load, load[-1]), pairs)[::2]
    rise = peaks - load[later] - view.load.largest * view.load.quiet_noise
    at, middle = view.curve
    beyond = inward * (middle - rail) > band * view.span
    if not beyond.any():
        return 0.0
    inner = at[np.flatnonzero(beyond)[-1 if inward < 0 else 0]]
    edge = float(np.median(load[starts])) if inward < 0 else float(np.median(load[stops - 1]))
    slope = band * view.span / max(abs(edge - inner), band * view.load_span)
    return float(slope * rise.max())
