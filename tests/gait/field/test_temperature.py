"""Sealed air presses as p V = n R T says; what is not alike in all units is no temperature."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import UsageError
from smartshoe.gait.field import sealed_air_pa_per_k, temperature_of_zeros, temperature_sensitivity

NAMES = ("toe", "meta1", "meta4", "heel")
GAS_CONSTANT = 8.3145


def test_eight_kelvin_are_27_mbar_of_a_200_mbar_range() -> None:
    volume_m3, temperature_k, pressure_pa = 1.2e-6, 296.0, 1e5
    amount_mol = pressure_pa * volume_m3 / (GAS_CONSTANT * temperature_k)
    rise_pa = amount_mol * GAS_CONSTANT * (temperature_k + 8.0) / volume_m3 - pressure_pa
    assert 8.0 * sealed_air_pa_per_k(pressure_pa, temperature_k) == pytest.approx(rise_pa, rel=1e-9)
    assert rise_pa / 100.0 == pytest.approx(27.0, abs=0.05)
    assert rise_pa / 20_000.0 == pytest.approx(0.135, abs=0.0005)


@given(st.floats(-15.0, 15.0))
def test_a_common_shift_is_the_warming_that_made_it(delta_k: float) -> None:
    finding = temperature_of_zeros(np.full(4, delta_k * sealed_air_pa_per_k()), 10.0, NAMES)
    assert finding.numbers["delta_k"] == pytest.approx(delta_k, abs=1e-9)
    assert finding.verdict == ("warning" if abs(delta_k) > 3.0 else "ok")
    if abs(delta_k) > 1.0:
        assert ("warms" in finding.says) == (delta_k > 0.0)


def test_the_sd_of_the_warming_is_what_repeats_show() -> None:
    rng = np.random.default_rng(0)
    found = [temperature_of_zeros(30.0 * rng.standard_normal(4), 30.0, NAMES).numbers for _ in range(300)]
    # Of 300 draws the sd is known to 4 %; a tenth of the median change widens it a little.
    assert np.std([n["delta_k"] for n in found]) == pytest.approx(np.mean([n["sd_k"] for n in found]), rel=0.15)
    # One in a hundred by chance: 300 with nine or more has a chance of 0.4 %.
    assert sum(n["p_value"] < 0.01 for n in found) < 9


def test_a_unit_that_goes_its_own_way_is_named() -> None:
    finding = temperature_of_zeros([2700.0, 2650.0, 2750.0, 200.0], 20.0, NAMES)
    assert (finding.verdict, finding.unit) == ("unknown", "heel")
    assert "leak or a load" in finding.says


def test_a_logged_temperature_gives_the_share_of_sealed_air() -> None:
    rng = np.random.default_rng(1)
    warm_k = 296.0 + np.linspace(0.0, 8.0, 40)
    share = 0.6  # of a tube whose wall gives
    zeros_pa = share * sealed_air_pa_per_k(temperature_k=300.0) * (warm_k - 296.0) + 20.0 * rng.standard_normal(40)
    numbers = temperature_sensitivity(warm_k, zeros_pa).numbers
    true = share * sealed_air_pa_per_k(temperature_k=300.0)
    assert numbers["low_pa_per_k"] < true < numbers["high_pa_per_k"]
    assert numbers["share"] == pytest.approx(share, abs=0.02)


def test_a_temperature_that_keeps_still_says_nothing() -> None:
    finding = temperature_sensitivity([296.0, 296.1, 296.2], [0.0, 10.0, 5.0])
    assert finding.verdict == "unknown"


def test_wrong_input_is_said() -> None:
    with pytest.raises(UsageError, match="no state of air"):
        sealed_air_pa_per_k(0.0)
    with pytest.raises(UsageError, match="sd above 0"):
        temperature_of_zeros([1.0, 2.0], 0.0, ("toe", "heel"))
    with pytest.raises(UsageError, match="three moments"):
        temperature_sensitivity([1.0, 2.0], [1.0, 2.0])
