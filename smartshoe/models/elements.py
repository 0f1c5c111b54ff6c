"""What the linear network of wall and gas is made of (`smartshoe.models.core`)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Arm:
    """A Maxwell arm of the wall: stiffness ``share`` of (gas + k1), relaxing at ``rate_per_s``."""

    share: float
    rate_per_s: float


@dataclass(frozen=True, slots=True)
class Heat:
    """Heat of compression: ``share`` of the isothermal pressure rise, leaving at ``rate_per_s``."""

    share: float
    rate_per_s: float


@dataclass(frozen=True, slots=True)
class Leak:
    """Air lost at ``rate_per_s`` times the pressure."""

    rate_per_s: float


Element = Arm | Heat | Leak
