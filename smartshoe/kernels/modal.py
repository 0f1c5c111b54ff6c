"""A linear network in modal form, for loads linear between samples; the plain twin is `smartshoe.models.core.plain`."""

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
    if 0 < modes <= 2:  # the most common case: keeping states in registers takes half the time
        j = modes - 1  # with a single mode, the second is the same with zero weight
        e, b, a, w, m = decay[0], before[0], after[0], weights[0], state[0]
        e2, b2, a2, w2, m2 = decay[j], before[j], after[j], j * weights[j], state[j]
        out[0] = direct * last + w * m + w2 * m2
        for k in range(1, u.size):
            now = u[k]
            m = e * m + (b * last + a * now)
            m2 = e2 * m2 + (b2 * last + a2 * now)
            out[k] = direct * now + w * m + w2 * m2
            last = now
        state[0], state[j] = m, m2
        return
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
