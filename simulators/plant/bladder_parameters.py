"""The parameters of a simulated bladder; `simulators.plant.bladder` has its equations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, Finite, NotNegative, Positive
from simulators.effects.contact import ContactParameters
from simulators.effects.damage import PermanentSetParameters
from simulators.effects.friction import BoucWenParameters, StickSlipParameters
from simulators.effects.outside import Odd
from simulators.effects.relaxation import PowerLawCreepParameters, SecondRelaxationParameters
from smartshoe.arrays import Array

AMBIENT_PA = 101_325.0
AMBIENT_K = 300.0
HEAT_RATIO = 1.4  # of air
X_OVER_NRT = 0.38113  # x0^2/(nRT) in m/N, Chinimilli 2016, below eq. (4)
TUBE_DIAMETER_M = 2e-3
BESSEL_ZEROS = np.array([2.404826, 5.520078, 8.653728, 11.791534, 14.930918, 18.071064])  # of J0


@dataclass(frozen=True, slots=True)
class HysteresisParameters:
    """Rate-independent friction of wall and contact (`simulators.plant.preisach`).

    ``strength`` is half of the major loop's greatest height, as a fraction of full-scale load; ``half_width_n`` (1 +-
    ``spread``) is the relays' half width.
    """

    __pydantic_config__ = STRICT_KEYS
    kind: Literal["preisach"] = "preisach"
    strength: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    half_width_n: Positive = 40.0
    spread: Annotated[float, Field(gt=0, le=1)] = 0.9


@dataclass(frozen=True, slots=True)
class LeakParameters:
    """Air that leaves the tube: ``linear_per_s`` times p/p0, ``orifice_per_s`` times sqrt(p/p0) (turbulent).

    Or by compressible flow: ``capillary_per_s`` through a narrow channel (Poiseuille, ((1 + p)^2 - 1)/2 for p/p0),
    ``nozzle_per_s`` through a hole (Saint-Venant and Wantzel, laminar near zero), also about sqrt(p/p0).
    """

    __pydantic_config__ = STRICT_KEYS
    linear_per_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    orifice_per_s: Annotated[float, Field(ge=0, le=1)] = 0.0
    capillary_per_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    nozzle_per_s: Annotated[float, Field(ge=0, le=1)] = 0.0


@dataclass(frozen=True, slots=True)
class GasHeatParameters:
    """Heat of compression that has not yet left the air: ``fraction`` of the adiabatic rise, ``time_constant_s``.

    ``modes`` above one conduct it away through a cylinder of air: Fourier's series with the Bessel function's zeros
    j_n, shares 4/j_n^2 and rates j_n^2 (Carslaw and Jaeger 1959, 7.6); the time constant is the slowest mode's.
    """

    __pydantic_config__ = STRICT_KEYS
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.0
    time_constant_s: Positive = 1.0
    modes: Annotated[int, Field(ge=1, le=6)] = 1

    def spread(self) -> tuple[Array, Array]:
        """Each mode's share of the heat (they sum to one) and rate in 1/s."""
        zeros = BESSEL_ZEROS[: self.modes]
        share = 1.0 / zeros**2
        return share / share.sum(), (zeros / zeros[0]) ** 2 / self.time_constant_s


@dataclass(frozen=True, slots=True)
class TemperatureParameters:
    """Temperature of the sealed air above that at the reset: a drift, and a warming that settles."""

    __pydantic_config__ = STRICT_KEYS
    drift_k_per_s: Finite = 0.0
    warming_k: Finite = 0.0
    warming_time_constant_s: Positive = 300.0


@dataclass(frozen=True, slots=True)
class SofteningParameters:
    """Mullins softening (after Ogden and Roxburgh 1999): below its largest deformation so far the wall is softer.

    Loading that sets a new maximum follows the virgin curve. k1 is multiplied by 1 - ``strength`` tanh((e_max^2 -
    e^2)/(``width`` e_fullscale^2)).
    """

    __pydantic_config__ = STRICT_KEYS
    strength: Annotated[float, Field(ge=0, lt=1)] = 0.0
    width: Positive = 0.3


@dataclass(frozen=True, slots=True)
class ConditioningParameters:
    """Gain that settles over load cycles: 1 + ``gain`` (1 - exp(-n/``cycles``)), n the cycles completed."""

    __pydantic_config__ = STRICT_KEYS
    gain: Annotated[float, Field(gt=-0.5, lt=0.5)] = 0.0
    cycles: Positive = 3.0


@dataclass(frozen=True, slots=True)
class BladderParameters:
    """A bladder's physics; every effect is off by default.

    ``k1``, ``k2`` in N/m and ``c`` in N s/m as in Table 1 of Chinimilli 2016; ``x_over_nrt`` is x0^2/(nRT) in m/N.
    ``static_exponent`` m transforms the load to full_scale (F/full_scale)^m (contact that grows with load);
    ``wall_hardening`` beta stiffens k1 by 1 + beta (e/e_fullscale)^2; ``wall_stiffening`` kappa makes its force
    sinh(kappa x)/kappa, x = e/e_fullscale (Fung 1967). The nested effects are in `simulators.effects`.
    """

    __pydantic_config__ = STRICT_KEYS
    k1: NotNegative
    k2: Positive
    c: Positive = 1.0
    effective_area_m2: Positive = 0.0266
    x_over_nrt: Positive = X_OVER_NRT
    full_scale_n: Positive = 800.0
    gas: Literal["linear", "boyle"] = "linear"
    static_exponent: Annotated[float, Field(gt=0.2, lt=5)] = 1.0
    wall_hardening: Annotated[float, Field(gt=-0.3, lt=10)] = 0.0
    hysteresis: HysteresisParameters = field(default_factory=HysteresisParameters)
    leak: LeakParameters = field(default_factory=LeakParameters)
    gas_heat: GasHeatParameters = field(default_factory=GasHeatParameters)
    temperature: TemperatureParameters = field(default_factory=TemperatureParameters)
    softening: SofteningParameters = field(default_factory=SofteningParameters)
    conditioning: ConditioningParameters = field(default_factory=ConditioningParameters)
    wall_stiffening: Annotated[float, Field(ge=0, le=6)] = 0.0
    second_relaxation: SecondRelaxationParameters = field(default_factory=SecondRelaxationParameters)
    power_law_creep: PowerLawCreepParameters = field(default_factory=PowerLawCreepParameters)
    stick_slip: StickSlipParameters = field(default_factory=StickSlipParameters)
    bouc_wen: BoucWenParameters = field(default_factory=BoucWenParameters)
    permanent_set: PermanentSetParameters = field(default_factory=PermanentSetParameters)
    contact: ContactParameters = field(default_factory=ContactParameters)
    odd: Odd = field(default_factory=Odd)

    @property
    def static_gain_pa_per_n(self) -> float:
        """Gauge pressure per newton at rest with all effects off: 1/(A (1 + k1 x0^2/(nRT)))."""
        return 1.0 / (self.effective_area_m2 * (1.0 + self.k1 * self.x_over_nrt))

    @property
    def full_scale_deformation(self) -> float:
        """Deformation e at full-scale load, with all effects off."""
        return self.full_scale_n * self.static_gain_pa_per_n / AMBIENT_PA

    def nominal_pressure_pa(self, load_n: float) -> float:
        """Gauge pressure expected under a held load, without leak, heat and hysteresis."""
        share = float((load_n / self.full_scale_n) ** self.static_exponent)
        return self.static_gain_pa_per_n * self.full_scale_n * share
