"""Whether the reading follows the load at all, and in the right direction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._answers import answered_s, binned, cut_short
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._held import frozen
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity._view import View
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.lags import lagged

RISES_WITH_LOAD = ("pressure", "force")


def does_not_follow_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``does_not_follow_load``: fatal; the reading is constant, noise, or another channel's."""
    whole = np.ones(len(view.recording), dtype=bool)
    reading = view.reading
    if float(np.ptp(reading.values)) == 0.0:
        says = "the reading is constant: is the unit connected, and is this its column?"
    else:
        share, moves_with = _followed_share(view) if view.load_span > 0.0 else (0.0, 0.0)
        # A walk at random may explain half of the variance, but does not move along.
        follows = view.thresholds.follows
        if view.thresholds.clear * (1.0 - share) <= view.thresholds.same or (share >= follows and moves_with > 0.0):
            return  # of a few samples a ramp, a load looks like noise: what is followed is none
        if share >= follows and _answers(view):
            return
        if (stands_still := frozen(view)) is not None:
            yield stands_still
            return
        memory_s = view.thresholds.memory_s
        says = (
            f"the reading does not follow the load: load explains {100 * max(share, 0.0):.0f} % of its variance, a"
            f" curve and relaxations of {min(memory_s):g} to {max(memory_s):g} s allowed; is this the unit that was"
            " pressed?"
        )
        if share >= follows:
            says = (
                f"the reading does not move with the load, though what is slow in it explains {100 * share:.0f} % of"
                f" its variance: were both recorded by one clock, is this the unit that was pressed, and does it answer"
                f" within {max(memory_s):g} s (of a slower one record several steps of the load)?"
            )
        if view.thresholds.clear * (went_on := _goes_on(view)) > 1.0:
            says = (
                f"the reading goes on while the load stands: {100 * went_on:.0f} % of its range is gone through"
                f" more than {max(memory_s):g} s after the load's last move; whether it is the load's integral, a"
                " slower unit or a drift cannot be told from so few levels (record several, each for a while)"
            )
        if _is_noise(view):
            says = f"the load covers {view.load_span:.3g} N only, no more than its noise: load the unit over its range"
    yield Finding.fatal("does_not_follow_load", whole, says)


