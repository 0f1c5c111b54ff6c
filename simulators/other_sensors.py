"""Force sensors other than a pneumatic shoe, by textbook physics, pressed as by hands, robots and walkers.

They stand for sensors unknown to smartshoe's authors. Each is an equation or two of its own kind of sensor, with noise,
and lists the families of the catalogue that a standard linear solid of it lacks. *Left out:* everything else of the
sensor.

Sources: contacts that grow with load (Holm 1967), polymers that creep by powers of time (Findley 1976), hysteresis by
relays (Mayergoyz 1991), bridges and their creep (OIML R 60), piezoelectric discharge and optical loss (Fraden 2016),
rubber's softening (Mullins 1969).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from smartshoe.arrays import Array
from smartshoe.recording import Recording

ROOM_C = 20.0


@dataclass(frozen=True)
class LoadHistory:
    """One recording's load (n,) in N at ``time_s`` (n,), the ``number``-th of its unit; ``rng`` for random parts."""

    time_s: Array
    load_n: Array
    number: int
    rng: Generator

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / float(self.time_s[1] - self.time_s[0])

    def late(self, signal: Array, tau_s: float) -> Array:
        """``signal`` (n,) through a first-order lag, starting in steady state."""
        keep = float(np.exp(-1.0 / (self.rate_hz * tau_s)))
        return np.asarray(lfilter([1.0 - keep], [1.0, -keep], signal - signal[0]) + signal[0])

    def crept(self, signal: Array, taus_s: ArrayLike, weights: ArrayLike | None = None) -> Array:
        """Weighted mean (n,) of ``signal`` through several first-order lags."""
        lags = [self.late(signal, float(tau)) for tau in np.asarray(taus_s)]
        return np.asarray(np.average(lags, axis=0, weights=weights))

    def noise(self, sd: float, memory: float = 0.6) -> Array:
        """Noise (n,) of standard deviation ``sd``; ``memory`` is the correlation of neighbouring samples."""
        white = self.rng.normal(0.0, sd * np.sqrt(1.0 - memory**2), self.time_s.size)
        return np.asarray(lfilter([1.0], [1.0, -memory], white))


# -- loads ------------------------------------------------------------------------------------------------------------
Load = Callable[[Generator, int], tuple[Array, Array]]


def presses(
    seconds: float,
    rate_hz: float,
    highest_n: float,
    hold_s: tuple[float, float] = (0.3, 2.0),
    ramp_s: tuple[float, float] = (0.2, 2.0),
    rest_s: tuple[float, float] = (0.5, 3.0),
    lowest_n: float = 0.0,
) -> Load:
    """Presses of random height, speed and length, no two alike."""

    def made(rng: Generator, number: int) -> tuple[Array, Array]:
        time_s = np.arange(0.0, seconds, 1.0 / rate_hz)
        corners = [(0.0, lowest_n), (rng.uniform(*rest_s), lowest_n)]
        while corners[-1][0] < seconds:
            peak = lowest_n + (highest_n - lowest_n) * rng.uniform(0.3, 1.0)
            for lasts, level in ((ramp_s, peak), (hold_s, peak), (ramp_s, lowest_n), (rest_s, lowest_n)):
                corners.append((corners[-1][0] + rng.uniform(*lasts), level))
        load = np.interp(time_s, *np.transpose(corners))
        width = max(3, int(0.05 * rate_hz))  # no robot changes its speed instantly
        padded = np.pad(load, width, mode="edge")
        return time_s, np.convolve(padded, np.full(width, 1.0 / width), "same")[width:-width]

    return made


def one_press(rng: Generator, number: int) -> tuple[Array, Array]:
    """A rest, one press whose rate changes from recording to recording, and a rest."""
    ramp_s, peak = (0.2, 0.5, 1.0, 2.0)[number % 4], rng.uniform(10.0, 40.0)
    time_s = np.arange(0.0, 8.0, 0.01)
    corners_s = [0.0, 1.0, 1.0 + ramp_s, 2.5 + ramp_s, 2.5 + 2 * ramp_s, 8.0]
    return time_s, np.interp(time_s, corners_s, [0.0, 0.0, peak, peak, 0.0, 0.0])


