"""Figures of merit and segments on cases whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration
from smartshoe.calibration.validation import _metrics as metrics
from smartshoe.calibration.validation import validate
from smartshoe.errors import InputError
from smartshoe.recording import Recording
from smartshoe.signals import loading
from smartshoe.units import MILLIBAR


@settings(max_examples=20)
@given(a=st.floats(0.1, 1e3), b=st.floats(0.1, 1e3))
def test_an_ellipse_encloses_pi_a_b(a, b):
    angle = np.linspace(0.0, 2 * np.pi, 2000, endpoint=False)
    # A polygon of n corners in an ellipse lacks 2 pi^2 / (3 n^2) of its area.
    assert metrics.loop_area(a * np.cos(angle), b * np.sin(angle)) == pytest.approx(np.pi * a * b, rel=2e-6)


@settings(max_examples=20)
@given(
    rates=st.lists(st.sampled_from([50.0, 100.0, 200.0, 400.0, 600.0, 800.0]), min_size=1, max_size=4),
    noise_n=st.floats(0.0, 5.0),
    seed=st.integers(0, 2**31),
)
def test_drawn_rates_are_recovered_from_noisy_triangles(rates, noise_n, seed):
    at, load = [0.0], [0.0]
    for rate in rates:
        start = at[-1] + 2.0
        at += [start, start + 800.0 / rate, start + 1600.0 / rate]
        load += [0.0, 800.0, 0.0]
    time_s = np.arange(0.0, at[-1] + 2.0, 0.01)
    noisy = np.interp(time_s, at, load) + np.random.default_rng(seed).normal(0.0, noise_n, time_s.size)
    found = loading.cycles(time_s, noisy)
    # Two end samples of sd 5 N each over 640 N: 1.1 % of rate sd a ramp; four and more of those.
    assert [cycle.rate_n_per_s for cycle in found] == pytest.approx(rates, rel=0.05)


def test_the_static_line_may_have_an_offset() -> None:
    """A sensor that is a line with a zero of its own leaves the best static line no error."""
    time_s = np.arange(0.0, 12.0, 0.01)
    load_n = np.interp(time_s, [2.0, 6.0, 10.0], [0.0, 800.0, 0.0])
    recording = Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=0.5 * load_n + 30.0)
    found = validate(recording, Calibration(0.2, 2.1, 0.4, reading_unit=MILLIBAR))
    assert found.static_gain == pytest.approx(2.0)
    assert found.static_offset_n == pytest.approx(-60.0)
    assert found.overall.rmse_static_n == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(found.traces[0].static_n, load_n, rtol=0, atol=1e-9)


def test_a_reading_that_never_moves_is_refused_as_no_usable_data() -> None:
    time_s = np.arange(0.0, 12.0, 0.01)
    load_n = np.interp(time_s, [2.0, 6.0, 10.0], [0.0, 800.0, 0.0])
    recording = Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=np.full(time_s.size, 12.5))
    with pytest.raises(InputError, match="never moves"):
        validate(recording, Calibration(0.2, 2.1, 0.4, reading_unit=MILLIBAR))


@pytest.mark.parametrize("unit", ["left_toe", "left_heel"])
def test_of_a_whole_shoe_the_calibrated_units_reading_is_judged(unit: str) -> None:
    t = np.arange(0.0, 20.0, 0.01)
    load = 400.0 * (1.0 - np.abs(t % 4.0 - 2.0) / 2.0)
    readings = {"left_toe_mbar": load / 5.0, "left_heel_mbar": load**2 / 2000.0}
    shoe = Recording.from_arrays(time_s=t, force_n=load, **readings)
    calibration = Calibration(0.2, 5.0, 1.0, MILLIBAR, unit=unit)
    alone = Recording.from_arrays(time_s=t, force_n=load, pressure_mbar=readings[f"{unit}_mbar"], name=shoe.name)
    assert validate(shoe, calibration).to_dict() == validate(alone, calibration).to_dict()
    with pytest.raises(InputError, match="no reading of the calibrated unit 'right_toe'"):
        validate(shoe, Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="right_toe"))


@pytest.mark.parametrize("delay_s", [-0.02, 0.0, 0.03])
def test_a_delay_is_told_where_the_estimate_follows_the_load_and_not_of_noise(delay_s: float) -> None:
    time_s = np.arange(0.0, 12.0, 0.01)
    noise = np.random.default_rng(3).standard_normal((40, time_s.size))
    load_n = 400.0 - 400.0 * np.cos(2.0 * np.pi * time_s / 4.0)
    late_n = 400.0 - 400.0 * np.cos(2.0 * np.pi * (time_s - delay_s) / 4.0)
    assert metrics.delay_s(load_n, 0.7 * late_n + noise[0], 0.01) == pytest.approx(delay_s, abs=2e-3)
    told = [metrics.delay_s(load_n, one, 0.01) for one in noise]
    assert sum(one is not None for one in told) <= 8  # 5 % of 40, and three sd more
    assert all(abs(one) < 12.0 for one in told if one is not None)


@pytest.mark.parametrize(("height", "counts"), [(0.2, False), (0.4, True), (0.55, True)])
def test_a_ramp_counts_from_three_tenths_of_the_records_load_range_on(height: float, counts: bool) -> None:
    top_n = 1000.0 * height
    time_s = np.arange(0.0, 40.0, 0.01)
    load_n = np.interp(time_s, [2, 12, 22, 25, 29, 33], [0.0, 1000.0, 0.0, 0.0, top_n, 0.0])
    found = [cycle.rate_n_per_s for cycle in loading.cycles(time_s, load_n)]
    assert found == pytest.approx([100.0, top_n / 4.0] if counts else [100.0], rel=1e-6)


def test_one_ramp_tells_no_delay() -> None:
    """Its slope is the constant but for rounding: of the normal matrix nothing is left to invert."""
    time_s = np.arange(0.0, 0.4, 0.02)
    load_n = 100.0 - 100.0 * np.abs((time_s / 5.0) % 2.0 - 1.0)
    noise = 0.05 * np.random.default_rng(1).standard_normal(time_s.size)
    assert metrics.delay_s(load_n, 5.0 + 0.9 * load_n + noise, 0.02) is None
