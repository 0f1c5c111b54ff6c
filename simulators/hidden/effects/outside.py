"""Hidden effects that the catalogue lacks: the plain ones are in `simulators.effects.outside`, the others here."""

from __future__ import annotations

from typing import Any

import numpy as np

from simulators.effects.outside import moments
from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import (
    Draws,
    Hideable,
    Options,
    bladder,
    log_uniform,
    sensor,
    signed,
    uniform,
)
from simulators.hidden.effects.operators import lagged
from smartshoe.arrays import Array


def _odd(**given: Any) -> Options:
    return bladder(odd=given)


def _wander(**given: Any) -> Options:
    return sensor(wander=given)


def automatic_gain(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """An amplifier that reduces its gain with the mean of the last seconds."""
    return np.asarray(y * (1.0 - amount * (lagged(np.abs(y), draws["mean_s"], at.step_s) - 0.3)))


def slips(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """The unit slips on its seat at random moments, further at higher loads; slips accumulate and recover."""
    number, _, size = moments(at.time_s, draws["every_s"], at.rng)
    struck = np.flatnonzero(np.diff(number, prepend=number[0]) > 0)
    moved = np.zeros(y.size)
    for i in struck:
        moved[i:] += size[number[i]] * at.load[i]
    return np.asarray(y + amount * (moved - moved.mean()))


def breathing(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Pressure changes of the room, through an open vent: rises and falls of random length."""
    knots = at.rng.standard_normal(int(at.span_s / draws["breath_s"]) + 4)
    course = np.interp(at.time_s / draws["breath_s"], np.arange(knots.size), knots)
    return np.asarray(y + amount * (1.0 + y) * course)


def _nothing(amount: float, draws: Draws, subject: object) -> Options:
    return {}


def _by_law(name: str, stage: str, law: Law) -> Hideable:
    return Hideable(
        name, "outside", stage, law.name, "1", law.typical, law.largest, _nothing, law.draw, inside=False, law="",
        says=law.says, source=law.source, laws=(law,),
    )  # fmt: skip


EFFECTS = [
    Hideable("gain_step", "outside", "sensor", "gain step", "%", 2.0, 60.0,
        lambda a, d, s: _wander(gain_step_percent=d["sign"] * a, gain_step_at_s=d["gain_step_at_s"]),
        signed(lambda r, s: {"gain_step_at_s": float(r.uniform(0.25, 0.75)) * s.duration_s}), inside=False,
        says="the gain changes at one moment of each session"),
    Hideable("resonance", "outside", "contact", "resonance", "1", 0.2, 1.0,
        lambda a, d, s: _odd(resonance=a, resonance_hz=d["resonance_hz"], resonance_damping=d["resonance_damping"]),
        log_uniform(resonance_hz=(0.3, 3.0), resonance_damping=(0.01, 0.06)), inside=False,
        says="a lightly damped mode between plate and tube"),
    Hideable("slow_sine", "outside", "sensor", "slow sine", "%", 1.0, 40.0,
        lambda a, d, s: _wander(slow_sine_percent=a, **d),
        uniform(slow_sine_period_s=(15.0, 60.0), slow_sine_phase=(0.0, 1.0)), inside=False,
        says="the gain goes up and down"),
    Hideable("telegraph_noise", "outside", "sensor", "telegraph", "%", 1.0, 40.0,
        lambda a, d, s: _wander(telegraph_percent=a, **d), log_uniform(telegraph_dwell_s=(1.0, 8.0)),
        inside=False, says="the zero jumps between two levels"),
    Hideable("intermittent_pinch", "outside", "contact", "pinch", "1", 0.05, 1.0,
        lambda a, d, s: _odd(pinch=a, pinch_from=d["pinch_from"], pinch_share=d["pinch_share"], seed=int(d["seed"])),
        lambda r, s: {"pinch_from": float(r.uniform(0.1, 0.5)), "pinch_share": float(r.uniform(0.3, 0.6)),
                      "seed": float(r.integers(2**31))}, inside=False,
        says="some cycles lose part of the load above a level"),
    Hideable("random_seating", "outside", "contact", "seating", "1", 0.02, 0.3,
        lambda a, d, s: _odd(seating=a, seed=int(d["seed"])), lambda r, s: {"seed": float(r.integers(2**31))},
        inside=False, says="each cycle has a gain of its own"),
    Hideable("snap_through", "outside", "wall", "snap", "1", 0.02, 0.5,
        lambda a, d, s: _odd(snap=a, **d), uniform(snap_up=(0.5, 0.8), snap_down=(0.15, 0.4)), inside=False,
        says="the wall snaps over at one load and back at a lower one"),
    Hideable("draughts", "outside", "sensor", "draught", "%", 2.0, 40.0,
        lambda a, d, s: _wander(draught_percent=a, **d),
        uniform(draught_every_s=(15.0, 40.0), draught_recovery_s=(2.0, 8.0)), inside=False,
        says="the die is cooled or warmed at random moments"),
]  # fmt: skip

BY_LAW_ALONE = [
    _by_law("automatic_gain", "sensor", Law("automatic_gain", "reading",
        "an amplifier turns itself down by the mean of the last seconds", "automatic gain control", automatic_gain,
        0.1, 2.0, log_uniform(mean_s=(6.0, 30.0)), bends=None)),
    _by_law("seat_slips", "contact", Law("seat_slips", "reading", "the unit slips on its seat at random moments",
        "stick and slip", slips, 0.03, 0.6, uniform(every_s=(8.0, 30.0)), bends=None)),
    _by_law("breathing_vent", "sensor", Law("breathing_vent", "reading",
        "the room's pressure comes and goes through an open vent", "gauge reference", breathing, 0.02, 0.4,
        uniform(breath_s=(3.0, 12.0)), bends=None)),
]  # fmt: skip
