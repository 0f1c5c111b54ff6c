"""Recordings: immutable, united, honest about what is missing."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.recording import Channel, Recording, split_column
from smartshoe.units import MILLIBAR, unit


def _recording(**more: object) -> Recording:
    return Recording.from_arrays(time_s=[0.0, 0.1, 0.2], force_n=[0.0, 1.0, 2.0], pressure_mbar=[0.0, 0.5, 1.0], **more)


def test_contract_names_give_roles_and_si() -> None:
    recording = _recording(command_n=[0, 1, 2], displacement_mm=[0, 0.1, 0.2], temperature_c=[20, 20, 21])
    assert recording.load.name == "force"
    assert recording.sensor.unit is MILLIBAR
    np.testing.assert_allclose(recording.pressure_pa, [0, 50, 100])
    np.testing.assert_allclose(recording.command_n, [0, 1, 2])
    assert recording["temperature"].si[0] == pytest.approx(293.15)
    assert recording["displacement"].role == "auxiliary"


def test_a_shoes_units_are_sensors_in_order() -> None:
    shoe = Recording.from_arrays(time_s=[0, 1], left_toe_mbar=[1, 2], left_heel_mbar=[3, 4])
    assert [channel.name for channel in shoe.sensors] == ["left_toe", "left_heel"]
    with pytest.raises(MissingChannelError, match="2 readings"):
        _ = shoe.sensor
    with pytest.raises(MissingChannelError, match="array force_"):
        _ = shoe.load


@pytest.mark.parametrize(
    ("time_s", "says"),
    [([0, 0.1, 0.1], "repeats at sample 3"), ([0, 0.2, 0.1], "goes back at sample 3"), ([0, np.nan, 1], "sample 2")],
)
def test_time_that_does_not_increase_is_refused(time_s: list[float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Recording.from_arrays(time_s=time_s, force_n=[0, 1, 2])


@pytest.mark.parametrize(
    "time_s",
    [
        np.arange(3).astype("datetime64[ms]"),
        np.arange(3).astype("timedelta64[ms]"),
        [np.datetime64(k, "s") for k in range(3)],
        np.arange(3) * 1j,
        [np.timedelta64(1, "s"), np.timedelta64(2, "s"), None],
        [datetime(2026, 5, 1), datetime(2026, 5, 2), 3.0],
        np.array([1.0, 2.0 + 1.0j, 3.0], dtype=object),
        np.array([1.0, np.complex128(2.0), 3.0], dtype=object),
        ["a", "b", "c"],
        ["1", "2", "3"],
        [1.0, b"2", 3.0],
        np.array([1.0, "2", None], dtype=object),
        None,
    ],
)
def test_time_that_is_no_number_of_seconds_is_refused(time_s: object) -> None:
    """numpy takes a date for so many nanoseconds."""
    with pytest.raises(InputError, match="walk: time_s: not all are real numbers"):
        Recording.from_arrays(time_s=time_s, force_n=np.ones(3), name="walk")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="channel force: not all are real numbers"):
        Recording.from_arrays(time_s=np.arange(3), force_n=time_s)  # type: ignore[arg-type]


def test_columns_of_other_libraries_are_numbers_whatever_their_dtype_is() -> None:
    """One of polars or torch has a dtype that is none of numpy's."""

    class Column:
        dtype = "Float64"

        def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray:
            return np.array([0.0, 1.0, 2.0])

    assert Recording.from_arrays(time_s=Column(), force_n=Column()).force_n.tolist() == [0.0, 1.0, 2.0]  # type: ignore[arg-type]


def test_a_column_without_a_unit_is_refused() -> None:
    with pytest.raises(UnitError, match="pressure"):
        Recording.from_arrays(time_s=[0, 1], pressure=[0, 1])


def test_whoever_gives_arrays_is_told_their_names_and_whoever_gives_a_file_its_option() -> None:
    bare = Recording.from_arrays(time_s=[0.0, 1.0], load_n=[1.0, 2.0], voltage_v=[1.0, 2.0])
    for of, array, option in (
        (lambda one: one.load, "name its array force_ and its unit, for example force_n=", "--force 'Load[N]'"),
        (lambda one: one.sensor, "its unit, for example pressure_v=", "for example --sensor 'load'"),
    ):
        with pytest.raises(MissingChannelError, match=array):
            of(bare)
        with pytest.raises(MissingChannelError, match=re.escape(option)):
            of(replace(bare, source="walk.csv"))


