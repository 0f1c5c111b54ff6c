"""Hidden effects: noise beyond white noise, and spikes."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import (
    Draws,
    Hideable,
    Subject,
    both,
    log_uniform,
    reading,
    sensor,
    uniform,
)
from smartshoe.arrays import Array


def alias_hz(frequency_hz: float, sample_rate_hz: float) -> float:
    """The frequency in Hz at which a tone of ``frequency_hz`` appears in a log at ``sample_rate_hz``."""
    folded = frequency_hz % sample_rate_hz
    return min(folded, sample_rate_hz - folded)


def _mains(rng: np.random.Generator, subject: Subject) -> Draws:
    return {"hum_hz": float(rng.choice([50.0, 60.0]) + rng.uniform(0.01, 0.05) * rng.choice([-1.0, 1.0]))}


def wandering_mains(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A tone whose frequency varies with the grid's load: a slow random walk of the phase."""
    walk = np.cumsum(at.rng.standard_normal(y.size)) * np.sqrt(at.step_s) * draws["wander"]
    return np.asarray(y + amount * np.sin(2.0 * np.pi * (draws["hum_hz"] * at.time_s + at.rng.uniform()) + walk))


def motor(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A tone present while a motor runs: two thirds of the time, in spells."""
    spell = np.floor(at.time_s / draws["spell_s"] + at.rng.uniform()).astype(int)
    runs = at.rng.random(int(spell[-1]) + 1 if spell.size else 1) < 0.67
    wave = np.sin(2.0 * np.pi * (draws["hum_hz"] * at.time_s + at.rng.uniform()))
    return np.asarray(y + amount * runs[spell] * wave)


def rumble(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A broad band about one frequency, like a shaking building: second order with a damping of a tenth to a half."""
    from scipy.signal import lfilter

    angle = 2.0 * np.pi * min(draws["rumble_hz"] * at.step_s, 0.3)
    radius = np.exp(-angle * draws["damping"])
    band = lfilter([1.0], [1.0, -2.0 * radius * np.cos(angle), radius**2], at.rng.standard_normal(y.size + 500))[500:]
    return np.asarray(y + amount * band / band.std())


def averaged(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """White noise through a running mean: correlated up to its length but not beyond."""
    width = max(2, round(draws["mean_s"] / at.step_s))
    total = np.cumsum(at.rng.standard_normal(y.size + width))
    return np.asarray(y + amount * (total[width:] - total[:-width]) / np.sqrt(width))


def shot(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """White noise whose variance is proportional to the reading."""
    return np.asarray(y + amount * np.sqrt(np.abs(y)) * at.rng.standard_normal(y.size))


def two_ranges(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """An amplifier that switches to a noisier range above a certain reading."""
    return np.asarray(y + amount * (np.abs(y) > draws["switch"]) * at.rng.standard_normal(y.size))


def late_or_not(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """An interrupt that is sometimes served late; zero on average."""
    late = at.rng.random(t.size) < draws["share"]
    return np.asarray(amount * (late - draws["share"]) / np.sqrt(draws["share"] * (1.0 - draws["share"])))


def queueing(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """Waiting times of a queue: exponential; zero on average."""
    return np.asarray(amount * (at.rng.standard_exponential(t.size) - 1.0))


def discharges(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Spikes of single samples to one side, with exponential sizes."""
    struck = at.rng.random(y.size) < draws["spike_share"]
    return np.asarray(y + draws["side"] * amount * struck * (0.3 + at.rng.standard_exponential(y.size)))


def heavy_tail(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Spikes of single samples to either side, Student's t with three degrees of freedom, limited to four."""
    struck = at.rng.random(y.size) < draws["spike_share"]
    return np.asarray(y + amount * struck * np.clip(at.rng.standard_t(3.0, y.size), -4.0, 4.0))


RARE = log_uniform(spike_share=(2e-3, 8e-3))

EFFECTS = [
    Hideable("hum", "noise", "logger", "hum", "%", 0.5, 30.0,
        lambda a, d, s: reading(hum_percent=a, hum_hz=d["hum_hz"]), _mains, law="harmonic",
        says="a tone and its third harmonic", source="mains",
        catalogue=lambda a, d, s, hz: {"frequency_hz": alias_hz(d["hum_hz"], hz)},
        laws=(
            Law("wandering", "log", "a tone whose phase wanders", "grid frequency", wandering_mains, 0.014, 0.3,
                both(_mains, uniform(wander=(0.02, 0.1))), bends=None),
            Law("motor", "log", "a tone while a motor runs", "duty cycle", motor, 0.017, 0.3,
                both(_mains, uniform(spell_s=(8.0, 25.0))), bends=None),
        )),
    Hideable("coloured_noise", "noise", "sensor", "coloured", "%", 0.5, 30.0,
        lambda a, d, s: sensor(noise={"coloured_percent": a, **d}), log_uniform(coloured_time_constant_s=(0.1, 3.0)),
        law="first_order", says="Ornstein and Uhlenbeck's", source="Uhlenbeck and Ornstein 1930",
        laws=(
            Law("rumble", "log", "a broad band about one frequency", "second-order autoregression", rumble, 0.01, 0.3,
                both(log_uniform(rumble_hz=(0.3, 3.0)), uniform(damping=(0.15, 0.5))), bends=None),
            Law("averaged", "log", "white noise through a running mean", "moving average", averaged, 0.01, 0.3,
                log_uniform(mean_s=(0.15, 2.0)), bends=None),
        )),
    Hideable("heteroscedastic_noise", "noise", "sensor", "growing", "%", 0.5, 50.0,
        lambda a, d, s: sensor(noise={"growing_percent": a}), law="proportional",
        says="standard deviation in proportion to the reading", source="gain noise",
        laws=(
            Law("shot", "log", "variance in proportion to the reading", "Schottky 1918", shot, 0.015, 0.3, bends=None),
            Law("two_ranges", "log", "noisier above one reading", "auto-ranging amplifier", two_ranges, 0.015, 0.3,
                uniform(switch=(0.25, 0.6)), bends=None),
        )),
    Hideable("timing_jitter", "noise", "logger", "jitter_s", "s", 0.005, 1.0, lambda a, d, s: reading(jitter_s=a),
        law="normal", says="normal", source="clock jitter", catalogue=lambda a, d, s, hz: {"jitter_s": a},
        laws=(
            Law("late_or_not", "shift", "now and then served late", "interrupt latency", late_or_not, 0.01, 0.3,
                uniform(share=(0.2, 0.5)), bends=None),
            Law("queueing", "shift", "waiting times of a queue", "Erlang 1909", queueing, 0.01, 0.3, bends=None),
        )),
    Hideable("spikes", "noise", "logger", "spike size", "%", 20.0, 90.0,
        lambda a, d, s: reading(spike_percent=a, spike_share=d["spike_share"]), log_uniform(spike_share=(2e-3, 1e-2)),
        law="either_side", says="rare, either side, of nearly one size", source="bit errors",
        catalogue=lambda a, d, s, hz: {"share": d["spike_share"], "size_mbar": 0.01 * a * s.range_mbar},
        laws=(
            Law("discharges", "log", "one side, sizes exponential", "electrostatic discharge", discharges, 0.15, 1.5,
                both(RARE, lambda r, s: {"side": float(r.choice([-1.0, 1.0]))}), bends=None),
            Law("heavy_tail", "log", "either side, Student's t", "Student 1908", heavy_tail, 0.15, 1.5, RARE,
                bends=None),
        )),
]  # fmt: skip
