"""Transfer functions of any order: the cases of the literature, noise-free and at the bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cases
import numpy as np
import pytest
from monte_carlo import over_cores
from scipy.optimize import least_squares
from scipy.signal import lfilter

from smartshoe.identification.transfer_function import identify_transfer_function

pytestmark = pytest.mark.benchmark
METHODS = ("srivc", "gn", "lm", "trf")


def fitted(case: cases.Linear, ratio: float, seed: int, **options: Any) -> Any:
    y = case.noisy(ratio, np.random.default_rng(seed)) if ratio else case.clean
    return identify_transfer_function(
        case.u, y, sample_time_s=case.sample_time_s, strict=False, **case.order, **options
    )


def found_coefficients(estimate: Any) -> np.ndarray:
    return np.concatenate([estimate.numerator, estimate.denominator[1:]])


def transfer_functions(
    case: cases.Linear, seeds: Sequence[int], ratio: float, options: Mapping[str, Any]
) -> np.ndarray:
    """(runs, 4 + coefficients) iterations (SRIVC's before another method too), converged, rmse, delay, coefficients."""
    found = []
    for seed in seeds:
        one = fitted(case, ratio, seed, **options)
        steps = one.iterations + (one.start_iterations if one.method != "srivc" else 0)
        row = [steps, one.converged, one.rmse, one.delay_s, *found_coefficients(one)]
        found.append(row)
    return np.array(found, dtype=float)


def scipy_rmse(case: cases.Linear, seeds: Sequence[int], ratio: float) -> np.ndarray:
    """(runs,) where a user's own output-error fit ends: discrete ARX by least squares, then least_squares."""
    n, late = case.denominator.size - 1, round(case.delay_s / case.sample_time_s)
    u = np.concatenate([np.zeros(late), case.u[: case.u.size - late]])
    found = []
    for seed in seeds:
        y = case.noisy(ratio, np.random.default_rng(seed))
        columns = [-y[n - k : y.size - k] for k in range(1, n + 1)] + [u[n - k : u.size - k] for k in range(1, n + 1)]
        start = np.linalg.lstsq(np.stack(columns, axis=1), y[n:], rcond=None)[0]

        def residual(theta: np.ndarray, y: np.ndarray = y) -> np.ndarray:
            with np.errstate(over="ignore", invalid="ignore"):
                error = lfilter(np.r_[0.0, theta[n:]], np.r_[1.0, theta[:n]], u) - y
            return np.clip(np.nan_to_num(error, nan=1e6), -1e6, 1e6)

        found.append(np.sqrt(np.mean(residual(least_squares(residual, start, x_scale="jac").x) ** 2)))
    return np.array(found)


def test_rao_garnier(table):
    case, runs, noise = cases.rao_garnier(), 400, 10 ** (-10 / 20)
    bound = cases.cramer_rao_linear(case, noise * float(np.std(case.clean)))
    label = f"Rao-Garnier, 10 dB, {runs} runs (peer: scipy from ARX)"
    least, short = [], []
    for method in ("srivc", "trf"):
        for prefilter in (5.0, 20.0):
            options = {"method": method, "prefilter_rad_s": prefilter}
            found = over_cores(transfer_functions, case, runs, noise, options)
            least.append(found[:, 2])
            spread = found[:, 4:].std(axis=0, ddof=1)
            sd, off = spread / bound, (found[:, 4:].mean(axis=0) - case.coefficients) / spread * np.sqrt(runs)
            from_lambda = f"{method}, lambda {prefilter:g}"
            converged, most = bool(found[:, 1].all()), int(found[:, 0].max())
            rows = (
                ("converged", "always", f"{found[:, 1].mean() * 100:.1f} %", converged),
                ("iterations, most", "10", f"{most}", most <= 10),
                (
                    "bias over its Monte Carlo error, largest of six",
                    "",
                    f"{np.abs(off).max():.1f}",
                    None,
                ),
                (
                    "sd over the bound", "at the bound", f"{sd.min():.3f}-{sd.max():.3f} ± {1 / np.sqrt(2 * runs):.3f}",
                    bool(sd.max() < 1 + 3 / np.sqrt(2 * runs)),
                ),
            )  # fmt: skip
            for figure, asked, reached, met in rows:
                table.add(label, f"{from_lambda}: {figure}", reached, asked=asked, met=met)
                short += [f"{from_lambda}: {figure} {reached}"] if met is False else []
    ends = np.array(
        [[fitted(case, noise, seed, method=m, prefilter_rad_s=20.0).rmse for m in METHODS] for seed in range(20)]
    )
    apart = float((np.ptp(ends, axis=1) / ends.min(axis=1)).max())
    table.add(label, "srivc, gn, lm, trf: rmse apart", f"{apart:.1e}", asked="one optimum", met=apart < 1e-6)
    best = np.min(least, axis=0)
    peer = over_cores(scipy_rmse, case, 40, noise) / best[:40]
    table.add(
        label,
        "ends within 0.1 % of the least rmse",
        f"{(np.stack(least) < 1.001 * best).mean() * 100:.1f} %",
        peer=f"{(peer < 1.001).mean() * 100:.0f} % of 40 (worst {peer.max():.2f} times)",
    )
    assert not short, "; ".join(short)


def test_eight_seconds_of_delay(table):
    case, runs, noise = cases.late(), 60, 10 ** (-15 / 20)
    bound = cases.cramer_rao_linear(case, noise * float(np.std(case.clean)))
    options = {"method": "trf", "delay_s": "estimate"}
    found = over_cores(transfer_functions, case, runs, noise, options)
    label = f"(-4 s + 0.5)/(s^2 + s + 4), 8 s delay, 15 dB, {runs} runs (peer: scipy, delay known)"
    delay = found[:, 3] - case.delay_s
    apart = found[:, 4:] / case.coefficients - 1
    converged = bool(found[:, 1].all())
    table.add(label, "converged", f"{found[:, 1].mean() * 100:.0f} %", asked="always", met=converged)
    table.add(label, "iterations, most", f"{int(found[:, 0].max())}")
    table.add(label, "delay: largest error", f"{np.abs(delay).max():.2e} s of 8 s (sd {delay.std():.1e} s)")
    within = ", ".join(f"{value:.4f}" for value in apart.std(axis=0, ddof=1))
    bounds = ", ".join(f"{value:.4f}" for value in bound / np.abs(case.coefficients))
    table.add(label, "relative sd, each coefficient", within, peer=f"bound, delay known: {bounds}")
    peer = over_cores(scipy_rmse, case, 40, noise) / found[:40, 2]
    figure = "ends at the least rmse within 0.1 %"
    table.add(label, figure, "the reference", peer=f"{(peer < 1.001).mean() * 100:.0f} % of 40")
    assert converged


@pytest.mark.parametrize("numerator", [(1000.0,), (20.0, 1000.0)])
def test_second_order(table, numerator):
    case, runs, noise = cases.second_order(numerator), 40, 2.3
    exact = found_coefficients(fitted(case, 0.0, 0)) / case.coefficients - 1
    found = over_cores(transfer_functions, case, runs, noise, {})[:, 4:] / case.coefficients - 1
    bound = cases.cramer_rao_linear(case, noise * float(np.std(case.clean))) / case.coefficients
    noise_free, worst = float(np.abs(exact).max()), np.abs(found).max(axis=1)
    label = f"{case.name}, {runs} runs"
    table.add(label, "noise-free error", f"{noise_free:.1e}", asked="1e-8", met=noise_free < 1e-8)
    table.add(
        label,
        "error at noise 2.3 times the signal",
        f"{worst[0]:.3f} in the first run; within 0.1 in {(worst < 0.1).mean() * 100:.0f} %, worst {worst.max():.3f}",
        asked="0.1",
        met=bool(worst[0] < 0.1),
    )
    within = ", ".join(f"{value:.4f}" for value in found.std(axis=0))
    table.add(
        label, "relative sd, each coefficient", within, peer="bound " + ", ".join(f"{value:.4f}" for value in bound)
    )
    assert noise_free < 1e-8


@pytest.mark.parametrize("collocated", [True, False])
def test_coupled_inertias(table, collocated):
    case = cases.coupled_inertias(collocated=collocated)
    exact = fitted(case, 0.0, 0, method="srivc", prefilter_rad_s=20.0)
    noise_free = float(np.abs(found_coefficients(exact) / case.coefficients - 1).max())
    runs = 20
    options = {"method": "trf", "prefilter_rad_s": 20.0}
    found = over_cores(transfer_functions, case, runs, 0.05, options)
    worst = np.abs(found[:, 4:] / case.coefficients - 1).max(axis=1)
    label = f"{case.name}, order 8, {runs} runs (peer: scipy from ARX)"
    table.add(label, "noise-free error", f"{noise_free:.1e}", asked="1e-4", met=noise_free < 1e-4)
    iterations = max(int(found[:, 0].max()), exact.iterations)
    table.add(label, "iterations, most", f"{iterations}", asked="10", met=iterations <= 10)
    figure = "error at 5 % noise, worst of all runs"
    table.add(label, figure, f"{worst.max():.3f}", asked="0.05", met=bool(worst.max() < 0.05))
    peer = over_cores(scipy_rmse, case, 4, 0.05) / found[:4, 2]
    reached = f"{found[:, 1].mean() * 100:.0f} % converged"
    table.add(label, "ends at the least rmse within 0.1 %", reached, peer=f"{(peer < 1.001).mean() * 100:.0f} % of 4")
    assert noise_free < 1e-4
    assert iterations <= 10
