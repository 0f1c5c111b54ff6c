"""A curve that rises everywhere and is otherwise free: its slope is linear between knots, and never zero."""

from __future__ import annotations

from functools import partial

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import EffectParameter, Inverse

KNOTS = np.linspace(0.0, 1.0, 6) ** 1.5  # shares of full scale; denser at low loads, where contacts and gaps bend most


def slope_weights(quantity: str) -> tuple[EffectParameter, ...]:
    """One parameter a knot: how much steeper the curve is there; ``quantity`` names what runs along the curve."""
    return tuple(
        EffectParameter(
            f"slope_{k}", "1", f"relative departure of the slope at {100.0 * knot:.0f} % of full-scale {quantity}",
            0.0, -0.95, 20.0, 0.1, prior_sd=1.0,
        )
        for k, knot in enumerate(KNOTS)
    )  # fmt: skip


def bent(signal: Array, weights: Array) -> Array:
    """The curve (n,) of ``signal`` (n,): s(0) = 0, s(1) = 1, s' in proportion to 1 + weight at each knot (6,).

    Between knots the slope is straight, so that the curve is a parabola; beyond 0 and 1 it goes on as a line.
    """
    if not np.any(weights):
        return signal.copy()
    from smartshoe.kernels.parabolas import along

    out = np.empty(signal.size)
    along(np.ascontiguousarray(signal, dtype=float), KNOTS, *_pieces(weights), out)
    return out


def straightened(weights: Array) -> Inverse:
    """The inverse of `bent`: the parabola between two knots is solved for its argument, exact to rounding."""
    start, slope, bend = _pieces(weights)
    return Memoryless(partial(_undo, weights=weights), _c_body(start, slope, bend))


def _pieces(weights: Array) -> tuple[Array, Array, Array]:
    """Value (6,), slope (6,) and half the second derivative (5,) of the curve at, and after, each knot."""
    slope = 1.0 + np.asarray(weights, dtype=float)
    length = np.diff(KNOTS)
    rise = 0.5 * (slope[1:] + slope[:-1]) * length
    whole = rise.sum()
    start = np.concatenate([[0.0], np.cumsum(rise) / whole])
    slope = slope / whole
    return start, slope, 0.5 * np.diff(slope) / length


def _undo(signal: Array, time_s: Array, weights: Array) -> Array:
    """(n,) arguments at which the curve has the values ``signal`` (n,), whatever the time."""
    start, slope, bend = _pieces(weights)
    y = np.clip(signal, 0.0, 1.0)
    at = np.searchsorted(start[1:-1], y, side="right")
    above = y - start[at]
    # The slope at the solution is the root: it is positive, so that this form of the solution never cancels.
    root = np.sqrt(np.maximum(slope[at] ** 2 + 4.0 * bend[at] * above, 0.0))
    inside: Array = KNOTS[at] + 2.0 * above / (slope[at] + root)
    inside += np.minimum(signal, 0.0) / slope[0] + np.maximum(signal - 1.0, 0.0) / slope[-1]
    return inside


def _c_body(start: Array, slope: Array, bend: Array) -> str:
    """`_undo` in C, by the curve's value, slope and bend at the knots."""

    def row(values: Array) -> str:
        return ", ".join(c_number(value) for value in values)

    pieces = bend.size
    return f"""{{
    static const double knot[{pieces}] = {{{row(KNOTS[:-1])}}};
    static const double start[{pieces}] = {{{row(start[:-1])}}};
    static const double slope[{pieces}] = {{{row(slope[:-1])}}};
    static const double bend[{pieces}] = {{{row(bend)}}};
    const double y = x < 0.0 ? 0.0 : (x > 1.0 ? 1.0 : x);
    const double beyond = x < 0.0 ? x / {c_number(slope[0])} : (x > 1.0 ? (x - 1.0) / {c_number(slope[-1])} : 0.0);
    double above, root;
    int at = 0;
    while (at < {pieces - 1} && y >= start[at + 1]) {{
        at++;
    }}
    above = y - start[at];
    root = slope[at] * slope[at] + 4.0 * bend[at] * above;
    root = root > 0.0 ? sqrt(root) : 0.0;
    x = knot[at] + 2.0 * above / (slope[at] + root) + beyond;
}}"""
