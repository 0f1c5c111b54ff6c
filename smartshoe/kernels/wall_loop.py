"""Springs that bend beside the arm that relaxes: the balance of both, sample by sample.

f = phi(u) + kappa (u - q), q' = a (u - q), u the deformation: all begin in the steady state of the first load, where
the arm bears nothing. ``share`` is kappa; q is u through `models.first_order.lag`, whose coefficients are ``decay``,
``now`` and ``before``, so that within a sample the arm is a straight spring that is held elsewhere. A step waits for
the one before it: those of several loads, side by side, fill that time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from smartshoe.kernels.memory import EASED, first_loading, newton, rise, softness

CLOSE = 1e-8  # of full scale: a step of Newton's that is less leaves about its square
ALIKE = 0.05  # of its logarithm: over a step that turns a curvature by less it is the same
STEPS = 30


@njit(cache=True)
def hardened(loads, cubic, fifth, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (m, n) = u + kappa (u - q) under ``loads`` (m, n), phi = (u + cubic u^3 + fifth u^5)/(1 + cubic + fifth)."""
    whole, count = 1.0 + cubic + fifth, loads.shape[0]
    arm, held, bent, relaxed = 0.0, np.zeros(count), np.zeros(count), np.zeros(count)
    known, slopes = np.zeros(count), np.full(count, 1.0 / whole)
    for k in range(loads.shape[1]):
        for i in range(count):
            last, f, slope = bent[i], loads[i, k] + held[i], slopes[i]
            u = last + (f - known[i]) / slope  # moved along with the load
            for _ in range(STEPS):
                square = u * u
                slope = (1.0 + square * (3.0 * cubic + 5.0 * fifth * square)) / whole + arm
                step = (f - u * ((1.0 + square * (cubic + fifth * square)) / whole + arm)) / slope
                u += step
                if abs(step) <= CLOSE:
                    break
            q = decay * relaxed[i] + now * u + before * last if k else u
            out[i, k] = u + share * (u - q)
            held[i] = share * (decay * q + before * u)
            bent[i], relaxed[i], known[i], slopes[i] = u, q, f, slope
        arm = share * (1.0 - now)


@njit(cache=True)
def compressed(loads, ratio, wall, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (m, n) = p under ``loads`` (m, n), phi = p (1 + wall/(1 + g p))/whole and u = (1 + g) p/(1 + g p).

    ``ratio`` is g, whole = 1 + wall/(1 + g). Times 1 + g p the balance is quadratic in p; its other root is a gas of
    less than no absolute pressure.
    """
    whole = 1.0 + wall / (1.0 + ratio)
    bend = ratio / whole
    arm = 0.0
    held, bent, relaxed = np.zeros(loads.shape[0]), np.zeros(loads.shape[0]), np.zeros(loads.shape[0])
    for k in range(loads.shape[1]):
        for i in range(loads.shape[0]):
            last, f = bent[i], loads[i, k] + held[i]
            half = 0.5 * ((1.0 + wall) / whole + arm * (1.0 + ratio) - ratio * f)
            root = math.sqrt(max(half * half + bend * f, 0.0))
            p = f / (half + root) if half > 0.0 else (root - half) / bend
            u = (1.0 + ratio) * p / (1.0 + ratio * p)
            q = decay * relaxed[i] + now * u + before * last if k else u
            out[i, k] = p
            held[i] = share * (decay * q + before * u)
            bent[i], relaxed[i] = u, q
        arm = share * (1.0 - now)


@njit(cache=True)
def softened(loads, strength, width, widening, raised, power, before_it, dead_zone, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (m, n) = u + kappa (u - q) under ``loads`` (m, n), phi r(M) = u (1 - strength softness(M^2 r(M)^2 - u^2)).

    `softness` of ``power``, wide = ``width`` + ``widening`` M^2; M is the largest phi so far, ``before_it`` before the
    record, and counts less ``dead_zone``; r is `rise`.
    """
    count, corner = loads.shape[0], EASED**power
    arm, held = 0.0, np.zeros(count)
    bent, relaxed, known, slopes = np.zeros(count), np.zeros(count), np.zeros(count), np.ones(count)
    virgin, largest, most, more = np.zeros(count), np.full(count, before_it), np.zeros(count), np.ones(count)
    per_wide, top = np.full(count, 1.0 / width), np.zeros(count)
    for k in range(loads.shape[1]):
        for i in range(count):
            last, f, u, slope = bent[i], loads[i, k] + held[i], bent[i], slopes[i]
            reached = max(largest[i] - dead_zone, 0.0)
            if reached != most[i]:
                most[i], more[i] = reached, rise(reached, raised, width)
                per_wide[i], top[i] = 1.0 / (width + widening * reached * reached), (reached * more[i]) ** 2
            if f >= most[i] * (1.0 + arm * more[i]):
                virgin[i], slope = first_loading(f, raised, width, 1.0, arm, virgin[i])
                u = virgin[i] * rise(virgin[i], raised, width)
            elif not k or f != known[i]:  # a pause leaves it where it is, to the last digit
                moved = (f - known[i]) / slope
                u, slope = _softer(f, u + moved, strength, power, corner, arm, most[i], more[i], per_wide[i], top[i])
            largest[i] = max(largest[i], f - arm * u)
            q = decay * relaxed[i] + now * u + before * last if k else u
            out[i, k] = u + share * (u - q)
            held[i] = share * (decay * q + before * u)
            bent[i], relaxed[i], known[i], slopes[i] = u, q, f, slope
        arm = share * (1.0 - now)


@njit(cache=True)
def _softer(f, u, strength, power, corner, arm, most, more, per_wide, top):  # type: ignore[no-untyped-def]
    """Deformation under ``f`` below the largest load, and the load's slope in it; see `softened`.

    The load rises with it: Newton from ``u``, held in a bracket.
    """
    given, beside = f * more, arm * more
    straight = given / (1.0 + beside)
    low, high = straight, most * more
    if f <= 0.0:
        lost = min(strength * softness(top * per_wide, power, corner)[0], 0.95)  # more leaves nothing to pull
        low, high = given / (1.0 - lost + beside), straight
    u, moved, slope = min(max(u, low), high), math.inf, 1.0
    for _ in range(STEPS):
        bend, steep, falls = softness(max(top - u * u, 0.0) * per_wide, power, corner)
        slope = 1.0 - strength * bend + beside
        off, turn, turns = u * slope - given, u * u * per_wide, 0.0
        if bend > 0.0:
            slope += 2.0 * strength * turn * steep
            turns = strength * per_wide * steep * abs(u) * (3.0 + 2.0 * turn * falls)
        was = u
        u, low, high, step = newton(u, off, slope, low, high)
        if abs(step) > 0.5 * moved:  # to and fro across the corner
            u, step = 0.5 * (low + high), math.inf
        moved = abs(step)
        # A step leaves an error of its square times half the curvature where that is the same all along it.
        # Beyond the corner nothing tells what the curvature is before it.
        if abs(step) <= CLOSE:
            break
        if bend > 0.0 and turns * step * step <= 5e-11 * slope and abs(was * step) * per_wide * falls <= ALIKE:
            break
    return u, slope / more
