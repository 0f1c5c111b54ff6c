"""A sensing unit's air bladder from physics: wall, sealed air, contact, and the effects that a scenario switches on.

*Scale.* The paper writes its force f as a pressure (Chinimilli 2016, eq. 2). Between a load in newton and a contact
stress in pascal stands an area, and the coil's own 40 cm^2 would give 2 bar at 800 N, ten times the sensor's range
and above its burst pressure. Most of the load must pass beside the tube; an *effective area* models that,
f = F / effective_area. Eq. (2) at full scale asks for 226 cm^2 (467 cm^2 for the toe's 100 mbar sensor).

*Equations.* Stresses in units of the ambient pressure p0, e the compressed share of the air's volume, K = k x0^2/(nRT):

    f/p0 = p + K1 e (hardening)(softening) + K2 (e - q),    q' = (e - q) k2/c           wall and force balance
    p = e - w + theta + dT/T0                 or  (1 - w)(1 + theta + dT/T0)/(1 - e) - 1 (Boyle)        sealed air
    w' = rate p  or  rate sqrt|p| sgn p,      theta' = -theta/tau + fraction (gamma - 1) e'/(1 - e)

With every effect off this is eq. (2)-(4):  P/f = (s + k2/c) / ([1 + K1 + K2] s + (k2/c)(1 + K1)).
The scheme is exact for a deformation that is linear within a step (the arm, the heat), two-step Adams-Bashforth for
the slow leak, and a safeguarded Newton iteration for the balance: second order, stable at any step for the wall.

*Left out:* inertia and the tube's acoustics (both far above 1 kHz), buckling and contact of the tube's own walls
(bottoming out), a wall spectrum wider than one relaxation time, temperature of the wall, humidity, shear, neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from simulators.preisach import MEMORY, loop_shape
from simulators.stepping import STATE_SIZE, advance
from smartshoe.devices.base import Bladder
from smartshoe.errors import UsageError

Array = NDArray[np.float64]

AMBIENT_PA = 101_325.0
AMBIENT_K = 300.0
HEAT_RATIO = 1.4  # of air
X_OVER_NRT = 0.38113  # x0^2/(nRT) in m/N, Chinimilli 2016, below eq. (4)
TUBE_DIAMETER_M = 2e-3
LOWEST_STEP_HZ = 1000.0

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
_STRICT_KEYS = ConfigDict(extra="forbid")


@dataclass(frozen=True, slots=True)
class Hysteresis:
    """Rate-independent friction of wall and contact (`simulators.preisach`).

    ``strength`` is half of the major loop's greatest height, as a fraction of full-scale load; the relays' half width
    is ``half_width_n`` (1 +- ``spread``).
    """

    __pydantic_config__ = _STRICT_KEYS
    kind: Literal["preisach"] = "preisach"
    strength: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    half_width_n: Positive = 40.0
    spread: Annotated[float, Field(gt=0, le=1)] = 0.9


@dataclass(frozen=True, slots=True)
class Leak:
    """Air that leaves the tube: ``linear_per_s`` at p/p0 each, ``orifice_per_s`` at sqrt(p/p0) (turbulent)."""

    __pydantic_config__ = _STRICT_KEYS
    linear_per_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    orifice_per_s: Annotated[float, Field(ge=0, le=1)] = 0.0


@dataclass(frozen=True, slots=True)
class GasHeat:
    """Heat of compression that has not yet left the air: ``fraction`` of the adiabatic rise, ``time_constant_s``."""

    __pydantic_config__ = _STRICT_KEYS
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.0
    time_constant_s: Positive = 1.0


@dataclass(frozen=True, slots=True)
class Temperature:
    """Temperature of the sealed air above that of the reset: a drift, and a warming that settles."""

    __pydantic_config__ = _STRICT_KEYS
    drift_k_per_s: Finite = 0.0
    warming_k: Finite = 0.0
    warming_time_constant_s: Positive = 300.0


@dataclass(frozen=True, slots=True)
class Softening:
    """Mullins softening (after Ogden and Roxburgh 1999): below the largest deformation so far the wall is softer.

    The loading that sets a new maximum follows the virgin curve. k1 is multiplied by 1 - ``strength``
    tanh((e_max^2 - e^2)/(``width`` e_fullscale^2)).
    """

    __pydantic_config__ = _STRICT_KEYS
    strength: Annotated[float, Field(ge=0, lt=1)] = 0.0
    width: Positive = 0.3


@dataclass(frozen=True, slots=True)
class Conditioning:
    """Gain that settles over load cycles: 1 + ``gain`` (1 - exp(-n/``cycles``)), n the cycles completed."""

    __pydantic_config__ = _STRICT_KEYS
    gain: Annotated[float, Field(gt=-0.5, lt=0.5)] = 0.0
    cycles: Positive = 3.0


@dataclass(frozen=True, slots=True)
class BladderParameters:
    """A bladder's physics; every effect is off by default.

    ``k1``, ``k2`` in N/m and ``c`` in N s/m as in Table 1 of Chinimilli 2016; ``x_over_nrt`` is x0^2/(nRT) in m/N.
    ``static_exponent`` m passes the load as full_scale (F/full_scale)^m (contact that grows with load);
    ``wall_hardening`` beta stiffens k1 by 1 + beta (e/e_fullscale)^2.
    """

    __pydantic_config__ = _STRICT_KEYS
    k1: NotNegative
    k2: Positive
    c: Positive = 1.0
    effective_area_m2: Positive = 0.0266
    x_over_nrt: Positive = X_OVER_NRT
    full_scale_n: Positive = 800.0
    gas: Literal["linear", "boyle"] = "linear"
    static_exponent: Annotated[float, Field(gt=0.2, lt=5)] = 1.0
    wall_hardening: Annotated[float, Field(gt=-0.3, lt=10)] = 0.0
    hysteresis: Hysteresis = field(default_factory=Hysteresis)
    leak: Leak = field(default_factory=Leak)
    gas_heat: GasHeat = field(default_factory=GasHeat)
    temperature: Temperature = field(default_factory=Temperature)
    softening: Softening = field(default_factory=Softening)
    conditioning: Conditioning = field(default_factory=Conditioning)

    @property
    def static_gain_pa_per_n(self) -> float:
        """Gauge pressure per newton at rest with all effects off: 1/(A (1 + k1 x0^2/(nRT)))."""
        return 1.0 / (self.effective_area_m2 * (1.0 + self.k1 * self.x_over_nrt))

    @property
    def full_scale_deformation(self) -> float:
        """Deformation e at full-scale load, all effects off."""
        return self.full_scale_n * self.static_gain_pa_per_n / AMBIENT_PA

    def nominal_pressure_pa(self, load_n: float) -> float:
        """Gauge pressure expected under a held load, without leak, heat and hysteresis."""
        share = float((load_n / self.full_scale_n) ** self.static_exponent)
        return self.static_gain_pa_per_n * self.full_scale_n * share


class SimulatedBladder(Bladder):
    """A bladder that keeps its memory from one `press` to the next; see the module for what it leaves out."""

    def __init__(self, parameters: BladderParameters) -> None:
        self.parameters = parameters
        friction = parameters.hysteresis
        self._shape, loop = loop_shape(friction.half_width_n, friction.spread, parameters.full_scale_n)
        self._loop_n = friction.strength * parameters.full_scale_n / loop if friction.strength else 0.0
        self._constants = self._pack()
        self.reset()

    def reset(self) -> None:
        """Back to rest: unloaded for ever, memory forgotten, at the reset's temperature."""
        self._state = np.zeros(STATE_SIZE)
        self._turning = np.zeros(MEMORY)
        self._partial = np.zeros(MEMORY)
        self.deformation = np.zeros(0)

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa under ``load_n`` (n,) in N, compression positive; memory carries on.

        The load is linear between samples, and from the last sample of the call before (or rest) to the first; the
        inner step is 1 ms or finer. ``deformation`` (n,) then holds the compressed share of the volume. Raises
        `UsageError` where a load is not finite.
        """
        load = np.ascontiguousarray(load_n, dtype=float)
        if not np.isfinite(load).all():
            at = int(np.argmin(np.isfinite(load)))
            raise UsageError(f"load sample {at + 1} of {load.size} is not finite: fill gaps before pressing")
        finer = max(1, ceil(LOWEST_STEP_HZ / sample_rate_hz - 1e-9))
        pressure = np.empty(load.size)
        self.deformation = np.empty(load.size)
        advance(
            load, finer, 1.0 / (sample_rate_hz * finer), self._constants, self._shape,
            self._state, self._turning, self._partial, pressure, self.deformation,
        )  # fmt: skip
        return pressure * AMBIENT_PA

    def _pack(self) -> Array:
        """The kernel's constants, in the order in which `simulators.stepping.advance` unpacks them."""
        p = self.parameters
        return np.array([
            p.k1 * p.x_over_nrt,
            p.k2 * p.x_over_nrt,
            p.k2 / p.c,
            1.0 / (p.effective_area_m2 * AMBIENT_PA),
            p.full_scale_n,
            p.full_scale_deformation,
            1.0 if p.gas == "boyle" else 0.0,
            p.static_exponent,
            p.wall_hardening,
            self._loop_n,
            p.leak.linear_per_s,
            p.leak.orifice_per_s,
            p.gas_heat.fraction * (HEAT_RATIO - 1.0),
            1.0 / p.gas_heat.time_constant_s,
            p.temperature.drift_k_per_s / AMBIENT_K,
            p.temperature.warming_k / AMBIENT_K,
            1.0 / p.temperature.warming_time_constant_s,
            p.softening.strength,
            p.softening.width,
            p.conditioning.gain,
            1.0 / p.conditioning.cycles,
        ])  # fmt: skip
