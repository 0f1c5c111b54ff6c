"""What zeros and gains drift with: the time since the session began, and the temperature where it was logged."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects.effect import LEAST_CHANGE_K, Conditions, EffectParameter
from smartshoe.models.first_order import lag

SAME_AS_TIME = 0.98  # correlation above which a temperature is a clock, and the two have no separate coefficients
SMOOTHED_S = 3.0  # over which a thermometer's noise is averaged; a body that is faster looks the same
BLOCKS = 50
TEMPERATURE_LAG = EffectParameter(
    "temperature_lag",
    "s",
    "time constant by which the sensor's body follows the temperature that was logged",
    None,
    0.1,
    300.0,
    SMOOTHED_S,
    channel="temperature",
    absent=0.0,
    natural="lower",
)
TEMPERATURE_LAGS = ({"temperature_lag": SMOOTHED_S}, {"temperature_lag": 60.0})  # a bare die's, and a housing's
FIRST_S = 100.0  # over which the rate of a drift is the mean one, whatever its exponent
EXPONENT = EffectParameter("exponent", "1", "power of the time, 1 for a steady drift", None, 0.4, 2.0, 0.05, absent=1.0)


def running_time_s(conditions: Conditions) -> Array:
    """(n,) seconds since the unit rested and was zeroed, also where this recording continues others."""
    return conditions.kept("running_time_s", (), lambda: conditions.time_s + conditions.before.get("time_s", 0.0))


def grown(time_s: Array, exponent: float) -> Array:
    """(n,) the time in which a steady drift would come as far as one with this ``exponent`` does in ``time_s`` (n,)."""
    return time_s if exponent == 1.0 else np.asarray(FIRST_S * (time_s / FIRST_S) ** exponent)


def grown_in_c(exponent: float) -> str:
    """`grown` as a C expression of ``t`` in s; for a steady drift without a power, which firmware would pay for."""
    return "t" if exponent == 1.0 else f"{c_number(FIRST_S)} * pow(t / {c_number(FIRST_S)}, {c_number(exponent)})"


def drift(conditions: Conditions, values: Array, exponent: float, carried_over: float = 0.0) -> Array:
    """(n,) a rate ``values[0]`` in 1/s times the time, and a coefficient ``values[1]`` in 1/K times the temperature.

    1. The time is `grown` by ``exponent``.
    2. The sensor's body follows the logged temperature by a first-order lag of ``values[2]`` s, and is as warm as that
       where the recording begins.
    3. The coefficient does nothing where no temperature moves. The rate does nothing where the temperature rises as
       evenly as a clock, since the two cannot then be told apart.
    4. ``carried_over``: the share that counts of how much warmer the recording begins than the first of all.
    """
    warmer_k = _warmer_k(conditions)
    moved = np.zeros(conditions.time_s.size)
    if warmer_k.size and values[1] != 0.0:
        moved += values[1] * (lag(warmer_k, 1.0 / values[2], float(conditions.step_s)) if values[2] > 0.0 else warmer_k)
    if carried_over != 0.0:
        moved += values[1] * carried_over * conditions.begins_warmer_k
    if not warmer_k.size or conditions.cache["drift_by_clock"][0] > 0.0:
        moved += values[0] * conditions.kept("grown", (exponent,), lambda: grown(running_time_s(conditions), exponent))
    return moved


def settled_so_far(conditions: Conditions, tau_s: float, stretch: float) -> Array:
    """(n,) `settled` at the `running_time_s`."""
    return conditions.kept("settled", (tau_s, stretch), lambda: settled(running_time_s(conditions), tau_s, stretch))


def settled(time_s: Array, tau_s: float, stretch: float) -> Array:
    """(n,) the share that has settled at ``time_s``: 1 - exp(-(t/s)^stretch) (Kohlrausch 1854), mean time ``tau_s``."""
    return np.asarray(-np.expm1(-((time_s / _settling_scale(tau_s, stretch)) ** stretch)))


def unsettled_in_c(tau_s: float, stretch: float) -> str:
    """Minus `settled`, as a C expression of ``t`` in s."""
    return f"expm1(-pow(t / {c_number(_settling_scale(tau_s, stretch))}, {c_number(stretch)}))"


def _settling_scale(tau_s: float, stretch: float) -> float:
    """The s in exp(-(t/s)^stretch) for which the mean time of settling is ``tau_s``."""
    return tau_s / math.gamma(1.0 + 1.0 / stretch)


def _warmer_k(conditions: Conditions) -> Array:
    """The smoothed temperature (n,) above the recording's own first; (0,) where none was logged or it stood still."""
    known = conditions.cache.get("warmer_k")
    if known is None:
        known = np.zeros(0)
        temperature = conditions.temperature_k
        if temperature is not None and temperature.size > BLOCKS:
            # Means over blocks, since a thermometer's noise would pass for movement and hide a straight line.
            whole = temperature.size // BLOCKS * BLOCKS
            means = temperature[:whole].reshape(BLOCKS, -1).mean(axis=1)
            if float(np.ptp(means)) >= LEAST_CHANGE_K:
                known = _running_mean(temperature - temperature[0], round(0.5 * SMOOTHED_S / conditions.step_s))
                like_time = abs(float(np.corrcoef(means, np.arange(BLOCKS))[0, 1])) >= SAME_AS_TIME
                conditions.cache["drift_by_clock"] = np.array([0.0 if like_time else 1.0])
        conditions.cache["warmer_k"] = known
    return known


def _running_mean(signal: Array, half: int) -> Array:
    """(n,) means over ``half`` samples on either side, near the ends over as many as both sides have."""
    n = signal.size
    k = np.arange(n)
    reach = np.minimum(np.minimum(k, n - 1 - k), half)
    summed = np.concatenate([[0.0], np.cumsum(signal)])
    return np.asarray((summed[k + reach + 1] - summed[k - reach]) / (2 * reach + 1))
