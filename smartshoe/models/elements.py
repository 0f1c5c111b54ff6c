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

GAS_SHARE = 1.6 / 0.6  # heat's share for one of the reading: N/(N - 1) at the usual wall ratio N of the core


def relaxing(share: float, rate_per_s: float) -> Element:
    """Element by which a held reading creeps up by a ``share`` of itself, or falls if it is negative, to first order.

    An arm of negative stiffness would make the reading fall, too, but such a network may oscillate or grow without
    bound beside another arm. Arms and heats are springs and dampers: their poles and zeros stay real and negative for
    any share. At a wall ratio other than the usual one the two signs differ in size.
    """
    return Arm(share, rate_per_s) if share >= 0.0 else Heat(-GAS_SHARE * share, rate_per_s)
