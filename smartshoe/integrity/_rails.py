"""Rails: readings tied exactly at the loaded end (saturation) or at the unloaded end while the load is on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.masks import runs_of

LEAST_TIES = 5
MOST_TIES = 10  # times as many: levels of a grid at a peak differ by a few times
LEAST_RUN = 3
NOISY_RUN = 8  # ties in a row at which noise does not come to rest by chance
FEW_BEYOND = 0.01  # of all samples: spikes may lie beyond the rail
FEW_JUST_BEYOND = 0.1  # of those at the rail: the converter's own noise
BAND = 0.1  # of the span: the stretch of the static curve beside the rail that gives its slope there
STEPS = 3.0
NOISES = 7.0
LEAST_RISE = 0.005  # of the span
AS_NOISY = 0.4  # of the noise in the upper half, that noise beside the rail must have for ties to be a wonder
LEAST_RUNS = 2  # a single run may be one held sample


def saturation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``saturation``; masked: ties at the largest reading while the load goes on rising, or noise stands still."""
    top = _rail(view, bad, -1.0)
    if top is None:
        return
    tied = (view.reading.values == top) & ~bad
    least = STEPS * view.reading.step + NOISES * view.reading.quiet_noise + LEAST_RISE * view.span
    hidden = _hidden(view, tied, top, -1.0)
    stands = _noise_stands_still(view, tied, top, -1.0)
    if hidden <= least and not stands:
        return
    cut = f", and about {100 * hidden / view.span:.2g} % of the span is cut off" if hidden > least else ""
    yield Finding(
        "saturation",
        view.whole(tied),
        f"{int(tied.sum())} readings ({100 * float(tied.mean()):.2g} %) are exactly {view.sign * top:.6g}"
        f" {view.recording.sensor.unit.symbol} at the loaded end: the sensor or its converter saturates there{cut}",
        masks=True,
    )


def low_rail(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``low_rail``; masked: ties at the smallest reading under a rising load, where noise should untie them.

    Without noise beside the rail, one at zero and a dead band of the contact are the same: nothing is said then.
    """
    bottom = _rail(view, bad, 1.0)
    if bottom is None:
        return
    tied = (view.reading.values == bottom) & ~bad
    least = STEPS * view.reading.step + 2.0 * view.reading.quiet_noise + 2.0 * LEAST_RISE * view.span
    if not _noise_stands_still(view, tied, bottom, 1.0) or _hidden(view, tied, bottom, 1.0) <= least:
        return
    on = tied & (view.load.values > view.curve[0][0] + 0.005 * view.load_span)
    yield Finding(
        "low_rail",
        view.whole(on),
        f"{int(on.sum())} readings are exactly {view.sign * bottom:.6g} {view.recording.sensor.unit.symbol} while the"
        " load is on: the sensor cannot go lower, and its zero is cut off",
        masks=True,
    )


def _rail(view: View, bad: Mask, inward: float) -> float | None:
    """The outermost value at which readings tie, hardly any lying beyond; None where there is none."""
    if view.span == 0.0 or bad.all():
        return None
    levels, count = view.reading.levels if not bad.any() else np.unique(view.reading.values[~bad], return_counts=True)
    if inward < 0.0:
        levels, count = levels[::-1], count[::-1]
    tied = np.flatnonzero(count >= LEAST_TIES)
    if tied.size == 0 or count[: tied[0]].sum() > FEW_BEYOND * count.sum():
        return None
    # On a grid the converter's noise ties beyond the rail too, but nowhere as often as at it.
    outer = count[: 1 + int(np.searchsorted(np.cumsum(count), FEW_BEYOND * count.sum()))]
    most = int(np.argmax(outer))
    at = most if outer[most] > MOST_TIES * count[tied[0]] else int(tied[0])
    # A rail cuts noise off: where readings lie just beyond, those that tie are held or lie on a grid.
    beyond = np.abs(levels[:at] - levels[at]) <= NOISES * view.reading.quiet_noise
    return float(levels[at]) if count[:at][beyond].sum() <= FEW_JUST_BEYOND * count[at] else None


def _noise_stands_still(view: View, tied: Mask, rail: float, inward: float) -> bool:
    """Whether readings tie for long although there is noise, and as much of it beside the rail as elsewhere."""
    starts, stops = runs_of(tied)
    size = stops - starts
    # A soft knee ties beside its rail too.
    far = np.abs(view.reading.values - rail) > NOISES * view.reading.quiet_noise
    elsewhere = runs_of((np.diff(view.reading.values, prepend=np.nan) == 0.0) & far)
    if int(((elsewhere[1] - elsewhere[0]) >= NOISY_RUN - 1).sum()) >= int((size >= NOISY_RUN).sum()):
        return False  # the logger holds, at the rail as elsewhere
    if not view.reading.is_noisy or (size >= LEAST_RUN).sum() < LEAST_RUNS or int(size.max()) < NOISY_RUN:
        return False
    inside = inward * (view.reading.values - rail)
    beside = (inside > 0.02 * view.span) & (inside < 0.2 * view.span)
    noise = view.noise_at_load
    upper = (view.expected > view.rest + 0.5 * view.span) & ~tied
    if beside.sum() < NOISY_RUN or upper.sum() < NOISY_RUN:
        return False
    return bool(np.median(noise[beside]) > AS_NOISY * np.median(noise[upper]))


def _hidden(view: View, tied: Mask, rail: float, inward: float) -> float:
    """How far the reading would have gone on within the runs of ties, by the static curve's slope beside the rail.

    Only load that rises within a run counts: friction holds the reading at its peak while load falls.
    """
    if int(tied.sum()) < LEAST_TIES:
        return 0.0
    starts, stops = runs_of(tied)
    long = stops - starts >= LEAST_RUN
    starts, stops = starts[long], stops[long]
    if starts.size == 0:
        return 0.0
    load = view.load.values
    # The echo of a corner may come a little late: so many samples are left out at both ends of a run.
    later = np.minimum(starts + LEAST_RUN, stops - 1)
    pairs = np.stack([later, np.maximum(stops - LEAST_RUN, later + 1)], axis=1).ravel()
    peaks = np.maximum.reduceat(np.append(load, load[-1]), pairs)[::2]
    rise = peaks - load[later] - 6.0 * view.load.quiet_noise
    at, middle, _ = view.curve
    beyond = inward * (middle - rail) > BAND * view.span
    if not beyond.any():
        return 0.0
    inner = at[np.flatnonzero(beyond)[-1 if inward < 0 else 0]]
    edge = float(np.median(load[starts])) if inward < 0 else float(np.median(load[stops - 1]))
    slope = BAND * view.span / max(abs(edge - inner), BAND * view.load_span)
    return float(slope * rise.max())
