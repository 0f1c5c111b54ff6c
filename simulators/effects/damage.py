"""Wall: a permanent set that grows with the dose of load.

The wall's unloaded position moves with the load's creep damage, (f/f_fullscale)^exponent, so that pressure remains when
the load is removed (an exponent above one is Findley's stress exponent). A leak would lower the pressure instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS


@dataclass(frozen=True, slots=True)
class PermanentSetParameters:
    """``rate_per_s`` is the set gained per second of full-scale load, in units of the full-scale deformation."""

    __pydantic_config__ = STRICT_KEYS
    rate_per_s: Annotated[float, Field(ge=0, le=0.1)] = 0.0
    exponent: Annotated[float, Field(ge=1, le=4)] = 1.25
