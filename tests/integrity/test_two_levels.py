"""A load of two levels, and a unit that lags by longer than its load stays: a motor that is switched on and off."""

from __future__ import annotations

import numpy as np
import pytest

from smartshoe.integrity import examine
from smartshoe.recording import Recording

STEP_S, LEAST_S = 0.1, 0.5
UP_S, DOWN_S, SECOND_S = 0.6, 1.3, 0.5


def switched(seed: int, duration_s: float = 125.0) -> np.ndarray:
    """(n,) a drive of 0 or 5 that may change each half second."""
    held = np.random.default_rng(seed).integers(0, 2, int(duration_s / LEAST_S))
    return 5.0 * np.repeat(held, round(LEAST_S / STEP_S))


def speed(drive: np.ndarray, delay_s: float = 0.0, seed: int = 0) -> np.ndarray:
    """(n,) what turns: faster up than down, behind a second lag; and noise."""
    fine = 10
    steps = np.repeat(np.concatenate([np.full(round(delay_s / STEP_S), drive[0]), drive])[: drive.size], fine)
    dt, wheel, out = STEP_S / fine, 2500.0, np.empty(steps.size)
    shown = wheel
    for k, at in enumerate(steps):
        wheel += dt * (1200.0 * at - wheel) / (UP_S if at else DOWN_S)
        shown += dt * (wheel - shown) / SECOND_S
        out[k] = shown
    return out[fine - 1 :: fine] + np.random.default_rng(seed).normal(0.0, 3.0, drive.size)


def quick(drive: np.ndarray) -> np.ndarray:
    """(n,) what follows its load at once."""
    return 1000.0 * drive + np.random.default_rng(3).normal(0.0, 3.0, drive.size)


def logged(drive: np.ndarray, reading: np.ndarray, every: int = 1, name: str = "rig") -> Recording:
    time_s = STEP_S * np.arange(drive.size)
    return Recording.from_arrays(
        time_s=time_s[::every], force_n=drive[::every], pressure_mbar=0.1 * reading[::every], name=name
    )


@pytest.mark.parametrize("every", [1, 2], ids=["10 Hz", "5 Hz"])
@pytest.mark.parametrize("duration_s", [125.0, 500.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_slow_unit_under_a_load_that_switches_has_no_fault(seed: int, duration_s: float, every: int) -> None:
    """Its lag is no clock's, zeros of half a second are no dropouts, edges are no noise, and it follows."""
    drive = switched(seed, duration_s)
    found = examine([logged(drive, speed(drive, seed=seed), every)])
    assert [(fault.kind, fault.says) for fault in found.faults] == []
    assert found.usable[0].all()


@pytest.mark.parametrize("seed", range(4))
def test_one_that_is_late_by_its_clock_is_told(seed: int) -> None:
    """A reading that answers nothing for two seconds, and then at once."""
    drive = switched(seed, 250.0)
    found = examine([logged(drive, speed(drive, delay_s=2.0, seed=seed))])
    assert [fault.kind for fault in found.faults] == ["two_clocks"]


@pytest.mark.parametrize("every", [1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_the_reading_of_another_drive_does_not_follow(seed: int, every: int) -> None:
    found = examine([logged(switched(seed), speed(switched(seed + 100), seed=seed), every)])
    assert [fault.kind for fault in found.faults] == ["does_not_follow_load"]
    assert "noise" not in found.refusals[0]


def test_a_spike_of_a_load_that_switches_is_none_of_its_levels() -> None:
    drive = np.repeat(switched(1), 4)
    spiked = np.array(drive)
    spiked[730] = 9.0
    found = examine([logged(spiked, quick(drive))])
    assert [fault.kind for fault in found.faults] == ["spikes"]
    assert np.flatnonzero(~found.usable[0]).tolist() == [730]


def test_a_load_that_toggles_between_two_steps_of_its_grid_is_noise() -> None:
    """A load cell that nobody presses."""
    toggling = 0.1 * np.random.default_rng(1).integers(0, 2, 1250)
    found = examine([logged(toggling, speed(switched(3)))])
    assert "no more than its noise" in found.refusals[0]


def test_a_load_that_switches_and_is_lost_for_a_moment_is_missing() -> None:
    """Where most of its falls are of that kind: a cable that breaks, and a reading that stays."""
    drive = np.repeat([0.0, 5.0, 5.0, 5.0, 5.0, 5.0, 0.0], 200)
    lost, gone = np.array(drive), np.zeros(drive.size, dtype=bool)
    gone[[*range(500, 505), *range(560, 570), *range(700, 706), *range(1100, 1110)]] = True
    lost[gone] = 0.0
    found = examine([logged(lost, quick(drive))])
    assert [fault.kind for fault in found.faults] == ["dropouts"]
    assert np.array_equal(~found.usable[0], gone)
