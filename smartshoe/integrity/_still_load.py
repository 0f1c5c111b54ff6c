"""A load that stands still while the reading goes on: a load cell at the end of its range, or a channel that froze."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import Signal, View
from smartshoe.signals.loading import turning_points
from smartshoe.signals.masks import level_stretches, runs_of


def still_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kinds ``saturation`` and ``held_samples``; masked: the load stands while the reading goes on.

    At its largest value the load cell is at the end of its range; at another its channel froze. A load that is switched
    between a few levels stands and jumps for good reasons.
    """
    if Signal(view.recording.load.values[view.index], view.thresholds).is_switched:  # on its own clock
        return
    at_end, hidden = _at_the_cells_end(view, bad)
    if at_end.any():
        largest = float(view.load.values.max())
        meanwhile = ", as in another recording"
        if hidden > 0.0:
            meanwhile = (
                f" while the reading rises on and comes back, by up to {percent(hidden / view.span)} of its span"
            )
        says = (
            f"the load stands at its largest value, {largest:.6g} N, at {int(at_end.sum())} samples"
            f"{meanwhile}: the load cell or its converter saturates there; these samples are left out, and what the"
            " unit remembers of them is not known: record again with a larger range"
        )
        yield replace(_finding(view, "saturation", at_end, says), load_end=largest)
    frozen = _frozen(view, bad | at_end)
    if frozen.any():
        starts, stops = runs_of(frozen)
        longest_s = float(np.max(view.time_s[stops - 1] - view.time_s[starts]))
        says = (
            f"the load stands at one value for up to {longest_s:.3g} s while the reading goes through much of its span:"
            f" its channel froze; {int(frozen.sum())} samples are left out, and what the unit remembers of them is not"
            " known: find what froze"
        )
        yield _finding(view, "held_samples", frozen, says)


def _at_the_cells_end(view: View, bad: Mask) -> tuple[Mask, float]:
    """(m,) samples whose load is at the cell's end, and by how much the reading rises on there; 0 where none shows it.

    One run of them that shows it, here or in another recording, tells it of all: also of holds beyond that end.
    """
    load, largest = view.load.values, float(view.load.values.max())
    reach = _reach(view)
    is_top = (load >= largest - reach) & ~bad
    long = [(a, b) for a, b in zip(*runs_of(is_top), strict=True) if b - a > 2 * view.thresholds.few]
    hidden = max((_rise_and_return(view, a, b - 1, reach) for a, b in long), default=0.0)
    is_known = bool(np.any(np.abs(view.ends.loads - largest) <= reach))
    return is_top & (hidden > 0.0 or is_known), hidden


def _frozen(view: View, bad: Mask) -> Mask:
    """(m,) samples of a load's channel that froze: it stands within its noise."""
    load, reach = view.load.values, _reach(view)
    is_frozen, smallest = np.zeros(load.size, dtype=bool), float(load.min())
    breaks_off = np.append(False, view.gap | (np.abs(np.diff(load)) > reach))
    stands = level_stretches(load, 2 * view.thresholds.few + 1, reach) & ~breaks_off
    swapped = view.swapped()
    for first, stop in zip(*runs_of(stands), strict=True):
        level = float(np.median(load[first:stop]))
        near = first + np.flatnonzero(np.abs(load[first:stop] - level) <= reach)  # without the end of a ramp beside it
        is_level = near.size > (1.0 - view.thresholds.faulty_share) * (stop - first)
        if is_level and _is_frozen(view, swapped, near, bad, may_be_nothing=level <= smallest + reach):
            is_frozen[near] = True
    return is_frozen & ~bad


def _reach(view: View) -> float:
    """By how much the load's noise may move it, from its least to its most, in N; 0 where more than standing still.

    A load that is noisier stands where it repeats one value.
    """
    reach = 2.0 * view.load.largest * view.load.quiet_noise
    return reach if reach <= view.thresholds.standing * view.load_span else 0.0


def _finding(view: View, kind: str, at: Mask, says: str) -> Finding:
    return Finding(kind, view.whole(at), says, masks=True, no_load=view.whole(at))


def _rise_and_return(view: View, first: int, last: int, reach: float) -> float:
    """By how much the reading rises above both of its values at the ends of a run of samples; 0 within the noise.

    Within a ``reach`` the load may have risen and fallen itself. It is 0 as well where a load that is held explains it:
    the reading may overshoot and relax, to end farther from where it began than it rose, but does not move before the
    load's next move as it does after.
    """
    y, given = view.reading.values, view.thresholds
    inside = _without_spikes(view, y[first : last + 1])
    begin, end = (float(np.median(part)) for part in (inside[: given.few], inside[-given.few :]))
    noise = view.reading.largest * view.reading.quiet_noise + view.gain * reach
    rise = float(inside.max()) - max(begin, end)
    if rise <= max(abs(end - begin), noise + given.standing * view.span):
        return 0.0
    width = min(max((last - first) // 4, given.few), given.local)
    begins = first < width or _is_one_move(y[first - width : first], y[first : first + width], given.clear)
    ends = last + width >= y.size or _is_one_move(y[last - width : last], y[last : last + width], given.clear)
    return rise if begins and ends else 0.0


def _is_frozen(view: View, swapped: View, at: Index, bad: Mask, *, may_be_nothing: bool) -> bool:
    """Whether the reading goes through at least half (`clear`) of its span ``at`` (k,), as under no load that is held.

    Under a load that is held a reading moves at once, if slowly, and turns once at most, as it overshoots. So it turns
    twice, if the load is not such that it ``may_be_nothing`` while the unit bears another; or it turns, or has stood
    before it moves, and the load (the reading of ``swapped``) then jumps as the reading does not. Readings that are
    ``bad`` (m,) tell nothing.
    """
    given, half = view.thresholds, view.span / view.thresholds.clear
    first, last = int(at[0]), int(at[-1])
    inside = view.reading.values[first : last + 1][~bad[first : last + 1]]
    if inside.size == 0 or np.ptp(inside) < half:  # as in most runs, before spikes are looked for
        return False
    inside = _without_spikes(view, inside)
    if np.ptp(inside) < half:
        return False
    turns = len(turning_points(inside, half)[1:-1])
    if turns > 1 and not may_be_nothing:
        return True
    soon = inside[: 1 + round(given.settled_s / view.step_s)]
    jumps = last < view.load.values.size - 1 and swapped.jump[last] != 0.0
    return bool(jumps and (turns > 0 or np.ptp(soon) < given.standing * view.span))


def _without_spikes(view: View, readings: Array) -> Array:
    """(k,) running medians of ``readings``."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(readings, 2 * view.thresholds.few + 1, mode="nearest"))


def _is_one_move(before: Array, after: Array, clear: float) -> bool:
    """Whether the readings ``before`` and ``after`` a moment, (k,) each, go one way and about as fast."""
    half = before.size // 2
    first, second = (float(part[half:].mean() - part[:half].mean()) for part in (before, after))
    return first * second > 0.0 and 1.0 / clear < second / first < clear
