"""Wall: relaxation beyond the one arm of the paper's standard linear solid.

*Second relaxation*: a Maxwell arm with an Eyring dashpot, whose viscosity falls with stress: q' = (width/tau) sinh((e -
q)/width); a single exponential only for small strain. *Power-law creep*: a spring-pot sigma = E D^alpha e between two
times, as a dense ladder of Maxwell arms (Mainardi 2010, ch. 3): t^-alpha = 1/Gamma(alpha) int tau^-alpha exp(-t/tau)
dtau/tau.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gamma, log
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, NotNegative, Positive
from smartshoe.arrays import Array

ARMS = 48
SHORTEST_S, LONGEST_S = 5e-3, 1e5


@dataclass(frozen=True, slots=True)
class SecondRelaxationParameters:
    """A second arm of stiffness ``k3`` in N/m.

    ``eyring_width`` is the strain, in units of the full-scale deformation, at which its dashpot begins to thin.
    """

    __pydantic_config__ = STRICT_KEYS
    k3: NotNegative = 0.0
    time_constant_s: Annotated[float, Field(ge=0.02, le=1e5)] = 5.0
    eyring_width: Positive = 0.6


@dataclass(frozen=True, slots=True)
class PowerLawCreepParameters:
    """A spring-pot: relaxation modulus ``stiffness`` (t/1 s)^-``exponent`` in N/m."""

    __pydantic_config__ = STRICT_KEYS
    stiffness: NotNegative = 0.0
    exponent: Annotated[float, Field(gt=0.02, lt=0.98)] = 0.3

    def arms(self) -> tuple[Array, Array]:
        """Stiffness in N/m and rate in 1/s of each arm of the ladder; empty where it is off."""
        if self.stiffness == 0.0:
            return np.zeros(0), np.zeros(0)
        tau_s = np.geomspace(SHORTEST_S, LONGEST_S, ARMS)
        spacing = log(LONGEST_S / SHORTEST_S) / (ARMS - 1)
        weight = self.stiffness * tau_s**-self.exponent * spacing / gamma(self.exponent)
        weight[[0, -1]] *= 0.5
        return weight, 1.0 / tau_s
