"""A counter that runs over: counted on before anything else is asked, and never where a reading drops out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.integrity import examine
from smartshoe.integrity._wrapped import unwrapped
from smartshoe.integrity.thresholds import Thresholds

Array = NDArray[np.float64]
STANDARD = Thresholds()
TIME_S = np.arange(0.0, 60.0, 0.01)
SHARE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)


def _recording(counts: Array) -> Recording:
    return Recording.from_arrays(time_s=TIME_S, force_n=400.0 * SHARE, pressure_counts=counts, name="run")


def _counts(seed: int, top: float, foot: float = 0.0) -> Array:
    noise = np.random.default_rng(seed).standard_normal(TIME_S.size)
    return np.asarray(np.rint(foot + (top - foot) * SHARE + 1e-3 * top * noise))


def _logged(counts: Array, bits: int, signed: bool) -> Array:
    word = 2.0**bits
    return np.asarray((counts + 0.5 * word) % word - 0.5 * word if signed else counts % word)


@given(st.integers(0, 2**31), st.sampled_from([10, 12, 16, 24]), st.booleans(), st.floats(1.1, 4.0))
def test_counts_are_as_they_were_before_the_counter_ran_over(seed: int, bits: int, signed: bool, times: float) -> None:
    """Also beside noise about nothing, of which an unsigned counter makes the end of its range."""
    counts = _counts(seed, times * 2.0**bits * (0.5 if signed else 1.0))
    logged = _logged(counts, bits, signed)
    recording, findings = unwrapped(_recording(logged), STANDARD)
    assert np.array_equal(recording.sensor.values, counts)
    assert [one.kind for one in findings] == ["counter_overflow"]
    assert np.array_equal(findings[0].at, logged != counts)
    assert f"counter of {bits} bits" in findings[0].says


@given(st.integers(0, 2**31), st.sampled_from([0.0, 65535.0]), st.floats(0.001, 0.02), st.floats(0.5, 0.98))
def test_a_reading_that_drops_out_has_not_run_over(seed: int, to: float, share: float, top: float) -> None:
    counts = np.clip(_counts(seed, top * 65535.0), 0.0, 65535.0)
    counts[np.random.default_rng(seed + 1).random(counts.size) < share] = to
    recording = _recording(counts)
    assert unwrapped(recording, STANDARD) == (recording, [])


@pytest.mark.parametrize("scale", [0.01, 1.0 / 7.0])
def test_what_is_no_whole_number_comes_from_no_counter(scale: float) -> None:
    recording = _recording(scale * _logged(_counts(1, 1e5), 16, signed=True))
    assert unwrapped(recording, STANDARD) == (recording, [])


@pytest.mark.long
def test_a_unit_whose_counter_ran_over_is_diagnosed_as_it_is() -> None:
    """As large as it is, whatever the word: the fault is told, and no cause is found for it."""
    counts = _counts(3, 5e4)
    plain, over = (diagnose([_recording(one)]) for one in (counts, _logged(counts, 16, signed=True)))
    assert [fault.kind for fault in over.data_faults] == ["counter_overflow"]
    assert plain.verdict == over.verdict == "adequate"
    assert plain.baseline is not None
    assert over.baseline is not None
    assert over.baseline.rmse == pytest.approx(plain.baseline.rmse)


def test_missing_samples_stay_so() -> None:
    logged = _logged(_counts(2, 5e4), 16, signed=True)
    logged[700:720] = np.nan
    found = examine([_recording(logged)])
    kept = found.recordings[0].sensor
    assert np.array_equal(kept.present, ~np.isnan(logged))
    assert float(kept.values[kept.present].max()) > 2**15
