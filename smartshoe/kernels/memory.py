"""Operators with memory of past loads: plays, Bouc-Wen, largest load so far, completed cycles, air lost by an orifice.

Rate-independent ones depend on the sequence of loads only, and not on the sampling as long as every turning point is a
sample. The states are arrays that a call changes in place: pushing block by block gives the same numbers.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

_LAX = {"reassoc", "contract", "nsz"}  # sums may be reordered; NaN is still handled
_BISECTIONS = 50
SOLVED = 1e-14  # of full scale: tolerated residual of an inverse's equation
STEPS, CLOSE = 60, 1e-9  # of Newton's and similar methods; after a smaller Newton step the error is about its square
EASED = 1e-3  # of the width within which the corner of a root is rounded
NO_LOAD = 1e30  # marks that there was no load yet
CYCLE_ENDS = 0.05  # of the cycle's height, above its trough


@njit(cache=True)
def backlash(load, half_width, state, out):  # type: ignore[no-untyped-def]
    """Play operator: out (n,) stays within ``half_width`` of ``load`` (n,) and moves only where it must.

    ``state`` (1,) is the last output, NO_LOAD before the first sample, whose load then becomes the output.
    """
    if load.size == 0:
        return
    place = state[0]
    if place >= NO_LOAD:
        place = load[0]
    for k in range(load.size):
        place = min(max(place, load[k] - half_width), load[k] + half_width)
        out[k] = place
    state[0] = place


@njit(cache=True)
def plays(signal, before, own, half_widths, weights, after, state, out):  # type: ignore[no-untyped-def]
    """Prandtl-Ishlinskii: out (n,) = own x + sum of weights play(x) + after, with x = ``signal`` (n,) + before.

    ``half_widths``, ``weights``, ``state`` (m,); ``state`` holds the plays' positions and is updated.
    """
    for k in range(signal.size):
        x = signal[k] + before
        total = own * x
        for i in range(half_widths.size):
            place = min(max(state[i], x - half_widths[i]), x + half_widths[i])
            state[i] = place
            total += weights[i] * place
        out[k] = total + after


@njit(cache=True, fastmath=_LAX)
def _loop_at(load, half_widths, closed, open_, levelling, state):  # type: ignore[no-untyped-def]
    """The loop's value at ``load``; updates ``state``; see `relays`."""
    bent = 2.0 / 3.0 * levelling
    total = 0.0
    above = load * load * (1.0 - bent * load)
    for i in range(half_widths.size):
        reach = load - 2.0 * half_widths[i]
        place = min(max(state[i], reach), load)
        state[i] = place
        low, up = max(reach, 0.0), max(place, 0.0)
        mean = 0.5 * (above + low * low * (1.0 - bent * low))
        total += closed[i] * (mean - up * up * (1.0 - bent * up)) + open_[i] * (load - half_widths[i] - place)
    return total


@njit(cache=True, fastmath=_LAX)
def relays(load, half_widths, closed, open_, levelling, state, out):  # type: ignore[no-untyped-def]
    """out (n,): loop of a bank of relays about its mean curve, positive while loading.

    ``closed`` (m,) weighs relays whose down thresholds b >= 0 have the density 2 b (1 - levelling b), so that all are
    down without load; ``open_`` (m,) weighs stop operators, which are in the middle before the first loading. ``state``
    (m,) is the play's position minus its half width, initially -half_widths.
    """
    for k in range(load.size):
        out[k] = _loop_at(max(load[k], 0.0), half_widths, closed, open_, levelling, state)


@njit(cache=True)
def closer(step, at, left, low, high, under, over, stays):  # type: ignore[no-untyped-def]
    """Next point in the search for the zero of an increasing ``left``, after ``at``, and the updated bracket.

    The first two steps evaluate the ends ``low`` and ``high``. From ``step`` 2 on the Illinois method is used (Dowell
    and Jarratt 1971): false position, in which an end that stays twice counts half. ``under`` and ``over`` are the
    values at the ends; ``stays`` is 1 if ``high`` stayed, -1 if ``low`` did. `smartshoe.models.effects._false_position`
    is the same in C.
    """
    if step == 0:
        return high, low, high, left, over, stays
    if step == 1:
        over = left
    elif left < 0.0:
        low, under, over, stays = at, left, over * (0.5 if stays == 1 else 1.0), 1
    else:
        high, over, under, stays = at, left, under * (0.5 if stays == -1 else 1.0), -1
    trial = low - (high - low) * (under / (over - under)) if over > under else low
    return trial, low, high, under, over, stays


