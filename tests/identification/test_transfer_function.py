"""`identify_transfer_function` against data that SciPy simulates, never this project."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag, expm
from scipy.signal import lsim, max_len_seq

from smartshoe.errors import InputError, NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification.transfer_function import identify_transfer_function
from smartshoe.identification.transfer_function._discrete import StateVariableFilter
from smartshoe.identification.transfer_function._experiment import prepare
from smartshoe.identification.transfer_function._problem import OutputError, Structure, Whitened
from smartshoe.identification.transfer_function._srivc import least_squares, reflected

RAO_GARNIER = ([-6400.0, 1600.0], [1.0, 5.0, 408.0, 416.0, 1600.0])
LATE = ([-4.0, 0.5], [1.0, 1.0, 4.0])
PEM = ("gn", "lm", "trf")


def simulated(system, u, step_s, hold="zoh", start=None):
    """Samples of the continuous output, from SciPy; the numerator's leading zeros are left to it."""
    numerator, denominator = system
    padded = np.concatenate([np.zeros(len(denominator) - len(numerator)), numerator])
    time_s = np.arange(u.size) * step_s
    return lsim(_companion(padded, denominator), u, time_s, X0=start, interp=hold == "foh")[1]


def _companion(padded, denominator):
    """Controllable form without SciPy's own warning on leading zeros of a numerator."""
    n = len(denominator) - 1
    direct = padded[0]
    A = np.zeros((n, n))
    A[0] = -np.asarray(denominator[1:])
    A[1:, :-1] = np.eye(n - 1)
    B = np.eye(n)[:, :1]
    C = (np.asarray(padded[1:]) - direct * np.asarray(denominator[1:]))[None, :]
    return A, B, C, np.array([[direct]])


def prbs(bits, held, count=None):
    u = np.repeat(2.0 * max_len_seq(bits)[0] - 1.0, held)
    return u if count is None else np.resize(u, count)


def coefficients(system):
    return np.concatenate([system[0], system[1][1:]])


def found_coefficients(estimate):
    return np.concatenate([estimate.numerator, estimate.denominator[1:]])


def with_noise(y, decibels, rng):
    return y + rng.normal(size=y.size) * np.std(y) * 10 ** (-decibels / 20)


