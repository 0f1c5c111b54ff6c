"""Joins two logs of one experiment, the machine's load and the data logger's reading, on one time base.

The two clocks are aligned by the loads themselves: the logger holds a copy of the load (a voltage, on its own scale)
or, failing that, the reading that follows the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices._corners import AtCorners, follow_corners
from smartshoe.devices.following import Following, follow
from smartshoe.errors import InputError
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Channel, Recording, Role
from smartshoe.signals.noise import NORMAL_95

LEAST_CORRELATION = 0.8
SAME_SIGNAL = 0.98
COPY_CLOSER = 0.5  # a copy of the load fits it better than the reading does; another sensor's channel does not
ITERATIONS = 8
LARGEST_MISFIT = 1.5
LONGEST_BRIDGED_STEPS = 3.5
POWERS = 3  # of the load, for a bent characteristic
RARE_RATE = 0.01  # between two clocks: quartz clocks differ by a ten-thousandth, a processor's own by a hundredth
Ticks = Literal["logger", "machine"]
By = Literal["load", "model", "corners", "curve"]
CAVEATS: dict[By, str] = {
    "load": "",
    "model": ", the unit's own lag was estimated too",
    "corners": (
        ", and the unit does more than its model says, so the load's corners alone were used: the error counts how far"
        " they disagree"
    ),
    "curve": (
        ", and the unit does more than its model says, but the load has no corners that lead to one delay: the unit's"
        " lag and curve were estimated too, and the error counts what the curve changes"
    ),
}


@dataclass(frozen=True, slots=True)
class Alignment:
    """machine time = logger time + ``delay_s`` + ``rate`` (logger time - its middle), with both sd and the correlation.

    ``residual`` is the signal minus its fit, at the logger's samples that lie within the machine's log. ``by`` tells
    what delay and rate come from: a copy of the load, the unit's model, the load's corners alone, or the model with a
    bent characteristic.
    """

    delay_s: float
    delay_sd_s: float
    rate: float
    rate_sd: float
    correlation: float
    residual: Array = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
    by: By = "load"

    @property
    def says(self) -> str:
        """The offset and rate of the machine's clock against the logger's, in words; negative is behind and slow.

        The offset is the one in the middle of the logger's record; where the rates differ, it is another elsewhere.
        """
        return (
            f"{abs(self.delay_s):.4f} ± {self.delay_sd_s:.4f} s {'behind' if self.delay_s < 0 else 'ahead'}"
            " in the middle of the record,"
            f" {1e6 * abs(self.rate):.1f} ± {1e6 * self.rate_sd:.1f} ppm {'slow' if self.rate < 0 else 'fast'}"
        )

    def machine_time(self, logger_time_s: Array) -> Array:
        """Logger time (n,) converted to the machine's clock."""
        middle = 0.5 * (logger_time_s[0] + logger_time_s[-1])
        moved: Array = logger_time_s + self.delay_s + self.rate * (logger_time_s - middle)
        return moved


def coarse(machine_s: Array, load: Array, logger_s: Array, signal: Array) -> tuple[float, float]:
    """Delay to within one step, by cross-correlation on a common grid, and the correlation over the overlap there.

    One log may cover only part of the other.
    """
    from scipy.signal import correlate

    step = float(max(np.median(np.diff(machine_s)), np.median(np.diff(logger_s))))
    first = np.interp(np.arange(machine_s[0], machine_s[-1], step), machine_s, load)
    second = np.interp(np.arange(logger_s[0], logger_s[-1], step), logger_s, signal)
    product = correlate(first - first.mean(), second - second.mean(), mode="full", method="fft")
    lag = int(np.argmax(np.abs(product))) - (second.size - 1)
    begin, end = max(lag, 0), min(first.size, lag + second.size)
    ours, theirs = first[begin:end], second[begin - lag : end - lag]
    ours, theirs = ours - ours.mean(), theirs - theirs.mean()
    size = float(np.sqrt(np.dot(ours, ours) * np.dot(theirs, theirs)))
    correlation = float(np.dot(ours, theirs)) / size if size > 0.0 else 0.0
    return float(machine_s[0] - logger_s[0] + lag * step), correlation


