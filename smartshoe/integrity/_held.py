"""Held samples: the logger or its bus repeats a reading instead of taking a new one.

A reading may repeat for honest reasons: a coarse grid, a rest, a rail, a dead band. A run of equal readings is called
held where it passes one of three tests:

1. Noise and the signal's own motion would hardly ever leave so many readings equal (`_log_chance`).
2. The run ends in a jump that the load does not explain, and the load moved during the run (`_ends_in_a_jump`).
3. The load goes through much of its span during the run, and there is noise beside it (`_stands_under_moving_load`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.display import moment
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._noise_beside import alternates, is_noise, noise_beside, noise_under_motion
from smartshoe.integrity._scales import ROUNDING, SECOND_DIFFERENCE, turns
from smartshoe.integrity._view import View, toggling
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import UNIFORM_SD


def held_samples(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``held_samples``; masked, but for the first reading of each run, which was measured."""
    at = held(view, bad)
    if not at.any():
        return
    starts, stops = runs_of(at)
    count, longest = int(at.sum()), int((stops - starts).max())
    says = "1 reading repeats the one before while the load moves: it is left out"
    if count > 1:
        says = (
            f"{count} readings repeat the one before while the load moves, up to {longest} in a row: they are left out"
        )
    yield Finding("held_samples", view.whole(at), says, masks=True)


def frozen(view: View) -> Finding | None:
    """Kind ``held_samples``, fatal: the reading froze; or None.

    It froze where one value lasts for at least half (`clear`) of the samples, while the load goes through at least half
    of its span. Asked where the load explains hardly any of the reading: a frozen channel is then why, not the unit.
    """
    starts, stops = runs_of(np.diff(view.reading.values) == 0.0)
    if starts.size == 0:
        return None
    longest = int(np.argmax(stops - starts))
    first, last = int(starts[longest]), int(stops[longest])
    is_frozen = np.zeros(view.time_s.size, dtype=bool)
    is_frozen[first + 1 : last + 1] = True
    clear = view.thresholds.clear
    if clear * is_frozen.mean() < 1.0 or clear * float(np.ptp(view.load.values[first : last + 1])) < view.load_span:
        return None
    says = (
        f"the reading stands still from {moment(view.time_s[first])} to {moment(view.time_s[last])} s,"
        f" {100 * float(is_frozen.mean()):.0f} % of the samples, while the load moves: find what froze, and record"
        " it again"
    )
    return Finding.fatal("held_samples", view.whole(is_frozen), says)


def held(view: View, bad: Mask) -> Mask:
    """(m,) True at readings that repeat the one before although noise or motion must have changed it.

    Readings that are ``bad`` (m,) are in no run: runs at a dropout's value would pass for a logger that holds, and
    honest runs for its work.
    """
    reading = view.reading
    y = reading.values
    is_held = np.zeros(y.size, dtype=bool)
    repeats = (np.diff(y) == 0.0) & ~view.gap & ~bad[1:] & ~bad[:-1]
    starts, stops = runs_of(repeats)  # samples starts..stops, stops included
    if starts.size == 0 or view.span == 0.0:
        return is_held
    log_chance = _log_chance(view, bad, starts, stops)
    is_held_run = log_chance < _log_chance_limit(log_chance, y.size, view.thresholds)
    is_held_run |= _ends_in_a_jump(view, starts, stops)
    is_held_run |= _stands_under_moving_load(view, bad, starts, stops)
    for first, last in zip(starts[is_held_run], stops[is_held_run], strict=True):
        is_held[first + 1 : last + 1] = True
    return is_held


def _log_chance_limit(log_chance: Array, count: int, thresholds: Thresholds) -> float:
    """Log of the chance below which a run among ``count`` readings is taken as held.

    That chance leaves one false alarm in the whole recording. A logger that holds often has more runs of a small chance
    than honest readings allow. Then the limit is raised until a ``faulty_share`` of the runs below it may be honest.
    """
    ordered = np.sort(log_chance)
    honest = count * np.exp(ordered)
    in_excess = np.arange(ordered.size) - honest
    is_excess = in_excess > largest_of_noise(count, thresholds) * np.sqrt(honest) + thresholds.few
    allowed = float(np.max(in_excess, where=is_excess, initial=0.0)) * thresholds.faulty_share
    return float(np.log(max(thresholds.false_alarm, allowed) / count))


