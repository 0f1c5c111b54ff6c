"""Found events against true ones: errors in time, events missed, events that are none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIKE_S = 0.1  # further apart, they are not the same event


@dataclass(frozen=True)
class Score:
    """Signed errors (m,) in s of the events that were found, and counts."""

    error_s: Array
    missed: int
    false: int
    true: int

    @property
    def median_ms(self) -> float:
        return 1e3 * float(np.median(np.abs(self.error_s)))

    @property
    def p95_ms(self) -> float:
        return 1e3 * float(np.quantile(np.abs(self.error_s), 0.95))

    @property
    def missed_percent(self) -> float:
        return 100.0 * self.missed / self.true

    @property
    def false_percent(self) -> float:
        return 100.0 * self.false / self.true


def score(found_s: Array, true_s: Array, begin_s: float = -np.inf, end_s: float = np.inf) -> Score:
    """Each true event with the nearest found one, within `LIKE_S`; a found one belongs to one true one at most.

    Only events between ``begin_s`` and ``end_s`` count, but those outside are there to be matched.
    """
    found_s, true_s = np.sort(found_s), np.sort(true_s)
    counts = (true_s > begin_s) & (true_s < end_s)
    if not found_s.size:
        return Score(np.zeros(0), int(counts.sum()), 0, int(counts.sum()))
    at = np.minimum(np.clip(np.searchsorted(found_s, true_s), 1, max(found_s.size - 1, 1)), found_s.size - 1)
    nearer = np.where(np.abs(found_s[at - 1] - true_s) < np.abs(found_s[at] - true_s), at - 1, at)
    error_s = found_s[nearer] - true_s
    good = np.abs(error_s) < LIKE_S
    unmatched = np.ones(found_s.size, dtype=bool)
    unmatched[nearer[good]] = False
    false = int(np.count_nonzero(unmatched & (found_s > begin_s) & (found_s < end_s)))
    return Score(error_s[good & counts], int(np.count_nonzero(~good & counts)), false, int(counts.sum()))


def scores(found, made, edge_s: float = 1.2):  # type: ignore[no-untyped-def]
    """Scores by event of a `GaitResult` against a `simulators.people.Trial`, both feet together.

    A stance cut by the record's end has no heel off that could be told: the last ``edge_s`` count for nothing.
    """
    end_s = made.time_s[-1] - edge_s
    result = {}
    for kind in ("heel_strike", "foot_flat", "heel_off", "toe_off"):
        parts = []
        for foot in found.feet:
            own = np.array([e.time_s for e in found.events if e.foot == foot and e.event == kind])
            parts.append(score(own, made.times_s(foot, kind), edge_s, end_s))
        result[kind] = Score(
            np.concatenate([p.error_s for p in parts]),
            sum(p.missed for p in parts),
            sum(p.false for p in parts),
            sum(p.true for p in parts),
        )
    return result
