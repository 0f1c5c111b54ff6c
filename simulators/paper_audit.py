"""Recomputes the paper's numbers: ``python -m simulators.paper_audit`` prints every figure of docs/paper_audit.md."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.signal import lfilter

from simulators.paper import AMBIENT_PA, DIAMETER_M, GAS_CONSTANT, MOLES, PEAK_N, TABLE_1, TABLE_2, TEMPERATURE_K
from smartshoe.arrays import Array
from smartshoe.kernels.blas import on_one_thread

RATE_HZ = 100.0
TRIANGLE_RMS = PEAK_N / math.sqrt(3.0)  # of a triangle 0-800-0 about zero
TRIANGLE_SD = PEAK_N / math.sqrt(12.0)  # about its mean: what MATLAB's fit % divides by


def x_over_nrt() -> float:
    """x0^2/(nRT) in m/N (below eq. 4)."""
    return DIAMETER_M**2 / (MOLES * GAS_CONSTANT * TEMPERATURE_K)


def air_volume_m3() -> float:
    """nRT/Patm in m³: the air volume that corresponds to the printed n."""
    return MOLES * GAS_CONSTANT * TEMPERATURE_K / AMBIENT_PA


@dataclass(frozen=True)
class Filter:
    """The discrete filter (n0 z + n1)/(z + d1) at 100 Hz."""

    n0: float
    n1: float
    d1: float

    @property
    def static_gain(self) -> float:
        """The gain at z = 1."""
        return (self.n0 + self.n1) / (1.0 + self.d1)

    @property
    def high_gain(self) -> float:
        """The gain at z = -1, half the sampling rate."""
        return (self.n0 - self.n1) / (1.0 - self.d1)

    def lead_deg(self, frequency_hz: float) -> float:
        """Phase lead in degrees at ``frequency_hz``."""
        z = np.exp(2j * np.pi * frequency_hz / RATE_HZ)
        return float(np.degrees(np.angle((self.n0 * z + self.n1) / (z + self.d1))))

    def run(self, u: Array) -> Array:
        """The filter's output (n,) for the input ``u`` (n,), starting from rest."""
        return np.asarray(lfilter([self.n0, self.n1], [1.0, self.d1], u), dtype=float)


def from_stiffness(k1: float, k2: float, c: float = 1.0) -> Filter:
    """The filter of given stiffnesses: eqs. (2)-(4) through the bilinear transform at 100 Hz."""
    x, t = x_over_nrt(), 2.0 * RATE_HZ
    b1, b2, a1, a2 = k2 * (1 + k1 * x), c * (1 + (k1 + k2) * x), k2, c
    scale = a2 * t + a1
    return Filter((b2 * t + b1) / scale, (b1 - b2 * t) / scale, (a1 - a2 * t) / scale)


def printed(unit: str) -> Filter:
    """The filter of a unit that Table 1 prints."""
    return Filter(*TABLE_1[unit][2:])


def static_gain_interval(unit: str) -> tuple[float, float]:
    """The range of the static gain that the printed digits allow (half a unit of each last digit)."""
    _, _, n0, n1, d1 = TABLE_1[unit]
    numerator, denominator = n0 + n1, 1.0 + d1
    return (numerator - 1e-3) / (denominator + 5e-5), (numerator + 1e-3) / (denominator - 5e-5)


def x_needed(unit: str) -> float:
    """The x0^2/(nRT) for which the high-frequency gain of k1, k2 would equal the printed one."""
    k1, k2, *_ = TABLE_1[unit]
    wanted = printed(unit).high_gain
    # At z = -1 the bilinear transform gives s = infinity: the gain is 1 + (k1 + k2) X.
    return (wanted - 1.0) / (k1 + k2)


def rounding_loss_n() -> float:
    """Largest error in N of the left toe at a held 800 N, caused by rounding its z-coefficients to four decimals."""
    exact = from_stiffness(*TABLE_1["left_toe"][:2])
    rounded = Filter(*(round(value, 4) for value in (exact.n0, exact.n1, exact.d1)))
    hold = np.full(int(60 * RATE_HZ), PEAK_N / exact.static_gain)
    return float(np.max(np.abs(exact.run(hold) - rounded.run(hold))))


def improvement(unit: str) -> list[tuple[float, float]]:
    """Table 2's P% as printed, and as it follows from the two RMSEs."""
    return [(said, 100.0 * (raw - filtered) / raw) for _, raw, filtered, said in TABLE_2[unit]]


def under_gain(unit: str) -> list[float]:
    """The gain g that explains RMSE(r): with u = gamma x and r = g u, RMSE(r)/RMSE(u) = |1 - g gamma|/(1 - gamma)."""
    found = []
    for _, raw, filtered, _ in TABLE_2[unit]:
        gamma = 1.0 - raw / TRIANGLE_RMS
        found.append((1.0 - filtered / TRIANGLE_RMS) / gamma)
    return found