def _require_match(correlation: float) -> None:
    if abs(correlation) < LEAST_CORRELATION:
        raise InputError(
            f"the two logs' loads do not match (correlation {correlation:.2f}): give the logs of one and the same test"
        )


@on_one_thread
def align(machine_s: Array, load: Array, logger_s: Array, signal: Array) -> Alignment:
    """Delay and clock rate between two logs of one load, with error bars.

    A coarse search, then Gauss-Newton on signal(t) = offset + gain load(t + delay + rate (t - middle)). Raises
    `InputError` where the two do not correlate.
    """
    delay, correlation = coarse(machine_s, load, logger_s, signal)
    _require_match(correlation)
    slope = np.gradient(load, machine_s)
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    rate = 0.0
    sd, error = np.zeros(2), np.zeros(0)
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
    return Alignment(delay, float(sd[0]), rate, float(sd[1]), correlation, error)


@on_one_thread
def align_reading(machine_s: Array, load: Array, logger_s: Array, reading: Array) -> Alignment:
    """Delay and clock rate between a load and the reading of a unit, excluding the unit's own lag.

    The unit's model is fitted together with them. Where that leaves more than noise, only the load's corners are used.
    Where the load has no corners, the model is fitted with a bent characteristic. Raises `InputError` where the two do
    not correlate.
    """
    delay, correlation = coarse(machine_s, load, logger_s, reading)
    _require_match(correlation)
    found = follow(machine_s, load, logger_s, reading, delay)
    if found.misfit <= LARGEST_MISFIT:
        return _aligned(found, correlation, found.residual, "model")
    if (at := follow_corners(machine_s, load, logger_s, reading, delay)) is not None:
        return _aligned(at, correlation, found.residual, "corners")
    bent = _bent(machine_s, load, logger_s, reading, delay, found)
    return _aligned(bent, correlation, bent.residual, "curve")


def _aligned(found: Following | AtCorners, correlation: float, residual: Array, by: By) -> Alignment:
    return Alignment(found.delay_s, found.delay_sd_s, found.rate, found.rate_sd, correlation, residual, by)


def _bent(
    machine_s: Array, load: Array, logger_s: Array, reading: Array, delay_s: float, straight: Following
) -> Following:
    """The fit with a bent characteristic, with sds that count what the bend changes of delay and rate.

    A smooth load tells a rate from what the unit remembers only poorly: one that is not clear of none is none.
    """
    logs = machine_s, load, logger_s, reading, delay_s
    bent = follow(*logs, POWERS)
    rate_sd = max(bent.rate_sd, abs(bent.rate - straight.rate))
    if abs(bent.rate) < NORMAL_95 * rate_sd:
        straight, bent = (follow(*logs, powers, at_one_rate=True) for powers in (1, POWERS))
    delay_sd_s = max(bent.delay_sd_s, abs(bent.delay_s - straight.delay_s))
    return replace(bent, delay_sd_s=delay_sd_s, rate_sd=rate_sd)


def join(machine_log: Recording, logger_log: Recording, *, ticks: Ticks = "logger") -> Recording:
    """One recording of the two logs; like `join_with_clocks`, without the alignment."""
    return join_with_clocks(machine_log, logger_log, ticks=ticks)[0]


