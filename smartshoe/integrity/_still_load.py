"""A load that stands still while the reading goes on: a load cell at the end of its range, or a channel that froze."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.loading import turning_points
from smartshoe.signals.masks import runs_of


def still_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kinds ``saturation`` and ``held_samples``; masked: the load stands while the reading goes on.

    At its largest value the load cell is at the end of its range; at another, repeated exactly, its channel froze. At
    its smallest value the load may be nothing, whatever the unit reads then.
    """
    at_end, hidden = _at_the_cells_end(view, bad)
    if at_end.any():
        largest = float(view.load.values.max())
        meanwhile = f" while the reading rises on and comes back, by up to {percent(hidden / view.span)} of its span"
        says = (
            f"the load stands at its largest value, {largest:.6g} N, at {int(at_end.sum())} samples"
            f" ({percent(float(at_end.mean()))}){meanwhile if hidden > 0.0 else ', as in another recording'}: the load"
            " cell or its converter saturates there; these samples are left out, and what the unit remembers of them is not"
            " known: record again with a larger range"
        )
        yield replace(_finding(view, "saturation", at_end, says), load_end=largest)
    frozen = _frozen(view, bad | at_end)
    if frozen.any():
        starts, stops = runs_of(frozen)
        longest_s = float(np.max(view.time_s[stops - 1] - view.time_s[starts]))
        says = (
            f"the load repeats one value for up to {longest_s:.3g} s while the reading goes through much of its span:"
            f" its channel froze; {int(frozen.sum())} samples are left out, and what the unit remembers of them is not"
            " known: find what froze"
        )
        yield _finding(view, "held_samples", frozen, says)


def _at_the_cells_end(view: View, bad: Mask) -> tuple[Mask, float]:
    """(m,) samples whose load is at the cell's end, and by how much the reading rises on there; 0 where none shows it.

    One run of them that shows it, here or in another recording, tells it of all: also of holds beyond that end.
    """
    load, largest = view.load.values, float(view.load.values.max())
    reach = 2.0 * view.load.largest * view.load.quiet_noise
    is_top = (load >= largest - reach) & ~bad
    long = [(a, b) for a, b in zip(*runs_of(is_top), strict=True) if b - a > 2 * view.thresholds.few]
    hidden = max((_rise_and_return(view, a, b - 1, reach) for a, b in long), default=0.0)
    is_known = bool(np.any(np.abs(view.ends.loads - largest) <= reach))
    return is_top & (hidden > 0.0 or is_known), hidden


def _frozen(view: View, bad: Mask) -> Mask:
    """(m,) samples of a load's channel that froze."""
    load = view.load.values
    is_frozen, smallest = np.zeros(load.size, dtype=bool), float(load.min())
    for first, last in zip(*runs_of((np.diff(load) == 0.0) & ~view.gap), strict=True):
        is_long = last - first >= 2 * view.thresholds.few and not bad[first : last + 1].any()
        if is_long and load[first] != smallest and _is_frozen(view, first, last):
            is_frozen[first : last + 1] = True
    return is_frozen


def _finding(view: View, kind: str, at: Mask, says: str) -> Finding:
    return Finding(kind, view.whole(at), says, masks=True, no_load=view.whole(at))


def _rise_and_return(view: View, first: int, last: int, reach: float) -> float:
    """By how much the reading rises above both of its values at the ends of a run of samples; 0 within the noise.

    Within a ``reach`` of the load the run may have risen and fallen by itself.

    It is 0 as well where a load that is held explains it: the reading may overshoot and relax, to end farther from
    where it began than it rose, but does not move before the load's next move as it does after.
    """
    y, given = view.reading.values, view.thresholds
    inside = y[first : last + 1]
    begin, end = (float(np.median(part)) for part in (inside[: given.few], inside[-given.few :]))
    noise = view.reading.largest * view.reading.quiet_noise + view.gain * reach
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
