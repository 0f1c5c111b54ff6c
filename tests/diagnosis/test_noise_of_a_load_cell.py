"""A load cell's noise stays in the steep and bent parts of a walk's load, where the reading is high: that is all."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from smartshoe.diagnosis import diagnose
from smartshoe.models.effects._sensor_evidence import PRESSURE, SLOPE, growing_noise
from smartshoe.recording import Recording

RATE_HZ = 125.0
NOISE = 3e-4  # of load and reading, of full scale
KIND = "heteroscedastic_noise"
Array = NDArray[np.float64]


def _walk(rng: np.random.Generator) -> Array:
    """Strides of 1.1 s about, in shares of the highest load: two peaks while the foot stands, nothing in between."""
    parts = [np.zeros(int(3.0 * RATE_HZ))]
    for _ in range(60):
        stance = np.linspace(0.0, np.pi, int(rng.uniform(0.6, 0.75) * RATE_HZ))
        height = rng.uniform(0.7, 0.95)
        parts += [height * (np.sin(stance) + 0.35 * np.sin(3.0 * stance)), np.zeros(int(0.4 * RATE_HZ))]
    return gaussian_filter1d(np.concatenate(parts), 0.02 * RATE_HZ)


def _recording(seed: int, growing: float) -> Recording:
    rng = np.random.default_rng(seed)
    load = _walk(rng)
    of_load, of_reading, with_reading = rng.standard_normal((3, load.size))
    return Recording.from_arrays(
        time_s=np.arange(load.size) / RATE_HZ,
        force_n=800.0 * (load + NOISE * of_load),
        pressure_mbar=200.0 * (load + NOISE * of_reading + growing * load * with_reading),
        name=f"walk {seed}",
    )


@pytest.mark.parametrize("seed", [21, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 11))])
@pytest.mark.parametrize("growing", [0.0, 3e-3])
def test_noise_is_said_to_grow_with_the_reading_only_where_the_readings_own_does(growing: float, seed: int) -> None:
    """Without a look at the load's noise all three were said to be so."""
    found = diagnose([_recording(seed + k, growing) for k in range(2)], hold_out=[_recording(seed + 2, growing)])
    told = [fault.kind for fault in found.data_faults].count(KIND)
    assert told == (3 if growing else 0)


@pytest.mark.parametrize("asked", [PRESSURE, SLOPE])
def test_what_noise_of_the_load_brings_is_fitted_apart(asked: int) -> None:
    rng = np.random.default_rng(5)
    load = _walk(rng)
    weight = load if asked == PRESSURE else np.abs(np.gradient(load))
    left = (weight > 0.1 * weight.max()).astype(float)
    residual = NOISE * (rng.standard_normal(load.size) + 3.0 * np.sqrt(left) * rng.standard_normal(load.size))
    assert growing_noise(residual, load, 1.0 / RATE_HZ, asked) is not None
    assert growing_noise(residual, load, 1.0 / RATE_HZ, asked, left) is None
    more = residual + 3e-2 * weight / weight.max() * rng.standard_normal(load.size)
    assert growing_noise(more, load, 1.0 / RATE_HZ, asked, left) is not None


@pytest.mark.parametrize(
    ("noise", "is_told"), [(0.02, True), (0.002, False), pytest.param(0.1, True, marks=pytest.mark.long)]
)
def test_a_load_cell_as_noisy_as_to_limit_what_is_seen_is_told(noise: float, is_told: bool) -> None:
    rng = np.random.default_rng(3)
    load = np.interp(np.arange(6000) % 1000, [0, 200, 600, 1000], [0.0, 0.0, 1.0, 0.0])
    found = diagnose(
        [
            Recording.from_arrays(
                time_s=0.01 * np.arange(load.size),
                force_n=800.0 * (load + noise * rng.standard_normal(load.size)),
                pressure_mbar=200.0 * load + 0.1 * rng.standard_normal(load.size),
            )
        ]
    )
    said = [str(one) for one in found.limits if "the load of recording is noisy" in str(one)]
    assert len(said) == is_told
    for told in said:
        (logged_n,) = re.findall(r"by ([\d.]+) N rms", told)
        assert float(logged_n) == pytest.approx(800.0 * noise, rel=0.15)
