"""Hidden effects: gain that changes with time or temperature."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, Options, Subject, log_uniform, sensor, signed
from simulators.hidden.effects.zero import PER_KELVIN, ROOM, by_temperature
from smartshoe.arrays import Array


def _by_clock_or_room(amount: float, draws: Draws, subject: Subject) -> Options:
    size = draws["sign"] * amount
    if draws["by_temperature"]:
        return {"sensor": {"drift": {"gain_percent_per_k": PER_KELVIN * size}}, "room": ROOM}
    return sensor(drift={"gain_percent_per_s": size})


def _catalogue(amount: float, draws: Draws, subject: Subject, hz: float) -> dict[str, float]:
    size = 0.01 * draws["sign"] * amount
    if draws["by_temperature"]:
        return {"temperature_coefficient_per_k": PER_KELVIN * size}
    return {"drift_rate_per_s": size}


def settling(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """An exponential change that settles within the session."""
    course = np.expm1(-at.time_s / draws["time_constant_s"])
    return np.asarray(y * (1.0 - draws["sign"] * amount * course))


def oxidation(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """sqrt(1 + t/tau) - 1: linear at first, then as the square root."""
    return np.asarray(y * (1.0 + draws["sign"] * amount * (np.sqrt(1.0 + at.time_s / draws["time_constant_s"]) - 1.0)))


EFFECTS = [
    Hideable("gain_drift", "gain_drift", "sensor", "gain drift", "%/s", 0.005, 2.0, _by_clock_or_room, by_temperature,
        law="line", says="a straight line in time, or in the room's temperature", source="data sheets",
        catalogue=_catalogue,
        laws=(
            Law("settling", "reading", "an exponential that settles within minutes", "ageing of a reference", settling,
                0.03, 0.6, signed(log_uniform(time_constant_s=(60.0, 300.0))), bends="time"),
            Law("deal_grove", "reading", "linear at first, then by the root of time", "Deal and Grove 1965", oxidation,
                0.03, 0.6, signed(log_uniform(time_constant_s=(15.0, 120.0))), bends="time"),
        )),
]  # fmt: skip
