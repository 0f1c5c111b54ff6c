"""Delay and clock rate from a unit's reading alone. The unit's own lag is fitted too, so that it does not bias them.

The reading follows the load through a standard linear solid (Chinimilli 2016, eq. 2, read backwards): one share follows
at once, another through a first-order lag.

    r(t) = offset + g0 F(tau) + g1 w(tau) + g2 exp(-p tau),   w' = p (F - w),   tau = t + delay + rate (t - middle)

Seven parameters by Gauss-Newton: offset, g0, g1, g2 (relaxation still left from before the log began), p, delay, rate.
Two more for a bent characteristic, where asked for: gains of F^2 and F^3. A lag of the sensor itself (a millisecond)
stays in the delay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices._corners import SLOPE_OVER_S, slope_of

SLOW_S, QUICK_S = 0.5, 0.05
ITERATIONS = 40
SETTLED = 1e-2  # of a standard deviation
STARTS_S = (3.0, 0.5)
LAGS_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
FASTEST_S, SLOWEST_S = 0.05, 60.0
LONGEST_WAY_S = 3.0  # from the best correlation of load and reading: more than any unit's lag shifts it
LARGEST_RATE = 1e-2
LARGEST_STEP = 1.0  # of log p in one iteration


@dataclass(frozen=True, slots=True)
class Following:
    """Delay in s, clock rate, their sds, the lag's time constant, the residual (n,) and its `misfit_of`."""

    delay_s: float
    delay_sd_s: float
    rate: float
    rate_sd: float
    lag_s: float
    residual: Array
    misfit: float


def misfit_of(residual: Array, sample_rate_hz: float) -> float:
    """Variance of the residual's means over 0.5 s relative to that over 0.05 s, per sample: 1 for white noise."""
    quick = _of_means(residual, QUICK_S * sample_rate_hz)
    return _of_means(residual, SLOW_S * sample_rate_hz) / quick if quick > 0.0 else 1.0


