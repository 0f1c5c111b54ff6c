"""State recursions of a linear filter: even steps by exact matrices, uneven ones by the exponential's action.

A state consists of two blocks of n, of which the second drives the first but not the other way round: ``[second-order
chain, first-order chain]``; see `smartshoe.identification.transfer_function._discrete`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

TAYLOR_TERMS = 18  # of the exponential's action on a vector at norm 1: the first omitted term is below 1e-17


@njit(cache=True)
def run_even(columns, taps, u, first, start, blocks, out):  # type: ignore[no-untyped-def]
    """States (count, m) of ``s[k+1] = columns.T s[k] + sum_j taps[j] u[first + k + j]`` from ``start`` into ``out``.

    ``columns`` (m, m) is the transposed transition matrix, ``taps`` (taps, m); ``u`` is padded so that every index
    exists (or empty: no input). ``blocks``: the size of the leading block, which does not act on the rest (0: dense).
    """
    count, m = out.shape
    state = start.copy()
    fresh = np.empty(m)
    driven = u.size > 0
    for k in range(count):
        for i in range(m):
            out[k, i] = state[i]
            fresh[i] = 0.0
        if driven:
            for j in range(taps.shape[0]):
                now = u[first + k + j]
                for i in range(m):
                    fresh[i] += taps[j, i] * now
        for j in range(blocks):
            now = state[j]
            for i in range(blocks):
                fresh[i] += columns[j, i] * now
        for j in range(blocks, m):
            now = state[j]
            for i in range(m):
                fresh[i] += columns[j, i] * now
        for i in range(m):
            state[i] = fresh[i]


@njit(cache=True)
def _step(matrix, h, state, term, after):  # type: ignore[no-untyped-def]
    """Multiply ``state`` by the exponential of ``matrix`` h in place, by its Taylor series.

    The others are work space.
    """
    size = state.size
    for i in range(size):
        term[i] = state[i]
    for order in range(1, TAYLOR_TERMS):
        for i in range(size):
            after[i] = 0.0
        for j in range(size):
            weight = term[j] * (h / order)
            if weight != 0.0:
                for i in range(size):
                    after[i] += matrix[i, j] * weight
        largest = 0.0
        for i in range(size):
            term[i] = after[i]
            state[i] += after[i]
            largest = max(largest, abs(after[i]))
        if largest == 0.0:
            break


@njit(cache=True)
def run_uneven(  # type: ignore[no-untyped-def]
    matrix, norm, t, knots, u, hold, start, slack, out, value, slope
):
    """States (count, m) at the times ``t`` of ``d/dt s = matrix[:m, :m] s + matrix[:m, m] input`` into ``out``.

    The input has the values ``u`` at the increasing times ``knots`` (linear between them where ``hold`` is 1, steps
    where it is 0; constant beyond the ends). ``matrix`` (m + 2, m + 2) includes input and slope as two last states,
    ``norm`` is its 1-norm over the states. A knot less than ``slack`` after a time counts as being at it. ``value`` and
    ``slope`` (count,) receive the input at ``t``.
    """
    count, m = out.shape
    size = m + 2
    state = np.zeros(size)
    for i in range(m):  # a slice that is assigned takes seconds more to compile
        state[i] = start[i]
    term = np.empty(size)
    after = np.empty(size)
    n = u.size
    at = -1  # index of the last knot up to now
    while at + 1 < n and knots[at + 1] <= t[0] + slack:
        at += 1
    for k in range(count):
        now = t[k]
        if k > 0:
            here = t[k - 1]
            while here < now:
                ends = now
                if at + 1 < n and knots[at + 1] < now - slack:
                    ends = knots[at + 1]
                length = ends - here
                if n > 0:
                    state[m], state[m + 1] = _input(knots, u, hold, at, here)
                pieces = int(np.ceil(norm * length))
                if pieces < 1:
                    pieces = 1
                for _ in range(pieces):
                    _step(matrix, length / pieces, state, term, after)
                here = ends
                while at + 1 < n and knots[at + 1] <= here + slack:
                    at += 1
        if n > 0:
            value[k], slope[k] = _input(knots, u, hold, at, now)
        for i in range(m):
            out[k, i] = state[i]


@njit(cache=True)
def _input(knots, u, hold, at, now):  # type: ignore[no-untyped-def]
    n = u.size
    if at < 0:
        return u[0], 0.0
    if hold == 0 or at + 1 >= n:
        return u[at], 0.0
    rise = (u[at + 1] - u[at]) / (knots[at + 1] - knots[at])
    return u[at] + rise * (now - knots[at]), rise
