"""Spikes: one or two samples far from their neighbours on both sides, on the reading or on the load.

A spike comes back at once: the line through the samples before it and the line through those after it agree with each
other and not with it. After a jump that stays (a wall that snaps, a level that switches) the two lines do not agree,
however far it goes; that is no fault of single samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._scales import local_scale, own_corner
from smartshoe.integrity._view import Signal, View
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.masks import runs_of


def isolated(signal: Signal, corner: Array, scale: float, span: float, near: int, jitter: Array | float = 0.0) -> Mask:
    """(m,) samples off their five-point median by more than noise, grid and corners explain, and that come back.

    ``corner`` (m,): `View.load_corner` of the other channel; ``scale`` turns its unit into this signal's. ``jitter``:
    what an error of the sampling time may bring in. At the foot of a ramp a sample is its own median. The tip of a
    triangle is not, but has its corner in both channels. Nor is a jump against a ramp, which `comes_back` leaves out.
    """
    # Noise that was smoothed by a filter has small second differences. The scale of what the median leaves is larger.
    given = signal.thresholds
    noise = np.maximum(signal.noise, local_scale(signal.outlying, given, signal.step))
    allowed = signal.largest * noise + given.clear * (signal.local_step + given.clear * scale * corner) + jitter
    allowed += given.material * span + own_corner(signal.values, near)
    found: Mask = np.abs(signal.outlying) > allowed
    return comes_back(signal.values, found, given)


def comes_back(values: Array, found: Mask, thresholds: Thresholds) -> Mask:
    """(m,) those of the ``found`` samples whose neighbours before and after agree with each other and not with them.

    The lines before and after must differ by less than half (`clear`) of the sample's distance from either.
    """
    is_spike = np.zeros(found.size, dtype=bool)
    starts, stops = runs_of(found)
    if starts.size == 0:
        return is_spike
    few = thresholds.few
    at = np.flatnonzero(found)
    run_of = np.repeat(np.arange(starts.size), stops - starts)
    before = _line(values, found, starts[run_of, None] - np.arange(1, few + 1), at)
    after = _line(values, found, stops[run_of, None] + np.arange(few), at)
    # At either end of a recording one side must do.
    before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    off_before, off_after = values[at] - before, values[at] - after
    is_spike[at] = (off_before * off_after > 0.0) & (
        thresholds.clear * np.abs(before - after) < np.minimum(np.abs(off_before), np.abs(off_after))
    )
    return is_spike


def _line(values: Array, found: Mask, index: Index, at: Array | Index) -> Array:
    """(runs,) least-squares lines through samples ``index`` (runs, k), without ``found`` ones, taken at ``at`` (runs,).

    NaN where no more than half of the samples are left.
    """
    place = np.clip(index, 0, values.size - 1)
    weight = ((index >= 0) & (index < values.size) & ~found[place]).astype(float)
    count = weight.sum(axis=1)
    offset = index - at[:, None]
    total = np.maximum(count, 1.0)
    mean_offset, mean_value = (weight * offset).sum(axis=1) / total, (weight * values[place]).sum(axis=1) / total
    x, y = offset - mean_offset[:, None], values[place] - mean_value[:, None]
    slope = (weight * x * y).sum(axis=1) / np.maximum((weight * x * x).sum(axis=1), 1e-300)
    return np.where(count > 0.5 * index.shape[1], mean_value - slope * mean_offset, np.nan)


def lasting_jumps(view: View, found: Mask) -> Array:
    """(jumps,) sizes of the reading's jumps that load does not explain and that stay; ``found`` samples left out."""
    given = view.thresholds
    good = np.flatnonzero(~found)
    jump = np.flatnonzero(view.jump != 0.0)
    left = np.unique(np.clip(np.searchsorted(good, jump, "right") - 1, 0, good.size - 2))
    values = view.reading.values[good]
    none_found = np.zeros(values.size, dtype=bool)
    halfway = np.asarray(left + 0.5, dtype=float)
    before = _line(values, none_found, left[:, None] - np.arange(given.few), halfway)
    after = _line(values, none_found, left[:, None] + 1 + np.arange(given.few), halfway)
    size = after - before
    step = values[left + 1] - values[left]
    return np.abs(size[(size * step > 0.0) & (given.clear * np.abs(size) > np.abs(step))])


