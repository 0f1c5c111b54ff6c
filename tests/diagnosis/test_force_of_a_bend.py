"""A unit that loses a tenth of its slope above two thirds of its range: the force that is handed out, and its error.

The recordings are lines of numpy, and share no equation with the models.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from smartshoe import Recording, diagnose
from smartshoe.arrays import Array
from smartshoe.diagnosis import Diagnosis

FULL_N, FULL_MBAR, STEP_S, THINNED = 500.0, 300.0, 0.001, 10
LEVEL, SLOPE_LOST = 0.65, 0.1


def _rounded(corners: list[tuple[float, float]]) -> Array:
    """A load by its corners (s, share of full scale), rounded over some tens of milliseconds."""
    at_s, levels = zip(*corners, strict=True)
    sharp = np.interp(np.arange(0.0, at_s[-1], STEP_S), at_s, levels)
    window = np.hanning(75)[1:-1]
    return np.convolve(np.pad(sharp, 36, mode="edge"), window / window.sum(), "valid")


def _triangles() -> Array:
    """Three of each of three rates, with rests."""
    corners, at_s = [(0.0, 0.0), (2.0, 0.0)], 2.0
    for rate in (0.06, 0.25, 1.0):
        for _ in range(3):
            corners += [(at_s + 1.0 / rate, 1.0), (at_s + 2.0 / rate, 0.0)]
            at_s += 2.0 / rate
        at_s += 2.0
        corners.append((at_s, 0.0))
    return _rounded(corners)


def _holds() -> Array:
    """At three levels, with rests."""
    corners, at_s = [(0.0, 0.0), (2.0, 0.0)], 2.0
    for level in (0.3, 0.6, 0.9):
        ramp_s = level / 0.8
        corners += [(at_s + ramp_s, level), (at_s + ramp_s + 15.0, level), (at_s + 2.0 * ramp_s + 15.0, 0.0)]
        at_s += 2.0 * ramp_s + 21.0
        corners.append((at_s, 0.0))
    return _rounded(corners)


def _mixed(rng: np.random.Generator) -> Array:
    """Ramps and holds at random."""
    corners, at_s, load = [(0.0, 0.0), (1.5, 0.0)], 1.5, 0.0
    while at_s < 40.0:
        level = rng.uniform() if rng.random() > 0.2 else 0.0
        ramp_s, hold_s = max(abs(level - load) / rng.uniform(0.15, 1.0), 0.03), rng.uniform(0.5, 4.0)
        corners += [(at_s + ramp_s, level), (at_s + ramp_s + hold_s, level)]
        at_s, load = at_s + ramp_s + hold_s, level
    return _rounded([*corners, (at_s + 1.0, 0.0), (at_s + 3.0, 0.0)])


def _solid(load: Array) -> Array:
    """A wall with one arm that relaxes within a second: p + 0.12 (p - q) = f, q' = p - q."""
    kept, q, out = math.exp(-STEP_S), 0.0, []
    for f in load.tolist():
        p = (f + 0.12 * q) / 1.12
        q = kept * q + (1.0 - kept) * p
        out.append(p)
    return np.array(out)


def _recorded(name: str, load: Array, rng: np.random.Generator, zero_mbar: float = 0.0) -> Recording:
    read = _solid(load)
    bent = np.where(read > LEVEL, LEVEL + (1.0 - SLOPE_LOST) * (read - LEVEL), read)[::THINNED]
    force_n = FULL_N * (load[::THINNED] + 2e-4 * rng.standard_normal(bent.size))
    pressure_mbar = zero_mbar + FULL_MBAR * (bent + 5e-4 * rng.standard_normal(bent.size))
    time_s = THINNED * STEP_S * np.arange(bent.size)
    return Recording.from_arrays(name=name, time_s=time_s, force_n=force_n, pressure_mbar=pressure_mbar)


@pytest.fixture(scope="module", params=[0.0, 90.0], ids=["zeroed", "not zeroed"])
def told(request: pytest.FixtureRequest) -> tuple[Diagnosis, Recording]:
    """The diagnosis, and what was held out."""
    rng, zero_mbar = np.random.default_rng(3), request.param
    loads = {"triangles": _triangles(), "holds": _holds()}
    fitted = [_recorded(name, load, rng, zero_mbar) for name, load in loads.items()]
    held = _recorded("mixed", _mixed(rng), rng, zero_mbar)
    return diagnose(fitted, hold_out=held), held


def test_the_stated_error_of_the_force_is_true_and_less_than_the_plain_models(
    told: tuple[Diagnosis, Recording],
) -> None:
    found, held = told
    assert found.extended is not None
    assert found.baseline is not None
    force_n = found.calibration().compensator(100.0).apply(held)
    off_n = float(np.sqrt(np.mean((force_n - held.force_n) ** 2)))
    above = held.force_n > 1.02 * LEVEL * FULL_N
    off_above_n = float(np.sqrt(np.mean((force_n - held.force_n)[above] ** 2)))
    assert found.extended.force_rmse_n == pytest.approx(off_n, rel=0.15)
    assert max(off_n, off_above_n) < 0.25 * found.baseline.force_rmse_n


def test_no_sample_of_a_bend_is_said_to_be_clipped(told: tuple[Diagnosis, Recording]) -> None:
    found, _ = told
    assert found.clipped == 0.0
    assert not any("clipped" in one for one in (*found.limits, *found.limits_of_the_force))
