"""The bladder's time stepping with every effect of wall and air, compiled separately from the plain one.

`simulators.plant.bladder` and `simulators.effects` have the equations; every stress is in units of the ambient
pressure. Load-side effects have been applied before: the argument is the stress at every fine step.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from simulators.plant._kernel_constants import WallConstants
from simulators.plant._stepping import ORIFICE_SMOOTHING, newton
from smartshoe.arrays import Array

SCALARS = 12
LAMINAR = 3e-4  # of ambient: below this pressure difference a nozzle's flow is viscous
GAMMA = 1.4


@njit(cache=True)
def nozzle_flow(p: float) -> float:
    """Subsonic isentropic flow through a hole for gauge pressure ``p``, as sqrt(p) where p is small (Saint-Venant)."""
    size = abs(p)
    upstream = 1.0 + max(p, 0.0)
    ratio = max((1.0 + min(p, 0.0)) / upstream, 0.53)  # choked below
    flow = upstream * math.sqrt(
        max(GAMMA / (GAMMA - 1.0) * (ratio ** (2.0 / GAMMA) - ratio ** ((GAMMA + 1.0) / GAMMA)), 0.0)
    )
    flow *= math.sqrt(size / (size + LAMINAR))
    return float(flow if p > 0.0 else -flow)


@njit(cache=True)
def faded(heats: Array, keep: Array) -> float:
    """The sum of ``heats`` after a step in which each keeps its share ``keep``; changes ``heats`` in place."""
    total = 0.0
    for j in range(heats.size):
        heats[j] *= keep[j]
        total += heats[j]
    return total


@njit(cache=True)
def softened(
    wall: float, tangent: float, softening: float, e: float, e_max: float, width: float
) -> tuple[float, float]:
    """Force and tangent of a wall that was deformed to ``e_max`` before; ``width`` is a squared deformation."""
    bend = math.tanh((e_max * e_max - e * e) / width)
    left = 1.0 - softening * bend
    bend_slope = (1.0 - bend * bend) * 2.0 * e / width
    return wall * left, tangent * left + wall * softening * bend_slope


@njit(cache=True)
def slider_at(pull: float, spring: float, most: float) -> tuple[float, float]:
    """The force of a slider (Jenkins) under an elastic ``pull``, and its stiffness, which is 0 once it slips."""
    if abs(pull) < most:
        return pull, spring
    return math.copysign(most, pull), 0.0


@njit(cache=True)
def slide(z: float, way: float, power: float, gamma: float) -> float:
    """Bouc and Wen's dz/dx for a motion in the direction of ``way``."""
    sense = 1.0 if z * way > 0.0 else -1.0
    return float(1.0 - abs(z) ** power * (gamma + (1.0 - gamma) * sense))


