"""How sure a name is: what the data cannot separate, and a probability whose calibration a simulated bank measures."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, log

from smartshoe.diagnosis.result import Rival

SEPARATED = 6.0  # difference of -2 log likelihood under which another effect does as well

# Log odds of "the name was right" over the logs of the margin and of the fall: logistic regression over 1484 names, 34
# of them wrong, of the bank's cases that had been looked at (docs/diagnosis.md). Names are right about as often
# whatever the margin, so that the slopes are small; a margin near zero is told by the equivalents.
INTERCEPT, PER_LOG_MARGIN, PER_LOG_FALL = 3.59, 0.269, -0.136


def inseparable(rivals: Sequence[Rival]) -> tuple[str, ...]:
    """The effects that this data cannot tell from the one that was named."""
    return tuple(rival.effect for rival in rivals if rival.margin < SEPARATED)


def confidence(rivals: Sequence[Rival], fall: float) -> float:
    """Probability that the name is right."""
    margin = min((rival.margin for rival in rivals), default=fall)
    score = INTERCEPT + PER_LOG_MARGIN * log(max(margin, 1.0)) + PER_LOG_FALL * log(max(fall, 1.0))
    return 1.0 / (1.0 + exp(-score))
