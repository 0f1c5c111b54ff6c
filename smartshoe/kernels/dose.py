"""Inverse of effects that grow with the dose of load (sets, gains), while recovering the load that caused them."""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import NO_LOAD


@njit(cache=True)
def set_undone(signal, half, exponent, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out + set = ``signal`` (n,); per step, set += half (out^m + last out^m), with out^m = 0 below zero.

    ``state`` (2,): set, last out^m (negative before the first sample).
    """
    total, last = state
    for k in range(signal.size):
        p = signal[k]
        if last >= 0.0:
            known = p - total - half * last
            p = known
            for _ in range(12):  # converges, as half is far below 1
                p = known - half * max(p, 0.0) ** exponent
            total = signal[k] - p
        last = max(p, 0.0) ** exponent
        out[k] = p
    state[0], state[1] = total, last


@njit(cache=True)
def dose_undone(signal, is_gain, size, early, held, by_stroke, exponent, width, rounds, settled, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out + g = ``signal`` (n,), or out (1 + g) where ``is_gain``; g = size early log(1 + X/early).

    Per step, the dose X grows by ``held`` times the sum of two flows p^m, and while the play of ``width`` rises by
    ``by_stroke`` times the rise of its z^m; all are zero below zero. Each sample is iterated for at most ``rounds``,
    until it changes by no more than ``settled``. ``state`` (3,): X, last flow, play (NO_LOAD before the first).
    """
    total, last, place = state
    for k in range(signal.size):
        p = signal[k]
        flow = max(p, 0.0) ** exponent
        if place < NO_LOAD:
            low = max(place, 0.0)
            begun, more = low**exponent, 0.0
            for _ in range(rounds):  # converges, as g changes by less than out does
                guess = p
                flow = max(p, 0.0) ** exponent
                more = held * (last + flow)
                if p - width > low:
                    more += by_stroke * ((p - width) ** exponent - begun)
                grown = size * early * math.log(1.0 + (total + more) * (1.0 / early))
                p = signal[k] / (1.0 + grown) if is_gain else signal[k] - grown
                if abs(p - guess) <= settled:
                    break
            total += more
            place = min(max(place, p - width), p + width)
        else:
            place = p
        last = flow
        out[k] = p
    state[0], state[1], state[2] = total, last, place
