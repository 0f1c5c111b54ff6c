"""A load that stands still while the reading goes on: a load cell at the end of its range, or a channel that froze."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.loading import turning_points
from smartshoe.signals.masks import runs_of


def still_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kinds ``saturation`` and ``held_samples``; masked: the load repeats one value while the reading goes on.

    At its largest value the load cell is at the end of its range; at another its channel froze. At its smallest value
    the load may be nothing, whatever the unit reads then.
    """
    load = view.load.values
    is_top, is_frozen = np.zeros(load.size, dtype=bool), np.zeros(load.size, dtype=bool)
    largest, smallest, hidden = float(load.max()), float(load.min()), 0.0
    for first, last in zip(*runs_of((np.diff(load) == 0.0) & ~view.gap), strict=True):
        if last - first < 2 * view.thresholds.few or load[first] == smallest or bad[first : last + 1].any():
            continue
        beyond = _rise_and_return(view, first, last)
        if load[first] == largest and beyond > 0.0:
            is_top[first : last + 1], hidden = True, max(hidden, beyond)
        elif _is_frozen(view, first, last):
            is_frozen[first : last + 1] = True
    if is_top.any():
        says = (
            f"the load repeats its largest value, {largest:.6g} N, at {int(is_top.sum())} samples"
            f" ({percent(float(is_top.mean()))}) while the reading rises on and comes back, by up to"
            f" {percent(hidden / view.span)} of its span: the load cell or its converter saturates there; these samples"
            " are left out, and what the unit remembers of them is not known: record again with a larger range"
        )
        yield _finding(view, "saturation", is_top, says)
    if is_frozen.any():
        starts, stops = runs_of(is_frozen)
        longest_s = float(np.max(view.time_s[stops - 1] - view.time_s[starts]))
        says = (
            f"the load repeats one value for up to {longest_s:.3g} s while the reading goes through much of its span:"
            f" its channel froze; {int(is_frozen.sum())} samples are left out, and what the unit remembers of them is"
            " not known: find what froze"
        )
        yield _finding(view, "held_samples", is_frozen, says)


def _finding(view: View, kind: str, at: Mask, says: str) -> Finding:
    return Finding(kind, view.whole(at), says, masks=True, no_load=view.whole(at))


def _rise_and_return(view: View, first: int, last: int) -> float:
    """By how much the reading rises above both of its values at the ends of a run of samples; 0 within the noise.

    It is 0 as well where a load that is held explains it: the reading may overshoot and relax, to end farther from
    where it began than it rose, but does not move before the load's next move as it does after.
    """
    y, given = view.reading.values, view.thresholds
    inside = y[first : last + 1]
    begin, end = (float(np.median(part)) for part in (inside[: given.few], inside[-given.few :]))
    noise = view.reading.largest * view.reading.quiet_noise
    rise = float(inside.max()) - max(begin, end)
    if rise <= max(abs(end - begin), noise + given.standing * view.span):
        return 0.0
    width = min(max((last - first) // 4, given.few), given.local)
    begins = first < width or _is_one_move(y[first - width : first], y[first : first + width], given.clear)
    ends = last + width >= y.size or _is_one_move(y[last - width : last], y[last : last + width], given.clear)
    return rise if begins and ends else 0.0


def _is_frozen(view: View, first: int, last: int) -> bool:
    """Whether the reading goes through at least half (`clear`) of its span in a run, as under no load that is held.

    It does so to and fro, and turns more often than an overshoot's once; or the load jumps at the end of the run as the
    reading does not.
    """
    inside, half = view.reading.values[first : last + 1], view.span / view.thresholds.clear
    if np.ptp(inside) < half:
        return False
    ends_in_a_jump = last < view.load.values.size - 1 and view.swapped().jump[last] != 0.0
    return bool(ends_in_a_jump or len(turning_points(inside, half)[1:-1]) > 1)


def _is_one_move(before: Array, after: Array, clear: float) -> bool:
    """Whether the readings ``before`` and ``after`` a moment, (k,) each, go one way and about as fast."""
    half = before.size // 2
    first, second = (float(part[half:].mean() - part[:half].mean()) for part in (before, after))
    return first * second > 0.0 and 1.0 / clear < second / first < clear
