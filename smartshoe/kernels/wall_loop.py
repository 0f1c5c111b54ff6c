"""Springs that bend beside the arm that relaxes: the balance of both, sample by sample.

f = phi(u) + kappa (u - q), q' = a (u - q), u the deformation: all begin in the steady state of the first load, where
the arm bears nothing. ``share`` is kappa; q is u through `models.first_order.lag`, whose coefficients are ``decay``,
``now`` and ``before``, so that within a sample the arm is a straight spring that is held elsewhere.
"""

from __future__ import annotations

import math

from numba import njit

from smartshoe.kernels.memory import EASED, first_loading, newton, rise, softness, tanh

CLOSE = 1e-8  # of full scale: a step of Newton's that is less leaves about its square
ALIKE = 0.05  # of its logarithm: over a step that turns a curvature by less it is the same
STEPS = 30


@njit(cache=True)
def hardened(load, cubic, fifth, share, decay, now, before, out):  # type: ignore[no-untyped-def]
    """out (n,) = u + kappa (u - q) under ``load`` (n,), phi = (u + cubic u^3 + fifth u^5)/(1 + cubic + fifth)."""
    whole = 1.0 + cubic + fifth
    arm = held = 0.0
    u, q, known, slope = 0.0, 0.0, 0.0, 1.0 / whole
    for k in range(load.size):
        last, f = u, load[k] + held
        u += (f - known) / slope  # moved along with the load
        for _ in range(STEPS):
            square = u * u
            slope = (1.0 + square * (3.0 * cubic + 5.0 * fifth * square)) / whole + arm
            step = (f - u * ((1.0 + square * (cubic + fifth * square)) / whole + arm)) / slope
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

    ``ratio`` is g, whole = 1 + wall/(1 + g). Times 1 + g p the balance is quadratic in p; its other root is a gas of
    less than no absolute pressure.
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
        elif not k or f != known:  # a pause leaves it where it is, to the last digit
            # It rises with u: Newton from the last output moved along, held in a bracket.
            given, beside = f * more, arm * more
            straight = given / (1.0 + beside)
            low, high = straight, most * more
            if f <= 0.0:
                lost = min(strength * softness(top * per_wide, power, corner)[0], 0.95)  # more leaves nothing to pull
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
                if abs(step) > 0.5 * moved:  # to and fro across the corner
                    u, step = 0.5 * (low + high), math.inf
                moved = abs(step)
                # A step leaves an error of its square times half the curvature where that is the same all along it.
                # Beyond the corner nothing tells what the curvature is before it.
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


@njit(cache=True)
def recovered(out, share, decay, now, before, u, q):  # type: ignore[no-untyped-def]
    """The deformation ``u`` (n,) and the arm's q (n,) of which ``out`` (n,) is u + kappa (u - q)."""
    whole = 1.0 + share * (1.0 - now)
    u[0] = q[0] = out[0]
    for k in range(1, out.size):
        kept = decay * q[k - 1] + before * u[k - 1]
        u[k] = (out[k] + share * kept) / whole
        q[k] = kept + now * u[k]


@njit(cache=True)
def hardened_about(u, cubic, fifth, arm, by_load, by_amounts):  # type: ignore[no-untyped-def]
    """How ``u`` (n,) of `hardened` moves with the load, ``by_load`` (n,), and with its two amounts, (2, n)."""
    whole = 1.0 + cubic + fifth
    for k in range(u.size):
        square = u[k] * u[k]
        bent = u[k] * (1.0 + square * (cubic + fifth * square)) / whole
        slope = (1.0 + square * (3.0 * cubic + 5.0 * fifth * square)) / whole + (arm if k else 0.0)
        by_load[k] = 1.0 / slope
        by_amounts[0, k] = (bent - u[k] * square) / (whole * slope)
        by_amounts[1, k] = (bent - u[k] * square * square) / (whole * slope)


