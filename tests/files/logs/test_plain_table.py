"""The plain table: exact round trip, and one sentence with the line for everything that does not fit."""

import bz2
import gzip
import io
import lzma
import os
import re
import string
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import smartshoe
from smartshoe.errors import FormatError, InputError, MissingChannelError, UnitError, UsageError
from smartshoe.files.logs.accepted import recording_of
from smartshoe.recording import Channel, Recording
from smartshoe.units import declared, unit

finite = st.floats(-1e30, 1e30)  # beyond it a number is no measurement and is refused
texts = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=12)  # a terminal obeys Cc
keys = texts.filter(lambda key: key not in ("name", "unit", "note") and not key.startswith("role "))
names = st.text(string.ascii_lowercase, min_size=1, max_size=6)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    count = draw(st.integers(1, 12))
    time_s = np.array(draw(st.lists(finite, min_size=count, max_size=count, unique=True)))
    time_s = np.unique(time_s + 0.0)
    count = time_s.size
    channels = {}
    for name in draw(
        st.lists(st.one_of(names, st.sampled_from(["force", "pressure", "toe"])), max_size=4, unique=True)
    ):
        values = np.array(draw(st.lists(finite, min_size=count, max_size=count)))
        missing = np.array(draw(st.lists(st.booleans(), min_size=count, max_size=count)))
        missing[draw(st.integers(0, count - 1))] = False
        in_unit = draw(
            st.sampled_from(["N", "kN", "mbar", "V", "mm", "°C", "counts"]).map(unit)
            | st.sampled_from(["fF", "Lux", "lux / s", "a_n"]).map(declared)  # as a header or `--sensor 'C[fF]'` has it
        )
        role = draw(st.sampled_from(["load", "sensor", "command", "auxiliary"]))
        if role == "load" and any(channel.role == "load" for channel in channels.values()):
            role = "auxiliary"
        if name != "time":
            channels[name] = Channel.from_values(name, np.where(missing, np.nan, values), in_unit, role)
    return Recording(
        time_s,
        channels,
        name=draw(texts),
        unit=draw(st.none() | texts),
        metadata=draw(st.dictionaries(keys, texts, max_size=3)),
        notes=tuple(draw(st.lists(texts, max_size=2))),
    )


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(recording=recordings())
def test_round_trip_is_bit_exact(tmp_path: Path, recording: Recording) -> None:
    path = tmp_path / "table.csv"
    smartshoe.write(recording, path)
    again = smartshoe.read(path)
    assert again.time_s.tobytes() == recording.time_s.tobytes()
    assert (again.name, again.unit, again.notes) == (recording.name or "table", recording.unit, recording.notes)
    assert dict(again.metadata) == dict(recording.metadata)
    assert list(again.channels) == list(recording.channels)
    for name, channel in recording.channels.items():
        other = again[name]
        assert other.values.tobytes() == channel.values.tobytes()
        assert (other.unit, other.role) == (channel.unit, channel.role)
        assert np.array_equal(other.present, channel.present)


