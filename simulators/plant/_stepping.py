"""The bladder's compiled time stepping: one small kernel, which compiles within two seconds.

`simulators.plant.bladder` has the equations; every stress here is in units of the ambient pressure.
"""

from __future__ import annotations

import math

from numba import njit

from simulators.plant._kernel_constants import PlainConstants
from simulators.plant.preisach import mean_curve, relays_up
from smartshoe.arrays import Array

STATE_SIZE = 11
ORIFICE_SMOOTHING = 1e-4  # of ambient: near zero pressure the flow is laminar, so the root's slope is finite
CYCLE_BEGINS, CYCLE_ENDS = 0.10, 0.01  # of full scale: a load cycle counts once it has ended


@njit(cache=True)
def newton(at: float, off: float, slope: float, low: float, high: float) -> tuple[float, float, float, float]:
    """One step towards the root of an increasing balance that is ``off`` at ``at``.

    Returns the next point, the step, and the bracket's ends. Where Newton leaves the bracket, its middle is taken.
    """
    if off > 0.0:
        high = at
    else:
        low = at
    move = off / slope
    new = at - move
    if not low <= new <= high:
        new = 0.5 * (low + high)
        move = at - new
    return new, move, low, high


@njit(cache=True)
def cycle_at(load_n: float, full_n: float, in_cycle: bool) -> tuple[bool, bool]:
    """Whether a load cycle is in progress at ``load_n``, given whether one was before, and whether one ends here."""
    if load_n > CYCLE_BEGINS * full_n:
        return True, False
    ended = in_cycle and load_n < CYCLE_ENDS * full_n
    return in_cycle and not ended, ended


@njit(cache=True)
def advance(
    load_n: Array, finer: int, step_s: float, constants: PlainConstants, shape: Array,
    state: Array, turning: Array, partial: Array, pressure: Array, deformation: Array,
) -> None:  # fmt: skip
    """Advance the state through ``load_n`` (n,), with ``finer`` steps of ``step_s`` per sample.

    Fills ``pressure`` and ``deformation`` (n,); changes ``state``, ``turning`` and ``partial`` in place.
    """
    c = constants
    K1, K2, full_n, full_e = c.stiffness, c.arm_stiffness, c.full_n, c.full_e
    heat, softening, width = c.heat, c.softening, c.softening_width
    boyle = c.boyle != 0.0
    e, e_before, q, theta, w, flow_before, e_max, time_s, cycles, load, places = state
    count = max(int(abs(places)), 1)
    in_cycle = places < 0.0

    # Exact weights for a deformation that is linear within the step.
    z = c.arm_rate_per_s * step_s
    keep = math.exp(-z)
    mean = -math.expm1(-z) / z
    heat_keep = math.exp(-c.heat_rate_per_s * step_s)
    heat_mean = -math.expm1(-c.heat_rate_per_s * step_s) / (c.heat_rate_per_s * step_s)

    flow = 0.0
    p = 0.0
    for i in range(load_n.size):
        load_step = (load_n[i] - load) / finer
        for j in range(finer):
            load = load_n[i] if j == finer - 1 else load + load_step
            time_s += step_s
            acting = load
            if c.loop_n != 0.0:
                up, count = relays_up(load, turning, partial, count, shape)
                acting += c.loop_n * (up - mean_curve(load, shape))
            if c.static_exponent != 1.0 and acting > 0.0:
                acting = full_n * (acting / full_n) ** c.static_exponent
            if c.conditioning != 0.0:
                in_cycle, ended = cycle_at(load, full_n, in_cycle)
                cycles += 1.0 if ended else 0.0
                acting *= 1.0 + c.conditioning * -math.expm1(-cycles * c.per_cycle)
            stress = acting * c.per_newton
            warm = c.drift_per_s * time_s - c.warming * math.expm1(-c.warming_rate_per_s * time_s)

            q_fixed = keep * q + (mean - keep) * e
            theta_fixed = heat_keep * theta
            # Newton on the balance, which increases with e, so that the iterates themselves give a safe bracket.
            low, high = -1e9, 0.999 if boyle else 1e9
            new = min(2.0 * e - e_before, 0.99) if boyle else 2.0 * e - e_before
            for _ in range(60):
                if boyle:
                    theta_new = theta_fixed + heat * heat_mean * math.log((1.0 - e) / (1.0 - new))
                    hot = (1.0 - w) / (1.0 - new)
                    p = hot * (1.0 + theta_new + warm) - 1.0
                    slope = (p + 1.0) / (1.0 - new) + hot * heat * heat_mean / (1.0 - new)
                else:
                    theta_new = theta_fixed + heat * heat_mean * (new - e)
                    p = new - w + theta_new + warm
                    slope = 1.0 + heat * heat_mean
                ratio = new / full_e
                stiffness = K1 * (1.0 + c.hardening * ratio * ratio)
                tangent = K1 * (1.0 + 3.0 * c.hardening * ratio * ratio)
                if softening != 0.0 and new < e_max:
                    bend = math.tanh((e_max * e_max - new * new) / (width * full_e * full_e))
                    left = 1.0 - softening * bend
                    tangent = tangent * left + stiffness * softening * (1.0 - bend * bend) * 2.0 * ratio * ratio / width
                    stiffness *= left
                q_new = q_fixed + (1.0 - mean) * new
                off = p + stiffness * new + K2 * (new - q_new) - stress
                new, move, low, high = newton(new, off, slope + (tangent + K2 * mean), low, high)
                if abs(move) <= 1e-13:
                    break
            # The last correction is below rounding: update the rest of the state to the same deformation.
            q = q_fixed + (1.0 - mean) * new
            if boyle:
                theta = theta_fixed + heat * heat_mean * math.log((1.0 - e) / (1.0 - new))
                p = (1.0 - w) / (1.0 - new) * (1.0 + theta + warm) - 1.0
            else:
                theta = theta_fixed + heat * heat_mean * (new - e)
                p = new - w + theta + warm
            e_before = e
            e = new
            e_max = max(e_max, e)
            if c.linear_leak_per_s != 0.0 or c.orifice_leak_per_s != 0.0:
                flow = c.linear_leak_per_s * p + c.orifice_leak_per_s * p / math.sqrt(abs(p) + ORIFICE_SMOOTHING)
                w += step_s * (1.5 * flow - 0.5 * flow_before)
                flow_before = flow
        pressure[i] = p
        deformation[i] = e
    state[0], state[1], state[2], state[3], state[4], state[5] = e, e_before, q, theta, w, flow_before
    state[6], state[7], state[8], state[9] = e_max, time_s, cycles, load
    state[10] = -float(count) if in_cycle else float(count)
