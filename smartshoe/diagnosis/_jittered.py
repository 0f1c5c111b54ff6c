"""Jitter of the sampling, estimated before any fit: on average it smooths the reading's corners like a window."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import timing_jitter

# A resolution: a ramp shorter than the jitter seems steeper than it is read; it settles from the second pass on.
PASSES = 3


def with_sampling_jitter(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> Array:
    """``load`` (n,) smoothed by the sampling jitter of ``reading`` (n,); both in shares of full scale.

    A sample taken early or late by a random time of standard deviation s reads, on average, what a Gaussian window of s
    gives. A relaxation beside a delay does nearly the same to a corner, and would be named. Linear physics commutes
    with the window, so that the load may be smoothed instead of the reading.
    """
    smoothed = load
    for _ in range(PASSES):
        sd_s = jitter_s(smoothed, reading, step_s)
        if not 0.0 < sd_s <= thresholds.echo_s:  # longer than any echo, it is no jitter of a usable clock
            return load
        smoothed = np.asarray(gaussian_filter1d(load, sd_s / step_s, mode="nearest"))
    before, after = (abs(float(np.corrcoef(one, reading)[0, 1])) for one in (load, smoothed))
    return smoothed if after > before else load


def jitter_s(load: Array, reading: Array, step_s: float) -> float:
    """Standard deviation of the sampling time in s, from noise that follows the slope; 0 where it does not."""
    scale = float(np.dot(load, load))
    if scale == 0.0:
        return 0.0
    prediction = load * float(np.dot(load, reading)) / scale
    return timing_jitter.jitter_s(reading - prediction, prediction, step_s)