def _log_chance(view: View, bad: Mask, starts: Index, stops: Index) -> Array:
    """(runs,) upper bound of the log of the chance that honest readings repeat as in each run.

    1. Noise: each repeat needs the noise to stay within one step of the grid, however the steps lie about the signal.
       Where the motion hides the noise, it is seen in higher differences, and dead bands and friction are left out.
    2. Motion: over the whole run the signal moves on by `_motion_per_sample`, and noise would have to make up for what
       exceeds one step.
    """
    from scipy.special import erf

    reading = view.reading
    y, given = reading.values, view.thresholds
    repeats = stops - starts
    # Where no grid is found, its step is at most the smallest difference between readings.
    step = reading.local_step[starts]
    step = np.maximum(np.where(step > 0.0, step, reading.least_gap[starts]), ROUNDING * view.span)
    noise_sd = np.where(alternates(y, starts, stops, given), noise_beside(y, starts, stops, given.local // 4), 0.0)
    is_hidden = noise_sd == 0.0
    noise_sd[is_hidden] = noise_under_motion(y, starts, stops, is_hidden, given.material * view.span, given)
    noise_sd[is_hidden & _stands_by_itself(view, starts, stops, noise_sd)] = 0.0
    noise_sd = np.minimum(noise_sd, view.noise_at_load[starts])
    # The noise test says nothing at a rail, which repeats by itself, nor of a signal without noise that toggles between
    # two levels of the grid, which looks like noise of half a step.
    is_noisy = (noise_sd > toggling(given) * step) & ~_at_either_end(y, starts)
    chance = np.ones(starts.size)
    chance[is_noisy] = erf(
        np.maximum(step[is_noisy], _coincident_step(view, bad)) / (np.sqrt(8.0) * noise_sd[is_noisy])
    )
    chance[is_noisy] = np.maximum(
        chance[is_noisy], _share_of_equals(y, starts[is_noisy], stops[is_noisy], given.local // 2)
    )
    # Some converters repeat by themselves, as the readings that repeat once show.
    chance[is_hidden] = np.maximum(chance[is_hidden], np.count_nonzero(repeats == 1) / y.size)
    motion = _motion_per_sample(view, starts, stops, step)
    excess = np.maximum(0.5 * (motion * repeats - step), 0.0)
    # On a line that rises to ``excess`` the squares add up to those of so many samples that are all off by as much.
    samples_off = np.maximum(excess / (3.0 * np.maximum(motion, 1e-300)), 1.0)
    noise_at_ends = np.maximum(reading.noise[starts], reading.noise[stops])
    width = np.hypot(noise_at_ends, UNIFORM_SD * step)
    return repeats * np.log(np.maximum(chance, 1e-300)) - samples_off * (excess / width) ** 2


def _stands_by_itself(view: View, starts: Index, stops: Index, noise_sd: Array) -> Mask:
    """(runs,) whether the unit may have made a run by itself: by a dead band or a contact, or by friction.

    1. A dead band comes back to one value: another run stands there, for at least half as long (`clear`).
    2. What friction held back does not catch up: by the static curve the load has moved, by the first new reading, more
       than the noise, ``noise_sd`` (runs,), accounts for, and that reading makes up for less than half of it (`clear`).
    """
    y, clear = view.reading.values, view.thresholds.clear
    repeats = stops - starts
    values, value_of = np.unique(y[starts], return_inverse=True)
    longest = np.zeros(values.size, dtype=repeats.dtype)
    np.maximum.at(longest, value_of, repeats)
    long_runs = np.bincount(value_of, weights=clear * repeats >= longest[value_of])
    comes_back = (repeats < longest[value_of]) | (long_runs[value_of] > 1)
    new = np.minimum(stops + 1, y.size - 1)
    moved, made = view.expected[new] - view.expected[starts], y[new] - y[starts]
    is_held_back = np.abs(moved) > np.maximum(view.reading.largest * noise_sd, clear * np.sign(moved) * made)
    return np.asarray(comes_back | is_held_back)


def _at_either_end(y: Array, starts: Index) -> Mask:
    """(runs,) whether each run stands at the smallest or the largest of all readings."""
    return np.asarray((y[starts] == y.min()) | (y[starts] == y.max()))


def _coincident_step(view: View, bad: Mask) -> float:
    """The grid's step, estimated from how often readings that lie 2 to ``few`` apart are equal by coincidence.

    Noise of a known size brings two readings to one value the oftener, the coarser the grid. A grid that was calibrated
    or averaged after sampling is written with finer differences, and still shows by these coincidences. A run counts as
    one reading.
    """
    y = view.reading.values
    is_new = ~bad & (np.diff(y, prepend=np.nan) != 0.0) & (y > y.min()) & (y < y.max()) & (view.reading.noise > 0.0)
    values, density_at_equal = y[is_new], 1.0 / (np.sqrt(4.0 * np.pi) * view.reading.noise[is_new])
    lags = range(2, view.thresholds.few + 1)
    expected = sum(float(density_at_equal[lag:].sum()) for lag in lags)
    return sum(int(np.count_nonzero(values[lag:] == values[:-lag])) for lag in lags) / expected if expected else 0.0


def _share_of_equals(y: Array, starts: Index, stops: Index, width: int) -> Array:
    """(runs,) share of the ``width`` readings before and after each run that equal it.

    Some converters favour a value, which then repeats more often than noise on an even grid would have it.
    """
    distance = np.arange(1, width + 1)
    before, after = starts[:, None] - distance, stops[:, None] + distance
    equal = np.zeros(starts.size)
    inside_count = np.zeros(starts.size)
    for index in (before, after):
        inside = (index >= 0) & (index < y.size)
        equal += (inside & (y[np.clip(index, 0, y.size - 1)] == y[starts][:, None])).sum(axis=1)
        inside_count += inside.sum(axis=1)
    return equal / np.maximum(inside_count, 1.0)


def _motion_per_sample(view: View, starts: Index, stops: Index, step: Array) -> Array:
    """(runs,) size of the signal's motion a sample across each run, in the reading's unit; 0 where that is uncertain.

    1. Three slopes are taken: before the run, after it, and across it, from its value to the next over its length. All
       must have one sign; the least of their sizes is the motion.
    2. Across a held run the signal catches up at its end. What friction or a dead band has held back does not, so the
       motion is 0 where the slope across the run is clearly smaller than the other two.
    3. For a long run the load must also have moved within it (`_load_rate`): a step of load that follows the run is
       no motion within it.
    4. One ``step`` of the grid is taken off, since a slope between two values of a grid is uncertain by as much.
    """
    y, given = view.reading.values, view.thresholds
    m = y.size
    repeats = stops - starts
    reach = np.clip(2 * repeats, given.few, given.local)
    low, high = np.maximum(starts - reach, 0), np.minimum(stops + 1 + reach, m - 1)
    next_one = np.minimum(stops + 1, m - 1)
    before = (y[starts] - y[low]) / np.maximum(starts - low, 1)
    after = (y[high] - y[next_one]) / np.maximum(high - next_one, 1)
    across = (y[next_one] - y[starts]) / (repeats + 1)
    just_before = y[starts] - y[np.maximum(starts - 3, 0)]
    agree = (np.sign(before) == np.sign(across)) & (np.sign(after) == np.sign(across))
    agree &= np.sign(just_before) == np.sign(across)
    motion = np.minimum(np.minimum(np.abs(before), np.abs(after)), np.abs(across))
    is_held_back = given.clear * np.abs(across) < np.minimum(np.abs(before), np.abs(after))
    is_long = repeats > given.few  # the slopes on both sides then say little of what lies between
    jump, next_move = y[next_one] - y[stops], y[np.minimum(stops + 2, m - 1)] - y[next_one]
    is_held_back |= is_long & (np.abs(jump) < given.clear * np.abs(next_move))
    load_motion = given.clear * view.gain * _load_rate(view, starts, stops)
    motion = np.where(is_long, np.minimum(motion, load_motion), motion)
    return np.where(agree & ~is_held_back, np.maximum(motion - step / reach, 0.0), 0.0)


def _load_rate(view: View, starts: Index, stops: Index) -> Array:
    """(runs,) size of the load's motion a sample within each run, noise and one grid step left out.

    Of a run longer than the smoothing the lesser of its two halves, of the smoothed load. In a shorter one smoothing
    would bring in a step of load beside the run: there it is the difference of the load itself from end to end.
    """
    # A quarter is left out at both ends: the reading may follow a step of load a little late.
    repeats, load = stops - starts, view.steady_load
    edge = np.minimum(view.near, repeats // 4)
    first, last = starts + edge, stops - edge
    half = np.maximum((last - first + 1) // 2, 1)
    by_halves = np.minimum(np.abs(load[first + half] - load[first]), np.abs(load[last] - load[last - half])) / half
    noise = view.load.largest * view.load.quiet_noise
    by_halves -= (noise / np.sqrt(view.near) + view.load.step) / half
    length = np.maximum(last - first, 1)
    by_ends = (np.abs(view.load.values[last] - view.load.values[first]) - noise - view.load.step) / length
    return np.asarray(np.maximum(np.where(repeats > 2 * view.near, by_halves, by_ends), 0.0))


def _ends_in_a_jump(view: View, starts: Index, stops: Index) -> Mask:
    """(runs,) runs of three repeats and more that end in a jump which the load does not explain, while the load moved.

    Three quarters of the run must have seen the load move: a step of load just before the jump is a delay.
    """
    is_held = np.zeros(starts.size, dtype=bool)
    y, load, jump = view.reading.values, view.load.values, view.jump
    noise = view.load.largest * view.load.quiet_noise
    is_inside = ~_at_either_end(y, starts)  # at the ends a dead band or saturation stands still
    for i in np.flatnonzero((stops - starts >= 3) & (stops < y.size - 1) & is_inside):
        first, last = int(starts[i]), int(stops[i])
        if jump[last] == 0.0:
            continue
        load_within = load[first : first + max(3 * (last - first) // 4, 1) + 1]
        moved = float(np.max(np.abs(load_within - load_within[0]))) - noise
        is_held[i] = view.thresholds.clear * view.gain * moved > abs(float(jump[last]))
    return is_held


def _stands_under_moving_load(view: View, bad: Mask, starts: Index, stops: Index) -> Mask:
    """(runs,) runs beside noise, over which the load goes through a large share of its span.

    The share is a half (by `clear`); or a quarter (`same`), where over no other run the load goes through half as much.
    Such a run need not end: a channel that freezes may stay so until the recording stops.

    A dead band, friction and saturation stand still as well, but each time, or for less of the load, or without noise.
    A run at the smallest or largest readings counts only where the static curve moves during it, which it does not at a
    rail.
    """
    y, load, given = view.reading.values, view.load.values, view.thresholds
    is_held = np.zeros(starts.size, dtype=bool)
    ordered = np.sort(y[~bad])
    if ordered.size <= 2 * given.few:
        return is_held
    is_inside = (y[starts] > ordered[given.few - 1]) & (y[starts] < ordered[-given.few])
    span = float(np.ptp(load))
    width = given.few * given.local
    long = np.flatnonzero(stops - starts > given.few)
    load_ranges = np.array([float(np.ptp(load[a : b + 1])) for a, b in zip(starts[long], stops[long], strict=True)])
    second_largest = float(np.sort(load_ranges)[-2]) if load_ranges.size > 1 else 0.0
    is_far = (given.clear * load_ranges > span) | (load_ranges > max(given.same * span, given.clear * second_largest))
    for i in long[is_far]:
        first, last = int(starts[i]), int(stops[i])
        if not (is_inside[i] or given.clear * float(np.ptp(view.expected[first : last + 1])) > view.span):
            continue
        neighbours = max(y[max(first - width, 0) : first + 1], y[last : last + width + 1], key=len)
        if neighbours.size <= given.local:
            continue
        bends = np.diff(neighbours, 2)
        turned, stayed = (int(one.sum()) for one in turns(bends))
        is_alternating = bool(is_noise(turned, stayed, given))
        least_noise = toggling(given) * view.reading.local_step[first]
        is_held[i] = is_alternating and float(np.std(bends)) / SECOND_DIFFERENCE > least_noise
    return is_held
