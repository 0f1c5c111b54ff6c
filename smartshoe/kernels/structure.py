"""A structure that motion breaks down and time rebuilds, and the inverse of a gain that goes with it."""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import NO_LOAD


@njit(cache=True)
def _next(broken, worn, rebuilt):  # type: ignore[no-untyped-def]
    """The share ``broken`` a sample later: ``worn`` is the rate of what is whole, ``rebuilt`` that of what is not."""
    both = worn + rebuilt
    kept = math.exp(-both)
    return kept * broken + (1.0 - kept) * worn / both


@njit(cache=True)
def broken_down(place, per_loading, rebuilt, out):  # type: ignore[no-untyped-def]
    """out (n,): the share that is broken, b' = (1 - b) per_loading |place'|/2 - b ``rebuilt``, from none on.

    ``place`` (n,) is the load through a play; ``rebuilt``, above 0, is by the sample. Between samples the load moves
    evenly.
    """
    broken = 0.0
    for k in range(place.size):
        if k:
            broken = _next(broken, 0.5 * per_loading * abs(place[k] - place[k - 1]), rebuilt)
        out[k] = broken


@njit(cache=True)
def thinned_undone(signal, strength, per_loading, rebuilt, width, rounds, settled, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out (1 + strength b) = ``signal`` (n,), b as in `broken_down` of out's play of ``width``.

    Each sample is iterated for at most ``rounds``, until it changes by no more than ``settled``. ``state`` (2,): b, and
    the play (NO_LOAD before the first sample).
    """
    broken, place = state
    for k in range(signal.size):
        f = signal[k] / (1.0 + strength * broken)
        z, b = f, broken
        if place < NO_LOAD:
            for _ in range(rounds):  # converges, as the gain changes by less than out does
                guess = f
                z = min(max(place, f - width), f + width)
                b = _next(broken, 0.5 * per_loading * abs(z - place), rebuilt)
                f = signal[k] / (1.0 + strength * b)
                if abs(f - guess) <= settled:
                    break
        place, broken = z, b
        out[k] = f
    state[0], state[1] = broken, place
