"""Protocols that separate effects, for a machine to run: each shows what the paper's two cannot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from smartshoe.diagnosis._scale import Scale, thinning
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.files.gate import limits
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

STEP_S = 0.1  # the time in which a machine changes the load at once; half and twice as long changed no proposal


def long_hold(peak_n: float) -> Protocol:
    """Five minutes at three quarters of the load, five minutes unloaded."""
    return Protocol("long_hold", (*_press(0.75 * peak_n, 300.0, 300.0, peak_n), *_triangle(peak_n, 4.0)))


def holds_at_several_loads(peak_n: float) -> Protocol:
    """A minute and a half at four loads, with rests between them."""
    segments: list[Segment] = []
    for share in (0.25, 1.0, 0.5, 0.75):
        segments += _press(share * peak_n, 90.0, 30.0, peak_n)
    return Protocol("holds_at_several_loads", tuple(segments))


def idle(peak_n: float) -> Protocol:
    """Three triangles, ten minutes unloaded, three triangles."""
    three = [segment for _ in range(3) for segment in _triangle(peak_n, 4.0)]
    return Protocol("idle", (*three, Segment("rest", 0.0, 600.0), *three))


def pauses(peak_n: float) -> Protocol:
    """Groups of triangles with pauses of five seconds to five minutes between them."""
    segments: list[Segment] = []
    for pause_s in (5.0, 120.0, 20.0, 300.0, 5.0):
        for _ in range(3):
            segments += _triangle(peak_n, 2.0)
        segments.append(Segment("rest", 0.0, pause_s))
    return Protocol("pauses", tuple(segments))


def steps(peak_n: float) -> Protocol:
    """Steps up and down to several loads, each held for some seconds."""
    segments = [Segment("rest", 0.0, 3.0)]
    for share in (0.5, 0.0, 1.0, 0.25, 0.75, 0.0, 1.0, 0.5, 0.0, 0.75, 0.25, 0.0):
        segments += [Segment("ramp", share * peak_n, STEP_S), Segment("hold", share * peak_n, 4.0)]
    return Protocol("steps", tuple(segments))


def multisine(peak_n: float) -> Protocol:
    """Eleven sines from 0.02 to 2 Hz about half the load, with phases that keep the peak low (Schroeder 1970)."""
    frequency_hz = np.geomspace(0.02, 2.0, 11)
    order = np.arange(1, 12)
    phase = np.pi * order * (order - 1) / 11
    time_s = np.arange(0.0, 120.0, STEP_S)
    wave = np.sum(np.cos(2 * np.pi * np.outer(time_s, frequency_hz) + phase), axis=1)
    load_n = peak_n * (0.5 + 0.45 * wave / np.max(np.abs(wave)))
    segments = [Segment("rest", 0.0, 3.0), Segment("ramp", float(load_n[0]), 2.0)]
    segments += [Segment("ramp", float(load), STEP_S) for load in load_n[1:]]
    return Protocol("multisine", (*segments, Segment("ramp", 0.0, 2.0), Segment("rest", 0.0, 5.0)))


def minor_loops(peak_n: float) -> Protocol:
    """Loops within loops, at two rates."""
    segments = [Segment("rest", 0.0, 3.0)]
    for rate in (0.1, 0.4):
        at = 0.0
        for share in (1.0, 0.2, 0.8, 0.4, 0.7, 0.5, 0.65, 0.1, 0.45, 0.25, 0.9, 0.0):
            segments.append(Segment("ramp", share * peak_n, abs(share - at) / rate))
            at = share
        segments.append(Segment("rest", 0.0, 5.0))
    return Protocol("minor_loops", tuple(segments))


def shuffled_loads(peak_n: float) -> Protocol:
    """Triangles to loads in an order without trend, small ones before and after large ones."""
    segments = [Segment("rest", 0.0, 3.0)]
    for share in (0.25, 0.5, 0.25, 0.75, 0.5, 1.0, 0.25, 0.75, 0.5, 1.0, 0.1, 0.5, 0.25, 1.0, 0.75, 0.1):
        segments += _triangle(share * peak_n, 3.0, peak_n)
    return Protocol("shuffled_loads", tuple(segments))


def rates(peak_n: float) -> Protocol:
    """Three triangles at each rate from a sixteenth of the load per second to all of it."""
    made = dynamic_protocol([share * peak_n for share in (0.0625, 0.125, 0.25, 0.5, 1.0)], peak_n=peak_n, repeats=3)
    return Protocol("rates", made.segments)


EXPERIMENTS: Mapping[str, Callable[[float], Protocol]] = {
    made.__name__: made
    for made in (
        steps, multisine, minor_loops, shuffled_loads, rates, holds_at_several_loads, long_hold, pauses, idle,
    )
}  # fmt: skip


def paced(protocol: Protocol, sample_time_s: float, thresholds: Thresholds) -> Protocol:
    """The protocol, slowed so that a log with a sample every ``sample_time_s`` shows it; unchanged if it does already.

    The log has a ``few`` samples of each hold, and of a full ramp at the fastest rate (instant changes excepted), and
    ``least_samples`` of the whole. It never exceeds the longest allowed protocol.
    """
    least_s, at_n = protocol.duration_s * thresholds.few / thresholds.least_samples, 0.0
    for one in protocol.segments:
        if one.duration_s > STEP_S:
            of_all = abs(one.load_n - at_n) / protocol.peak_load_n or 1.0
            least_s = min(least_s, one.duration_s / of_all)
        at_n = one.load_n
    slower = min(thresholds.few * sample_time_s / least_s, (1.0 - 1e-9) * limits().duration_s / protocol.duration_s)
    if slower <= 1.0:
        return protocol
    return replace(
        protocol, segments=tuple(replace(one, duration_s=slower * one.duration_s) for one in protocol.segments)
    )


def run_on(unit: ExtendedModel, protocol: Protocol, peak_n: float, sample_time_s: float) -> Recording:
    """The noise-free recording of ``unit``, of full scale ``peak_n``, under one run of the protocol."""
    time_s = np.arange(0.0, protocol.duration_s, sample_time_s)
    load_n = protocol.load_at(time_s)
    reading = unit.reading(Conditions(time_s, load_n / peak_n, sample_time_s))
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading, name=protocol.name)


def sessions_on(
    unit: ExtendedModel, protocols: Sequence[Protocol], peak_n: float, sample_time_s: float, thresholds: Thresholds
) -> tuple[list[Session], list[int]]:
    """The prepared sessions of `run_on` for each protocol, and the factors by which they were thinned."""
    recordings = [run_on(unit, one, peak_n, sample_time_s) for one in protocols]
    scale = Scale(peak_n, unit.full_scale_reading, MILLIBAR)
    factors = thinning(recordings, scale, thresholds)
    usable = [np.ones(len(one), dtype=bool) for one in recordings]
    return prepare(recordings, usable, [False] * len(recordings), scale, factors, thresholds), factors


def _press(load_n: float, hold_s: float, rest_s: float, peak_n: float) -> list[Segment]:
    """A rest, a ramp to a load, a hold, a ramp down, and a rest; the rate is the same for every load."""
    ramp_s = 4.0 * load_n / peak_n
    return [
        Segment("rest", 0.0, 3.0),
        Segment("ramp", load_n, ramp_s),
        Segment("hold", load_n, hold_s),
        Segment("ramp", 0.0, ramp_s),
        Segment("rest", 0.0, rest_s),
    ]


def _triangle(load_n: float, rest_s: float, peak_n: float | None = None) -> list[Segment]:
    """A ramp up, a ramp down, and a rest; the rate is the same for every load of one ``peak_n``."""
    ramp_s = 3.0 * load_n / (peak_n or load_n)
    return [Segment("ramp", load_n, ramp_s), Segment("ramp", 0.0, ramp_s), Segment("rest", 0.0, rest_s)]