def stretch(rng: Generator, number: int) -> tuple[Array, Array]:
    """One stretching cycle of a strip, faster in each recording."""
    seconds, rate_hz = ((200.0, 10.0), (66.0, 20.0), (40.0, 20.0))[number]
    time_s = np.arange(0.0, seconds, 1.0 / rate_hz)
    return time_s, np.interp(time_s, [0.0, 0.5 * seconds, seconds], [0.0, 1.0, 0.0])


def hand(rng: Generator, number: int) -> tuple[Array, Array]:
    """A hand that never releases the sensor."""
    time_s = np.arange(0.0, 60.0, 0.01)
    swing = np.abs(np.convolve(rng.normal(0.0, 1.0, time_s.size + 200), np.hanning(160), "same")[100:-100])
    return time_s, 2.0 + 24.0 * swing / swing.max()


def sways(rng: Generator, number: int) -> tuple[Array, Array]:
    """Three sines about a mean, after a ramp."""
    time_s = np.arange(0.0, 60.0, 0.01)
    sines = [np.sin(2.0 * np.pi * hz * time_s + rng.uniform(0.0, 6.0)) for hz in (0.1 * (1 + number), 0.33, 1.1)]
    return time_s, 60.0 * np.clip(time_s / 2.0, 0.0, 1.0) * (0.55 + 0.4 * np.mean(sines, axis=0))


def steps(rng: Generator, number: int) -> tuple[Array, Array]:
    """Double-humped steps of a walker."""
    time_s = np.arange(0.0, 60.0, 0.01)
    load, begins_s = np.zeros(time_s.size), 0.5
    while begins_s < 59.0:
        lasts_s = rng.uniform(0.6, 0.75)
        share = (time_s - begins_s) / lasts_s
        hump = np.sin(np.pi * share) + 0.35 * np.sin(3.0 * np.pi * share)
        load += np.where((share > 0.0) & (share < 1.0), rng.uniform(500.0, 700.0) * np.maximum(hump, 0.0), 0.0)
        begins_s += lasts_s + rng.uniform(0.35, 0.5)
    return time_s, load


# -- sensors ----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class OtherSensor:
    """A sensor: ``reading`` (n,) of a load history, logged as ``column``.

    ``kinds``: families that a line and an arm of it lack. ``beside``: families that are present only slightly, or that
    only their size distinguishes from those.
    """

    reading: Callable[[LoadHistory], Array]
    load: Load
    column: str
    load_noise_n: float
    kinds: Set[str]
    beside: Set[str] = frozenset()
    fitted: int = 2
    held_out: int = 2
    logs: Callable[[LoadHistory], Mapping[str, Array]] = lambda history: {}
    """Channels logged beside the reading, by column."""

    def recordings(self, seed: int) -> tuple[list[Recording], list[Recording]]:
        """The recordings to fit, and those to judge the fit on."""
        rng = np.random.default_rng(seed)
        made = []
        for number in range(self.fitted + self.held_out):
            history = LoadHistory(*self.load(rng, number), number, rng)
            columns: dict[str, Any] = {self.column: self.reading(history), **self.logs(history)}
            measured_n = history.load_n + rng.normal(0.0, self.load_noise_n, history.load_n.size)
            name = f"recording_{number + 1}"
            made.append(Recording.from_arrays(time_s=history.time_s, name=name, force_n=measured_n, **columns))
        return made[: self.fitted], made[self.fitted :]


