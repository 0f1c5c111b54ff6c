"""A piecewise parabolic curve between knots, evaluated value by value."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def along(signal, knots, start, slope, bend, out):  # type: ignore[no-untyped-def]
    """out (n,) = start + d (slope + d bend), d the distance of ``signal`` (n,) from the knot before.

    Linear beyond the ends. ``knots``, ``start`` (value at each knot) and ``slope`` (m + 1,), ``bend`` (m,) half the
    second derivative.
    """
    last = bend.size
    for k in range(signal.size):
        x = signal[k]
        if x < knots[0]:
            out[k] = start[0] + slope[0] * (x - knots[0])
        elif x > knots[last]:
            out[k] = start[last] + slope[last] * (x - knots[last])
        else:
            at = 0
            while at < last - 1 and x >= knots[at + 1]:
                at += 1
            d = x - knots[at]
            out[k] = start[at] + d * (slope[at] + d * bend[at])
