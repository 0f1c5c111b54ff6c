"""How a reading runs over its load, without any model: what can still be told where a diagnosis is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.thresholds import Thresholds
from smartshoe.recording import Recording

Array = NDArray[np.float64]
STANDARD = Thresholds()


def course_of(recording: Recording, thresholds: Thresholds = STANDARD) -> str | None:
    """A sentence on curve and loop of the reading over its load; None where the two hardly go together.

    Medians of the reading over bins of the load, loading and unloading apart: their mean is the curve, half of their
    difference the loop.
    """
    if not recording.of_role("load") or len(recording.sensors) != 1:
        return None
    load, sensor = recording.load, recording.sensor
    present = load.present & sensor.present
    x, y = load.values[present], sensor.values[present]
    if x.size < thresholds.least_samples or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    width = max(1, round(0.5 * thresholds.echo_s / recording.sample_time_s))
    rate = np.gradient(np.convolve(x, np.full(width, 1.0 / width), "same"))
    low, high = (float(value) for value in np.percentile(x, [1, 99]))
    still = thresholds.standing * float(np.quantile(np.abs(rate), 1.0 - thresholds.faulty_share))
    # Rice's rule, of each direction's half.
    bins = 2 * round((0.5 * x.size) ** (1.0 / 3.0))
    edges = np.linspace(low, high, bins + 1)
    at, ups, downs = [], [], []
    for left, right in pairwise(edges):
        inside = (x >= left) & (x < right)
        up, down = y[inside & (rate > still)], y[inside & (rate < -still)]
        if min(up.size, down.size) > 2:
            at.append(0.5 * (left + right))
            ups.append(float(np.median(up)))
            downs.append(float(np.median(down)))
    if len(at) < bins // 2:
        return None
    place, level = np.array(at), 0.5 * (np.array(ups) + np.array(downs))
    half = 0.5 * float(np.median(np.array(ups) - np.array(downs)))
    unit, of_load = sensor.unit.symbol, load.unit.symbol
    moving = np.abs(rate) > still
    either = np.where(rate > 0, np.interp(x, place, np.array(ups)), np.interp(x, place, np.array(downs)))
    if _explained(y, np.interp(x, place, level)) < thresholds.follows:
        if _explained(y[moving], either[moving]) < thresholds.follows:
            return None
        return (
            f"the {sensor.name} does not follow this load but its direction: while the load rises it lies"
            f" {abs(half):.3g} {unit} {'above' if half > 0 else 'below'} its mean, while the load falls as much to the"
            " other side, which is friction; Coulomb's and viscous friction are told apart by strokes at several rates"
            " only"
        )
    u = (place - 0.5 * (low + high)) / (0.5 * (high - low))
    middle = _slope(place, level, np.abs(u) < 0.25)
    ends = 0.5 * (_slope(place, level, u > 0.5) + _slope(place, level, u < -0.5))
    ratio = ends / middle if middle else np.inf
    if thresholds.clear * ratio < 1.0:
        shape = "it flattens, as friction does that saturates, and no straight line or linear damping describes it"
    elif ratio > thresholds.clear:
        shape = "it steepens towards the ends, and no straight line describes it"
    else:
        shape = "it is nearly straight"
    apart = 0.5 * float(np.median(np.abs(np.array(ups) - np.array(downs))[np.abs(u) < 0.5]))
    return (
        f"over this load the {sensor.name} rises by {middle:.3g} {unit}/{of_load} about the middle and by {ends:.3g}"
        f" {unit}/{of_load} at the ends: {shape}; loading and unloading lie {apart:.3g} {unit} to either side of it"
    )


def _explained(values: Array, by: Array) -> float:
    whole = float(np.var(values))
    return 1.0 - float(np.var(values - by)) / whole if whole > 0 else 0.0


def _slope(place: Array, level: Array, among: NDArray[np.bool_]) -> float:
    return float(np.polyfit(place[among], level[among], 1)[0]) if among.sum() >= 3 else 0.0
