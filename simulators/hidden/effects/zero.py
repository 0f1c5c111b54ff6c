"""Hidden effects: the reading's zero, by offset, drift, warm-up and permanent set."""

from __future__ import annotations

import numpy as np

from simulators.effects.sensing import DIE_FASTER, DIE_SHARE
from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import (
    Draws,
    Hideable,
    Options,
    Subject,
    bladder,
    log_uniform,
    sensor,
    signed,
    uniform,
)
from simulators.hidden.effects.operators import integral
from simulators.plant.bladder_parameters import X_OVER_NRT
from smartshoe.arrays import Array

PER_KELVIN = 50.0  # converts a coefficient per second to one per kelvin: warming is slow
ROOM = {"logged": True, "warming_k": 4.0, "warming_time_constant_s": 90.0, "swing_k": 1.0, "swing_period_s": 83.0}
TOUCHED = 0.05  # of full scale: threshold of the first load of a session


def by_temperature(rng: np.random.Generator, subject: Subject) -> Draws:
    """Draws a sign, and whether the drift follows the room's temperature instead of the time."""
    return {"sign": float(rng.choice([-1.0, 1.0])), "by_temperature": float(rng.random() < 0.4)}


def _drift(amount: float, draws: Draws, subject: Subject) -> Options:
    size = draws["sign"] * amount
    if draws["by_temperature"]:
        return {"sensor": {"drift": {"zero_percent_per_k": PER_KELVIN * size}}, "room": ROOM}
    return sensor(zero_drift_mbar_per_s=0.01 * size * subject.range_mbar)


def _drift_catalogue(amount: float, draws: Draws, subject: Subject, hz: float) -> dict[str, float]:
    size = draws["sign"] * amount * 0.01 * subject.range_mbar
    if draws["by_temperature"]:
        return {"temperature_coefficient_mbar_per_k": PER_KELVIN * size}
    return {"drift_rate_mbar_per_s": size}


def _warm_up_catalogue(amount: float, draws: Draws, subject: Subject, hz: float) -> dict[str, float]:
    mean = 1.0 - DIE_SHARE + DIE_SHARE / DIE_FASTER
    return {
        "change_mbar": draws["sign"] * amount * 0.01 * subject.range_mbar,
        "time_constant_s": mean * draws["warm_up_time_constant_s"],
    }


def _set_catalogue(amount: float, draws: Draws, subject: Subject, hz: float) -> dict[str, float]:
    stiff = subject.k1 * X_OVER_NRT
    return {"set_rate_mbar_per_s": amount * stiff / (1.0 + stiff) * subject.full_scale_mbar}


