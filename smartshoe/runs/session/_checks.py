"""Checks of a pressing for faults, made while the unit still lies under the machine; one function a fault.

The first lines of the docstrings of `AT_THE_END` are shown on the session's page.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices.following import zeros_at
from smartshoe.devices.joining import Alignment, align_reading, coarse
from smartshoe.errors import InputError
from smartshoe.protocol import Protocol
from smartshoe.recording import Channel, Recording
from smartshoe.signals.masks import runs_of

FOLLOWS = 0.8  # correlation above which a reading follows the load that presses it
END_OF_RANGE = 0.995
SATURATED_SAMPLES = 3
CONTACT_SHARE = 0.02  # of the sensor's range: the smallest rise of a unit that is touched
LEAST_REST_S = 0.5
BRIDGED_S = 0.05  # longest time to the nearest sample of the stream for a moment to count as covered
LARGEST_LOSS = 0.02
DRIFT_SHARE = 0.02  # of the reading's span
PEAK_TOLERANCE = 0.05
AT_REST, PRESSED = 0.02, 0.04  # of the protocol's peak: a machine's log is at rest below one, presses above the other


@dataclass(frozen=True, slots=True)
class PressingFault:
    """A fault of a pressing: ``says`` names it and its remedy; if it is not ``grave``, a person may go on."""

    kind: str
    says: str
    grave: bool = True

    def to_dict(self) -> dict[str, Any]:
        """The fault as an object for the journal and for JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Pressing:
    """What is known of a pressing: the stream of all units and, once it exists, the machine's log."""

    unit: str
    protocol: Protocol
    stream: Recording
    load: Recording | None = None

    @property
    def reading(self) -> Channel:
        """The reading of the unit under test."""
        return self.stream[self.unit]

    @cached_property
    def correlations(self) -> dict[str, float]:
        """The correlation of each unit's reading with the load, -1 to 1; empty without a log."""
        if self.load is None:
            return {}
        load = self.load
        return {
            channel.name: coarse(load.time_s, load.force_n, self.stream.time_s, channel.values)[1]
            for channel in self.stream.sensors
        }

    @cached_property
    def alignment(self) -> Alignment | None:
        """The alignment of log and reading; None if there is no log or the two do not match."""
        if self.load is None:
            return None
        try:
            return align_reading(self.load.time_s, self.load.force_n, self.stream.time_s, self.reading.values)
        except InputError:
            return None


Check = Callable[[Pressing], PressingFault | None]  # examines a pressing and returns what is wrong, or None


def saturation(pressing: Pressing) -> PressingFault | None:
    """The reading stands at the end of the sensor's range."""
    reading = pressing.reading
    if reading.range_ is None:
        return None
    low, high = reading.range_
    at_end = int(np.count_nonzero(reading.values >= low + END_OF_RANGE * (high - low)))
    if at_end < SATURATED_SAMPLES:
        return None
    return PressingFault(
        "saturation",
        f"{pressing.unit} reads the end of its range ({high:g} {reading.unit.symbol}) at {at_end} samples: lower"
        " the load, or spread it over a larger area",
    )


def contact(pressing: Pressing) -> PressingFault | None:
    """The unit's reading does not rise at all."""
    reading = pressing.reading
    span = _span(reading.values)
    if reading.range_ is not None:
        least = CONTACT_SHARE * (reading.range_[1] - reading.range_[0])
    else:
        noise = float(np.median(np.abs(np.diff(reading.values)))) if reading.values.size > 1 else 0.0
        least = 20.0 * noise
    if span > least:
        return None
    return PressingFault(
        "no_contact",
        f"{pressing.unit} hardly reads anything ({span:.3g} {reading.unit.symbol}): see that the anvil touches it"
        " and that its tube is whole",
    )


def wrong_unit(pressing: Pressing) -> PressingFault | None:
    """Another unit of the shoe is pressed."""
    found = pressing.correlations
    if found:
        best = max(found, key=lambda name: found[name])
        wrong = best != pressing.unit and found[best] >= FOLLOWS and found[pressing.unit] < 0.9 * found[best]
    else:
        spans = {channel.name: _share(channel) for channel in pressing.stream.sensors}
        best = max(spans, key=lambda name: spans[name])
        wrong = best != pressing.unit and spans[best] > 0.1 and spans[pressing.unit] < 0.1 * spans[best]
    if not wrong:
        return None
    return PressingFault("wrong_unit", f"{best} is pressed, not {pressing.unit}: put {pressing.unit} under the anvil")


def other_test(pressing: Pressing) -> PressingFault | None:
    """The machine's log is not the one of this pressing."""
    if pressing.load is None:
        return None
    asked, peak = pressing.protocol.peak_load_n, float(np.max(pressing.load.force_n))
    if abs(peak - asked) > PEAK_TOLERANCE * max(asked, peak):
        return PressingFault(
            "other_test",
            f"{pressing.load.label} reaches {peak:.0f} N, {pressing.protocol.name} asks for {asked:.0f} N: give the"
            " log of this test",
        )
    if pressing.alignment is None:
        follows = pressing.correlations[pressing.unit]
        return PressingFault(
            "other_test",
            f"{pressing.load.label} does not match what {pressing.unit} read (correlation {follows:.2f}): give the"
            " log of this test",
        )
    return None