def _of_means(residual: Array, samples: float) -> float:
    """Variance of the residual's means over ``samples`` samples, multiplied by that number."""
    count = min(max(1, round(samples)), residual.size)
    means = residual[: residual.size // count * count].reshape(-1, count).mean(axis=1)
    return float(np.var(means)) * count


@dataclass(frozen=True)
class _Load:
    """The load interpolated to an even grid."""

    start_s: float
    step_s: float
    load: Array

    @property
    def time_s(self) -> Array:
        return np.asarray(self.start_s + self.step_s * np.arange(self.load.size), dtype=float)

    def lagged(self, pole: float) -> Array:
        """The load (n,) behind a first-order lag, w = p/(s + p) F, starting at rest under the first load."""
        from smartshoe.kernels.pole_bank import lag_bank

        out = np.empty((self.load.size, 1))
        places = np.arange(self.load.size, dtype=float)
        first = float(self.load[0])
        lag_bank(self.load, places, np.array([pole]), self.step_s, first, -1.0, np.array([first]), out)
        return out[:, 0]


def _even(machine_s: Array, load: Array) -> _Load:
    step = float(np.median(np.diff(machine_s)))
    count = int(np.floor((machine_s[-1] - machine_s[0]) / step + 1e-6)) + 1
    time_s = machine_s[0] + step * np.arange(count)
    return _Load(float(machine_s[0]), step, np.ascontiguousarray(np.interp(time_s, machine_s, load)))


def _solved(design: Array, values: Array) -> tuple[Array, Array]:
    """Least-squares solution with the columns scaled to equal size; returns it and the columns' original sizes."""
    size = np.abs(design).max(axis=0)
    size[size == 0.0] = 1.0
    return np.linalg.lstsq(design / size, values, rcond=None)[0] / size, size


def _one(
    even: _Load, logger_s: Array, signal: Array, delay_s: float, lag_s: float, powers: int, *, at_one_rate: bool
) -> Following:
    grid_s, pole, delay, rate = even.time_s, 1.0 / lag_s, delay_s, 0.0
    largest = float(np.abs(even.load).max()) or 1.0
    bends = [largest * (even.load / largest) ** power for power in range(2, powers + 1)]
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    for _ in range(ITERATIONS):
        lagged = even.lagged(pole)
        at = logger_s + delay + rate * (logger_s - middle)
        inside = (at >= grid_s[0]) & (at <= grid_s[-1])
        at, values = at[inside], signal[inside]
        since = at - grid_s[0]
        ends = np.exp(-pole * since)
        of_load = [even.load, lagged, *bends]
        shapes = np.column_stack([np.ones(at.size), ends, *(np.interp(at, grid_s, one) for one in of_load)])
        linear = _solved(shapes, values)[0]
        followed = np.column_stack(of_load) @ linear[2:]
        tilt = np.interp(at, grid_s, slope_of(grid_s, followed, SLOPE_OVER_S))
        small = 1e-3
        faster = linear[3] * (even.lagged(pole * (1.0 + small)) - lagged) / small
        # The last three columns belong to delay, rate and log p.
        relaxing = np.interp(at, grid_s, faster) - linear[1] * pole * since * ends
        parting = np.zeros(at.size) if at_one_rate else tilt * (logger_s[inside] - middle)
        design = np.column_stack([shapes, tilt, parting, relaxing])
        change, size = _solved(design, values - shapes @ linear)
        residual = values - shapes @ linear - design @ change
        variance = float(residual @ residual) / max(at.size - design.shape[1], 1)
        normal = (design / size).T @ (design / size)
        sd = np.sqrt(np.maximum(np.diag(np.linalg.pinv(normal)) * variance, 0.0)) / size
        delay = float(np.clip(delay + change[-3], delay_s - LONGEST_WAY_S, delay_s + LONGEST_WAY_S))
        rate = float(np.clip(rate + change[-2], -LARGEST_RATE, LARGEST_RATE))
        step = float(np.clip(change[-1], -LARGEST_STEP, LARGEST_STEP))
        pole = float(np.clip(pole * np.exp(step), 1.0 / SLOWEST_S, 1.0 / FASTEST_S))
        if np.all(np.abs(change[-3:-1]) <= SETTLED * sd[-3:-1]):
            break
    rate_hz = 1.0 / float(np.median(np.diff(logger_s)))
    misfit = misfit_of(residual, rate_hz)
    # Noise of an interpolated load is correlated between neighbours: its spread over half seconds is what counts.
    sd *= np.sqrt(max(_of_means(residual, SLOW_S * rate_hz) / max(float(np.var(residual)), 1e-300), 1.0))
    return Following(delay, float(sd[-3]), rate, float(sd[-2]), 1.0 / pole, residual, misfit)


def follow(
    machine_s: Array,
    load: Array,
    logger_s: Array,
    signal: Array,
    delay_s: float,
    powers: int = 1,
    *,
    at_one_rate: bool = False,
) -> Following:
    """Delay and rate of ``signal`` (n,) at ``logger_s`` (n,) behind ``load`` (m,) at ``machine_s`` (m,).

    The search begins at ``delay_s``; of the fits from the time constants `STARTS_S` the better one is returned.
    ``powers``: how many powers of the load the reading follows at once; 1 is a straight characteristic.
    ``at_one_rate``: the two clocks go at one rate.
    """
    even = _even(machine_s, load)
    found = [_one(even, logger_s, signal, delay_s, lag_s, powers, at_one_rate=at_one_rate) for lag_s in STARTS_S]
    return min(found, key=lambda one: float(np.mean(one.residual**2)))


def zeros_at(rests_s: Array, machine_s: Array, load: Array, at_s: Array, signal: Array) -> Array:
    """The reading (k,) at zero load at the times ``rests_s`` (k,), freed of the unit's relaxation there.

    At least two times. Load (m,) at ``machine_s`` (m,) and ``signal`` (n,) at ``at_s`` (n,) are on one clock. The zero
    changes linearly from rest to rest; the lag is the best fitting of `LAGS_S`.
    """
    even = _even(machine_s, load)
    hats = np.column_stack([np.interp(at_s, rests_s, one) for one in np.eye(rests_s.size)])
    level = np.interp(at_s, even.time_s, even.load)
    best: tuple[float, Array] = (np.inf, np.zeros(rests_s.size))
    for lag_s in LAGS_S:
        design = np.column_stack([hats, level, np.interp(at_s, even.time_s, even.lagged(1.0 / lag_s))])
        found = _solved(design, signal)[0]
        error = float(np.mean((signal - design @ found) ** 2))
        if error < best[0]:
            best = error, found[: rests_s.size]
    return best[1]
