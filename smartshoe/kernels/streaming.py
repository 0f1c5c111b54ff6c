"""A bank of first-order filters over ticks and blocks, compiled when this module is imported.

``bank`` (8, units), rows in this order: numerator of z^0 and of z^-1, denominator of z^-1, static gain, offset, state
of the filter, last finite reading (NaN before the first), count of readings that were not finite. The recursion is
that of `scipy.signal.lfilter` (transposed direct form II), rounding and all; `Compensator` is the slow twin.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_BANK = "float64[:, ::1]"


@njit(inline="always", error_model="numpy")
def _step(reading, bank, unit):  # type: ignore[no-untyped-def]
    """Force of one reading of one unit; updates the unit's column of ``bank``."""
    if not np.isfinite(reading):
        bank[7, unit] += 1.0
        reading = bank[6, unit]
        if np.isnan(reading):
            return 0.0
    elif np.isnan(bank[6, unit]):
        # With y = n0 u + state, this state makes the first output that of the static gain.
        bank[5, unit] = (bank[3, unit] - bank[0, unit]) * (reading - bank[4, unit])
    bank[6, unit] = reading
    u = reading - bank[4, unit]
    y = bank[5, unit] + bank[0, unit] * u
    bank[5, unit] = u * bank[1, unit] - y * bank[2, unit]
    return y


@njit(f"boolean(float64[::1], float64[::1], {_BANK})", cache=True, error_model="numpy")
def push_tick(readings, forces_n, bank):  # type: ignore[no-untyped-def]
    """Write the forces (units,) of one tick of readings (units,); False, without any effect, where shapes differ."""
    units = bank.shape[1]
    if readings.size != units or forces_n.size != units:
        return False
    for unit in range(units):
        forces_n[unit] = _step(readings[unit], bank, unit)
    return True


@njit(f"void(float64[:, ::1], float64[:, ::1], {_BANK})", cache=True, error_model="numpy")
def push_block(readings, forces_n, bank):  # type: ignore[no-untyped-def]
    """Write the forces (ticks, units) of readings (ticks, units) of the same shape, tick by tick."""
    for tick in range(readings.shape[0]):
        for unit in range(readings.shape[1]):
            forces_n[tick, unit] = _step(readings[tick, unit], bank, unit)