@st.composite
def stable_systems(draw):
    """Order 1 to 6, poles spread over a decade, zeros between them in radius so that no pair cancels."""
    order = draw(st.integers(1, 6))
    radius, poles = draw(st.floats(0.5, 2.0)), []
    middles = []
    for _ in range(order // 2):
        damping = draw(st.floats(0.1, 0.5))
        poles += [radius * complex(-damping, sign * np.sqrt(1 - damping**2)) for sign in (1, -1)]
        middles.append(radius * 1.5)
        radius *= draw(st.floats(2.0, 2.5))
    if order % 2:
        poles.append(complex(-radius, 0.0))
    zeros = [-radius * draw(st.sampled_from([1, -1])) for radius in middles[: draw(st.integers(0, len(middles)))]]
    denominator = np.real(np.poly(poles))
    numerator = np.real(np.poly(zeros)) if zeros else np.ones(1)
    return numerator * denominator[-1] / numerator[-1] * draw(st.floats(0.5, 2.0)), denominator


def excitation(denominator, hold, count, rng):
    """A step in s that resolves the fastest pole, and an input that excites from the slowest to it."""
    radii = np.abs(np.roots(denominator))
    step_s = 0.4 / radii.max()
    if hold == "foh":
        return rng.normal(size=count), step_s
    longest = max(int(2.0 / radii.min() / step_s), 2)
    return np.repeat(rng.choice([-1.0, 1.0], count), rng.integers(1, longest, count))[:count], step_s


@settings(max_examples=9)
@given(stable_systems(), st.sampled_from(["zoh", "foh"]), st.integers(0, 2**32 - 1))
def test_any_order_is_recovered_exactly_without_noise_and_within_its_error_bars_with_it(system, hold, seed):
    rng = np.random.default_rng(seed)
    u, step_s = excitation(system[1], hold, 3000, rng)
    y = simulated(system, u, step_s, hold)
    structure = {"poles": len(system[1]) - 1, "zeros": len(system[0]) - 1, "sample_time_s": step_s, "intersample": hold}
    exact = identify_transfer_function(u, y, method="srivc", **structure)
    np.testing.assert_allclose(found_coefficients(exact), coefficients(system), rtol=1e-6)
    noisy = with_noise(y, 30.0, rng)
    ends = [identify_transfer_function(u, noisy, method=method, **structure) for method in PEM]
    for end in ends:
        assert end.rmse == pytest.approx(ends[0].rmse, rel=1e-9)
        np.testing.assert_allclose(
            found_coefficients(end) / ends[0].sd, found_coefficients(ends[0]) / ends[0].sd, atol=2e-3
        )
    assert np.all(np.abs(found_coefficients(ends[0]) - coefficients(system)) < 5.0 * ends[0].sd)


@settings(max_examples=12)
@given(
    stable_systems(),
    st.sampled_from(["zoh", "foh"]),
    st.sampled_from(["estimate", "rest", "steady"]),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_gradient_is_the_difference_quotient_of_the_cost(system, hold, initial_state, uneven, seed):
    rng = np.random.default_rng(seed)
    u, step_s = excitation(system[1], hold, 150, rng)
    time_s = np.cumsum(rng.uniform(0.5, 1.5, u.size)) * step_s if uneven else None
    y = rng.normal(size=u.size)
    y[40:50] = np.nan
    experiments, _ = prepare(u, y, sample_time_s=None if uneven else step_s, time_s=time_s, hold=hold)
    problem = OutputError(
        experiments,
        Structure(len(system[1]) - 1, len(system[0]) - 1, hold, initial_state, None),
        delayed=True,
        most_delay_s=3.0 * step_s,
    )
    theta = np.append(coefficients(system), 1.37 * step_s)
    seen = Whitened(problem, theta)
    inside = seen.inside(theta)
    gradient = seen.evaluate(inside).gradient
    for index in range(inside.size):
        nudge = np.zeros(inside.size)
        nudge[index] = 1e-5 * max(abs(inside[index]), 1e-2)
        quotient = (seen.evaluate(inside + nudge).cost - seen.evaluate(inside - nudge).cost) / (4 * nudge[index])
        assert gradient[index] == pytest.approx(quotient, rel=1e-5, abs=1e-6 * np.abs(gradient).max() + 1e-9)


@settings(max_examples=8)
@given(stable_systems(), st.sampled_from(["zoh", "foh"]), st.floats(0.0, 2.9))
def test_uneven_recursion_is_the_even_one_on_even_steps(system, hold, delay):
    rng = np.random.default_rng(3)
    u, step_s = excitation(system[1], hold, 80, rng)
    time_s = np.arange(u.size) * step_s
    chain = StateVariableFilter(system[1][1:])
    start = rng.normal(size=chain.size)
    even = chain.run_even(u, 4, 70, start, step_s, hold, delay * step_s)
    uneven = chain.run_uneven(u, time_s, time_s[4:74], start, hold, delay * step_s)
    scale = np.abs(even.states).max(axis=0)
    np.testing.assert_allclose(uneven.states / scale, even.states / scale, atol=1e-10)
    np.testing.assert_allclose(uneven.value, even.value, atol=1e-9)


@pytest.mark.parametrize("prefilter_rad_s", [pytest.param(5.0, marks=pytest.mark.long), 20.0])
def test_rao_garnier_settles_in_ten_iterations_at_the_cramer_rao_bound(prefilter_rad_s):
    u, step_s = prbs(10, 7), 0.01
    y = simulated(RAO_GARNIER, u, step_s)
    noise_sd = np.std(y) * 10**-0.5
    truth = coefficients(RAO_GARNIER)
    gradient = np.empty((u.size, truth.size))
    for index, value in enumerate(truth):
        sides = []
        for sign in (1, -1):
            moved = truth.copy()
            moved[index] += sign * 1e-5 * value
            sides.append(simulated((moved[:2], np.concatenate([[1.0], moved[2:]])), u, step_s))
        gradient[:, index] = (sides[0] - sides[1]) / (2e-5 * value)
    information = gradient.T @ gradient / noise_sd**2
    bound = np.sqrt(np.diag(np.linalg.inv(information)))
    distances = []
    for seed in range(20):
        noisy = y + noise_sd * np.random.default_rng(seed).normal(size=y.size)
        estimate = identify_transfer_function(
            u, noisy, sample_time_s=step_s, poles=4, zeros=1, method="srivc", prefilter_rad_s=prefilter_rad_s
        )
        assert estimate.converged
        assert estimate.iterations <= 10
        # Offset and initial state cost 1.4 % at most here; the noise's estimated spread varies by 1 %.
        np.testing.assert_allclose(estimate.sd, bound, rtol=0.05)
        off = found_coefficients(estimate) - truth
        distances.append(off @ information @ off)
    # Chi-square of 6 degrees a run: a 1e-4 interval of the sum over 20.
    assert 67.0 < sum(distances) < 187.0


def test_the_three_methods_share_srivcs_optimum_on_rao_garnier():
    u = prbs(10, 7)
    y = with_noise(simulated(RAO_GARNIER, u, 0.01), 10.0, np.random.default_rng(1))
    ends = [
        identify_transfer_function(u, y, sample_time_s=0.01, poles=4, zeros=1, method=method)
        for method in ("srivc", *PEM)
    ]
    for end in ends[1:]:
        np.testing.assert_allclose(found_coefficients(end), found_coefficients(ends[-1]), rtol=1e-6)
        assert end.fit_percent == pytest.approx(ends[0].fit_percent, abs=1e-6)
    assert np.all(np.abs(found_coefficients(ends[0]) - found_coefficients(ends[1])) < 1e-2 * ends[1].sd)


@pytest.mark.parametrize(
    ("method", "seed", "max_delay_s"),
    [
        ("srivc", 2, None),
        *((method, 2, 10.0) for method in PEM),
        *(pytest.param(method, 2, None, marks=pytest.mark.long) for method in PEM),
        *(pytest.param("srivc", seed, None, marks=pytest.mark.bank) for seed in (1, 3)),
    ],
)
def test_a_delay_of_eight_seconds_is_found(method, seed, max_delay_s):
    step_s, late = 0.1, 80
    u = prbs(10, 5, 3000)
    y = np.concatenate([np.zeros(late), simulated(LATE, u, step_s)[:-late]])
    noisy = with_noise(y, 15.0, np.random.default_rng(seed))
    estimate = identify_transfer_function(
        u,
        noisy,
        sample_time_s=step_s,
        poles=2,
        zeros=1,
        delay_s="estimate",
        max_delay_s=max_delay_s,
        method=method,
        prefilter_rad_s=2.0,
    )
    assert estimate.iterations <= 10
    assert abs(estimate.delay_s - 8.0) < 4.0 * estimate.delay_sd_s < 0.02
    assert np.all(np.abs(found_coefficients(estimate) - coefficients(LATE)) < 4.0 * estimate.sd)


@pytest.mark.parametrize(("hold", "delay"), [("zoh", 3.37), ("foh", 3.37), ("zoh", 0.6), ("foh", 5.0)])
def test_a_fraction_of_a_sample_is_found_exactly(hold, delay):
    fine, step_s = 100, 0.1
    u = np.random.default_rng(4).normal(size=800)
    dense_time = np.arange(u.size * fine) / fine
    dense = np.repeat(u, fine) if hold == "zoh" else np.interp(dense_time, np.arange(u.size), u)
    late = round(delay * fine)
    y = simulated(LATE, np.concatenate([np.full(late, dense[0]), dense]), step_s / fine, hold)[: u.size * fine : fine]
    estimate = identify_transfer_function(
        u, y, sample_time_s=step_s, poles=2, zeros=1, intersample=hold, delay_s="estimate", max_delay_s=1.0
    )
    assert estimate.delay_s == pytest.approx(delay * step_s, abs=1e-8)
    np.testing.assert_allclose(found_coefficients(estimate), coefficients(LATE), rtol=1e-6)


def test_a_zero_on_the_wrong_side_does_not_pass_for_a_delay():
    # Mirroring the zero at -1.36 rad/s and taking 1.5 s off the delay leaves a minimum of its own.
    denominator = np.real(np.poly([-0.105 + 0.9j, -0.105 - 0.9j, -0.77 + 1.64j, -0.77 - 1.64j]))
    system = (np.array([1.0, 1.36]) * denominator[-1] / 1.36, denominator)
    rng = np.random.default_rng(20)
    u, step_s = excitation(denominator, "zoh", 2500, rng)
    late = 9
    y = np.concatenate([np.zeros(late), simulated(system, u, step_s)[:-late]])
    estimate = identify_transfer_function(
        u, with_noise(y, 20.0, rng), sample_time_s=step_s, poles=4, zeros=1, delay_s="estimate"
    )
    # Half way to the rival, at most.
    assert abs(estimate.delay_s - late * step_s) < 4.0 * estimate.delay_sd_s < 0.75
    assert np.all(np.abs(found_coefficients(estimate) - coefficients(system)) < 5.0 * estimate.sd)


def test_a_delay_is_found_from_a_single_step():
    step_s, late = 0.1, 13
    u = np.repeat([0.0, 1.0], [50, 500])
    y = np.concatenate([np.zeros(late), simulated(([1.0], LATE[1]), u, step_s)[:-late]])
    noisy = with_noise(y, 30.0, np.random.default_rng(18))
    estimate = identify_transfer_function(u, noisy, sample_time_s=step_s, poles=2, zeros=0, delay_s="estimate")
    assert abs(estimate.delay_s - 1.3) < 4.0 * estimate.delay_sd_s < 0.1
    assert np.all(np.abs(found_coefficients(estimate) - coefficients(([1.0], LATE[1]))) < 4.0 * estimate.sd)


@pytest.mark.parametrize("numerator", [[1000.0], [20.0, 1000.0]])
def test_second_order_at_a_millisecond(numerator):
    system = (numerator, [1.0, 20.0, 1000.0])
    u = prbs(12, 10, 20000)
    y = simulated(system, u, 1e-3)
    structure = {"poles": 2, "zeros": len(numerator) - 1, "sample_time_s": 1e-3, "prefilter_rad_s": 30.0}
    exact = identify_transfer_function(u, y, **structure)
    np.testing.assert_allclose(found_coefficients(exact), coefficients(system), rtol=1e-8)
    noisy = y + 2.3 * np.std(y) * np.random.default_rng(5).normal(size=y.size)
    estimate = identify_transfer_function(u, noisy, **structure)
    np.testing.assert_allclose(found_coefficients(estimate), coefficients(system), rtol=0.1)


def coupled_inertias(collocated):
    """Torque through a drive of second order to three discs on two shafts, held by a spring; angle of disc 1 or 3."""
    stiffness = 100.0 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    discs = np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness, -0.5 * np.eye(3)]])
    drive = np.array([[0.0, 1.0], [-400.0, -12.0]])
    A = block_diag(discs, drive)
    A[3, 6] = 1.0
    B, C = np.zeros((8, 1)), np.zeros((1, 8))
    B[7, 0], C[0, 0 if collocated else 2] = 400.0, 1.0
    denominator = np.real(np.poly(A))
    markov = [(C @ np.linalg.matrix_power(A, k) @ B).item() for k in range(8)]
    numerator = np.convolve(denominator, markov)[:8][3 if collocated else 7 :]
    return (A, B, C, np.zeros((1, 1))), (numerator, denominator)


