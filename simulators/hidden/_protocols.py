"""Load histories for hidden effects, beyond the paper's two: those a diagnosis may be given or may ask for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smartshoe.protocol import DYNAMIC_RATES_N_PER_S, Protocol, Segment, dynamic_protocol, static_protocol

PEAK_N = 800.0
SINE_STEP_S = 0.05


def _hold(load_n: float, hold_s: float, rest_s: float, rate_n_per_s: float = 200.0) -> list[Segment]:
    ramp_s = load_n / rate_n_per_s
    return [
        Segment("ramp", load_n, ramp_s),
        Segment("hold", load_n, hold_s),
        Segment("ramp", 0.0, ramp_s),
        Segment("rest", 0.0, rest_s),
    ]


def _triangles(peaks_n: list[float], rate_n_per_s: float, rest_s: float) -> list[Segment]:
    segments = [Segment("rest", 0.0, rest_s)]
    for peak_n in peaks_n:
        ramp_s = peak_n / rate_n_per_s
        segments += [Segment("ramp", peak_n, ramp_s), Segment("ramp", 0.0, ramp_s), Segment("rest", 0.0, rest_s)]
    return segments


def rates(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Three triangles at each rate of the paper; with ``other``, slightly lower rates in another order."""
    order = rng.permutation(DYNAMIC_RATES_N_PER_S) if other else DYNAMIC_RATES_N_PER_S
    peak_n = 0.9 * PEAK_N if other else PEAK_N
    return list(dynamic_protocol([float(r) for r in order], peak_n=peak_n, repeats=3, rest_s=4.0).segments)


def rates_and_holds(rng: np.random.Generator, other: bool) -> list[Segment]:
    """The rates, then a hold of a minute at three loads and an idle minute."""
    segments = rates(rng, other)
    for load_n in (650.0, 150.0, 350.0) if other else (200.0, 500.0, 800.0):
        segments += _hold(load_n, 60.0, 15.0)
    return [*segments, Segment("rest", 0.0, 60.0)]


def static(rng: np.random.Generator, other: bool) -> list[Segment]:
    """The paper's staircase; with ``other``, its loads in another order."""
    loads = np.arange(50.0, 801.0, 50.0)
    return list(static_protocol([float(x) for x in (rng.permutation(loads) if other else loads)]).segments)


