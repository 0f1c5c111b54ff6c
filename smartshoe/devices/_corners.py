"""Delay and clock rate from the corners of the load alone, for units whose own lag no model describes well enough.

Where the load's slope jumps, the reading's slope jumps at the same instant, whatever the unit remembers: springs,
dampers, leaks and friction all respond smoothly between corners. Around each corner the reading is fitted by

    r = cubic(t) + g F(tau) + a x^2 + b x^3,   x = max(tau - corner, 0),   tau = t + delay + rate (t - middle)

Each corner has its own cubic, gain and curvature after the corner; delay and rate are common to all. This uses only a
small part of the record, but is unbiased where a fit of the whole record is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array

SLOPE_OVER_S = 0.15
APART_S = 0.3
LEAST_JUMP = 0.03  # of the largest jump of the slope
LONGEST_SIDE_S = 2.0
SHORTEST_SIDE_S = 0.15
SHARE_OF_GAP = 0.9
LEAST_SAMPLES = 30
ITERATIONS = 10
SETTLED = 1e-2
DEPENDENT = 1e-9


def slope_of(time_s: Array, load: Array, over_s: float = SLOPE_OVER_S) -> Array:
    """Slope dF/dt (n,) of an evenly sampled load, from straight lines over ``over_s`` about each sample."""
    step = float(np.median(np.diff(time_s)))
    half = max(1, round(0.5 * over_s / step))
    place = np.arange(-half, half + 1) * step
    padded = np.pad(load, half, mode="edge")
    slope: Array = np.convolve(padded, place[::-1] / (place @ place), mode="valid")
    return slope


def corners(time_s: Array, load: Array) -> Array:
    """The times (m,) at which the load's slope jumps, by more than noise and more than 3 % of the largest jump."""
    step = float(np.median(np.diff(time_s)))
    slope = slope_of(time_s, load)
    half = max(1, round(0.5 * SLOPE_OVER_S / step))
    jump = np.zeros(load.size)
    jump[half:-half] = np.abs(slope[2 * half :] - slope[: -2 * half])
    least = max(8.0 * float(np.median(jump)), LEAST_JUMP * float(jump.max()))
    apart = max(1, round(APART_S / step))
    found: list[int] = []
    while jump.max() > least:
        at = int(np.argmax(jump))
        found.append(at)
        jump[max(0, at - apart) : at + apart + 1] = 0.0
    times: Array = time_s[np.sort(np.array(found, dtype=np.intp))]
    return times


@dataclass(frozen=True, slots=True)
class AtCorners:
    """Delay in s and clock rate from a load's corners, with their sds."""

    delay_s: float
    delay_sd_s: float
    rate: float
    rate_sd: float


def follow_corners(machine_s: Array, load: Array, logger_s: Array, signal: Array, delay_s: float) -> AtCorners | None:
    """Delay and rate of ``signal`` (n,) at ``logger_s`` (n,) by the corners of ``load`` (m,) at ``machine_s`` (m,).

    The search begins on either side of ``delay_s``, half of `SLOPE_OVER_S` away, within which a corner is seen. None
    where the load has fewer than two corners, or where these do not lead both searches to one delay: kinks of a smooth
    load's noise hold a search wherever it begins.
    """
    aside = 0.5 * SLOPE_OVER_S
    first, second = (_searched_from(machine_s, load, logger_s, signal, delay_s + way * aside) for way in (-1.0, 1.0))
    if first is None or second is None:
        return None
    return first if abs(first.delay_s - second.delay_s) <= max(first.delay_sd_s, second.delay_sd_s) else None


def _searched_from(machine_s: Array, load: Array, logger_s: Array, signal: Array, delay_s: float) -> AtCorners | None:
    """Where a search from ``delay_s`` ends; None where fewer than two corners can be used."""
    at_corners = corners(machine_s, load)
    gaps = np.diff(np.concatenate([machine_s[:1], at_corners, machine_s[-1:]]))
    sides = np.minimum(SHARE_OF_GAP * np.column_stack([gaps[:-1], gaps[1:]]), LONGEST_SIDE_S)
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    slope = slope_of(machine_s, load, 0.05)
    delay, rate, sd = delay_s, 0.0, np.zeros(2)
    for _ in range(ITERATIONS):
        at = logger_s + delay + rate * (logger_s - middle)
        normal, moment, scatter, freedom, used = np.zeros((2, 2)), np.zeros(2), 0.0, 0, 0
        for corner, (before, after) in zip(at_corners, sides, strict=True):
            first, last = np.searchsorted(at, [corner - before, corner + after])
            if last - first < LEAST_SAMPLES or min(before, after) < SHORTEST_SIDE_S:
                continue
            tau = at[first:last]
            place = (tau - corner) / max(before, after)
            since = np.maximum(place, 0.0)
            level = np.interp(tau, machine_s, load)
            local = np.column_stack([place**k for k in range(4)] + [since**2, since**3, level / np.abs(level).max()])
            basis, triangle = np.linalg.qr(local)
            if np.abs(np.diag(triangle)).min() < DEPENDENT * np.abs(triangle).max():
                continue  # the load is a cubic here: it has no corner that the reading could show
            values = signal[first:last]
            gain = np.linalg.solve(triangle, basis.T @ values)[-1] / np.abs(level).max()
            tilt = gain * np.interp(tau, machine_s, slope)
            tilts = np.column_stack([tilt, tilt * (logger_s[first:last] - middle)])
            tilts -= basis @ (basis.T @ tilts)
            left = values - basis @ (basis.T @ values)
            normal += tilts.T @ tilts
            moment += tilts.T @ left
            scatter += float(left @ left)
            freedom += left.size - local.shape[1]
            used += 1
        if used < 2:
            return None
        size = np.sqrt(np.diag(normal))
        scaled = normal / np.outer(size, size)
        change = np.linalg.lstsq(scaled, moment / size, rcond=None)[0] / size
        sd = np.sqrt(np.diag(np.linalg.pinv(scaled)) * scatter / freedom) / size
        delay, rate = delay + float(change[0]), rate + float(change[1])
        if np.all(np.abs(change) <= SETTLED * sd):
            break
    return AtCorners(delay, float(sd[0]), rate, float(sd[1]))
