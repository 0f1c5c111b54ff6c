"""The benchmark cases as data generators: the plants are solved with SciPy, never with the code under test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.signal import lfilter, lsim, max_len_seq

from smartshoe.protocol import dynamic_protocol

Array = NDArray[np.float64]

# -- the shoe: Chinimilli 2016, equation (13), with the values of the issue ------------------------------------------
K1, K2, C, X = 1.341, 0.215, 1.0, 0.38113
RATES_N_PER_S = (50.0, 100.0, 200.0, 400.0, 600.0, 800.0)
SAMPLE_TIME_S = 0.01
LOAD_NOISE_N = 2.23
TRUE = np.array([K2 / C, C + (K1 + K2) * X, K2 / C * (C + K1 * X)])  # a1, b0, b1


@dataclass(frozen=True, eq=False)
class Shoe:
    """Noise-free signals (n,): the load in N and the reading in the paper's force units."""

    time_s: Array
    load_n: Array
    reading: Array

    @property
    def full_scale(self) -> float:
        """Span of the reading."""
        return float(np.ptp(self.reading))


def first_order(num: Sequence[float], den: Sequence[float], u: Array, step_s: float, x0: Array | None = None) -> Array:
    """Exact response to ``u``, straight between samples."""
    time_s = np.arange(u.size) * step_s
    direct = num[0]
    system = ([[-den[1]]], [[1.0]], [[num[1] - direct * den[1]]], [[direct]])
    return np.asarray(lsim(system, u, time_s, X0=x0, interp=True)[1], dtype=float)


def plant(load_n: Array, step_s: float, state: float = 0.0) -> Array:
    """The reading to a load: (s + a1)/(b0 s + b1), at rest before unless ``state`` says otherwise."""
    a1, b0, b1 = TRUE
    return first_order([1 / b0, a1 / b0], [1.0, b1 / b0], load_n, step_s, np.array([state]))


@cache
def shoe() -> Shoe:
    """Three triangles to 800 N at each of the six rates, 100 Hz: 19,401 samples."""
    protocol = dynamic_protocol(RATES_N_PER_S, repeats=3, rest_s=0.0)
    time_s = np.arange(0.0, protocol.duration_s, SAMPLE_TIME_S)
    load_n = protocol.load_at(time_s)
    return Shoe(time_s, load_n, plant(load_n, SAMPLE_TIME_S))


def shoe_in_mid_ramp(*, skew_s: float, from_sample: int) -> Shoe:
    """The same, the reading ``skew_s`` late, from ``from_sample`` on, which lies within a ramp.

    Solved at a tenth of the sample time, so that a skew of tenths of a sample falls on a sample.
    """
    finer = 10
    late = round(skew_s / SAMPLE_TIME_S * finer)
    protocol = dynamic_protocol(RATES_N_PER_S, repeats=3, rest_s=0.0)
    count = int(protocol.duration_s / SAMPLE_TIME_S) + 1
    fine_s = np.arange(count * finer) * SAMPLE_TIME_S / finer
    reading = plant(protocol.load_at(fine_s), SAMPLE_TIME_S / finer)
    at = np.arange(from_sample, count) * finer
    return Shoe(fine_s[at] - fine_s[at[0]], protocol.load_at(fine_s[at]), reading[at - late])


def hold_filter(a1: float, b0: float, b1: float, step_s: float = SAMPLE_TIME_S) -> tuple[list[float], list[float]]:
    """Numerator and denominator in z of (b0 s + b1)/(s + a1) between straight lines: what a user would write."""
    x = a1 * step_s
    decay = np.exp(-x)
    now = 1.0 + np.expm1(-x) / x
    before = -np.expm1(-x) - now
    slow = b1 / a1 - b0
    return [b0 + slow * now, slow * before - b0 * decay], [1.0, -decay]


def filter_residual(theta: Array, u: Array, y: Array) -> Array:
    """Model minus measured of the three coefficients."""
    return np.asarray(lfilter(*hold_filter(*theta), u) - y)


def cramer_rao_sd() -> tuple[Array, Array]:
    """Least standard deviations of (a1, b0, b1) and of (k1, k2) with c and X known, by difference quotients."""
    u = shoe().reading

    def response(theta: Array) -> Array:
        return filter_residual(theta, u, np.zeros_like(u))

    def bound(jacobian: Array) -> Array:
        return LOAD_NOISE_N * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))

    free = quotient(response, TRUE)
    return bound(free), bound(free @ quotient(grey, np.array([K1, K2])))


def grey(k: Array) -> Array:
    """(a1, b0, b1) of (k1, k2), c = 1."""
    return np.array([k[1], 1 + (k[0] + k[1]) * X, k[1] * (1 + k[0] * X)])


def quotient(function, theta: Array, relative: float = 1e-5) -> Array:
    """Central difference quotients (m, size)."""
    columns = []
    for index, value in enumerate(theta):
        nudge = np.zeros(theta.size)
        nudge[index] = relative * abs(value)
        columns.append((function(theta + nudge) - function(theta - nudge)) / (2 * nudge[index]))
    return np.stack(columns, axis=1)