def seated(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """An offset that partly disappears with the session's first load."""
    touched = np.maximum.accumulate(np.asarray(at.load > TOUCHED, dtype=float))
    return np.asarray(y + draws["sign"] * amount * (1.0 - draws["part"] * touched))


def file_by_file(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """An offset that grows from one session to the next."""
    return np.asarray(y + draws["sign"] * amount * (1.0 + draws["part"] * (at.number - 1.0)))


def moisture(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Uptake of moisture by diffusion: the square root of time."""
    return np.asarray(y + draws["sign"] * amount * np.sqrt(at.time_s / 100.0))


def accelerating(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A parabola in time: a drift that speeds up."""
    share = at.time_s / 300.0
    return np.asarray(y + draws["sign"] * amount * share * (1.0 + draws["bend"] * share))


def slab_warming(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Heat conduction through a slab, with all odd modes."""
    odd = np.array([1.0, 3.0, 5.0, 7.0, 9.0])
    share = 1.0 / odd**2
    left = np.exp(-np.outer(at.time_s / draws["time_constant_s"], odd**2)) @ (share / share.sum())
    return np.asarray(y + draws["sign"] * amount * (1.0 - left))


def stretched(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A stretched exponential in time, 1 - exp(-(t/tau)^beta)."""
    slow = (at.time_s / draws["time_constant_s"]) ** draws["beta"]
    return np.asarray(y - draws["sign"] * amount * np.expm1(-slow))


def log_dose(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """The wall's rest position moves with the logarithm of the load dose."""
    dose = integral(np.maximum(at.load, 0.0), at.step_s)
    moved = draws["early_s"] * np.log1p(dose / draws["early_s"])
    return np.asarray(-at.stiff / (1.0 + at.stiff) * amount * moved)


def ratchet(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """The wall's rest position moves while the load grows, as a power of it: by strokes, not by time."""
    f = np.maximum(at.load, 0.0)
    grown = np.maximum(np.diff(f, prepend=0.0), 0.0)
    return np.asarray(-at.stiff / (1.0 + at.stiff) * amount * np.cumsum(grown * f ** draws["power"]))


EFFECTS = [
    Hideable("zero_offset", "zero", "sensor", "zero_offset", "mbar", 0.5, 100.0,
        lambda a, d, s: sensor(zero_offset_mbar=d["sign"] * a), signed(), needs_zero=True, law="constant",
        says="one constant", source="data sheets",
        catalogue=lambda a, d, s, hz: {"offset_mbar": d["sign"] * a},
        laws=(
            Law("seated", "reading", "a part of it goes with the session's first load", "seating of an O-ring", seated,
                0.01, 0.3, signed(uniform(part=(0.1, 0.4))), bends=None),
            Law("growing", "reading", "it grows from session to session", "mounting stress", file_by_file, 0.01, 0.3,
                signed(uniform(part=(-0.25, 0.25))), bends=None),
        )),
    Hideable("zero_drift", "zero", "sensor", "zero drift", "%/s", 0.005, 2.0, _drift, by_temperature, law="line",
        says="a straight line in time, or in the room's temperature", source="data sheets",
        catalogue=_drift_catalogue,
        laws=(
            Law("moisture", "reading", "the root of time: uptake by diffusion", "Crank 1975, ch. 4", moisture, 0.02,
                0.5, signed(), bends="time"),
            Law("parabola", "reading", "a line that bends", "thermal runaway of second order", accelerating, 0.03, 0.8,
                signed(uniform(bend=(-0.3, 0.6))), bends="time"),
        )),
    Hideable("warm_up", "zero", "sensor", "warm_up", "%", 0.5, 40.0,
        lambda a, d, s: sensor(drift={"warm_up_percent": d["sign"] * a,
                                      "warm_up_time_constant_s": d["warm_up_time_constant_s"]}),
        signed(log_uniform(warm_up_time_constant_s=(20.0, 90.0))), law="die_and_package", says="two time constants",
        source="package and die", catalogue=_warm_up_catalogue,
        laws=(
            Law("slab", "reading", "heat through a slab", "Carslaw and Jaeger 1959, 3.3", slab_warming, 0.02, 0.4,
                signed(log_uniform(time_constant_s=(20.0, 80.0))), bends="time"),
            Law("stretched", "reading", "a stretched exponential", "Kohlrausch 1854", stretched, 0.02, 0.4,
                signed(lambda r, s: {"time_constant_s": float(np.exp(r.uniform(np.log(15.0), np.log(60.0)))),
                                     "beta": float(r.uniform(0.6, 0.85))}), bends="time"),
        )),
    Hideable("permanent_set", "zero", "wall", "rate_per_s", "1/s", 2e-4, 0.1,
        lambda a, d, s: bladder(permanent_set={"rate_per_s": a}), law="findley",
        says="the wall's place moves with a power of the load", source="Findley 1976", bends="load",
        catalogue=_set_catalogue,
        laws=(
            Law("log_dose", "stress", "with the logarithm of the dose", "Garofalo 1965, logarithmic creep", log_dose,
                1e-3, 0.1, log_uniform(early_s=(40.0, 300.0))),
            Law("ratchet", "stress", "by strokes, while the load grows", "Armstrong and Frederick 1966", ratchet, 6e-3,
                0.5, uniform(power=(0.5, 2.0))),
        )),
]  # fmt: skip