def wrong_sign(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``wrong_sign``: a load that is negative in compression, or a pressure (or force) that falls as load rises.

    Counts, volts and lengths may fall, and so may what creeps under a load that stands.
    """
    at, whole = view.curve[0], np.ones(len(view.recording), dtype=bool)
    if at[-1] < -view.thresholds.same * at[0]:
        says = (
            f"the load is negative in compression (it runs from {at[0]:.4g} to {at[-1]:.4g} N): turn its sign,"
            " compression is positive (a minus before the column does so: --force '-COLUMN')"
        )
        yield Finding.fatal("wrong_sign", whole, says)
    elif view.sign < 0 and view.recording.sensor.unit.quantity in RISES_WITH_LOAD and not _is_noise(view):
        name = view.recording.sensor.name
        says = f"the {name} falls as the load rises: turn the sign of one of the two (load is positive in compression)"
        yield Finding("wrong_sign", whole, says)


def _is_noise(view: View) -> bool:
    """Whether the load covers no more than its noise: it stands, or hardly any of its samples are on a ramp.

    And at least half of its variance is in its steps (von Neumann 1941): noise is as far from its last value as from
    any other, a drive that is anywhere within a sample, but off for hours, is not.
    """
    load = view.load.values
    if view.load_span > 2.0 * view.load.largest * view.load.quiet_noise:
        return False
    white = 0.5 * float(np.mean(np.diff(load) ** 2)) if load.size > 1 else 0.0
    return float(np.var(load)) <= view.thresholds.clear * white


def _answers(view: View) -> bool:
    """Whether what the load does anew is answered, and soon: a unit that lags by longer than its load stays.

    Its reading is anywhere at any load, and moves against it as often as with it.
    """
    for time_constant_s in view.thresholds.memory_s:
        width_s = max(view.step_s, time_constant_s / view.thresholds.few)
        late_s = answered_s(view.time_s, view.load.values, view.reading.values, width_s, view.thresholds)
        if late_s is not None and 0.0 <= late_s <= max(time_constant_s, width_s):
            return True
    return False


def _goes_on(view: View) -> float:
    """Share of the reading's range that it goes through while the load stands, once what laws remember by is over.

    The largest of any stretch in which the load stays within what counts as standing.
    """
    given = view.thresholds
    step_s = float(view.time_s[-1] - view.time_s[0]) / min(given.bins, view.time_s.size)
    grid = np.arange(view.time_s[0] + 0.5 * step_s, view.time_s[-1], step_s)
    load, reading = (
        binned(view.time_s, five_point_median(one.values), grid, step_s) for one in (view.load, view.reading)
    )
    within, most, first = given.standing * view.load_span, 0.0, 0
    settling = int(np.ceil(max(given.memory_s) / step_s))
    for last in range(1, grid.size + 1):
        if last == grid.size or abs(float(load[last] - load[first])) > within:
            after = reading[first + settling : last]
            if after.size > 2 * given.few:
                begins, ends = np.median(after[: given.few]), np.median(after[-given.few :])
                most = max(most, abs(float(ends - begins)))
            first = last
    return most / max(float(np.ptp(reading)), most, 1e-300)


def _followed_share(view: View) -> tuple[float, float]:
    """Share of the reading's variance about a straight line in time that load explains; correlation of increments.

    About its mean where each load comes but once: time is then the load's, and no drift is told from what follows it.
    """
    n = view.reading.values.size
    width = max(1, n // view.thresholds.bins)
    count = n // width
    load = view.load.values[: count * width].reshape(count, width).mean(axis=1)
    reading = np.median(view.reading.values[: count * width].reshape(count, width), axis=1)
    curve = np.interp(load, view.curve[0], view.curve[1])
    columns = np.concatenate(
        [load_regressors(load, width * view.step_s, view.thresholds.memory_s), curve[:, None]], axis=1
    )
    base = np.stack([np.ones(count), np.linspace(-1.0, 1.0, count)], axis=1)
    if _comes_once(load, view.thresholds):
        base = base[:, :1]
    left_base, left = _beyond(reading, base), _beyond(reading, np.concatenate([base, columns], axis=1))
    total = float(np.dot(left_base, left_base))
    if total == 0.0:
        return 0.0, 0.0
    together = max(
        _moves_with(curve, reading, stride_s / (width * view.step_s), view.thresholds)
        for stride_s in view.thresholds.memory_s
    )
    return 1.0 - float(np.dot(left, left)) / total, together


def _comes_once(load: Array, thresholds: Thresholds) -> bool:
    """Whether a load (n,) goes one way, straight or not, and stands nowhere: its ranks are those of its moments."""
    from scipy.stats import rankdata

    moment, place = np.arange(1.0, load.size + 1.0), rankdata(load)
    off = min(float(np.std(place - moment)), float(np.std(place + moment)))
    return off < thresholds.standing * load.size


def _beyond(signal: Array, columns: Array) -> Array:
    """(n,) what ``columns`` (n, k) leave of a ``signal`` (n,)."""
    return signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]


def _moves_with(load: Array, reading: Array, stride: float, thresholds: Thresholds) -> float:
    """Correlation of increments over ``stride`` points, less what chance gives so many; large ones cut short."""
    apart = min(max(1, round(stride)), load.size // 4)
    d_load, d_reading = (cut_short(one[apart:] - one[:-apart], thresholds) for one in (load, reading))
    size = float(np.sqrt(np.dot(d_load, d_load) * np.dot(d_reading, d_reading)))
    if size == 0.0:
        return 0.0
    return float(np.dot(d_load, d_reading) / size - thresholds.clear / np.sqrt(load.size / apart))


def load_regressors(load: Array, step_s: float, time_constants_s: Sequence[float] | Array) -> Array:
    """(n, 3 + k) a load (n,) as share of its span, its square and cube, and the share behind k first-order lags."""
    return share_regressors((load - load.min()) / np.ptp(load), step_s, time_constants_s)


def share_regressors(f: Array, step_s: float, time_constants_s: Sequence[float] | Array) -> Array:
    """(n, 3 + k) a share ``f`` (n,) of a load, its square and cube, and the share behind k first-order lags."""
    lags = [lagged(f, step_s, float(tau_s)) for tau_s in time_constants_s]
    return np.stack([f, f**2, f**3, *lags], axis=1)
