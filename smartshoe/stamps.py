"""The step between time stamps, even if they were rounded: 120 Hz written to four decimals is not 8.3 ms."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array

SAME_STEP = 0.01  # relative difference within which steps count as equal
_GAP = 1.75  # usual steps: between stamps further apart a sample is missing
_MOST_DIGITS = 12  # stamps with more digits were not rounded
_PASSES = 3  # each with a better step, which can count the steps in longer gaps
_HALF = 0.6  # of the last digit's value: effect of rounding on a stamp, plus the slope's own error
_SAME = 1e-9  # of a span: rounding of a double


def usual_step_s(time_s: Array) -> float:
    """Time in s from a sample to the next, of increasing stamps (n,), at least two: the median step.

    If stamps were rounded, it is the step of the even grid that they were rounded from.
    """
    step_s = rounded_grid_step_s(time_s)
    return float(np.median(np.diff(time_s))) if step_s is None else step_s


def mean_step_s(time_s: Array) -> float:
    """The mean step in s of stamps (n,), at least two, without gaps (steps of `_GAP` median steps or more)."""
    steps = np.diff(time_s)
    return float(np.mean(steps[steps < _GAP * np.median(steps)]))


def rounded_grid_step_s(time_s: Array) -> float | None:
    """The step in s of the even grid from which stamps (n,) were rounded; None where the median step is as good.

    Each stamp is numbered by the steps before it, and the grid's step is the slope of stamps over numbers. A gap that
    is not a whole number of steps divides the stamps into parts, which share one slope. The median step is kept where
    its own grid explains the stamps to within their rounding; where it differs from the grid's by more than rounding
    explains; where the grid misses a stamp by more than rounding, since sampling was then not even; and where the
    numbers are uncertain, since stamps were rounded to more than half a step.
    """
    steps = np.diff(time_s)
    median, span = float(np.median(steps)), float(time_s[-1] - time_s[0])
    if abs(span - median * steps.size) <= _SAME * span:
        return None
    rounding = _rounding_s(time_s)
    step = mean_step_s(time_s)
    for _ in range(_PASSES):
        numbers = np.rint(steps / step)
        parted = (numbers > 1.0) & (np.abs(steps - numbers * step) > 2.0 * rounding)
        part = np.concatenate([[0], np.cumsum(parted)])
        number, stamp = _centred(np.concatenate([[0.0], np.cumsum(numbers)]), part), _centred(time_s, part)
        if numbers.min() < 1.0 or not number.any():
            return None
        step = float(number @ stamp) / float(number @ number)
    if float(np.abs(stamp - number * step).max()) > _HALF * rounding or rounding > 0.5 * step:
        return None
    off, longest = abs(step - median), 2.0 * float(np.abs(number).max())
    return step if off <= rounding < off * longest else None


def _centred(values: Array, part: Array) -> Array:
    """``values`` (n,) minus the mean of their ``part`` (n,), which are integers from 0 on."""
    out: Array = values - (np.bincount(part, values) / np.bincount(part))[part]
    return out


def _rounding_s(time_s: Array) -> float:
    """The value in s of the last digit of rounded stamps (n,), the largest if it varies; 0 if they were not rounded.

    Programs write a fixed number of decimals, or a fixed number of digits, of which fewer are decimals as time
    increases.
    """
    size = np.abs(time_s)
    largest = float(size.max())
    noise = 4.0 * float(np.spacing(largest))
    first = 10.0 ** np.floor(np.log10(np.where(size > 0.0, size, largest)))  # value of each stamp's first digit

    def last(units: Array, unit: float) -> float:
        for _ in range(_MOST_DIGITS):
            counted, least = time_s / units, 1e-6 + noise / units
            if np.all(np.abs(counted - np.rint(counted)) <= least):
                return unit
            units, unit = units / 10.0, unit / 10.0
        return 0.0

    return max(last(np.ones(1), 1.0), last(first, float(first.max())))


__all__ = ["SAME_STEP", "mean_step_s", "rounded_grid_step_s", "usual_step_s"]
