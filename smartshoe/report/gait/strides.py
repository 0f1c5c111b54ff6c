"""What charts, pages and figures use of a trial: the strides that count, and the force on the whole foot."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait import FootSeries, GaitFindings, Stride
from smartshoe.gait.summary import of_main_activity


def whole_of(foot: FootSeries) -> Array:
    """The force (n,) in N on the whole foot, or the sum of its units' readings if no force is known."""
    return foot.force_n if foot.force_n is not None else np.asarray(foot.load.sum(axis=1))


def main_strides(found: GaitFindings, foot: str) -> list[Stride]:
    """The foot's strides on which the summary is based."""
    return [stride for stride in of_main_activity(found.strides) if stride.foot == foot]
