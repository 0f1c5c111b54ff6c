"""Held samples: a value repeated exactly where neither grid, nor rest, nor a rail would repeat it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.display import moment
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._scales import ROUNDING, SECOND_DIFFERENCE, turns
from smartshoe.integrity._view import View, toggling
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import UNIFORM_SD


def held_samples(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``held_samples``; masked, but for the first sample of a run, which was read."""
    at = held(view, bad)
    if not at.any():
        return
    starts, stops = runs_of(at)
    count, longest = int(at.sum()), int((stops - starts).max())
    said = "1 reading repeats the one before while the load moves: it is left out"
    if count > 1:
        said = (
            f"{count} readings repeat the one before while the load moves, up to {longest} in a row: they are left out"
        )
    yield Finding("held_samples", view.whole(at), said, masks=True)


def frozen(view: View) -> Finding | None:
    """Kind ``held_samples``: fatal; one value lasts longer than all else, while the load goes through most of its span.

    Asked where the load explains hardly any of the reading: that is why, and not the unit.
    """
    starts, stops = runs_of(np.diff(view.reading.values) == 0.0)
    if starts.size == 0:
        return None
    longest = int(np.argmax(stops - starts))
    first, last = int(starts[longest]), int(stops[longest])
    at = np.zeros(view.time_s.size, dtype=bool)
    at[first + 1 : last + 1] = True
    clear = view.thresholds.clear
    if clear * at.mean() < 1.0 or clear * float(np.ptp(view.load.values[first : last + 1])) < view.load_span:
        return None
    says = (
        f"the reading stands still from {moment(view.time_s[first])} to {moment(view.time_s[last])} s,"
        f" {100 * float(at.mean()):.0f} % of the samples, while the load moves: find what froze, and record it again"
    )
    return Finding.fatal("held_samples", view.whole(at), says)


def held(view: View, bad: Mask) -> Mask:
    """(m,) readings that repeat the last one although noise or motion must have changed it; none that is ``bad``.

    The chance of an honest run is at most that of noise staying within one grid step, however the step lies,
    while the signal moves on by d a sample. d is the least of three slopes: before the run, after it, and from its
    value to the next over its whole length, which a held run catches up with and a dead band or a friction does not.
    """
    reading = view.reading
    y = reading.values
    at = np.zeros(y.size, dtype=bool)
    # Runs at a dropout's value would pass for a logger that holds, and honest runs for its work.
    same = (np.diff(y) == 0.0) & ~view.gap & ~bad[1:] & ~bad[:-1]
    starts, stops = runs_of(same)  # samples starts..stops, stops included
    if starts.size == 0 or view.span == 0.0:
        return at
    log_chance = _log_chance(view, bad, starts, stops)
    sure = log_chance < _rarely_honest(log_chance, y.size, view.thresholds)
    sure |= _caught_up(view, starts, stops)
    sure |= _stuck(view, bad, starts, stops)
    for first, last in zip(starts[sure], stops[sure], strict=True):
        at[first + 1 : last + 1] = True
    return at


def _rarely_honest(log_chance: Array, count: int, thresholds: Thresholds) -> float:
    """Log of the chance below which hardly a run of ``count`` readings is honest.

    One of a false alarm in the whole recording; or, where there are more runs of a small chance than that chance
    allows (the logger does hold, and so often), one that leaves a ``faulty_share`` of honest ones among them.
    """
    increasing = np.sort(log_chance)
    honest = count * np.exp(increasing)
    beyond = np.arange(increasing.size) - honest
    many = beyond > largest_of_noise(count, thresholds) * np.sqrt(honest) + thresholds.few
    often = float(np.max(beyond, where=many, initial=0.0)) * thresholds.faulty_share
    return float(np.log(max(thresholds.false_alarm, often) / count))


