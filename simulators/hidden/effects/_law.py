"""What a further law of an effect is: one function at one place of the chain, fed with what the unit goes through.

All in shares of full scale (load, deformation, pressure, reading), times in s. The places, in the order of the chain:

========= =====================================================================================================
load      returns the load that reaches the wall, from the plate's: contact, and friction before the wall
stress    returns the further stress that the wall's deformation asks for, solved in balance with the unit
gas       returns the further pressure of the air over the deformation's own, solved in balance too
leak      the same, from the pressure rather than from the deformation
reading   returns the sensor's reading from the pressure that it feels, before its lag and noise
shift     returns by how much the reading is late (s) at each time
log       returns the logged reading from the logged one, sample by sample: noise and faults of the data
tare      returns what the load cell adds to its log
options   none: the machine's own options switch it on
========= =====================================================================================================

A *departure* warps what such a function is fed with: the load, deformation or pressure by a smooth monotone map of
0 to 1 onto itself, or the time by one of the session's span onto itself. The law stays smooth, is still nothing at
zero amount, and what was a memory of the load is then one of the warped load.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from smartshoe.arrays import Array

if TYPE_CHECKING:
    from simulators.hidden.effects._registry import Drawing, Draws, Options, Subject

Place = Literal["load", "stress", "gas", "leak", "reading", "shift", "log", "tare", "options"]

BUMPS = 3  # sine terms of a warp


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a law may use besides its argument.

    (n,) each: time since the session's start, load, deformation, pressure, and the room's temperature above that at the
    start. ``span_s`` is the session's length, ``number`` counts sessions, ``stiff`` is k1 x0^2/(nRT); ``rng`` draws
    what differs from session to session.
    """

    time_s: Array
    step_s: float
    load: Array
    deformation: Array
    pressure: Array
    span_s: float
    number: int
    stiff: float
    rng: np.random.Generator


def _as_it_is(amount: float, draws: Draws, signal: Array, at: Surroundings) -> Array:
    return signal


@dataclass(frozen=True)
class Law:
    """One further law. ``act(amount, draws, signal, at)`` is described in the module's docstring by its ``place``.

    ``typical`` is an amount that leaves about 1 % of full scale, ``largest`` the largest possible one. ``bends`` is
    what a departure warps: "signal" or "time"; None where a departure has no meaning (noise, faults of the data).
    """

    name: str
    place: Place
    says: str
    source: str
    act: Callable[[float, Draws, Array, Surroundings], Array]
    typical: float
    largest: float
    draw: Drawing = lambda rng, subject: {}
    bends: Literal["signal", "time"] | None = "signal"
    options: Callable[[float, Draws, Subject], Options] | None = None

    @classmethod
    def of_options(
        cls,
        name: str,
        says: str,
        source: str,
        options: Callable[[float, Draws, Subject], Options],
        typical: float,
        largest: float,
        draw: Drawing,
    ) -> Law:
        """A law that the machine's own options switch on, like the first one."""
        return cls(name, "options", says, source, _as_it_is, typical, largest, draw, None, options)


@dataclass(frozen=True)
class Warp:
    """A smooth monotone map of [0, 1] onto itself, continued by a shift: x + size sum_k w_k sin(k pi x)/(k pi)."""

    size: float = 0.0
    weights: tuple[float, ...] = field(default=())

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Warp:
        """A random warp of size 1 whose slope stays positive: the weights' absolute values sum to one."""
        weights = rng.standard_normal(BUMPS) / np.arange(1, BUMPS + 1)
        return cls(1.0, tuple(float(w) for w in 0.95 * weights / np.abs(weights).sum()))

    def of(self, x: Array) -> Array:
        """The map's values (n,) at x (n,)."""
        if self.size == 0.0 or not self.weights:
            return x
        place = np.pi * np.clip(x, 0.0, 1.0)
        bumps = sum(w * np.sin(k * place) / (k * np.pi) for k, w in enumerate(self.weights, start=1))
        return np.asarray(x + self.size * bumps)