@pytest.mark.parametrize("collocated", [True, False])
def test_three_coupled_inertias_of_order_eight(collocated):
    states, system = coupled_inertias(collocated)
    u, step_s = np.random.default_rng(6).choice([-1.0, 1.0], 20000), 0.02
    y = lsim(states, u, np.arange(u.size) * step_s, interp=False)[1]
    structure = {"poles": 8, "zeros": len(system[0]) - 1, "sample_time_s": step_s, "prefilter_rad_s": 20.0}
    exact = identify_transfer_function(u, y, method="srivc", **structure)
    np.testing.assert_allclose(found_coefficients(exact), coefficients(system), rtol=1e-4)
    noisy = y + 0.05 * np.std(y) * np.random.default_rng(7).normal(size=y.size)
    ends = [identify_transfer_function(u, noisy, method=method, **structure) for method in ("srivc", *PEM)]
    for end in ends:
        assert end.iterations <= 10
        np.testing.assert_allclose(found_coefficients(end), coefficients(system), rtol=5e-2)
        assert end.rmse == pytest.approx(ends[-1].rmse, rel=1e-8)


@settings(max_examples=6)
@given(st.floats(1e-3, 1e3), st.sampled_from(["zoh", "foh"]))
def test_time_in_other_units_scales_the_coefficients_and_nothing_else(factor, hold):
    u = prbs(9, 4, 1500)
    y = with_noise(simulated(LATE, u, 0.1, hold), 20.0, np.random.default_rng(8))
    one = identify_transfer_function(u, y, sample_time_s=0.1, poles=2, zeros=1, intersample=hold, prefilter_rad_s=2.0)
    other = identify_transfer_function(
        u, y, sample_time_s=0.1 * factor, poles=2, zeros=1, intersample=hold, prefilter_rad_s=2.0 / factor
    )
    powers = np.array([-1.0, -2.0, -1.0, -2.0])  # b0 and a0 of a system of order 2 go with 1/s^2
    np.testing.assert_allclose(found_coefficients(other), found_coefficients(one) * factor**powers, rtol=1e-7)
    np.testing.assert_allclose(other.sd, one.sd * factor**powers, rtol=1e-6)
    assert other.fit_percent == pytest.approx(one.fit_percent, rel=1e-9)


