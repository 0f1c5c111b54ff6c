"""A zero, and a gain, that follow the temperature of a die within its housing, while the thermometer is in the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank
from scipy.signal import lfilter

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Channel, Recording
from smartshoe.units import unit

SLAB_S = 50.0  # of the slowest mode
START_C = 22.0
SHARE_PER_KELVIN = 0.006  # of full scale
GAIN_PER_KELVIN = -0.004


def _air_k(time_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(n,) air above its first value: somebody opens a door, and somebody turns the heating up."""
    cooled = -rng.uniform(1.0, 2.5) * -np.expm1(-np.maximum(time_s - rng.uniform(10.0, 60.0), 0.0) / 40.0)
    heated = rng.uniform(2.0, 4.0) * -np.expm1(-np.maximum(time_s - rng.uniform(80.0, 140.0), 0.0) / 90.0)
    return np.asarray(cooled + heated)


def _amid_k(air_k: np.ndarray, step_s: float) -> np.ndarray:
    """(n,) the middle of a slab whose faces are as warm as the air: all odd modes (Carslaw and Jaeger 1959, 3.3)."""
    odd = np.arange(1, 20, 2)
    weight = np.where(np.arange(odd.size) % 2, -1.0, 1.0) / odd
    rises = np.diff(air_k, prepend=0.0)
    left = np.array([lfilter([keep], [1.0, -keep], rises) for keep in np.exp(-step_s * odd**2 / SLAB_S)])
    return np.asarray(air_k - weight @ left / weight.sum())


def _warmed(recording: Recording, full_scale: float, rng: np.random.Generator) -> Recording:
    reading = recording.sensors[0]
    air_k = _air_k(recording.time_s, rng)
    moved = SHARE_PER_KELVIN * full_scale * _amid_k(air_k, recording.sample_time_s)
    thermometer = Channel.from_values("temperature", START_C + air_k, unit("°C"))
    return recording.with_channel(replace(reading, values=reading.values + moved)).with_channel(thermometer)


def _in_a_room(recording: Recording, room_k: float, rng: np.random.Generator) -> Recording:
    """The gain of a sensor that has come to a room ``room_k`` above the first, and goes on with its air."""
    reading = recording.sensors[0]
    air_k = room_k + _air_k(recording.time_s, rng)
    gain = 1.0 + GAIN_PER_KELVIN * (room_k + _amid_k(air_k - room_k, recording.sample_time_s))
    thermometer = Channel.from_values("temperature", START_C + air_k, unit("°C"))
    return recording.with_channel(replace(reading, values=reading.values * gain)).with_channel(thermometer)


@pytest.mark.parametrize("seed", first_and_bank(range(3), {0}))
def test_a_gain_that_follows_the_temperature_from_room_to_room_is_told(seed: int) -> None:
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed, recordings=3)
    rng = np.random.default_rng(seed)
    fitted = [_in_a_room(one, room_k, rng) for one, room_k in zip(case.recordings, (0.0, 7.0, -4.0), strict=True)]
    held_out = [_in_a_room(one, 3.0, rng) for one in case.hold_out]
    found = diagnose(fitted, held_out)
    told = next(cause for cause in found.causes if cause.name == "gain_drift")
    assert told.confidence > 0.5
    # Within a recording lag and coefficient stand in for one another; what is between rooms is told.
    coefficient, share = (told.parameters[name].value for name in ("temperature_coefficient", "carried_over"))
    assert coefficient * share == pytest.approx(GAIN_PER_KELVIN, rel=0.05)
    assert found.verdict == "explained"
    assert found.explained_percent > 0.75 * found.explainable_percent


@pytest.mark.parametrize("seed", first_and_bank(range(4), {0}))
def test_a_zero_that_lags_behind_the_temperature_is_told(seed: int) -> None:
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    rng = np.random.default_rng(seed)
    full_scale = float(np.ptp(case.recordings[0].sensors[0].values))
    fitted, held_out = ([_warmed(one, full_scale, rng) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert found.verdict == "explained"
    told = next(cause for cause in found.causes if cause.name == "zero_drift")
    assert told.confidence > 0.5
    # Lag and coefficient stand in for one another where a recording ends before the housing has settled.
    coefficient = told.parameters["temperature_coefficient"].value
    assert 0.5 < coefficient / (SHARE_PER_KELVIN * full_scale) < 2.0
    assert found.explained_percent > 0.75 * found.explainable_percent