# -- any order -------------------------------------------------------------------------------------------------------
@dataclass(frozen=True, eq=False)
class Linear:
    """A transfer function, its input, and its noise-free output."""

    name: str
    numerator: Array
    denominator: Array
    u: Array
    clean: Array
    sample_time_s: float
    delay_s: float = 0.0

    @property
    def coefficients(self) -> Array:
        """Numerator, then denominator without the leading 1."""
        return np.concatenate([self.numerator, self.denominator[1:]])

    @property
    def order(self) -> dict[str, int]:
        return {"poles": self.denominator.size - 1, "zeros": self.numerator.size - 1}

    def noisy(self, ratio: float, rng: np.random.Generator) -> Array:
        """With white noise of ``ratio`` times the output's standard deviation."""
        return self.clean + ratio * float(np.std(self.clean)) * rng.standard_normal(self.clean.size)


def held(numerator: Array, denominator: Array, u: Array, step_s: float, late: int = 0) -> Array:
    """Exact response, at rest before, to ``u`` held between samples and ``late`` samples of delay."""
    n = denominator.size - 1
    padded = np.concatenate([np.zeros(n + 1 - numerator.size), numerator])
    A = np.zeros((n, n))
    A[0], A[1:, :-1] = -denominator[1:], np.eye(n - 1)
    system = (A, np.eye(n)[:, :1], (padded[1:] - padded[0] * denominator[1:])[None, :], np.array([[padded[0]]]))
    y = np.asarray(lsim(system, u, np.arange(u.size) * step_s, interp=False)[1], dtype=float)
    return np.concatenate([np.zeros(late), y[: y.size - late]]) if late else y


def prbs(bits: int, hold: int, count: int | None = None) -> Array:
    """A pseudo-random binary sequence of +-1."""
    u = np.repeat(2.0 * max_len_seq(bits)[0] - 1.0, hold)
    return u if count is None else np.resize(u, count)


def rao_garnier() -> Linear:
    """Rao and Garnier 2002: resonances at 2 and 20 rad/s, a zero in the right half plane, PRBS of 10 bits held 7."""
    num, den, u = np.array([-6400.0, 1600.0]), np.array([1.0, 5.0, 408.0, 416.0, 1600.0]), prbs(10, 7)
    return Linear("Rao-Garnier", num, den, u, held(num, den, u, 0.01), 0.01)


def late() -> Linear:
    """8 s of delay, 80 samples."""
    num, den, u = np.array([-4.0, 0.5]), np.array([1.0, 1.0, 4.0]), prbs(10, 5, 3000)
    return Linear("8 s delay", num, den, u, held(num, den, u, 0.1, 80), 0.1, 8.0)


def second_order(numerator: Sequence[float]) -> Linear:
    """numerator/(s^2 + 20 s + 1000), 1 ms, 20,000 samples."""
    num, den, u = np.array(numerator), np.array([1.0, 20.0, 1000.0]), prbs(12, 10, 20_000)
    label = " s + ".join(f"{value:g}" for value in numerator)
    return Linear(f"({label})/(s^2 + 20 s + 1000)", num, den, u, held(num, den, u, 1e-3), 1e-3)


def coupled_inertias(*, collocated: bool) -> Linear:
    """Torque through a drive of second order to three discs on two shafts, held by a spring; angle of disc 1 or 3."""
    stiffness = 100.0 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    discs = np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness, -0.5 * np.eye(3)]])
    A = block_diag(discs, np.array([[0.0, 1.0], [-400.0, -12.0]]))
    A[3, 6] = 1.0
    B, C_ = np.zeros((8, 1)), np.zeros((1, 8))
    B[7, 0], C_[0, 0 if collocated else 2] = 400.0, 1.0
    den = np.real(np.poly(A))
    markov = [(C_ @ np.linalg.matrix_power(A, k) @ B).item() for k in range(8)]
    num = np.convolve(den, markov)[:8][3 if collocated else 7 :]
    u = np.random.default_rng(6).choice([-1.0, 1.0], 20_000)
    y = np.asarray(lsim((A, B, C_, np.zeros((1, 1))), u, 0.02 * np.arange(u.size), interp=False)[1], dtype=float)
    return Linear(f"coupled inertias, disc {1 if collocated else 3}", num, den, u, y, 0.02)


def cramer_rao_linear(case: Linear, noise_sd: float) -> Array:
    """Least standard deviations of ``case.coefficients``, delay, offset and rest at the start being known."""
    zeros = case.numerator.size
    late = round(case.delay_s / case.sample_time_s)

    def response(theta: Array) -> Array:
        return held(theta[:zeros], np.concatenate([[1.0], theta[zeros:]]), case.u, case.sample_time_s, late)

    jacobian = quotient(response, case.coefficients)
    return noise_sd * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
