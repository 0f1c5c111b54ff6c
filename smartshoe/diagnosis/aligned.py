"""Recordings put right before any model sees them: on one clock, with the reading's sign and zero taken from the data.

What is put right here is a fault of the data that `smartshoe.diagnosis.integrity` has told of, or a convention of a
sensor that is no pressure. It must not be left to a model: a lag or a relaxation would be named in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.integrity import Integrity
from smartshoe.diagnosis.session import lowest, resting_reading
from smartshoe.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SAME_LAG = 0.25
SMALL_LAG_S = 0.2
BEGIN_TOGETHER = 0.4  # of the lag in the middle: what the lag at the start may be, where it is all drift
LARGEST_DELAY_S = 2.9
UNLOADED = 0.1  # of the largest load: where the lowest ones do not come below it, no rest is seen
FOREIGN_ZERO = 0.3  # of the reading's span: a zero beyond it is the sensor's convention, no offset


def common_delay_s(integrity: Integrity) -> float:
    """The one delay of all readings, where two clocks are a constant apart in every recording; 0 where they are not.

    Such a delay is a cause like any other, and the model bears it.
    """
    lags = np.array(integrity.clock_offset_s)
    if not lags.any() or any(integrity.clock_rate) or np.ptp(lags) > SAME_LAG * np.max(np.abs(lags)):
        return 0.0
    mean = float(np.mean(lags))
    return mean if abs(mean) <= LARGEST_DELAY_S else 0.0


def common_drift(integrity: Integrity, recordings: Sequence[Recording]) -> float:
    """How much faster one clock runs, where all recordings begin together and part alike; 0 where they do not.

    A drift is a cause like any other, and the model bears it.
    """
    offsets, rates = np.array(integrity.clock_offset_s), np.array(integrity.clock_rate)
    if not rates.any() or np.ptp(offsets) > max(SAME_LAG * np.max(np.abs(offsets)), SMALL_LAG_S):
        return 0.0
    half_s = 0.5 * np.array([recording.duration_s for recording in recordings])
    begins = (offsets - rates * half_s)[rates != 0]
    if np.max(np.abs(begins)) > max(BEGIN_TOGETHER * np.max(np.abs(offsets)), SMALL_LAG_S):
        return 0.0
    return float(np.mean(offsets / half_s))


def drift_rates(integrity: Integrity, recordings: Sequence[Recording]) -> list[float]:
    """How much faster one clock may run, if all recordings began together: from each lag seen, and its growth."""
    half_s = [0.5 * recording.duration_s for recording in recordings]
    offsets = [offset_s / half for offset_s, half in zip(integrity.clock_offset_s, half_s, strict=True)]
    return [float(np.mean(offsets)), *offsets, *integrity.clock_rate]


def on_one_clock(integrity: Integrity) -> Integrity:
    """The findings where what looked like two clocks is something else."""
    none = (0.0,) * len(integrity.clock_offset_s)
    faults = tuple(fault for fault in integrity.faults if fault.kind != "two_clocks")
    return replace(integrity, faults=faults, clock_offset_s=none, clock_rate=none)


def put_right(recordings: Sequence[Recording], integrity: Integrity) -> tuple[list[Recording], list[Mask], list[str]]:
    """The recordings, sensors aligned, turned and zeroed where they must be; usable samples; a sentence for each."""
    made: list[Recording] = []
    usable: list[Mask] = []
    said: list[str] = []
    borne = common_delay_s(integrity) != 0.0 or common_drift(integrity, recordings) != 0.0
    for recording, mask, offset_s, rate in zip(
        recordings, integrity.usable, integrity.clock_offset_s, integrity.clock_rate, strict=True
    ):
        if (offset_s or rate) and not borne:
            recording, mask = _on_one_clock(recording, mask, offset_s, rate)
            way = "earlier" if offset_s > 0 else "later"
            said.append(
                f"{recording.label}: the reading was moved {abs(offset_s):.3g} s {way}"
                " to the load's clock before anything else: nothing is said of delays in it"
            )
        recording, sentence = _turned_and_zeroed(recording, mask)
        if sentence:
            said.append(sentence)
        made.append(recording)
        usable.append(mask)
    return made, usable, said


def _on_one_clock(recording: Recording, usable: Mask, offset_s: float, rate: float) -> tuple[Recording, Mask]:
    time_s = recording.time_s
    middle = 0.5 * (time_s[0] + time_s[-1])
    source_s = time_s + offset_s + rate * (time_s - middle)
    sensor = recording.sensor
    values = np.interp(source_s, time_s, sensor.values)
    inside = (source_s >= time_s[0]) & (source_s <= time_s[-1])
    nearest = np.clip(np.searchsorted(time_s, source_s), 0, time_s.size - 1)
    return recording.with_channel(replace(sensor, values=values, missing=None)), inside & usable[nearest]


def _turned_and_zeroed(recording: Recording, usable: Mask) -> tuple[Recording, str]:
    """A reading that falls with the load is turned; one that is no gauge pressure, or far from zero, is zeroed."""
    sensor, load_n = recording.sensor, recording.force_n
    if usable.sum() < 10:
        return recording, ""
    values, load = sensor.values[usable], load_n[usable]
    span = float(np.percentile(values, 99) - np.percentile(values, 1))
    low = lowest(load)
    rest = resting_reading(values, load)
    unloads = float(np.median(np.abs(load[low]))) < UNLOADED * float(np.percentile(np.abs(load), 99.9))
    falls = float(np.corrcoef(values, load)[0, 1]) < -0.5 if span > 0 else False
    foreign = unloads and (sensor.unit.quantity != "pressure" or abs(rest) > FOREIGN_ZERO * span)
    if not (falls or (foreign and span > 0 and abs(rest) > 0.02 * span)):
        return recording, ""
    zero = rest if foreign else 0.0
    turned = -(sensor.values - zero) if falls else sensor.values - zero
    what = [f"zeroed at its rest, {rest:.4g} {sensor.unit.symbol}"] if foreign else []
    what += ["turned, since it falls with the load"] if falls else []
    sentence = f"{recording.label}: the reading was {' and '.join(what)}: nothing is said of its zero"
    return recording.with_channel(replace(sensor, values=turned)), sentence