def test_several_experiments_keep_their_own_offsets_and_initial_states():
    rng = np.random.default_rng(9)
    inputs, outputs = [], []
    offsets, starts = (0.5, -2.0, 10.0), ([0.0, 0.0], [3.0, -1.0], [0.5, 2.0])
    for count, offset, start in zip((400, 700, 250), offsets, starts, strict=True):
        inputs.append(rng.choice([-1.0, 1.0], count).repeat(3))
        outputs.append(simulated(LATE, inputs[-1], 0.1, start=start) + offset)
    exact = identify_transfer_function(inputs, outputs, sample_time_s=0.1, poles=2, zeros=1)
    np.testing.assert_allclose(found_coefficients(exact), coefficients(LATE), rtol=1e-9)
    np.testing.assert_allclose(exact.offsets, offsets, atol=1e-9)
    A, _, C, _ = _companion(np.array([0.0, *LATE[0]]), LATE[1])
    for found, start in zip(exact.initial_states, starts, strict=True):
        # The free response C x, and its slope, from either description of the start.
        first, second = C @ start, C @ A @ start
        np.testing.assert_allclose([found[0], found[1] - LATE[1][1] * found[0]], [first[0], second[0]], atol=1e-8)
    noisy = [with_noise(y, 20.0, rng) for y in outputs]
    together = identify_transfer_function(inputs, noisy, sample_time_s=0.1, poles=2, zeros=1)
    alone = identify_transfer_function(inputs[1], noisy[1], sample_time_s=0.1, poles=2, zeros=1)
    assert np.all(np.abs(found_coefficients(together) - coefficients(LATE)) < 5.0 * together.sd)
    assert np.all(together.sd < alone.sd)
    assert np.all(np.abs(together.offsets - offsets) < 5.0 * together.offsets_sd)
    assert [one.size for one in together.residual] == [y.size for y in outputs]


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_missing_samples_are_counted_and_their_values_do_not_matter(hold):
    rng = np.random.default_rng(10)
    u = rng.normal(size=900).repeat(2)
    y = simulated(LATE, u, 0.1, hold)
    y[rng.choice(y.size, 300, replace=False)] = np.nan
    y[700:760] = np.inf
    estimate = identify_transfer_function(u, y, sample_time_s=0.1, poles=2, zeros=1, intersample=hold)
    assert estimate.n_missing == np.count_nonzero(~np.isfinite(y))
    assert estimate.n_samples == y.size - estimate.n_missing
    assert np.array_equal(np.isnan(estimate.residual[0]), ~np.isfinite(y))
    np.testing.assert_allclose(found_coefficients(estimate), coefficients(LATE), rtol=1e-8)
    hidden = np.ma.MaskedArray(np.where(np.isfinite(y), y, 1e9), mask=~np.isfinite(y))
    masked = identify_transfer_function(u, hidden, sample_time_s=0.1, poles=2, zeros=1, intersample=hold)
    np.testing.assert_array_equal(found_coefficients(masked), found_coefficients(estimate))


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("delay_fine", [0, 13])
def test_uneven_samples_are_exact(hold, delay_fine):
    rng = np.random.default_rng(11)
    fine_s = 0.01
    at = np.cumsum(rng.integers(2, 25, 600))
    time_s = at * fine_s
    u = rng.normal(size=at.size)
    dense_at = np.arange(at[0], at[-1] + 1)
    dense = u[np.searchsorted(at, dense_at, side="right") - 1] if hold == "zoh" else np.interp(dense_at, at, u)
    late = np.concatenate([np.full(delay_fine, dense[0]), dense])[: dense.size]
    y = simulated(LATE, late, fine_s, hold)[at - at[0]]
    estimate = identify_transfer_function(
        u, y, time_s=time_s, poles=2, zeros=1, intersample=hold, delay_s=delay_fine * fine_s, prefilter_rad_s=2.0
    )
    np.testing.assert_allclose(found_coefficients(estimate), coefficients(LATE), rtol=1e-8)
    asked = identify_transfer_function(
        u, y, time_s=time_s, poles=2, zeros=1, intersample=hold, delay_s="estimate", max_delay_s=0.5
    )
    assert asked.delay_s == pytest.approx(delay_fine * fine_s, abs=1e-7)


