"""`TransferFunctionEstimate`: a continuous-time transfer function with its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.identification._residual_tests import ResidualTest, whiteness
from smartshoe.identification.transfer_function._discrete import Intersample
from smartshoe.identification.transfer_function._experiment import as_signals, prepare
from smartshoe.identification.transfer_function._problem import ErrorGradient, OutputError, Structure, orthogonal_factor
from smartshoe.models.parameter import Parameter
from smartshoe.signals.noise import NORMAL_95

LEAST_P_VALUE = 1e-3  # of the whiteness test, below which a note is added
NOISE_FREE = 1e-9  # of the output's spread: a smaller residual is rounding


@dataclass(frozen=True)
class Root:
    """A pole or zero in rad/s, with standard deviations and 95 % intervals of its real and imaginary part."""

    value: complex
    sd_real: float
    sd_imag: float

    @property
    def ci95_real(self) -> tuple[float, float]:
        """95 % interval of the real part."""
        return self.value.real - NORMAL_95 * self.sd_real, self.value.real + NORMAL_95 * self.sd_real

    @property
    def ci95_imag(self) -> tuple[float, float]:
        """95 % interval of the imaginary part; both ends are 0 for a real root."""
        return self.value.imag - NORMAL_95 * self.sd_imag, self.value.imag + NORMAL_95 * self.sd_imag


@dataclass(frozen=True, eq=False)
class TransferFunctionEstimate:
    """y = numerator/denominator exp(-delay_s s) u + offset + the initial state's free response, in seconds.

    ``numerator`` (zeros + 1,) and ``denominator`` (poles + 1,) hold the highest power first; the denominator's first is
    1. ``covariance`` is that of the numerator's coefficients followed by the denominator's without the leading 1,
    ``sd`` the root of its diagonal. It holds at the optimum of the output error under white noise, with delay, offsets
    and initial states unknown where they were estimated. By experiment: ``offsets``; ``initial_states`` (experiments,
    poles) in observer form (the free response is their polynomial, highest power first, over the denominator, from the
    experiment's start, or with an estimated delay from the first counted sample); and ``residual`` (measured minus
    model, NaN where a sample was not counted). ``rmse`` is in y's unit; ``fit_percent`` is ``100 (1 - |residual| / |y -
    mean|)``. ``whiteness`` tests the assumption behind the error bars. ``iterations`` are those of ``method``,
    ``start_iterations`` those of SRIVC before it.
    """

    numerator: Array
    denominator: Array
    covariance: Array
    sd: Array
    delay_s: float
    delay_sd_s: float
    offsets: Array
    offsets_sd: Array
    initial_states: Array
    initial_states_sd: Array
    fit_percent: float
    rmse: float
    noise_sd: float
    poles: tuple[Root, ...]
    zeros: tuple[Root, ...]
    static_gain: Parameter
    residual: tuple[Array, ...] = field(repr=False)
    whiteness: ResidualTest
    method: str
    intersample: Intersample
    sample_time_s: float
    iterations: int
    start_iterations: int
    converged: bool
    message: str
    n_samples: int
    n_missing: int
    notes: tuple[str, ...] = ()

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Each coefficient with its error bar, named b or a with its power of s, and the delay."""
        m, n = self.numerator.size - 1, self.denominator.size - 1
        names = [f"b{power}" for power in range(m, -1, -1)] + [f"a{power}" for power in range(n - 1, -1, -1)]
        values = np.concatenate([self.numerator, self.denominator[1:]])
        found = {name: Parameter.from_sd(value, sd, "") for name, value, sd in zip(names, values, self.sd, strict=True)}
        found["delay"] = Parameter.from_sd(self.delay_s, self.delay_sd_s, "s")
        return found

    @property
    def correlation(self) -> Array:
        """The correlations that correspond to ``covariance``."""
        safe = np.where(self.sd > 0.0, self.sd, 1.0)
        matrix: Array = self.covariance / np.outer(safe, safe)
        return matrix

    def simulate(
        self,
        u: Any,
        *,
        sample_time_s: float | None = None,
        time_s: Any = None,
        initial_state: Literal["rest", "steady"] = "rest",
        offset: float = 0.0,
    ) -> Array:
        """y (n,) for the input ``u`` (n,), by default at the fit's sample time; exact between samples.

        ``initial_state``: "rest" assumes an input of 0 before, "steady" that its first value had lasted forever.
        """
        if sample_time_s is None and time_s is None:
            sample_time_s = self.sample_time_s
        signal = as_signals(u, "u")[0]
        if not np.isfinite(signal).all():
            raise UsageError("u holds missing samples: fill them before a simulation")
        problem = OutputError(
            [
                prepare(
                    signal, signal, sample_time_s=sample_time_s, time_s=time_s, hold=self.intersample, strict=False
                )[0][0]
            ],
            Structure(self.denominator.size - 1, self.numerator.size - 1, self.intersample, initial_state, 0.0),
            delayed=False,
            delay_s=self.delay_s,
        )
        return problem.output(np.concatenate([self.numerator, self.denominator[1:]]), 0) + offset


@dataclass(frozen=True)
class Ending:
    """How a fit ended: its method, iterations, those of SRIVC before it, whether it converged, and a sentence."""

    method: str
    iterations: int
    start_iterations: int
    converged: bool
    message: str