def _film(history: LoadHistory) -> Array:
    conducts = 1e-5 * np.maximum(history.load_n, 0.0) ** 0.85
    ohm = 1.0 / (1e-7 + 0.9 * conducts + 0.1 * history.crept(conducts, (0.3, 1.0, 3.0, 10.0, 30.0)))
    return np.asarray(np.round((5.0 * 1e4 / (1e4 + ohm) + history.noise(0.003)) / 5.0 * 1023.0) * 5.0 / 1023.0)


def _bridge(history: LoadHistory) -> Array:
    return 2e-3 * history.load_n + 5e-7 * history.late(history.load_n, 8.0) + history.noise(4e-4, 0.2)


def _foam_capacitor(history: LoadHistory) -> Array:
    closed = 0.45 * -np.expm1(-history.load_n / 9.0)
    closed = 0.85 * closed + 0.1 * history.late(closed, 0.6) + 0.05 * history.late(closed, 12.0)
    return 10.0 / (1.0 - closed) + history.noise(0.008)


def _piezo(history: LoadHistory) -> Array:
    return 0.02 * (history.load_n - history.late(history.load_n, 20.0)) + history.noise(0.002)


def _rubber_barometer(history: LoadHistory) -> Array:
    pressed = 3.0 * history.load_n + 0.07 * history.load_n**2 + 0.25 * history.late(history.load_n, 2.0)
    return 1010.0 + pressed - 1.5 * np.expm1(-history.time_s / 60.0) + history.noise(0.05)


def _air_line(history: LoadHistory) -> Array:
    angular, step_s = 2.0 * np.pi * 2.0, 0.1 / history.rate_hz
    out, speed, place = np.empty(history.load_n.size), 0.0, float(history.load_n[0])
    for k, load in enumerate(history.load_n):
        for _ in range(10):
            speed += step_s * (angular**2 * (load - place) - 1.4 * angular * speed)
            place += step_s * speed
        out[k] = place
    return 0.5 * out + history.noise(0.05)


def _fibre(history: LoadHistory) -> Array:
    return 4.0 * np.exp(-history.load_n / 12.0) + 0.5 + history.noise(0.006)


def _relays(load_n: Array, highest_n: float, count: int = 25) -> Array:
    """Share (n,) of relays that are up, for relays that switch up at a higher load than they switch down."""
    level = np.linspace(0.0, highest_n, count)
    ups, downs = np.meshgrid(level, level, indexing="ij")
    there, is_up, out = ups >= downs, np.zeros((count, count), dtype=bool), np.empty(load_n.size)
    for k, load in enumerate(load_n):
        is_up = (is_up & (downs < load)) | (ups <= load)
        out[k] = is_up[there].mean()
    return out


def _magnet(history: LoadHistory) -> Array:
    deep = 0.2 * _relays(history.load_n, 10.0) + 0.08 * history.load_n
    field_mt = 1.0 / (2.2 - deep) ** 3
    return 20.0 * (0.9 * field_mt + 0.1 * history.late(field_mt, 3.0)) + history.noise(0.004)


def _late_pad(history: LoadHistory) -> Array:
    reading = 0.8 * history.load_n + 0.35 * history.late(history.load_n, 0.9)
    return (
        np.interp(history.time_s - 0.08, history.time_s, reading) + history.rng.uniform(-3.0, 3.0) + history.noise(0.02)
    )


def _room_k(history: LoadHistory) -> Array:
    return np.asarray(6.0 * history.number + 8.0 * np.sin(2.0 * np.pi * history.time_s / 300.0 + history.number))


def _bridge_in_any_room(history: LoadHistory) -> Array:
    warmer_k = _room_k(history)
    spanned = 0.05 * history.load_n + 0.006 * history.late(history.load_n, 4.0)
    return spanned * (1.0 - 0.004 * warmer_k) + 0.002 * warmer_k + history.noise(0.004)


def _ionic(history: LoadHistory) -> Array:
    pressed, taus = np.maximum(history.load_n, 0.0) ** 0.7, np.geomspace(0.05, 100.0, 14)
    return 0.5 * pressed + 0.5 * history.crept(pressed, taus, taus**-0.35) + history.noise(0.01)


