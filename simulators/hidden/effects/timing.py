"""Hidden effects: a reading that is late against the load."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, reading, sensor, signed, uniform
from simulators.hidden.effects.operators import against_modes, opening_port
from smartshoe.arrays import Array


def cole_cole(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """1/(1 + (s tau)^alpha): a port with many volumes, with the spectrum of Cole and Cole."""
    alpha = draws["alpha"]
    log_ratio = np.linspace(-5.0, 5.0, 21)
    # Density over d ln(tau): sin(pi alpha)/(cosh(alpha u) + cos(pi alpha)).
    weight = np.sin(np.pi * alpha) / (np.cosh(alpha * log_ratio) + np.cos(np.pi * alpha))
    rate = np.minimum(np.exp(-log_ratio) / amount, 0.5 / at.step_s * 20.0)
    return np.asarray(y - against_modes(y, at.step_s, rate, weight / weight.sum()))


def widening(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A port that the pressure widens, and which is therefore faster at high pressure."""
    out = np.empty(y.size)
    opening_port(np.ascontiguousarray(y), at.step_s, amount, draws["opening"], out)
    return out


def beating(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """Two clocks of nearly equal rate: the delay beats about its mean."""
    return np.asarray(amount * (1.0 + draws["depth"] * np.sin(2.0 * np.pi * (t / draws["period_s"] + draws["phase"]))))


def catching_up(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """A buffer whose delay is longer at first."""
    return np.asarray(amount * (1.0 + draws["depth"] * np.exp(-t / draws["settles_s"])))


def temperature_of_crystal(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """A clock rate error that grows linearly in time about its mean, so that the delay is a parabola."""
    share = t / at.span_s
    return np.asarray(draws["sign"] * amount * t * (1.0 + draws["bend"] * (share - 0.7)))


def slipped_samples(amount: float, draws: Draws, t: Array, at: Surroundings) -> Array:
    """A sample is lost or doubled whenever the clocks differ by one: the delay is a staircase."""
    step_s = draws["slip_s"]
    return np.asarray(draws["sign"] * step_s * np.floor(amount * t / step_s + 0.5))


EFFECTS = [
    Hideable("sensor_lag", "timing", "sensor", "second_lag_s", "s", 0.02, 2.0,
        lambda a, d, s: sensor(second_lag_s=a), law="two_poles", says="two poles, at a time constant and its quarter",
        source="pneumatic port", bends="pressure",
        # Two poles, at the time constant and at a quarter of it, delay a ramp by their sum.
        catalogue=lambda a, d, s, hz: {"time_constant_s": 1.25 * a},
        laws=(
            Law("cole_cole", "reading", "a spread of lags about one", "Cole and Cole 1941", cole_cole, 0.03, 1.0,
                uniform(alpha=(0.85, 0.97))),
            Law("widening", "reading", "a port that the pressure widens", "compliant tube (Fung 1997)", widening,
                0.05, 1.5, uniform(opening=(0.3, 1.2))),
        )),
    Hideable("delay", "timing", "logger", "delay_s", "s", 0.01, 5.0, lambda a, d, s: reading(delay_s=a),
        law="constant", says="one delay", source="transport",
        catalogue=lambda a, d, s, hz: {"delay_s": a},
        laws=(
            Law("beating", "shift", "beats between two clocks of nearly one rate", "polled buffers", beating, 0.01, 2.0,
                uniform(depth=(0.1, 0.5), period_s=(15.0, 60.0), phase=(0.0, 1.0)), bends="time"),
            Law("catching_up", "shift", "a buffer that is longer at first", "queue that drains", catching_up, 0.01, 2.0,
                uniform(depth=(0.2, 1.0), settles_s=(15.0, 60.0)), bends="time"),
        )),
    Hideable("clock_drift", "timing", "logger", "skew", "s/s", 1e-4, 0.09, lambda a, d, s: reading(skew=-d["sign"] * a),
        signed(), law="constant", says="a constant error of rate", source="crystal tolerance",
        catalogue=lambda a, d, s, hz: {"clock_rate_error": d["sign"] * a},
        laws=(
            Law("ageing", "shift", "an error of rate that grows with time", "Walls and Vig 1995",
                temperature_of_crystal, 1e-4, 0.05, signed(uniform(bend=(-0.6, 0.6))), bends="time"),
            Law("slips", "shift", "samples lost or doubled whenever the clocks are one apart",
                "controlled slips, ITU-T G.822",
                slipped_samples, 1e-4, 0.05, signed(uniform(slip_s=(0.005, 0.02))), bends="time"),
        )),
]  # fmt: skip
