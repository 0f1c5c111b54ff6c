"""What effects of wall and contact share: the load without its noise, and inverses that run in a kernel."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import ChainContext, Conditions, CStep, Effect, Inverse

LEAST_DEAD_ZONE = 1e-3  # of full scale
SIGMAS = 4.0
SETTLED = 1e-15  # of full scale: an inverse with memory ends when a round moves a sample by no more
NO_LOAD = 1e30  # as in `smartshoe.kernels.memory`: before the first sample


def dead_zone(conditions: Conditions) -> float:
    """Half of the largest swing of load, a share of full scale, that memory takes for noise and for no reversal."""
    return beyond_noise(conditions.load_noise)


def beyond_noise(sd: float) -> float:
    """`dead_zone` for a signal whose noise has the standard deviation ``sd``, a share of full scale."""
    return max(LEAST_DEAD_ZONE, SIGMAS * sd)


def cleaned(load: Array, half_width: float) -> Array:
    """The ``load`` (n,) through a play, without reversals smaller than twice ``half_width``."""
    from smartshoe.kernels.memory import backlash

    out = np.empty(load.size)
    backlash(np.ascontiguousarray(load), half_width, np.array([NO_LOAD]), out)
    return out


def cleaned_load(conditions: Conditions) -> Array:
    """The measured load (n,) through a play as wide as its noise; computed once."""
    found = conditions.cache.get("cleaned_load")
    if found is None:
        found = conditions.cache["cleaned_load"] = cleaned(conditions.load, dead_zone(conditions))
    return found


class Remembering(Effect):
    """An effect that remembers reversals of the load but not swings within its noise, and so does its inverse."""

    @abstractmethod
    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """The streaming inverse, which takes no swing within twice ``dead_zone`` for a reversal."""

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse:
        """`inverse` with a dead zone that is clear of the noise in the ``chain``."""
        return self.inverse(values, step_s, beyond_noise(chain.noise))


@dataclass(eq=False)
class Undone(Inverse):
    """An inverse with memory: ``kernel(signal, *constants, state, out)`` fills ``out`` (n,) and moves ``state`` on.

    ``body`` gives the same step in C for given identifiers; ``members`` names the states in the order of ``start``.
    """

    kernel: Callable[..., None]
    constants: tuple[object, ...]
    start: Array
    members: tuple[str, ...]
    body: Callable[[Mapping[str, str]], str]

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Back to the session's beginning."""
        self.state = self.start.copy()

    def push(self, signal: Array, time_s: Array) -> Array:
        """The block's input (n,); the state carries on from one call to the next."""
        out = np.empty(signal.size)
        self.kernel(np.ascontiguousarray(signal, dtype=float), *self.constants, self.state, out)
        return out

    def c_step(self, name: str) -> CStep:
        """The kernel's step in C, its search for a root included."""
        names = {member: f"f->{name}_{member}" for member in self.members}
        states = {f"{name}_{member}": float(value) for member, value in zip(self.members, self.start, strict=True)}
        return CStep(states, self.body(names))
