"""Softening of rubber by its largest load so far: it is stiffer the first time than ever after."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._beside_arm import BesideArm
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_loop import arm_beside, most_beside
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, Undone, beyond_noise, dead_zone
from smartshoe.models.effects.effect import ChainContext, Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class MullinsSoftening(Effect):
    """f r = u (1 - c tanh(((M^2 r^2 - u^2)/(width + beta M^2))^power)), r = 1 + a tanh(M^2/width), M the largest load.

    c lets the first loading follow the stiff curve and makes all loadings below M softer (Ogden and Roxburgh 1999; with
    beta, as in Mars 2004 and finite-element codes; by the root of the distance, Beatty and Krishnaswamy 2000). a makes
    the wall softer by what it has borne, the first loading included (damage, Simo 1987); ``at_once`` is the share of a.
    ``gained`` is the rise of the gain at half of full scale after a full load, for ``at_once`` 0. ``of_arm`` is the
    share of the relaxing arm that softens with the spring, as where a material softens as a whole (Simo 1987).
    """

    name, family, stage, place = "mullins_softening", "softening", "wall", "wall"
    bends_beside_arm = True
    says = "the first loading to a level reads lower than every later one to that level or below"
    parameters = (
        EffectParameter(
            "gained", "1", "gain at half load after a full load, over the virgin one, less 1", 0.0, 0.0, 1.0, 0.01
        ),
        EffectParameter(
            "width", "1", "how far below M^2 softening is complete, squares of full scale", None, 0.02, 3.0, 0.3
        ),
        EffectParameter("at_once", "1", "share of it that the first loading bears", None, 0.0, 1.0, 0.5,
                        absent=0.0, natural="both"),
        EffectParameter("widening", "1", "beta: by how much the width grows with M^2", None, 0.0, 3.0, 0.5,
                        absent=0.0, natural="lower"),
        EffectParameter("power", "1", "of the distance to M^2: 1 by energy, 0.5 by its root", None, 0.5, 1.0, 0.75,
                        absent=1.0, natural="both"),
        EffectParameter("of_arm", "1", "share of the relaxing arm that softens with the spring", None, 0.0, 1.0, 0.5,
                        absent=0.0, natural="both"),
    )  # fmt: skip
    shapes = tuple(
        {"width": width, "at_once": at_once, "widening": 0.0, "power": 1.0, "of_arm": 0.0}
        for width, at_once in ((0.1, 0.0), (0.5, 0.0), (0.5, 1.0))
    )
    exposed_by = by("peaks", "repeats")
    separated_by = {
        "cycle_conditioning": by("shuffled_loads"),
        "gain_drift": by("pauses", "shuffled_loads"),
        "play_hysteresis": by("repeats"),
    }
    branch = "largest load"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that a wall without softening would need; ``before["largest_load"]`` counts as well."""
        from smartshoe.kernels.wall_loop import softened

        if values[0] == 0.0:
            return signal.copy()
        before, out = float(conditions.before.get("largest_load", 0.0)), np.empty(signal.size)
        share, decay, now, earlier = arm_beside(conditions)
        share *= 1.0 - float(values[5])
        given = *_amounts(values, share), before, dead_zone(conditions), share, decay, now, earlier
        softened(np.ascontiguousarray(signal), *given, out)
        return out

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse:
        """`inverse` beside the arm, whose load is taken off first."""
        arm = replace(chain.arm, share=chain.arm.share * (1.0 - float(values[5])))
        return BesideArm(_undone(*_amounts(values, arm.share), dead_zone=beyond_noise(chain.noise)), arm, step_s)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The static load from u: in closed form below the largest, by Newton above; exact without noise."""
        return _undone(*_amounts(values))


def _undone(
    strength: float, width: float, widening: float, raised: float, power: float, dead_zone: float = LEAST_DEAD_ZONE
) -> Undone:
    """The inverse for the constants of `_amounts`."""
    from smartshoe.kernels.memory import CLOSE, EASED, STEPS, softened_undone

    def body(of: Mapping[str, str]) -> str:
        most, per_width, a = of["largest"], c_number(1.0 / width), c_number(raised)
        rounded = f"pow(share + {c_number(EASED)}, {c_number(power)}) - {c_number(EASED**power)}"
        eased = "share" if power == 1.0 else rounded
        return f"""{{
    const double rise = 1.0 + {a} * tanh({most} * {most} * {per_width}), highest = {most} * rise;
    if (x < highest) {{
        const double below = highest * highest - x * x;
        const double wide = {c_number(width)} + {c_number(widening)} * {most} * {most};
        const double share = (below > 0.0 ? below : 0.0) / wide;
        x *= (1.0 - {c_number(strength)} * tanh({eased})) / rise;
    }} else {{
        const double u = x;
        double low = u / (1.0 + {a}), high = u;
        int k;
        for (k = 0; k < {STEPS}; k++) {{
            const double bend = tanh(x * x * {per_width}), was = x;
            const double more = 1.0 + {a} * bend;
            if (x * more > u) {{
                high = x;
            }} else {{
                low = x;
            }}
            x -= (x * more - u) / (more + {a} * 2.0 * x * x * {per_width} * (1.0 - bend * bend));
            if (!(low <= x && x <= high)) {{
                x = 0.5 * (low + high);
            }} else if (fabs(x - was) <= {c_number(CLOSE)}) {{
                break;
            }}
        }}
    }}
    if (x - {c_number(dead_zone)} > {most}) {{
        {most} = x - {c_number(dead_zone)};
    }}
}}"""

    constants = (strength, width, widening, raised, power, dead_zone)
    return Undone(softened_undone, constants, np.zeros(1), ("largest",), body)


def _amounts(values: Array, share: float = 0.0) -> tuple[float, float, float, float, float]:
    """What is lost below the largest load, the width, its growth, the largest rise of a first loading, the power.

    Beside an arm of ``share`` that pushes, a tenth of the wall's own stiffness is left at least, softened or not.
    """
    from smartshoe.kernels.memory import EASED, softness

    gained, width, at_once, widening, power = (float(value) for value in values[:5])
    below = (1.0 - at_once) * gained
    lost = below / (1.0 + below) / softness(0.75 / (width + widening), power, EASED**power)[0]
    raised = min(at_once * gained / math.tanh(0.75 / width), most_beside(share))
    if share < 0.0:
        lost = min(lost, max(0.9 + share * (1.0 + raised), 0.0))
    return lost, width, widening, raised, power
