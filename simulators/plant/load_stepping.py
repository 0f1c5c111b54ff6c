"""Hysteresis and cycle count of a load at the fine step, for the kernel that takes the stress as its input."""

from __future__ import annotations

from numba import njit

from simulators.plant._stepping import cycle_at
from simulators.plant.preisach import mean_curve, relays_up
from smartshoe.arrays import Array


@njit(cache=True)
def loop_and_cycles(
    load_n: Array, shape: Array, full_n: float, turning: Array, partial: Array, state: Array, loop: Array, cycles: Array
) -> None:
    """Fill ``loop`` (n,), a share about its mean curve, and ``cycles`` (n,), the number completed so far.

    ``state`` (3,) is the number of turning points, whether a cycle is in progress, and the number of cycles; it is
    changed in place.
    """
    count, in_cycle, done = int(state[0]), state[1] > 0.0, state[2]
    for i in range(load_n.size):
        up, count = relays_up(load_n[i], turning, partial, count, shape)
        loop[i] = up - mean_curve(load_n[i], shape)
        in_cycle, ended = cycle_at(load_n[i], full_n, in_cycle)
        done += 1.0 if ended else 0.0
        cycles[i] = done
    state[0], state[1], state[2] = count, 1.0 if in_cycle else 0.0, done
