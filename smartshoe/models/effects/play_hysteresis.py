"""Friction of wall and contact that does not depend on rate: a bank of plays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._false_position import closer_in_c
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import Undone, dead_zone
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

HALF_WIDTHS = np.geomspace(0.003, 0.5, 20)  # of full scale
LEAST_LEVELLING = 0.5
LEVELS = np.linspace(0.0, 1.0, 101)


class PlayHysteresis(Effect):
    """f - h z, z a generalised Prandtl-Ishlinskii operator: plays of half widths 0.3 to 50 % of full scale.

    The weights of the plays have a lognormal density about ``width`` (``spread`` its standard deviation in ln r).
    ``openness`` 1 weighs stop operators, which slide at any load and so keep friction without load. 0 weighs relays
    that are all down without load, with a friction that grows with load b as b (1 - levelling b), so that the loop
    closes at zero (Mayergoyz 2003, ch. 1; Brokate and Sprekels 1996, ch. 2). Friction in proportion to the load
    (levelling 0, openness 0) is another gain for unloading, and no play: that is `load_unload_asymmetry`. h is half of
    the greatest height of the loop from zero to full scale and back.
    """

    name, family, stage, place = "play_hysteresis", "hysteresis", "wall", "wall"
    mechanism, never_fades = "friction", True
    says = "the reading lies lower while loading than while unloading, by the same amount at any rate"
    parameters = (
        EffectParameter("half_height", "FS_load", "half of the major loop's greatest height", 0.0, 0.0, 0.4, 0.01),
        EffectParameter("width", "FS_load", "half width of the play that matters most", None, 0.015, 0.3, 0.05),
        EffectParameter("spread", "1", "standard deviation of ln width over the plays", None, 0.3, 1.2, 0.5),
        EffectParameter("levelling", "1", "how far friction stops growing", None, LEAST_LEVELLING, 0.9, 0.3),
        EffectParameter(
            "openness", "1", "share of friction that is there without load too", None, 0.0, 1.0, 0.3, natural="both"
        ),
    )
    shapes = (
        {"width": 0.05, "spread": 0.5, "levelling": 0.6, "openness": 0.1},
        {"width": 0.15, "spread": 0.5, "levelling": 0.6, "openness": 0.1},
        {"width": 0.05, "spread": 0.8, "levelling": 0.6, "openness": 0.9},
    )
    exposed_by = by("rates", "peaks", "minor_loops")
    separated_by = {
        "bouc_wen_hysteresis": by("minor_loops"),
        "load_unload_asymmetry": by("minor_loops"),
        "mullins_softening": by("repeats"),
        "power_law_creep": by("rates"),
        "second_relaxation": by("rates"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load less friction."""
        if values[0] == 0.0:
            return signal.copy()
        from smartshoe.kernels.memory import relays

        half_widths, closed, open_ = _bank(dead_zone(conditions), *(float(value) for value in values[1:]))
        out = np.empty(signal.size)
        relays(np.ascontiguousarray(signal), half_widths, closed, open_, float(values[3]), -half_widths, out)
        return signal - float(values[0]) * out

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The load whose loop gives the output, by false position; exact."""
        from smartshoe.kernels.memory import relays_undone

        strength, levelling = float(values[0]), float(values[3])
        closed, open_ = _weights(HALF_WIDTHS, *(float(value) for value in values[1:]))
        members = tuple(f"play{k}" for k in range(HALF_WIDTHS.size))

        def body(of: Mapping[str, str]) -> str:
            return _c_body([of[member] for member in members], strength, levelling, closed, open_)

        return Undone(relays_undone, (strength, HALF_WIDTHS, closed, open_, levelling), -HALF_WIDTHS, members, body)


@lru_cache(maxsize=64)
def _bank(
    narrowest: float, width: float, spread: float, levelling: float, openness: float
) -> tuple[Array, Array, Array]:
    """Half widths (m,), none below ``narrowest``, and `_weights`; cached, since a fit asks for the same few often.

    Nobody may write to the arrays. They are not marked read-only, since kernels would be compiled once more for that.
    """
    half_widths = np.maximum(HALF_WIDTHS, narrowest)
    return half_widths, *_weights(half_widths, width, spread, levelling, openness)


def _weights(half_widths: Array, width: float, spread: float, levelling: float, openness: float) -> tuple[Array, Array]:
    """Weights (m,) of the relays and of the stops, for a loop of half height 1."""
    weight = np.exp(-0.5 * (np.log(HALF_WIDTHS / width) / spread) ** 2) / HALF_WIDTHS
    low = np.maximum(LEVELS[:, None] - 2.0 * half_widths, 0.0)
    up = np.maximum(np.minimum(LEVELS[:, None], 1.0 - 2.0 * half_widths), low)
    bent = 2.0 / 3.0 * levelling
    height = 0.5 * (up * up * (1.0 - bent * up) - low * low * (1.0 - bent * low)) @ weight
    return weight * ((1.0 - openness) / height.max()), weight * (openness / (half_widths @ weight))


def _c_body(states: list[str], strength: float, levelling: float, closed: Array, open_: Array) -> str:
    """The inverse's step in C."""
    from smartshoe.kernels.memory import SOLVED, STEPS

    count = len(states)

    def row(values: Array) -> str:
        return ", ".join(c_number(value) for value in values)

    bent, whole = c_number(2.0 / 3.0 * levelling), c_number(strength)
    load = "".join(f"    state[{k}] = {state};\n" for k, state in enumerate(states))
    save = "".join(f"    {state} = moved[{k}];\n" for k, state in enumerate(states))
    return f"""{{
    static const double half[{count}] = {{{row(HALF_WIDTHS)}}};
    static const double closed[{count}] = {{{row(closed)}}};
    static const double open[{count}] = {{{row(open_)}}};
    double state[{count}], moved[{count}];
    double low = x - 2.0 * {whole}, high = x + 2.0 * {whole}, under = 0.0, over = 0.0, v = low;
    int i, k, stays = 0;
{load}    for (k = 0; k < {STEPS}; k++) {{
        double left = v - x, g = v > 0.0 ? v : 0.0;
        const double above = g * g * (1.0 - {bent} * g);
        for (i = 0; i < {count}; i++) {{
            const double reach = g - 2.0 * half[i];
            double place = state[i] > reach ? state[i] : reach;
            double down, up;
            place = place < g ? place : g;
            moved[i] = place;
            down = reach > 0.0 ? reach : 0.0;
            up = place > 0.0 ? place : 0.0;
            left -= {whole} * closed[i]
                * (0.5 * (above + down * down * (1.0 - {bent} * down)) - up * up * (1.0 - {bent} * up));
            left -= {whole} * open[i] * (g - half[i] - place);
        }}
        if (fabs(left) <= {SOLVED}) {{
            break;
        }}
        {closer_in_c("v")}
    }}
    x = v;
{save}}}"""
