"""Input that a laboratory brings on a bad day: one sentence each, and no fault where a sensor is merely another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.diagnosis import diagnose
from smartshoe.errors import MissingChannelError
from smartshoe.files.logs import read
from smartshoe.integrity import examine
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
LOAD_N = 800.0 * TRIANGLE + 0.3 * np.random.default_rng(0).standard_normal(TIME_S.size)
READING = 100.0 * TRIANGLE + 0.05 * np.random.default_rng(1).standard_normal(TIME_S.size)


def _recording(**columns: Array) -> Recording:
    return Recording.from_arrays(time_s=TIME_S, **columns)


def test_a_load_that_is_only_commanded_is_no_reference() -> None:
    found = examine([_recording(command_n=LOAD_N, pressure_mbar=READING)])
    assert "command is what was asked for, not what was measured" in found.refusals[0]


def test_a_load_that_is_taken_as_the_sensor_is_told_as_such(tmp_path: Path) -> None:
    """As by ``--sensor force_n`` of a table that holds the sensor, too."""
    path = tmp_path / "pressed.csv"
    np.savetxt(
        path,
        np.column_stack([TIME_S, LOAD_N, READING]),
        "%.4f",
        ",",
        header="time_s,force_n,pressure_mbar",
        comments="",
    )
    found = examine([read(path, sensors=["force_n"])])
    assert "there is no reference load (force is taken as the sensor)" in found.refusals[0]


def test_what_is_asked_for_is_chosen_from_the_columns_that_are_there() -> None:
    loadless = _recording(pressure_mbar=READING, left_mv=LOAD_N, right_mv=LOAD_N)
    assert examine([loadless]).refusals[0].endswith("name its column with --force (columns: left, right)")
    with pytest.raises(
        MissingChannelError, match=r"--sensor, for example --sensor 'left' \(columns: left, right, force\)"
    ):
        _ = replace(_recording(left_mv=READING, right_mv=READING, force_n=LOAD_N), source="log.csv").sensor
    both = examine([_recording(force_n=LOAD_N, left_toe_mbar=READING, left_heel_mbar=READING)])
    assert both.refusals[0].endswith("there are 2 readings (left_toe, left_heel): name one with --sensor")


def test_a_load_that_is_negative_in_compression_is_told_as_such() -> None:
    found = examine([_recording(force_n=-LOAD_N, pressure_mbar=READING)])
    assert [fault.kind for fault in found.faults] == ["wrong_sign"]
    assert "the load is negative in compression" in found.faults[0].says
    diagnosed = diagnose(_recording(force_n=-LOAD_N, pressure_mbar=READING))
    assert diagnosed.verdict == "refused"
    assert "turn its sign" in diagnosed.limits[0]


def test_a_pressure_that_falls_under_a_positive_load_is_no_negative_load() -> None:
    found = examine([_recording(force_n=LOAD_N, pressure_mbar=-READING)])
    assert [fault.kind for fault in found.faults] == ["wrong_sign"]
    assert "the pressure falls as the load rises" in found.faults[0].says


@pytest.mark.parametrize("period_s", [0.55, 0.7, 0.9])
def test_a_load_of_a_few_samples_a_ramp_that_is_followed_is_no_noise(period_s: float) -> None:
    """As one that was logged at 10 Hz: from each sample to the next it goes anywhere."""
    time_s = np.arange(0.0, 90.0, 0.1)
    load_n = 300.0 + 400.0 * (1.0 - np.abs(2.0 * (time_s / period_s % 1.0) - 1.0))
    noise, other = np.random.default_rng(1).standard_normal((2, time_s.size))
    followed, not_followed = (
        examine([Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=mbar)])
        for mbar in (0.1 * load_n + 0.05 * noise, 60.0 + 10.0 * other)
    )
    assert followed.faults == ()
    assert [fault.kind for fault in not_followed.faults] == ["does_not_follow_load"]
    # Of fewer than six samples a cycle more than half of the variance is in its steps, as noise's is.
    assert ("no more than its noise" in not_followed.refusals[0]) is (period_s < 0.6)


@pytest.mark.parametrize("seed", range(4))
def test_a_load_that_is_off_for_hours_is_no_noise_whatever_it_is_when_it_is_on(seed: int) -> None:
    """A boiler, logged by the hour, and a house that follows for a day; noise is off for no longer than by chance."""
    rng = np.random.default_rng(seed)
    is_on = np.tile(np.repeat([False, True], [8, 16]), 14)
    drawn = 2.5 * rng.integers(8, 36, is_on.size)
    time_s = 3600.0 * np.arange(is_on.size)
    other = np.cumsum(rng.standard_normal(is_on.size))
    by_day, shuffled = (
        examine([Recording.from_arrays(time_s=time_s, force_n=load_n, room_v=other)])
        for load_n in (np.where(is_on, drawn, 0.0), rng.permutation(np.where(is_on, drawn, 0.0)))
    )
    assert "the reading does not " in by_day.refusals[0]
    assert "noise" not in by_day.refusals[0]
    assert "no more than its noise" in shuffled.refusals[0]


@pytest.mark.parametrize("first", [0.0, 0.2, 0.35])
def test_a_reading_that_froze_for_most_of_a_recording_is_told_as_such(first: float) -> None:
    """What is left of it follows; the whole does not, and that is not because of the unit."""
    reading, begins = READING.copy(), int(first * TIME_S.size)
    ends = begins + int(0.65 * TIME_S.size)
    reading[begins:ends] = READING[begins if begins else ends]
    found = examine([_recording(force_n=LOAD_N, pressure_mbar=reading)])
    assert [fault.kind for fault in found.faults] == ["held_samples"]
    assert found.faults[0].share == pytest.approx(0.65, abs=0.001)
    assert f"stands still from {TIME_S[begins]:.4g} to" in found.refusals[0]


@pytest.mark.parametrize(("load", "reading"), [(1.0, 0.0), (0.0, 1.0)], ids=["reading", "load"])
def test_a_channel_that_is_constant_is_refused(load: float, reading: float) -> None:
    found = examine([_recording(force_n=40.0 + load * LOAD_N, pressure_mbar=3.0 + reading * READING)])
    assert [fault.kind for fault in found.faults] == ["does_not_follow_load"]
    assert ("the reading is constant" if load else "the load covers 0 N only") in found.refusals[0]


@pytest.mark.parametrize("samples", [1, 2])
def test_a_load_that_stands_but_for_a_spike_is_refused(samples: int) -> None:
    load_n = np.full(TIME_S.size, 100.0)
    load_n[1000 : 1000 + samples] = 500.0
    found = examine([_recording(force_n=load_n, pressure_mbar=READING)])
    assert "the reading does not follow the load" in found.refusals[0]


@pytest.mark.parametrize("rest_s", [0.0, 3.0])
@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_a_single_ramp_is_followed(rest_s: float, noise: float) -> None:
    """All that such a load explains is a trend."""
    share = np.clip((TIME_S - rest_s) / (TIME_S[-1] - rest_s), 0.0, 1.0)
    reading = 100.0 * (share + noise * np.random.default_rng(3).standard_normal(share.size))
    load_n = 800.0 * share + 0.2 * np.random.default_rng(4).standard_normal(share.size)
    assert examine([_recording(force_n=load_n, pressure_mbar=reading)]).refusals == ()


@pytest.mark.parametrize("power", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_ramp_whose_reading_is_a_line_in_time_is_followed(power: float, way: float) -> None:
    """As at a constant speed: the load is bent, and the reading all that a drift would be."""
    share = TIME_S / TIME_S[-1] if way > 0.0 else 1.0 - TIME_S / TIME_S[-1]
    noise = np.random.default_rng(3).standard_normal((2, share.size))
    bent = _recording(force_n=85.0 * share**power + 0.2 * noise[0], pressure_mbar=80.0 * share + 5e-3 * noise[1])
    assert examine([bent]).refusals == ()


@pytest.mark.parametrize(
    "load",
    [
        TRIANGLE,
        np.minimum(TIME_S, 9.0 * (60.0 - TIME_S)) / 54.0,
        np.minimum(TIME_S / 30.0, 1.0),
        np.floor(TIME_S / 6.0),
        1.0 * (TIME_S > 30.0),
    ],
    ids=["triangles", "and back a little", "held after", "staircase", "step"],
)
@pytest.mark.parametrize("noise", [0.0, 3e-3])
def test_what_merely_drifts_does_not_follow_a_load_that_stands_or_comes_back(load: Array, noise: float) -> None:
    of_load, of_reading = np.random.default_rng(3).standard_normal((2, TIME_S.size))
    drifting = _recording(force_n=800.0 * (load + noise * of_load), pressure_mbar=TIME_S + 5e-3 * of_reading)
    assert "the reading does not follow the load" in examine([drifting]).refusals[0]


def test_noise_does_not_follow_a_single_ramp() -> None:
    found = examine([_recording(force_n=TIME_S, pressure_mbar=np.random.default_rng(3).standard_normal(TIME_S.size))])
    assert "the reading does not follow the load" in found.refusals[0]


def test_thousands_of_short_recordings_are_refused_each_and_a_long_one_among_them_stays() -> None:
    whole = _recording(force_n=LOAD_N, pressure_mbar=READING)
    found = examine([*(whole.taken(slice(k, k + 60)) for k in range(2000)), whole])
    assert len(found.refusals) == 2000
    assert {fault.kind for fault in found.faults} == {"short_recording"}
    assert len(found.faults) == 2000
    assert found.usable[-1].all()


def test_one_cycle_is_enough_for_integrity() -> None:
    found = examine([_recording(force_n=LOAD_N, pressure_mbar=READING).between(3.0, 9.0)])
    assert (found.faults, found.refusals) == ((), ())


@pytest.mark.parametrize(
    ("name", "reading"),
    [
        ("pressure_ohm", 900.0 / (1.0 + 9.0 * TRIANGLE)),
        ("pressure_mm", 20.0 + 5.0 * TRIANGLE + 0.1 * TIME_S),
        ("pressure_mbar", 300.0 + READING),
        ("pressure_mbar", READING + 40.0 * np.exp(-TIME_S / 30.0)),
    ],
    ids=["falls with load", "never returns", "far from zero", "starts loaded"],
)
def test_a_sensor_that_is_merely_another_has_no_fault(name: str, reading: Array) -> None:
    noise = 5e-4 * np.ptp(reading) * np.random.default_rng(2).standard_normal(TIME_S.size)
    found = examine([_recording(force_n=LOAD_N, **{name: reading + noise})])
    assert (found.faults, found.refusals) == ((), ())


def test_a_reading_that_goes_on_while_the_load_stands_is_told_as_such() -> None:
    """A cell that one current empties for an hour: of its load's integral, or of a drift, one level tells nothing."""
    time_s = np.arange(0.0, 6000.0, 2.0)
    load_n = np.where((time_s > 600.0) & (time_s < 4200.0), 30.0, 0.0)
    used = np.cumsum(load_n) / np.sum(load_n)
    pressure = 420.0 - 100.0 * used - 20.0 * used**8 - 0.1 * load_n + 8.0 * (time_s > 4200.0)
    pressure += 0.05 * np.random.default_rng(1).standard_normal(time_s.size)
    found = examine([Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=pressure)])
    assert [fault.kind for fault in found.faults] == ["does_not_follow_load"]
    assert "the reading goes on while the load stands" in found.refusals[0]
    assert "integral" in found.refusals[0]
    assert "unit that was pressed" not in found.refusals[0]