@njit(cache=True)
def advance_wall(
    stress: Array, step_s: float, constants: WallConstants, arm_stiffness: Array, arm_rate: Array, heat_share: Array,
    heat_rate: Array, slider_spring: Array, slider_most: Array,
    state: Array, arms: Array, heats: Array, sliders: Array, pressure: Array, deformation: Array,
) -> None:  # fmt: skip
    """Advance the state through ``stress`` (n,), one step of ``step_s`` each; fill pressure and deformation (n,).

    ``state`` (SCALARS,), ``arms``, ``heats`` and ``sliders`` are changed in place.
    """
    c = constants
    K1, K3, full_e, heat = c.stiffness, c.second_stiffness, c.full_e, c.heat
    power, gamma = c.bristle_exponent, c.bristle_gamma
    boyle = c.boyle != 0.0
    e, e_before, w, flow_before, e_max, time_s, thin, thin_flow_before, bristle, rest, rest_flow_before, last = state
    arm_keep, arm_mean = np.exp(-arm_rate * step_s), -np.expm1(-arm_rate * step_s) / (arm_rate * step_s)
    heat_keep, heat_mean = np.exp(-heat_rate * step_s), -np.expm1(-heat_rate * step_s) / (heat_rate * step_s)
    arm_tangent = np.sum(arm_stiffness * arm_mean)
    heat_gain = heat * np.sum(heat_share * heat_mean)
    leaks = (
        c.linear_leak_per_s != 0.0 or c.orifice_leak_per_s != 0.0 or c.capillary_per_s != 0.0 or c.nozzle_per_s != 0.0
    )
    bent = max(c.stiffening, 1e-6)
    p = 0.0
    for i in range(stress.size):
        time_s += step_s
        warm = c.drift_per_s * time_s - c.warming * math.expm1(-c.warming_rate_per_s * time_s)
        arm_pull = 0.0
        for j in range(arms.size):
            arms[j] = arm_keep[j] * arms[j] + (arm_mean[j] - arm_keep[j]) * e
            arm_pull += arm_stiffness[j] * arms[j]
        theta_fixed = faded(heats, heat_keep)
        if K3 != 0.0:
            thin_flow = c.second_rate_per_s * c.second_width * math.sinh((e - thin) / c.second_width)
            thin += step_s * (1.5 * thin_flow - 0.5 * thin_flow_before)
            thin_flow_before = thin_flow
        if c.set_rate_per_s != 0.0:
            rest_flow = c.set_rate_per_s * full_e * (max(last, 0.0) / c.full_stress) ** c.set_exponent
            rest += step_s * (1.5 * rest_flow - 0.5 * rest_flow_before)
            rest_flow_before = rest_flow
        low, high = -1e9, 0.999 if boyle else 1e9
        new = min(2.0 * e - e_before, 0.99) if boyle else 2.0 * e - e_before
        bristle_new = bristle
        for _ in range(60):
            if boyle:
                hot = (1.0 - w) / (1.0 - new)
                p = hot * (1.0 + theta_fixed + heat_gain * math.log((1.0 - e) / (1.0 - new)) + warm) - 1.0
                slope = (p + 1.0) / (1.0 - new) + hot * heat_gain / (1.0 - new)
            else:
                p = new - w + theta_fixed + heat_gain * (new - e) + warm
                slope = 1.0 + heat_gain
            x = (new - rest) / full_e
            square = x * x
            wall = K1 * full_e * (math.sinh(bent * x) / bent + c.hardening * square * x)
            tangent = K1 * (math.cosh(bent * x) + 3.0 * c.hardening * square)
            if c.softening != 0.0 and new < e_max:
                wall, tangent = softened(wall, tangent, c.softening, new, e_max, c.softening_width * full_e * full_e)
            wall += arm_tangent * new - arm_pull + K3 * (new - thin)
            tangent += arm_tangent + K3
            for j in range(sliders.size):
                held, stiffness = slider_at(sliders[j] + slider_spring[j] * (new - e), slider_spring[j], slider_most[j])
                wall += held
                tangent += stiffness
            if c.bristles != 0.0:
                way = c.bristle_spring * (new - e)
                first = slide(bristle, way, power, gamma)
                bristle_new = bristle + 0.5 * way * (first + slide(bristle + way * first, way, power, gamma))
                wall += c.bristles * bristle_new
                tangent += c.bristles * c.bristle_spring * first
            off = p + wall - stress[i]
            new, move, low, high = newton(new, off, slope + tangent, low, high)
            if abs(move) <= 1e-13:
                break
        # The last correction is below rounding: update the rest of the state to the same deformation.
        grow = math.log((1.0 - e) / (1.0 - new)) if boyle else new - e
        theta = 0.0
        for j in range(heats.size):
            heats[j] += heat * heat_share[j] * heat_mean[j] * grow
            theta += heats[j]
        p = (1.0 - w) / (1.0 - new) * (1.0 + theta + warm) - 1.0 if boyle else new - w + theta + warm
        for j in range(arms.size):
            arms[j] += (1.0 - arm_mean[j]) * new
        for j in range(sliders.size):
            sliders[j] = min(max(sliders[j] + slider_spring[j] * (new - e), -slider_most[j]), slider_most[j])
        bristle = bristle_new
        e_before = e
        e = new
        e_max = max(e_max, e)
        last = stress[i]
        if leaks:
            flow = c.linear_leak_per_s * p + c.orifice_leak_per_s * p / math.sqrt(abs(p) + ORIFICE_SMOOTHING)
            flow += c.capillary_per_s * p * (1.0 + 0.5 * p) + c.nozzle_per_s * nozzle_flow(p)
            w += step_s * (1.5 * flow - 0.5 * flow_before)
            flow_before = flow
        pressure[i] = p
        deformation[i] = e
    state[0], state[1], state[2], state[3], state[4], state[5] = e, e_before, w, flow_before, e_max, time_s
    state[6], state[7], state[8], state[9] = thin, thin_flow_before, bristle, rest
    state[10], state[11] = rest_flow_before, last
