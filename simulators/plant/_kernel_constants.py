"""A bladder's constants for the compiled time stepping, by name, in the form in which its kernel multiplies them.

Stresses are in units of the ambient pressure, deformations in shares of the gas volume, times in s. They are a
NamedTuple of numbers, which numba accepts directly.
"""

from __future__ import annotations

from typing import NamedTuple

from simulators.plant.bladder_parameters import AMBIENT_K, AMBIENT_PA, HEAT_RATIO, BladderParameters


class PlainConstants(NamedTuple):
    """Constants of `simulators.plant._stepping`: the paper's unit and the first effects. Switches are 1 or 0."""

    stiffness: float
    arm_stiffness: float
    arm_rate_per_s: float
    per_newton: float
    full_n: float
    full_e: float
    boyle: float
    static_exponent: float
    hardening: float
    loop_n: float
    linear_leak_per_s: float
    orifice_leak_per_s: float
    heat: float
    heat_rate_per_s: float
    drift_per_s: float
    warming: float
    warming_rate_per_s: float
    softening: float
    softening_width: float
    conditioning: float
    per_cycle: float


class WallConstants(NamedTuple):
    """Constants of `simulators.plant._wall_stepping`: every effect of wall and air. Switches are 1 or 0."""

    stiffness: float
    full_stress: float
    full_e: float
    boyle: float
    hardening: float
    stiffening: float
    softening: float
    softening_width: float
    linear_leak_per_s: float
    orifice_leak_per_s: float
    capillary_per_s: float
    nozzle_per_s: float
    heat: float
    drift_per_s: float
    warming: float
    warming_rate_per_s: float
    second_stiffness: float
    second_rate_per_s: float
    second_width: float
    bristles: float
    bristle_spring: float
    bristle_exponent: float
    bristle_gamma: float
    set_rate_per_s: float
    set_exponent: float


def per_newton(p: BladderParameters) -> float:
    """Stress in units of ambient pressure for a load of 1 N."""
    return 1.0 / (p.effective_area_m2 * AMBIENT_PA)


def plain_constants(p: BladderParameters, loop_n: float) -> PlainConstants:
    """The plain kernel's constants; ``loop_n`` is the load that the friction loop's relays bear together."""
    constants = PlainConstants(
        stiffness=p.k1 * p.x_over_nrt,
        arm_stiffness=p.k2 * p.x_over_nrt,
        arm_rate_per_s=p.k2 / p.c,
        per_newton=per_newton(p),
        full_n=p.full_scale_n,
        full_e=p.full_scale_deformation,
        boyle=1.0 if p.gas == "boyle" else 0.0,
        static_exponent=p.static_exponent,
        hardening=p.wall_hardening,
        loop_n=loop_n,
        linear_leak_per_s=p.leak.linear_per_s,
        orifice_leak_per_s=p.leak.orifice_per_s,
        heat=p.gas_heat.fraction * (HEAT_RATIO - 1.0),
        heat_rate_per_s=1.0 / p.gas_heat.time_constant_s,
        drift_per_s=p.temperature.drift_k_per_s / AMBIENT_K,
        warming=p.temperature.warming_k / AMBIENT_K,
        warming_rate_per_s=1.0 / p.temperature.warming_time_constant_s,
        softening=p.softening.strength,
        softening_width=p.softening.width,
        conditioning=p.conditioning.gain,
        per_cycle=1.0 / p.conditioning.cycles,
    )
    return PlainConstants._make(map(float, constants))  # an int would be another type and be compiled again


def wall_constants(p: BladderParameters) -> WallConstants:
    """The constants of the kernel with all effects of wall and air."""
    full_stress, full_e, second = p.full_scale_n * per_newton(p), p.full_scale_deformation, p.second_relaxation
    constants = WallConstants(
        stiffness=p.k1 * p.x_over_nrt,
        full_stress=full_stress,
        full_e=full_e,
        boyle=1.0 if p.gas == "boyle" else 0.0,
        hardening=p.wall_hardening,
        stiffening=p.wall_stiffening,
        softening=p.softening.strength,
        softening_width=p.softening.width,
        linear_leak_per_s=p.leak.linear_per_s,
        orifice_leak_per_s=p.leak.orifice_per_s,
        capillary_per_s=p.leak.capillary_per_s,
        nozzle_per_s=p.leak.nozzle_per_s,
        heat=p.gas_heat.fraction * (HEAT_RATIO - 1.0),
        drift_per_s=p.temperature.drift_k_per_s / AMBIENT_K,
        warming=p.temperature.warming_k / AMBIENT_K,
        warming_rate_per_s=1.0 / p.temperature.warming_time_constant_s,
        second_stiffness=second.k3 * p.x_over_nrt,
        second_rate_per_s=1.0 / second.time_constant_s,
        second_width=second.eyring_width * full_e,
        bristles=p.bouc_wen.strength * full_stress,
        bristle_spring=1.0 / (p.bouc_wen.width * full_e),
        bristle_exponent=p.bouc_wen.exponent,
        bristle_gamma=p.bouc_wen.gamma,
        set_rate_per_s=p.permanent_set.rate_per_s,
        set_exponent=p.permanent_set.exponent,
    )
    return WallConstants._make(map(float, constants))
