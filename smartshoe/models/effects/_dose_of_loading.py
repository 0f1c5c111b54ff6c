"""The dose that a unit has borne, by loadings and by time: flexible blocks of set and of softening grow with it.

X = c S + (1 - c) D / 10 s: S is the sum of loadings, z^m from trough to peak, D the integral of p^m over time. z is p
through a play, since the noise of a load would else count as loadings without end. Both begin at 0 in each session.
What grows with the dose does so ever more slowly: X0 log(1 + X/X0).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import NO_LOAD, SETTLED, Undone, cleaned, dead_zone
from smartshoe.models.effects.effect import Conditions, EffectParameter

HALF_WIDTH = 0.01  # of full scale: a loading is more than twice of it, so that noise does not count
MOST_ROUNDS = 80  # 0.6, of the largest set that grows with the fourth power of a loading, to this power is 2e-18
USUAL_STROKE_S = 10.0  # seconds under full-scale load that count as one loading to it


def shape_parameters(most_early: float) -> tuple[EffectParameter, ...]:
    """The parameters ``by_stroke`` c, ``exponent`` m and ``early`` X0, the last up to ``most_early``."""
    return (
        EffectParameter("by_stroke", "1", "share of it that goes by loadings, not by time", None, 0.0, 1.0, 0.5),
        EffectParameter("exponent", "1", "power of the load that it grows with", None, 0.7, 4.0, 1.0),
        EffectParameter("early", "1", "loadings to full scale after which it has slowed to a half", None, 0.3,
                        most_early, 5.0),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Dose:
    """What grows with the dose, by about ``size`` with the first loading to full scale and 10 s there."""

    size: float
    by_stroke: float
    exponent: float
    early: float

    def grown(self, signal: Array, conditions: Conditions) -> Array:
        """(n,) how far it has grown: ``size`` X0 log(1 + X/X0)."""
        flow = np.maximum(signal, 0.0) ** self.exponent
        z = np.maximum(cleaned(signal, max(HALF_WIDTH, dead_zone(conditions))), 0.0) ** self.exponent
        held = 0.5 * conditions.step_s * (1.0 - self.by_stroke) / USUAL_STROKE_S
        dose = np.zeros(signal.size)
        np.cumsum(held * (flow[1:] + flow[:-1]) + self.by_stroke * np.maximum(np.diff(z), 0.0), out=dose[1:])
        return self.size * self.early * np.log1p(dose / self.early)

    def undone(self, step_s: float, is_gain: bool) -> Undone:
        """The inverse: what was added is subtracted, or (``is_gain``) a gain is divided by.

        Exact, since the dose is of the block's input, which the inverse gives out.
        """
        from smartshoe.kernels.dose import dose_undone

        held = 0.5 * step_s * (1.0 - self.by_stroke) / USUAL_STROKE_S
        constants = (
            is_gain,
            self.size,
            self.early,
            held,
            self.by_stroke,
            self.exponent,
            HALF_WIDTH,
            MOST_ROUNDS,
            SETTLED,
        )
        members = ("dose", "flow", "place")

        def body(of: Mapping[str, str]) -> str:
            return self._c_body(of, held, is_gain)

        return Undone(dose_undone, constants, np.array([0.0, 0.0, NO_LOAD]), members, body)

    def _c_body(self, of: Mapping[str, str], held: float, is_gain: bool) -> str:
        m, width, scale = c_number(self.exponent), c_number(HALF_WIDTH), c_number(self.size * self.early)
        grown = f"{scale} * log(1.0 + ({of['dose']} + more) * {c_number(1.0 / self.early)})"
        return f"""{{
    const double low = {of["place"]} < {NO_LOAD} && {of["place"]} > 0.0 ? {of["place"]} : 0.0;
    const double begun = low > 0.0 ? pow(low, {m}) : 0.0;
    double p = x;
    double flow = x > 0.0 ? pow(x, {m}) : 0.0;
    double more = 0.0;
    int k;
    if ({of["place"]} >= {NO_LOAD}) {{
        {of["place"]} = x;
    }} else {{
        for (k = 0; k < {MOST_ROUNDS}; k++) {{
            const double z = p - {width}, guess = p;
            flow = p > 0.0 ? pow(p, {m}) : 0.0;
            more = {c_number(held)} * ({of["flow"]} + flow);
            if (z > low) {{
                more = more + {c_number(self.by_stroke)} * (pow(z, {m}) - begun);
            }}
            p = {f"x / (1.0 + {grown})" if is_gain else f"x - {grown}"};
            if (fabs(p - guess) <= {c_number(SETTLED)}) {{
                break;
            }}
        }}
        {of["dose"]} += more;
        if ({of["place"]} < p - {width}) {{
            {of["place"]} = p - {width};
        }} else if ({of["place"]} > p + {width}) {{
            {of["place"]} = p + {width};
        }}
    }}
    {of["flow"]} = flow;
    x = p;
}}"""
