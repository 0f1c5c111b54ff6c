"""Whether the reading follows the load at all, and in the right direction.

A reading follows where two things hold. The load explains enough of its variance, through a curve and first-order lags.
And the increments of both go together, over at least one time constant that a law may have: a random walk may be
explained by chance, but does not move along. A slow unit may answer changes of the load late instead
(`_answers_soon`), or be foretold in either half of its recording by what the other half tells (`_is_foretold`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._answers import answered_s, cut_short, in_bins
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._held import frozen
from smartshoe.integrity._plain_unit import delays_of, plain_units, squares_left, weights_of, without_past
from smartshoe.integrity._view import View
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.signals.lags import left_by, share_regressors

RISES_WITH_LOAD = ("pressure", "force")


def does_not_follow_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``does_not_follow_load``, fatal: the reading is constant, noise or another channel's, or froze (`frozen`).

    The sentence names the likeliest cause: a reading that does not move along, one that goes on while the load stands,
    or a load that is no more than noise.
    """
    all_samples = np.ones(len(view.recording), dtype=bool)
    reading = view.reading
    if float(np.ptp(reading.values)) == 0.0:
        says = "the reading is constant: is the unit connected, and is this its column?"
    else:
        explained, correlation = _followed_share(view) if view.load_span > 0.0 else (0.0, 0.0)
        follows = view.thresholds.follows
        if view.thresholds.clear * (1.0 - explained) <= view.thresholds.same or (
            explained >= follows and correlation > 0.0
        ):
            return  # few samples a ramp make a load look like noise, but noise is not followed so closely
        if explained >= follows and (_answers_soon(view) or _is_foretold(view)):
            return
        if (froze := frozen(view)) is not None:
            yield froze
            return
        memory_s = view.thresholds.memory_s
        says = (
            f"the reading does not follow the load: the load explains {100 * max(explained, 0.0):.0f} % of its"
            f" variance, with a curve and relaxations of {min(memory_s):g} to {max(memory_s):g} s allowed for; is this"
            " the unit that was pressed?"
        )
        if explained >= follows:
            says = (
                f"the reading does not follow the load throughout: the load explains {100 * explained:.0f} % of its"
                " variance, but only by slow changes; the two do not rise and fall together, and a model of one half of"
                " the recording does not predict the other half; were both recorded by one clock, and is this the unit"
                " that was pressed? (of a slow unit record several steps of the load)"
            )
        if view.thresholds.clear * (moved_at_rest := _share_moved_at_rest(view)) > 1.0:
            says = (
                f"the reading goes on while the load stands: it moves by {100 * moved_at_rest:.0f} % of its range more"
                f" than {max(memory_s):g} s after the load's last move; it may be the load's integral, a slower unit or"
                " a drift, and so few levels cannot tell which (record several levels, each for a while)"
            )
        if _load_is_noise(view):
            says = f"the load covers {view.load_span:.3g} N only, no more than its noise: load the unit over its range"
    yield Finding.fatal("does_not_follow_load", all_samples, says)


