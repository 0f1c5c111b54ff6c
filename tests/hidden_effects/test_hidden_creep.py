"""Creep that grows from decade to decade, as a power of time does: nothing that it leaves is a set or a drift."""

from __future__ import annotations

import numpy as np
import pytest
from daily import first_and_bank
from scipy.signal import fftconvolve

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

RATE_HZ, FULL_N, FULL_MBAR, NOISE_MBAR = 100.0, 500.0, 100.0, 0.06
SPANS_S, PEAKS, RESTS_S = (2.0, 5.0, 1.0), (1.0, 0.5, 0.8), (0.0, 1.0, 4.0)


def _triangles() -> list[tuple[float, float]]:
    """Seconds and share of full load, one after the other, at three rates to three peaks."""
    return [
        corner
        for k in range(15)
        for corner in ((SPANS_S[k // 3 % 3], PEAKS[k % 3]), (SPANS_S[k // 3 % 3], 0.0), (RESTS_S[k % 3], 0.0))
    ]


def _holds() -> list[tuple[float, float]]:
    return [corner for peak in (1.0, 0.4, 0.7) for corner in ((1.0, peak), (19.0, peak), (1.0, 0.0), (15.0, 0.0))]


def _stairs(rng: np.random.Generator) -> list[tuple[float, float]]:
    return [corner for at in rng.permutation(np.linspace(0.0, 1.0, 13)) for corner in ((1.0, at), (7.0, at))]


def _recording(moves: list[tuple[float, float]], power: float, creep: float, rng: np.random.Generator) -> Recording:
    """A unit whose reading of a load step is 1 + ``creep`` (t/10 s)^``power``, and nothing else but noise."""
    seconds, shares = np.array([(0.0, 0.0), (3.0, 0.0), *moves, (1.0, 0.0), (5.0, 0.0)]).T
    ends_s = np.cumsum(seconds)
    time_s = np.arange(int(ends_s[-1] * RATE_HZ)) / RATE_HZ
    load = np.interp(time_s, ends_s, shares)
    later = fftconvolve(np.diff(load, prepend=0.0), creep * (time_s / 10.0) ** power)[: load.size]
    return Recording.from_arrays(
        time_s=time_s,
        force_n=FULL_N * load + 0.15 * rng.standard_normal(load.size),
        pressure_mbar=FULL_MBAR * (load + later) + NOISE_MBAR * rng.standard_normal(load.size),
    )


@pytest.mark.parametrize("creep", first_and_bank((0.1, 0.2), {0.1}))
@pytest.mark.parametrize("power", first_and_bank((0.1, 0.2, 0.3), {0.3}))
def test_creep_with_a_power_of_time_is_all_that_is_named(power: float, creep: float) -> None:
    rng = np.random.default_rng(7)
    fitted = [_recording(moves, power, creep, rng) for moves in (_triangles(), _holds())]
    found = diagnose(fitted, [_recording(_stairs(rng), power, creep, rng)])
    assert found.verdict == "explained"
    assert [cause.name for cause in found.causes] == ["power_law_creep"]
    assert found.causes[0].confidence > 0.9
    assert found.extended is not None
    assert found.extended.rmse < 1.1 * NOISE_MBAR
