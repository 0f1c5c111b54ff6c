"""Any loop that does not depend on rate: the family of hystereses without a law."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import Undone, dead_zone
from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter, Inverse

HALF_WIDTHS = np.geomspace(0.01, 0.4, 6)  # of the plays, shares of full scale
USUAL_HEIGHT = 0.01  # of full scale: half of the loop's height by one weight at its prior's standard deviation
MOST_LOST = 0.5  # of the slope: that standard deviation where the play is narrow


def _weights() -> tuple[EffectParameter, ...]:
    apart = np.diff(HALF_WIDTHS, prepend=0.0)
    return tuple(
        EffectParameter(
            f"lost_slope_{k}", "1",
            f"share of the slope lost between {200.0 * (width - step):.1f} and {200.0 * width:.1f} % of full scale"
            " after a reversal",
            0.0, -1.0, 0.95, 0.1, prior_sd=float(min(USUAL_HEIGHT / step, MOST_LOST)),
        )
        for k, (width, step) in enumerate(zip(HALF_WIDTHS, apart, strict=True))
    )  # fmt: skip


class FlexibleLoop(Effect):
    """f - sum of w_k (z_k - z_(k-1)), z_k = f - play_k(f) + r_k the friction of a play of half width r_k, z_0 = 0.

    A Prandtl-Ishlinskii operator (Brokate and Sprekels 1996, ch. 2), written so that each weight is a share of slope:
    while the load is between 2 r_(k-1) and 2 r_k past its last reversal, the output moves by 1 - w_k of the load's
    move. Weights below 1, each by itself, keep it rising. The load has come down before the session, so that there is
    no friction at rest: the loop closes there.
    """

    name, family, stage, place = "flexible_loop", "hysteresis", "wall", "wall"
    says = "the reading lies lower while loading than while unloading, by the same amount at any rate"
    parameters = _weights()
    exposed_by = frozenset({"rates", "peaks", "minor_loops"})
    is_flexible = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load less friction."""
        if not np.any(values):
            return signal.copy()
        from smartshoe.kernels.memory import plays

        half_widths = np.maximum(HALF_WIDTHS, dead_zone(conditions))
        own, weights, shift = _operator(half_widths, values)
        out = np.empty(signal.size)
        plays(np.ascontiguousarray(signal, dtype=float), 0.0, own, half_widths, weights, shift, half_widths.copy(), out)
        return out

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Another such operator, exact (Krejci and Kuhnen 2001): each of its plays goes with one of the block's."""
        from smartshoe.kernels.memory import plays

        own, weights, shift = _operator(HALF_WIDTHS, values)
        within, heights = np.cumsum(weights), np.cumsum(weights * HALF_WIDTHS)
        slope = own + np.concatenate([[0.0], within])  # of the load's move, by how many plays move along
        turned = slope[1:] * HALF_WIDTHS - heights
        undone = -weights / (slope[1:] * slope[:-1])
        # The play that runs along with z_k is at slope_k z_k + sum over wider ones of w_i z_i; z_i = r_i at first.
        start = slope[1:] * HALF_WIDTHS + heights[-1] - heights
        members = tuple(f"play{k}" for k in range(HALF_WIDTHS.size))

        def body(of: Mapping[str, str]) -> str:
            return _c_body([of[member] for member in members], shift, 1.0 / own, turned, undone)

        return Undone(plays, (-shift, 1.0 / own, turned, undone, 0.0), start, members, body)


def _operator(half_widths: Array, values: Array) -> tuple[float, Array, float]:
    """Weight of the load itself, of the plays (6,), and what is added: `FlexibleLoop` as a sum of plays."""
    lost = np.append(np.asarray(values, dtype=float), 0.0)
    weights = lost[:-1] - lost[1:]
    return float(1.0 - lost[0]), weights, float(-weights @ half_widths)


def _c_body(states: list[str], shift: float, own: float, half_widths: Array, weights: Array) -> str:
    lines = [f"    const double y = x + {c_number(-shift)};", f"    x = {c_number(own)} * y;"]
    for state, width, weight in zip(states, half_widths, weights, strict=True):
        low, high = f"y - {c_number(width)}", f"y + {c_number(width)}"
        lines.append(f"    {state} = {state} > {low} ? {state} : {low};")
        lines.append(f"    {state} = {state} < {high} ? {state} : {high};")
        lines.append(f"    x += {c_number(weight)} * {state};")
    return "{\n" + "\n".join(lines) + "\n}"