def _log_chance(view: View, bad: Mask, starts: Index, stops: Index) -> Array:
    """(runs,) upper bound of the log chance that honest readings repeat so."""
    from scipy.special import erf

    reading = view.reading
    y, given = reading.values, view.thresholds
    repeats = stops - starts
    # Where no grid is known the smallest gap between readings is an upper bound of its step.
    step = reading.local_step[starts]
    step = np.maximum(np.where(step > 0.0, step, reading.least_gap[starts]), ROUNDING * view.span)
    least = np.minimum(_noise_beside(y, starts, stops, given.local // 4), view.noise_at_load[starts])
    # A rail repeats without being held. Between two levels an undithered signal toggles, which looks like half a step
    # of noise and says nothing.
    noisy = (least > toggling(given) * step) & ~_at_either_end(y, starts) & _alternates(y, starts, stops, given)
    within = np.ones(starts.size)
    within[noisy] = erf(np.maximum(step[noisy], _coincident_step(view, bad)) / (np.sqrt(8.0) * least[noisy]))
    within[noisy] = np.maximum(within[noisy], _common(y, starts[noisy], stops[noisy], given.local // 2))
    motion = _motion(view, starts, stops, step)
    beyond = np.maximum(0.5 * (motion * repeats - step), 0.0)
    many = np.maximum(beyond / (3.0 * np.maximum(motion, 1e-300)), 1.0)
    noise = np.maximum(reading.noise[starts], reading.noise[stops])
    width = np.hypot(noise, UNIFORM_SD * step)
    return repeats * np.log(np.maximum(within, 1e-300)) - many * (beyond / width) ** 2


def _at_either_end(y: Array, at: Index) -> Mask:
    """(runs,) whether readings are the least or the largest of all."""
    return np.asarray((y[at] == y.min()) | (y[at] == y.max()))


def _coincident_step(view: View, bad: Mask) -> float:
    """The grid's step by which noise brings readings that lie a few apart to the same value, each held one once.

    A grid that was calibrated or averaged afterwards is written with finer differences, and still repeats itself.
    """
    y = view.reading.values
    taken = ~bad & (np.diff(y, prepend=np.nan) != 0.0) & (y > y.min()) & (y < y.max()) & (view.reading.noise > 0.0)
    values, density = y[taken], 1.0 / (np.sqrt(4.0 * np.pi) * view.reading.noise[taken])
    lags = range(2, view.thresholds.few + 1)
    honest = sum(float(density[lag:].sum()) for lag in lags)
    return sum(int(np.count_nonzero(values[lag:] == values[:-lag])) for lag in lags) / honest if honest else 0.0


def _noise_beside(y: Array, starts: Index, stops: Index, beside: int) -> Array:
    """(runs,) the lesser noise just before and just after each run; a side that is held itself is left out.

    At either end of the recording it is 0: one side does not tell whether noise was there on the other.
    """
    second = np.diff(y, 2)
    power = np.concatenate([[0.0], np.cumsum(second**2)])
    moving = np.concatenate([[0], np.cumsum(second != 0.0)])
    least = np.full(starts.size, np.inf)
    for low, high in ((starts - beside, starts - 1), (stops, stops + beside - 1)):
        a, b = np.clip(low, 0, second.size), np.clip(high, 0, second.size)
        side = np.sqrt((power[b] - power[a]) / np.maximum(b - a, 1)) / SECOND_DIFFERENCE
        side = np.where(moving[b] - moving[a] < beside // 4, np.inf, side)
        least = np.where(b - a < beside // 2, 0.0, np.minimum(least, side))
    return np.where(np.isfinite(least), least, 0.0)


def _common(y: Array, starts: Index, stops: Index, beside: int) -> Array:
    """(runs,) share of the readings before and after each run that equal it: some converters favour a value."""
    away = np.arange(1, beside + 1)
    before, after = starts[:, None] - away, stops[:, None] + away
    equal = np.zeros(starts.size)
    there = np.zeros(starts.size)
    for place in (before, after):
        inside = (place >= 0) & (place < y.size)
        equal += (inside & (y[np.clip(place, 0, y.size - 1)] == y[starts][:, None])).sum(axis=1)
        there += inside.sum(axis=1)
    return equal / np.maximum(there, 1.0)


def _alternates(y: Array, starts: Index, stops: Index, thresholds: Thresholds) -> Mask:
    """(runs,) whether second differences change sign more often than not before and after: noise, not curvature."""
    beside = thresholds.local // 2
    counts = [np.concatenate([[0], np.cumsum(one)]) for one in turns(np.diff(y, 2))]
    turned, stayed = np.zeros(starts.size, dtype=np.int64), np.zeros(starts.size, dtype=np.int64)
    for low, high in ((starts - beside, starts - 2), (stops, stops + beside - 2)):
        a, b = (np.clip(one, 0, counts[0].size - 1) for one in (low, high))
        turned += counts[0][b] - counts[0][a]
        stayed += counts[1][b] - counts[1][a]
    return _is_noise(turned, stayed, thresholds) & (turned > thresholds.few)


def _is_noise(turned: Index | int, stayed: Index | int, thresholds: Thresholds) -> Mask:
    """Whether second differences change sign so much oftener than not: 2.7 times as often in white noise."""
    return np.asarray(turned > np.sqrt(thresholds.clear) * stayed)


def _motion(view: View, starts: Index, stops: Index, step: Array) -> Array:
    """(runs,) motion a sample across each run: the least of before, after and catching up; 0 where they disagree.

    Of a long run no more than the load's own move within either half explains: a step of load after the run is not
    motion within it.
    """
    y, load = view.reading.values, view.steady_load
    m = y.size
    repeats = stops - starts
    given = view.thresholds
    reach = np.clip(2 * repeats, given.few, given.local)
    low, high = np.maximum(starts - reach, 0), np.minimum(stops + 1 + reach, m - 1)
    after_first = np.minimum(stops + 1, m - 1)
    before = (y[starts] - y[low]) / np.maximum(starts - low, 1)
    after = (y[high] - y[after_first]) / np.maximum(high - after_first, 1)
    caught = (y[after_first] - y[starts]) / (repeats + 1)
    agree = (np.sign(before) == np.sign(caught)) & (np.sign(after) == np.sign(caught))
    least = np.minimum(np.minimum(np.abs(before), np.abs(after)), np.abs(caught))
    # What a friction or a dead band has held back is not caught up with.
    kept = given.clear * np.abs(caught) < np.minimum(np.abs(before), np.abs(after))
    long = repeats > given.few  # from there on the slopes on both sides say little of what lies between
    jump, onward = y[after_first] - y[stops], y[np.minimum(stops + 2, m - 1)] - y[after_first]
    kept |= long & (np.abs(jump) < given.clear * np.abs(onward))
    last = y[starts] - y[np.maximum(starts - 3, 0)]
    agree &= np.sign(last) == np.sign(caught)
    # A quarter is left out at both ends: the reading may follow a step of load a little late.
    edge = np.minimum(view.near, repeats // 4)
    a, b = starts + edge, stops - edge
    half = np.maximum((b - a + 1) // 2, 1)
    steady = np.minimum(np.abs(load[a + half] - load[a]), np.abs(load[b] - load[b - half])) / half
    noise = view.load.largest * view.load.quiet_noise
    steady -= (noise / np.sqrt(view.near) + view.load.step) / half
    # The mean over ``near`` samples brings a step beside a shorter run into it.
    span = np.maximum(b - a, 1)
    plain = (np.abs(view.load.values[b] - view.load.values[a]) - noise - view.load.step) / span
    moved = np.maximum(np.where(repeats > 2 * view.near, steady, plain), 0.0)
    least = np.where(long, np.minimum(least, given.clear * view.gain * moved), least)
    # A slope between two grid values is uncertain by a step.
    return np.where(agree & ~kept, np.maximum(least - step / reach, 0.0), 0.0)


def _caught_up(view: View, starts: Index, stops: Index) -> Mask:
    """(runs,) runs of three repeats and more that end in a jump which load does not explain, the load having moved.

    Three quarters of the run must have seen the move: a step of load just before the jump is a delay.
    """
    out = np.zeros(starts.size, dtype=bool)
    y, load, jump = view.reading.values, view.load.values, view.jump
    noise = view.load.largest * view.load.quiet_noise
    inside = ~_at_either_end(y, starts)  # there a dead band or saturation stands still
    for i in np.flatnonzero((stops - starts >= 3) & (stops < y.size - 1) & inside):
        first, last = int(starts[i]), int(stops[i])
        if jump[last] == 0.0:
            continue
        part = load[first : first + max(3 * (last - first) // 4, 1) + 1]
        moved = float(np.max(np.abs(part - part[0]))) - noise
        out[i] = view.thresholds.clear * view.gain * moved > abs(float(jump[last]))
    return out


def _stuck(view: View, bad: Mask, starts: Index, stops: Index) -> Mask:
    """(runs,) runs beside noise over which the load goes through more than a share of its span: half of it, by `clear`.

    Or through more than a quarter (`same`), where over no other run it goes through half as much. They need not end: a
    channel that freezes stays so until the recording does, and catches up with nothing. A dead band, a friction and a
    saturation stand still as well, but each time, for less of the load, or without noise; or at a rail, where the
    curve stands still as well.
    """
    y, load, given = view.reading.values, view.load.values, view.thresholds
    out = np.zeros(starts.size, dtype=bool)
    sound = np.sort(y[~bad])
    if sound.size <= 2 * given.few:
        return out
    inside = (y[starts] > sound[given.few - 1]) & (y[starts] < sound[-given.few])
    span = float(np.ptp(load))
    beside = given.few * given.local
    long = np.flatnonzero(stops - starts > given.few)
    passed = np.array([float(np.ptp(load[a : b + 1])) for a, b in zip(starts[long], stops[long], strict=True)])
    next_most = float(np.sort(passed)[-2]) if passed.size > 1 else 0.0  # of others than that which passes most
    is_far = (given.clear * passed > span) | (passed > max(given.same * span, given.clear * next_most))
    for i in long[is_far]:
        first, last = int(starts[i]), int(stops[i])
        if not (inside[i] or given.clear * float(np.ptp(view.expected[first : last + 1])) > view.span):
            continue
        near = max(y[max(first - beside, 0) : first + 1], y[last : last + beside + 1], key=len)
        if near.size <= given.local:
            continue
        bends = np.diff(near, 2)
        turned, stayed = (int(one.sum()) for one in turns(bends))
        alternates = bool(_is_noise(turned, stayed, given))
        least = toggling(given) * view.reading.local_step[first]
        out[i] = alternates and float(np.std(bends)) / SECOND_DIFFERENCE > least
    return out
