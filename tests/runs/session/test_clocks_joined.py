"""The shoe's clock and the machine's, found from the reading and the load alone.

The figures: ``pytest -m bank tests/runs/session/test_clocks_joined.py -s``. The sensor's own lag, a millisecond,
cannot be told from a delay and stays in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.devices import open_machine, open_shoe
from smartshoe.devices._corners import corners, follow_corners
from smartshoe.devices.joining import align_reading, coarse
from smartshoe.protocol import Protocol, dynamic_protocol

SENSOR_LAG_S = 0.001
HYSTERESIS = {"bladder": {"hysteresis": {"strength": 0.01}}}
LEAK_AND_HEAT = {"bladder": {"leak": {"linear_per_s": 0.02}, "gas_heat": {"fraction": 0.3, "time_constant_s": 0.5}}}


@dataclass
class _Pressing:
    machine_s: np.ndarray
    load_n: np.ndarray
    shoe_s: np.ndarray
    reading: np.ndarray
    machine_true_s: np.ndarray
    rate: float


def _pressing(seed: int, unit: str, effects: dict[str, Any], protocol: Protocol | None = None) -> _Pressing:
    """A pressing on the bench: up to 200 ppm of skew either way, seconds of offset, a wait before the test."""
    rng = np.random.default_rng(seed)
    protocol = protocol or dynamic_protocol()
    skew_ppm = float(rng.uniform(-200.0, 200.0))
    shoe: Any = open_shoe("sim:stand", seed=seed, clock_skew_ppm=skew_ppm, units={unit: effects})
    machine: Any = open_machine("sim:instron", seed=seed + 1000)
    machine.under(shoe, unit)
    with shoe, machine:
        stream = shoe.blocks()
        blocks = list(islice(stream, int(rng.integers(20, 80))))
        machine.run(protocol)
        blocks += list(islice(stream, int(10 * protocol.duration_s) + 20))
    bench, log = shoe.bench, machine.logs[0]
    shoe_s = np.concatenate([block.time_s for block in blocks])
    began = machine.parameters.bluehill_clock_offset_s - bench.began_s[0]
    column = [u.name for u in shoe.units].index(unit)
    return _Pressing(
        log.time_s, log.force_n, shoe_s, np.concatenate([block.readings[:, column] for block in blocks]),
        (shoe_s - bench.offset_s) * (1.0 + bench.skew) + began, bench.skew,
    )  # fmt: skip


def _errors(p: _Pressing) -> tuple[float, float, float, bool]:
    """Worst error in s within the test, rate error in ppm and its sd, and whether the corners alone were used."""
    found = align_reading(p.machine_s, p.load_n, p.shoe_s, p.reading)
    inside = (p.machine_true_s > p.machine_s[0]) & (p.machine_true_s < p.machine_s[-1])
    wrong_s = float(np.abs(found.machine_time(p.shoe_s) - p.machine_true_s)[inside].max())
    return wrong_s, 1e6 * (found.rate - p.rate), 1e6 * found.rate_sd, found.by == "corners"


@pytest.mark.parametrize(("seed", "unit"), [(1, "left_toe"), (2, "left_heel"), (3, "left_meta1")])
def test_delay_and_rate_are_found_without_a_copy_of_the_load(seed: int, unit: str) -> None:
    wrong_s, rate_ppm, sd_ppm, by_corners = _errors(_pressing(seed, unit, {}))
    assert not by_corners
    assert wrong_s < 2e-3
    assert abs(rate_ppm) < 4.0 * sd_ppm
    assert sd_ppm < 4.0


def test_a_unit_that_does_more_than_its_model_is_joined_by_the_loads_corners() -> None:
    p = _pressing(4, "left_toe", HYSTERESIS)
    wrong_s, rate_ppm, sd_ppm, by_corners = _errors(p)
    assert by_corners
    # The model's fit is 80 ms off here: friction looks like a delay on every slow ramp.
    assert wrong_s < 4e-3
    assert abs(rate_ppm) < 4.0 * sd_ppm


def test_corners_are_where_the_protocol_has_them_and_give_the_delay() -> None:
    protocol = dynamic_protocol((100.0, 400.0), rest_s=2.0)
    time_s = np.arange(0.0, protocol.duration_s, 0.01)
    rng = np.random.default_rng(0)
    load_n = protocol.load_at(time_s) + rng.normal(0.0, 0.3, time_s.size)
    found = corners(time_s, load_n)
    expected = protocol.corners()[0][1:-1]
    assert found.size == expected.size
    np.testing.assert_allclose(found, expected, atol=0.03)
    shoe_s = np.arange(1.0, protocol.duration_s - 1.0, 0.005)
    reading = 3.0 + 0.2 * protocol.load_at(shoe_s + 0.2 + 1e-4 * (shoe_s - 0.5 * (shoe_s[0] + shoe_s[-1])))
    reading += rng.normal(0.0, 0.02, shoe_s.size)
    start, _ = coarse(time_s, load_n, shoe_s, reading)
    found = follow_corners(time_s, load_n, shoe_s, reading, start)
    assert found is not None
    assert found.delay_s == pytest.approx(0.2, abs=4.0 * found.delay_sd_s)
    assert found.rate == pytest.approx(1e-4, abs=4.0 * found.rate_sd)
    assert found.delay_sd_s < 1e-3


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_kinks_of_a_smooth_loads_noise_are_no_corners(seed: int) -> None:
    """A bent unit that relaxes, under slow waves that a coarse gauge reads: an honest error, not milliseconds."""
    rng = np.random.default_rng(seed)
    machine_s = np.arange(0.0, 200.0, 0.02)
    waves = [rng.uniform(0.5, 1.0) * np.sin(2.0 * np.pi * machine_s / period) for period in rng.uniform(6.0, 40.0, 4)]
    load_n = 50.0 + 10.0 * np.sum(waves, axis=0)
    late_s = float(rng.uniform(0.5, 1.5))
    shoe_s = machine_s[100:-100]
    seen = np.interp(shoe_s - late_s, machine_s, load_n)
    relaxing = lfilter([1.0], [1.0, -np.exp(-0.02 / 8.0)], seen - seen[0]) * (1.0 - np.exp(-0.02 / 8.0))
    reading = 0.1 * seen + 0.02 * relaxing - 1e-5 * seen**3 / 50.0 + rng.normal(0.0, 0.003, seen.size)
    gauged = np.round(load_n + rng.normal(0.0, 0.05, load_n.size), 1)
    found = align_reading(machine_s, gauged, shoe_s, reading)
    assert found.by == "curve"
    assert abs(found.delay_s + late_s) < 3.0 * found.delay_sd_s + 0.02
    # What the corners would have said, from where the correlation is best:
    assert follow_corners(machine_s, gauged, shoe_s, reading, coarse(machine_s, gauged, shoe_s, reading)[0]) is None


@pytest.mark.bank
@pytest.mark.parametrize(
    ("name", "unit", "effects"),
    [
        ("left_toe", "left_toe", {}),
        ("left_heel", "left_heel", {}),
        ("left_toe, friction 1 %", "left_toe", HYSTERESIS),
        ("left_toe, leak and heat", "left_toe", LEAK_AND_HEAT),
    ],
)
def test_figures_over_many_seeds(name: str, unit: str, effects: dict[str, Any]) -> None:
    rows = np.array([_errors(_pressing(seed, unit, effects)) for seed in range(100, 200)])
    wrong_ms, rate_ppm = 1e3 * rows[:, 0], np.abs(rows[:, 1])
    print(
        f"\n{name}: worst time error {np.median(wrong_ms):.2f} ms median, {np.quantile(wrong_ms, 0.95):.2f} at 95 %,"
        f" {wrong_ms.max():.2f} largest; rate {np.median(rate_ppm):.1f} ppm median, {np.quantile(rate_ppm, 0.95):.1f}"
        f" at 95 %, {rate_ppm.max():.1f} largest, said sd {rows[:, 2].mean():.1f}, within 5 ppm"
        f" {100.0 * np.mean(rate_ppm <= 5.0):.0f} %; by corners {100.0 * rows[:, 3].mean():.0f} %"
    )
    assert np.isfinite(rows).all()
