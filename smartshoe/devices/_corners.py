"""Delay and clock rate from the corners of the load alone, for units whose own lag no model describes well enough.

Where the load's slope jumps, the reading's slope jumps at the same instant, whatever the unit remembers: springs,
dampers, leaks and friction all respond smoothly between corners. Around each corner the reading is fitted by

    r = cubic(t) + g F(tau) + a x^2 + b x^3,   x = max(tau - corner, 0),   tau = t + delay + rate (t - middle)

Each corner has its own cubic, gain and curvature after the corner; delay and rate are common to all. This uses only a
small part of the record, but is less biased than a fit of the whole record.

It is not free of bias: what the unit does soon after a corner (play that is passed, heat that leaves) is no cubic, and
shifts the corner. Repeats do not average that away, and the noise about the fit does not tell it. Two things do, and
the sds are the largest of what the three say:

1. The shift is the same wherever the load turns in the same way, and another where it turns otherwise: the start of a
   quick rise comes late, the end of a fall does not. How far kinds of corners disagree is the covariance of clustered
   least squares with each kind as one cluster (Liang and Zeger 1986, Biometrika 73, 13-22), times Student's quantile
   over the normal one, for there are few kinds:

       cov = N^-1 (sum over the G kinds of m m') N^-1 G/(G - 1),

   N the normal matrix and m the kind's part of the gradient.
2. The shift changes with how far the corner is looked at, for the cubics follow anything smooth over a short enough
   time: a second search looks half as far. This tells where kinds are mirror images, as in triangles without a rest.

Neither sees what shifts a corner within milliseconds, such as a lag of the sensor itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.signals.noise import NORMAL_95

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
NEAR = 0.5  # of how far a corner is looked at, in the second search: the part of the delay that hangs on it shows
ALIKE = 0.25  # of the larger slope beside a corner: corners whose slopes differ by less are one kind


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
    """Delay in s and clock rate from a load's corners, with their sds.

    ``noise_sd_s`` is the part of the delay's sd that the noise about the fit makes.
    """

    delay_s: float
    delay_sd_s: float
    rate: float
    rate_sd: float
    noise_sd_s: float


def follow_corners(machine_s: Array, load: Array, logger_s: Array, signal: Array, delay_s: float) -> AtCorners | None:
    """Delay and rate of ``signal`` (n,) at ``logger_s`` (n,) by the corners of ``load`` (m,) at ``machine_s`` (m,).

    The search begins on either side of ``delay_s``, half of `SLOPE_OVER_S` away, within which a corner is seen. None
    where the load has fewer than two corners, or where these do not lead both searches to one delay: kinks of a smooth
    load's noise hold a search wherever it begins.
    """
    aside = 0.5 * SLOPE_OVER_S
    logs = machine_s, load, logger_s, signal, corners(machine_s, load)
    found, second = (_searched_from(*logs, delay_s + way * aside) for way in (-1.0, 1.0))
    if found is None or second is None:
        return None
    if abs(found.delay_s - second.delay_s) > max(found.noise_sd_s, second.noise_sd_s):
        return None
    near = _searched_from(*logs, found.delay_s, NEAR)
    if near is None:
        return found
    return replace(
        found,
        delay_sd_s=max(found.delay_sd_s, abs(near.delay_s - found.delay_s)),
        rate_sd=max(found.rate_sd, abs(near.rate - found.rate)),
    )


def kinds_of(at_corners: Array, sides: Array, machine_s: Array, load: Array) -> Index:
    """The kind (m,) of each corner, a number from 0: corners of one kind have like slopes before and after them.

    ``sides`` (m, 2) is how far in s a corner is looked at, before and after it.
    """
    level = np.interp(at_corners, machine_s, load)
    before = (level - np.interp(at_corners - sides[:, 0], machine_s, load)) / sides[:, 0]
    after = (np.interp(at_corners + sides[:, 1], machine_s, load) - level) / sides[:, 1]
    slopes = np.column_stack([before, after])
    kinds = np.full(at_corners.size, -1)
    while (left := np.flatnonzero(kinds < 0)).size:
        first = slopes[left[0]]
        alike = np.abs(slopes[left] - first).max(axis=1) <= ALIKE * np.abs(first).max()
        kinds[left[alike]] = kinds.max() + 1
    return kinds


def _sd_of_kinds(covariance: Array, moments: Array, kinds: Index) -> Array:
    """The sds (2,) of delay and rate by how far kinds of corners disagree; zeros where there is one kind only.

    ``covariance`` (2, 2) is the inverse of the normal matrix, ``moments`` (k, 2) the corners' parts of the gradient
    where the search ended, ``kinds`` (k,) theirs.
    """
    from scipy.special import stdtrit

    count = np.unique(kinds).size
    if count < 2:
        return np.zeros(2)
    of_kinds = np.array([moments[kinds == kind].sum(axis=0) for kind in np.unique(kinds)])
    moved = of_kinds @ covariance
    few = float(stdtrit(count - 1, 0.975)) / NORMAL_95
    found: Array = few * np.sqrt((moved**2).sum(axis=0) * count / (count - 1))
    return found


def _searched_from(
    machine_s: Array,
    load: Array,
    logger_s: Array,
    signal: Array,
    at_corners: Array,
    delay_s: float,
    far: float = 1.0,
) -> AtCorners | None:
    """Where a search from ``delay_s`` ends; None where fewer than two of the load's `corners` (m,) can be used.

    ``far`` is the share of the usual time before and after each corner that is looked at.
    """
    gaps = np.diff(np.concatenate([machine_s[:1], at_corners, machine_s[-1:]]))
    sides = far * np.minimum(SHARE_OF_GAP * np.column_stack([gaps[:-1], gaps[1:]]), LONGEST_SIDE_S)
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    slope = slope_of(machine_s, load, 0.05)
    kinds = kinds_of(at_corners, sides, machine_s, load)
    delay, rate = delay_s, 0.0
    for _ in range(ITERATIONS):
        at = logger_s + delay + rate * (logger_s - middle)
        normal, scatter, freedom = np.zeros((2, 2)), 0.0, 0
        moments: list[Array] = []
        used: list[int] = []
        for corner, (before, after), kind in zip(at_corners, sides, kinds, strict=True):
            first, last = np.searchsorted(at, [corner - before, corner + after])
            if last - first < far * LEAST_SAMPLES or min(before, after) < far * SHORTEST_SIDE_S:
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
            moments.append(tilts.T @ left)
            scatter += float(left @ left)
            freedom += left.size - local.shape[1]
            used.append(int(kind))
        if len(used) < 2:
            return None
        size = np.sqrt(np.diag(normal))
        scaled = normal / np.outer(size, size)
        change = np.linalg.lstsq(scaled, np.sum(moments, axis=0) / size, rcond=None)[0] / size
        covariance = np.linalg.pinv(scaled) / np.outer(size, size)
        sd = np.sqrt(np.diag(covariance) * scatter / freedom)
        delay, rate = delay + float(change[0]), rate + float(change[1])
        if np.all(np.abs(change) <= SETTLED * sd):
            break
    delay_sd_s, rate_sd = np.maximum(sd, _sd_of_kinds(covariance, np.array(moments), np.array(used)))
    return AtCorners(delay, float(delay_sd_s), rate, float(rate_sd), float(sd[0]))