@pytest.mark.parametrize("initial_state", ["rest", "steady", "estimate"])
def test_a_start_that_is_known_needs_no_estimate(initial_state):
    u = prbs(9, 4, 1200) + 0.3
    A, B, _, _ = _companion(np.array([0.0, *LATE[0]]), LATE[1])
    start = {"rest": [0.0, 0.0], "steady": -np.linalg.solve(A, B[:, 0] * u[0]), "estimate": [1.0, -2.0]}[initial_state]
    y = simulated(LATE, u, 0.1, start=start)
    estimate = identify_transfer_function(
        u, y, sample_time_s=0.1, poles=2, zeros=1, initial_state=initial_state, offset=0.0
    )
    np.testing.assert_allclose(found_coefficients(estimate), coefficients(LATE), rtol=1e-8)
    again = estimate.simulate(u, initial_state="rest")
    np.testing.assert_allclose(again, simulated(LATE, u, 0.1), atol=1e-8)


def test_a_direct_term_takes_as_many_zeros_as_poles():
    u = np.random.default_rng(12).normal(size=2000)
    system = ([2.0, 3.0, 8.0], [1.0, 1.0, 4.0])
    for hold in ("zoh", "foh"):
        y = simulated(system, u, 0.1, hold)
        estimate = identify_transfer_function(u, y, sample_time_s=0.1, poles=2, zeros=2, intersample=hold)
        np.testing.assert_allclose(found_coefficients(estimate), coefficients(system), rtol=1e-8)
        late = np.concatenate([np.full(5, y[0]), y[:-5]])
        delayed = identify_transfer_function(
            u, late, sample_time_s=0.1, poles=2, zeros=2, intersample=hold, delay_s="estimate", max_delay_s=1.0
        )
        assert delayed.delay_s == pytest.approx(0.5, abs=1e-6)