def table(tmp_path: Path, text: str, name: str = "walk.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def test_remarks_and_roles(tmp_path: Path) -> None:
    path = table(
        tmp_path,
        "# unit: left_toe\r\n# continues: first walk\r\n"
        "time_s,force_n,command_n,pressure_v,temperature_c,force_estimate_n\r\n"
        "0,1,2,3,4,5\r\n0.1,1,2,3,,5\r\n",
    )
    recording = smartshoe.read(path)
    assert (recording.unit, recording.name) == ("left_toe", "walk")
    assert recording.metadata["continues"] == "first walk"
    assert [c.role for c in recording.channels.values()] == ["load", "command", "sensor", "auxiliary", "auxiliary"]
    assert recording.load.name == "force"
    assert recording["temperature"].present.tolist() == [True, False]


def test_forces_of_a_shoe_are_sensors_not_the_load(tmp_path: Path) -> None:
    recording = smartshoe.read(table(tmp_path, "time_s,left_heel_n,left_toe_n\n0,1,2\n1,1,2\n"))
    assert [channel.name for channel in recording.sensors] == ["left_heel", "left_toe"]
    with pytest.raises(MissingChannelError, match="--force"):
        _ = recording.load


def test_choices_override_names(tmp_path: Path) -> None:
    path = table(tmp_path, "time_s,force_n,other_kn,pressure_mbar,stroke_mm\n0,1,2,3,4\n1,1,2,3,4\n")
    recording = smartshoe.read(path, force="other_kn", sensors=["stroke"])
    assert recording.force_n.tolist() == [2000.0, 2000.0]
    assert (recording.sensor.name, recording.sensor.unit.symbol) == ("stroke", "mm")


FAULTS = {
    "": "is empty",
    "\n\n": "is empty",
    "time_s,force_n\n": "no data rows",
    "# name: x\n": "no header row",
    "time_s,force_n\n0,1\n1,abc\n": r"line 3: 'abc' in column force_n",
    "time_s,force_n\n\n0,1\n\n1,abc\n": r"line 5: 'abc'",
    "# a: b\ntime_s,force_n\n0,1\n1\n": r"line 4 has 1 cells where the header names 2",
    "time_s,force_n,pressure_mbar\n0,1,2\n1,2\n2,3,4\n": r"line 3 has 2 cells",
    "time_s,force_n\n0,1\n1,2,3\n": r"line 3 has 3 cells",
    "time_s,force_n\n0,1\n0.5,2\n0.5,3\n": r"line 4: time repeats \(0.5 s, then 0.5 s\)",
    "time_s,force_n\n0,1\n0,2\n1,2\n1,3\n2,2\n2,3\n": r"line 3: time repeats .*as in 2 more: .*'rows\[2.5Hz\]'",
    "time_s,force_n\n2,1\n1,2\n0,2\n": r"line 3: time goes back \(2 s, then 1 s\), as in 1 more: [^']*rows$",
    "time_s,force_n\n\n0,1\n0.5,2\n0.25,3\n": r"line 5: time goes back \(0.5 s, then 0.25 s\)",
    "time_s,force_n\n0,1\n,2\n": r"line 3 has no time",
    "time_s,force_n\n0,1\n2,2\n1,3\n3,4\n": r"line 4: time goes back \(2 s, then 1 s\): [^']*that row$",
    "time_s,force_n\n0,1\n2,2\n1,3\n1.5,4\n2.5,4\n": r"line 4: time goes back .*that row and those after it$",
    "time_s,force_n\n0,\n1,\n": r"line 2: every sample of column 'force' is missing",
    "time_s,force_n,force_n\n0,1,1\n": r"line 1 names column 'force_n' twice",
    "time_s,force_n\n0,1\n1,1_0\n": r"line 3: '1_0'",
    "force_n,pressure_mbar\n0,1\n1,2\n": "no column that is time",
}


@pytest.mark.parametrize("text", FAULTS)
def test_faults_name_file_and_line(tmp_path: Path, text: str) -> None:
    path = table(tmp_path, text)
    with pytest.raises(InputError, match=FAULTS[text]) as error:
        smartshoe.read(path)
    assert "walk.csv" in str(error.value)
    assert "\n" not in str(error.value)
    assert error.value.exit_status == 3


@pytest.mark.parametrize(
    ("title", "newtons"),
    [("Force (kgf)", 9.80665), ("Force [kN]", 1e3), ("Load (lbf)", 4.4482216152605), ('"Force, N"', 1.0)],
)
def test_a_unit_in_brackets_or_after_a_comma_holds_beside_the_tables_own_titles(
    tmp_path: Path, title: str, newtons: float
) -> None:
    path = table(tmp_path, f"time_s,{title},pressure_mbar\n0,0,1\n1,2,3\n2,4,5\n")
    bare = title.strip('"')
    for force in (None, bare, "2"):
        assert smartshoe.read(path, force=force).force_n == pytest.approx(newtons * np.array([0.0, 2.0, 4.0]))
    framed = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], bare: [0.0, 2.0, 4.0], "pressure_mbar": [1.0, 3.0, 5.0]})
    assert recording_of(framed).force_n == pytest.approx(newtons * np.array([0.0, 2.0, 4.0]))
    with pytest.raises(UnitError, match="by the file, --force says daN: leave the unit out"):
        smartshoe.read(path, force=f"{bare}[daN]")


@pytest.mark.parametrize("title", ["Force (peak)", "Sensor (1)", "Sensor, left"])
def test_what_else_stands_in_brackets_is_of_the_name(tmp_path: Path, title: str) -> None:
    path = table(tmp_path, f'time_s,"{title}",pressure_mbar\n0,0,1\n1,2,3\n')
    assert list(smartshoe.read(path).channels) == [title, "pressure"]


def test_missing_runs_and_infinities_become_missing_samples(tmp_path: Path) -> None:
    recording = smartshoe.read(table(tmp_path, "time_s,force_n\n0,nan\n1,NaN\n2,5\n3,\n4,inf\n"))
    assert recording.load.present.tolist() == [False, False, True, False, False]
    assert np.isfinite(recording.force_n).all()
    assert "infinite" in recording.notes[0]


