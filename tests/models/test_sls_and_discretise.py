"""The standard linear solid and its difference equations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.errors import UsageError
from smartshoe.models import X_OVER_NRT, StandardLinearSolid, discretise, simulate
from smartshoe.models.discretise import run_plainly
from smartshoe.models.first_order import interpolation_taps, lag, lag_and_slope, shifted, steps

positive = st.floats(0.05, 20.0)


def test_x_over_nrt_is_the_papers() -> None:
    assert pytest.approx(0.38113, abs=5e-6) == X_OVER_NRT


@given(k1=positive, k2=positive, c=positive, scale=positive)
@settings(max_examples=30)
def test_coefficients_turn_back_into_the_solid(k1: float, k2: float, c: float, scale: float) -> None:
    solid = StandardLinearSolid(k1, k2, c)
    back = StandardLinearSolid.from_coefficients(solid.a1, solid.b0 * scale, solid.b1 * scale, scale)
    assert [back.k1, back.k2, back.c] == pytest.approx([k1, k2, c], rel=1e-9)


@given(k1=positive, k2=positive, c=positive, seed=st.integers(0, 99))
@settings(max_examples=20)
def test_a_closed_cycle_dissipates_what_goes_in(k1: float, k2: float, c: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.linspace(0.0, 2.0, 4001)
    x = sum(rng.standard_normal() * np.sin(np.pi * n * time_s) ** 2 for n in (1, 2, 3))
    solid = StandardLinearSolid(k1, k2, c)
    # From the second cycle on the springs give back what they took, once the start has faded.
    cycles = int(np.ceil(12.0 * c / k2 / 2.0)) + 1
    if cycles > 40:
        return
    period = np.arange(cycles + 1)[:, None] * 2.0 + time_s[:-1]
    t, deformation = period.ravel(), np.tile(x[:-1], cycles + 1)
    force = solid.wall_force(t, deformation)
    last = slice(t.size - 4001, t.size)
    work = np.trapezoid(force[last], deformation[last])
    heat = solid.dissipated_energy(t, deformation) - solid.dissipated_energy(
        t[: t.size - 4000], deformation[: t.size - 4000]
    )
    assert heat >= 0.0
    assert work == pytest.approx(heat, rel=2e-3, abs=1e-4 * k2)


@given(a1=positive, b0=positive, b1=positive, rate=st.floats(20.0, 500.0), seed=st.integers(0, 99))
@settings(max_examples=20)
def test_foh_recursion_equals_its_difference_equation(a1: float, b0: float, b1: float, rate: float, seed: int) -> None:
    u = np.random.default_rng(seed).standard_normal(200).cumsum()
    fast = simulate(a1, b0, b1, u, np.arange(200) / rate)
    np.testing.assert_allclose(fast, run_plainly(*discretise(a1, b0, b1, rate, "foh"), u), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("method", ["bilinear", "zoh", "foh"])
def test_every_discretisation_keeps_the_static_gain(method: str) -> None:
    numerator, denominator = discretise(0.215, 1.593, 0.3249, 100.0, method)
    assert numerator.sum() / denominator.sum() == pytest.approx(0.3249 / 0.215, rel=1e-9)


def test_bilinear_converges_with_the_square_of_the_step() -> None:
    a1, b0, b1 = 2.0, 1.5, 2.6
    errors = []
    for rate in (50.0, 100.0, 200.0):
        time_s = np.arange(0, 4.0, 1 / rate)
        u = np.sin(3 * time_s) ** 2
        exact = simulate(a1, b0, b1, np.sin(3 * np.arange(0, 4.0, 1 / 6400)) ** 2, np.arange(0, 4.0, 1 / 6400))
        y = run_plainly(*discretise(a1, b0, b1, rate), u)
        errors.append(float(np.max(np.abs(y - exact[:: int(6400 / rate)]))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)


@pytest.mark.parametrize("count", [300, 5000])
def test_uneven_steps_agree_with_even_ones_where_the_signal_is_piecewise_straight(count: int) -> None:
    rng = np.random.default_rng(1)
    corners = np.linspace(0.0, 10.0, 21)
    heights = rng.standard_normal(21)
    fine = np.linspace(0.0, 10.0, 20001)
    uneven = np.union1d(rng.uniform(0, 10, count), corners)
    reference = lag(np.interp(fine, corners, heights), 0.7, steps(fine))
    w = lag(np.interp(uneven, corners, heights), 0.7, steps(uneven))
    np.testing.assert_allclose(w, np.interp(uneven, fine, reference), rtol=0, atol=1e-6)


@pytest.mark.parametrize("alpha", [1e-4, 0.09, 0.11, 5.0, 300.0])
@pytest.mark.parametrize("even", [True, False])
def test_slope_over_the_pole_is_the_difference_quotient(alpha: float, even: bool) -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal(400).cumsum()
    step = 0.01 if even else rng.uniform(0.005, 0.02, 399)
    slope = lag_and_slope(u, alpha, step)[1]
    change = 1e-4 * alpha
    quotient = (lag(u, alpha + change, step) - lag(u, alpha - change, step)) / (2 * change)
    np.testing.assert_allclose(slope, quotient, rtol=1e-5, atol=1e-5 * np.max(np.abs(quotient)))


@given(shift=st.floats(-0.2, 0.2), even=st.booleans())
@settings(max_examples=20)
def test_shift_is_exact_for_ramps_inside(shift: float, even: bool) -> None:
    time_s = np.arange(200) / 100 if even else np.sort(np.random.default_rng(3).uniform(0, 2, 200))
    value, slope = shifted(3 * time_s, time_s, steps(time_s), shift)
    edge = 9 if even else 3
    inside = (time_s + shift > time_s[edge]) & (time_s + shift < time_s[-edge])
    assert value[inside] == pytest.approx(3 * (time_s + shift)[inside], abs=1e-9)
    assert slope[inside] == pytest.approx(3.0, abs=1e-6)


@given(shift=st.floats(-0.05, 0.05), share=st.floats(0.01, 0.7))
@settings(max_examples=30)
def test_shift_passes_waves_up_to_near_the_nyquist_frequency(shift: float, share: float) -> None:
    time_s = np.arange(400) / 100
    omega = share * np.pi * 100
    value, slope = shifted(np.sin(omega * time_s), time_s, steps(time_s), shift)
    inside = slice(20, -20)
    # The window's transition ends at 7/8 of the Nyquist frequency; far below it the error is the window's ripple.
    tolerance = 0.01 if share > 0.5 else 1e-3
    np.testing.assert_allclose(value[inside], np.sin(omega * (time_s + shift))[inside], rtol=0, atol=tolerance)
    np.testing.assert_allclose(
        slope[inside], omega * np.cos(omega * (time_s + shift))[inside], rtol=0, atol=10 * tolerance * omega
    )


@given(fraction=st.floats(0.0, 1.0))
def test_interpolation_slopes_are_the_difference_quotients(fraction: float) -> None:
    change = 1e-6
    quotient = (interpolation_taps(fraction + change)[0] - interpolation_taps(fraction - change)[0]) / (2 * change)
    assert interpolation_taps(fraction)[1] == pytest.approx(quotient, abs=1e-7)


@pytest.mark.parametrize("a1", [0.0, -1.0, float("nan")])
def test_an_unstable_filter_is_refused(a1: float) -> None:
    with pytest.raises(UsageError, match="a1"):
        discretise(a1, 1.0, 1.0, 100.0)


def test_steps_are_even_up_to_a_thousandth_of_one() -> None:
    time_s = np.arange(500) * 0.01
    jitter_s = 0.01 * np.random.default_rng(4).uniform(-1.0, 1.0, time_s.size)
    assert steps(np.round(time_s + 1e-7, 6)) == pytest.approx(0.01)  # stamps of a logger that counts microseconds
    assert steps(time_s + 4e-4 * jitter_s) == pytest.approx(0.01, rel=1e-5)
    uneven = time_s + 2e-3 * jitter_s
    assert np.array_equal(steps(uneven), np.diff(uneven))
