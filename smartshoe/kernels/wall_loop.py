"""Nonlinear springs beside a relaxing arm: the balance of both, sample by sample.

f = phi(u) + kappa (u - q), q' = a (u - q), u the deformation. All begin in the steady state of the first load, where
the arm bears nothing. ``share`` is kappa; q is u through `models.first_order.lag`, whose coefficients are ``decay``,
``now`` and ``before``, so that within a sample the arm acts as a linear spring with a shifted end.
"""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import EASED, first_loading, newton, rise, softness

CLOSE = 1e-8  # of full scale: after a smaller Newton step the error is about its square
ALIKE = 0.05  # in its logarithm: a curvature that changes by less over a step counts as constant
STEPS = 30


@njit(cache=True)
def inflection(cubic, fifth):  # type: ignore[no-untyped-def]
    """u at which (u + cubic u^3 + fifth u^5)/(1 + cubic + fifth) is steepest, and its slope.

    Infinity and 0 where there is no such u.
    """
    if fifth >= 0.0:
        return math.inf, 0.0
    square = -0.3 * cubic / fifth
    return math.sqrt(square), (1.0 + square * (3.0 * cubic + 5.0 * fifth * square)) / (1.0 + cubic + fifth)


@njit(cache=True)
def hardened(load, cubic, fifth, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (n,) = u + kappa (u - q) under ``load`` (n,), phi = (u + cubic u^3 + fifth u^5)/(1 + cubic + fifth).

    Beyond its `inflection` phi is its tangent.
    """
    whole = 1.0 + cubic + fifth
    end, steepest = inflection(cubic, fifth)
    arm = held = 0.0
    u, q, known, slope = 0.0, 0.0, 0.0, 1.0 / whole
    for k in range(load.size):
        last, f = u, load[k] + held
        u += (f - known) / slope  # the first guess follows the load
        for _ in range(STEPS):
            within = min(max(u, -end), end)
            square = within * within
            slope = (1.0 + square * (3.0 * cubic + 5.0 * fifth * square)) / whole + arm
            beyond = (steepest + arm) * (u - within)
            step = (f - within * ((1.0 + square * (cubic + fifth * square)) / whole + arm) - beyond) / slope
            u += step
            if abs(step) <= CLOSE:
                break
        q = decay * q + now * u + before * last if k else u
        out[k] = u + share * (u - q)
        arm, known = share * (1.0 - now), f
        held = share * (decay * q + before * u)


@njit(cache=True)
def compressed(load, ratio, wall, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (n,) = p under ``load`` (n,), phi = p (1 + wall/(1 + g p))/whole and u = (1 + g) p/(1 + g p).

    ``ratio`` is g, whole = 1 + wall/(1 + g). Multiplied by 1 + g p the balance is quadratic in p; its other root has a
    negative absolute pressure.
    """
    whole = 1.0 + wall / (1.0 + ratio)
    bend = ratio / whole
    arm = held = u = q = 0.0
    for k in range(load.size):
        last, f = u, load[k] + held
        half = 0.5 * ((1.0 + wall) / whole + arm * (1.0 + ratio) - ratio * f)
        root = math.sqrt(max(half * half + bend * f, 0.0))
        p = f / (half + root) if half > 0.0 else (root - half) / bend
        u = (1.0 + ratio) * p / (1.0 + ratio * p)
        q = decay * q + now * u + before * last if k else u
        out[k] = p
        arm = share * (1.0 - now)
        held = share * (decay * q + before * u)


@njit(cache=True)
def softened(load, strength, width, widening, raised, power, largest, dead_zone, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (n,) = u + kappa (u - q) under ``load`` (n,), phi r(M) = u (1 - strength softness(M^2 r(M)^2 - u^2)).

    `softness` of ``power``, wide = ``width`` + ``widening`` M^2; M is the largest phi so far, ``largest`` before the
    record, and counts less ``dead_zone``; r is `rise`.
    """
    arm = held = 0.0
    u, q, phi, known, slope, corner = 0.0, 0.0, 0.0, 0.0, 1.0, EASED**power
    most, more, per_wide, top = 0.0, 1.0, 1.0 / width, 0.0
    for k in range(load.size):
        last, f = u, load[k] + held
        reached = max(largest - dead_zone, 0.0)
        if reached != most:
            most, more = reached, rise(reached, raised, width)
            per_wide, top = 1.0 / (width + widening * reached * reached), (most * more) ** 2
        if f >= most * (1.0 + arm * more):
            phi, slope = first_loading(f, raised, width, 1.0, arm, phi)
            u = phi * rise(phi, raised, width)
        elif not k or f != known:  # during a pause the value stays the same, to the last digit
            # The balance increases with u: Newton from the extrapolated last output, kept in a bracket.
            given, beside = f * more, arm * more
            straight = given / (1.0 + beside)
            low, high = straight, most * more
            if f <= 0.0:
                lost = min(strength * softness(top * per_wide, power, corner)[0], 0.95)  # more would leave no stiffness
                low, high = given / (1.0 - lost + beside), straight
            u, moved = min(max(u + (f - known) / slope, low), high), math.inf
            for _ in range(STEPS):
                bend, steep, falls = softness(max(top - u * u, 0.0) * per_wide, power, corner)
                slope = 1.0 - strength * bend + beside
                off, turn, turns = u * slope - given, u * u * per_wide, 0.0
                if bend > 0.0:
                    slope += 2.0 * strength * turn * steep
                    turns = strength * per_wide * steep * abs(u) * (3.0 + 2.0 * turn * falls)
                was = u
                u, low, high, step = newton(u, off, slope, low, high)
                if abs(step) > 0.5 * moved:  # oscillating across the corner
                    u, step = 0.5 * (low + high), math.inf
                moved = abs(step)
                # After a step the error is its square times half the curvature, if that is constant over the step.
                # The curvature beyond the corner does not tell the one before it.
                if abs(step) <= CLOSE:
                    break
                if bend > 0.0 and turns * step * step <= 5e-11 * slope and abs(was * step) * per_wide * falls <= ALIKE:
                    break
            slope /= more
        largest = max(largest, f - arm * u)
        q = decay * q + now * u + before * last if k else u
        out[k] = u + share * (u - q)
        arm, known = share * (1.0 - now), f
        held = share * (decay * q + before * u)
