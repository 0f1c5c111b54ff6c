"""The rounding errors of a coarse grid are told as the grid's, and as no other noise."""

from __future__ import annotations

import numpy as np
import pytest

from smartshoe import diagnose
from smartshoe.recording import Recording

STEP_S, CODES = 0.02, 14


def _read(seed: int, name: str) -> Recording:
    """Triangles of several rates, read by a converter of a few uneven codes."""
    rng = np.random.default_rng(seed)
    pieces = [np.zeros(200)]
    for samples in rng.permutation([80, 160, 240, 320, 400, 480]):
        up = np.arange(1, samples + 1) / samples
        pieces += [up, 1.0 - up, np.zeros(150)]
    load = np.concatenate(pieces)
    codes = np.cumsum(np.random.default_rng(9).uniform(0.6, 1.4, CODES + 2))
    codes = (codes - codes[1]) / (codes[-2] - codes[1])
    reading = load + 5e-4 * rng.standard_normal(load.size)
    reading = codes[np.searchsorted(0.5 * (codes[1:] + codes[:-1]), reading)]
    time_s = STEP_S * (np.arange(load.size) + rng.uniform(-0.12, 0.12, load.size))  # true moments
    return Recording.from_arrays(time_s=time_s, force_n=500.0 * load, pressure_mbar=100.0 * reading, name=name)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_an_uneven_grid_is_no_jitter_and_no_noise_that_grows(seed: int) -> None:
    found = diagnose([_read(seed, "first"), _read(seed + 50, "second")])
    kinds = {fault.kind for fault in found.data_faults}
    assert "quantisation" in kinds
    assert not kinds & {"timing_jitter", "heteroscedastic_noise"}