def test_places_that_hold_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder"):
        smartshoe.read(tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        smartshoe.read(tmp_path / "absent.csv")
    path = tmp_path / "binary.csv"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(FormatError, match="binary"):
        smartshoe.read(path)


def _zipped(text: bytes) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        archive.writestr("table.csv", text)
    return held.getvalue()


@pytest.mark.parametrize(
    ("pack", "says"),
    [
        (gzip.compress, "packed by gzip: unpack it (gunzip)"),
        (bz2.compress, "packed by bzip2: unpack it (bunzip2)"),
        (lzma.compress, "packed by xz: unpack it (unxz)"),
        (_zipped, "a zip archive or a workbook: unpack it and name a file of it, or export the sheet as CSV"),
    ],
)
@pytest.mark.parametrize("name", ["table.csv.packed", "table.csv"])
def test_a_packed_table_is_to_be_unpacked(tmp_path: Path, pack: Callable[[bytes], bytes], says: str, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(pack(b"time_s,force_n,pressure_mbar\n0,0,0\n1,1,1\n"))
    with pytest.raises(FormatError, match=f"^{re.escape(f'{path} is {says}')}$"):
        smartshoe.read(path)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_no_permission(tmp_path: Path) -> None:
    path = table(tmp_path, "time_s,force_n\n0,1\n")
    path.chmod(0)
    with pytest.raises(InputError, match="check its permissions"):
        smartshoe.read(path)


def test_a_cell_beyond_every_measure_is_refused(tmp_path: Path) -> None:
    path = table(tmp_path, 'time_s;force_n\n0;1\n1;"' + "9" * 200_000 + '"\n')
    with pytest.raises(FormatError, match=r"walk\.csv"):
        smartshoe.read(path)


def test_a_refused_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recording.from_arrays(time_s=[0.0, 1.0], force_n=[1.0, 2.0])
    with pytest.raises(UsageError, match=r"\.csv"):
        smartshoe.write(recording, tmp_path / "out.docx")
    path = table(tmp_path, "old")

    def full_disk(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pandas.DataFrame.to_csv", full_disk)
    with pytest.raises(UsageError, match="No space left"):
        smartshoe.write(recording, path)
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk.csv"]


@pytest.mark.parametrize("moment", ["2024-01-01T10:00:00.{}0", "10:00:00.{}"])
def test_dates_beside_the_time_are_left_out_with_a_note(tmp_path: Path, moment: str) -> None:
    rows = [f"{moment.format(k) if k != 1 else ''},{k / 10},{k},{2 * k}" for k in range(5)]
    (tmp_path / "a.csv").write_text("\n".join(["timestamp,time_s,force_n,pressure_mbar", *rows]) + "\n")
    found = smartshoe.read(tmp_path / "a.csv")
    assert found.time_s.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert list(found.channels) == ["force", "pressure"]
    assert any("timestamp" in note for note in found.notes)


def test_a_time_that_is_a_date_is_refused_where_seconds_are_promised(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,force_n\n2024-01-01T10:00:00,1\n2024-01-01T10:00:01,2\n")
    with pytest.raises(FormatError, match="line 2"):
        smartshoe.read(tmp_path / "a.csv")


def test_a_remark_that_is_called_as_a_column_of_a_foreign_unit_is_kept(tmp_path: Path) -> None:
    time_s = 0.01 * np.arange(5)
    capacitance = Channel.from_values("cap", np.arange(5.0), declared("fF"), "sensor")
    written = Recording(time_s, {"cap": capacitance}, "a", metadata={"cap_ff": "of plates"})
    smartshoe.write(written, tmp_path / "a.csv")
    found = smartshoe.read(tmp_path / "a.csv")
    assert (found.metadata["cap_ff"], found["cap"].unit.symbol) == ("of plates", "fF")
    assert "unit cap_ff" not in found.metadata


def test_cells_in_quotes_may_hold_decimal_commas(tmp_path: Path) -> None:
    """As spreadsheets export them; a quote without its second one is a fault of its line alone."""
    path = tmp_path / "x.csv"
    rows = ["time_s,force_n,pressure_mbar", *(f'"{k},0","{k},25","{2 * k},5"' for k in range(6))]
    path.write_text("\n".join([*rows[:3], '"2,0,"2,25","4,5"', *rows[4:]]))
    with pytest.raises(FormatError, match="line 4"):
        smartshoe.read(path)
    path.write_text("\n".join(rows))
    recording = smartshoe.read(path)
    np.testing.assert_array_equal(recording["force"].values, np.arange(6) + 0.25)
    np.testing.assert_array_equal(recording["pressure"].values, 2.0 * np.arange(6) + 0.5)
