"""The zero before use: checks that the shoe is unloaded and still, and what each unit then reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import RefusedError, UsageError
from smartshoe.gait.field._finding import CheckResult, Verdict
from smartshoe.signals.noise import white_noise_sd

SHORTEST_S = 1.0
FEWEST = 20
BLOCK_S = 0.25
STILL = 0.002  # of full scale, 1.6 N of 800 N: a standing person sways by more
SETTLED = 0.005  # of full scale over the segment: drift of a silicone tube whose load was just removed
EVEN = 0.03  # of full scale: how far a unit may lie from what all units share; weight is never that even
COMMON = 0.2  # of the largest full scale: 8 K are 13.5 % of a 200 mbar range, 16 % of what 800 N read in it
REPORTED = 0.05  # of full scale: a larger shift common to all units is reported


@dataclass(frozen=True, slots=True)
class ZeroReading:
    """A unit's reading at no load, with the sd of this mean, the ``noise`` of one sample and the drift per second.

    With ``verdict`` "ok" or "warning" the reading can be used; with "fault" the shoe is loaded, moves or has not
    settled, and ``says`` tells which.
    """

    unit: str
    reading: float
    sd: float
    noise: float
    drift_per_s: float
    verdict: Verdict
    says: str
    span_s: tuple[float, float]

    @property
    def is_usable(self) -> bool:
        """Whether the reading may be taken as the zero."""
        return self.verdict in ("ok", "warning")

    def finding(self) -> CheckResult:
        """The reading as a `CheckResult`."""
        numbers = {"reading": self.reading, "sd": self.sd, "noise": self.noise, "drift_per_s": self.drift_per_s}
        return CheckResult("zero", self.verdict, self.says, self.unit, self.span_s, numbers)


def check_zero(
    time_s: ArrayLike,
    readings: ArrayLike,
    names: Sequence[str],
    *,
    full_scale: ArrayLike,
    expected: ArrayLike = 0.0,
    symbol: str = "",
) -> tuple[ZeroReading, ...]:
    """What each unit reads while nobody stands in the shoe, with a verdict on whether the shoe was unloaded.

    ``time_s`` (n,) and ``readings`` (n, units) span at least a second. ``full_scale`` and ``expected`` (the
    calibration's offset) are a number or (units,), in the unit of the readings. A unit counts as loaded if it lies
    further from ``expected`` than the others do, since weight, unlike warm air, is never even; or if all lie further
    from it than warm air explains. Raises `UsageError` if the shapes do not fit.
    """
    time, values = np.asarray(time_s, dtype=float), np.asarray(readings, dtype=float)
    if values.ndim == 1:
        values = values[:, None]
    if values.shape != (time.size, len(names)):
        raise UsageError(f"readings are of shape {values.shape}: give ({time.size}, {len(names)})")
    scale = np.broadcast_to(np.asarray(full_scale, dtype=float), (len(names),))
    if not (np.isfinite(scale).all() and (scale > 0.0).all()):
        raise UsageError(f"full_scale is {scale.tolist()}: give numbers above 0")
    span = (float(time[0]), float(time[-1])) if time.size else (0.0, 0.0)
    if time.size < FEWEST or span[1] - span[0] < SHORTEST_S:
        says = (
            f"{span[1] - span[0]:.2g} s at rest are too short for a zero: keep the shoe unloaded for {SHORTEST_S:g} s"
        )
        return tuple(ZeroReading(name, np.nan, np.nan, np.nan, np.nan, "unknown", says, span) for name in names)
    there = np.isfinite(values)
    means = np.where(there, values, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    shift = means - np.asarray(expected, dtype=float)
    answer = there.sum(axis=0) >= FEWEST
    shared = float(np.median(shift[answer])) if np.count_nonzero(answer) > 1 else 0.0
    return tuple(
        _zero_of(
            name, time, values[:, k], float(scale[k]), float(shift[k]), shared, COMMON * float(scale.max()), symbol
        )
        for k, name in enumerate(names)
    )


def zero(
    time_s: ArrayLike,
    readings: ArrayLike,
    names: Sequence[str],
    *,
    full_scale: ArrayLike,
    expected: ArrayLike = 0.0,
    symbol: str = "",
) -> Array:
    """The zeros (units,) that `check_zero` finds; raises `RefusedError` if one of them cannot be used."""
    found = check_zero(time_s, readings, names, full_scale=full_scale, expected=expected, symbol=symbol)
    for item in found:
        if not item.is_usable:
            raise RefusedError(item.says)
    return np.array([item.reading for item in found])


def _zero_of(
    name: str, time: Array, values: Array, scale: float, shift: float, shared: float, common: float, symbol: str
) -> ZeroReading:
    """The zero of one unit: its mean after removing a linear drift, judged by shift, sway and drift."""
    span = (float(time[0]), float(time[-1]))
    there = np.isfinite(values)
    at, y = time[there], values[there]
    if y.size < FEWEST:
        says = f"{name} sent {y.size} samples of {values.size} at rest: look at its cable"
        return ZeroReading(name, np.nan, np.nan, np.nan, np.nan, "fault", says, span)
    noise = white_noise_sd(y)
    slope, level = np.polyfit(at - at.mean(), y, 1)
    left = y - level - slope * (at - at.mean())
    count = max(int((span[1] - span[0]) / BLOCK_S), 2)
    means = np.array([part.mean() for part in np.array_split(left, count)])
    sway = float(means.std(ddof=1))
    still = max(4.0 * noise / np.sqrt(y.size / count), STILL * scale)
    drift = float(slope)
    moved = abs(drift) * (span[1] - span[0])
    sd = sway / np.sqrt(count)
    reading = f"{name} reads {level:.4g} {symbol}".rstrip()
    verdict: Verdict = "fault"
    if abs(shift - shared) > EVEN * scale:
        says = f"{reading}, {100 * (shift - shared) / scale:.2g} % of full scale off the others: take the weight off it"
        if shared == 0.0:
            says = f"{reading}, {100 * shift / scale:.2g} % of full scale from its zero: take the weight off it"
    elif abs(shift) > common:
        says = f"{reading}, with the others {100 * shift / scale:.2g} % of full scale from zero: take the weight off"
    elif sway > still:
        says = f"{reading} and sways by {100 * sway / scale:.2g} % of full scale: nobody may stand in the shoe"
    elif moved > max(SETTLED * scale, 4.0 * noise):
        says = f"{reading} and still settles by {100 * moved / scale:.2g} % of full scale: wait half a minute"
    elif abs(shift) > REPORTED * scale:
        verdict = "warning"
        says = f"{reading}, with the others {100 * shift / scale:.2g} % of full scale from zero, as warm air would"
    else:
        verdict, says = "ok", f"{reading} at no load, still within {100 * max(sway, noise) / scale:.2g} % of full scale"
    return ZeroReading(name, float(level), sd, noise, drift, verdict, says, span)
