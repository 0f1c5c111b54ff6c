"""Estimates the noise of a reading from the reading alone."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Mask

BLOCK = 16  # samples: 80 ms at 200 Hz, shorter than a swing
CALM = 0.2  # of the blocks: less than the share of a stride in which a foot swings or stands still
# A block's mean square over its expectation is chi-square with 16/1.94 degrees of freedom, since second differences
# of white noise correlate by -2/3 and 1/6 (sum of squares 1.94): the mean of its lowest fifth, its 99 % quantile, and
# the mean below that.
LOWEST_FIFTH, HIGHEST, BELOW_HIGHEST = 0.424, 2.48, 0.982
ROUNDS = 20


def reading_noise_sd(readings: Array, missing: Mask | None = None) -> float:
    """The standard deviation of white noise on ``readings`` (n,), in their unit, at least that of its quantisation.

    Second differences remove level and slope. Of short blocks, the calmest fifth is used, and further blocks whose
    differences are no larger than noise explains. Quantisation with step d is a noise of d/sqrt(12).
    """
    there = readings if missing is None else readings[~missing]
    steps = np.abs(np.diff(there))
    steps = steps[steps > 0]
    if steps.size == 0:
        return 0.0
    quantised = float(np.quantile(steps, 0.01) / np.sqrt(12.0))
    curvature = np.diff(there, 2)
    count = curvature.size // BLOCK
    if count == 0:
        return quantised
    power = np.mean(curvature[: count * BLOCK].reshape(count, BLOCK) ** 2, axis=1)
    level = float(np.mean(np.sort(power)[: max(1, round(CALM * count))])) / LOWEST_FIFTH
    for _ in range(ROUNDS):
        level, before = float(np.mean(power[power <= HIGHEST * level])) / BELOW_HIGHEST, level
        if level == before:
            break
    # The variance of a second difference of white noise is six times the noise's.
    return max(float(np.sqrt(level / 6.0)), quantised)
