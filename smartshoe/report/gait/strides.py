"""What a trial's charts, pages and figures take from a result: the strides that count, a foot's whole force."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait import FootSeries, GaitFindings, Stride
from smartshoe.gait.summary import of_main_activity


def whole_of(foot: FootSeries) -> Array:
    """The foot's whole force (n,) in N, or the sum of its readings where there is no force."""
    return foot.force_n if foot.force_n is not None else np.asarray(foot.load.sum(axis=1))


def main_strides(found: GaitFindings, foot: str) -> list[Stride]:
    """The foot's strides that the summary counts."""
    return [stride for stride in of_main_activity(found.strides) if stride.foot == foot]
