"""The unit and the load on it as a state-space model, which the Kalman filters share.

The state is (load F in N, its rate in N/s, the solid's slow strain w in N). The reading follows from Chinimilli 2016
(13), inverted: reading = offset + F/b0 + (a1/b1 - 1/b0) w with w' = (b1/b0) (F - w). The load's rate is integrated
white noise of spectral density q in N²/s³ (a "nearly constant rate", Bar-Shalom, Li and Kirubarajan 2001, section
6.2.2); nothing is assumed about feet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import InputError

if TYPE_CHECKING:
    from smartshoe.calibration._calibration import Calibration


LOAD, RATE, STRAIN = 0, 1, 2
LEAST_DENSITY, MOST_DENSITY = 1e2, 1e11  # N²/s³: a slow sway, and a load that jumps by 10 kN within 5 ms


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = F x + noise of covariance Q per step; reading - offset = H x + noise of variance R."""

    transition: Array
    process: Array
    output: Array
    noise: float


def contact_model(calibration: Calibration, sample_rate_hz: float, density: float, noise_sd: float) -> StateSpace:
    """A load whose rate is a random walk of ``density`` in N²/s³; ``noise_sd`` is in the reading's unit."""
    flow = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return _discretised(calibration, sample_rate_hz, flow, np.array([[0.0], [np.sqrt(density)], [0.0]]), noise_sd)


def swing_model(
    calibration: Calibration, sample_rate_hz: float, residual_n: float, time_s: float, noise_sd: float
) -> StateSpace:
    """A load that decays to zero within ``time_s`` and then has a standard deviation of ``residual_n``."""
    flow = np.array([[-1.0 / time_s, 0.0, 0.0], [0.0, -1.0 / time_s, 0.0], [0.0, 0.0, 0.0]])
    drive = np.sqrt(2.0 / time_s) * residual_n
    return _discretised(calibration, sample_rate_hz, flow, np.array([[drive], [0.0], [0.0]]), noise_sd)


def _discretised(
    calibration: Calibration, sample_rate_hz: float, flow: Array, drive: Array, noise_sd: float
) -> StateSpace:
    from filterpy.common import van_loan_discretization

    c = calibration
    if not (c.b0 > 0.0 and c.b1 > 0.0):
        raise InputError(
            f"calibration of {c.unit or 'a unit'}: b0 and b1 must be above 0 for a Kalman filter: identify it anew"
        )
    speed = c.b1 / c.b0
    flow = flow.copy()
    flow[STRAIN, LOAD], flow[STRAIN, STRAIN] = speed, -speed
    transition, process = van_loan_discretization(flow, drive, 1.0 / sample_rate_hz)
    output = np.array([[1.0 / c.b0, 0.0, c.a1 / c.b1 - 1.0 / c.b0]])
    return StateSpace(np.asarray(transition), np.asarray(process), output, noise_sd**2)


def likely_density(calibration: Calibration, sample_rate_hz: float, readings: Array, noise_sd: float) -> float:
    """The spectral density in N²/s³ under which ``readings`` (n,) less their offset are most likely.

    Each density has a steady-state filter, whose innovations give the likelihood; maximised on a grid of decades, then
    by Brent's method.
    """
    from scipy.optimize import minimize_scalar

    def cost(log_density: float) -> float:
        model = contact_model(calibration, sample_rate_hz, 10.0**log_density, noise_sd)
        innovation, variance = _steady_innovations(model, readings)
        return float(np.log(variance) + np.mean(innovation**2) / variance)

    grid = np.arange(np.log10(LEAST_DENSITY), np.log10(MOST_DENSITY) + 0.5)
    costs = [cost(value) for value in grid]
    best = int(np.argmin(costs))
    found = minimize_scalar(
        cost,
        bounds=(grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]),
        method="bounded",
        options={"xatol": 0.02},
    )
    return float(10.0**found.x)


def _steady_innovations(model: StateSpace, readings: Array) -> tuple[Array, float]:
    """Innovations (n,) of the steady-state filter and their variance, by one recursive filter of third order."""
    from scipy.linalg import solve_discrete_are
    from scipy.signal import lfilter, ss2tf

    F, H = model.transition, model.output
    prior = solve_discrete_are(F.T, H.T, model.process, np.array([[model.noise]]))
    variance = float((H @ prior @ H.T)[0, 0] + model.noise)
    gain = F @ prior @ H.T / variance
    # x_(k+1) = (F - K H) x_k + K y_k; e_k = y_k - H x_k
    numerator, denominator = ss2tf(F - gain @ H, gain, -H, np.array([[1.0]]))
    innovation = lfilter(numerator[0], denominator, readings - readings[0])
    return np.asarray(innovation), variance
