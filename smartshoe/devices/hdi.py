"""`HdiSensor`: the First Sensor HDI's nominal characteristic, from logged volts to pascal and back."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices.base import ChannelDescription, Sensor
from smartshoe.units import MILLIBAR, VOLT, unit

# First Sensor HDI data sheet: ratiometric, 0.5 to 4.5 V at a supply of 5 V; proof pressure 1 bar.
LOW_V, HIGH_V = 0.5, 4.5
PROOF_PA = 1e5


class HdiSensor(Sensor):
    """An HDI of ``range_mbar`` (100 or 200), unidirectional; without noise or lag: what the data sheet says."""

    def __init__(self, range_mbar: float = 200.0) -> None:
        self._range_pa = float(MILLIBAR.to_si(range_mbar))

    def describe(self) -> ChannelDescription:
        """0.5 to 4.5 V over the range."""
        return ChannelDescription("pressure", VOLT.quantity, unit("V"), (LOW_V, HIGH_V))

    @property
    def range_pa(self) -> tuple[float, float]:
        """Zero to the range in Pa."""
        return 0.0, self._range_pa

    @property
    def proof_pressure_pa(self) -> float:
        """1 bar."""
        return PROOF_PA

    def reset(self) -> None:
        """Nothing is remembered."""

    def read(self, pressure_pa: Array, sample_rate_hz: float) -> Array:
        """Volts (n,) for the pressure (n,) in Pa, clipped to the range."""
        share = np.clip(np.asarray(pressure_pa, dtype=float) / self._range_pa, 0.0, 1.0)
        return np.asarray(LOW_V + (HIGH_V - LOW_V) * share, dtype=float)

    def to_pressure_pa(self, reading_v: Array) -> Array:
        """Pa (n,) for the reading (n,) in volt; outside 0.5 to 4.5 V the line goes on."""
        return (np.asarray(reading_v, dtype=float) - LOW_V) / (HIGH_V - LOW_V) * self._range_pa