def test_roots_and_gain_carry_the_coefficients_uncertainty():
    rng = np.random.default_rng(13)
    u = prbs(9, 4, 1200)
    y = with_noise(simulated(LATE, u, 0.1), 20.0, rng)
    estimate = identify_transfer_function(u, y, sample_time_s=0.1, poles=2, zeros=1)
    drawn = rng.multivariate_normal(found_coefficients(estimate), estimate.covariance, 4000)
    poles = np.array([np.roots(np.concatenate([[1.0], one[2:]])) for one in drawn])
    # 4000 draws give a standard deviation to about 1 %.
    upper = next(root for root in estimate.poles if root.value.imag > 0)
    assert upper.sd_real == pytest.approx(np.std(poles.max(axis=1).real), rel=0.06)
    assert upper.sd_imag == pytest.approx(np.std(np.abs(poles.imag[:, 0])), rel=0.06)
    assert estimate.zeros[0].sd_real == pytest.approx(np.std(-drawn[:, 1] / drawn[:, 0]), rel=0.06)
    assert estimate.static_gain.sd == pytest.approx(np.std(drawn[:, 1] / drawn[:, 3]), rel=0.06)
    assert estimate.static_gain.ci95[0] < 0.125 < estimate.static_gain.ci95[1]


def test_an_unstable_start_is_reflected_and_srivc_stays_stable():
    u = prbs(10, 7)
    y = with_noise(simulated(RAO_GARNIER, u, 0.01), 10.0, np.random.default_rng(14))
    experiments, _ = prepare(u, y, sample_time_s=0.01, time_s=None, hold="zoh")
    problem = OutputError(experiments, Structure(4, 1, "zoh", "estimate", None), delayed=False)
    start = least_squares(problem, 20.0, 0.0)
    assert np.any(np.roots([1.0, *start[2:]]).real > 0.0)
    mirrored = np.roots([1.0, *reflected(start[2:])])
    np.testing.assert_allclose(np.sort(np.abs(mirrored)), np.sort(np.abs(np.roots([1.0, *start[2:]]))), rtol=1e-9)
    assert np.all(mirrored.real < 0.0)
    estimate = identify_transfer_function(
        u, y, sample_time_s=0.01, poles=4, zeros=1, method="srivc", prefilter_rad_s=20.0
    )
    assert np.all(np.roots(estimate.denominator).real < 0.0)
    assert np.all(np.abs(found_coefficients(estimate) - coefficients(RAO_GARNIER)) < 5.0 * estimate.sd)


