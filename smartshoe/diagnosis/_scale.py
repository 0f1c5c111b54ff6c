"""What all fitted recordings determine together: the full scale of all shares, and the thinning of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import NotIdentifiableError, UnitError
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.loading import ramps
from smartshoe.units import Unit

# Resolutions, chosen for speed. Half and twice of each changed no name in two cases.
SAMPLES_A_RAMP = 24  # samples of the fastest ramp from 10 to 90 % of the load
MOST_SAMPLES = 12_000
MOST_COARSENED = 6.0  # so many times coarser at most than what keeps the fastest ramp


@dataclass(frozen=True, slots=True)
class Scale:
    """Full scale of all fitted data: the largest load in N, and the span of the reading in ``unit``.

    ``reading`` is negative where the reading falls as the load grows. ``zero`` is subtracted from every reading; it is
    a convention of no effect, since each recording's offset is free.
    """

    load_n: float
    reading: float
    unit: Unit
    zero: float = 0.0

    def share(self, values: Array) -> Array:
        """Readings (n,) in ``unit`` as shares."""
        return (values - self.zero) / self.reading


def full_scale(
    recordings: Sequence[Recording],
    usable: Sequence[Mask],
    thresholds: Thresholds,
    following: Sequence[Recording] | None = None,
) -> Scale:
    """The largest load (99.9th percentile, so that a spike does not count) and the reading's span.

    The span is negative where the reading falls as the load rises. The sign is taken from ``following``, the recordings
    with lags removed, since a rising reading that is late by half a load step is low where the load is high. Raises
    `NotIdentifiableError` where load or reading never changes, `UnitError` for readings of two quantities.
    """
    unit = recordings[0].sensor.unit
    pairs = [
        (recording.force_n[mask], reading_in(recording, unit)[mask])
        for recording, mask in zip(recordings, usable, strict=True)
        if mask.any()
    ]
    load = max((float(np.percentile(np.abs(force), 99.9)) for force, _ in pairs), default=0.0)
    # The span of each recording, since zeros may differ between recordings by more than the load moves the reading.
    spans = [float(np.ptp(np.percentile(values, [0.1, 99.9]))) for _, values in pairs]
    if load <= 0 or not spans or max(spans) <= 0:
        raise NotIdentifiableError(
            f"{recordings[0].label}: load or reading never leaves zero: record a load that rises and falls"
        )
    slope = load_reading_covariance(following or recordings, usable)
    zero = 0.0
    if unit.quantity != "pressure":
        zero = float(np.median(np.concatenate([values[at_lowest_load(force, thresholds)] for force, values in pairs])))
    return Scale(load, max(spans) if slope >= 0 else -max(spans), unit, zero)


def load_reading_covariance(recordings: Sequence[Recording], usable: Sequence[Mask]) -> float:
    """Sum of products of load and reading about their means over usable samples; negative where one falls."""
    products = 0.0
    for recording, one in zip(recordings, usable, strict=True):
        mask = one & recording.sensor.present
        if mask.any():
            force, values = recording.force_n[mask], recording.sensor.si[mask]
            products += float(np.dot(force - force.mean(), values - values.mean()))
    return products


def reading_in(recording: Recording, unit: Unit) -> Array:
    """(n,) the reading in ``unit``; raises `UnitError` with the recording's name where its quantity differs."""
    sensor = recording.sensor
    if sensor.unit.quantity != unit.quantity:
        raise UnitError(
            f"{recording.label}: {sensor.name} is in {sensor.unit.symbol} ({sensor.unit.quantity}), the first recording"
            f" is in {unit.symbol} ({unit.quantity}): give all recordings in units of one quantity"
        )
    return sensor.in_unit(unit)


def at_lowest_load(load_n: Array, thresholds: Thresholds) -> Mask:
    """(n,) True at the lowest load, within ``standing``."""
    low, high = float(np.percentile(load_n, 0.1)), float(np.percentile(load_n, 99.9))
    return np.asarray(load_n <= low + thresholds.standing * (high - low))


def thinning(recordings: Sequence[Recording], scale: Scale, thresholds: Thresholds) -> list[int]:
    """The factor by which each recording may be thinned so that the fastest ramp of all keeps its shape.

    If too many samples are left, further, down to what the fastest ramp needs at least: the same factor for all, or a
    recording's own where that is clearly larger. For quick steps between long holds fewer samples suffice.
    """
    finest = []  # factors, not rounded, at which the fastest ramp keeps its shape
    for recording, span in zip(recordings, _spans(recordings, scale, thresholds.standing), strict=True):
        step_s = recording.sample_time_s
        load = recording.force_n / scale.load_n
        window = max(1, round(0.05 / step_s))
        if load.size <= 2 * window:
            finest.append(1.0)
            continue
        slope = np.abs(load[window:] - load[:-window]) / (window * step_s)
        moved = [
            one
            for one in ramps(recording.time_s, load)
            if abs(load[one.stop - 1] - load[one.start]) > thresholds.same * span
        ]
        stepped = max((abs(one.rate_n_per_s) for one in moved), default=0.0)
        fastest = max(float(np.percentile(slope, 99.5)), stepped / thresholds.clear)
        ramp_s = 0.8 * span / fastest if fastest > 0 else recording.duration_s
        finest.append(ramp_s / SAMPLES_A_RAMP / step_s + 1e-3)  # time stamps are rounded
    total = sum(len(recording) for recording in recordings)
    shape = max(1, int(min(finest)))
    wanted = -(-total // MOST_SAMPLES)
    factors = []
    for steps in finest:
        # Of a ramp without samples to spare a sixth is kept, where the logger itself resolved as much.
        kept = int(MOST_COARSENED * min(steps, max(1, int(steps)))) or round(MOST_COARSENED)
        factors.append(max(shape, min(wanted, kept)))
    alike = min(factors)
    return [one if one >= thresholds.clear * alike else alike for one in factors]


def fitted_lengths(recordings: Sequence[Recording], factors: Sequence[int]) -> list[int]:
    """The number of samples from the start of each recording that are fitted: all, unless there are too many.

    Quick loads over hours, thinned further, would appear as a delay, and one part is like another. Short recordings
    stay whole; the others are cut to one common length.
    """
    counts = [len(one) / factor for one, factor in zip(recordings, factors, strict=True)]
    room, longest = MOST_COARSENED * MOST_SAMPLES, math.inf
    for place, count in enumerate(sorted(counts)):
        even = room / (len(counts) - place)
        if count > even:
            longest = even
            break
        room -= count
    return [
        len(one) if count <= longest else math.ceil(longest * factor)
        for one, count, factor in zip(recordings, counts, factors, strict=True)
    ]


def _spans(recordings: Sequence[Recording], scale: Scale, standing: float) -> Array:
    """(recordings,) range of each load in full scales; 1 where it is nearly all, or where the load stands still."""
    spans = np.array([np.ptp(np.percentile(one.force_n, [0.1, 99.9])) for one in recordings]) / scale.load_n
    is_part = (spans > standing * spans.max()) & (spans < 1.0 - standing)
    return np.where(is_part, spans, 1.0)
