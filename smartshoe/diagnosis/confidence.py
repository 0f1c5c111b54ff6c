"""How sure a name is: what the data cannot separate, and a probability whose calibration a simulated bank measures."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, log

from smartshoe.diagnosis.result import Rival

SEPARATED = 6.0  # difference of -2 log likelihood under which another effect does as well

# Log odds of "the name was right" over the logs of the margin and of the fall: logistic regression over the bank's set
# `calibrate` (docs/diagnosis.md), cases 0-99: 160 causes, of which three were wrong, so that the slopes are known to
# about a half. What matters is the margin as a share of the fall: no equation is exact, and the larger an effect, the
# larger what its error of shape moves.
INTERCEPT, PER_LOG_MARGIN, PER_LOG_FALL = 9.1, 1.0, -0.9


def inseparable(rivals: Sequence[Rival]) -> tuple[str, ...]:
    """The effects that this data cannot tell from the one that was named."""
    return tuple(rival.effect for rival in rivals if rival.margin < SEPARATED)


def confidence(rivals: Sequence[Rival], fall: float) -> float:
    """Probability that the name is right."""
    margin = min((rival.margin for rival in rivals), default=fall)
    score = INTERCEPT + PER_LOG_MARGIN * log(max(margin, 1.0)) + PER_LOG_FALL * log(max(fall, 1.0))
    return 1.0 / (1.0 + exp(-score))