@njit(cache=True)
def relays_undone(signal, strength, half_widths, closed, open_, levelling, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out - strength relays(out) = ``signal`` (n,); ``state`` is updated."""
    moved = np.empty(half_widths.size)
    for k in range(signal.size):
        y = signal[k]
        low, high = y - 2.0 * strength, y + 2.0 * strength
        f, under, over, stays = low, 0.0, 0.0, 0
        for i in range(STEPS):
            for j in range(state.size):  # a slice that is assigned takes seconds more to compile
                moved[j] = state[j]
            left = f - y - strength * _loop_at(max(f, 0.0), half_widths, closed, open_, levelling, moved)
            if abs(left) <= SOLVED:
                break
            f, low, high, under, over, stays = closer(i, f, left, low, high, under, over, stays)
        for j in range(state.size):
            state[j] = moved[j]
        out[k] = f


@njit(cache=True)
def _bend(z, exponent, turn):  # type: ignore[no-untyped-def]
    if z >= 0.0:
        return 1.0 - min(z, 1.0) ** exponent
    return 1.0 + turn * (-z) ** exponent


@njit(cache=True)
def bouc_wen_branch(exponent, turn, spacing, z, slope):  # type: ignore[no-untyped-def]
    """The rising branch from z = -1: fills ``z`` and ``slope`` times spacing (m,), at points ``spacing`` widths apart.

    dz/dx = 1 - z^exponent, or 1 + turn |z|^exponent below zero, by fourth-order Runge-Kutta.
    """
    last = -1.0
    for k in range(z.size):
        z[k] = last
        one = _bend(last, exponent, turn)
        slope[k] = spacing * one
        two = _bend(last + 0.5 * spacing * one, exponent, turn)
        three = _bend(last + 0.5 * spacing * two, exponent, turn)
        four = _bend(last + spacing * three, exponent, turn)
        last = min(last + spacing * (one + 2.0 * two + 2.0 * three + four) / 6.0, 1.0)


@njit(cache=True)
def _along(place, z, slope):  # type: ignore[no-untyped-def]
    """The branch at ``place`` spacings from its beginning (cubic Hermite); beyond its end the last value."""
    if place >= z.size - 1:
        return z[z.size - 1]
    i = int(place)
    t = place - i
    u = 1.0 - t
    return u * u * ((1.0 + 2.0 * t) * z[i] + t * slope[i]) + t * t * ((1.0 + 2.0 * u) * z[i + 1] - u * slope[i + 1])


@njit(cache=True)
def _place_of(value, z, slope):  # type: ignore[no-untyped-def]
    """The place, in spacings, where the rising branch has ``value``, by bisection of the table and of its cubics."""
    low, high = 0.0, z.size - 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        i = int(middle)
        if z[i + 1] < value or (z[i] < value and _along(middle, z, slope) < value):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(cache=True)
def bouc_wen(load, per_load, z, slope, state, out):  # type: ignore[no-untyped-def]
    """out (n,): friction in [-1, 1] along ``load`` (n,), on the branch ``z``, ``slope`` of `bouc_wen_branch`.

    ``per_load`` is spacings of the branch per load. ``state`` (4,): last load (NO_LOAD before the first), friction,
    direction (0 before the first move), place on the branch.
    """
    last, value, direction, place = state
    for k in range(load.size):
        move = load[k] - last if last < NO_LOAD else 0.0
        if move != 0.0:
            sense = 1.0 if move > 0.0 else -1.0
            if sense != direction:
                direction, place = sense, _place_of(sense * value, z, slope)
            place += abs(move) * per_load
            value = direction * _along(place, z, slope)
        last = load[k]
        out[k] = value
    state[0], state[1], state[2], state[3] = last, value, direction, place


@njit(cache=True)
def _left(fading, load):  # type: ignore[no-untyped-def]
    """The share of friction that remains under a ``load``."""
    return min(max(1.0 - fading * load, 0.0), 1.0)


@njit(cache=True)
def bouc_wen_undone(signal, strength, fading, per_load, z, slope, dead_zone, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out - strength (1 - fading b) friction = ``signal`` (n,), friction along b, the backlash of out.

    ``state`` (4,) as in `bouc_wen`.
    """
    last, value, direction, place = state
    for k in range(signal.size):
        y = signal[k]
        if last >= NO_LOAD:
            last = y
            out[k] = y
            continue
        f = y + strength * _left(fading, last) * value
        if abs(f - last) > dead_zone:  # else the load has not moved as seen by friction
            sense = 1.0 if f > last else -1.0
            on = place if sense == direction else _place_of(sense * value, z, slope)
            low, under, over, stays = 0.0, dead_zone - sense * (f - last), 0.0, 0
            move = high = sense * (y - last) + strength - dead_zone  # an upper bound, as friction is bounded
            for i in range(1, STEPS + 1):  # the residual at the lower end is known
                f = last + sense * (dead_zone + move)
                height = strength * _left(fading, last + sense * move)
                left = sense * (f - y) - height * _along(on + move * per_load, z, slope)
                if abs(left) <= SOLVED:
                    break
                move, low, high, under, over, stays = closer(i, move, left, low, high, under, over, stays)
            if move > 0.0:
                direction, place = sense, on + move * per_load
                value = sense * _along(place, z, slope)
                last += sense * move
        out[k] = f
    state[0], state[1], state[2], state[3] = last, value, direction, place


@njit(cache=True)
def _sense(before, move, width, fade):  # type: ignore[no-untyped-def]
    """The direction after a step: ds = (sgn(df) - s) |df|/width - s fade, exact where the load moves evenly."""
    turned = abs(move) / width
    total = turned + fade
    if total == 0.0:
        return before
    end = math.copysign(turned / total, move)
    return end + (before - end) * math.exp(-total)


@njit(cache=True)
def sense_of_motion(load, width, fade, state, out):  # type: ignore[no-untyped-def]
    """out (n,) in [-1, 1]: s with ds = (sgn(df) - s) |df|/width along ``load`` (n,), decaying by ``fade`` a step.

    ``state`` (2,): last load (NO_LOAD before the first sample), last s.
    """
    last, sense = state
    for k in range(load.size):
        sense = _sense(sense, load[k] - last if last < NO_LOAD else 0.0, width, fade)
        last = load[k]
        out[k] = sense
    state[0], state[1] = last, sense


@njit(cache=True)
def sense_undone(signal, strength, width, fade, dead_zone, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out (1 - strength (1 - s)/2) = ``signal`` (n,), s the `sense_of_motion` of the backlash of out.

    Within the dead zone s does not change; for a signal that this cannot explain, the load is sought outside the dead
    zone. Where unloading has more gain, a load that turns raises the signal like one that keeps rising; which one it
    was shows in the signal's next fall. ``state`` (2,) as in `sense_of_motion`.
    """
    last, sense = state
    for k in range(signal.size):
        y = signal[k]
        now = _sense(sense, 0.0, width, fade)
        f = y / (1.0 - 0.5 * strength * (1.0 - now))
        if last >= NO_LOAD:
            last = f
        elif abs(f - last) > dead_zone:
            end = last + math.copysign(dead_zone, f - last)
            whole = y / (1.0 - strength)
            far = max(y, whole) if f > last else min(y, whole)
            way = 1.0 if f > last else -1.0  # for a falling load the search is mirrored
            f = low = way * end
            high, under, over, stays = way * far, 0.0, 0.0, 0
            for i in range(STEPS):
                now = _sense(sense, way * f - end, width, fade)
                left = f * (1.0 - 0.5 * strength * (1.0 - now)) - way * y
                if abs(left) <= SOLVED or (i == 0 and left > 0.0) or (i == 1 and left < 0.0):
                    break
                f, low, high, under, over, stays = closer(i, f, left, low, high, under, over, stays)
            f *= way
            last += f - end
        sense = now
        out[k] = f
    state[0], state[1] = last, sense


@njit(cache=True)
def _cycle_step(f, least, trough, peak):  # type: ignore[no-untyped-def]
    """Whether a cycle ends at ``f``, and the updated trough and peak."""
    if trough >= NO_LOAD:
        return False, f, f
    if peak - trough < least:
        if f < trough:
            return False, f, f
        return False, trough, max(peak, f)
    peak = max(peak, f)
    if f <= trough + CYCLE_ENDS * (peak - trough):
        return True, f, f
    return False, trough, peak


@njit(cache=True)
def cycles_done(load, least, state, out):  # type: ignore[no-untyped-def]
    """out (n,): completed load cycles, in which the load rose by ``least`` and fell by 95 % of that rise.

    ``state`` (3,): lowest load since the last cycle, highest since then (NO_LOAD before the first sample), count.
    """
    trough, peak, count = state
    for k in range(load.size):
        ended, trough, peak = _cycle_step(load[k], least, trough, peak)
        if ended:
            count += 1.0
        out[k] = count
    state[0], state[1], state[2] = trough, peak, count


@njit(cache=True)
def conditioned_undone(signal, strength, per_cycle, by_way, stretch, least, width, rounds, settled, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out (1 + strength (1 - exp(-n))) = ``signal`` (n,).

    n = (1 - by_way) (N per_cycle)^stretch + by_way L/2 per_cycle.

    N is the number of cycles of out, as in `cycles_done`; L is the path length of its play of ``width``. Each sample is
    iterated for at most ``rounds``, until it changes by no more than ``settled``. ``state`` (5,): N, trough and peak of
    the cycle, the play (each NO_LOAD before the first sample), L/2.
    """
    count, trough, peak, place, gone = state
    for k in range(signal.size):
        f, ended, moved, z = signal[k], False, gone, place
        for _ in range(2):  # repeated where a cycle ends with this sample
            counted = (1.0 - by_way) * (count * per_cycle) ** stretch
            for _ in range(rounds):
                guess = f
                z = f if place >= NO_LOAD else min(max(place, f - width), f + width)
                moved = gone if place >= NO_LOAD else gone + 0.5 * abs(z - place)
                f = signal[k] / (1.0 - strength * math.expm1(-(counted + by_way * moved * per_cycle)))
                if abs(f - guess) <= settled:
                    break
            if ended:
                break
            ended, trough, peak = _cycle_step(f, least, trough, peak)
            if not ended:
                break
            count += 1.0
        place, gone = z, moved
        out[k] = f
    state[0], state[1], state[2], state[3], state[4] = count, trough, peak, place, gone


@njit(cache=True)
def rate_undone(signal, strength, exponent, least, softness, dead_zone, step_s, keep, state, out):  # type: ignore[no-untyped-def]
    """out (n,) with out (1 + strength s(r)) = ``signal`` (n,), r the rate that explains the signal's own smoothed rate.

    The factor is at least ``least``.

    s(r) = (r^2 + softness^2)^(exponent/2) - softness^exponent. The signal's rate equals r (1 + strength s(r)), as on a
    ramp; it is measured as a first-order mean, with ``keep`` per step, of the signal's changes beyond a play of
    ``dead_zone``. (With the rate of the output instead, unloading would be unstable.) ``state`` (2,): last cleaned
    signal (NO_LOAD before the first), its rate.
    """
    last, seen = state
    floor = softness**exponent
    for k in range(signal.size):
        cleaned = signal[k] if last >= NO_LOAD else min(max(last, signal[k] - dead_zone), signal[k] + dead_zone)
        moved = 0.0 if last >= NO_LOAD else abs(cleaned - last)
        seen = keep * seen + (1.0 - keep) * moved / step_s
        last = cleaned
        gain = 1.0
        for _ in range(8):
            gain = 1.0 + strength * (((seen / gain) ** 2 + softness * softness) ** (0.5 * exponent) - floor)
            gain = max(gain, least)
        out[k] = signal[k] / gain
    state[0], state[1] = last, seen


@njit(cache=True)
def newton(at, off, slope, low, high):  # type: ignore[no-untyped-def]
    """Next point in the search for a zero of an increasing ``off``, the bracket, and the step (infinite: halved)."""
    if off > 0.0:
        high = at
    else:
        low = at
    trial = at - off / slope
    if low <= trial <= high:
        return trial, low, high, trial - at
    return 0.5 * (low + high), low, high, math.inf


@njit(cache=True)
def _orifice(p, laminar):  # type: ignore[no-untyped-def]
    return p / math.sqrt(math.sqrt(p * p + laminar * laminar))


@njit(cache=True)
def orifice(pressure, step_rate, laminar, state, out):  # type: ignore[no-untyped-def]
    """out (n,) = ``pressure`` (n,) - w, with w' = rate out/sqrt(|out|), by the implicit trapezoidal rule.

    ``step_rate`` is rate times step; below ``laminar`` the flow is proportional. ``state`` (2,): w, last flow over
    rate.
    """
    w, flow = state
    half = 0.5 * step_rate
    # An upper bound of half the equation's curvature: after a step the error is at most its square times that.
    bend = half / (laminar * math.sqrt(laminar))
    half_flow = half * flow
    p, known = 0.0, 0.0
    for k in range(pressure.size):
        # p + half flow(p) = known increases with p: Newton from the extrapolated last output, kept in a bracket.
        moved = pressure[k] - w - half_flow - known
        known += moved
        low, high = min(known, 0.0), max(known, 0.0)
        p = min(max(p + moved, low), high)
        for _ in range(30):
            per_pressure = 1.0 / math.sqrt(math.sqrt(p * p + laminar * laminar))
            flow = p * per_pressure
            sine = flow * per_pressure
            slope = 1.0 + half * per_pressure * (1.0 - 0.5 * sine * sine)
            p, low, high, step = newton(p, p + half * flow - known, slope, low, high)
            if bend * step * step <= 1e-10:
                break
        half_flow = known - p
        w = pressure[k] - p
        out[k] = p
    if pressure.size:
        state[0], state[1] = w, _orifice(p, laminar)


@njit(cache=True)
def rise(largest, raised, width):  # type: ignore[no-untyped-def]
    """u/phi of a first loading, 1 + raised tanh(M^2/width), M the ``largest`` load so far."""
    return 1.0 + raised * tanh(largest * largest / width) if raised > 0.0 else 1.0


@njit(cache=True)
def tanh(x):  # type: ignore[no-untyped-def]
    """tanh by one exponential, accurate to the last digit of 1, in a third of the time of `math.tanh`."""
    return 1.0 - 2.0 / (math.exp(2.0 * x) + 1.0)


@njit(cache=True)
def softness(x, power, corner):  # type: ignore[no-untyped-def]
    """Share of the softening at x = (M^2 - u^2)/wide below the largest load, tanh(x^power), and its slope over x.

    Also the decrease of the slope's logarithm with x. For a power other than 1 the corner at the largest load is
    rounded by EASED, which leaves ``corner``, EASED^power.
    """
    if power == 1.0:
        bend = tanh(x)
        return bend, 1.0 - bend * bend, 2.0 * bend
    at = x + EASED
    rooted = at**power
    bend, steep = tanh(rooted - corner), power * rooted / at
    return bend, (1.0 - bend * bend) * steep, 2.0 * bend * steep + (1.0 - power) / at


@njit(cache=True)
def first_loading(load, raised, width, own, arm, phi):  # type: ignore[no-untyped-def]
    """phi of a first loading, own phi + arm u = ``load`` >= 0 and u = phi rise(phi), and the slope of the load in u.

    Newton from ``phi``, kept in a bracket; own + arm (1 + raised) must be above zero.
    """
    if raised == 0.0:
        return load / (own + arm), own + arm
    one, other = load / (own + arm * (1.0 + raised)), load / (own + arm)
    low, high = min(one, other), max(one, other)
    phi, slope = min(max(phi, low), high), 1.0
    for _ in range(STEPS):
        bend = tanh(phi * phi / width)
        off = phi * (own + arm * (1.0 + raised * bend)) - load
        slope = 1.0 + raised * (bend + 2.0 * phi * phi / width * (1.0 - bend * bend))  # du/dphi
        phi, low, high, step = newton(phi, off, own + arm * slope, low, high)
        if abs(step) <= CLOSE:
            break
    return phi, own / slope + arm


@njit(cache=True)
def softened_undone(signal, strength, width, widening, raised, power, dead_zone, state, out):  # type: ignore[no-untyped-def]
    """out (n,) = u (1 - strength softness(M^2 rise^2 - u^2))/rise for ``signal`` u (n,), with M the largest out so far.

    ``state`` (1,): M less ``dead_zone``.
    """
    largest, corner = state[0], EASED**power
    for k in range(signal.size):
        u, more = signal[k], rise(largest, raised, width)
        if u >= largest * more:
            f = first_loading(u, raised, width, 0.0, 1.0, u)[0]
        else:
            below = max(largest * largest * more * more - u * u, 0.0)
            x = below / (width + widening * largest * largest)
            f = u * (1.0 - strength * softness(x, power, corner)[0]) / more
        largest = max(largest, f - dead_zone)
        out[k] = f
    state[0] = largest


@njit(cache=True)
def orifice_undone(signal, step_rate, laminar, state, out):  # type: ignore[no-untyped-def]
    """out (n,): pressure before `orifice`, from the pressure (n,) after it. ``state`` (2,): w, last flow over rate."""
    lost, last = state
    for k in range(signal.size):
        flow = _orifice(signal[k], laminar)
        lost += 0.5 * step_rate * (flow + last)
        last = flow
        out[k] = signal[k] + lost
    state[0], state[1] = lost, last
