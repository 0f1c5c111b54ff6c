"""Air that stiffens as its volume shrinks (Boyle's law)."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._beside_arm import GasBesideArm
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects._wall_loop import arm_beside, most_beside, relaxed
from smartshoe.models.effects.effect import ChainContext, Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class GasCompression(Effect):
    """p + (N - 1) e = f, e = p/(1 + g p): Boyle's gas beside a straight wall, scaled to f = p = 1 at full scale.

    e is the deformation in the linear gas's units, N that of `smartshoe.models.core` (the usual one).
    """

    name, family, stage, place = "gas_compression", "static_curve", "gas", "gas"
    is_memoryless = True
    bends_beside_arm = True
    says = "the air stiffens as it is compressed: the reading against load is bent upwards, ever steeper"
    parameters = (
        EffectParameter(
            "pressure_ratio",
            "1",
            "g: gauge pressure at full scale over the ambient one, if N is 1.6",
            0.0,
            0.0,
            5.0,
            0.1,
        ),
    )
    exposed_by = by("peaks")
    separated_by = {
        "contact_area": by("peaks", "displacement"),
        "sensor_nonlinearity": by("displacement", "pressure_reference"),
        "wall_hardening": by("peaks", "displacement"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The pressure of the stiffer gas."""
        from smartshoe.kernels.wall_loop import compressed

        arm = arm_beside(conditions)
        ratio = _beside(float(values[0]), arm[0])
        if ratio == 0.0:
            return signal.copy()
        # The load from which the linear core made the signal.
        load, out = signal + relaxed(signal, conditions), np.empty(signal.size)
        compressed(load, ratio, _stiffness(ratio)[0], *arm, out)
        return out

    def inverse_within(self, chain: ChainContext, values: Array, step_s: float) -> Inverse:
        """`inverse` beside the arm, whose load is taken off first."""
        ratio = _beside(float(values[0]), chain.arm.share)
        return GasBesideArm(self.inverse(np.array([ratio]), step_s), ratio, chain.arm, step_s)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The static load from the pressure, in closed form."""
        ratio = float(values[0])
        wall, whole = _stiffness(ratio)
        return Memoryless(
            lambda signal, time_s: signal * (1.0 + wall / (1.0 + ratio * signal)) / whole,
            f"x *= (1.0 + {c_number(wall)} / (1.0 + {c_number(ratio)} * x)) / {c_number(whole)};",
        )


def _beside(ratio: float, share: float) -> float:
    """``ratio``, or the largest one that a gas beside an arm of ``share`` may have.

    A gas that stiffened more, beside an arm that pushes, would need an absolute pressure below zero
    (`kernels.wall_loop.compressed`).
    """
    from smartshoe.models.core import USUAL_WALL_RATIO

    return min(ratio, max((USUAL_WALL_RATIO - 1.0) * most_beside(share) - 1.0, 0.0))


def _stiffness(ratio: float) -> tuple[float, float]:
    """The wall's stiffness over that of the linear gas, and that of wall and gas from rest to full scale."""
    from smartshoe.models.core import USUAL_WALL_RATIO

    wall = USUAL_WALL_RATIO - 1.0
    return wall, 1.0 + wall / (1.0 + ratio)
