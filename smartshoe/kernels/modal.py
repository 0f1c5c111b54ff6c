"""A linear network in modal form, straight lines between samples; the plain twin is `smartshoe.models.core.plain`."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def respond(u, decay, before, after, weights, direct, state, out):  # type: ignore[no-untyped-def]
    """out_k = direct u_k + weights . m_k, m_k = decay m_(k-1) + before u_(k-1) + after u_k, into ``out`` (n,).

    ``decay``, ``before``, ``after``, ``weights`` (p,); ``state`` (p,) holds m at the first sample, and at the last on
    return.
    """
    modes = decay.size
    last = u[0]
    for k in range(u.size):
        now = u[k]
        value = direct * now
        if k > 0:
            for i in range(modes):
                state[i] = decay[i] * state[i] + before[i] * last + after[i] * now
        for i in range(modes):
            value += weights[i] * state[i]
        out[k] = value
        last = now
