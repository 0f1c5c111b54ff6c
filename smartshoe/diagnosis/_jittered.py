"""Jitter of the sampling, known before any fit: on the mean it smooths the reading's corners as a window would."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import timing_jitter

# A resolution: a ramp shorter than the jitter seems steeper than it is read, and settles from the second pass on.
PASSES = 3


def as_sampled(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> Array:
    """``load`` (n,) on the mean of the clock that ``reading`` (n,) was sampled by; both in shares of full scale.

    A sample that is taken early or late by a random time with standard deviation s reads, on the mean, what a Gaussian
    window of s would. A relaxation beside a delay does much the same to a corner, and would be named. Linear physics
    commutes with the window, so that the load may pass it in the reading's stead.
    """
    seen = load
    for _ in range(PASSES):
        sd_s = jitter_s(seen, reading, step_s)
        if not 0.0 < sd_s <= thresholds.echo_s:  # what is later than any echo is no jitter of a clock that can be used
            return load
        seen = np.asarray(gaussian_filter1d(load, sd_s / step_s, mode="nearest"))
    before, after = (abs(float(np.corrcoef(one, reading)[0, 1])) for one in (load, seen))
    return seen if after > before else load


def jitter_s(load: Array, reading: Array, step_s: float) -> float:
    """Standard deviation of the sampling time in s, by noise that follows the slope; 0 where it does not."""
    scale = float(np.dot(load, load))
    if scale == 0.0:
        return 0.0
    prediction = load * float(np.dot(load, reading)) / scale
    return timing_jitter.jitter_s(reading - prediction, prediction, step_s)
