"""The baseline: the paper's standard linear solid, with an offset and an initial state for each recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._sensitivity import marginal
from smartshoe.diagnosis._session import Session, fitted_of, stretch_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.core import USUAL_WALL_RATIO
from smartshoe.models.extended import BASELINE, ExtendedModel
from smartshoe.signals.lags import lagged

USUAL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 100.0, "mbar")  # about the mean of the paper's four units (Table 1)
_, SHARE, RATE = BASELINE
MOST_OF_WALL = 5.0  # share; beyond it the static gain is six times the instant one, and the wall a dashpot
FASTEST_PER_S = RATE.upper / (1.0 + SHARE.upper)  # pole; a wall's arm is slower, a sensor's lag seldom faster
POLES_A_DECADE = 9.2  # a resolution of the start; halved or doubled, no name changed in two cases
WALL_RATIOS = 1.02, 50.0  # bounds for any tube


def baseline_of(sessions: Sequence[Session], scale: Scale) -> ExtendedModel:
    """The best standard linear solid of positive gain, with the wall's ratio of `_wall_ratio`."""
    _, gain, share, pole = _best_by_sign(sessions).get(1.0, (0.0, 1.0, 0.0, 0.2))
    ratio = _wall_ratio(sessions, gain, scale)
    rate, slowest = pole * (1.0 + share), RATE.lower / stretch_of(sessions)
    return ExtendedModel(
        gain, share, rate, scale.load_n, scale.reading, scale.unit.symbol, (), ratio, slowest_per_s=slowest
    )


def has_negative_gain(sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether a solid of negative gain follows ``sessions`` clearly better than any of positive gain.

    Correlation does not tell the sign of a unit that is slower than its load, since it still rises when the load has
    fallen. Its static gain does.
    """
    errors = {sign: best[0] for sign, best in _best_by_sign(sessions).items()}
    return thresholds.clear * errors.get(-1.0, math.inf) < errors.get(1.0, math.inf)


def poles_per_s(stretch: float) -> Array:
    """The poles (k,) from which a fit may start, 1/s, for recordings ``stretch`` times longer than usual."""
    slowest = RATE.lower / stretch
    count = 1 + round(POLES_A_DECADE * math.log10(FASTEST_PER_S / slowest))
    return np.geomspace(slowest, FASTEST_PER_S, count)


def _best_by_sign(sessions: Sequence[Session]) -> dict[float, tuple[float, float, float, float]]:
    """Squared error, gain, share and pole (1/s) of the best solid for each sign of the gain.

    A grid over poles, linear in the rest, so that there is no local optimum. The relaxing share may have either sign: a
    baseline that cannot follow the data leaves structure that no effect made.
    """
    fitted = fitted_of(sessions)
    best: dict[float, tuple[float, float, float, float]] = {}
    poles = poles_per_s(stretch_of(sessions))
    for pole in poles:
        gram = np.zeros((3, 3))
        for session in fitted:
            load = session.conditions.load
            slow_load = lagged(load, session.conditions.step_s, 1.0 / float(pole))
            gram += marginal(np.column_stack([session.reading, load, slow_load]), session, float(pole))
        part = gram[1:, 1:] + 1e-9 * np.trace(gram[1:, 1:]) * np.eye(2)
        fast, slow = np.linalg.solve(part, gram[1:, 0])
        # reading = fast f + slow lag(f) = gain (s + a) / ((1 + kappa) s + a) f with a = pole (1 + kappa)
        share = float(slow / fast) if fast != 0.0 else SHARE.upper
        # Within the bounds of share and rate, since a fit starts there: beyond them it would be another solid.
        lowest = max(SHARE.lower, float(poles[0]) / pole - 1.0)
        shares = (share,) if lowest <= share <= SHARE.upper else (lowest, SHARE.upper)
        for share in shares:
            shape = np.array([1.0, share]) / (1.0 + share)
            gain = float(shape @ gram[1:, 0] / (shape @ part @ shape))
            error = float(gram[0, 0] - gain * (shape @ gram[1:, 0]))
            sign = math.copysign(1.0, gain)
            if sign not in best or error < best[sign][0]:
                best[sign] = error, gain, share, float(pole)
    return best


def with_usual_arm(model: ExtendedModel) -> ExtendedModel:
    """``model`` with a usual arm, to start a fit from where its own arm is bent by an effect."""
    return replace(model, relaxing_share=USUAL.relaxing_share, relaxation_rate_per_s=USUAL.relaxation_rate_per_s)


def has_arm_beyond_memory(model: ExtendedModel, thresholds: Thresholds) -> bool:
    """Whether the baseline's arm is beyond all usual time constants: then it follows an effect, not the wall."""
    return not thresholds.memory_s[0] < 1.0 / model.relaxation_rate_per_s < thresholds.memory_s[-1]


def has_extreme_arm(model: ExtendedModel) -> bool:
    """Whether no wall has such an arm: it follows an effect, or another kind of sensor."""
    share, rate = model.relaxing_share, model.relaxation_rate_per_s
    return not (SHARE.lower < share < MOST_OF_WALL and model.slowest_per_s < rate < FASTEST_PER_S)


def _wall_ratio(sessions: Sequence[Session], gain: float, scale: Scale) -> float:
    """1 + k1 x0^2/(nRT) from the static gain where an effective area is declared; else the usual ratio."""
    recording = next((one.recording for one in sessions if "effective_area_m2" in one.recording.metadata), None)
    if recording is None or scale.unit.quantity != "pressure":
        return USUAL_WALL_RATIO
    area_m2 = recording.positive("effective_area_m2", "m2")
    pascal_per_newton = gain * float(scale.unit.to_si(np.array([abs(scale.reading)]))[0]) / scale.load_n
    ratio = 1.0 / (area_m2 * pascal_per_newton)
    return ratio if WALL_RATIOS[0] < ratio < WALL_RATIOS[1] else USUAL_WALL_RATIO
