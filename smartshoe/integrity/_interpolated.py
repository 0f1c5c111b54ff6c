"""A channel that was measured more slowly than its table, and interpolated by straight lines or by cubics.

A sample on such a piece is foretold by its neighbours up to rounding; only at a knot, where two pieces meet, it is not.
A channel counts as interpolated where most samples that move lie on pieces between knots that are evenly apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._scales import ROUNDING
from smartshoe.integrity._view import Signal
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording
from smartshoe.signals.masks import runs_of

REACHES = (1, 2, 4, 8, 16)  # samples between a stencil's neighbours: the more, the larger a bend is beside rounding
# The neighbours, in reaches, that foretell a sample on a piece.
LINEAR, CUBIC = np.array([-1, 1]), np.array([-2, -1, 1, 2])
MOST_DIGITS = math.ceil(-math.log10(ROUNDING))  # behind the point; more come from a double's own rounding
SINGLE = float(np.finfo(np.float32).eps)  # rounding of a value that was held in single precision


@dataclass(frozen=True, eq=False)
class _Knots:
    """The knots of an interpolated channel at ``time_s`` (k,), of which neighbours are usually ``apart_s`` apart."""

    time_s: Array
    apart_s: float


def without_interpolated(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """The recording at the moments at which the slowest of load and reading was measured, and the finding that says so.

    Between these moments that channel was not measured. Taken for measurements, the straight lines would be fitted as
    dynamics of the unit.
    """
    knots_of = {one.name: _knots_of(recording.time_s, one, thresholds) for one in recording.loads_and_sensors}
    interpolated = {name: knots for name, knots in knots_of.items() if knots is not None}
    if not interpolated:
        return recording, []
    slowest = max(interpolated, key=lambda name: interpolated[name].apart_s)
    measured = _taken_at(recording, slowest, _moments(recording.time_s, interpolated[slowest]))
    says = (
        f"{slowest} was measured every {interpolated[slowest].apart_s:.3g} s and interpolated to"
        f" {recording.sample_rate_hz:.4g} Hz: of all channels only those moments are used, and what is faster"
        " cannot be told"
    )
    return measured, [Finding("interpolated", np.ones(len(measured), dtype=bool), says)]


def _knots_of(time_s: Array, channel: Channel, thresholds: Thresholds) -> _Knots | None:
    """The knots of the straight lines, or else of the cubics, on which a ``channel`` lies wherever it moves; or None.

    Neighbours of every reach are tried, since close ones may bend by no more than rounding.
    """
    present = np.flatnonzero(channel.present)
    if present.size < thresholds.least_samples:
        return None
    t, v = time_s[present], channel.values[present]
    value_digit = _last_digit(v)
    time_digit_s = _last_digit(t) if np.ptp(np.diff(t)) > ROUNDING * np.ptp(t) else 0.0
    # A ramp on a coarse grid goes by steps, to either side of a line, and may seem to lie on a cubic: a cubic must
    # therefore be clear of the grid's step.
    grid = max(value_digit, Signal(v, thresholds).step)
    for neighbours, digit in ((LINEAR, value_digit), (CUBIC, grid)):
        for reach in REACHES:
            if present.size < thresholds.few**2 * reach:
                break
            bends = _bends(t, v, reach * neighbours, (digit, time_digit_s))
            # A knot bends as many samples as there are neighbours, and between two at least one more is straight. Where
            # more than that are sharp, more will be at a farther reach.
            if np.mean(bends.are_sharp) * (neighbours.size + 2) > neighbours.size + 1:
                break
            found = _between_knots(t, v, bends, thresholds)
            if found is not None:
                return found
    return None


@dataclass(frozen=True, eq=False)
class _Bends:
    """How far n values lie off what neighbours of each foretell.

    Each array is (n - 2 ``beyond``,), of the values that have all neighbours. ``reach``, ``beyond``: distance of the
    nearest and of the farthest neighbour, in samples. ``off``: value less foretold value. ``by_rounding``: its size
    over what rounding explains. ``slopes``: whether the channel moves there.
    """

    reach: int
    beyond: int
    off: Array
    by_rounding: Array
    slopes: Mask

    @property
    def are_sharp(self) -> Mask:
        """Whether each is off by more than rounding explains."""
        return self.by_rounding > 1.0


def _bends(t: Array, v: Array, neighbours: Index, last_digits: tuple[float, float]) -> _Bends:
    """How far values ``v`` (n,) at times ``t`` (n,) lie off the polynomial (Lagrange's) through their ``neighbours``.

    ``last_digits``: the last digits to which values and times were written, 0 where they were not rounded.
    """
    beyond, reach = int(neighbours[-1]), int(np.min(np.abs(neighbours)))
    at = np.arange(beyond, v.size - beyond)
    away_s = [t[at + one] - t[at] for one in neighbours]
    off, weight_sum, scale = np.zeros(at.size), np.ones(at.size), np.abs(v[at])
    for i, one in enumerate(neighbours):
        others = [(away_s[i] - other) / -other for k, other in enumerate(away_s) if k != i]
        weight = 1.0 / np.prod(others, axis=0)
        off += weight * (v[at + one] - v[at])
        weight_sum += np.abs(weight)
        scale += np.abs(weight * v[at + one])
    rate = (v[at + reach] - v[at - reach]) / (t[at + reach] - t[at - reach])
    rounding = (1.0 + ROUNDING) * (0.5 * weight_sum * last_digits[0] + np.abs(rate) * last_digits[1]) + SINGLE * scale
    return _Bends(reach, beyond, off, np.abs(off) / np.maximum(rounding, 1e-300), rate != 0.0)


def _between_knots(t: Array, v: Array, bends: _Bends, thresholds: Thresholds) -> _Knots | None:
    """The knots between which a channel lies on pieces; None where pieces are few or may be a machine's ramps.

    A measured channel bends at every sample, by its noise. A load without noise bends where a machine turns, starts or
    stops. An interpolated channel also bends where it goes on or stands (`_goes_on`), after about the same time again
    and again, and by clearly more (`clear`) than rounding explains.
    """
    beyond, sharp, size = bends.beyond, bends.are_sharp, np.abs(bends.off)
    starts, stops = runs_of(sharp)
    if starts.size < thresholds.few**2:
        return None
    sum_of = _sums(size, starts, stops)
    is_knot = (stops - starts >= bends.reach) & (stops - starts <= 2 * beyond)
    # A knot bends all within reach the same way; a step, or a sample off its place, bends them both ways.
    is_knot &= np.abs(_sums(bends.off, starts, stops)) > (1.0 - ROUNDING) * sum_of
    between, moving = starts[1:] - stops[:-1], _sums(bends.slopes, stops[:-1], starts[1:])
    knots = beyond + _sums(size * np.arange(size.size), starts, stops) / sum_of
    # A piece must be longer than the stencil, since about one corner there may seem to be three knots.
    is_line = (
        is_knot[1:] & is_knot[:-1] & (thresholds.clear * moving > between) & (np.diff(knots) > 2 * beyond - ROUNDING)
    )
    on_lines = float(np.diff(starts)[is_line].sum())
    if is_line.sum() < thresholds.few**2 or on_lines < (1.0 - thresholds.same) * np.sum(bends.slopes | sharp):
        return None
    at_s = np.interp(knots, np.arange(t.size), t)
    lasts_s = np.diff(at_s)[is_line]
    apart_s = float(np.median(lasts_s))
    even_share = np.mean(np.abs(lasts_s - apart_s) < thresholds.same * apart_s)
    by_rounding = np.median(np.maximum.reduceat(bends.by_rounding, starts)[1:][is_line])
    if min(thresholds.clear * even_share, by_rounding / thresholds.clear) < 1.0:
        return None
    if not _goes_on(np.interp(knots, np.arange(v.size), v), at_s, is_line, thresholds):
        return None
    return _Knots(at_s[is_knot], apart_s)


def _sums(values: Array | Mask, starts: Index, stops: Index) -> Array:
    """(k,) sums of ``values`` (n,) over the runs from ``starts`` to before ``stops``, (k,) each."""
    ends = np.stack([starts, stops], axis=1).ravel()
    return np.add.reduceat(np.append(values, 0.0), ends)[::2]


def _last_digit(values: Array) -> float:
    """The last decimal to which all ``values`` were written, such as 0.01; 0 where they are no short decimals."""
    for digits in range(MOST_DIGITS):
        scaled = values * 10.0**digits
        if np.all(np.abs(np.rint(scaled) - scaled) < ROUNDING * (1.0 + np.abs(scaled))):
            return 10.0**-digits
    return 0.0


def _goes_on(v: Array, at_s: Array, is_line: Mask, thresholds: Thresholds) -> bool:
    """Whether the channel goes on or stands at a share (`same`) of the knots between two pieces.

    A machine's corners lie where it turns, starts or stops.
    """
    move = np.diff(v)
    rate = move / np.diff(at_s)
    is_inner = is_line[1:] & is_line[:-1]
    larger_rate = np.maximum(np.abs(rate[1:]), np.abs(rate[:-1]))
    goes_on = np.abs(np.diff(rate)) < larger_rate / thresholds.clear
    goes_on |= np.maximum(np.abs(move[1:]), np.abs(move[:-1])) < thresholds.standing * float(np.ptp(v))
    return bool(goes_on[is_inner].sum() > thresholds.same * is_inner.sum())


def _moments(time_s: Array, found: _Knots) -> Array:
    """(m,) the knots, and evenly between and beside them the moments at which nothing bends."""
    knots, apart_s = found.time_s, found.apart_s
    first = knots[0] - apart_s * np.floor((knots[0] - time_s[0]) / apart_s)
    last = knots[-1] + apart_s * np.floor((time_s[-1] - knots[-1]) / apart_s)
    ends = np.concatenate([[first], knots, [last]])
    number = np.rint(np.diff(ends) / apart_s).astype(int)
    between = [
        np.linspace(a, b, max(n, 1), endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], number, strict=True)
    ]
    return np.unique(np.concatenate([*between, [last]]))


def _taken_at(recording: Recording, slow: str, moments: Array) -> Recording:
    """The recording at ``moments`` (m,) at which the ``slow`` channel was measured.

    Where these fall between samples, the slow channel is the mean of the lines on both sides of each knot, and the
    other channels are interpolated.
    """
    t, step_s = recording.time_s, recording.sample_time_s
    nearest = np.searchsorted(0.5 * (t[1:] + t[:-1]), moments)
    is_present = recording.channels[slow].present[nearest]
    moments, nearest = moments[is_present], nearest[is_present]
    # A line needs two samples on one side of a knot. With fewer than three between knots the nearest samples do.
    if np.max(np.abs(t[nearest] - moments)) < ROUNDING * np.ptp(t) or np.median(np.diff(moments)) < 3.0 * step_s:
        return recording.taken(np.unique(nearest))
    channels = {}
    for name, one in recording.channels.items():
        values = np.interp(moments, t, one.with_nan())
        if name == slow:
            at = np.clip(np.searchsorted(t, moments), 2, t.size - 2)
            lines = [one.values[i] + (moments - t[i]) * _slope(t, one.values, i, k) for i, k in ((at - 1, -1), (at, 1))]
            values = 0.5 * (lines[0] + lines[1])
        channels[name] = one.with_values(values)
    return replace(recording, time_s=moments, channels=channels)


def _slope(t: Array, v: Array, at: Index, to: int) -> Array:
    """(m,) slopes of ``v`` (n,) over ``t`` (n,) from samples ``at`` (m,) to those ``to`` samples after."""
    return (v[at + to] - v[at]) / (t[at + to] - t[at])
