"""A wall that stiffens with strain."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._beside_arm import BesideArm
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects._wall_loop import arm_beside
from smartshoe.models.effects.effect import ChainContext, Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class WallHardening(Effect):
    """(1 + h) f = u + h [(1 - s) u^3 + s u^5]: k1 grows with strain, and the gas takes less and less of the load.

    The odd curve ranges from k1 (1 + beta u^2) to beyond the sinh of long chains; zero and full scale stay in place.
    Where s < 0 the fifth power would turn it down: beyond its inflection, above full scale, it goes on along its
    tangent.
    """

    name, family, stage, place = "wall_hardening", "static_curve", "wall", "wall"
    is_memoryless = True
    bends_beside_arm = True
    says = "the wall stiffens with deformation: the reading against load is bent, flattest at high loads"
    parameters = (
        EffectParameter("bow", "FS_load", "above the straight line at half of full scale", 0.0, 0.0, 0.25, 0.01),
        EffectParameter("steepness", "1", "s: share of the fifth power, which comes late", None, -0.3, 1.0, 0.3),
    )
    shapes = ({"steepness": 0.1},)
    exposed_by = by("peaks", "low_loads")
    separated_by = {
        "contact_area": by("rates", "displacement"),
        "gas_compression": by("peaks", "displacement"),
        "saturation": by("peaks"),
        "sensor_nonlinearity": by("displacement", "pressure_reference"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that a wall without hardening would need."""
        if values[0] == 0.0:
            return signal.copy()
        from smartshoe.kernels.wall_loop import hardened

        out = np.empty(signal.size)
        hardened(np.ascontiguousarray(signal), *_coefficients(values), *arm_beside(conditions), out)
        return out

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse:
        """`inverse` beside the arm, whose load is taken off first."""
        return BesideArm(self.inverse(values, step_s), chain.arm, step_s)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The static load from u, in closed form."""
        from smartshoe.kernels.wall_loop import inflection

        cubic, fifth = _coefficients(values)
        whole = 1.0 + cubic + fifth
        end, steepest = inflection(cubic, fifth)

        def undo(signal: Array, time_s: Array) -> Array:
            within = np.clip(signal, -end, end)
            square = within * within
            load: Array = within * (1.0 + square * (cubic + fifth * square)) / whole
            load += steepest * (signal - within)
            return load

        body = f"x *= (1.0 + x * x * ({c_number(cubic)} + {c_number(fifth)} * x * x)) / {c_number(whole)};"
        if np.isfinite(end):
            most = c_number(end)
            body = f"""{{
    const double beyond = x > {most} ? x - {most} : (x < -{most} ? x + {most} : 0.0);
    x -= beyond;
    {body}
    x += {c_number(steepest)} * beyond;
}}"""
        return Memoryless(undo, body)


def _coefficients(values: Array) -> tuple[float, float]:
    """The coefficients of u^3 and of u^5."""
    bow, steepness = (float(value) for value in values)
    middle = 0.5 + bow
    hardening = bow / (0.5 - (1.0 - steepness) * middle**3 - steepness * middle**5)
    return hardening * (1.0 - steepness), hardening * steepness
