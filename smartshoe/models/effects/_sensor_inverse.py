"""Inverses of blocks without memory, and how their constants are written in C."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CStep, Inverse


def c_number(value: float) -> str:
    """``value`` as a C double that reads back to the same bits; in brackets where it is negative."""
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


@dataclass(frozen=True, eq=False)
class Memoryless(Inverse):
    """``undo`` turns a signal (n,) at times (n,) in s; ``body`` is the same in C, for the doubles x and t."""

    undo: Callable[[Array, Array], Array]
    body: str

    def push(self, signal: Array, time_s: Array) -> Array:
        """The block's input (n,), each sample by itself."""
        return self.undo(signal, time_s)

    def until(self, last_s: float) -> Memoryless:
        """The same by a clock that stands still from ``last_s`` on."""
        return Memoryless(
            lambda signal, time_s: self.undo(signal, np.minimum(time_s, last_s)),
            re.sub(r"\bt\b", f"fmin(t, {c_number(last_s)})", self.body),
        )

    def c_step(self, name: str) -> CStep:
        """The body; nothing is kept from one sample to the next, so ``name`` is not needed."""
        return CStep({}, self.body)
