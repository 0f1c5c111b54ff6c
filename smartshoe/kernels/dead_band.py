"""Inverse of gaps that a load closes first; the plain twin is `smartshoe.models.effects.dead_band`."""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import SOLVED, STEPS, closer


@njit(cache=True)
def dead_band_undone(signal, lost, soft, onset, sets_in_over, begins, whole, late, most, out):  # type: ignore[no-untyped-def]
    """out (n,) with out - lost m(out/lost) = ``signal`` (n,), m as in `DeadBand`; samples not above zero are unchanged.

    ``begins``, ``whole`` and ``late`` are m's constants; ``sets_in_over`` is its onset or a tiny number; ``most`` is an
    upper bound of the lost load.
    """
    for k in range(signal.size):
        y = signal[k]
        if y <= 0.0:
            out[k] = y
            continue
        f, low, high, under, over, stays = y, y, y + most, 0.0, 0.0, 0
        for i in range(STEPS):
            z = f / lost
            x = (1.0 + onset - z) / soft
            rounded = max(x, 0.0) + math.log1p(math.exp(-abs(x)))
            left = f - y - lost / whole * (begins - soft * rounded + late * math.expm1(-z / sets_in_over))
            if abs(left) <= SOLVED:
                break
            f, low, high, under, over, stays = closer(i, f, left, low, high, under, over, stays)
        out[k] = f