def single_rate(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Twelve triangles at 200 N/s."""
    return _triangles([0.9 * PEAK_N if other else PEAK_N] * 12, 200.0, 3.0)


def shuffled(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Triangles at mixed rates to loads in random order, so that effects of earlier maxima and of cycles differ."""
    segments = [Segment("rest", 0.0, 3.0)]
    for load_n in rng.permutation(np.repeat(np.arange(100.0, 801.0, 100.0), 3)):
        ramp_s = float(load_n) / float(rng.choice(DYNAMIC_RATES_N_PER_S))
        segments += [Segment("ramp", float(load_n), ramp_s), Segment("ramp", 0.0, ramp_s), Segment("rest", 0.0, 3.0)]
    return segments


def long_hold(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Five minutes at one load, five minutes unloaded, then three triangles."""
    return [
        Segment("rest", 0.0, 10.0),
        *_hold(400.0 if other else 600.0, 300.0, 300.0),
        *_triangles([PEAK_N] * 3, 200.0, 4.0),
    ]


def step(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Steps of 0.1 s up and down between random loads, held for some seconds."""
    segments = [Segment("rest", 0.0, 3.0)]
    for load_n in rng.uniform(100.0, PEAK_N, 14):
        segments += [Segment("ramp", float(load_n), 0.1), Segment("hold", float(load_n), float(rng.uniform(2, 6)))]
        if rng.random() < 0.4:
            segments += [Segment("ramp", 0.0, 0.1), Segment("rest", 0.0, float(rng.uniform(2, 4)))]
    return [*segments, Segment("ramp", 0.0, 0.5), Segment("rest", 0.0, 5.0)]


def multisine(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Sines from 0.02 to 4 Hz, evenly in log frequency, about half load, for two minutes."""
    time_s = np.arange(SINE_STEP_S, 120.0 + 1e-9, SINE_STEP_S)
    frequency_hz = np.geomspace(0.02, 4.0, 16)
    wave = np.sum(np.cos(2 * np.pi * np.outer(time_s, frequency_hz) + rng.uniform(0, 2 * np.pi, 16)), axis=1)
    load_n = 0.5 * PEAK_N * (1.0 + 0.95 * wave / np.abs(wave).max())
    start = [Segment("rest", 0.0, 3.0), Segment("ramp", float(load_n[0]), 2.0)]
    return [
        *start,
        *(Segment("ramp", float(x), SINE_STEP_S) for x in load_n[1:]),
        Segment("ramp", 0.0, 2.0),
        Segment("rest", 0.0, 5.0),
    ]


def minor_loops(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Loops of several widths at several loads, within a large one, at 100 N/s and again at 400 N/s."""
    segments = [Segment("rest", 0.0, 3.0)]
    load = 0.0
    for rate in (100.0, 400.0):
        for centre in (600.0, 400.0, 200.0) if other else (200.0, 400.0, 600.0):
            for half in (50.0, 100.0, 190.0):
                for to_n in (centre + half, centre - half, centre + half, centre - half):
                    segments.append(Segment("ramp", to_n, max(abs(to_n - load), 1.0) / rate))
                    load = to_n
        segments += [Segment("ramp", PEAK_N, (PEAK_N - load) / rate), Segment("ramp", 0.0, PEAK_N / rate)]
        segments.append(Segment("rest", 0.0, 4.0))
        load = 0.0
    return segments


def idle(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Two minutes unloaded, three triangles, two minutes unloaded."""
    triangles = _triangles([PEAK_N] * 3, 200.0, 4.0)
    return [Segment("rest", 0.0, 120.0), *triangles, Segment("rest", 0.0, 120.0)]


def staircase(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Eight levels of the paper's static protocol; with ``other``, seven levels between them in another order."""
    loads = np.arange(100.0, 801.0, 100.0)
    levels = rng.permutation(loads[:-1] + 50.0) if other else loads
    return list(static_protocol([float(x) for x in levels], rate_n_per_s=100.0, approach_s=2.0).segments)


def holds(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Holds of 3 to 24 s at levels in random order, at mixed rates, rests of 2 to 14 s after two in three."""
    segments = [Segment("rest", 0.0, 5.0)]
    load = 0.0
    levels = rng.permutation(np.linspace(100.0, 0.97 * PEAK_N, 9 if other else 11))
    for k, level in enumerate(levels):
        to_n, rate = float(level), float(rng.choice([60.0, 200.0, 500.0, 1200.0]))
        segments += [
            Segment("ramp", to_n, max(abs(to_n - load), 1.0) / rate),
            Segment("hold", to_n, float(rng.choice([3.0, 6.0, 12.0, 24.0]))),
        ]
        load = to_n
        if rng.random() < 0.65 or k == len(levels) - 1:
            segments += [
                Segment("ramp", 0.0, load / float(rng.choice([120.0, 400.0, 1200.0]))),
                Segment("rest", 0.0, float(rng.choice([2.0, 4.0, 8.0, 14.0]))),
            ]
            load = 0.0
    return segments


def recovery(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Idle, a long hold and a long rest, two shorter ones at other loads, three triangles."""
    loads = rng.permutation([0.9 * PEAK_N, 0.6 * PEAK_N, 0.35 * PEAK_N])
    segments = [Segment("rest", 0.0, 15.0)]
    for load_n, hold_s, rest_s in zip(loads, (50, 30, 20) if other else (80, 30, 30), (40, 20, 20), strict=True):
        segments += _hold(float(load_n), float(hold_s), float(rest_s), float(rng.choice([200.0, 600.0])))
    return segments + _triangles([PEAK_N] * 3, 400.0, 3.0)


def walking(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Bouts of steps of two humps, 0.8 to 1.1 a second, with standing and rests between them."""
    humps = np.array([0.35, 0.82, 1.0, 0.9, 0.74, 0.7, 0.8, 0.97, 0.9, 0.55, 0.2, 0.0])
    segments = [Segment("rest", 0.0, 4.0)]
    for bout in range(4 if other else 3):
        stride_s = 1.0 / rng.uniform(0.8, 1.1)
        for _ in range(int(rng.integers(10, 16))):
            height_n, own_s = PEAK_N * rng.uniform(0.6, 1.0), stride_s * rng.uniform(0.95, 1.05)
            segments += [Segment("ramp", float(height_n * h), 0.6 * own_s / humps.size) for h in humps]
            segments.append(Segment("rest", 0.0, 0.4 * own_s))
        segments.append(Segment("rest", 0.0, 3.0))
        if bout % 2 == 0:
            segments += _hold(float(PEAK_N * rng.uniform(0.35, 0.6)), float(rng.uniform(10, 18)), 6.0, 500.0)
    return segments


def mixed(rng: np.random.Generator, other: bool) -> list[Segment]:
    """Ramps to random loads at random rates, some held, some not back to zero."""
    segments = [Segment("rest", 0.0, 5.0)]
    load = 0.0
    for k in range(16 if other else 20):
        rate = float(np.exp(rng.uniform(np.log(50.0), np.log(900.0))))
        to_n = float(rng.uniform(0.3, 1.0) * PEAK_N)
        segments.append(Segment("ramp", to_n, max(abs(to_n - load), 1.0) / rate))
        if rng.random() < 0.45:
            segments.append(Segment("hold", to_n, float(rng.uniform(1.0, 12.0))))
        load = float(rng.uniform(0.04, 0.2) * PEAK_N) if rng.random() < 0.3 and k < 15 else 0.0
        segments.append(Segment("ramp", load, (to_n - load) / float(rng.choice([100.0, 300.0, 800.0]))))
        if load == 0.0 and rng.random() < 0.6:
            segments.append(Segment("rest", 0.0, float(rng.uniform(1.0, 8.0))))
    return [*segments, Segment("ramp", 0.0, max(load, 1.0) / 200.0), Segment("rest", 0.0, 6.0)]


PROTOCOLS: dict[str, Callable[[np.random.Generator, bool], list[Segment]]] = {
    f.__name__: f
    for f in (
        rates, rates_and_holds, static, single_rate, shuffled, long_hold, step, multisine, minor_loops, idle, staircase,
        holds, recovery, walking, mixed,
    )
}  # fmt: skip


def build(name: str, rng: np.random.Generator, other: bool = False) -> Protocol:
    """The named protocol; ``other`` selects its variant for hold-out recordings."""
    return Protocol(name, tuple(PROTOCOLS[name](rng, other)))


def never_unloaded(protocol: Protocol, floor_n: float, before_s: float = 60.0) -> Protocol:
    """The protocol on top of a permanent load, after ``before_s`` under that load (before the record begins)."""
    share = 1.0 - floor_n / max(protocol.peak_load_n, floor_n)
    lifted = tuple(
        Segment("hold" if s.kind == "rest" else s.kind, floor_n + share * s.load_n, s.duration_s)
        for s in protocol.segments
    )
    return Protocol(protocol.name, (*_before(floor_n, before_s), *lifted))


def begun_loaded(protocol: Protocol, floor_n: float, before_s: float = 60.0) -> Protocol:
    """The protocol after ``before_s`` under a load, which is still applied during its first rest."""
    first, *rest = protocol.segments
    start = Segment("hold", floor_n, max(first.duration_s, 1.0)) if first.load_n == 0.0 else first
    return Protocol(protocol.name, (*_before(floor_n, before_s), start, Segment("ramp", 0.0, 1.0), *rest))


def _before(load_n: float, before_s: float) -> tuple[Segment, ...]:
    return Segment("ramp", load_n, 2.0), Segment("hold", load_n, before_s - 2.0)