def test_arrays_are_copies_and_read_only() -> None:
    values = np.array([0.0, 1.0, 2.0])
    recording = Recording.from_arrays(time_s=[0, 1, 2], force_n=values)
    values[0] = 9.0
    assert recording.force_n[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        recording.load.values[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        recording.time_s[0] = 1.0


@given(st.lists(st.one_of(st.floats(-1e9, 1e9), st.just(float("nan"))), min_size=1, max_size=30))
def test_missing_samples_repeat_the_last_one_and_come_back_as_nan(values: list[float]) -> None:
    channel = Channel.from_values("pressure", values, MILLIBAR)
    assert np.isfinite(channel.values).all()
    np.testing.assert_array_equal(channel.with_nan(), values)
    last = None
    for given_, held in zip(values, channel.values, strict=True):
        if not np.isnan(given_):
            last = given_
        if last is not None:
            assert held == last


@given(
    st.lists(st.tuples(st.integers(-1000, 1000), st.booleans()), min_size=1, max_size=30),
    st.sampled_from([float, np.float32, int, object]),
)
def test_what_a_masked_array_hides_is_missing(samples: list[tuple[int, bool]], dtype: type) -> None:
    values, hidden = (list(column) for column in zip(*samples, strict=True))
    masked = np.ma.MaskedArray(np.array(values, dtype=dtype), mask=hidden)
    time_s = np.arange(len(values), dtype=float)
    made = Recording.from_arrays(time_s=time_s, force_n=masked, pressure_mbar=masked)
    for channel in made.channels.values():
        np.testing.assert_array_equal(channel.present, ~np.array(hidden))
        np.testing.assert_array_equal(channel.with_nan(), np.where(hidden, np.nan, values))


def test_a_time_that_a_mask_hides_is_missing() -> None:
    time_s = np.ma.MaskedArray([0.0, 1.0, 2.0], mask=[False, True, False])
    with pytest.raises(InputError, match="time of sample 2 is missing"):
        Recording.from_arrays(time_s=time_s, force_n=np.ones(3))
    with pytest.raises(InputError, match="time of sample 2 is missing"):
        Recording(time_s, {})


@pytest.mark.parametrize(
    ("column", "name", "symbol"),
    [("force_n", "force", "N"), ("left_meta1_mbar", "left_meta1", "mbar"), ("rate_n_per_s", "rate", "N/s")],
)
def test_columns_split_into_name_and_unit(column: str, name: str, symbol: str) -> None:
    assert split_column(column) == (name, unit(symbol))


@given(st.floats(20.0, 400.0), st.integers(500, 3000), st.sampled_from([0.0, 0.2]))
def test_sample_rate_is_that_of_the_logger_though_stamps_are_rounded_and_samples_lost(
    rate_hz: float, count: int, lost: float
) -> None:
    """To milliseconds: the median step of 300 Hz is one of 333 Hz."""
    time_s = np.round(np.arange(count) / rate_hz, 3)
    if lost:
        time_s = np.delete(time_s, slice(count // 3, count // 3 + int(lost * count)))
    recording = Recording.from_arrays(time_s=time_s, force_n=np.zeros(time_s.size))
    assert recording.sample_rate_hz == pytest.approx(rate_hz, rel=2e-3 * max(rate_hz / count, 0.5))


@given(st.integers(2, 50), st.floats(0.001, 10.0))
def test_sample_rate_is_that_of_the_grid(count: int, step: float) -> None:
    recording = Recording.from_arrays(time_s=np.arange(count) * step, force_n=np.zeros(count))
    assert recording.sample_rate_hz == pytest.approx(1.0 / step, rel=1e-9)
    assert recording.is_uniform


@pytest.mark.parametrize(
    ("columns", "role"),
    [
        ({"foil_ohm": [1.0, 2.0]}, "sensor"),
        ({"cell_v": [1.0, 2.0]}, "sensor"),
        ({"adc_counts": [1.0, 2.0]}, "sensor"),
        ({"crosshead_mm": [1.0, 2.0]}, "auxiliary"),
        ({"room_c": [1.0, 2.0]}, "auxiliary"),
        ({"temperature_c": [20.0, 21.0], "crosshead_mm": [0.0, 1.0], "cell_v": [1.0, 2.0]}, "sensor"),
        ({"foil_ohm": [1.0, 2.0], "cell_v": [1.0, 2.0]}, "auxiliary"),
        ({"pressure_mbar": [1.0, 2.0], "foil_ohm": [1.0, 2.0]}, "auxiliary"),
    ],
)
def test_a_single_array_beside_the_load_is_the_reading_as_in_a_file(columns: dict[str, list[float]], role: str) -> None:
    recording = Recording.from_arrays(time_s=[0.0, 1.0], force_n=[0.0, 1.0], **columns)
    assert recording.channels[split_column(list(columns)[-1])[0]].role == role
