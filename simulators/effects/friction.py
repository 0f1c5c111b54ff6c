"""Wall: rate-independent friction, driven by the wall's motion rather than by the load.

*Stick-slip*: Jenkins elements (a spring behind a slider) whose slip distances are spread log-uniformly, on the
deformation (Iwan 1966); the load enters only through the balance. *Bouc-Wen*: z' = e' (1 - |z|^n (gamma + beta sgn(e'
z)))/width (Wen 1976) on the deformation, by Heun's rule; with gamma = 0 and n = 1 it is Dahl's friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS
from smartshoe.arrays import Array

ELEMENTS = 24

SlipShare = Annotated[float, Field(gt=1e-3, lt=1)]


@dataclass(frozen=True, slots=True)
class StickSlipParameters:
    """Sliders that together hold ``strength`` of full-scale load once all of them slip.

    They begin to slip between ``first_slip`` and ``last_slip`` of the full-scale deformation after a reversal.
    """

    __pydantic_config__ = STRICT_KEYS
    strength: Annotated[float, Field(ge=0, le=0.4)] = 0.0
    first_slip: SlipShare = 0.01
    last_slip: SlipShare = 0.2

    def elements(self, full_scale: float, full_e: float) -> tuple[Array, Array]:
        """Each element's spring constant (stress per deformation) and largest stress, for a full-scale stress."""
        if self.strength == 0.0:
            return np.zeros(0), np.zeros(0)
        slip = np.geomspace(self.first_slip, self.last_slip, ELEMENTS) * full_e
        greatest = np.full(ELEMENTS, self.strength * full_scale / ELEMENTS)
        return greatest / slip, greatest


@dataclass(frozen=True, slots=True)
class BoucWenParameters:
    """Friction up to ``strength`` of full-scale load, reached over about ``width`` of the full-scale deformation.

    ``gamma`` and beta = 1 - gamma shape the sliding and the reversal; the friction is passive for gamma up to a half.
    """

    __pydantic_config__ = STRICT_KEYS
    strength: Annotated[float, Field(ge=0, le=0.4)] = 0.0
    width: Annotated[float, Field(gt=5e-3, le=2)] = 0.1
    exponent: Annotated[float, Field(ge=1, le=4)] = 1.5
    gamma: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.3