@njit(cache=True)
def softened_about(  # type: ignore[no-untyped-def]
    load, u, q, strength, width, widening, raised, power, largest, dead_zone, share, decay, now, before,
    by_load, by_most, grows, by_amounts,
):  # fmt: skip
    """How ``u`` (n,) of `softened` moves: ``by_load``, ``by_most`` with the largest load before, (n,), and its amounts.

    ``by_amounts`` (5, n): strength to power. ``grows`` (n,): the samples whose load is the largest so far.
    """
    arm = held = 0.0
    corner = EASED**power
    for k in range(load.size):
        f, at = load[k] + held, u[k]
        most = max(largest - dead_zone, 0.0)
        turned = tanh(most * most / width)
        more, turns = 1.0 + raised * turned, raised * (1.0 - turned * turned)
        by_most[k] = 0.0
        if f >= most * (1.0 + arm * more):
            phi = f - arm * at
            bend = tanh(phi * phi / width)
            falls = 1.0 - bend * bend
            slope = 1.0 + raised * (bend + 2.0 * phi * phi / width * falls)  # of u in phi
            per = 1.0 / (1.0 + slope * arm)
            by_load[k] = slope * per
            by_amounts[0, k] = by_amounts[2, k] = by_amounts[4, k] = 0.0
            by_amounts[1, k] = -per * raised * falls * phi * phi * phi / (width * width)
            by_amounts[3, k] = per * phi * bend
        else:
            wide = width + widening * most * most
            below = max(most * most * more * more - at * at, 0.0)
            x = below / wide
            bend, steep, _ = softness(x, power, corner)
            if below == 0.0:
                steep = 0.0
            phi = at * (1.0 - strength * bend) / more
            slope = (1.0 - strength * bend + 2.0 * strength * at * at * steep / wide) / more + arm
            per = 1.0 / slope
            by_x = strength * at * steep / more * per  # of u
            by_rise = phi / more * per + by_x * 2.0 * most * most * more / wide
            eased = x + EASED
            rooted = math.log(eased) * eased**power - math.log(EASED) * corner
            by_load[k] = per
            by_amounts[0, k] = at * bend / more * per
            by_amounts[1, k] = -by_x * x / wide - by_rise * turns * most * most / (width * width)
            by_amounts[2, k] = -by_x * x / wide * most * most
            by_amounts[3, k] = by_rise * turned
            by_amounts[4, k] = strength * at / more * per * (1.0 - bend * bend) * rooted
            if largest > dead_zone:
                by_top = by_x * 2.0 * most * (more * more / wide - x / wide * widening)
                by_most[k] = by_top + by_rise * turns * 2.0 * most / width
        reached = f - arm * at
        grows[k] = reached > largest
        largest = max(largest, reached)
        arm = share * (1.0 - now)
        held = share * (decay * q[k] + before * at)


@njit(cache=True)
def spring_along(  # type: ignore[no-untyped-def]
    moved, forced, u, q, by_load, by_most, grows, share, decay, now, before, d_share, d_decay, d_now, d_before, out
):
    """out (n,): by how much u + kappa (u - q) moves with the load, by ``moved`` (n,), and with the arm, by the d_.

    ``forced`` (n,) is what amounts move u by; the others (n,) are as in `recovered` and `softened_about`.
    """
    arm = d_arm = d_held = d_most = d_u = d_q = 0.0
    for k in range(u.size):
        last, d_last, d_load = u[k - 1] if k else 0.0, d_u, moved[k] + d_held
        d_u = by_load[k] * (d_load - u[k] * d_arm) + by_most[k] * d_most + forced[k]
        if grows[k]:
            d_most = d_load - d_arm * u[k] - arm * d_u
        if k:
            d_q = decay * d_q + now * d_u + before * d_last + d_decay * q[k - 1] + d_now * u[k] + d_before * last
        else:
            d_q = d_u
        out[k] = d_u + share * (d_u - d_q) + d_share * (u[k] - q[k])
        arm, d_arm = share * (1.0 - now), d_share * (1.0 - now) - share * d_now
        d_held = share * (decay * d_q + before * d_u + d_decay * q[k] + d_before * u[k])
        d_held += d_share * (decay * q[k] + before * u[k])
