"""What looks like a fault of single samples and is none: jumps that stay, draughts, ringing, jitter, ties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_integrity_faults import kinds, on_lattice, recorded, with_reading

from smartshoe.integrity import examine
from smartshoe.integrity._examination import _view
from smartshoe.integrity._spikes import comes_back, spikes
from smartshoe.integrity._view import UNKNOWN_ENDS
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.protocol import dynamic_protocol, static_protocol
from smartshoe.recording import Recording

SEEDS = st.integers(0, 999)
FEW = settings(max_examples=6)


def dwelling(recording: Recording, rng: np.random.Generator, dwell_s: float) -> np.ndarray:
    """(n,) a level of -1 or 1 that switches at random times."""
    step_s = float(recording.time_s[1] - recording.time_s[0])
    return np.where(np.cumsum(rng.random(len(recording)) < step_s / dwell_s) % 2 == 0, -1.0, 1.0)


@FEW
@given(SEEDS, st.floats(0.5, 8.0), st.floats(1.0, 8.0))
def test_a_level_that_switches_is_neither_spikes_nor_dropouts(seed, amplitude_mbar, dwell_s):
    recording = recorded(dynamic_protocol(), seed, 0.2)
    level = amplitude_mbar * dwelling(recording, np.random.default_rng(seed), dwell_s)
    assert kinds(examine([with_reading(recording, on_lattice(recording.sensor.values + level))])) == set()


@FEW
@given(SEEDS, st.floats(1.0, 20.0), st.sampled_from([-1.0, 1.0]))
def test_a_wall_that_snaps_is_no_spike(seed, drop_mbar, sign):
    # At half of the load the reading jumps against the ramp, and back again on the way down.
    recording = recorded(dynamic_protocol(), seed, 0.1)
    reading = recording.sensor.values - sign * drop_mbar * (recording.load.values > 400.0)
    assert "spikes" not in kinds(examine([with_reading(recording, on_lattice(reading))]))


@FEW
@given(SEEDS, st.floats(5.0, 30.0), st.floats(2.0, 8.0))
def test_a_draught_that_dies_away_is_no_dropout(seed, size_mbar, recovery_s):
    rng = np.random.default_rng(seed)
    recording = recorded(dynamic_protocol(), seed, 0.2)
    reading = recording.sensor.values.copy()
    t = recording.time_s
    for start_s in np.sort(rng.uniform(0.0, float(t[-1]), 8)):
        reading -= np.where(t >= start_s, size_mbar * np.exp(-(t - start_s) / recovery_s), 0.0)
    assert kinds(examine([with_reading(recording, on_lattice(reading))])) == set()


def test_ringing_after_each_move_of_the_load_is_no_hum():
    recording = recorded(static_protocol((100.0, 500.0, 800.0)), 3, 0.05)
    t, load = recording.time_s, recording.load.values
    moves = np.flatnonzero(np.abs(np.diff(np.convolve(load, np.ones(50) / 50, "same"))) > 1.0)
    ends = moves[np.flatnonzero(np.diff(moves, append=10**9) > 100)]
    ringing = np.zeros(t.size)
    for end in ends:
        since = t[end:] - t[end]
        ringing[end:] += 1.5 * np.sin(2 * np.pi * 4.0 * since) * np.exp(-since / 4.0)
    assert "hum" not in kinds(examine([with_reading(recording, on_lattice(recording.sensor.values + ringing))]))


@FEW
@given(SEEDS, st.floats(20.0, 60.0), st.floats(0.2, 3.0))
def test_readings_on_a_lattice_in_the_lower_of_two_ranges_are_not_held(seed, switch_mbar, noise_mbar):
    recording = recorded(dynamic_protocol(), seed, 0.1)
    rng = np.random.default_rng(seed)
    reading = on_lattice(recording.sensor.values)
    noisy = reading + noise_mbar * (reading > switch_mbar) * rng.standard_normal(reading.size)
    assert "held_samples" not in kinds(examine([with_reading(recording, noisy)]))


@pytest.mark.parametrize("is_held", [False, True])
@FEW
@given(SEEDS, st.floats(3.0, 30.0))
def test_noise_comes_back_to_the_steps_of_a_lattice_however_finely_they_are_written(is_held, seed, steps):
    """Of 16 bits calibrated by a temperature that wanders, written to more digits; a logger that holds is still one."""
    recording = recorded(static_protocol((100.0, 500.0, 800.0)), seed, 0.2)
    rng = np.random.default_rng(seed)
    grid_mbar = 0.2 / steps
    reading = np.rint(recording.sensor.values / grid_mbar) * grid_mbar + 1e-6 * rng.integers(0, 3, len(recording))
    if is_held:
        for start in rng.integers(1, reading.size - 5, reading.size // 100):
            reading[start : start + 4] = reading[start - 1]
    assert ("held_samples" in kinds(examine([with_reading(recording, reading)]))) is is_held


@FEW
@given(SEEDS, st.floats(0.05, 0.3))
def test_samples_taken_early_or_late_are_no_spikes(seed, jitter_s):
    recording = recorded(dynamic_protocol(), seed, 0.1)
    t = recording.time_s
    taken = t + jitter_s * np.random.default_rng(seed).standard_normal(t.size)
    reading = np.interp(taken, t, recording.sensor.values)
    assert kinds(examine([with_reading(recording, on_lattice(reading))])) == set()


def test_held_readings_at_the_top_are_no_rail():
    recording = recorded(static_protocol((100.0, 500.0, 800.0)), 5, 0.3)
    rng = np.random.default_rng(5)
    reading = recording.sensor.values.copy()
    for start in rng.integers(1, reading.size - 20, reading.size // 40):
        reading[start : start + 12] = reading[start - 1]
    assert kinds(examine([with_reading(recording, reading)])) == {"held_samples"}


def test_noise_of_the_converter_beyond_a_rail_hides_it_not():
    recording = recorded(static_protocol((100.0, 500.0, 800.0)), 6, 0.2)
    rng = np.random.default_rng(6)
    cut = np.minimum(recording.sensor.values, 0.9 * recording.sensor.values.max())
    one_up = (cut == cut.max()) & (rng.random(cut.size) < 0.01)
    assert kinds(examine([with_reading(recording, cut + 0.03 * one_up)])) == {"saturation"}


@pytest.mark.parametrize("where", ["at rest only", "once"])
def test_what_one_recording_drops_to_is_a_dropout_in_another(where):
    rng = np.random.default_rng(7)
    recordings = []
    for number in range(2):
        recording = recorded(dynamic_protocol(), number, 0.2)
        reading = recording.sensor.values + 2.0  # zero is no reading of this unit
        if number == 0:
            for start in rng.integers(1, reading.size - 8, 40):
                reading[start : start + 6] = 0.0
        elif where == "at rest only":
            for start in np.flatnonzero(recording.load.values < 5.0)[100:2000:500]:
                reading[start : start + 12] = 0.0
        else:
            reading[int(np.argmax(recording.load.values))] = 0.0
        recordings.append(replace(with_reading(recording, reading), name=f"number_{number}"))
    found = examine(recordings)
    assert kinds(found) == {"dropouts"}
    assert {fault.recording for fault in found.faults} == {0, 1}


@given(st.integers(0, 999), st.floats(8.0, 100.0), st.integers(1, 2))
@settings(max_examples=20)
def test_only_what_comes_back_is_a_spike(seed, size, length):
    rng = np.random.default_rng(seed)
    values = 0.5 * np.arange(60.0) + rng.standard_normal(60)
    found = np.zeros(60, dtype=bool)
    found[30 : 30 + length] = True
    spiked, stepped = values.copy(), values.copy()
    spiked[30 : 30 + length] += size
    stepped[30:] += size
    assert comes_back(spiked, found, Thresholds())[found].all()
    assert not comes_back(stepped, found, Thresholds()).any()


def test_a_move_before_a_stretch_that_is_held_is_no_spike():
    """What stands between a measured level and the next, far later, is not seen to come back."""
    time_s = 0.03 * np.arange(800)
    load = 30.0 + 25.0 * np.sin(0.9 * time_s)
    reading = 0.2 * load + 0.02 * np.random.default_rng(3).standard_normal(load.size)
    bad = np.zeros(load.size, dtype=bool)
    reading[300:314], bad[301:314] = reading[300] + 4.0, True
    moved = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=reading)
    assert list(spikes(_view(moved, Thresholds(), UNKNOWN_ENDS), bad)) == []
    reading[445] += 4.0
    spiked = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=reading)
    (found,) = spikes(_view(spiked, Thresholds(), UNKNOWN_ENDS), bad)
    assert np.flatnonzero(found.at).tolist() == [445]
    assert "an isolated spike of 39 %" in found.says
