"""What the effects of wall and contact share: a load cleaned of noise, and inverses that run in a kernel."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import ChainContext, Conditions, CStep, Effect, Inverse

LEAST_DEAD_ZONE = 1e-3  # of full scale
SIGMAS = 4.0
SETTLED = 1e-15  # of full scale: what a round of an inverse with memory may still move a sample by
NO_LOAD = 1e30  # as in `smartshoe.kernels.memory`: before the first sample


def dead_zone(conditions: Conditions) -> float:
    """Half the swing of load that memory must not take for a reversal, a share of full scale."""
    return beyond_noise(conditions.load_noise)


def beyond_noise(sd: float) -> float:
    """The same of a signal whose noise has this standard deviation, a share of full scale."""
    return max(LEAST_DEAD_ZONE, SIGMAS * sd)


def cleaned(load: Array, half_width: float) -> Array:
    """The load (n,) through a play: reversals smaller than twice ``half_width`` are gone."""
    from smartshoe.kernels.memory import backlash

    out = np.empty(load.size)
    backlash(np.ascontiguousarray(load), half_width, np.array([NO_LOAD]), out)
    return out


def cleaned_load(conditions: Conditions) -> Array:
    """The measured load (n,) through a play of the noise's width; computed once."""
    found = conditions.cache.get("cleaned_load")
    if found is None:
        found = conditions.cache["cleaned_load"] = cleaned(conditions.load, dead_zone(conditions))
    return found


class Remembering(Effect):
    """An effect that remembers the load as it is seen through a dead zone; so does its inverse, through the chain's."""

    @abstractmethod
    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """The streaming inverse, which takes no swing within twice ``dead_zone`` for a reversal."""

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse:
        """The same, of what is clear of the chain's noise."""
        return self.inverse(values, step_s, beyond_noise(chain.noise))


@dataclass(eq=False)
class Undone(Inverse):
    """An inverse with memory: ``kernel(signal, *constants, state, out)`` fills ``out`` and moves ``state`` on.

    ``body`` turns a name for identifiers into the same in C; ``members`` names the states in the order of ``start``.
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
        """What went into the block (n,); the state carries on."""
        out = np.empty(signal.size)
        self.kernel(np.ascontiguousarray(signal, dtype=float), *self.constants, self.state, out)
        return out

    def c_step(self, name: str) -> CStep:
        """The kernel's step, its search for a root included."""
        names = {member: f"f->{name}_{member}" for member in self.members}
        states = {f"{name}_{member}": float(value) for member, value in zip(self.members, self.start, strict=True)}
        return CStep(states, self.body(names))
