"""Dropouts: the reading falls to the unloaded value, or to nothing, while the load stays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.diagnosis.integrity.fault import Array, Finding, Mask, runs_of
from smartshoe.diagnosis.integrity.held import held
from smartshoe.diagnosis.integrity.spikes import isolated_beside
from smartshoe.diagnosis.integrity.view import View

GONE = 0.25  # of the expected reading at most is left
LEAST_EXPECTED = 0.03  # of the span: below, a dropout cannot be told from rest
EDGE, BESIDE = 0.5, 5
LET_GO = 0.3  # of the span
BELOW_REST = 0.05  # of the span
PASSES = 2
LEVEL = 0.01  # of the span: within which dropouts end at one level


def dropouts(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``dropouts``; masked. Runs of two samples at most are dropouts only where their level is a common one."""
    if view.span == 0.0:
        return
    at = dropped(view)
    if not at.any():
        return
    for _ in range(PASSES):  # with those known cut out the noise is known better
        at |= _also_gone(view, at)
    starts, stops = runs_of(at)
    longest = int((stops - starts).max())
    if longest <= 2 and not _one_level(view, at):
        return
    yield Finding(
        "dropouts",
        view.whole(at),
        f"the reading drops out {starts.size} times, for up to"
        f" {float(np.max(view.time_s[stops - 1] - view.time_s[starts])) + view.step_s:.3g} s,"
        f" to about {float(np.median(view.sign * view.reading.values[at])):.4g}"
        f" {view.recording.sensor.unit.symbol}, while the load stays: {int(at.sum())} samples are left out",
        masks=True,
    )


def dropped(view: View) -> Mask:
    """(m,) samples of runs that are low although the load is on, or below rest, and begin and end abruptly."""
    y = view.reading.values
    above = view.expected - view.rest
    noise = view.reading.noise
    loaded = above > np.maximum(LEAST_EXPECTED * view.span, 8.0 * view.reading.quiet_noise)
    low = loaded & (y < view.rest + GONE * above)
    below = y < view.rest - np.maximum(BELOW_REST * view.span, 10.0 * noise)
    out = np.zeros(y.size, dtype=bool)
    jump, gap = view.jump, np.diff(view.time_s) > 1.6 * view.step_s
    lost = np.where(below, view.rest - y, view.expected - y)
    for first, stop in zip(*runs_of(low | below), strict=True):
        ends_open = stop == y.size or bool(gap[stop - 1])
        # Both edges make up most of what is lost.
        falls = first > 0 and jump[first - 1] < -EDGE * lost[first]
        rises = not ends_open and jump[stop - 1] > EDGE * lost[stop - 1]
        if falls and rises:
            out[first:stop] = True
        elif falls and (ends_open or not loaded[stop]):
            # The load went while the reading was gone. A contact that lets go at a low load jumps too, and a spike
            # just before seems to fall.
            before = y[max(first - BESIDE, 0) : first]
            out[first:stop] = (above[first] > LET_GO * view.span or below[first]) and _stood(
                before, y[first] + EDGE * lost[first]
            )
    return out


def _stood(beside: Array, level: float) -> bool:
    """Whether readings stood above a level: the second largest did, since one may be a spike and others be gone."""
    return bool(np.sort(beside)[max(beside.size - 2, 0)] > level)


def _also_gone(view: View, at: Mask) -> Mask:
    """(m,) samples at the level of known dropouts where load is too low to tell: isolated ones and held runs."""
    y = view.reading.values
    level = float(np.median(y[at]))
    near = np.abs(y - level) <= 3.0 * view.reading.quiet_noise + LEVEL * view.span
    alone = isolated_beside(view, at) & near
    values, count = np.unique(y[at], return_counts=True)
    common = values[count >= 0.02 * at.sum()]
    if common.size == 0 or common.size > 20:
        return alone
    repeated = held(view)
    repeated[:-1] |= repeated[1:] & (y[1:] == y[:-1])
    out: Mask = alone | (repeated & np.isin(y, common) & near)
    return out


def _one_level(view: View, at: Mask) -> bool:
    """Whether short falls end at one level, and at a level they would not by chance: dropouts, not spikes."""
    y = view.reading.values[at]
    before = view.expected[at]
    near = np.abs(y - np.median(y)) <= 3.0 * view.reading.quiet_noise + LEVEL * view.span
    return bool(at.sum() >= 3 and near.mean() > 0.6 and np.ptp(before) > 0.2 * view.span)
