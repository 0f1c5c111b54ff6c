"""Where the units lie in the insole, and the centre of pressure from these four points.

Places are shares of the insole's length: along from the heel's end, medial from the long axis (positive towards the
other foot), after the anatomy of an adult's foot: heel pad at an eighth, fourth metatarsal head at five eighths, first
at seven tenths, great toe at nine tenths. They are typical values, not measured on the shoe of the paper.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smartshoe.arrays import Array

PLACES: Mapping[str, tuple[float, float]] = {
    "heel": (0.13, 0.0),
    "meta4": (0.63, -0.09),
    "meta1": (0.71, 0.08),
    "toe": (0.90, 0.07),
}
# The insole's outline (along, medial), from the heel forwards along the inner edge and back along the outer one.
OUTLINE: tuple[tuple[float, float], ...] = (
    (0.00, 0.00), (0.02, 0.07), (0.10, 0.115), (0.22, 0.11), (0.40, 0.075), (0.55, 0.095), (0.70, 0.145),
    (0.82, 0.145), (0.93, 0.115), (0.99, 0.055), (1.00, 0.01), (0.97, -0.05), (0.88, -0.115), (0.75, -0.165),
    (0.62, -0.175), (0.45, -0.155), (0.25, -0.13), (0.10, -0.115), (0.02, -0.07),
)  # fmt: skip
LEAST_SHARE = 0.05  # of the foot's median peak: below it the centre of pressure is only noise


def centre_of_pressure(
    load: Array, regions: Sequence[str], least: float, places: Mapping[str, tuple[float, float]] = PLACES
) -> Array:
    """Centre of pressure (n, 2), along and medial as shares of the insole's length, from loads (n, r).

    It is estimated from the units alone and so always lies between them. NaN where the whole load is below ``least``.
    """
    at = np.array([places[region] for region in regions])
    held = np.maximum(load, 0.0)
    whole = held.sum(axis=1)
    on = whole > max(least, 0.0)
    centre = np.full((load.shape[0], 2), np.nan)
    centre[on] = (held[on] @ at) / whole[on, None]
    return centre