@pytest.mark.parametrize("seed", range(3))
def test_a_walk_beside_a_load_that_moves_does_not_go_on_while_it_stands(seed: int) -> None:
    walk = np.cumsum(np.random.default_rng(seed).standard_normal(TIME_S.size))
    found = examine([_recording(force_n=LOAD_N, pressure_mbar=walk)])
    assert all("goes on while the load stands" not in said for said in found.refusals)


@pytest.mark.parametrize("unit_suffix", ["kg", "kgf"])
def test_a_load_cell_as_the_sensor_is_asked_for_by_its_arrays_name(unit_suffix: str) -> None:
    """The advice can be followed as it stands; who has a file chooses its column."""
    rng = np.random.default_rng(1)
    kilograms = LOAD_N / 9.81 + 0.01 * rng.standard_normal(LOAD_N.size)
    given_ = _recording(force_n=LOAD_N, **{f"cell_{unit_suffix}": kilograms})
    (said,) = examine([given_]).refusals
    assert said.endswith("; an array is named pressure and its unit, as in pressure_kgf=")
    named = said.rsplit(" ", 1)[1].removesuffix("=")
    assert examine([_recording(force_n=LOAD_N, **{named: kilograms})]).refusals == ()
    of_file = examine([replace(given_, source="log.csv")])
    assert of_file.refusals[0].endswith("name its column with --sensor (columns: cell)")
