"""What drifts by: the clock, and the temperature where it was logged."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects.effect import Array, Conditions

LEAST_CHANGE_K = 0.2  # below a cheap probe's noise and steps: such a channel says that the temperature stood still
SAME_AS_TIME = 0.98  # correlation above which a temperature is a clock, and the two have no separate coefficients
BLOCKS = 50


def running_time_s(conditions: Conditions) -> Array:
    """(n,) seconds since the unit rested and was zeroed, through the recordings that this one continues."""
    return conditions.time_s + conditions.before.get("time_s", 0.0)


def drift(conditions: Conditions, values: Array) -> Array:
    """(n,) a rate ``values[0]`` in 1/s times the time and a coefficient ``values[1]`` in 1/K times the temperature.

    The coefficient does nothing without a temperature that moves, the rate nothing where that temperature rises as
    evenly as a clock.
    """
    by_clock, by_temperature = _live(conditions)
    moved = np.zeros(conditions.time_s.size)
    if by_clock:
        moved += values[0] * running_time_s(conditions)
    if by_temperature and conditions.temperature_k is not None:
        moved += values[1] * conditions.temperature_k
    return moved


def _live(conditions: Conditions) -> Array:
    """(2,) whether the clock and the temperature count; kept, since it depends on the channels alone."""
    known = conditions.kept.get("drift_by")
    if known is None:
        temperature = conditions.temperature_k
        known = np.array([True, False])
        if temperature is not None and temperature.size > BLOCKS:
            # Means over blocks, since a thermometer's noise would pass for movement and hide a straight line.
            whole = temperature.size // BLOCKS * BLOCKS
            means = temperature[:whole].reshape(BLOCKS, -1).mean(axis=1)
            if float(np.ptp(means)) >= LEAST_CHANGE_K:
                known = np.array([abs(float(np.corrcoef(means, np.arange(BLOCKS))[0, 1])) < SAME_AS_TIME, True])
        conditions.kept["drift_by"] = known
    return np.asarray(known)
