"""A dead band: gaps in the contact must be closed before load reaches the tube."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._false_position import closer_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

LEAST_ONSET = 1e-9  # stands for an onset of 0
MOST_OF_BEND = 0.3  # of full scale: a band that is wider is dead at first, or a curve like any other
DEAD = 0.1  # of the slope: what is left of it in a dead band
MOST = 1.3  # times the lost load: a band with a sharp end loses a little more just before it


class DeadBand(Effect):
    """f - f0 m(f/f0), m(x) = x at first and 1 later, rounded over ``softness``: f - f0 once all gaps are closed.

    m(x) = [k s(b/k) - k s((b - x)/k) - a e (1 - exp(-x/a))]/[k s(b/k) - a e], b = 1 + a, s(y) = ln(1 + exp y), and e
    the slope of s at b/k. ``onset`` a, over the lost load, is the load over which the loss sets in: 0 for gaps, which
    lose all at once; more where something beside the tube is touched, bears along and then yields. Loads below zero
    pass unchanged.
    """

    name, family, stage, place = "dead_band", "dead_band", "contact", "contact"
    is_memoryless = True
    is_steep_undone = True
    says = "the first newtons of each loading do not reach the tube: no reading at low loads, a constant lack above"
    parameters = (
        EffectParameter("lost_load", "FS_load", "load that is lost once all gaps are closed", 0.0, 0.0, 0.8, 0.01,
                        kind_ends="upper"),
        EffectParameter("softness", "1", "how far the gaps spread, over the lost load", None, 0.03, 3.0, 0.3),
        EffectParameter("onset", "1", "load over which the loss sets in, over the lost load", None, 0.0, 1.5, 0.3,
                        absent=0.0, natural="lower"),
    )  # fmt: skip
    shapes = ({"softness": 0.2, "onset": 0.0}, {"softness": 0.6, "onset": 0.0}, {"softness": 0.6, "onset": 0.6})
    exposed_by = by("low_loads", "rests")
    separated_by = {
        "contact_area": by("low_loads"),
        "dropouts": by("repeats"),
        "load_cell_tare": by("command"),
        "sensor_nonlinearity": by("low_loads"),
        "zero_offset": by("low_loads"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        if values[0] == 0.0:
            return signal.copy()
        return _passed(signal, *(float(value) for value in values))

    def kind_ends_at(self, values: Array) -> list[tuple[EffectParameter, float]]:
        """Also a large loss by gaps that spread so far that the first newtons pass in part."""
        lost, soft, onset = (float(value) for value in values)
        is_bend = lost >= MOST_OF_BEND and 1.0 / (1.0 + np.exp((1.0 + onset) / soft)) > DEAD
        return [(self.parameters[0], lost)] if is_bend else super().kind_ends_at(values)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """By false position from y to y + f0; loads in a sharp band cannot be told apart, nor can noise about zero."""
        from smartshoe.kernels.dead_band import dead_band_undone
        from smartshoe.kernels.memory import SOLVED, STEPS

        lost, soft, onset = (float(value) for value in values)
        if lost == 0.0:
            return Memoryless(lambda signal, _: signal.copy(), "")
        begins, whole, late = _constants(soft, onset)

        def undo(signal: Array, time_s: Array) -> Array:
            out = np.empty(signal.size)
            given = lost, soft, onset, max(onset, LEAST_ONSET), begins, whole, late, MOST * lost
            dead_band_undone(np.ascontiguousarray(signal, dtype=float), *given, out)
            return out

        body = f"""if (x > 0.0) {{
    double low = x, high = x + {c_number(MOST * lost)}, under = 0.0, over = 0.0, v = low;
    int k, stays = 0;
    for (k = 0; k < {STEPS}; k++) {{
        const double z = v / {c_number(lost)}, y = ({c_number(1.0 + onset)} - z) / {c_number(soft)};
        const double s = (y > 0.0 ? y : 0.0) + log1p(exp(-fabs(y)));
        const double sets_in = {c_number(late)} * expm1(-z / {c_number(max(onset, LEAST_ONSET))});
        const double left = v - x - {c_number(lost / whole)} * ({c_number(begins)} - {c_number(soft)} * s + sets_in);
        if (fabs(left) <= {SOLVED}) {{
            break;
        }}
        {closer_in_c("v")}
    }}
    x = v;
}}"""
        return Memoryless(undo, body)


def _soft(y: Array) -> Array:
    """s(y) = ln(1 + exp y) (n,), without overflow."""
    return np.maximum(y, 0.0) + np.log1p(np.exp(-np.abs(y)))


def _constants(soft: float, onset: float) -> tuple[float, float, float]:
    """Of the formula k s(b/k), the divisor of m, and a e."""
    end = np.array([(1.0 + onset) / soft])
    begins, late = soft * float(_soft(end)[0]), onset / float(1.0 + np.exp(-end[0]))
    return begins, begins - late, late


def _passed(load: Array, lost: float, soft: float, onset: float) -> Array:
    """The load (n,) that reaches the tube, by the formula."""
    begins, whole, late = _constants(soft, onset)
    z = np.maximum(load / lost, 0.0)
    sets_in = late * np.expm1(-z / max(onset, LEAST_ONSET))
    out = load - lost / whole * (begins - soft * _soft((1.0 + onset - z) / soft) + sets_in)
    return np.where(load > 0.0, out, load)