def test_contracts_call():
    u = prbs(10, 7)
    y = with_noise(simulated(RAO_GARNIER, u, 0.01), 10.0, np.random.default_rng(15))
    estimate = identify_transfer_function(
        u,
        y,
        sample_time_s=0.01,
        poles=4,
        zeros=1,
        method="srivc",
        intersample="zoh",
        prefilter_rad_s=20.0,
        delay_s="estimate",
    )
    assert estimate.covariance.shape == (6, 6)
    assert estimate.numerator.size == 2
    assert estimate.denominator[0] == 1.0
    assert estimate.iterations <= 10
    assert estimate.converged
    assert 0.0 <= estimate.delay_s < 4.0 * estimate.delay_sd_s
    np.testing.assert_allclose(np.sqrt(np.diag(estimate.covariance)), estimate.sd)


def test_refusals_name_what_is_missing():
    rng = np.random.default_rng(16)
    u = rng.normal(size=200)
    y = simulated(LATE, u, 0.1)
    known = {"sample_time_s": 0.1, "poles": 2, "zeros": 1}
    with pytest.raises(NotIdentifiableError, match="constant"):
        identify_transfer_function(np.ones(200), y, **known)
    with pytest.raises(NotIdentifiableError, match="output is constant"):
        identify_transfer_function(u, np.zeros(200), **known)
    with pytest.raises(NotIdentifiableError, match="samples"):
        identify_transfer_function(u[:9], y[:9], **known)
    with pytest.raises(NotIdentifiableError, match="at least as many poles"):
        identify_transfer_function(u, y, sample_time_s=0.1, poles=1, zeros=2)
    with pytest.raises(NotIdentifiableError, match="no sample"):
        identify_transfer_function(u, np.full(200, np.nan), **known)
    with pytest.raises(NotConvergedError, match="did not settle"):
        identify_transfer_function(u, y + rng.normal(size=200), max_iterations=1, prefilter_rad_s=50.0, **known)
    with pytest.raises(UsageError, match="either"):
        identify_transfer_function(u, y, poles=2, zeros=1)
    with pytest.raises(UsageError, match="method"):
        identify_transfer_function(u, y, method="newton", **known)
    with pytest.raises(InputError, match="does not rise at sample 4"):
        identify_transfer_function(u, y, time_s=[0.0, 0.1, 0.2, 0.2, *range(1, 197)], poles=2, zeros=1)


def test_unsettled_fit_says_so_where_it_is_wanted():
    rng = np.random.default_rng(17)
    u = rng.normal(size=300)
    y = simulated(LATE, u, 0.1) + rng.normal(size=300)
    estimate = identify_transfer_function(
        u, y, sample_time_s=0.1, poles=2, zeros=1, method="srivc", max_iterations=1, prefilter_rad_s=50.0, strict=False
    )
    assert not estimate.converged
    assert "did not settle" in estimate.message


def test_chain_steps_as_the_matrix_exponential_of_the_plain_companion_form():
    chain = StateVariableFilter(np.array([3.0, 2.0]))
    plain = np.array([[0, 1, 0, 0], [-2, -3, 1, 0], [0, 0, 0, 1], [0, 0, -2, -3]], dtype=float)
    expected = expm(plain * 0.3)
    ours = chain.scale[:, None] * chain.transition(0.3)[:4, :4] / chain.scale
    np.testing.assert_allclose(ours, expected, atol=1e-14)


def test_coloured_noise_is_noted():
    rng = np.random.default_rng(19)
    u = prbs(10, 3, 3000)
    y = simulated(LATE, u, 0.1)
    for noise, noted in (
        (rng.normal(size=u.size), False),
        (np.convolve(rng.normal(size=u.size), np.ones(5), "same"), True),
    ):
        estimate = identify_transfer_function(u, y + 0.1 * noise, sample_time_s=0.1, poles=2, zeros=1)
        assert any("not white" in note for note in estimate.notes) is noted


def test_the_page_s_example_runs(root, capsys):
    page = (root / "docs" / "transfer_function.md").read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0], {})
    shown = capsys.readouterr().out
    assert "trf settled" in shown
    assert shown.splitlines()[-4].startswith("4 1 BIC")
