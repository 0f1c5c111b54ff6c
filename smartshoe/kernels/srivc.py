"""One pass over an experiment: the inner products of SRIVC's filtered regressors and instruments."""

from __future__ import annotations

from numba import njit


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def instrument_products(u, y, x, counted, holds, pole, normal, right):  # type: ignore[no-untyped-def]
    """Add instruments times regressors (5, 5) to ``normal`` and instruments times target (5,) to ``right``.

    ``u``, ``y``, ``x`` (n,) input, output and the instrument's output, ``counted`` (n,) bool or size 0 for all,
    ``holds`` (1 or n - 1, 6) as for `kernels.first_order`. Behind f = pole/(s + pole) the regressors are -f y/pole,
    u - f u, f u/pole, 1 and exp(-pole t), the target y - f y; the instruments have x for y.
    """
    n, even = u.size, holds.shape[0] == 1
    E, A, B = holds[0, 0], holds[0, 1], holds[0, 2]
    u_slow, y_slow, x_slow, fade = u[0], y[0], x[0], 1.0
    for k in range(n):
        if k > 0:
            if not even:
                E, A, B = holds[k - 1, 0], holds[k - 1, 1], holds[k - 1, 2]
            u_slow = E * u_slow + (A * u[k] + B * u[k - 1])
            y_slow = E * y_slow + (A * y[k] + B * y[k - 1])
            x_slow = E * x_slow + (A * x[k] + B * x[k - 1])
            fade *= E
        if counted.size and not counted[k]:
            continue
        a, b, c = -y_slow / pole, u[k] - u_slow, u_slow / pole
        z, target = -x_slow / pole, y[k] - y_slow
        normal[0, 0] += z * a
        normal[0, 1] += z * b
        normal[0, 2] += z * c
        normal[0, 3] += z
        normal[0, 4] += z * fade
        normal[1, 0] += b * a
        normal[1, 1] += b * b
        normal[1, 2] += b * c
        normal[1, 3] += b
        normal[1, 4] += b * fade
        normal[2, 0] += c * a
        normal[2, 2] += c * c
        normal[2, 3] += c
        normal[2, 4] += c * fade
        normal[3, 0] += a
        normal[3, 3] += 1.0
        normal[3, 4] += fade
        normal[4, 0] += fade * a
        normal[4, 4] += fade * fade
        right[0] += z * target
        right[1] += b * target
        right[2] += c * target
        right[3] += target
        right[4] += fade * target
    for i in range(1, 5):
        for j in range(1, i):
            normal[i, j] = normal[j, i]
