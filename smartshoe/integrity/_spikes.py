"""Spikes: one or two samples far from their neighbours on both sides, on the reading or on the load.

A spike comes back at once: the line through what is before it and the line through what is after it agree with each
other and not with it. A jump that stays (a wall that snaps, a level that switches) leaves one of the two lines on its
own, however far it goes, and is no fault of single samples.
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
    """(m,) samples off their five-point median by more than noise, grid, own corners and the other channel's.

    ``corner`` (m,) is the other channel's `View.load_corner`; ``scale`` turns its unit into this signal's. ``jitter``
    is what an error of the sampling time may bring in. The foot of a ramp leaves its median alone; the tip of a
    triangle has its corner in both; a jump against a ramp, which the median does not follow, stays.
    """
    # Noise that a filter has smoothed has small second differences: then the residual's own scale is the larger.
    given = signal.thresholds
    noise = np.maximum(signal.noise, local_scale(signal.outlying, given, signal.step))
    allowed = signal.largest * noise + given.clear * (signal.local_step + given.clear * scale * corner) + jitter
    allowed += given.material * span + own_corner(signal.values, near)
    found: Mask = np.abs(signal.outlying) > allowed
    return comes_back(signal.values, found, given)


def comes_back(values: Array, found: Mask, thresholds: Thresholds) -> Mask:
    """(m,) those ``found`` samples whose neighbours before and after lie on one level, and they do not."""
    out = np.zeros(found.size, dtype=bool)
    starts, stops = runs_of(found)
    if starts.size == 0:
        return out
    few = thresholds.few
    at = np.flatnonzero(found)
    run = np.repeat(np.arange(starts.size), stops - starts)
    before = _line(values, found, starts[run, None] - np.arange(1, few + 1), at)
    after = _line(values, found, stops[run, None] + np.arange(few), at)
    # At either end of a recording one side must do.
    before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    up, down = values[at] - before, values[at] - after
    out[at] = (up * down > 0.0) & (thresholds.clear * np.abs(before - after) < np.minimum(np.abs(up), np.abs(down)))
    return out


def _line(values: Array, found: Mask, index: Index, at: Array | Index) -> Array:
    """(runs,) least-squares lines through samples ``index`` (runs, k), found ones left out, at ``at`` (runs,).

    NaN where no more than half are left.
    """
    place = np.clip(index, 0, values.size - 1)
    weight = ((index >= 0) & (index < values.size) & ~found[place]).astype(float)
    count = weight.sum(axis=1)
    away = index - at[:, None]
    total = np.maximum(count, 1.0)
    x0, y0 = (weight * away).sum(axis=1) / total, (weight * values[place]).sum(axis=1) / total
    x, y = away - x0[:, None], values[place] - y0[:, None]
    slope = (weight * x * y).sum(axis=1) / np.maximum((weight * x * x).sum(axis=1), 1e-300)
    return np.where(count > 0.5 * index.shape[1], y0 - slope * x0, np.nan)


def lasting_jumps(view: View, found: Mask) -> Array:
    """(jumps,) sizes of jumps of the reading that load does not explain and that stay; ``found`` ones are left out."""
    given = view.thresholds
    good = np.flatnonzero(~found)
    jump = np.flatnonzero(view.jump != 0.0)
    # Between the good samples on either side.
    left = np.unique(np.clip(np.searchsorted(good, jump, "right") - 1, 0, good.size - 2))
    values = view.reading.values[good]
    nothing = np.zeros(values.size, dtype=bool)
    middle = np.asarray(left + 0.5, dtype=float)
    before = _line(values, nothing, left[:, None] - np.arange(given.few), middle)
    after = _line(values, nothing, left[:, None] + 1 + np.arange(given.few), middle)
    size = after - before
    step = values[left + 1] - values[left]
    return np.abs(size[(size * step > 0.0) & (given.clear * np.abs(size) > np.abs(step))])


def isolated_beside(view: View, bad: Mask) -> Mask:
    """(m,) isolated readings of what is left when ``bad`` ones are cut out: a good one between two of them is none."""
    good = ~bad
    reading = Signal(view.reading.values[good], view.thresholds) if bad.any() else view.reading
    found = np.zeros(bad.size, dtype=bool)
    if good.any():
        jitter = view.jitter_reach[good]
        found[good] = isolated(reading, view.load_corner[good], view.gain, view.span, view.near, jitter)
    return found


def spikes(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``spikes``; masked. One finding for the reading, one for the reference load.

    A reading that jumps to stay as often as it jumps to return has levels, some of them short, and no spikes.
    """
    if view.span == 0.0 or view.gain == 0.0:
        return
    found = isolated_beside(view, bad)
    if found.any():
        usual = float(np.median(np.abs(view.reading.outlying[found])))
        lasting = int((view.thresholds.clear * lasting_jumps(view, found | bad) > usual).sum())
        if lasting <= runs_of(found)[0].size:
            yield _finding(view, found, view.reading, view.span, "reading")
    load_gain = view.load_span / view.span
    on_load = isolated(view.load, view.reading_corner, view.thresholds.clear * load_gain, view.load_span, view.near)
    on_load &= ~_on_a_level_of_its_own(view.load)
    if on_load.any():
        # A peak between two samples looks like a spike of a part of the span; what is beyond all of it is none.
        beyond = on_load & (np.abs(view.load.outlying) > view.load_span)
        found_on_load = _finding(view, on_load, view.load, view.load_span, "reference load")
        yield replace(found_on_load, no_load=view.whole(beyond | _stands_alone(view.load, on_load)))


def _on_a_level_of_its_own(signal: Signal) -> Mask:
    """(m,) samples of a signal that is switched, on levels where it also stays for longer than a spike does."""
    y = signal.values
    if not signal.is_switched:
        return np.zeros(y.size, dtype=bool)
    return np.isin(y, y[2:][(y[2:] == y[1:-1]) & (y[1:-1] == y[:-2])])


def _stands_alone(signal: Signal, found: Mask) -> Mask:
    """(m,) those ``found`` beside which the signal goes on as before, as it does not where it passes a peak.

    Between two samples, of which either side would lead to it: they bend by a part (``same``) of it at least.
    """
    given, y = signal.thresholds, signal.values
    out = np.zeros(found.size, dtype=bool)
    for first, last in zip(*runs_of(found), strict=True):
        before, after = y[max(first - given.few, 0) : first], y[last : last + given.few]
        size = float(np.min(np.abs(signal.outlying[first:last])))
        if min(before.size, after.size) == given.few:
            bend = (after[-1] - after[0]) - (before[-1] - before[0])
            out[first:last] = abs(float(bend)) < given.same * size
    return out


def _finding(view: View, at: Mask, signal: Signal, span: float, what: str) -> Finding:
    size = np.abs(signal.outlying[at])
    largest = f"{percent(float(size.max()) / span)} of its span"
    said = f"an isolated spike of {largest}: it is left out"
    if size.size > 1:
        said = f"{size.size} isolated spikes, the largest of {largest}: they are left out"
    return Finding("spikes", view.whole(at), f"the {what} has {said}", masks=True)
