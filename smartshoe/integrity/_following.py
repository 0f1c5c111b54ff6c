"""Whether the reading follows the load at all, and in the right direction."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View

LEAST_SHARE = 0.3  # of the reading's variance that a unit which follows at all leaves explained
CERTAIN_SHARE = 0.85
LEAST_MOVES_WITH = 0.05  # correlation of increments; a random walk may explain half of the variance, but not move along
STRIDES_S = (0.3, 1.0, 3.0, 10.0)
LEAST_MOVE = 10.0  # standard deviations of noise
POINTS = 3000
TIME_CONSTANTS_S = (0.3, 3.0, 30.0)
RISES_WITH_LOAD = ("pressure", "force")


def does_not_follow_load(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``does_not_follow_load``: fatal; the reading is constant, noise, or another channel's."""
    whole = np.ones(len(view.recording), dtype=bool)
    reading, load = view.reading, view.load
    if float(np.ptp(reading.values)) == 0.0:
        says = "the reading is constant: is the unit connected, and is this its column?"
    elif view.load_span <= LEAST_MOVE * load.quiet_noise or view.load_span == 0.0:
        says = f"the load covers {view.load_span:.3g} N only, no more than its noise: load the unit over its range"
    else:
        share, moves_with = _followed_share(view)
        if share >= CERTAIN_SHARE or (share >= LEAST_SHARE and moves_with >= LEAST_MOVES_WITH):
            return
        says = (
            f"the reading does not follow the load: load explains {100 * max(share, 0.0):.0f} % of its variance, any"
            " curve and any relaxation allowed; is this the unit that was pressed?"
        )
    yield Finding("does_not_follow_load", whole, says, "fatal", True, says)


def wrong_sign(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``wrong_sign``: a load that is negative in compression, or a pressure (or force) that falls as load rises.

    Counts, volts and lengths may fall.
    """
    if view.sign > 0 or view.recording.sensor.unit.quantity not in RISES_WITH_LOAD:
        return
    name, at = view.recording.sensor.name, view.curve[0]
    if -at[0] > abs(at[-1]):
        says = (
            f"the load is negative in compression (it runs from {at[0]:.4g} to {at[-1]:.4g} N and the {name} rises as"
            " it falls): turn its sign, compression is positive"
        )
    else:
        says = f"the {name} falls as the load rises: turn the sign of one of the two (load is positive in compression)"
    yield Finding("wrong_sign", np.ones(len(view.recording), dtype=bool), says)


def _followed_share(view: View) -> tuple[float, float]:
    """Share of the reading's variance about a straight line in time that load explains; correlation of increments."""
    n = view.reading.values.size
    width = max(1, n // POINTS)
    count = n // width
    load = view.load.values[: count * width].reshape(count, width).mean(axis=1)
    reading = np.median(view.reading.values[: count * width].reshape(count, width), axis=1)
    curve = np.interp(load, view.curve[0], view.curve[1])
    columns = np.concatenate([_of_load(load, width * view.step_s), curve[:, None]], axis=1)
    trend = np.linspace(-1.0, 1.0, count)
    base = np.stack([np.ones(count), trend], axis=1)
    matrix = np.concatenate([base, columns], axis=1)
    left_base = reading - base @ np.linalg.lstsq(base, reading, rcond=None)[0]
    left = reading - matrix @ np.linalg.lstsq(matrix, reading, rcond=None)[0]
    total = float(np.dot(left_base, left_base))
    if total == 0.0:
        return 0.0, 0.0
    together = max(_moves_with(curve, reading, stride_s / (width * view.step_s)) for stride_s in STRIDES_S)
    return 1.0 - float(np.dot(left, left)) / total, together


def _moves_with(load: Array, reading: Array, stride: float) -> float:
    """Correlation of increments over ``stride`` points, less what chance gives so many; large ones cut short."""
    apart = min(max(1, round(stride)), load.size // 4)
    d_load, d_reading = load[apart:] - load[:-apart], reading[apart:] - reading[:-apart]
    d_load = np.clip(d_load, *np.quantile(d_load, [0.02, 0.98]))
    d_reading = np.clip(d_reading, *np.quantile(d_reading, [0.02, 0.98]))
    size = float(np.sqrt(np.dot(d_load, d_load) * np.dot(d_reading, d_reading)))
    if size == 0.0:
        return 0.0
    return float(np.dot(d_load, d_reading) / size - 2.0 / np.sqrt(load.size / apart))


def _of_load(load: Array, step_s: float) -> Array:
    """(n, 6) load, its powers and its low passes."""
    from scipy.signal import lfilter

    f = (load - load.min()) / np.ptp(load)
    columns = [f, f**2, f**3]
    for tau_s in TIME_CONSTANTS_S:
        keep = float(np.exp(-step_s / tau_s))
        columns.append(lfilter([1.0 - keep], [1.0, -keep], f, zi=[keep * f[0]])[0])
    out: Array = np.stack(columns, axis=1)
    return out
