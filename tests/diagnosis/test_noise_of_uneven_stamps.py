"""Lines between uneven samples average a part of their noise away: errors that are stated are of all of it."""

from __future__ import annotations

import numpy as np
import pytest

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._prepared import prepared
from smartshoe.integrity import examine
from smartshoe.recording import Recording

STEP_S, NOISE = 0.01, 0.01  # of full scale


def _load(time_s: np.ndarray) -> np.ndarray:
    """Triangles of 8 s, of full scale, after a rest of 3 s."""
    return np.clip(1.0 - np.abs((time_s - 3.0) % 9.0 / 4.0 - 1.0), 0.0, 1.0) * (time_s > 3.0)


def _run(seed: int, jitter: float) -> Recording:
    rng = np.random.default_rng(seed)
    time_s = STEP_S * (np.arange(9000) + jitter * rng.uniform(-1.0, 1.0, 9000))
    time_s -= time_s[0]
    load = _load(time_s)
    noise = NOISE * rng.standard_normal(load.size)
    return Recording.from_arrays(
        time_s=time_s, force_n=500.0 * load, pressure_mbar=100.0 * (load + noise), name=f"run {seed}"
    )


@pytest.mark.parametrize("jitter", [0.0, 0.15, 0.3])
def test_what_is_judged_has_as_much_noise_as_was_logged(jitter: float) -> None:
    runs = [_run(seed, jitter) for seed in range(2)]
    thresholds = Thresholds()
    ready = prepared(runs, 2, examine(runs, thresholds), thresholds)
    for one in ready.fine:
        load = _load(one.conditions.time_s)
        columns = np.column_stack([load, np.ones(load.size)])[one.usable]
        reading = one.reading[one.usable]
        left = reading - columns @ np.linalg.lstsq(columns, reading, rcond=None)[0]
        full_scale = float(np.ptp(columns @ np.linalg.lstsq(columns, reading, rcond=None)[0]))
        assert float(np.std(left)) / full_scale == pytest.approx(NOISE, rel=0.03)
