"""Protocols for testing machines: load against time as a list of segments, checked before anything moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import LimitError
from smartshoe.files.gate import limits

STATIC_LOADS_N = tuple(float(load) for load in range(50, 801, 50))
DYNAMIC_RATES_N_PER_S = (50.0, 100.0, 200.0, 400.0, 600.0, 800.0)


@dataclass(frozen=True, slots=True)
class Segment:
    """A straight line in load, from the load reached so far to ``load_n`` within ``duration_s``.

    Equal loads are a hold.
    """

    kind: Literal["ramp", "hold", "rest"]
    load_n: float
    duration_s: float


@dataclass(frozen=True, slots=True)
class MachineLimits:
    """The largest loads and rates that a machine and the sensor on it withstand; None where there is no limit."""

    load_n: float | None = None
    rate_n_per_s: float | None = None
    pressure_pa: float | None = None


@dataclass(frozen=True, slots=True)
class Protocol:
    """A named load history that starts at zero load."""

    name: str
    segments: tuple[Segment, ...]

    def __post_init__(self) -> None:
        """Raise `LimitError` for values that are not finite, or more segments or a longer duration than allowed."""
        most, longest_s = limits().segments, limits().duration_s
        if len(self.segments) > most:
            raise LimitError(
                f"protocol {self.name} has {len(self.segments)} segments, more than {most}: split it, or raise the"
                f" limit with --limit segments={len(self.segments)}"
            )
        load_n = 0.0
        for number, segment in enumerate(self.segments, start=1):
            is_jump = segment.duration_s == 0.0 and segment.load_n != load_n
            load_n = segment.load_n
            if not (0.0 <= segment.duration_s < math.inf and math.isfinite(load_n)) or is_jump:
                raise LimitError(
                    f"protocol {self.name}, segment {number}: {segment.load_n:g} N within {segment.duration_s:g} s"
                    " cannot be pressed: give finite numbers, and a time above 0"
                )
        if self.duration_s > longest_s:
            raise LimitError(
                f"protocol {self.name} lasts {self.duration_s:g} s, more than {longest_s} s: shorten it, or raise the"
                f" limit with --limit duration_s={self.duration_s:.0f}"
            )

    @property
    def duration_s(self) -> float:
        """Sum of the segments' durations."""
        return sum(segment.duration_s for segment in self.segments)

    @property
    def peak_load_n(self) -> float:
        """The largest commanded load in N."""
        return max((segment.load_n for segment in self.segments), default=0.0)

    @property
    def peak_rate_n_per_s(self) -> float:
        """The steepest ramp in N/s, up or down."""
        rate, load = 0.0, 0.0
        for segment in self.segments:
            if segment.duration_s > 0.0:
                rate, load = max(rate, abs(segment.load_n - load) / segment.duration_s), segment.load_n
        return rate

    def corners(self) -> tuple[Array, Array]:
        """Times (m,) in s and loads (m,) in N of the corners, first (0, 0)."""
        time_s = np.concatenate([[0.0], np.cumsum([segment.duration_s for segment in self.segments])])
        return time_s, np.array([0.0] + [segment.load_n for segment in self.segments])

    def load_at(self, time_s: Array) -> Array:
        """The commanded load (n,) in N at ``time_s`` (n,) in s."""
        return np.interp(time_s, *self.corners())

    def check(self, limits: MachineLimits) -> None:
        """Raise `LimitError` where the protocol exceeds ``limits``."""
        if limits.load_n is not None and self.peak_load_n > limits.load_n:
            raise LimitError(
                f"protocol {self.name} asks for {self.peak_load_n:g} N, the machine's limit is {limits.load_n:g} N:"
                " lower the load"
            )
        if limits.rate_n_per_s is not None and self.peak_rate_n_per_s > limits.rate_n_per_s:
            raise LimitError(
                f"protocol {self.name} asks for {self.peak_rate_n_per_s:g} N/s, the machine's limit is"
                f" {limits.rate_n_per_s:g} N/s: lower the rate"
            )


def _positive(name: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise LimitError(f"{name} is {value:g}: give a positive number")
    return float(value)


def static_protocol(
    loads_n: Sequence[float] = STATIC_LOADS_N,
    *,
    rate_n_per_s: float = 50.0,
    approach_n: float = 5.0,
    approach_s: float = 5.0,
    hold_s: float = 5.0,
    rest_s: float = 5.0,
) -> Protocol:
    """The paper's static protocol: for each load a ramp to just below it, the rest slowly, a hold, unloading, a rest.

    Parameters
    ----------
    loads_n
        The loads that are held, in N.
    rate_n_per_s
        Rate of the ramps, in N/s.
    approach_n, approach_s
        The last part of each load, in N, which is applied slowly, and how long that takes, in s.
    hold_s, rest_s
        How long a load is held, and the rest after it, in s.

    Notes
    -----
    Chinimilli 2016, Section III and Fig. 4(a).
    """
    rate = _positive("rate_n_per_s", rate_n_per_s)
    segments: list[Segment] = []
    for load_n in loads_n:
        load = _positive("a load", load_n)
        below = max(load - approach_n, 0.0)
        if below > 0:
            segments.append(Segment("ramp", below, below / rate))
        segments += [
            Segment("ramp", load, _positive("approach_s", approach_s)),
            Segment("hold", load, _positive("hold_s", hold_s)),
            Segment("ramp", 0.0, load / rate),
            Segment("rest", 0.0, _positive("rest_s", rest_s)),
        ]
    return Protocol("static", tuple(segments))


def dynamic_protocol(
    rates_n_per_s: Sequence[float] = DYNAMIC_RATES_N_PER_S,
    *,
    peak_n: float = 800.0,
    repeats: int = 1,
    rest_s: float = 5.0,
) -> Protocol:
    """The paper's dynamic protocol: triangles 0 -> peak -> 0 at each rate, with a rest before and after each.

    Parameters
    ----------
    rates_n_per_s
        Loading and unloading rate of each triangle, in N/s.
    peak_n
        Peak load of the triangles, in N.
    repeats
        How often the whole series of rates is repeated.
    rest_s
        Rest before and after each triangle, in s. The paper states no rest between triangles; 0 omits it.

    Notes
    -----
    Chinimilli 2016, Section III and Fig. 4(b).

    Examples
    --------
    >>> import smartshoe
    >>> smartshoe.dynamic_protocol((100.0, 800.0), peak_n=800.0, rest_s=5.0).duration_s  # 5 + 16 + 5 + 2 + 5
    33.0
    """
    peak = _positive("peak_n", peak_n)
    if repeats < 1:
        raise LimitError(f"repeats is {repeats}: give 1 or more")
    if 3 * repeats * len(rates_n_per_s) > limits().segments:
        raise LimitError(f"repeats is {repeats}, which makes more than {limits().segments} segments: give fewer")
    segments = [Segment("rest", 0.0, rest_s)] if rest_s > 0 else []
    for rate_n_per_s in rates_n_per_s:
        duration_s = peak / _positive("a rate", rate_n_per_s)
        for _ in range(repeats):
            segments += [Segment("ramp", peak, duration_s), Segment("ramp", 0.0, duration_s)]
            if rest_s > 0:
                segments.append(Segment("rest", 0.0, rest_s))
    return Protocol("dynamic", tuple(segments))
