"""Any loop that does not depend on rate: the family of hystereses without a law."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import Undone, dead_zone
from smartshoe.models.effects.effect import Conditions, CStep, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

HALF_WIDTHS = np.geomspace(0.01, 0.4, 5)  # of the plays, as shares of full scale
LEAST_LOAD = 0.2  # of full scale: friction that grows with load is in proportion to the load and this
SCALE = math.log1p(1.0 / LEAST_LOAD)
USUAL_HEIGHT = 0.01  # of full scale: half the height of a loop by one weight at its prior's standard deviation
MOST_LOST = 0.5  # of the slope: the largest such standard deviation, for narrow plays


def _weights(name: str, says: str, height: float) -> tuple[EffectParameter, ...]:
    """One parameter a play: the share of slope that is lost while the input passes through it."""
    apart = np.diff(HALF_WIDTHS, prepend=0.0)
    return tuple(
        EffectParameter(
            f"{name}_{k}", "1",
            f"share of the slope lost between {200.0 * (width - step):.1f} and {200.0 * width:.1f} % of {says} after a"
            " reversal",
            0.0, -0.25, 0.95, 0.1, prior_sd=float(min(height / step, MOST_LOST)),
        )
        for k, (width, step) in enumerate(zip(HALF_WIDTHS, apart, strict=True))
    )  # fmt: skip


class FlexibleLoop(Effect):
    """Two Prandtl-Ishlinskii operators in a row: friction that is even over the load, and friction that grows with it.

    Each is x - sum of w_k (z_k - z_(k-1)), z_k = x - play_k(x) + r_k the friction of a play of half width r_k, z_0 = 0
    (Brokate and Sprekels 1996, ch. 2). So each weight is a share of slope: while x is between 2 r_(k-1) and 2 r_k past
    its last reversal, the output moves by 1 - w_k of its move, and rises while all weights are below 1. In the first
    operator x is the load; in the second it is ln(1 + f/0.2)/ln 6 (odd), in which equal widths are widths in proportion
    to f + 0.2. The load came down before the session, so that there is no friction at rest and the loop closes there.
    """

    name, family, stage, place = "flexible_loop", "hysteresis", "wall", "wall"
    is_steep_undone = True
    says = "loading and unloading give two readings of one load, by the same amount apart at any rate"
    parameters = (
        *_weights("even", "full scale", USUAL_HEIGHT),
        *_weights("growing", "the logarithmic scale of load", USUAL_HEIGHT / ((1.0 + LEAST_LOAD) * SCALE)),
    )
    exposed_by = by("rates", "peaks", "minor_loops")
    is_flexible = never_fades = True
    is_refinement = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load less friction."""
        even, growing = _banks(values)
        zone = dead_zone(conditions)
        out = _looped(signal, even, zone)
        if not np.any(growing):
            return out
        return _load_of(_looped(_logarithmic(out), growing, zone / (LEAST_LOAD * SCALE)))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The inverse of the second operator, then that of the first: exact."""
        even, growing = _banks(values)
        return _Loops(_undone(even), _undone(growing))


def _banks(values: Array) -> tuple[Array, Array]:
    """The weights of the even and of the growing operator, (m,) each."""
    count = HALF_WIDTHS.size
    return np.asarray(values[:count], dtype=float), np.asarray(values[count:], dtype=float)


def _logarithmic(load: Array) -> Array:
    """The load (n,) on the logarithmic scale of the second operator."""
    scaled: Array = np.copysign(np.log1p(np.abs(load) / LEAST_LOAD) / SCALE, load)
    return scaled


def _load_of(scaled: Array) -> Array:
    """The inverse of `_logarithmic`."""
    load: Array = np.copysign(LEAST_LOAD * np.expm1(np.abs(scaled) * SCALE), scaled)
    return load


def _operator(half_widths: Array, lost: Array) -> tuple[float, Array, float]:
    """The operator as a sum of plays: the weight of x itself, those of the plays (m,), and a constant."""
    weights = lost - np.append(lost[1:], 0.0)
    return float(1.0 - lost[0]), weights, float(-weights @ half_widths)


def _looped(signal: Array, lost: Array, zone: float) -> Array:
    """An operator with the weights ``lost`` (m,) applied to a ``signal`` (n,); plays are no narrower than ``zone``."""
    if not np.any(lost):
        return signal.copy()
    from smartshoe.kernels.memory import plays

    half_widths = np.maximum(HALF_WIDTHS, zone)
    own, weights, shift = _operator(half_widths, lost)
    out = np.empty(signal.size)
    plays(np.ascontiguousarray(signal, dtype=float), 0.0, own, half_widths, weights, shift, half_widths.copy(), out)
    return out


def _undone(lost: Array) -> Undone:
    """The inverse operator (Krejci and Kuhnen 2001), a sum of plays as well, each moving with one of the operator's."""
    from smartshoe.kernels.memory import plays

    own, weights, shift = _operator(HALF_WIDTHS, lost)
    within, heights = np.cumsum(weights), np.cumsum(weights * HALF_WIDTHS)
    slope = own + np.concatenate([[0.0], within])  # of the load's move, by how many plays move along
    turned = slope[1:] * HALF_WIDTHS - heights
    undone = -weights / (slope[1:] * slope[:-1])
    # The play that goes with z_k is at slope_k z_k + sum over wider ones of w_i z_i; z_i = r_i at first.
    start = slope[1:] * HALF_WIDTHS + heights[-1] - heights
    members = tuple(f"play{k}" for k in range(HALF_WIDTHS.size))

    def body(of: Mapping[str, str]) -> str:
        return _c_body([of[member] for member in members], shift, 1.0 / own, turned, undone)

    return Undone(plays, (-shift, 1.0 / own, turned, undone, 0.0), start, members, body)


class _Loops(Inverse):
    """The inverse of both operators: the second is undone first."""

    def __init__(self, even: Undone, growing: Undone) -> None:
        self.even, self.growing = even, growing

    def reset(self) -> None:
        """Back to the session's beginning."""
        self.even.reset()
        self.growing.reset()

    def push(self, signal: Array, time_s: Array) -> Array:
        """The load (n,)."""
        return self.even.push(_load_of(self.growing.push(_logarithmic(signal), time_s)), time_s)

    def c_step(self, name: str) -> CStep:
        """The same."""
        even, growing = self.even.c_step(f"{name}_even"), self.growing.c_step(f"{name}_growing")
        least, scale = c_number(LEAST_LOAD), c_number(SCALE)
        there = f"    x = x < 0.0 ? -log1p(-x / {least}) / {scale} : log1p(x / {least}) / {scale};"
        back = f"    x = x < 0.0 ? -{least} * expm1(-x * {scale}) : {least} * expm1(x * {scale});"
        return CStep({**growing.states, **even.states}, f"{{\n{there}\n{growing.body}\n{back}\n{even.body}\n}}")


def _c_body(states: list[str], shift: float, own: float, half_widths: Array, weights: Array) -> str:
    """A sum of plays in C."""
    lines = ["    {", f"    const double y = x + {c_number(-shift)};", f"    x = {c_number(own)} * y;"]
    for state, width, weight in zip(states, half_widths, weights, strict=True):
        low, high = f"y - {c_number(width)}", f"y + {c_number(width)}"
        lines.append(f"    {state} = {state} > {low} ? {state} : {low};")
        lines.append(f"    {state} = {state} < {high} ? {state} : {high};")
        lines.append(f"    x += {c_number(weight)} * {state};")
    return "\n".join([*lines, "    }"])
