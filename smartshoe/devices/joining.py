"""Two logs of one experiment on one time base: the machine's load and the data logger's reading.

The two clocks are aligned by the loads themselves: the logger holds a copy of the load (a voltage, on a scale of its
own) or, failing that, the reading that follows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.blas import on_one_thread
from smartshoe.errors import InputError
from smartshoe.recording import Channel, Recording

Array = NDArray[np.float64]

LEAST_CORRELATION = 0.8
SAME_SIGNAL = 0.98
ITERATIONS = 8


@dataclass(frozen=True, slots=True)
class Alignment:
    """machine time = logger time + ``delay_s`` + ``rate`` (logger time - its middle); sd of both; correlation."""

    delay_s: float
    delay_sd_s: float
    rate: float
    rate_sd: float
    correlation: float

    def machine_time(self, logger_time_s: Array) -> Array:
        """Logger time (n,) on the machine's clock."""
        middle = 0.5 * (logger_time_s[0] + logger_time_s[-1])
        moved: Array = logger_time_s + self.delay_s + self.rate * (logger_time_s - middle)
        return moved


def _coarse(machine_s: Array, load: Array, logger_s: Array, signal: Array) -> tuple[float, float]:
    """Delay to within a step, and the correlation there, by cross-correlation on a common grid."""
    from scipy.signal import correlate

    step = float(max(np.median(np.diff(machine_s)), np.median(np.diff(logger_s))))
    first = np.interp(np.arange(machine_s[0], machine_s[-1], step), machine_s, load)
    second = np.interp(np.arange(logger_s[0], logger_s[-1], step), logger_s, signal)
    first, second = first - first.mean(), second - second.mean()
    size = np.sqrt(np.dot(first, first) * np.dot(second, second))
    if size == 0.0:
        return 0.0, 0.0
    product = correlate(first, second, mode="full", method="fft")
    best = int(np.argmax(np.abs(product)))
    lag = best - (second.size - 1)
    return float(machine_s[0] - logger_s[0] + lag * step), float(product[best] / size)


@on_one_thread
def align(machine_s: Array, load: Array, logger_s: Array, signal: Array) -> Alignment:
    """Delay and clock rate between two logs of one load, with error bars.

    A coarse search, then Gauss-Newton on signal(t) = offset + gain load(t + delay + rate (t - middle)). Raises
    `InputError` where the two do not correlate.
    """
    delay, correlation = _coarse(machine_s, load, logger_s, signal)
    if abs(correlation) < LEAST_CORRELATION:
        raise InputError(
            f"the two logs' loads do not match (correlation {correlation:.2f}): give the logs of one and the same test"
        )
    slope = np.gradient(load, machine_s)
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    rate = 0.0
    sd = np.zeros(2)
    for _ in range(ITERATIONS):
        at = logger_s + delay + rate * (logger_s - middle)
        inside = (at >= machine_s[0]) & (at <= machine_s[-1])
        moved, tilt = np.interp(at[inside], machine_s, load), np.interp(at[inside], machine_s, slope)
        design = np.column_stack([np.ones_like(moved), moved, tilt, tilt * (logger_s[inside] - middle)])
        scale = np.abs(design).max(axis=0)
        scale[scale == 0.0] = 1.0
        found = np.linalg.lstsq(design / scale, signal[inside], rcond=None)[0] / scale
        error = signal[inside] - design @ found
        if found[1] == 0.0:
            break
        variance = float(error @ error) / max(inside.sum() - design.shape[1], 1)
        covariance = np.linalg.pinv((design / scale).T @ (design / scale)) * variance / np.outer(scale, scale)
        sd = np.sqrt(np.diag(covariance))[2:] / abs(found[1])
        change = found[2:] / found[1]
        delay, rate = delay + float(change[0]), rate + float(change[1])
        if np.all(np.abs(change) <= 1e-3 * sd):
            break
    return Alignment(delay, float(sd[0]), rate, float(sd[1]), correlation)


def join(machine_log: Recording, logger_log: Recording) -> Recording:
    """One recording on the logger's time base: its readings, and the machine's load (and other channels) moved to it.

    Raises `InputError` where the logs do not belong together.
    """
    load = machine_log.load
    candidates = [c for c in logger_log.channels.values() if c.role != "sensor"]
    ranked = sorted(
        ((abs(_coarse(machine_log.time_s, load.si, logger_log.time_s, c.values)[1]), c) for c in candidates),
        key=lambda pair: pair[0],
    )
    if ranked and ranked[-1][0] >= SAME_SIGNAL:
        copy, caveat = ranked[-1][1], ""
    else:
        copy, caveat = logger_log.sensor, "; the logger has no copy of the load, so the unit's own lag is in the delay"
    try:
        found = align(machine_log.time_s, load.si, logger_log.time_s, copy.values)
    except InputError as error:
        raise InputError(f"{machine_log.label} and {logger_log.label}: {error}") from error
    at = found.machine_time(logger_log.time_s)
    inside = (at >= machine_log.time_s[0]) & (at <= machine_log.time_s[-1])
    if inside.sum() < 2:
        raise InputError(f"{machine_log.label} and {logger_log.label} share no time: give the logs of one test")
    kept = logger_log.taken(inside)
    channels: dict[str, Channel] = {}
    for channel in machine_log.channels.values():
        values = np.interp(at[inside], machine_log.time_s, channel.values)
        if channel.missing is not None:
            gap = np.interp(at[inside], machine_log.time_s, channel.missing.astype(float)) > 0
            values = np.where(gap, np.nan, values)
        channels[channel.name] = Channel.from_values(channel.name, values, channel.unit, channel.role)
    for channel in kept.channels.values():
        name = channel.name if channel.name not in channels else f"logger_{channel.name}"
        channels[name] = Channel.from_values(
            name, channel.with_nan(), channel.unit, "auxiliary" if channel.role == "load" else channel.role
        )
    note = (
        f"joined with {machine_log.label} by {copy.name}: machine clock ahead by {found.delay_s:.4f} ±"
        f" {found.delay_sd_s:.4f} s, rate {1e6 * found.rate:.0f} ± {1e6 * found.rate_sd:.0f} ppm{caveat}"
    )
    return Recording(
        kept.time_s,
        channels,
        name=logger_log.name,
        unit=logger_log.unit or machine_log.unit,
        metadata={**machine_log.metadata, **logger_log.metadata, "join_delay_s": repr(found.delay_s)},
        source=logger_log.source,
        notes=(*machine_log.notes, *logger_log.notes, note),
    )


def join_pairs(recordings: Sequence[Recording]) -> list[Recording]:
    """Experiments from logs: one that has a load and no reading is joined with its neighbour that has the reading.

    A recording with both stands for itself.
    """
    found: list[Recording] = []
    waiting: Recording | None = None
    for recording in recordings:
        alone = bool(recording.of_role("load")) != bool(recording.sensors)
        if not alone:
            found.append(recording)
        elif waiting is not None and bool(waiting.sensors) != bool(recording.sensors):
            machine, logger = (waiting, recording) if recording.sensors else (recording, waiting)
            found.append(join(machine, logger))
            waiting = None
        else:
            if waiting is not None:
                found.append(waiting)
            waiting = recording
    if waiting is not None:
        found.append(waiting)
    return found
