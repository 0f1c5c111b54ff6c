"""Units whose lag is long, or short, beside the times that laws remember by: half a recording foretells the rest.

None of these readings moves with its load over 0.3, 3 or 30 s, as they are asked to first.
"""

from __future__ import annotations

import numpy as np
import pytest

from smartshoe.arrays import Array
from smartshoe.integrity import examine
from smartshoe.recording import Recording


def levels(seed: int, count: int, longest: int, highest: float = 40.0) -> Array:
    """(count,) a load that goes to a random level and stays there, for half of ``longest`` samples to all of them."""
    rng = np.random.default_rng(seed)
    stays = rng.integers(longest // 2, longest + 1, count)
    return np.repeat(rng.uniform(5.0, highest, count), stays)[:count]


def solid(load: Array, lag: float, delay: int, at_once: float, seed: int, noise: float = 0.05) -> Array:
    """(n,) a share ``at_once``, the rest behind a ``lag``, all after a ``delay`` (samples)."""
    late = np.concatenate([np.full(delay, load[0]), load[: load.size - delay]])
    behind, keep = np.empty(load.size), np.exp(-1.0 / lag)
    state = 0.4 * load[0]  # of a past that the recording does not hold
    for k, at in enumerate(late):
        state = keep * state + (1.0 - keep) * at
        behind[k] = state
    reading = 0.3 * (at_once * late + (1.0 - at_once) * behind)
    return np.asarray(reading + noise * np.random.default_rng(seed + 500).standard_normal(load.size))


def logged(load: Array, reading: Array, step_s: float, name: str = "rig") -> Recording:
    return Recording.from_arrays(time_s=step_s * np.arange(load.size), force_n=load, pressure_mbar=reading, name=name)


def kinds(recording: Recording) -> set[str]:
    return {fault.kind for fault in examine([recording]).faults}


SLOW = {
    "a circuit of 15 ms in half a second": (0.002, 240, 11, 7.0, 3),
    "a vessel of ten minutes": (20.0, 300, 14, 30.0, 2),
    "a heater of five minutes": (5.0, 260, 90, 60.0, 5),
}


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("unit", SLOW)
def test_a_unit_that_is_slow_beside_its_load_follows_it(unit: str, seed: int) -> None:
    step_s, count, longest, lag, delay = SLOW[unit]
    load = levels(seed, count, longest)
    found = examine([logged(load, solid(load, lag, delay, 0.0, seed), step_s)])
    assert "does_not_follow_load" not in {fault.kind for fault in found.faults}
    assert found.usable[0].any()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("unit", [one for one in SLOW if "vessel" not in one])  # which chance explains, and moves along
def test_what_such_a_unit_reads_under_another_load_does_not_follow(unit: str, seed: int) -> None:
    step_s, count, longest, lag, delay = SLOW[unit]
    other = solid(levels(seed + 70, count, longest), lag, delay, 0.0, seed)
    assert kinds(logged(levels(seed, count, longest), other, step_s)) == {"does_not_follow_load"}


@pytest.mark.parametrize("lag", [20.0, 60.0])
def test_one_step_tells_no_slow_unit_from_a_drift(lag: float) -> None:
    load = np.where(np.arange(240) < 8, 0.0, 30.0)
    found = examine([logged(load, solid(load, lag, 0, 0.0, 1, 0.01), 6.0)])
    assert "so few levels cannot tell which" in found.refusals[0]


def test_a_refusal_names_no_time_that_its_recording_does_not_hold() -> None:
    step_s, count, longest, lag, delay = SLOW["a circuit of 15 ms in half a second"]
    other = solid(levels(9, count, longest), lag, delay, 0.0, 1)
    (says,) = examine([logged(levels(1, count, longest), other, step_s)]).refusals
    assert "answer within 30 s" not in says


RAIL_MBAR = 7.0


def filled(seed: int, rail_mbar: float) -> Recording:
    """A slow vessel under short pulses of several heights; what it reads, a little late, ends at ``rail_mbar``."""
    rng, load = np.random.default_rng(seed), np.full(420, 8.0)
    for at in range(20, 390, 40):
        load[at : at + int(rng.integers(5, 9))] = rng.uniform(25.0, 60.0)
    reading = np.round(solid(load, 9.0, 2, 0.0, seed, 0.02), 3)
    return logged(load, np.minimum(reading, rail_mbar), 15.0)


@pytest.mark.parametrize("seed", [0, 1, 4, 5, 7, 8])
def test_a_rail_to_which_a_slow_unit_comes_after_pulses_of_several_heights_is_told(seed: int) -> None:
    """It comes there as its load falls, so that no load shows how far the reading would have gone."""
    cut = filled(seed, RAIL_MBAR)
    found = examine([cut])
    (rail,) = [fault for fault in found.faults if fault.kind == "saturation"]
    assert "are exactly 7 mbar" in rail.says
    assert not found.usable[0][cut.sensor.values == RAIL_MBAR].any()
    assert "saturation" not in kinds(filled(seed, 99.0))


@pytest.mark.parametrize("step_mbar", [0.001, 0.05, 0.4])
@pytest.mark.parametrize("seed", range(4))
def test_holds_and_peaks_on_a_grid_are_no_rail(seed: int, step_mbar: float) -> None:
    """Of a unit without noise: even holds and smooth peaks, and friction that keeps a reading as its load falls."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum(np.r_[0.0, rng.uniform(8.0, 30.0, 40)])
    heights = np.tile([0.0, 30.0, 30.0, 0.0, 40.0, 37.0, 20.0, 40.0], 6)[: corners.size]
    load = np.interp(np.arange(corners[-1]), corners, heights)
    for lag in (0.1, 8.0):
        rubbed = np.maximum(solid(load, lag, 0, 0.3, seed, 0.0), np.roll(solid(load, lag, 0, 0.3, seed, 0.0), 1))
        for reading in (solid(load, lag, 0, 0.3, seed, 0.0), rubbed):
            coarse = step_mbar * np.round(reading / step_mbar)
            assert "saturation" not in kinds(logged(load, coarse, 0.5))


@pytest.mark.parametrize("count", [2000, 16000])
def test_what_follows_no_load_that_alternates_from_sample_to_sample_is_told_so(count: int) -> None:
    """Averaged over pairs, as in a long log, such a load stands still."""
    load = np.where(np.arange(count) % 2 == 0, 100.0, 700.0)
    noise = np.random.default_rng(1).standard_normal(count)
    assert "does_not_follow_load" in kinds(logged(load, noise, 0.01))