def isolated_beside(view: View, bad: Mask) -> Mask:
    """(m,) isolated readings once ``bad`` ones (m,) are cut out: a good sample between two bad ones is not isolated."""
    good = ~bad
    reading = Signal(view.reading.values[good], view.thresholds) if bad.any() else view.reading
    found = np.zeros(bad.size, dtype=bool)
    if good.any():
        jitter = view.jitter_reach[good]
        found[good] = isolated(reading, view.load_corner[good], view.gain, view.span, view.near, jitter)
    return found


def _has_neighbours(bad: Mask, few: int) -> Mask:
    """(m,) whether the good samples next to each lie within ``few`` samples: what comes back later was no spike."""
    good = np.flatnonzero(~bad)
    apart = np.diff(good, prepend=good[:1], append=good[-1:])
    beside = np.zeros(bad.size, dtype=bool)
    beside[good] = np.maximum(apart[:-1], apart[1:]) <= few
    return beside


def spikes(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``spikes``; masked. One finding for the reading, one for the reference load.

    A reading that jumps and stays as often as it jumps and returns has levels, some of them short, and no spikes.
    """
    if view.span == 0.0 or view.gain == 0.0:
        return
    alone = isolated_beside(view, bad)
    found = alone & _has_neighbours(bad, view.thresholds.few)
    if found.any():
        off = np.zeros(bad.size)
        off[~bad] = Signal(view.reading.values[~bad], view.thresholds).outlying
        usual_size = float(np.median(np.abs(off[found])))
        lasting_count = int((view.thresholds.clear * lasting_jumps(view, alone | bad) > usual_size).sum())
        if lasting_count <= runs_of(found)[0].size:
            yield _finding(view, found, off, view.span, "reading")
    load_gain = view.load_span / view.span
    on_load = isolated(view.load, view.reading_corner, view.thresholds.clear * load_gain, view.load_span, view.near)
    on_load &= ~_on_a_lasting_level(view.load)
    if on_load.any():
        # A sharp peak of the load may look like a spike of less than the span; one that exceeds the span is no load.
        beyond_span = on_load & (np.abs(view.load.outlying) > view.load_span)
        found_on_load = _finding(view, on_load, view.load.outlying, view.load_span, "reference load")
        yield replace(found_on_load, no_load=view.whole(beyond_span | _stands_alone(view.load, on_load)))


def _on_a_lasting_level(signal: Signal) -> Mask:
    """(m,) samples of a switched signal on levels at which it elsewhere stays for longer than a spike."""
    y = signal.values
    if not signal.is_switched:
        return np.zeros(y.size, dtype=bool)
    return np.isin(y, y[2:][(y[2:] == y[1:-1]) & (y[1:-1] == y[:-2])])


def _stands_alone(signal: Signal, found: Mask) -> Mask:
    """(m,) those of the ``found`` samples beside which the signal goes on as before, so that they are no peak of it.

    Beside a peak that falls between two samples the signal bends, by a share (`same`) of the spike's size at least.
    """
    given, y = signal.thresholds, signal.values
    is_alone = np.zeros(found.size, dtype=bool)
    for first, last in zip(*runs_of(found), strict=True):
        before, after = y[max(first - given.few, 0) : first], y[last : last + given.few]
        size = float(np.min(np.abs(signal.outlying[first:last])))
        if min(before.size, after.size) == given.few:
            bend = (after[-1] - after[0]) - (before[-1] - before[0])
            is_alone[first:last] = abs(float(bend)) < given.same * size
    return is_alone


def _finding(view: View, at: Mask, off: Array, span: float, what: str) -> Finding:
    """The finding of spikes ``at`` (m,), which are ``off`` (m,) from a signal of a ``span``; ``what`` is its name."""
    size = np.abs(off[at])
    largest = f"{percent(float(size.max()) / span)} of its span"
    said = f"an isolated spike of {largest}: it is left out"
    if size.size > 1:
        said = f"{size.size} isolated spikes, the largest of {largest}: they are left out"
    return Finding("spikes", view.whole(at), f"the {what} has {said}", masks=True)
