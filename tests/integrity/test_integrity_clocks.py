"""Two clocks are told from a unit that relaxes by much, and a drift that all recordings share is one cause."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._aligned import aligned
from smartshoe.integrity import examine
from smartshoe.recording import Recording

RATE_HZ = 100.0


def staircase(levels: int, tau_s: float, share: float, drift: float = 0.0, seed: int = 1) -> Recording:
    """Loads that rise to ever higher holds and go back; ``share`` of the reading follows within ``tau_s``."""
    tops = (np.arange(levels) + 1.0) / levels
    steps_s = np.stack([6.0 * tops, np.full(levels, 7.0), 6.0 * tops, np.full(levels, 5.0)], axis=1).ravel()
    loads = np.stack([tops, tops, 0.0 * tops, 0.0 * tops], axis=1).ravel()
    corners_s, corners = np.append(0.0, np.cumsum(steps_s)), np.append(0.0, loads)
    time_s = np.arange(0.0, corners_s[-1], 1.0 / RATE_HZ)
    load = np.interp(time_s, corners_s, corners)
    late = np.interp(time_s * (1.0 - drift), corners_s, corners)
    keep = float(np.exp(-1.0 / RATE_HZ / tau_s))
    reading = (1.0 - share) * late + share * lfilter([1.0 - keep], [1.0, -keep], late)
    rng = np.random.default_rng(seed)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load + rng.normal(0.0, 0.3, time_s.size),
        pressure_mbar=100.0 * reading + rng.normal(0.0, 0.1, time_s.size),
        name=f"staircase_{seed}",
    )


@pytest.mark.parametrize(("tau_s", "share"), [(2.0, 0.7), (4.0, 0.9), (8.0, 0.9), (16.0, 0.9)])
def test_a_unit_that_relaxes_by_most_of_its_reading_has_one_clock(tau_s: float, share: float) -> None:
    """The higher the step, the slower it is gone to, and the later the reading seems to follow."""
    assert examine([staircase(8, tau_s, share)], Thresholds()).clock_rate == (0.0,)


def test_a_drift_of_the_clock_in_all_recordings_is_one_cause_and_none_is_moved() -> None:
    runs = [staircase(levels, 3.0, 0.1, drift=0.004, seed=levels) for levels in (6, 8, 11)]
    integrity = examine(runs, Thresholds())
    assert all(integrity.clock_rate)
    found = aligned(runs, integrity, Thresholds())
    ((effect, values),) = found.parts
    assert effect.name == "clock_drift"
    assert values[0] == pytest.approx(0.004, rel=0.15)
    assert found.recordings == runs
    assert not found.says


def test_a_drift_that_is_too_small_to_be_seen_in_a_short_recording_is_one_all_the_same() -> None:
    runs = [staircase(11, 3.0, 0.1, drift=0.003), staircase(3, 3.0, 0.1, drift=0.003, seed=2)]
    integrity = examine(runs, Thresholds())
    assert integrity.clock_rate[0] > 0.0
    assert integrity.clock_rate[1] == 0.0
    ((effect, values),) = aligned(runs, integrity, Thresholds()).parts
    assert effect.name == "clock_drift"
    assert values[0] == pytest.approx(0.003, rel=0.2)