@cache
@on_one_thread
def least_filtered_rmse(unit: str) -> tuple[float, ...]:
    """The smallest RMSE(r) in N that the printed filter can give for *any* raw signal with Table 2's RMSE(u).

    A least-squares problem with one quadratic constraint: minimise |x - H u|^2 subject to |x - u| = RMSE(u) sqrt(N), by
    its multiplier: (H'H + m) u = H'x + m x; one triangle at each rate.
    """
    found = []
    filter_ = printed(unit)
    for rate, raw, _, _ in TABLE_2[unit]:
        rise = np.arange(0.0, 2.0 * PEAK_N / rate, 1.0 / RATE_HZ)
        x = PEAK_N - np.abs(rise * rate - PEAK_N)
        # Triangles of 16 s have 1,600 samples: the filter as a matrix stays small.
        response = filter_.run(np.eye(1, x.size)[0])
        matrix = np.zeros((x.size, x.size))
        for row in range(x.size):
            matrix[row, : row + 1] = response[row::-1]
        values, vectors = np.linalg.eigh(matrix.T @ matrix)
        # With e = u - x: minimise |a + H e|^2, a = H x - x.
        push = vectors.T @ (matrix.T @ (matrix @ x - x))
        wanted = raw * math.sqrt(x.size)

        def length(multiplier: float, push: Array = push, values: Array = values, wanted: float = wanted) -> float:
            return float(np.linalg.norm(push / (values + multiplier))) - wanted

        low = -values[0] * (1 - 1e-9)
        high = 1.0
        while length(high) > 0:
            high *= 4.0
        multiplier = brentq(length, low, high) if length(low) > 0 else low
        e = -vectors @ (push / (values + multiplier))
        found.append(float(np.linalg.norm(matrix @ (x + e) - x) / math.sqrt(x.size)))
    return tuple(found)


def report() -> list[str]:
    """Every figure, one line each."""
    x, bore = x_over_nrt(), math.pi * DIAMETER_M**2 / 4
    lines = [
        f"X = x0^2/(nRT) = {x:.5f} m/N",
        f"air of n moles: {air_volume_m3() * 1e9:.4f} mm^3, {air_volume_m3() / bore * 1e6:.0f} um of a 2 mm tube;"
        f" half a metre of tube holds {0.5 * bore / air_volume_m3():.0f} times more",
        f"800 N on 40 cm^2: {PEAK_N / 40e-4 / 1e5:.2f} bar",
        f"effective area that brings 800 N to 200 mbar, f = (1 + k1 X) P:"
        f" {PEAK_N / (2e4 * (1 + TABLE_1['right_heel'][0] * x)) * 1e4:.0f} cm^2 (right heel)",
        f"the same for 100 mbar: {PEAK_N / (1e4 * (1 + TABLE_1['right_toe'][0] * x)) * 1e4:.0f} cm^2 (right toe)",
        f"sealed air warmed by 8 K at 300 K: {AMBIENT_PA * 8 / 300 / 100:.1f} mbar",
        f"rounding the left toe's z-coefficients to four decimals: {rounding_loss_n():.0f} N at 800 N",
        f"fit 90.23 % of a triangle 0-800-0: {(1 - 0.9023) * TRIANGLE_SD:.1f} N",
        f"618 -> 535.2 N: a gain of {535.2 / 618:.3f}",
        f"6 mph = {6 * 1609.344 / 3600:.2f} m/s",
    ]
    for unit, (k1, k2, *_) in TABLE_1.items():
        follows, said = from_stiffness(k1, k2), printed(unit)
        low, high = static_gain_interval(unit)
        lines += [
            f"{unit}: from k1, k2: ({follows.n0:.4f} z {follows.n1:+.4f})/(z {follows.d1:+.5f}),"
            f" gain {follows.static_gain:.3f} static, {follows.high_gain:.3f} high;"
            f" printed pole {-said.d1:.4f}, high gain {said.high_gain:.4f}, static {low:.2f} to {high:.2f}",
            f"{unit}: X that the printed high gain would need: {x_needed(unit):.3f};"
            f" lead at 1 Hz {said.lead_deg(1.0):.2f} deg",
            f"{unit}: P% " + ", ".join(f"{a:g} ({b:.2f})" for a, b in improvement(unit)),
            f"{unit}: under-gain " + ", ".join(f"{g:.2f}" for g in under_gain(unit)),
            f"{unit}: least RMSE(r) of the printed filter "
            + ", ".join(f"{v:.0f}" for v in least_filtered_rmse(unit))
            + " N; printed "
            + ", ".join(f"{row[2]:.0f}" for row in TABLE_2[unit]),
        ]
    return lines


if __name__ == "__main__":
    print("\n".join(report()))
