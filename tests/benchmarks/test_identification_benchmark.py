"""The identifier's accuracy: against the Cramer-Rao bound, with nuisances, and with noise on both signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cases
import numpy as np
import pytest
from monte_carlo import over_cores, percent
from scipy.optimize import least_squares

import smartshoe
from smartshoe.recording import Recording

pytestmark = pytest.mark.benchmark

NAMES = ("a1", "b0", "b1")
KNOWN: dict[str, Any] = {"offset": 0.0, "delay": 0.0, "initial_state": "steady"}
RUNS = 1000


# -- Monte Carlo -----------------------------------------------------------------------------------------------------
def recording(shoe: cases.Shoe, seed: int, reading_noise: float = 0.0, *, command: bool = False) -> Recording:
    rng = np.random.default_rng(seed)
    force_n = shoe.load_n + cases.LOAD_NOISE_N * rng.standard_normal(shoe.load_n.size)
    reading = shoe.reading + reading_noise * rng.standard_normal(shoe.reading.size)
    more = {"command_n": shoe.load_n} if command else {}
    return Recording.from_arrays(time_s=shoe.time_s, force_n=force_n, pressure_mbar=reading, **more)


def identified(
    shoe: cases.Shoe,
    seeds: Sequence[int],
    reading_noise: float,
    options: Mapping[str, Any],
    names: Sequence[str] = NAMES,
    command: bool = False,
) -> np.ndarray:
    """(runs, parameters, 4) value, standard deviation, ends of the 95 % interval."""
    found = []
    for seed in seeds:
        fit = smartshoe.identify(recording(shoe, seed, reading_noise, command=command), **options)
        found.append([[p.value, p.sd, *p.ci95] for p in (fit.parameters[name] for name in names)])
    return np.array(found)


def scipy_fits(shoe: cases.Shoe, seeds: Sequence[int], reading_noise: float) -> np.ndarray:
    """(runs, 3) by the peer."""
    found = []
    for seed in seeds:
        one = recording(shoe, seed, reading_noise)
        u, y = np.asarray(one["pressure"].values), np.asarray(one["force"].values)
        found.append(least_squares(cases.filter_residual, np.ones(3), args=(u, y), x_scale="jac").x)
    return np.array(found)


# -- the shoe --------------------------------------------------------------------------------------------------------
ASKED_SD = {"a1": 0.378, "b0": 0.0099, "b1": 0.379, "k1": 0.0106, "k2": 0.194}  # %


def add_shoe_rows(table, label, names, found, true, bound, peer):
    """Standard deviation, bias and coverage of each parameter; what fell short."""
    bias, error, sd = percent(found[:, :, 0], true)
    covered = ((found[:, :, 2] <= true) & (true <= found[:, :, 3])).mean(axis=0) * 100
    short = []
    for i, name in enumerate(names):
        ratio = sd[i] / (bound[i] / true[i] * 100)
        rows = (
            (
                f"sd of {name}", f"{ASKED_SD[name]} %, within 7 %", f"{sd[i]:.4g} % = {ratio:.3f} of the bound",
                f"{peer[2][i]:.4g} %" if peer else "", abs(ratio - 1) < 0.07,
            ),
            (
                f"bias of {name}", f"below {3 * error[i]:.2g} %", f"{bias[i]:+.2g} %",
                f"{peer[0][i]:+.2g} %" if peer else "", abs(bias[i]) < 3 * error[i],
            ),
            (f"95 % interval of {name} covers", "93-97 %", f"{covered[i]:.1f} %", "none given", 93 <= covered[i] <= 97),
        )  # fmt: skip
        for figure, asked, reached, peers, met in rows:
            table.add(label, figure, reached, asked=asked, peer=peers, met=bool(met))
            short += [] if met else [f"{label}: {figure} {reached}, asked {asked}"]
    return short


def test_shoe_reaches_the_bound(table):
    shoe = cases.shoe()
    bound, grey_bound = cases.cramer_rao_sd()
    peer = percent(over_cores(scipy_fits, shoe, RUNS, 0.0), cases.TRUE)
    free = over_cores(identified, shoe, RUNS, 0.0, KNOWN)
    short = add_shoe_rows(
        table, f"shoe, {RUNS} runs, a1 b0 b1 alone (peer: scipy)", NAMES, free, cases.TRUE, bound, peer
    )
    options = KNOWN | {"structure": "grey_box", "fixed": {"c": cases.C, "x_over_nrt": cases.X}, "scale": 1.0}
    grey = over_cores(identified, shoe, RUNS, 0.0, options, ("k1", "k2"))
    label = f"shoe, {RUNS} runs, grey box k1 k2"
    short += add_shoe_rows(table, label, ("k1", "k2"), grey, np.array([cases.K1, cases.K2]), grey_bound, None)
    default = over_cores(identified, shoe, RUNS, 0.0, {})
    bias, error, sd = percent(default[:, :, 0], cases.TRUE)
    covered = ((default[:, 0, 2] <= cases.TRUE[0]) & (cases.TRUE[0] <= default[:, 0, 3])).mean() * 100
    table.add(
        f"shoe, {RUNS} runs, default (offset, delay and start estimated too)",
        "a1: sd, bias, coverage",
        f"{sd[0]:.3g} %, {bias[0]:+.2g} ± {error[0]:.2g} %, {covered:.1f} %",
    )
    assert not short, "; ".join(short)


# -- nuisances -------------------------------------------------------------------------------------------------------
def test_offset_skew_and_start_in_mid_ramp_together(table):
    runs, step_s = 500, cases.SAMPLE_TIME_S
    full_scale = cases.shoe().full_scale
    suffered = cases.shoe_in_mid_ramp(skew_s=0.5 * step_s, from_sample=800)
    suffered = cases.Shoe(suffered.time_s, suffered.load_n, suffered.reading + 0.01 * full_scale)
    found = over_cores(identified, suffered, runs, 0.0, {})
    bias, error, sd = percent(found[:, :, 0], cases.TRUE)
    peer = percent(scipy_fits(suffered, range(40), 0.0), cases.TRUE)
    ratio = bias[0] / sd[0]
    label = f"offset 1 %, skew half a sample, start in mid-ramp, {runs} runs (peer: scipy, three coefficients)"
    met = bool(abs(ratio) < 0.5)
    table.add(
        label,
        "bias of a1 over its sd",
        f"{ratio:+.3f} ± {1 / np.sqrt(runs):.3f} (bias {bias[0]:+.3f} %, sd {sd[0]:.3f} %)",
        asked="below 0.5",
        peer=f"{peer[0][0] / peer[2][0]:+.0f} (bias {peer[0][0]:+.1f} %)",
        met=met,
    )
    for name, alone in (
        (
            "offset alone",
            cases.Shoe(cases.shoe().time_s, cases.shoe().load_n, cases.shoe().reading + 0.01 * full_scale),
        ),
        ("skew alone", cases.shoe_in_mid_ramp(skew_s=0.5 * step_s, from_sample=1)),
        ("start alone", cases.shoe_in_mid_ramp(skew_s=0.0, from_sample=800)),
    ):
        peer = percent(scipy_fits(alone, range(10), 0.0), cases.TRUE)
        bias, error, _ = percent(over_cores(identified, alone, 200, 0.0, {})[:, :, 0], cases.TRUE)
        reached = f"{bias[0]:+.3f} ± {error[0]:.3f} %"
        table.add(label, f"{name}: bias of a1", reached, peer=f"{peer[0][0]:+.1f} %")
    assert met


# -- noise on both signals -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("share", "limit_percent", "command_runs"), [(0.005, 0.1, 1000), (0.02, 1.0, 400)])
def test_errors_in_variables(table, share, limit_percent, command_runs):
    shoe = cases.shoe()
    noise = share * shoe.full_scale
    label = f"pressure noise {share * 100:g} % of full scale: bias of a1 (peer: scipy)"
    peer = percent(over_cores(scipy_fits, shoe, 200, noise), cases.TRUE)
    suffered = f"{peer[0][0]:+.2f} ± {peer[1][0]:.2f} %"
    short = []
    for estimator, nuisances, runs in (
        ("output_error", KNOWN, 300),
        ("output_error", {}, 300),
        ("command", KNOWN, command_runs),
        ("command", {}, command_runs),
        ("auto", {}, 200),
        ("errors_in_variables", KNOWN, 300),
        ("errors_in_variables", {}, 200),
    ):
        with_command = estimator in ("command", "auto")
        found = over_cores(identified, shoe, runs, noise, {"estimator": estimator, **nuisances}, NAMES, with_command)
        bias, error, sd = percent(found[:, :, 0], cases.TRUE)
        asked = estimator == "command"
        met = bool(abs(bias[0]) < limit_percent) if asked else None
        figure = f"{estimator}, nuisances {'known' if nuisances else 'estimated'}, {runs} runs"
        reached = f"{bias[0]:+.3f} ± {error[0]:.3f} % (sd {sd[0]:.2f} %)"
        table.add(label, figure, reached, asked=f"below {limit_percent:g} %" if asked else "", peer=suffered, met=met)
        # A figure below which the Monte Carlo error does not let one see is not asserted more sharply than that.
        if asked and abs(bias[0]) > limit_percent + 3 * error[0]:
            short.append(f"{figure}: {reached}")
    assert not short, "; ".join(short)
