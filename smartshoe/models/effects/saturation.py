"""A sensor or an amplifier that runs out of range."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._false_position import closer_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

RAIL_KNEE = 5e-4  # of full scale: below a sensor's noise, but smooth enough for derivatives
MOST_LOST = 0.5  # of the slope: a reading that loses more tells no load
LOWEST = 0.55  # of full scale: what begins below it is a curve like any other, unless more than half is lost


def _above(pressure: Array, level: float, knee: float) -> Array:
    """max(pressure - level, 0) (n,), rounded over about ``knee`` on either side of the level; 0 at pressure 0."""
    over, rest = pressure - level, np.exp(-level / knee)
    tail: Array = knee * (np.log1p(np.exp(-np.abs(over) / knee)) - np.log1p(rest))
    return np.maximum(over, 0.0) + tail


class Saturation(Effect):
    """P - s above(P): of the slope above the level, 1 - s is left (s = 1: the output stands still).

    And max(P, 0) with the weight ``rail``, for a sensor whose membrane does not follow a pressure below zero. Where
    more than half of the slope is lost above the level, what was clipped is lost, and there is no inverse; with less it
    is a bend, which is undone. The block comes after the sensor's drifts and gain, as rails do. With a level far below
    the top or a wide knee it would be a curve like any other: the bounds leave those to other blocks. Once it is found
    and ends there, the level may lie lower: a sensor whose range is half of what it is to read.
    """

    name, family, stage, place = "saturation", "saturation", "sensor", "logger"
    branch = "end of range"
    is_memoryless = True
    imitates = "static_curve"  # without ties at a rail it is a curve among curves
    says = "readings flatten near the largest one (or at zero) however the load goes on"
    parameters = (
        EffectParameter(
            "slope_lost", "1", "share of the slope lost above the level", 0.0, 0.0, 1.0, 0.1, natural="both"
        ),
        EffectParameter(
            "level",
            "FS_reading",
            "where it begins, from the reading without load on",
            None,
            LOWEST,
            1.5,
            0.1,
            kind_ends="lower",
            farthest=0.1,
        ),
        EffectParameter(
            "knee", "FS_reading", "half width of the transition", None, 1e-3, 0.08, 0.01, kind_ends="upper"
        ),
        EffectParameter("rail", "1", "share lost of a pressure below zero", 0.0, 0.0, 1.0, 0.1, natural="both"),
    )
    shapes = tuple(
        {"level": level, "knee": knee}
        for level, knee in ((0.65, 0.01), (0.8, 0.01), (0.9, 0.01), (0.97, 0.01), (0.9, 0.05))
    )
    exposed_by = by("peaks")
    separated_by = {
        "contact_area": by("peaks"),
        "sensor_nonlinearity": by("peaks"),
        "wall_hardening": by("peaks"),
    }
    clips = True
    why_not_undone = "what was clipped is lost"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The clipped reading (n,)."""
        lost, level, knee, rail = (float(value) for value in values)
        clipped = signal - lost * _above(signal, level, knee)
        if rail != 0.0:
            below = np.maximum(-signal, 0.0)
            inside = np.minimum(below, 2.0 * RAIL_KNEE)
            clipped += rail * (inside * inside / (4.0 * RAIL_KNEE) + below - inside)
        return clipped

    def kind_ends_at(self, values: Array) -> list[tuple[EffectParameter, float]]:
        """Also the level of a bend, which loses no more than half of the slope, far below the top."""
        lost, level, ends = float(values[0]), float(values[1]), super().kind_ends_at(values)
        is_bend = lost <= MOST_LOST and self.parameters[1].lower < level < LOWEST
        return [(self.parameters[1], level), *ends] if is_bend else ends

    def slope_left(self, signal: Array, values: Array) -> Array:
        """1 below the level and 1 - s above it; 1 - ``rail`` below zero."""
        lost, level, knee, rail = (float(value) for value in values)
        past = (signal - level) / knee
        passed = np.exp(np.minimum(past, 0.0)) / (1.0 + np.exp(-np.abs(past)))
        return 1.0 - lost * passed - rail * np.clip(-signal / (2.0 * RAIL_KNEE), 0.0, 1.0)

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """By false position; None where more than half of the slope is lost.

        Where the rail alone takes more, what lies above zero is undone, and readings below it stay as they are.
        """
        from smartshoe.kernels.memory import SOLVED, STEPS
        from smartshoe.kernels.saturation import saturation_undone

        lost, level, knee, rail = (float(value) for value in values)
        is_railed = rail > MOST_LOST
        if lost > MOST_LOST or (is_railed and lost == 0.0):
            return None
        if lost == rail == 0.0:
            return Memoryless(lambda signal, _: signal.copy(), "")
        rail = 0.0 if is_railed else rail
        rest = float(np.exp(-level / knee))
        at_zero = float(np.log1p(rest))
        least_below = 1.0 - lost * rest / (1.0 + rest) - rail

        def undo(signal: Array, time_s: Array) -> Array:
            out = np.empty(signal.size)
            given = lost, level, knee, at_zero, rail, 2.0 * RAIL_KNEE, least_below
            saturation_undone(np.ascontiguousarray(signal, dtype=float), *given, out)
            return np.where(signal < 0.0, signal, out) if is_railed else out

        corner = c_number(2.0 * RAIL_KNEE)
        body = f"""{{
    double low = x > 0.0 ? x : x / {c_number(least_below)}, high = x > 0.0 ? x / {c_number(1.0 - lost)} : x;
    double under = 0.0, over = 0.0, v = low;
    int k, stays = 0;
    for (k = 0; k < {STEPS}; k++) {{
        const double past = v - {c_number(level)}, below = v < 0.0 ? -v : 0.0;
        const double bent = {c_number(knee)} * (log1p(exp(-fabs(past) / {c_number(knee)})) - {c_number(at_zero)});
        const double inside = below < {corner} ? below : {corner};
        const double risen = inside * inside / (2.0 * {corner}) + below - inside;
        const double left = v - x - {c_number(lost)} * ((past > 0.0 ? past : 0.0) + bent) + {c_number(rail)} * risen;
        if (fabs(left) <= {SOLVED}) {{
            break;
        }}
        {closer_in_c("v")}
    }}
    x = v;
}}"""
        return Memoryless(undo, f"if (x > 0.0) {body}" if is_railed else body)