def _strip(history: LoadHistory) -> Array:
    drawn = history.load_n**0.8
    return 40.0 * (drawn + history.crept(drawn, np.geomspace(1.0, 300.0, 8))) + history.noise(0.05)


def _insole(history: LoadHistory) -> Array:
    volts = 3.0 * history.load_n / (history.load_n + 900.0)
    return 0.92 * volts + 0.08 * history.late(volts, 0.4) + 0.02 * history.number + history.noise(0.01)


def _coarse(history: LoadHistory) -> Array:
    crept = history.crept(history.load_n, (1.0, 5.0, 25.0, 120.0))
    return np.asarray(np.round((0.9 * history.load_n + 0.2 * crept) / 120.0 * 255.0) / 51.0)


def _sticky(history: LoadHistory) -> Array:
    out, place = np.empty(history.load_n.size), float(history.load_n[0])
    for k, load in enumerate(history.load_n):
        place += (load - place) * -np.expm1(-1.0 / (history.rate_hz * (0.15 if load > place else 1.2)))
        out[k] = place
    return 0.1 * (0.8 * history.load_n + 0.2 * out) + history.noise(0.004)


def _curing(history: LoadHistory) -> Array:
    kept = 1.0 + 0.06 * np.expm1(-history.time_s / 100.0)
    return 0.1 * (history.load_n + 0.1 * history.late(history.load_n, 1.0)) * kept + history.noise(0.004)


def _with_play(history: LoadHistory) -> Array:
    out, place = np.empty(history.load_n.size), float(history.load_n[0])
    for k, load in enumerate(history.load_n):
        place = min(max(place, load - 0.8), load + 0.8)
        out[k] = place
    return 0.1 * history.late(0.7 * history.load_n + 0.3 * out, 0.05) + history.noise(0.004)


def _slow(history: LoadHistory) -> Array:
    return history.late(0.05 * history.load_n + 0.01 * history.late(history.load_n, 3.0), 0.12) + history.noise(0.004)


def _leaking(history: LoadHistory) -> Array:
    out, lost = np.empty(history.load_n.size), 0.0
    for k, load in enumerate(history.load_n):
        out[k] = load - lost
        lost += 0.003 / history.rate_hz * out[k]
    return 0.2 * out + history.noise(0.05)


def _thickening(history: LoadHistory) -> Array:
    speed = np.abs(history.late(np.gradient(history.load_n, 1.0 / history.rate_hz), 0.05))
    return 0.05 * history.load_n * (1.0 + 0.04 * np.log1p(speed / 50.0)) + history.noise(0.006)


def _curved(history: LoadHistory) -> Array:
    curved = 0.05 * history.load_n * (1.0 - 0.1 * history.load_n / 40.0)
    return curved + 0.012 * history.late(history.load_n, 1.2) + history.rng.uniform(-0.3, 0.3) + history.noise(0.006)


def _reseated(history: LoadHistory) -> Array:
    spanned = 0.05 * history.load_n + 0.006 * history.late(history.load_n, 2.0)
    return spanned * (1.0 + history.rng.uniform(-0.04, 0.04)) + history.noise(0.005)


def _beside_another(history: LoadHistory) -> Array:
    other_n = presses(90.0, history.rate_hz, 30.0)(history.rng, 0)[1]
    return 0.05 * history.load_n + 0.006 * history.late(history.load_n, 2.0) + 0.004 * other_n + history.noise(0.004)


def _broken_in(history: LoadHistory) -> Array:
    below_n = np.maximum.accumulate(history.load_n) - history.load_n
    softened_n = history.load_n * (1.1 - 0.1 * np.exp(-below_n / 6.0))
    return 0.05 * softened_n + 0.004 * history.late(softened_n, 3.0) + history.noise(0.0002)


