"""Compiles the fit's kernels in parallel with other work, the first time that a machine runs them.

Compiled code is cached on disk, so that this happens once per installation. A scenario's devices take a second or two
on one core before the first fit: by then a second core has the kernels ready.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from pathlib import Path

from smartshoe.kernels._once import compile_each_kernel_once

CACHE = Path(__file__).parent / "__pycache__"
KERNELS = ("first_order", "shift", "srivc", "residual", "linear_filter")


def begin() -> None:
    """Start the compilation in a separate process, unless its results exist; never fails, never waits."""
    if all(any(CACHE.glob(f"{name}.*.nbi")) for name in KERNELS):
        return
    # Run in the package's folder, so that no module of the caller's folder is taken for one of ours, and that
    # folder may be deleted meanwhile. Any failure will recur, and be reported, in the fit itself.
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", __spec__.name]
    process = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet, cwd=Path(__file__).parents[2])
    atexit.register(process.wait)


def compile_all() -> None:
    """Call each kernel once, on a few numbers of the types that `identify` passes to it."""
    import numpy as np

    from smartshoe.kernels.first_order import COLUMNS, inner_products, respond
    from smartshoe.kernels.linear_filter import linear_filter
    from smartshoe.kernels.residual import lagged_products, orthogonalise
    from smartshoe.kernels.shift import NEIGHBOURS, fill_taps, shift
    from smartshoe.kernels.srivc import delayed_products, instrument_products

    u, none, every = np.ones(32), np.zeros(0), np.zeros(0, dtype=bool)
    products = np.zeros((COLUMNS, COLUMNS))
    delayed_products(u, u, u, u, 1, products)
    instrument_products(u, u, u, every, 1.0, None, 1.0, products)
    respond(u, 1.0, None, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, np.empty(32))
    fill_taps(0.5, np.empty(NEIGHBOURS), np.empty(NEIGHBOURS))
    shift(u, 0.5, 1.0, np.empty(32), np.empty(32))
    inner_products(u, none, u, every, 1.0, None, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, np.zeros((0, 0)), products)
    lagged_products(u, np.ones(32, dtype=bool), np.zeros(2), np.zeros(2, dtype=int))
    linear_filter([1.0, 1.0], [1.0, 0.5], u)
    orthogonalise(np.ones((2, 32)), 1)


def compile_alone() -> bool:
    """Compile each kernel, once among all processes, if the results can be cached here; returns whether it was done."""
    if not os.access(CACHE, os.W_OK):
        return False
    compile_each_kernel_once()
    compile_all()
    return True


if __name__ == "__main__":
    compile_alone()
