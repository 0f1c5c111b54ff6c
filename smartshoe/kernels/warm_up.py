"""Compiles the fit's kernels beside other work, the first time that this machine runs them.

Compiled code is kept on disk, so that this happens once an installation. A scenario's devices take a second or two on
one core before the first fit: by then a second core has the kernels ready.
"""

from __future__ import annotations

import atexit
import subprocess
import sys
from pathlib import Path

KERNELS = ("first_order", "shift", "srivc")


def begin() -> None:
    """Start the compilation in a process of its own, unless its results are there; never fails, never waits."""
    cache = Path(__file__).parent / "__pycache__"
    if all(any(cache.glob(f"{name}.*.nbi")) for name in KERNELS):
        return
    process = subprocess.Popen(
        [sys.executable, "-m", __spec__.name], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )
    atexit.register(process.wait)


def compile_all() -> None:
    """Call each kernel once, on a few numbers of the types that `identify` hands it."""
    import numpy as np

    from smartshoe.kernels.first_order import COLUMNS, inner_products
    from smartshoe.kernels.shift import weighted_neighbours
    from smartshoe.kernels.srivc import instrument_products

    u, none, every, hold = np.ones(32), np.zeros(0), np.zeros(0, dtype=bool), np.ones((1, 6))
    weighted_neighbours(u, -7, np.ones(16), np.empty(32))
    instrument_products(u, u, u, every, hold, 1.0, np.zeros((5, 5)), np.zeros(5))
    products = np.zeros((COLUMNS, COLUMNS))
    inner_products(u, none, u, every, np.ones(1), hold, 1.0, 1.0, 1.0, 0.0, 0.0, np.arange(COLUMNS), products)


if __name__ == "__main__":
    compile_all()
