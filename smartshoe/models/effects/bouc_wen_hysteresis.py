"""Friction that does not depend on rate, with one state that turns over smoothly (Bouc and Wen)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._false_position import closer_in_c
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, NO_LOAD, Remembering, Undone, cleaned, dead_zone
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

WIDTHS, SPACINGS = 10.0, 240  # to how many widths the branch is tabulated, and in how many pieces


class BoucWenHysteresis(Remembering):
    """f - h (1 - l f) z, dz/df = (1 - |z|^n (gamma + beta sgn(f' z)))/width, gamma + beta = 1 (Wen 1976).

    z in [-1, 1] begins at 0. ``turn`` is beta - gamma: with 0 unloading begins in a straight line, 1 with n = 1 is
    Dahl's friction. ``fading`` l: friction falls with the load, as what slides comes to its end, and is 0 from 1/l on;
    below zero load it stays whole. Friction that grows with the load from nothing is `play_hysteresis`.
    """

    name, family, stage, place = "bouc_wen_hysteresis", "hysteresis", "wall", "wall"
    is_steep_undone = True
    mechanism, never_fades = "friction", True
    says = "the reading lies lower while loading than while unloading, at any rate, and friction is there at any load"
    parameters = (
        EffectParameter("half_height", "FS_load", "friction of a long slide without load", 0.0, 0.0, 0.4, 0.01),
        EffectParameter("width", "FS_load", "load over which friction turns over", None, 0.005, 1.0, 0.1),
        EffectParameter("exponent", "1", "n: how abruptly friction comes to its end value", None, 0.6, 5.0, 0.5),
        EffectParameter("turn", "1", "how much faster friction falls after a reversal", None, 0.0, 2.0, 0.5),
        EffectParameter("fading", "1", "share of friction that is gone under full load", None, 0.0, 1.0, 0.5,
                        absent=0.0, natural="both"),
    )  # fmt: skip
    shapes = tuple({"width": width, "exponent": 1.5, "turn": 0.5, "fading": 0.0} for width in (0.03, 0.1, 0.3))
    exposed_by = by("rates", "peaks", "minor_loops")
    separated_by = {
        "load_unload_asymmetry": by("minor_loops"),
        "play_hysteresis": by("minor_loops"),
        "power_law_creep": by("rates"),
        "second_relaxation": by("rates"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load less friction."""
        if values[0] == 0.0:
            return signal.copy()
        from smartshoe.kernels.memory import bouc_wen

        load = cleaned(signal, dead_zone(conditions))
        out = np.empty(load.size)
        bouc_wen(load, *_branch(values), np.array(START), out)
        return signal - float(values[0]) * np.clip(1.0 - float(values[4]) * load, 0.0, 1.0) * out

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """The load whose friction gives the output, by false position; exact for a load without noise.

        It is the only one where friction turns over less fast than load: half_height (1 + turn) < width.
        """
        from smartshoe.kernels.memory import SOLVED, STEPS, bouc_wen_undone

        strength, fading = float(values[0]), float(values[4])
        per_load, z, slope = _branch(values)

        def body(of: Mapping[str, str]) -> str:
            return _C_BODY.format(
                **of, points=z.size, z=_row(z), slope=_row(slope), last_point=z.size - 1, no_load=NO_LOAD,
                strength=c_number(strength), fading=c_number(fading), zone=c_number(dead_zone),
                per_load=c_number(per_load), steps=STEPS, solved=SOLVED, closer=closer_in_c("move"),
            )  # fmt: skip

        constants = (strength, fading, per_load, z, slope, dead_zone)
        return Undone(bouc_wen_undone, constants, np.array(START), ("last", "value", "direction", "place"), body)


START = (NO_LOAD, 0.0, 0.0, 0.0)


def _branch(values: Array) -> tuple[float, Array, Array]:
    """Pieces per load, and the rising branch of z with its slope at the ends of the pieces."""
    width, exponent, turn = (float(value) for value in values[1:4])
    return SPACINGS / (WIDTHS * width), *_rising(exponent, turn)


@lru_cache(maxsize=64)
def _rising(exponent: float, turn: float) -> tuple[Array, Array]:
    """The rising branch and its slope, cached, since a fit asks for the same few often.

    Nobody may write to the arrays. They are not marked read-only, since kernels would be compiled once more for that.
    """
    from smartshoe.kernels.memory import bouc_wen_branch

    z, slope = np.empty(SPACINGS + 1), np.empty(SPACINGS + 1)
    bouc_wen_branch(exponent, turn, WIDTHS / SPACINGS, z, slope)
    return z, slope


def _row(values: Array) -> str:
    return ", ".join(c_number(value) for value in values)


_AT = """{{
                const double at = {place};
                const int i = at >= {last_point}.0 ? {last_point} - 1 : (int)at;
                const double t = at >= {last_point}.0 ? 1.0 : at - (double)i;
                const double u = 1.0 - t;
                {target} = u * u * ((1.0 + 2.0 * t) * z[i] + t * slope[i])
                    + t * t * ((1.0 + 2.0 * u) * z[i + 1] - u * slope[i + 1]);
            }}"""


def _at(place: str, target: str) -> str:
    """C that reads the branch at ``place``, with what `str.format` fills in later left standing."""
    return _AT.replace("{place}", place).replace("{target}", target)


_C_BODY = f"""if ({{last}} >= {{no_load}}) {{{{
    {{last}} = x;
}}}} else {{{{
    static const double z[{{points}}] = {{{{{{z}}}}}};
    static const double slope[{{points}}] = {{{{{{slope}}}}}};
    const double y = x;
    x = y + {{strength}} * fmin(fmax(1.0 - {{fading}} * {{last}}, 0.0), 1.0) * {{value}};
    if (fabs(x - {{last}}) > {{zone}}) {{{{
        const double sense = x > {{last}} ? 1.0 : -1.0;
        double on = {{place}}, low, high, height, move, now, left, under, over = 0.0;
        int k, stays = 0;
        if (sense * {{direction}} <= 0.0) {{{{
            low = 0.0;
            high = {{last_point}}.0;
            for (k = 0; k < 50; k++) {{{{
                on = 0.5 * (low + high);
                {_at("on", "now")}
                if (now < sense * {{value}}) {{{{
                    low = on;
                }}}} else {{{{
                    high = on;
                }}}}
            }}}}
            on = 0.5 * (low + high);
        }}}}
        low = 0.0;
        under = {{zone}} - sense * (x - {{last}});
        high = sense * (y - {{last}}) + {{strength}} - {{zone}};
        move = high;
        for (k = 1; k <= {{steps}}; k++) {{{{
            x = {{last}} + sense * ({{zone}} + move);
            {_at("on + move * {per_load}", "now")}
            height = {{strength}} * fmin(fmax(1.0 - {{fading}} * ({{last}} + sense * move), 0.0), 1.0);
            left = sense * (x - y) - height * now;
            if (fabs(left) <= {{solved}}) {{{{
                break;
            }}}}
            {{closer}}
        }}}}
        if (move > 0.0) {{{{
            {{direction}} = sense;
            {{place}} = on + move * {{per_load}};
            {{value}} = sense * now;
            {{last}} += sense * move;
        }}}}
    }}}}
}}}}"""