def wrong_sign(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``wrong_sign``: a load that is negative in compression (fatal), or a pressure or force that falls with load.

    Counts, volts and lengths may fall with load, and so may what creeps under a load that stands.
    """
    loads, all_samples = view.curve[0], np.ones(len(view.recording), dtype=bool)
    if loads[-1] < -view.thresholds.same * loads[0]:
        says = (
            f"the load is negative in compression (it runs from {loads[0]:.4g} to {loads[-1]:.4g} N): turn its sign,"
            " compression is positive (a minus before the column does so: --force '-COLUMN')"
        )
        yield Finding.fatal("wrong_sign", all_samples, says)
    elif view.sign < 0 and view.recording.sensor.unit.quantity in RISES_WITH_LOAD and not _load_is_noise(view):
        name = view.recording.sensor.name
        says = f"the {name} falls as the load rises: turn the sign of one of the two (load is positive in compression)"
        yield Finding("wrong_sign", all_samples, says)


def _load_is_noise(view: View) -> bool:
    """Whether the load covers no more than its noise: it stands, or hardly any of its samples are on a ramp.

    At least half of its variance must be between neighbouring samples (von Neumann 1941). Noise differs from its last
    value as much as from any other; a drive that switches within a sample, but is off for hours, does not.
    """
    load = view.load.values
    if view.load_span > 2.0 * view.load.largest * view.load.quiet_noise:
        return False
    white_variance = 0.5 * float(np.mean(np.diff(load) ** 2)) if load.size > 1 else 0.0
    return float(np.var(load)) <= view.thresholds.clear * white_variance


def _answers_soon(view: View) -> bool:
    """Whether changes of the load are answered within a time constant that a law may have (`answered_s`).

    So are those by a unit that lags longer than its load stays on one level. Its reading may be anywhere at any load,
    and moves against the load as often as with it.
    """
    for time_constant_s in view.thresholds.memory_s:
        width_s = max(view.step_s, time_constant_s / view.thresholds.few)
        late_s = answered_s(view, width_s)
        if late_s is not None and 0.0 <= late_s <= max(time_constant_s, width_s):
            return True
    return False


@on_one_thread
def _is_foretold(view: View) -> bool:
    """Whether a slow unit, as either half of the recording tells it, foretells most of the other half's reading.

    The unit is the plain one: the load, after some delay, and the same behind one lag, of whatever time the recording
    holds. Each half has an offset, a drift and a past of its own. A random course is often explained by chance, but
    what explains one half of it does not foretell the other: less than half of the squares (`clear`) must be left.
    """
    _, _, load, reading = in_bins(view, 1)
    if np.ptp(load) == 0.0:
        return False
    best = [(np.inf, np.inf, 0.0)] * 2  # of the unit told by either half: squares left there, in the other, and all
    for lag, columns in plain_units(load, reading, delays_of(load.size)):
        first, second = (without_past(half, lag) for half in (columns[: load.size // 2], columns[load.size // 2 :]))
        for place, (one, other) in enumerate(((first, second), (second, first))):
            weights = weights_of(one)
            if (left := squares_left(one, weights)) < best[place][0]:
                best[place] = left, squares_left(other, weights), float(np.sum(other[:, 2] ** 2))
    return view.thresholds.clear * sum(one[1] for one in best) < sum(one[2] for one in best)


def _share_moved_at_rest(view: View) -> float:
    """Largest share of the reading's range that it goes through in one stretch in which the load stands.

    The beginning of each stretch is left out, for as long as laws remember a load.
    """
    given = view.thresholds
    step_s, _, load, reading = in_bins(view, 1)
    standing_limit, largest, begin = given.standing * view.load_span, 0.0, 0
    settling = int(np.ceil(max(given.memory_s) / step_s))
    for stop in range(1, load.size + 1):
        if stop == load.size or abs(float(load[stop] - load[begin])) > standing_limit:
            settled = reading[begin + settling : stop]
            if settled.size > 2 * given.few:
                start, end = np.median(settled[: given.few]), np.median(settled[-given.few :])
                largest = max(largest, abs(float(end - start)))
            begin = stop
    return largest / max(float(np.ptp(reading)), largest, 1e-300)


def _followed_share(view: View) -> tuple[float, float]:
    """Share of the reading's variance that load explains, and how far increments of both correlate beyond chance.

    1. Both are averaged to ``bins`` points at most.
    2. The base is a straight line in time, since a drift is not of the load. It is the mean alone where the load only
       rises or only falls: drift and load cannot then be told apart.
    3. The share is that of the base's residual which a polynomial, the static curve and lags of the load take off.
    """
    n = view.reading.values.size
    width = max(1, n // view.thresholds.bins)
    count = n // width
    load = view.load.values[: count * width].reshape(count, width).mean(axis=1)
    reading = np.median(view.reading.values[: count * width].reshape(count, width), axis=1)
    if np.ptp(load) == 0.0:
        return 0.0, 0.0
    curve = np.interp(load, view.curve[0], view.curve[1])
    share = (load - load.min()) / np.ptp(load)
    of_load = share_regressors(share, width * view.step_s, view.thresholds.memory_s)
    base = np.stack([np.ones(count), np.linspace(-1.0, 1.0, count)], axis=1)
    if _is_monotone(load, view.thresholds):
        base = base[:, :1]
    full = np.column_stack([base, of_load, curve])
    base_residual, full_residual = (left_by(columns, reading) for columns in (base, full))
    total = float(np.dot(base_residual, base_residual))
    if total == 0.0:
        return 0.0, 0.0
    correlation = max(
        _correlation_of_increments(curve, reading, stride_s / (width * view.step_s), view.thresholds)
        for stride_s in view.thresholds.memory_s
    )
    return 1.0 - float(np.dot(full_residual, full_residual)) / total, correlation


def _is_monotone(load: Array, thresholds: Thresholds) -> bool:
    """Whether a load (n,) only rises or only falls, and stands nowhere: its ranks are nearly in the order of time."""
    from scipy.stats import rankdata

    order, ranks = np.arange(1.0, load.size + 1.0), rankdata(load)
    off = min(float(np.std(ranks - order)), float(np.std(ranks + order)))
    return off < thresholds.standing * load.size


def _correlation_of_increments(load: Array, reading: Array, stride: float, thresholds: Thresholds) -> float:
    """Correlation of the increments of both (n,) over ``stride`` points, less what chance reaches in so few points.

    The largest increments are clipped, so that a jump does not make up the correlation.
    """
    lag = min(max(1, round(stride)), load.size // 4)
    d_load, d_reading = (cut_short(one[lag:] - one[:-lag], thresholds) for one in (load, reading))
    norm = float(np.sqrt(np.dot(d_load, d_load) * np.dot(d_reading, d_reading)))
    if norm == 0.0:
        return 0.0
    return float(np.dot(d_load, d_reading) / norm - thresholds.clear / np.sqrt(load.size / lag))
