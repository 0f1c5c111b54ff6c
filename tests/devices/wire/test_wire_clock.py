"""The device's clock on the host's: within a millisecond under 100 ppm and tens of milliseconds of jitter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import pearson3

from smartshoe.devices.wire.clock import KEPT_BINS, ClockFit, DeviceClock
from smartshoe.devices.wire.delay_law import STRAY, DelayLaw, _tables
from smartshoe.devices.wire.delay_line import robust_line
from smartshoe.errors import UsageError

Array = NDArray[np.float64]
RATE_HZ = 200
SKEW_PPM = 100.0
BLOCK = 20
LAWS = (
    "uniform, 0 to 20 ms",
    "exponential, 20 ms",
    "half normal, 20 ms",
    "normal, 20 ms about 100",
    "lognormal, median 10 ms",
    "radio packets of 50 ms, exponential 5 ms",
    "USB timer of 16 ms, uniform 4 ms",
    "exponential, 20 ms; a stall of 1 s every 10 s",
)


def _delays(law: str, time_s: Array, rng: np.random.Generator) -> Array:
    n = time_s.size
    match LAWS.index(law):
        case 0:
            return rng.uniform(0.0, 0.02, n)
        case 1:
            return rng.exponential(0.02, n)
        case 2:
            return np.abs(rng.normal(0.0, 0.02, n))
        case 3:
            return np.maximum(rng.normal(0.1, 0.02, n), 0.0)
        case 4:
            return 0.01 * rng.lognormal(0.0, 1.0, n)
        case 5:
            return np.ceil(time_s / 0.05) * 0.05 - time_s + rng.exponential(0.005, n)
        case 6:
            return np.ceil(time_s / 0.016) * 0.016 - time_s + rng.uniform(0.0, 0.004, n)
        case _:
            delays = rng.exponential(0.02, n)
            for start in rng.integers(0, n, n // (10 * RATE_HZ)):
                stop = min(start + RATE_HZ, n)
                delays[start:stop] += np.linspace(1.0, 0.0, RATE_HZ)[: stop - start]
            return delays


@dataclass
class Run:
    """A stream of ``duration_s``: true times of its samples, the device's, and their errors by the fit."""

    law: str
    duration_s: float
    seed: int

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.true_s = np.arange(round(self.duration_s * RATE_HZ)) / RATE_HZ
        self.device_s = 7.0 + self.true_s / (1.0 + SKEW_PPM * 1e-6)
        # A serial line keeps the order.
        arrival_s = np.maximum.accumulate(self.true_s + 0.01 + _delays(self.law, self.true_s, rng))
        self.clock = DeviceClock()
        self.live_s, self.live_sd_s = np.empty_like(self.true_s), np.empty_like(self.true_s)
        for start in range(0, self.true_s.size, BLOCK):
            here = slice(start, start + BLOCK)
            self.clock.update(self.device_s[here], arrival_s[here])
            assert self.clock.fit is not None
            self.live_s[here] = self.clock.fit.host_time(self.device_s[here])
            self.live_sd_s[here] = self.clock.fit.sd_s(self.device_s[here])

    def final_error_s(self) -> float:
        """Largest error of a sample's time about the one constant, by the last line, over its window."""
        last = slice(-min(self.true_s.size, KEPT_BINS * RATE_HZ // 4), None)
        error = self.clock.host_time(self.device_s[last]) - self.true_s[last]
        return float(np.ptp(error)) / 2.0

    def live_error_s(self, from_s: float) -> float:
        """The same of each sample's time as it was at its arrival."""
        error = (self.live_s - self.true_s)[self.true_s >= from_s]
        return float(np.ptp(error)) / 2.0

    def share_within_stated(self, from_s: float) -> float:
        """Share of live times that are off by no more than 1.96 of the standard errors that were stated with them.

        About the constant that the last third of the stream shows.
        """
        error = self.live_s - self.true_s
        off = np.abs(error - error[self.true_s >= self.duration_s * 2.0 / 3.0].mean())
        return float(np.mean((off <= 1.96 * self.live_sd_s)[self.true_s >= from_s]))


@pytest.mark.parametrize("law", LAWS)
def test_a_minute_is_timed_within_a_millisecond(law: str) -> None:
    run = Run(law, 60.0, 1)
    fit = run.clock.fit
    assert fit is not None
    assert run.final_error_s() < 1e-3
    assert abs(fit.skew_ppm - SKEW_PPM) < 4.0 * fit.skew_sd_ppm
    assert (fit.sd_s(run.device_s) < 2e-3).all()
    assert fit.samples > 0.95 * run.true_s.size


@pytest.mark.parametrize("law", [pytest.param(LAWS[0], marks=pytest.mark.long), LAWS[3]])
def test_the_standard_error_of_the_skew_is_the_size_of_its_errors(law: str) -> None:
    true_s = np.arange(60 * RATE_HZ) / RATE_HZ
    errors = []
    for seed in range(20):
        clock = DeviceClock()
        arrival_s = np.maximum.accumulate(true_s + _delays(law, true_s, np.random.default_rng(seed)))
        clock.update(true_s / (1.0 + SKEW_PPM * 1e-6), arrival_s)
        assert clock.fit is not None
        errors.append((clock.fit.skew_ppm - SKEW_PPM) / clock.fit.skew_sd_ppm)
    # The root mean square of twenty is known to a sixth.
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.5


@settings(max_examples=8)
@given(st.floats(-1e4, 1e5), st.floats(-300.0, 300.0), st.integers(1, 60))
def test_without_jitter_the_line_is_found_whatever_the_batches(offset_s: float, skew_ppm: float, batch: int) -> None:
    device_s = np.arange(3000) / RATE_HZ
    host_s = offset_s + device_s * (1.0 + skew_ppm * 1e-6)
    clock = DeviceClock()
    for start in range(0, 3000, batch):
        clock.update(device_s[start : start + batch], host_s[start : start + batch])
    # Up to a constant: a skew moves the least delay of a quarter of a second by some microseconds.
    error_s = clock.host_time(device_s) - host_s
    assert np.ptp(error_s) < 2e-6
    assert np.abs(error_s).max() < 5e-5


def test_the_constant_stays_one_where_the_level_changes() -> None:
    run = Run(LAWS[3], 120.0, 3)
    steps = np.diff(run.live_s - run.true_s)[round(20 * RATE_HZ) :]
    assert np.abs(steps).max() < 5e-4


def test_a_temperature_is_followed() -> None:
    # 1 ppm of change a minute, for an hour: a single line would be off by tens of milliseconds.
    rng = np.random.default_rng(2)
    true_s = np.arange(3600 * 20) / 20
    device_s = true_s * (1 - 1e-4) - 0.5 * (1e-6 / 60) * true_s**2
    arrival_s = true_s + rng.uniform(0.0, 0.02, true_s.size)
    clock = DeviceClock()
    errors = []
    for start in range(0, true_s.size, 60):
        here = slice(start, start + 60)
        clock.update(device_s[here], arrival_s[here])
        errors.append(float((clock.host_time(device_s[here]) - true_s[here]).mean()))
    assert np.ptp(errors[30:]) / 2 < 3e-3
    assert np.ptp(device_s - true_s) > 0.1


def test_gaps_and_single_samples_are_taken() -> None:
    clock = DeviceClock()
    assert clock.fit is None
    with pytest.raises(UsageError, match="no line"):
        clock.host_time(0.0)
    clock.update([], [])
    clock.update(5.0, 105.0)
    assert clock.host_time(6.0) == pytest.approx(106.0)
    clock.update([600.0, 600.5], 700.5)
    assert clock.host_time(601.0) == pytest.approx(701.0, abs=0.6)
    clock.reset()
    assert clock.fit is None


def test_a_law_is_told_from_what_is_only_known_to_be_no_longer() -> None:
    # Exponential delays behind each other: of three in four only a bound is seen. The line through all of it is surer
    # than one through the delays that are known, taken as if all were.
    rng = np.random.default_rng(5)
    slopes: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(6):
        time_s = np.arange(4000) / RATE_HZ
        arrival_s = np.maximum.accumulate(time_s + rng.exponential(0.02, 4000))
        came_with = np.diff(arrival_s, prepend=-1.0) <= 0.0
        assert 0.6 < came_with.mean() < 0.9
        start = robust_line(time_s, arrival_s - time_s)
        for is_said in (True, False):
            kept = np.ones(4000, dtype=bool) if is_said else ~came_with
            at_s, delay_s, bound = time_s[kept], (arrival_s - time_s)[kept], came_with[kept]
            law = DelayLaw.of(delay_s - start.delay_s(at_s), bound)
            found = law.line(at_s, delay_s, bound, np.floor(2.0 * at_s).astype(int), start)
            assert found is not None
            slopes[is_said].append(found.slope)
    assert np.square(slopes[True]).mean() < 0.5 * np.square(slopes[False]).mean()


@pytest.mark.parametrize("skewness", [0.1, 1.0, 1.9])
@pytest.mark.parametrize("from_sd", [-0.5, -3.0])
def test_the_tables_are_density_and_probability_of_pearsons_third_law(skewness: float, from_sd: float) -> None:
    mean_s, sd_s = 0.03, 0.02
    edges = mean_s + sd_s * np.linspace(from_sd, 4.0, 601)
    middles, width = (edges[1:] + edges[:-1]) / 2.0, edges[1] - edges[0]
    shape = np.array([0.5, np.log(2.0), -np.log(2.0 / skewness - 1.0)])  # of middle and spread
    log_density, log_probability = _tables(shape, edges, 1.5 * width, mean_s - 0.5 * sd_s / 2.0, sd_s / 2.0)
    law = pearson3(skewness, loc=mean_s, scale=sd_s)
    stray = (middles - edges[0]) / (edges[-1] - edges[0])
    away = (
        np.abs(middles - (mean_s - 2.0 * sd_s / skewness)) > 8.0 * width
    )  # from the floor, where a law begins at once
    density = (1.0 - STRAY) * law.pdf(middles) + STRAY / (edges[-1] - edges[0])
    assert np.exp(log_density[away]) == pytest.approx(density[away], abs=2e-3 * density.max())
    probability = (1.0 - STRAY) * law.cdf(middles) + STRAY * stray
    assert np.exp(log_probability[away]) == pytest.approx(probability[away], abs=1e-4)


def test_a_line_and_its_errors_take_no_notice_of_delays_of_seconds() -> None:
    time_s, in_sd = 0.25 * np.arange(200), []
    spread_s = np.linalg.norm(time_s - time_s.mean())
    for seed in range(30):
        rng = np.random.default_rng(seed)
        delay_s = 0.02 + 1e-5 * time_s + rng.normal(0.0, 1e-3, 200)
        delay_s[rng.permutation(200)[:20]] += rng.uniform(1.0, 3.0, 20)
        line = robust_line(time_s, delay_s)
        assert line.offset_sd_s == pytest.approx(1e-3 / np.sqrt(180.0), rel=0.4)
        assert line.slope_sd == pytest.approx(1e-3 / (spread_s * np.sqrt(0.9)), rel=0.4)
        in_sd += [(line.slope - 1e-5) / line.slope_sd, (line.delay_s(40.0) - 0.0204) / line.sd_s(40.0)]
    # The root mean square of sixty is known to a tenth.
    assert 0.6 < np.sqrt(np.mean(np.square(in_sd))) < 1.3


def test_work_that_is_done_apart_is_taken_up_when_it_is_done() -> None:
    given: list[Callable[[], None]] = []
    clock, at_once = DeviceClock(given.append), DeviceClock()
    rng = np.random.default_rng(9)
    device_s = np.arange(8000) / RATE_HZ
    arrival_s = np.maximum.accumulate(device_s + rng.exponential(0.02, device_s.size))
    for start in range(0, 8000, 200):
        here = slice(start, start + 200)
        for each in (clock, at_once):
            each.update(device_s[here], arrival_s[here])
        assert clock.fit is not None
        assert clock.fit.level != "likely" or start > 6000
        if start == 6000:
            (work,) = given  # asked for once, however long it takes; nothing was held up
            work()
    assert clock.fit is not None
    assert at_once.fit is not None
    assert clock.fit.level == at_once.fit.level == "likely"
    assert abs(clock.fit.skew_ppm - at_once.fit.skew_ppm) < 2.0 * at_once.fit.skew_sd_ppm


@pytest.mark.bank
@pytest.mark.parametrize("law", LAWS)
def test_the_table_of_the_guide(law: str) -> None:
    """``pytest -m bank tests/devices/wire/test_wire_clock.py -s`` prints docs/wire.md's rows (some minutes).

    Seeds that nothing was developed on.
    """
    seeds = (31, 32, 33, 34)
    finals = [max(Run(law, duration, seed).final_error_s() for seed in seeds) for duration in (10.0, 60.0)]
    long = [Run(law, 600.0, seed) for seed in seeds]
    lives = sorted(run.live_error_s(30.0) for run in long)
    cells = [*finals, max(run.final_error_s() for run in long), float(np.median(lives)), lives[-1]]
    held = np.mean([run.share_within_stated(30.0) for run in long])
    print(f"\n| {law} | " + " | ".join(f"{1e3 * cell:.2f} ms" for cell in cells) + f" | {100 * held:.0f} % |")
    assert all(cell < 1e-3 for cell in cells[:3])


def test_a_line_is_known_best_in_its_middle_and_on_either_side_alike() -> None:
    fit = ClockFit(1000.0, 0.5, 0.003, 20.0, 4.0, "mean", 100, 100_000)
    assert fit.sd_s(1000.0) == pytest.approx(0.003)
    either = fit.sd_s(np.array([0.0, 2000.0]))
    assert either == pytest.approx(np.full(2, np.hypot(0.003, 4e-6 * 1000.0)))
    assert fit.host_time(np.array([1000.0, 1600.0])) == pytest.approx([1000.5, 1600.5 + 20e-6 * 600.0])
