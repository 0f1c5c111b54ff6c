"""A gain that depends on whether the load rises or falls: shared by the law and the flexible block of asymmetries."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._false_position import closer_in_c
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import NO_LOAD, Undone, cleaned_load
from smartshoe.models.effects.effect import Conditions


def by_sense(signal: Array, conditions: Conditions, lost: float, turn: float, fade: float) -> Array:
    """``signal`` (n,) times 1 - ``lost`` (1 - s)/2, with s the load's sense of motion, 1 rising and -1 falling.

    It turns over within a move of ``turn``, and fades by ``fade`` a step.
    """
    if lost == 0.0:
        return signal.copy()
    sense = conditions.kept("sense_of_motion", (turn, fade), lambda: _sense(conditions, turn, fade))
    return signal * (1.0 - 0.5 * lost * (1.0 - sense))


def _sense(conditions: Conditions, turn: float, fade: float) -> Array:
    """(n,) the sense of motion of the load, computed in a kernel."""
    from smartshoe.kernels.memory import sense_of_motion

    load = cleaned_load(conditions)
    out = np.empty(load.size)
    sense_of_motion(load, turn, fade, _start(fade), out)
    return out


def undone_by_sense(lost: float, turn: float, fade: float, dead_zone: float) -> Undone:
    """The load whose sense of motion gives the output, by false position; exact for a load without noise."""
    from smartshoe.kernels.memory import SOLVED, STEPS, sense_undone

    def body(of: Mapping[str, str]) -> str:
        zone = c_number(dead_zone)

        def turned(by: str) -> str:
            """Lines that turn the sense over by a move."""
            return f"""turned = ({by} < 0.0 ? -({by}) : {by}) / {c_number(turn)};
        total = turned + {c_number(fade)};
        if (total > 0.0) {{
            const double to = ({by} < 0.0 ? -turned : turned) / total;
            sense = to + ({of["sense"]} - to) * exp(-total);
        }}"""

        return f"""{{
    double v, turned, total, sense = {of["sense"]};
    {{
        {turned("0.0")}
    }}
    v = x / (1.0 - {c_number(0.5 * lost)} * (1.0 - sense));
    if ({of["last"]} >= {NO_LOAD}) {{
        {of["last"]} = v;
    }} else if (fabs(v - {of["last"]}) > {zone}) {{
        const double way = v > {of["last"]} ? 1.0 : -1.0;
        const double end = {of["last"]} + way * {zone}, whole = x / {c_number(1.0 - lost)};
        double low = way * end, high = way * ((x > whole) == (way > 0.0) ? x : whole);
        double at = low, under = 0.0, over = 0.0;
        int k, stays = 0;
        for (k = 0; k < {STEPS}; k++) {{
            double left;
            v = way * at;
            sense = {of["sense"]};
            {turned("(v - end)")}
            left = at * (1.0 - {c_number(0.5 * lost)} * (1.0 - sense)) - way * x;
            if (fabs(left) <= {SOLVED} || (k == 0 && left > 0.0) || (k == 1 && left < 0.0)) {{
                break;
            }}
            {closer_in_c("at")}
        }}
        {of["last"]} += v - end;
    }}
    {of["sense"]} = sense;
    x = v;
}}"""

    return Undone(sense_undone, (lost, turn, fade, dead_zone), _start(fade), ("last", "sense"), body)


def _start(fade: float) -> Array:
    """The kernel's state at first: no load yet, and the sense of loading, or none where it fades at rest."""
    return np.array([NO_LOAD, 0.0 if fade > 0.0 else 1.0])
