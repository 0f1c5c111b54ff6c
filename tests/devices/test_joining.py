"""Two logs of one test come onto one time base, with an error bar that holds."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.joining import Alignment, align, join, join_pairs
from smartshoe.errors import InputError
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

PROTOCOL = dynamic_protocol((100.0, 400.0, 800.0), rest_s=2.0)


def _logs(delay_s: float, rate: float, noise: float, seed: int) -> tuple[Recording, Recording]:
    rng = np.random.default_rng(seed)
    machine_s = np.arange(0, PROTOCOL.duration_s, 0.01)
    logger_s = np.arange(0, PROTOCOL.duration_s - 1.0, 0.01)
    middle = 0.5 * (logger_s[0] + logger_s[-1])
    at = logger_s + delay_s + rate * (logger_s - middle)
    load = PROTOCOL.load_at(at)
    machine = Recording.from_arrays(
        time_s=machine_s, force_n=PROTOCOL.load_at(machine_s) + rng.normal(0, noise, machine_s.size), name="machine"
    )
    logger = Recording.from_arrays(
        time_s=logger_s, load_v=0.1 + load / 200 + rng.normal(0, noise / 200, load.size), pressure_v=0.5 + load / 400
    )
    return machine, logger


@settings(max_examples=15)
@given(st.floats(-0.4, 0.9), st.sampled_from([0.0, 2e-4, -1e-4]), st.floats(0.1, 2.0), st.integers(0, 1000))
def test_delay_and_clock_rate_are_recovered_within_their_error(
    delay_s: float, rate: float, noise: float, seed: int
) -> None:
    machine, logger = _logs(delay_s, rate, noise, seed)
    found = align(machine.time_s, machine.force_n, logger.time_s, logger["load"].values)
    # Corners between samples and noise on the regressor add to the formal error; a tenth of a sample covers them.
    assert found.delay_s == pytest.approx(delay_s, abs=6 * found.delay_sd_s + 1e-3)
    assert found.rate == pytest.approx(rate, abs=6 * found.rate_sd + 3e-5)


def test_a_joined_recording_has_load_and_reading_together() -> None:
    machine, logger = _logs(0.35, 0.0, 0.3, 1)
    joined = join(machine, logger)
    # The reading is an exact line in the load; noise of the load cell is all that may be left.
    line = np.polyfit(joined.sensor.values, joined.force_n, 1)
    assert np.std(joined.force_n - np.polyval(line, joined.sensor.values)) < 0.6
    assert any("joined" in note for note in joined.notes)


def test_pairs_are_found_among_whole_recordings() -> None:
    machine, logger = _logs(0.2, 0.0, 0.3, 2)
    whole = join(machine, logger)
    found = join_pairs([whole, machine, logger, whole])
    assert len(found) == 3
    assert all(len(recording.sensors) == 1 and recording.of_role("load") for recording in found)


def test_logs_of_different_tests_are_refused() -> None:
    machine, logger = _logs(0.2, 0.0, 0.3, 3)
    rng = np.random.default_rng(0)
    other = Recording.from_arrays(time_s=logger.time_s, pressure_v=rng.normal(0, 1, len(logger)))
    with pytest.raises(InputError, match="one and the same test"):
        join(machine, other)


@pytest.mark.parametrize("ticks", ["logger", "machine"])
def test_a_join_may_stand_on_either_ones_ticks_and_keeps_the_noise_of_that_one(
    ticks: Literal["logger", "machine"],
) -> None:
    machine, logger = _logs(0.35, 1e-4, 0.3, 4)
    joined = join(machine, logger, ticks=ticks)
    kept, source = (joined["pressure"], logger["pressure"]) if ticks == "logger" else (joined.load, machine.load)
    assert set(kept.values) <= set(source.values)
    line = np.polyfit(joined.sensor.values, joined.force_n, 1)
    assert np.std(joined.force_n - np.polyval(line, joined.sensor.values)) < 0.6
    assert joined.time_s[0] >= logger.time_s[0] - 1e-9
    assert joined.time_s[-1] <= logger.time_s[-1] + 1e-9


@pytest.mark.parametrize("ticks", ["logger", "machine"])
def test_a_hole_in_a_log_is_missing_and_not_bridged(ticks: Literal["logger", "machine"]) -> None:
    machine, logger = _logs(0.2, 0.0, 0.3, 5)
    holed, whole = (machine, logger) if ticks == "logger" else (logger, machine)
    hole = (holed.time_s > 5.0) & (holed.time_s < 6.0)
    holed = holed.taken(~hole)
    joined = join(holed, whole, ticks=ticks) if ticks == "logger" else join(whole, holed, ticks=ticks)
    moved = joined.load if ticks == "logger" else joined["pressure"]
    assert moved.missing is not None
    assert 95 <= np.count_nonzero(moved.missing) <= 105


def test_another_sensors_channel_is_no_copy_of_the_load() -> None:
    """Two sensors that lag alike: the one that was not chosen must not lend its lag to the clocks."""
    machine, logger = _logs(0.2, 0.0, 0.3, 4)
    load, lagging = 200.0 * logger["load"].values, np.empty(len(logger))
    lagging[0] = load[0]
    for k in range(1, load.size):
        lagging[k] = lagging[k - 1] + 0.01 / 0.3 * (load[k] - lagging[k - 1])
    rng = np.random.default_rng(1)
    alike = [lagging / 4.0 + rng.normal(0.0, 0.5, load.size) for _ in range(2)]
    sensors = Recording.from_arrays(time_s=logger.time_s, pressure_counts=alike[0], other_counts=alike[1])
    joined = join(machine, sensors)
    assert "no copy of the load" in joined.notes[-1]
    assert float(joined.metadata["join_delay_s"]) == pytest.approx(0.2, abs=0.02)  # not 0.3 s less


def test_a_smooth_load_without_corners_is_joined_all_the_same() -> None:
    time_s = np.arange(0.0, 60.0, 0.02)
    load = 200.0 - 200.0 * np.cos(0.4 * time_s)
    bent = (load / 400.0) ** 2  # more than the unit's model says
    machine = Recording.from_arrays(time_s=time_s, force_n=load)
    sensor = Recording.from_arrays(time_s=time_s, pressure_mbar=100.0 * np.interp(time_s - 0.5, time_s, bent))
    assert float(join(machine, sensor).metadata["join_delay_s"]) == pytest.approx(-0.5, abs=0.2)


@pytest.mark.parametrize(("rate", "later_s", "is_doubted"), [(0.0, 0.0, True), (0.015, 0.5, True), (0.0, 0.5, False)])
def test_two_logs_that_one_clock_may_have_written_say_so(rate: float, later_s: float, is_doubted: bool) -> None:
    """They hold the same times, or clocks that differ by more than clocks do."""
    machine, _ = _logs(0.0, 0.0, 0.3, 6)
    time_s = machine.time_s + later_s
    load = PROTOCOL.load_at(time_s * (1.0 + rate))
    logger = Recording.from_arrays(time_s=time_s, load_v=load / 200.0, pressure_v=0.5 + load / 400.0)
    assert ("if one clock wrote both logs" in join(machine, logger).notes[-1]) == is_doubted


@pytest.mark.parametrize(
    ("delay_s", "rate", "words"),
    [(0.35, 2e-4, "0.3500 ± 0.0010 s ahead in the middle of the record, 200.0 ± 3.0 ppm fast"),
     (-5.3, -1e-4, "5.3000 ± 0.0010 s behind in the middle of the record, 100.0 ± 3.0 ppm slow")],
)  # fmt: skip
def test_a_clock_that_is_behind_is_not_said_to_be_ahead_by_less_than_nothing(
    delay_s: float, rate: float, words: str
) -> None:
    assert Alignment(delay_s, 1e-3, rate, 3e-6, 0.0).says == words
