"""A signal between its samples: one weighted sum of sixteen neighbours, and its derivative."""

from __future__ import annotations

from numba import njit


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def weighted_neighbours(u, first, taps, out):  # type: ignore[no-untyped-def]
    """out[k] = sum over j of taps[j] u[k + first + j]; beyond the ends the end values hold.

    ``u`` (n,), ``taps`` (16,), ``first`` the offset of the first neighbour; ``out`` (n,) is overwritten.
    """
    n = u.size
    low, high = min(max(0, -first), n), max(min(n, n - first - 15), 0)
    for k in range(n):
        if low <= k < high:
            continue
        total = 0.0
        for j in range(16):
            total += taps[j] * u[min(max(k + first + j, 0), n - 1)]
        out[k] = total
    # Written out, and from slices that start at 0: only so is the loop turned into vector instructions.
    v, inner = u[low + first :], out[low:high]
    a, b, c, d, e, f, g, h = taps[0], taps[1], taps[2], taps[3], taps[4], taps[5], taps[6], taps[7]
    i, j, s, m, o, p, q, r = taps[8], taps[9], taps[10], taps[11], taps[12], taps[13], taps[14], taps[15]
    for k in range(inner.size):
        early = a * v[k] + b * v[k + 1] + c * v[k + 2] + d * v[k + 3]
        early += e * v[k + 4] + f * v[k + 5] + g * v[k + 6] + h * v[k + 7]
        late = i * v[k + 8] + j * v[k + 9] + s * v[k + 10] + m * v[k + 11]
        late += o * v[k + 12] + p * v[k + 13] + q * v[k + 14] + r * v[k + 15]
        inner[k] = early + late