def join_with_clocks(
    machine_log: Recording, logger_log: Recording, *, ticks: Ticks = "logger"
) -> tuple[Recording, Alignment]:
    """One recording on the logger's clock, at the sample times of the log ``ticks``, the other's channels interpolated.

    Also returns the alignment of the two clocks, which the recording's metadata repeats for its file. The sample times
    of the slower log keep noise white: interpolating a signal to a higher rate repeats its noise. Raises `InputError`
    where the logs do not belong together.
    """
    load = machine_log.load
    candidates = [c for c in logger_log.channels.values() if c.role != "sensor"]
    ranked = sorted(
        ((abs(coarse(machine_log.time_s, load.si, logger_log.time_s, c.values)[1]), c) for c in candidates),
        key=lambda pair: pair[0],
    )
    apart = 1.0 - abs(coarse(machine_log.time_s, load.si, logger_log.time_s, logger_log.sensor.values)[1])
    if ranked and ranked[-1][0] >= SAME_SIGNAL and 1.0 - ranked[-1][0] <= COPY_CLOSER * apart:
        copy, caveat = ranked[-1][1], ""
    else:
        copy, caveat = logger_log.sensor, "; the logger has no copy of the load"
    try:
        fit = align_reading if copy.role == "sensor" else align
        found = fit(machine_log.time_s, load.si, logger_log.time_s, copy.values)
    except InputError as error:
        raise InputError(f"{machine_log.label} and {logger_log.label}: {error}") from error
    if copy.role == "sensor":
        caveat += CAVEATS[found.by]
    at = found.machine_time(logger_log.time_s)
    machine_s = machine_log.time_s
    if np.array_equal(machine_s, logger_log.time_s) or abs(found.rate) > RARE_RATE:
        caveat += "; if one clock wrote both logs, put their columns into one file"
    if ticks == "logger":
        inside = (at >= machine_s[0]) & (at <= machine_s[-1])
        time_s, on_machine_s = logger_log.time_s[inside], at[inside]
    else:
        inside = (machine_s >= at[0]) & (machine_s <= at[-1])
        time_s, on_machine_s = np.interp(machine_s[inside], at, logger_log.time_s), machine_s[inside]
    if inside.sum() < 2:
        raise InputError(f"{machine_log.label} and {logger_log.label} share no time: give the logs of one test")
    ours, theirs = machine_log.channels.values(), logger_log.channels.values()
    if ticks == "logger":
        moved, others = [_moved(c, machine_s, on_machine_s) for c in ours], [c.taken(inside) for c in theirs]
    else:
        moved, others = [c.taken(inside) for c in ours], [_moved(c, at, on_machine_s) for c in theirs]
    channels = {channel.name: channel for channel in moved}
    for channel in others:
        name = channel.name if channel.name not in channels else f"logger_{channel.name}"
        role: Role = "auxiliary" if channel.role == "load" else channel.role
        channels[name] = replace(channel, name=name, role=role)
    note = f"joined with {machine_log.label} by {copy.name}: its machine's clock is {found.says}{caveat}"
    joined = Recording(
        time_s,
        channels,
        name=logger_log.name,
        unit=logger_log.unit or machine_log.unit,
        metadata={**machine_log.metadata, **logger_log.metadata, **_as_metadata(found)},
        source=logger_log.source,
        notes=(*machine_log.notes, *logger_log.notes, note),
    )
    return joined, found


def _moved(channel: Channel, own_s: Array, to_s: Array) -> Channel:
    """The channel, sampled at ``own_s`` (n,), interpolated to the times ``to_s`` (m,); missing where it has a gap."""
    values = np.interp(to_s, own_s, channel.values)
    after = np.clip(np.searchsorted(own_s, to_s), 1, own_s.size - 1)
    step = own_s[after] - own_s[after - 1]
    hole = step > LONGEST_BRIDGED_STEPS * float(np.median(np.diff(own_s)))
    if channel.missing is not None:
        hole |= np.interp(to_s, own_s, channel.missing.astype(float)) > 0
    made = Channel.from_values(channel.name, np.where(hole, np.nan, values), channel.unit, channel.role)
    return replace(made, range_=channel.range_)


def _as_metadata(found: Alignment) -> dict[str, str]:
    numbers = {"delay_s": found.delay_s, "delay_sd_s": found.delay_sd_s, "rate": found.rate, "rate_sd": found.rate_sd}
    return {f"join_{name}": repr(value) for name, value in numbers.items()}


def join_pairs(recordings: Sequence[Recording]) -> list[Recording]:
    """Experiments from logs: a log with a load but no reading is joined with the neighbour that has the reading.

    A recording with both is returned as it is.
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