CURVE = "static_curve"
OTHER_SENSORS = {
    "polymer_film": OtherSensor(_film, presses(90, 100, 40), "pressure_v", 0.02, {CURVE}, {"relaxation"}),
    "strain_gauge": OtherSensor(_bridge, presses(120, 200, 500), "pressure_v", 0.1, frozenset()),
    "foam_capacitor": OtherSensor(_foam_capacitor, presses(100, 50, 20), "pressure_v", 0.01, {CURVE}, {"relaxation"}),
    "piezo": OtherSensor(_piezo, presses(100, 100, 100), "pressure_v", 0.03, {"leak"}),
    "rubber_barometer": OtherSensor(_rubber_barometer, presses(100, 50, 15), "pressure_mbar", 0.01, {CURVE, "zero"}),
    "air_line": OtherSensor(_air_line, sways, "pressure_kpa", 0.03, {"timing"}),
    "fibre": OtherSensor(_fibre, presses(80, 50, 30), "pressure_v", 0.02, {CURVE}),
    "magnet": OtherSensor(_magnet, presses(60, 50, 10), "pressure_v", 0.006, {CURVE, "hysteresis"}, {"relaxation"}),
    "late_pad": OtherSensor(_late_pad, hand, "pressure_v", 0.01, {"timing"}),
    "bridge_in_any_room": OtherSensor(
        _bridge_in_any_room, presses(200, 25, 50), "pressure_v", 0.03, {"gain_drift", "zero"},
        logs=lambda history: {"temperature_c": ROOM_C + _room_k(history)},
    ),
    "ionic_gel": OtherSensor(_ionic, presses(90, 50, 5), "pressure_v", 0.003, {CURVE, "relaxation"}),
    "strip": OtherSensor(_strip, stretch, "pressure_mm", 0.002, {CURVE}, {"relaxation"}, held_out=1),
    "insole": OtherSensor(_insole, steps, "pressure_v", 1.0, {CURVE}, {"relaxation"}),
    "coarse": OtherSensor(
        _coarse, presses(300, 10, 100, (10.0, 30.0), (2.0, 6.0), (10.0, 30.0)), "pressure_v", 0.1, {"relaxation"}
    ),
    "sticky": OtherSensor(_sticky, presses(90, 50, 20), "pressure_v", 0.01, {"asymmetry"}),
    "curing": OtherSensor(_curing, presses(300, 50, 20), "pressure_v", 0.01, {"gain_drift"}, {"softening"}),
    # The relaxing part softens too.
    "broken_in": OtherSensor(_broken_in, presses(120, 50, 20), "pressure_v", 0.01, {"softening"}),
    "with_play": OtherSensor(_with_play, presses(90, 50, 20), "pressure_v", 0.01, {"hysteresis"}, {"timing"}),
    "slow": OtherSensor(_slow, presses(90, 100, 40), "pressure_v", 0.02, {"timing"}),
    "leaking": OtherSensor(
        _leaking, presses(400, 20, 500, (20.0, 60.0), (1.0, 4.0), (20.0, 60.0)), "pressure_kpa", 0.2, {"leak"}
    ),
    "thickening": OtherSensor(_thickening, presses(90, 100, 100, ramp_s=(0.1, 4.0)), "pressure_v", 0.03, {"rate"}),
    "one_press_each": OtherSensor(_curved, one_press, "pressure_v", 0.02, {CURVE}, fitted=10, held_out=4),
    "noisy_load": OtherSensor(_curved, presses(90, 100, 60), "pressure_v", 0.6, {CURVE}),
    # For effects that are not in the catalogue, nothing may be named.
    "reseated": OtherSensor(_reseated, presses(60, 50, 60), "pressure_v", 0.03, frozenset(), fitted=3),
    "beside_another": OtherSensor(_beside_another, presses(90, 100, 40), "pressure_v", 0.02, frozenset()),
}  # fmt: skip
OUTSIDE = frozenset({"reseated", "beside_another"})
