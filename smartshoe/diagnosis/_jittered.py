"""Jitter of the sampling, known before any fit: on the mean it smooths the reading's corners as a window would."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from smartshoe.arrays import Array
from smartshoe.models.effects import Conditions, timing_jitter
from smartshoe.signals.noise import UNIFORM_SD

BLOCK = 12  # samples, over which the slope at which the noise is largest is a mean
PASSES = 3  # a ramp shorter than the jitter seems steeper than it is read; from the second pass on it settles


def as_sampled(load: Array, reading: Array, step_s: float) -> Array:
    """``load`` (n,) on the mean of the clock that ``reading`` (n,) was sampled by; both in shares of full scale.

    A sample that is taken early or late by a random time with standard deviation s reads, on the mean, what a Gaussian
    window of s would. A relaxation beside a delay does much the same to a corner, and would be named. Linear physics
    commutes with the window, so that the load may pass it in the reading's stead.
    """
    seen = load
    for _ in range(PASSES):
        sd = jitter_s(seen, reading, step_s) / step_s
        if sd < UNIFORM_SD:
            return load  # a time stamp says no more
        seen = np.asarray(gaussian_filter1d(load, sd, mode="nearest"))
    return seen


def jitter_s(load: Array, reading: Array, step_s: float) -> float:
    """Standard deviation of the sampling time in s, by noise that follows the slope; 0 where it does not."""
    scale = float(np.dot(load, load))
    count = load.size // BLOCK
    if scale == 0.0 or count == 0:
        return 0.0
    prediction = load * float(np.dot(load, reading)) / scale
    found = timing_jitter.evidence(
        reading - prediction, Conditions(np.asarray(np.arange(load.size) * step_s), load, step_s), prediction, step_s
    )
    if found is None:
        return 0.0
    slope = np.gradient(prediction, step_s)[: count * BLOCK].reshape(count, BLOCK)
    return found.strength / float(np.sqrt(np.max(np.mean(slope**2, axis=1))))
