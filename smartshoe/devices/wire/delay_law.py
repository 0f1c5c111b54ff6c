"""The distribution of delays, from arrivals that keep their order, and the maximum-likelihood line through them.

A serial line keeps the order of samples: a sample that would be faster than the one before it arrives together with it.
So the delay of a sample that arrived later than its predecessor is known; of one that arrived together with it, only
that its own delay was *at most* the observed one. A queue behind a slow sample, a packet and a stall of seconds are all
of this kind, and carry almost no information once they are treated so.

The delays' distribution is a Pearson III (a gamma distribution from a minimum on: from exponential to normal), with a
share `STRAY` of arbitrary values. It need not be the true one: the line's errors are estimated from the scatter of its
scores from second to second (a sandwich estimate), not from the distribution.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Self

import numpy as np

from smartshoe.arrays import Array, Integers, Mask
from smartshoe.devices.wire.delay_line import CRYSTALS_SD, SETTLED, DelayLine, of_few

CELLS = 600  # in each table
TOP = 0.995  # the quantile of the delays at which the tables end
STRAY = 0.01
LEAST_PROBABILITY = 1e-9
ROUNDS = 12
LONGEST_STEP = 3.0  # standard errors per iteration
RESOLUTION_S = 1e-7


class DelayLaw:
    """Scores of delays above a line, from a distribution with a fixed position: these determine the line."""

    def __init__(self, grid_s: Array, log_density: Array, log_probability: Array) -> None:
        self._first_s, self._width_s = float(grid_s[0]), float(grid_s[1] - grid_s[0])
        scores = [-np.gradient(table, self._width_s) for table in (log_density, log_probability)]
        curvatures = [np.gradient(table, self._width_s) for table in scores]
        # Beyond the tables scores are 0. Exactly known delays first, then those that are only upper bounds.
        self._score = np.concatenate([np.pad(table, 1) for table in scores])
        self._curvature = np.concatenate([np.pad(table, 1) for table in curvatures])

    @classmethod
    def of(cls, delay_s: Array, came_with: Mask) -> Self:
        """The maximum-likelihood distribution of delays (n,).

        ``came_with`` (n,) marks those that are only upper bounds.
        """
        from scipy.optimize import minimize

        exact = delay_s[~came_with]
        middle, spread = (
            float(np.median(exact)),
            max(float(np.subtract(*np.quantile(exact, (0.84, 0.16)))) / 2, RESOLUTION_S),
        )
        finest = spread / math.sqrt(exact.size)
        low, high = float(delay_s.min()) - 8.0 * finest, max(float(np.quantile(exact, TOP)), middle + 4.0 * spread)
        edges = np.linspace(low, high, CELLS + 1)
        width = edges[1] - edges[0]
        known = np.histogram(exact, edges)[0]
        at_most = np.histogram(delay_s[came_with], edges)[0]
        smoothing = max(finest, 2.0 * width)

        def unlikelihood(shape: Array) -> float:
            log_density, log_probability = _tables(shape, edges, smoothing, middle, spread)
            return -float(known @ log_density + at_most @ log_probability)

        found = [
            minimize(
                unlikelihood,
                start,
                method="Nelder-Mead",
                options={
                    "maxiter": 150,
                    "xatol": 0.01,
                    "fatol": 0.1,
                    "initial_simplex": start + 0.5 * np.eye(4, 3, -1),
                },
            )
            for start in (np.array([0.0, 0.0, -3.0]), np.array([0.0, 0.0, 2.0]))
        ]
        best = min(found, key=lambda each: float(each.fun))
        return cls(edges[:-1] + width / 2.0, *_tables(best.x, edges, smoothing, middle, spread))

    def moved(self, by_s: float) -> DelayLaw:
        """The same distribution for a line that is lower by ``by_s``."""
        moved = copy(self)
        moved._first_s += by_s
        return moved

    def line(
        self, time_s: Array, delay_s: Array, came_with: Mask, group: Integers, start: DelayLine
    ) -> DelayLine | None:
        """The line through samples (n,), starting from ``start``; errors may be correlated within each ``group`` (n,).

        The usual skews of crystals are its prior. None where the samples do not determine a line.
        """
        about, offset, slope = start.about_s, start.offset_s, start.slope
        row = (CELLS + 2) * came_with + 1.5
        lever = time_s - about
        prior = np.diag([0.0, CRYSTALS_SD**-2.0])
        for _ in range(ROUNDS):
            rest = delay_s - offset - slope * lever
            place = (np.clip((rest - self._first_s) / self._width_s, -1.0, CELLS) + row).astype(np.intp)
            score, curvature = self._score[place], self._curvature[place]
            gradient = np.array([score.sum(), (lever * score).sum()]) - prior @ [0.0, slope]
            # Minus the second derivative, since the score decreases as the line rises.
            information = prior + _moments(curvature, lever)
            if information[0, 0] <= 0.0 or np.linalg.det(information) <= 0.0:
                information = prior + _moments(score**2, lever)
            if np.linalg.det(information) <= 0.0:
                return None
            step = np.linalg.solve(information, gradient)
            sd = np.sqrt(np.diag(np.linalg.inv(information)))
            step /= max(1.0, float(np.abs(step / sd).max()) / LONGEST_STEP)
            offset, slope = offset + float(step[0]), slope + float(step[1])
            if (np.abs(step) < SETTLED * sd).all():
                break
        count = int(group[-1]) + 1
        free = max(count - 2, 1)
        sums = np.column_stack([np.bincount(group, score, count), np.bincount(group, lever * score, count)])
        inverse = np.linalg.inv(information)
        covariance = inverse @ (sums.T @ sums * (of_few(free) ** 2 * count / free) + prior) @ inverse
        # The time at which offset and slope are independent.
        shift = -float(covariance[0, 1] / covariance[1, 1])
        offset_sd = math.sqrt(max(float(covariance[0, 0] + shift * covariance[0, 1]), 0.0))
        return DelayLine(about + shift, offset + slope * shift, offset_sd, slope, math.sqrt(float(covariance[1, 1])))


def _moments(weights: Array, lever: Array) -> Array:
    # Sums instead of vector products, which would start a thread per core for a few thousand numbers.
    of_lever = weights * lever
    first = float(of_lever.sum())
    return np.array([[float(weights.sum()), first], [first, float((of_lever * lever).sum())]])


def _tables(shape: Array, edges: Array, smoothing: float, middle: float, spread: float) -> tuple[Array, Array]:
    """Log density and log probability (CELLS,) for given mean, spread and skewness, smoothed over ``smoothing``."""
    from scipy.special import gammainc

    width = float(edges[1] - edges[0])
    sd, skewness = spread * math.exp(min(shape[1], 20.0)), 2.0 / (1.0 + math.exp(-min(max(shape[2], -8.0), 20.0)))
    count, scale = 4.0 / skewness**2, sd * skewness / 2.0
    floor = middle + spread * shape[0] - count * scale
    # Extended beyond the tables on both sides, as smoothing needs it.
    reach = math.ceil(4.0 * smoothing / width)
    wider = np.concatenate(
        [edges[0] + width * np.arange(-reach, 0), edges, edges[-1] + width * np.arange(1, reach + 1)]
    )
    cumulative = gammainc(count, np.maximum(wider - floor, 0.0) / scale)
    kernel = np.exp(-0.5 * (width / smoothing * np.arange(-reach, reach + 1)) ** 2)
    shares = np.convolve(np.diff(cumulative), kernel / kernel.sum(), "valid")
    strays = STRAY / shares.size
    shares = (1.0 - STRAY) * shares + strays
    below = np.cumsum(shares) - shares / 2.0 + (1.0 - STRAY) * float(cumulative[reach])
    return np.log(np.maximum(shares, LEAST_PROBABILITY)) - math.log(width), np.log(np.maximum(below, LEAST_PROBABILITY))
