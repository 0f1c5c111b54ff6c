"""What the commands are tried on: a recording of the paper's left toe, by scipy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest


def _signals(seconds: float = 60.0, rate_hz: float = 100.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Load triangles and what the paper's left toe makes of them in force units, by scipy alone."""
    from scipy import signal

    time_s = np.arange(int(seconds * rate_hz)) / rate_hz
    load_n = np.interp(time_s, [0, 2, 10, 18, 20, 24, 28, 32, 33, 34, 60], [0, 0, 800, 0, 0, 800, 0, 0, 800, 0, 0])
    k1, k2, x = 1.341, 0.215, 0.38113
    plant = signal.TransferFunction([1, k2], [1 + (k1 + k2) * x, k2 * (1 + k1 * x)])
    _, reading, _ = signal.lsim(plant, load_n, time_s)
    return time_s, load_n, reading


@pytest.fixture
def table(tmp_path: Path) -> Path:
    time_s, load_n, reading = _signals()
    noise = np.random.default_rng(7).normal(0.0, 1.0, (2, time_s.size))
    path = tmp_path / "left_toe.csv"
    rows = np.column_stack([time_s, load_n + noise[0], reading + 0.2 * noise[1]])
    np.savetxt(path, rows, delimiter=",", header="time_s,force_n,pressure_mbar", comments="", fmt="%.6g")
    return path
