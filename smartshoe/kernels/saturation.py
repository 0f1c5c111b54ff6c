"""Inverse of an end of a sensor's range that leaves enough slope; the plain twin is in the effect of the same name."""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import SOLVED, STEPS, closer


@njit(cache=True)
def saturation_undone(signal, lost, level, knee, at_zero, rail, corner, least_below, out):  # type: ignore[no-untyped-def]
    """out (n,) whose reading by `Saturation` is ``signal`` (n,).

    ``lost``, ``level``, ``knee`` and ``rail`` are the effect's parameters, ``at_zero`` the logarithm that makes it 0 at
    0, ``corner`` the width of the rail's; ``least_below`` is the least slope below zero, that above is 1 - ``lost``.
    """
    for k in range(signal.size):
        y = signal[k]
        low, high = (y, y / (1.0 - lost)) if y > 0.0 else (y / least_below, y)
        p, under, over, stays = low, 0.0, 0.0, 0
        for i in range(STEPS):
            past, below = p - level, max(-p, 0.0)
            above = max(past, 0.0) + knee * (math.log1p(math.exp(-abs(past) / knee)) - at_zero)
            inside = min(below, corner)
            left = p - y - lost * above + rail * (inside * inside / (2.0 * corner) + below - inside)
            if abs(left) <= SOLVED:
                break
            p, low, high, under, over, stays = closer(i, p, left, low, high, under, over, stays)
        out[k] = p
