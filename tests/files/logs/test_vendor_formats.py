"""LabVIEW, TDMS, MATLAB and HDF5: round trips, dialects, and files that are refused."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import smartshoe
from smartshoe.errors import FormatError, InputError
from smartshoe.recording import Recording

ENDINGS = ("lvm", "tdms", "mat", "h5", "parquet")
number = st.floats(-1e9, 1e9, allow_subnormal=False) | st.just(float("nan"))
word = st.from_regex(r"[A-Za-z][A-Za-z0-9._]{0,11}[A-Za-z0-9]", fullmatch=True)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    count = draw(st.integers(2, 12))
    steps = draw(st.lists(st.floats(1e-3, 2.0), min_size=count, max_size=count))

    def signal() -> NDArray[np.float64]:
        # One sample at least is there: a channel without any is dropped on purpose.
        return np.array([draw(st.floats(-1e6, 1e6)), *draw(st.lists(number, min_size=count - 1, max_size=count - 1))])

    metadata = draw(st.dictionaries(word.map(lambda key: f"key {key}"), word, max_size=3))
    return Recording.from_arrays(
        time_s=np.cumsum(steps),
        force_n=signal(),
        pressure_mbar=signal(),
        displacement_mm=signal(),
        name=draw(word),
        unit=draw(st.none() | st.just("left_toe")),
        metadata=metadata,
    )


@pytest.mark.parametrize("ending", ENDINGS)
@settings(max_examples=15)
@given(recording=recordings())
def test_what_is_written_is_read_back_exactly(ending: str, recording: Recording) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x.{ending}"
        smartshoe.write(recording, path)
        again = smartshoe.read(path)
    assert again.name == recording.name
    assert again.unit == recording.unit
    assert dict(again.metadata) == dict(recording.metadata)
    np.testing.assert_array_equal(again.time_s, recording.time_s)
    assert list(again.channels) == list(recording.channels)
    for name, channel in recording.channels.items():
        np.testing.assert_array_equal(again[name].with_nan(), channel.with_nan())
        assert again[name].unit == channel.unit
        assert again[name].role == channel.role


def test_hdf5_opens_in_xarray(tmp_path: Path) -> None:
    import xarray

    recording = Recording.from_arrays(time_s=[0, 0.5, 1.0], force_n=[0, 1, 2], pressure_mbar=[0, np.nan, 1])
    smartshoe.write(recording, tmp_path / "x.h5")
    with xarray.open_dataset(tmp_path / "x.h5", engine="h5netcdf", decode_timedelta=False) as dataset:
        np.testing.assert_array_equal(dataset["time"].values, [0, 0.5, 1.0])
        np.testing.assert_array_equal(dataset["pressure"].values, [0, np.nan, 1])
        assert dataset["force"].attrs["units"] == "N"


def test_parquet_opens_in_pandas_and_one_of_pandas_is_read(tmp_path: Path) -> None:
    recording = Recording.from_arrays(time_s=[0, 0.5, 1.0], force_n=[0, 1, 2], pressure_mbar=[0, np.nan, 1])
    smartshoe.write(recording, tmp_path / "x.parquet")
    frame = pd.read_parquet(tmp_path / "x.parquet")
    assert list(frame) == ["time_s", "force_n", "pressure_mbar"]
    assert frame["pressure_mbar"].isna().tolist() == [False, True, False]
    frame.assign(says="a word").to_parquet(tmp_path / "y.parquet")
    again = smartshoe.read(tmp_path / "y.parquet")
    np.testing.assert_array_equal(again.sensor.with_nan(), recording.sensor.with_nan())
    plain = pd.DataFrame({"time_s": [0.0, 1.0], "force_n": [1.0, 2.0], "left_toe_kpa": [3, 4], "says": ["a", "b"]})
    plain.to_parquet(tmp_path / "z.parquet")
    foreign = smartshoe.read(tmp_path / "z.parquet")
    assert foreign.sensor.name == "left_toe"
    assert foreign.sensor.si.tolist() == [3000.0, 4000.0]
    assert any("says" in note for note in foreign.notes)


HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t{version}\nSeparator\tTab\n{mark}X_Columns\t{x}\n"
    "***End_of_Header***\t\n\t\n"
)
LVM = {
    "version 0.92, no declared mark, X No, comma in Time": (
        HEAD.format(version="0.92", mark="", x="No")
        + "Channels\t2\t\t\nTime\t09:18:17,725441\t09:18:17,725441\t\nY_Unit_Label\tNewtons\tVolts\t\n"
        "X0\t0.5\t0.5\t\nDelta_X\t0.25\t0.25\t\n***End_of_Header***\t\t\t\nX_Value\tLoad\tP\tComment\n"
        "\t1.5\t0.1\n\t2.5\t0.2\n\t3.5\t0.3\n"
    ),
    "version 2, decimal comma, X One, comments, empty cells": (
        HEAD.format(version="2", mark="Decimal_Separator\t,\n", x="One")
        + "Channels\t2\t\t\nY_Unit_Label\tN\tV\t\nX0\t0,0E+0\t0,0E+0\t\nDelta_X\t0,25\t0,25\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tLoad\tP\tComment\n0,5\t1,5\t0,1\tOK\n0,75\t2,5\t\n1,0\t3,5\t0,3\tLOST\n"
    ),
    "version 2, decimal point, X Multi, long fractions of a second": (
        HEAD.format(version="2", mark="Decimal_Separator\t.\n", x="Multi")
        + "Channels\t2\t\t\t\t\nTime\t10:45:47.0352557312499836422\t\t10:45:47.0352557312499836422\t\t\n"
        "Y_Unit_Label\tN\t\tV\t\t\nX0\t0.5\t\t0.5\t\t\nDelta_X\t0.25\t\t0.25\t\t\n***End_of_Header***\t\t\t\t\t\n"
        "X_Value\tLoad\tX_Value\tP\tComment\n5.0E-1\t1.5\t5.0E-1\t0.1\n0.75\t2.5\t0.75\t0.2\n1.0\t3.5\t1.0\t0.3\n\n"
    ),
}


@pytest.mark.parametrize("dialect", LVM)
def test_lvm_dialects_give_the_same_numbers(dialect: str, tmp_path: Path) -> None:
    path = tmp_path / "x.lvm"
    path.write_text(LVM[dialect])
    recording = smartshoe.read(path)
    np.testing.assert_allclose(recording.time_s, [0.5, 0.75, 1.0])
    np.testing.assert_allclose(recording.force_n, [1.5, 2.5, 3.5])
    other = next(c for c in recording.channels.values() if c.role != "load")
    expected = [0.1, np.nan if "empty" in dialect else 0.2, 0.3]
    np.testing.assert_allclose(other.with_nan(), expected)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("2.5\t0.2", "2,5\t0.2", "mixed"),
        ("2.5\t0.2", "x\t0.2", r"line 15.*'x'"),
        ("Channels\t2", "Channels\ttwo", "how many channels"),
        ("X_Value\tLoad\tP\tComment", "X_Value\tLoad\tComment", "column names"),
        ("***End_of_Header***\t\n", "", "header"),
        ("Delta_X\t0.25\t0.25", "Delta_X\t0.25\t0.5", "sample times"),
    ],
)
def test_lvm_faults_name_the_line_or_the_key(old: str, new: str, says: str, tmp_path: Path) -> None:
    text = next(iter(LVM.values()))
    assert old in text
    path = tmp_path / "x.lvm"
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=says):
        smartshoe.read(path)


@pytest.mark.parametrize("ending", ["tdms", "mat", "h5", "parquet"])
def test_truncated_files_are_refused_by_name_and_nothing_else_is_said(
    ending: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rng = np.random.default_rng(0)
    whole = tmp_path / f"x.{ending}"
    values = rng.normal(size=5000)
    smartshoe.write(Recording.from_arrays(time_s=np.arange(5000.0), force_n=values, pressure_mbar=values), whole)
    raw = whole.read_bytes()
    for keep in (40, len(raw) // 3):
        cut = tmp_path / f"cut{keep}.{ending}"
        cut.write_bytes(raw[:keep])
        with pytest.raises(InputError, match=cut.name):
            smartshoe.read(cut)
    assert not caplog.records


def test_pickles_are_never_opened(tmp_path: Path) -> None:
    import pickle

    path = tmp_path / "x.mat"
    path.write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(FormatError):
        smartshoe.read(path)


@pytest.mark.real_data
def test_the_real_lvm_and_tdms_files_give_the_numbers_in_them(measured: Path) -> None:
    folder = measured / "formats"
    short = smartshoe.read(folder / "lvm" / "short.lvm")
    np.testing.assert_allclose(short.time_s[:2], [0, 3.906250e-5])
    assert short.force_n[0] == 0.914018
    assert len(short) == 10
    assert len(smartshoe.read(folder / "lvm" / "long_single_header_multi_ch.lvm")) == 16384
    multi = smartshoe.read(folder / "lvm" / "multi_time_column.lvm")
    assert multi["Acceleration"].values[2] == 0.467541
    plain = smartshoe.read(folder / "lvm" / "no_decimal_separator.lvm")
    assert plain["az"].values.tolist() == [0.021503, -0.005606, 0.007789, -0.009433]
    comments = smartshoe.read(folder / "lvm" / "with_comments.lvm")
    assert comments.time_s[-1] == 9.723275
    assert "LOST COMMUNICATION" in comments.metadata["comments"]
    empty = smartshoe.read(folder / "lvm" / "with_empty_fields.lvm")
    assert empty["Dev0/Ai2"].values[2] == 7.250977
    digital = smartshoe.read(folder / "tdms" / "Digital_Input.tdms")
    assert len(digital) == 20000
    from nptdms import TdmsFile

    for path in sorted((folder / "tdms").glob("*.tdms")):
        recording = smartshoe.read(path)
        raw = {c.name: c[:] for group in TdmsFile.read(path).groups() for c in group.channels()}
        for name, channel in recording.channels.items():
            if name in raw and len(raw[name]) == len(recording):
                np.testing.assert_array_equal(channel.values, np.asarray(raw[name], dtype=float))
