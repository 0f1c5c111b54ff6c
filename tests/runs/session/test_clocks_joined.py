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
from smartshoe.devices._corners import corners, follow_corners, kinds_of
from smartshoe.devices.joining import Alignment, align_reading, coarse
from smartshoe.protocol import Protocol, dynamic_protocol
from smartshoe.signals.noise import NORMAL_95

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


def _bent_unit(load_n: np.ndarray, *, leak_per_s: float, play: float, bend: float) -> np.ndarray:
    """Reading (n,) under a load at 100 Hz: a bend, play of a twentieth of 800 N each way, relaxation, an air leak."""
    share = load_n / 800.0
    centre, lagging, leaked = 0.0, 0.0, 0.0
    reading = np.empty(load_n.size)
    for k, pressed in enumerate(share):
        centre = min(max(centre, pressed - 0.05), pressed + 0.05)
        level = pressed - play * (pressed - centre) / 0.05
        level += 4.0 * bend * level * (1.0 - level)
        lagging += 0.01 * (level - lagging) / 4.0
        leaked += 0.01 * leak_per_s * (level - leaked)
        reading[k] = level + 0.08 * lagging - leaked
    return 160.0 * reading


def _joined_bent(rates_n_per_s: tuple[float, ...], rest_s: float, seed: int, **unit: float) -> tuple[Alignment, float]:
    """The alignment of a load's log and a unit's at 50 Hz that runs 100 ppm fast, and how far off its delay is in s."""
    rng = np.random.default_rng(seed)
    parts = [np.zeros(300)]
    for rate in rates_n_per_s:
        samples = round(100.0 * 800.0 / rate)
        up = np.linspace(0.0, 800.0, samples, endpoint=False)
        parts += [up, 800.0 - up, np.zeros(round(100.0 * rest_s))]
    load_n = np.concatenate([*parts, np.zeros(300)])
    machine_s = 0.01 * np.arange(load_n.size)
    reading = _bent_unit(load_n, **unit) + rng.normal(0.0, 0.05, load_n.size)
    true_s = np.arange(-4.0, machine_s[-1] + 5.0, 0.02)
    logger_s = 1.0001 * (true_s + 4.0)
    found = align_reading(
        machine_s, load_n + rng.normal(0.0, 0.3, load_n.size), logger_s, np.interp(true_s, machine_s, reading)
    )
    middle_s = 0.5 * (logger_s[0] + logger_s[-1])
    return found, found.delay_s - (middle_s / 1.0001 - 4.0 - middle_s)


@pytest.mark.parametrize(
    ("rates_n_per_s", "rest_s"),
    [
        ((100.0, 100.0, 200.0, 200.0, 400.0, 400.0, 800.0, 800.0), 1.0),
        ((800.0,) * 12, 1.0),
        ((400.0,) * 12, 0.0),  # two kinds of corners, each the other's mirror image: they are shifted alike
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_error_bar_of_corners_holds_what_friction_and_a_leak_shift_them(
    rates_n_per_s: tuple[float, ...], rest_s: float, seed: int
) -> None:
    found, wrong_s = _joined_bent(rates_n_per_s, rest_s, seed, leak_per_s=0.006, play=0.015, bend=0.03)
    assert found.by == "corners"
    # 4 to 13 ms, where the noise about the fit alone says 0.3 to 1 ms.
    assert 3e-3 < abs(wrong_s) < NORMAL_95 * found.delay_sd_s
    assert found.delay_sd_s < 0.02


def test_a_leak_alone_costs_the_corners_no_error_bar() -> None:
    """It has no quick part: corners of all kinds agree within the noise."""
    found, wrong_s = _joined_bent((100.0, 200.0, 400.0, 800.0), 1.0, 3, leak_per_s=0.05, play=0.0, bend=0.03)
    assert found.by == "corners"
    assert abs(wrong_s) < 3.0 * found.delay_sd_s
    assert found.delay_sd_s < 1.5e-3


def test_kinds_of_corners_are_told_by_the_slopes_beside_them() -> None:
    protocol = dynamic_protocol((100.0, 400.0), rest_s=2.0)
    time_s = np.arange(0.0, protocol.duration_s, 0.01)
    load_n = protocol.load_at(time_s)
    at = corners(time_s, load_n)
    kinds = kinds_of(at, np.full((at.size, 2), 0.2), time_s, load_n)
    slopes = np.round((np.interp(at + 0.2, time_s, load_n) - np.interp(at, time_s, load_n)) / 20.0)
    for kind in range(kinds.max() + 1):
        assert np.ptp(slopes[kinds == kind]) <= 0.25 * np.abs(slopes[kinds == kind]).max()
    assert kinds.max() + 1 == 6  # two rates: a rise begins, turns into a fall, and the fall ends


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
