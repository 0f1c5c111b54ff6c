"""A unit that is preloaded within its gap: at rest the load cell shows a load, and the gauge reads nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

RATE_HZ, FULL_N, PRELOAD_N, GAP_N = 100.0, 900.0, 135.0, 162.0


def _preloaded(seed: int, *, logs_command: bool) -> Recording:
    """Triangles and stairs above a preload; what presses beyond the gap goes through a standard linear solid."""
    noise, corners, now_s = np.random.default_rng(seed), [(0.0, 0.0), (3.0, 0.0)], 3.0
    for k, top in enumerate((1.0, 0.5, 0.8, 0.4, 1.0, 0.6, 0.8)):
        rise_s = (1.0, 2.0, 4.0)[k % 3]
        corners += [(now_s + rise_s, top), (now_s + rise_s + 3.0, top), (now_s + 2.0 * rise_s + 3.0, 0.0)]
        now_s += 2.0 * rise_s + 5.0
        corners.append((now_s, 0.0))
    time_s = np.arange(0.0, now_s, 1.0 / RATE_HZ)
    asked = np.interp(time_s, *zip(*corners, strict=True))
    load_n = PRELOAD_N + (FULL_N - PRELOAD_N) * asked
    felt_n, fade = np.maximum(load_n - GAP_N, 0.0), np.exp(-1.0 / (3.0 * RATE_HZ))
    pressure_mbar = 0.11 * (0.85 * felt_n + 0.15 * lfilter([1.0 - fade], [1.0, -fade], felt_n))
    channels = {"pressure_mbar": pressure_mbar + 0.08 * noise.standard_normal(time_s.size)}
    if logs_command:
        channels["command_n"] = (FULL_N - PRELOAD_N) * asked
    force_n = load_n + 0.3 * noise.standard_normal(time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=force_n, name=f"preloaded_{seed}", **channels)


@pytest.mark.parametrize("logs_command", [False, True])
def test_a_load_at_rest_that_a_gap_may_swallow_is_a_tare_or_that_gap_unless_a_command_tells(logs_command: bool) -> None:
    one, two, held = (_preloaded(seed, logs_command=logs_command) for seed in (1, 2, 3))
    found = diagnose([one, two], hold_out=[held])
    causes = {cause.name: cause for cause in found.causes}
    assert {"load_cell_tare", "dead_band"} <= set(causes)
    tare = causes["load_cell_tare"]
    assert tare.equivalents == (() if logs_command else ("dead_band",))
    assert tare.law_confidence == (1.0 if logs_command else 0.5)
    assert any("keeps from the reading" in said for said in found.limits) is not logs_command
