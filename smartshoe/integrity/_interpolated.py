"""A channel that was measured more slowly than its table and interpolated: straight lines from value to value."""

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

REACHES = (1, 2, 4, 8, 16)  # samples from one to the next of a stencil: the farther, the larger a bend beside rounding
LINEAR, CUBIC = (
    np.array([-1, 1]),
    np.array([-2, -1, 1, 2]),
)  # neighbours, in reaches, that foretell what lies on a piece
MOST_DIGITS = math.ceil(-math.log10(ROUNDING))  # behind the point; more are a double's own
SINGLE = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, eq=False)
class _Knots:
    """Where an interpolated channel bends: ``time_s`` (k,) of the knots, usually ``apart_s`` one from the next."""

    time_s: Array
    apart_s: float


def without_interpolated(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """The recording at the moments at which the slowest of load and reading was measured, and what is said of it.

    Between them that channel is no measurement: taken for one, the chords of its course would be the unit's dynamics.
    """
    found = {one.name: _knots_of(recording.time_s, one, thresholds) for one in recording.loads_and_sensors}
    told = {name: knots for name, knots in found.items() if knots is not None}
    if not told:
        return recording, []
    slowest = max(told, key=lambda name: told[name].apart_s)
    measured = _taken_at(recording, slowest, _moments(recording.time_s, told[slowest]))
    says = (
        f"{slowest} was measured every {told[slowest].apart_s:.3g} s and interpolated to {recording.sample_rate_hz:.4g}"
        " Hz: of all channels only those moments are used, and what is faster cannot be told"
    )
    return measured, [Finding("interpolated", np.ones(len(measured), dtype=bool), says)]


def _knots_of(time_s: Array, channel: Channel, thresholds: Thresholds) -> _Knots | None:
    """The knots of the lines, else cubics, on which a channel lies wherever it moves; None where it lies on none."""
    there = np.flatnonzero(channel.present)
    if there.size < thresholds.least_samples:
        return None
    t, v = time_s[there], channel.values[there]
    written = _last_digit(v)
    written_s = _last_digit(t) if np.ptp(np.diff(t)) > ROUNDING * np.ptp(t) else 0.0
    # A ramp on a coarse grid takes its steps both ways from a line; a cubic it may seem to lie on.
    grid = max(written, Signal(v, thresholds).step)
    for neighbours, digit in ((LINEAR, written), (CUBIC, grid)):
        for reach in REACHES:
            if there.size < thresholds.few**2 * reach:
                break
            bends = _bends(t, v, reach * neighbours, (digit, written_s))
            # A knot bends as many samples as there are neighbours, and one more is straight. Farther off more bend.
            if np.mean(bends.are_sharp) * (neighbours.size + 2) > neighbours.size + 1:
                break
            found = _between_knots(t, v, bends, thresholds)
            if found is not None:
                return found
    return None


@dataclass(frozen=True, eq=False)
class _Bends:
    """How far values lie off what neighbours foretell, ``reach`` to ``beyond`` samples off, from ``beyond`` on.

    (n - 2 beyond,) each: ``off``; in sizes of what rounding explains, ``beside``; ``are_sharp``, more than that;
    ``slopes``, where the channel moves.
    """

    reach: int
    beyond: int
    off: Array
    beside: Array
    slopes: Mask

    @property
    def are_sharp(self) -> Mask:
        return self.beside > 1.0


def _bends(t: Array, v: Array, neighbours: Index, written: tuple[float, float]) -> _Bends:
    """Bends of ``v`` (n,) by the last digits to which values and times were ``written``."""
    beyond, reach = int(neighbours[-1]), int(np.min(np.abs(neighbours)))
    at = np.arange(beyond, v.size - beyond)
    around = [t[at + one] - t[at] for one in neighbours]
    off, doubt, scale = np.zeros(at.size), np.ones(at.size), np.abs(v[at])
    for i, one in enumerate(neighbours):
        others = [(around[i] - other) / -other for k, other in enumerate(around) if k != i]
        share = 1.0 / np.prod(others, axis=0)  # Lagrange's
        off += share * (v[at + one] - v[at])
        doubt += np.abs(share)
        scale += np.abs(share * v[at + one])
    rate = (v[at + reach] - v[at - reach]) / (t[at + reach] - t[at - reach])
    rounding = (1.0 + ROUNDING) * (0.5 * doubt * written[0] + np.abs(rate) * written[1]) + SINGLE * scale
    return _Bends(reach, beyond, off, np.abs(off) / np.maximum(rounding, 1e-300), rate != 0.0)


def _between_knots(t: Array, v: Array, bends: _Bends, thresholds: Thresholds) -> _Knots | None:
    """What lies between knots; None where that is not most of what moves, or no more than a machine's ramps.

    A measured channel bends at every sample, by its noise; a load without noise where the machine turns, starts or
    stops. Only one that was interpolated bends also as it goes on, or stands, after about the same time again and
    again, by far more than between two bends.
    """
    beyond, sharp, size = bends.beyond, bends.are_sharp, np.abs(bends.off)
    starts, stops = runs_of(sharp)
    if starts.size < thresholds.few**2:
        return None
    sum_of = _sums(size, starts, stops)
    is_knot = (stops - starts >= bends.reach) & (stops - starts <= 2 * beyond)
    # A knot bends all within reach the same way; a step, or a sample off its place, bends them both ways.
    is_knot &= np.abs(_sums(bends.off, starts, stops)) > (1.0 - ROUNDING) * sum_of
    inner, sloping = starts[1:] - stops[:-1], _sums(bends.slopes, stops[:-1], starts[1:])
    knots = beyond + _sums(size * np.arange(size.size), starts, stops) / sum_of
    # What lies between two knots must hold a stencil: about one corner there may seem to be three.
    is_line = (
        is_knot[1:] & is_knot[:-1] & (thresholds.clear * sloping > inner) & (np.diff(knots) > 2 * beyond - ROUNDING)
    )
    on_lines = float(np.diff(starts)[is_line].sum())
    if is_line.sum() < thresholds.few**2 or on_lines < (1.0 - thresholds.same) * np.sum(bends.slopes | sharp):
        return None
    at_s = np.interp(knots, np.arange(t.size), t)
    lasts_s = np.diff(at_s)[is_line]
    apart_s = float(np.median(lasts_s))
    alike = np.mean(np.abs(lasts_s - apart_s) < thresholds.same * apart_s)
    beside = np.median(np.maximum.reduceat(bends.beside, starts)[1:][is_line])
    if min(thresholds.clear * alike, beside / thresholds.clear) < 1.0:
        return None
    if not _goes_on(np.interp(knots, np.arange(v.size), v), at_s, is_line, thresholds):
        return None
    return _Knots(at_s[is_knot], apart_s)


def _sums(values: Array | Mask, starts: Index, stops: Index) -> Array:
    """(k,) sums of ``values`` over runs."""
    ends = np.stack([starts, stops], axis=1).ravel()
    return np.add.reduceat(np.append(values, 0.0), ends)[::2]


def _last_digit(values: Array) -> float:
    """The last decimal to which all ``values`` were written; 0 where they are no decimals."""
    for digits in range(MOST_DIGITS):
        scaled = values * 10.0**digits
        if np.all(np.abs(np.rint(scaled) - scaled) < ROUNDING * (1.0 + np.abs(scaled))):
            return 10.0**-digits
    return 0.0


def _goes_on(v: Array, at_s: Array, is_line: Mask, thresholds: Thresholds) -> bool:
    """Whether at a share of the knots the channel goes on, or stands: a machine's corners are where it turns."""
    move = np.diff(v)
    rate = move / np.diff(at_s)
    both = is_line[1:] & is_line[:-1]
    larger = np.maximum(np.abs(rate[1:]), np.abs(rate[:-1]))
    on = np.abs(np.diff(rate)) < larger / thresholds.clear
    on |= np.maximum(np.abs(move[1:]), np.abs(move[:-1])) < thresholds.standing * float(np.ptp(v))
    return bool(on[both].sum() > thresholds.same * both.sum())


def _moments(time_s: Array, told: _Knots) -> Array:
    """(m,) the knots, and as many between and beside them as are missing where nothing bends."""
    knots, apart_s = told.time_s, told.apart_s
    first = knots[0] - apart_s * np.floor((knots[0] - time_s[0]) / apart_s)
    last = knots[-1] + apart_s * np.floor((time_s[-1] - knots[-1]) / apart_s)
    ends = np.concatenate([[first], knots, [last]])
    number = np.rint(np.diff(ends) / apart_s).astype(int)
    between = [
        np.linspace(a, b, max(n, 1), endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], number, strict=True)
    ]
    return np.unique(np.concatenate([*between, [last]]))


def _taken_at(recording: Recording, slow: str, moments: Array) -> Recording:
    """The recording at ``moments``: the ``slow`` channel by the lines on both sides, others between their samples."""
    t, step_s = recording.time_s, recording.sample_time_s
    nearest = np.searchsorted(0.5 * (t[1:] + t[:-1]), moments)
    there = recording.channels[slow].present[nearest]
    moments, nearest = moments[there], nearest[there]
    # Of three samples at least two lie on one side of a knot, and tell the line.
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
    return (v[at + to] - v[at]) / (t[at + to] - t[at])
