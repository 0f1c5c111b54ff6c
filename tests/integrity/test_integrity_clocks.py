"""Two clocks are told from a unit that relaxes by much, and a drift that all recordings share is one cause."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.diagnosis import Thresholds, diagnose
from smartshoe.diagnosis._aligned import aligned
from smartshoe.integrity import examine
from smartshoe.recording import Recording

RATE_HZ = 100.0


def staircase(
    levels: int, tau_s: float, share: float, drift: float = 0.0, seed: int = 1, parted_s: float = 0.0
) -> Recording:
    """Loads that rise to ever higher holds and go back; ``share`` of the reading follows within ``tau_s``.

    The reading's clock begins ``parted_s`` late and falls behind by ``drift``.
    """
    tops = (np.arange(levels) + 1.0) / levels
    steps_s = np.stack([6.0 * tops, np.full(levels, 7.0), 6.0 * tops, np.full(levels, 5.0)], axis=1).ravel()
    loads = np.stack([tops, tops, 0.0 * tops, 0.0 * tops], axis=1).ravel()
    corners_s, corners = np.append(0.0, np.cumsum(steps_s)), np.append(0.0, loads)
    time_s = np.arange(0.0, corners_s[-1], 1.0 / RATE_HZ)
    load = np.interp(time_s, corners_s, corners)
    late = np.interp(time_s * (1.0 - drift) - parted_s, corners_s, corners)
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
    """The higher the step, the slower it is gone to, and the later the reading seems to follow, by up to seconds."""
    found = examine([staircase(8, tau_s, share)], Thresholds())
    assert (found.clock_offset_s, found.clock_rate) == ((0.0,), (0.0,))


@pytest.mark.parametrize("knee", [0.03, 0.1])
def test_a_reading_that_saturates_in_a_single_cycle_has_one_clock(knee: float) -> None:
    """Its edges lie at little load, which the load leaves early and comes back to late: a lag for each direction."""
    time_s = np.arange(0.0, 58.0, 0.05)
    load = 0.5 - 0.5 * np.cos(np.pi * np.interp(time_s, [4.0, 29.0, 54.0], [0.0, 1.0, 0.0]))
    single = Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load + np.random.default_rng(1).normal(0.0, 1.0, time_s.size),
        pressure_mbar=100.0 * (1.0 - np.exp(-load / knee)),
    )
    found = examine([single], Thresholds())
    assert (found.clock_offset_s, found.clock_rate) == ((0.0,), (0.0,))


def test_a_drift_of_the_clock_in_all_recordings_is_one_cause_and_none_is_moved() -> None:
    runs = [staircase(levels, 3.0, 0.1, drift=0.004, seed=levels) for levels in (6, 8, 11)]
    integrity = examine(runs, Thresholds())
    assert all(integrity.clock_rate)
    found = aligned(runs, integrity)
    (effect, values), (before, nothing) = found.parts
    assert (effect.name, before.name) == ("clock_drift", "delay")
    assert values[0] == pytest.approx(0.004, rel=0.15)
    assert nothing[0] == pytest.approx(0.0, abs=0.05)
    assert found.recordings == runs
    assert not found.says


def test_a_drift_that_is_too_small_to_be_seen_in_a_short_recording_is_one_all_the_same() -> None:
    runs = [staircase(11, 3.0, 0.1, drift=0.003), staircase(3, 3.0, 0.1, drift=0.003, seed=2)]
    integrity = examine(runs, Thresholds())
    assert integrity.clock_rate[0] > 0.0
    assert integrity.clock_rate[1] == 0.0
    (effect, values), _ = aligned(runs, integrity).parts
    assert effect.name == "clock_drift"
    assert values[0] == pytest.approx(0.003, rel=0.2)


@pytest.mark.parametrize("parted_s", [0.0, pytest.param(0.1, marks=pytest.mark.long)])
def test_a_drift_that_began_before_the_recordings_is_told_though_nothing_else_is_there(parted_s: float) -> None:
    """Without the lag that they begin with, the fit takes a relaxation for it and comes to 2 % of full scale."""
    runs = [staircase(levels, 3.0, 0.1, 0.004, levels, parted_s) for levels in (6, 8, 11)]
    found = diagnose(runs, hold_out=[staircase(9, 3.0, 0.1, 0.004, 1, parted_s)])
    names = {cause.name for cause in found.causes}
    assert "clock_drift" in names
    assert ("delay" in names) == (parted_s > 0.0)
    assert found.model is not None
    rate = next(part.values[0] for part in found.model.parts if part.name == "clock_drift")
    assert rate == pytest.approx(0.004, rel=0.02)
    assert found.extended.rmse < 0.12  # mbar, of 100, with 0.1 of noise
