"""A stiffening that levels off where no fitted recording was: what is claimed of faster loads is judged."""

from __future__ import annotations

import numpy as np
import pytest

from smartshoe.arrays import Array
from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

PEAK_N = 800.0
STEP_S = 0.01
LEVELS_OFF_N_PER_S = 160.0  # the fastest that is fitted


def _triangles(rates_n_per_s: tuple[float, ...]) -> Array:
    """Load (n,) in N: two triangles at each rate, with rests between."""
    parts = []
    for rate in rates_n_per_s * 2:
        up = np.linspace(0.0, PEAK_N, round(PEAK_N / rate / STEP_S) + 1)
        parts += [up, up[::-1], np.zeros(round(3.0 / STEP_S))]
    return np.concatenate(parts)


def _recorded(rates_n_per_s: tuple[float, ...], seed: int, name: str) -> Recording:
    load = _triangles(rates_n_per_s)
    time_s = STEP_S * np.arange(load.size)
    rate = np.abs(np.gradient(load, STEP_S))
    stiffer = 1.0 + 0.06 * np.sqrt(np.minimum(rate, LEVELS_OFF_N_PER_S) / LEVELS_OFF_N_PER_S)
    noise = np.random.default_rng(seed).normal(0.0, 0.05, load.size)
    return Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.18 * load * stiffer + noise, name=name)


@pytest.mark.parametrize("faster", [pytest.param(1.0, marks=pytest.mark.long), 10.0])
def test_an_extension_that_is_worse_on_faster_loads_says_so(faster: float) -> None:
    """Judged by loads as fitted, the effect is explained; by ten times faster ones it is not, and the page says why."""
    fitted = [_recorded((20.0, 40.0, 80.0, 160.0), 1, "slow_1"), _recorded((30.0, 60.0, 120.0), 2, "slow_2")]
    held_out = _recorded((160.0 * faster, 80.0 * faster), 3, "held")
    found = diagnose(fitted, [held_out])
    assert "rate_gain" in {cause.name for cause in found.causes}
    assert found.gain is not None
    worse = [said for said in found.limits if "worse than the baseline" in said]
    if faster == 1.0:
        assert found.verdict == "explained"
        assert found.gain.ci95[0] > 0.0
        assert not worse
        assert found.rejected is None
    else:
        assert found.verdict == "partly_explained"
        assert found.gain.ci95[1] < 0.0
        assert "change by up to 1,600 N/s (160 in what was fitted)" in worse[0]
        assert "it is worse there" in found.says
        assert found.rejected is not None
        assert "rate_gain" in found.rejected.names
        assert found.model is not None
        assert not {"rate_gain", "gas_heat"} & {*found.model.names}
        assert found.extended is not None
        assert found.baseline is not None
        assert found.extended.rmse == found.baseline.rmse
        assert found.extended.force_rmse_n == found.baseline.force_rmse_n
        assert found.next_experiment is not None
        assert "held" in found.next_experiment.says
