"""One pass over an experiment: error and gradient of the first-order model, stored only as their inner products.

The slow twin, which the tests compare with, is `smartshoe.identification._prediction_error`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

CHUNK = 256  # samples whose columns stay in the first-level cache
COLUMNS = 7  # d/d ln alpha, d/d p1, d/d p2, d/d delay, d/d offset, d/d start, error
FADED = 1e-30  # of an initial state: set to 0 below this, before slow subnormal numbers arise
_LAX = {"reassoc", "contract", "nsz"}  # sums may be reordered; NaN is still handled
_SMALL = 1e-3


@njit(cache=True)
def hold(alpha, step):  # type: ignore[no-untyped-def]
    """E, A, B of `models.first_order.hold_coefficients` at ``alpha`` in 1/s, and their derivatives over alpha."""
    x = alpha * step
    decay, fall = math.exp(-x), math.expm1(-x)
    if x > _SMALL:
        now = 1.0 + fall / x
        slope = (decay + fall / x) / x
    else:
        now = x * (1 / 2 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        slope = -1 / 2 + x * (1 / 3 - x * (1 / 8 - x * (1 / 30 - x / 144)))
    return decay, now, -fall - now, -step * decay, -step * slope, step * (slope + decay)


@njit(cache=True, fastmath=_LAX)
def recur(E, dE, w, v, s, lag, drift, slow, m):  # type: ignore[no-untyped-def]
    """w_j = E w_(j-1) + lag_j, v_j = E v_(j-1) + dE w_(j-1) + drift_j, s_j = E s_(j-1) + slow_j for ``m`` samples.

    The results replace the drives. Four samples are handled at a time, so that they need not wait for each other.
    """
    E2 = E * E
    E3, E4 = E2 * E, E2 * E2
    whole = m // 4 * 4
    for j in range(0, whole, 4):
        a0 = lag[j]
        a1 = E * a0 + lag[j + 1]
        a2 = E * a1 + lag[j + 2]
        a3 = E * a2 + lag[j + 3]
        c0 = slow[j]
        c1 = E * c0 + slow[j + 1]
        c2 = E * c1 + slow[j + 2]
        c3 = E * c2 + slow[j + 3]
        w0, w1, w2, w3 = E * w + a0, E2 * w + a1, E3 * w + a2, E4 * w + a3
        b0 = drift[j] + dE * w
        b1 = E * b0 + (drift[j + 1] + dE * w0)
        b2 = E * b1 + (drift[j + 2] + dE * w1)
        b3 = E * b2 + (drift[j + 3] + dE * w2)
        drift[j], drift[j + 1], drift[j + 2] = E * v + b0, E2 * v + b1, E3 * v + b2
        lag[j], lag[j + 1], lag[j + 2], lag[j + 3] = w0, w1, w2, w3
        slow[j], slow[j + 1], slow[j + 2] = E * s + c0, E2 * s + c1, E3 * s + c2
        w, v, s = w3, E4 * v + b3, E4 * s + c3
        drift[j + 3], slow[j + 3] = v, s
    for j in range(whole, m):
        v = E * v + dE * w + drift[j]
        w = E * w + lag[j]
        s = E * s + slow[j]
        lag[j], drift[j], slow[j] = w, v, s
    return w, v, s


@njit(cache=True, fastmath=_LAX)
def add_products(columns, m, out):  # type: ignore[no-untyped-def]
    """Add the inner products of the first ``m`` samples of ``columns`` to ``out`` (COLUMNS, COLUMNS).

    Written out, since 28 sums fit in registers: each sample is read once, four times as fast as by pairs.
    """
    a, b, c, d = columns[0], columns[1], columns[2], columns[3]
    e, f, g = columns[4], columns[5], columns[6]
    aa = ab = ac = ad = ae = af = ag = 0.0
    bb = bc = bd = be = bf = bg = 0.0
    cc = cd = ce = cf = cg = 0.0
    dd = de = df = dg = 0.0
    ee = ef = eg = 0.0
    ff = fg = gg = 0.0
    for j in range(m):
        p, q, r, s, t, u, v = a[j], b[j], c[j], d[j], e[j], f[j], g[j]
        aa, ab, ac, ad, ae, af, ag = aa + p * p, ab + p * q, ac + p * r, ad + p * s, ae + p * t, af + p * u, ag + p * v
        bb, bc, bd, be, bf, bg = bb + q * q, bc + q * r, bd + q * s, be + q * t, bf + q * u, bg + q * v
        cc, cd, ce, cf, cg = cc + r * r, cd + r * s, ce + r * t, cf + r * u, cg + r * v
        dd, de, df, dg = dd + s * s, de + s * t, df + s * u, dg + s * v
        ee, ef, eg = ee + t * t, ef + t * u, eg + t * v
        ff, fg, gg = ff + u * u, fg + u * v, gg + v * v
    sums = (
        aa, ab, ac, ad, ae, af, ag, bb, bc, bd, be, bf, bg, cc, cd, ce, cf, cg, dd, de, df, dg, ee, ef, eg, ff, fg, gg
    )  # fmt: skip
    at = 0
    for i in range(COLUMNS):
        for k in range(i, COLUMNS):
            out[i, k] += sums[at]
            out[k, i] = out[i, k]
            at += 1


@njit(cache=True)
def copy(values, at, m, out):  # type: ignore[no-untyped-def]
    """Copy ``m`` of ``values`` from ``at`` on into ``out``; numba takes two seconds to compile a slice assignment."""
    for j in range(m):
        out[j] = values[at + j]


@njit(cache=True, fastmath=_LAX)
def leave_out(counted, columns, m):  # type: ignore[no-untyped-def]
    """Set the first ``m`` of ``columns`` (COLUMNS, CHUNK) to 0 where ``counted`` (m or more,) is False."""
    counts = 0
    for j in range(m):
        counts += counted[j]
    for j in range(m if counts < m else 0):
        if not counted[j]:
            for i in range(COLUMNS):
                columns[i, j] = 0.0


@njit(cache=True, fastmath=_LAX)
def complete(columns, now, now_change, now_s, target, alpha, p1, p2, offset, start, m):  # type: ignore[no-untyped-def]
    """Compute the first ``m`` of gradient and error in ``columns`` from the lags stored there; see `inner_products`."""
    drift, rest, lag, slow = columns[0], columns[1], columns[2], columns[3]
    ones, fading, error = columns[4], columns[5], columns[6]
    drop = p2 - p1
    # One short loop per column: LLVM does not vectorise loops over more than a few arrays.
    for j in range(m):
        drift[j] = alpha * (drop * drift[j] - start * now_s[j] * fading[j])
    for j in range(m):
        ones[j], rest[j] = 1.0, now[j] - lag[j]
    for j in range(m):
        slow[j] = p1 * now_change[j] + drop * slow[j]
    for j in range(m):
        error[j] = p1 * rest[j] + p2 * lag[j] + offset + start * fading[j] - target[j]


@njit(cache=True, fastmath=_LAX)
def inner_products(  # type: ignore[no-untyped-def]
    u, slope, y, counted, step_s, uneven, begin_s, alpha, p1, p2, offset, start, stored, out
):
    """Add the inner products (COLUMNS, COLUMNS) of gradient and error over counted samples to ``out``.

    ``u`` (n,) input, ``slope`` (n,) its derivative with respect to the delay (or size 0), ``y`` (n,) output,
    ``counted`` (n,) bool or size 0 for all, ``step_s`` the even step or the first one, ``uneven`` None or all steps
    (n - 1,) in s, ``begin_s`` the time of the first sample. ``stored`` (COLUMNS, n) receives the columns at every
    sample, counted or not (or has size 0). The delay's column is 0 where there is no slope. The model is
    y = p1 (u - w) + p2 w + offset + start exp(-alpha t) with w = alpha/(s + alpha) u.
    """
    n = u.size
    delayed, masked = slope.size > 0, counted.size > 0
    columns = np.empty((COLUMNS, CHUNK))
    fades, times, now_s = np.empty(CHUNK), np.empty(CHUNK), np.empty(CHUNK)
    inputs, changes = np.zeros(CHUNK + 1), np.zeros(CHUNK + 1)  # the chunk, preceded by the sample before it
    before, now, before_change, now_change = inputs[:CHUNK], inputs[1:], changes[:CHUNK], changes[1:]
    drift, lag, slow, fading = columns[0], columns[2], columns[3], columns[5]
    E, A, B, dE, dA, dB = hold(alpha, step_s)
    fades[0], times[0] = 1.0, 0.0
    for j in range(1, CHUNK):
        fades[j], times[j] = fades[j - 1] * E, j * step_s
    w = v = s = 0.0
    time_s, fade = begin_s, math.exp(-alpha * begin_s)
    for at in range(0, n, CHUNK):
        m = min(CHUNK, n - at)
        copy(u, at, m, now)
        if delayed:
            copy(slope, at, m, now_change)
        if at == 0:  # started in the steady state of the first sample
            inputs[0] = w = now[0]
            changes[0] = s = now_change[0]
        if uneven is None:  # one short loop per column, as in `complete`
            for j in range(m):
                lag[j] = A * now[j] + B * before[j]
                drift[j] = dA * now[j] + dB * before[j]
            for j in range(m):
                slow[j] = A * now_change[j] + B * before_change[j]
            w, v, s = recur(E, dE, w, v, s, lag, drift, slow, m)
            for j in range(m):
                now_s[j] = time_s + times[j]
                fading[j] = fade * fades[j]
            fade *= fades[m - 1] * E
            time_s += m * step_s
        else:
            for j in range(m):
                if at + j > 0:
                    E, A, B, dE, dA, dB = hold(alpha, uneven[at + j - 1])
                    v = E * v + (dE * w + dA * now[j] + dB * before[j])
                    w = E * w + (A * now[j] + B * before[j])
                    s = E * s + (A * now_change[j] + B * before_change[j])
                    fade *= E
                    time_s += uneven[at + j - 1]
                lag[j], drift[j], slow[j], now_s[j], fading[j] = w, v, s, time_s, fade
        if fade < FADED:
            fade = 0.0
        complete(columns, now, now_change, now_s, y[at:], alpha, p1, p2, offset, start, m)
        inputs[0], changes[0] = now[m - 1], now_change[m - 1]
        for i in range(stored.shape[0]):
            for j in range(m):
                stored[i, at + j] = columns[i, j]
        if masked:
            leave_out(counted[at:], columns, m)
        add_products(columns, m, out)


@njit(cache=True, fastmath=_LAX)
def respond(u, step_s, uneven, begin_s, alpha, p1, p2, offset, start, out):  # type: ignore[no-untyped-def]
    """The model's output (n,) alone into ``out``; arguments as those of `inner_products`."""
    n = u.size
    E, A, B, _, _, _ = hold(alpha, step_s)
    lag, none, fading = np.empty(CHUNK), np.zeros(CHUNK), np.empty(CHUNK)
    u_last = w = u[0]
    fade, start = 0.0, start * math.exp(-alpha * begin_s)
    if uneven is None:
        for at in range(0, n, CHUNK):
            m = min(CHUNK, n - at)
            now, here = u[at:], out[at:]
            lag[0], fading[0] = A * now[0] + B * u_last, 1.0 if at == 0 else 0.0
            for j in range(1, m):
                lag[j], fading[j] = A * now[j] + B * now[j - 1], 0.0
            w, _, fade = recur(E, 0.0, w, 0.0, fade if fade > FADED else 0.0, lag, none, fading, m)
            for j in range(m):
                here[j] = p1 * (now[j] - lag[j]) + p2 * lag[j] + offset + start * fading[j]
            u_last = now[m - 1]
    else:
        for k in range(n):
            if k > 0:
                E, A, B, _, _, _ = hold(alpha, uneven[k - 1])
                w = E * w + (A * u[k] + B * u[k - 1])
            fade = 1.0 if k == 0 else E * fade
            out[k] = p1 * (u[k] - w) + p2 * w + offset + start * fade