def too_few_repeats(pressing: Pressing) -> PressingFault | None:
    """The machine stopped before the protocol's end.

    A log is whole if it presses as often from rest as asked, for as long in all, and ends at a load that the protocol
    ends at. Cycles within a press are not counted: noise adds some and takes some where a load turns by just as much as
    counts. Rests may differ in length, and the last one need not be in the log.
    """
    if pressing.load is None:
        return None
    protocol, time_s = pressing.protocol, pressing.load.time_s
    corner_s, corner_n = protocol.corners()
    load_n = pressing.load.force_n - np.quantile(pressing.load.force_n, AT_REST)
    rest_n, press_n = AT_REST * protocol.peak_load_n, PRESSED * protocol.peak_load_n
    step_s = float(np.median(np.diff(time_s)))
    last_n = float(np.max(protocol.load_at(corner_s[-1] - step_s * np.array([0.0, 0.5, 1.0]))))
    end_n = float(np.min(load_n[-3:]))
    if end_n > max(last_n, press_n):
        return PressingFault(
            "too_few_repeats",
            f"the machine's log ends under a load of {end_n:.0f} N, before the end of {protocol.name}: run it to its"
            " end",
        )
    # The asked presses are counted with twice the margin, so that noise below it takes none from a whole log.
    asked, done = _presses(corner_n, 0.5 * rest_n, 2.0 * press_n), _presses(load_n, rest_n, press_n)
    asked_s, done_s = _time_above(corner_s, corner_n, press_n), _time_above(time_s, load_n, press_n)
    if done >= asked and done_s >= (1.0 - PEAK_TOLERANCE) * asked_s:
        return None
    return PressingFault(
        "too_few_repeats",
        f"the machine pressed {done} times, {done_s:.4g} s in all, {protocol.name} asks for {asked} times and"
        f" {asked_s:.4g} s: run it to its end",
    )


def stream_too_short(pressing: Pressing) -> PressingFault | None:
    """The shoe's stream does not cover the test: begun late, ended early, or with holes in it."""
    if pressing.load is None or pressing.alignment is None:
        return None
    at = pressing.alignment.machine_time(pressing.stream.time_s)
    load = pressing.load.force_n
    pressed = pressing.load.time_s[load > 0.02 * float(load.max())]
    after = np.clip(np.searchsorted(at, pressed), 1, at.size - 1)
    apart = np.minimum(np.abs(at[after] - pressed), np.abs(pressed - at[after - 1]))
    lost = np.count_nonzero(apart > BRIDGED_S)
    if lost <= LARGEST_LOSS * pressed.size:
        return None
    return PressingFault(
        "stream_too_short",
        f"the shoe's stream misses {100.0 * lost / pressed.size:.0f} % of the test: start it before the machine and"
        " keep the connection",
    )


def zero_drift(pressing: Pressing) -> PressingFault | None:
    """The unloaded reading moves between presses, beyond what the unit's own relaxation explains."""
    found = pressing.alignment
    if found is None or pressing.load is None:
        return None
    load = pressing.load
    at = found.machine_time(pressing.stream.time_s)
    inside = (at >= load.time_s[0]) & (at <= load.time_s[-1])
    at, reading = at[inside], pressing.reading.values[inside]
    idle = np.interp(at, load.time_s, load.force_n) < 0.01 * float(load.force_n.max())
    rests = [
        0.5 * (at[start] + at[stop - 1])
        for start, stop in zip(*runs_of(idle), strict=True)
        if stop - start >= LEAST_REST_S * pressing.stream.sample_rate_hz
    ]
    if len(rests) < 2:
        return None
    zeros = zeros_at(np.array(rests), load.time_s, load.force_n, at, reading)
    moved, span = _span(zeros), _span(reading)
    if moved <= DRIFT_SHARE * span:
        return None
    return PressingFault(
        "zero_drift",
        f"the unloaded reading of {pressing.unit} moves by {100.0 * moved / span:.1f} % of its span between"
        " presses: let the unit warm up, and look for a leak",
        grave=False,
    )


AS_IT_GOES: tuple[Check, ...] = (saturation, wrong_unit)
AT_THE_END: tuple[Check, ...] = (
    saturation, wrong_unit, contact, other_test, too_few_repeats, stream_too_short, zero_drift,
)  # fmt: skip


def first_fault(checks: tuple[Check, ...], pressing: Pressing) -> PressingFault | None:
    """The first fault that one of ``checks`` finds; None if there is none."""
    return next((found for check in checks if (found := check(pressing)) is not None), None)


def _presses(load_n: Array, rest_n: float, press_n: float) -> int:
    """How often a load (n,) rises from below ``rest_n``, or from its start, to above ``press_n``."""
    pressed = load_n[(load_n <= rest_n) | (load_n >= press_n)] >= press_n
    return int(np.count_nonzero(pressed[1:] & ~pressed[:-1])) + int(pressed[:1].sum())


def _time_above(time_s: Array, load_n: Array, level_n: float) -> float:
    """How long in s the load, straight between the points ``time_s`` and ``load_n`` (n,), is above ``level_n``."""
    low, high = np.minimum(load_n[1:], load_n[:-1]), np.maximum(load_n[1:], load_n[:-1])
    span = high - low
    share = np.divide(np.clip(high - level_n, 0.0, span), span, out=(high > level_n).astype(float), where=span > 0.0)
    return float(np.sum(share * np.diff(time_s)))


def _span(values: Array) -> float:
    return float(np.ptp(values)) if values.size else 0.0


def _share(channel: Channel) -> float:
    """The span of the reading as a share of its range; in its own unit if the range is unknown."""
    size = 1.0 if channel.range_ is None else channel.range_[1] - channel.range_[0]
    return _span(channel.values) / (size or 1.0)