def summarise(
    problem: OutputError,
    theta: Array,
    looks: Sequence[ErrorGradient],
    *,
    ended: Ending,
    n_missing: int,
    notes: Sequence[str],
) -> TransferFunctionEstimate:
    """The estimate at ``theta``; ``looks`` are the errors and gradients there, one per experiment.

    Raises `FloatingPointError` on a gradient from which the parameters cannot be distinguished.
    """
    from scipy.linalg import solve_triangular

    m, n = problem.zeros + 1, problem.poles
    numerator, tail, delay_s = problem.split(theta)
    triangle = orthogonal_factor(np.vstack([look.columns for look in looks]))
    inverse = solve_triangular(triangle, np.eye(theta.size))
    cost = sum(float(look.error @ look.error) for look in looks)
    nuisances = sum(look.nuisance.basis.shape[1] for look in looks)
    variance = cost / max(problem.count - theta.size - nuisances, 1)
    root = np.sqrt(variance) * inverse  # the covariance is root @ root.T
    shared = root[: m + n]
    covariance = shared @ shared.T
    sd = np.sqrt(np.einsum("ij,ij->i", shared, shared))
    delay_sd_s = float(np.linalg.norm(root[-1])) if problem.delayed else 0.0
    offsets, offsets_sd, starts, starts_sd = _nuisances(problem, tail, looks, root, variance)
    denominator = np.concatenate([[1.0], tail])
    residual, spread = [], 0.0
    for experiment, first, look in zip(problem.experiments, problem.firsts, looks, strict=True):
        counted = experiment.counted.copy()
        counted[:first] = False
        one = np.full(counted.size, np.nan)
        one[first:] = look.error
        one[~counted] = np.nan
        residual.append(one)
        spread += float(np.sum((experiment.y[counted] - np.mean(experiment.y[counted])) ** 2))
    masks = [np.isfinite(one) for one in residual]
    white = whiteness(residual, masks)
    if white.p_value < LEAST_P_VALUE and cost > NOISE_FREE**2 * spread:
        notes = [*notes, f"the residual is not white (p = {white.p_value:.1g}): the error bars take it for white noise"]
    if (np.roots(denominator).real > 0.0).any():
        notes = [*notes, "the model is unstable: the data ask for a pole in the right half plane"]
    static = numerator[-1] / tail[-1] if tail[-1] != 0.0 else np.inf
    slope = np.zeros(m + n)
    if np.isfinite(static):
        slope[m - 1], slope[-1] = 1.0 / tail[-1], -static / tail[-1]
    return TransferFunctionEstimate(
        numerator=numerator.copy(),
        denominator=denominator,
        covariance=covariance,
        sd=sd,
        delay_s=delay_s,
        delay_sd_s=delay_sd_s,
        offsets=offsets,
        offsets_sd=offsets_sd,
        initial_states=starts,
        initial_states_sd=starts_sd,
        fit_percent=100.0 * (1.0 - float(np.sqrt(cost / spread))) if spread > 0.0 else 0.0,
        rmse=float(np.sqrt(cost / problem.count)),
        noise_sd=float(np.sqrt(variance)),
        poles=_roots(denominator, shared[m:]),
        zeros=_roots(numerator, shared[:m]),
        static_gain=Parameter.from_sd(static, float(np.linalg.norm(slope @ shared)), ""),
        residual=tuple(residual),
        whiteness=white,
        method=ended.method,
        intersample=problem.hold,
        sample_time_s=problem.experiments[0].typical_step_s,
        iterations=ended.iterations,
        start_iterations=ended.start_iterations,
        converged=ended.converged,
        message=ended.message,
        n_samples=problem.count,
        n_missing=n_missing,
        notes=tuple(notes),
    )


def _nuisances(
    problem: OutputError, tail: Array, looks: Sequence[ErrorGradient], root: Array, variance: float
) -> tuple[Array, Array, Array, Array]:
    """Offsets (e,), initial states (e, n), and their standard deviations including the shared parameters' part."""
    from smartshoe.identification.transfer_function._discrete import StateVariableFilter

    n = problem.poles
    offsets = np.full(len(looks), problem.offset or 0.0)
    offsets_sd, starts = np.zeros(len(looks)), np.zeros((len(looks), n))
    starts_sd = np.zeros_like(starts)
    scale = StateVariableFilter(tail).scale[-n:]
    for index, look in enumerate(looks):
        back = look.nuisance.back
        own = np.sum(back**2, axis=1) * variance
        through = back @ look.leaning @ root
        sd = np.sqrt(own + np.sum(through**2, axis=1)) if back.size else np.zeros(0)
        if problem.offset is None:
            offsets[index], offsets_sd[index] = look.coefficients[-1], sd[-1]
        if problem.initial_state == "estimate":
            starts[index], starts_sd[index] = (look.coefficients[:n] / scale)[::-1], (sd[:n] / scale)[::-1]
    return offsets, offsets_sd, starts, starts_sd


def _roots(polynomial: Array, root: Array) -> tuple[Root, ...]:
    """Roots with their standard deviations to first order: d r / d c_k = -r^k / p'(r).

    ``root`` is a square root of the covariance of the polynomial's last coefficients; sds are infinite at a double
    root.
    """
    degree = polynomial.size - 1
    powers = np.arange(root.shape[0])[::-1]
    slope = np.polyder(polynomial)
    found = []
    for value in sorted(np.roots(polynomial), key=lambda one: (abs(one), one.imag)):
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            lean = -(np.complex128(value) ** powers) / np.polyval(slope, np.complex128(value))
            sd_real, sd_imag = (float(np.linalg.norm(part @ root)) for part in (lean.real, lean.imag))
        found.append(Root(complex(value), sd_real, sd_imag if value.imag else 0.0))
    return tuple(found[:degree])
