"""Delimited text of unknown origin: delimiter, header, units, odd numbers, and the measured files."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import smartshoe
from smartshoe.errors import FormatError, InputError


def text(tmp_path: Path, content: str, name: str = "log.csv", encoding: str = "utf-8") -> Path:
    path = tmp_path / name
    path.write_bytes(content.encode(encoding))
    return path


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    delimiter=st.sampled_from(["\t", ";", ",", "  "]),
    decimal=st.sampled_from([".", ","]),
    header=st.sampled_from(["Time[s]|Force (N)|P_bar", "t_s|F/N|p [bar]", "t|F|P\ns|N|bar", ""]),
    newline=st.sampled_from(["\n", "\r\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    values=st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=2, max_size=12),
)
def test_every_layout_reads_to_the_numbers_written(
    tmp_path: Path, delimiter, decimal, header, newline, encoding, values
) -> None:
    if delimiter == "," and decimal == ",":
        decimal = "."
    if delimiter == "  ":
        header = header.replace(" ", "")
    rows = [(0.5 * index + 0.25, force, pressure) for index, (force, pressure) in enumerate(values)]
    lines = header.replace("|", delimiter).split("\n") if header else []
    lines += [delimiter.join(repr(cell).replace(".", decimal) for cell in row) for row in rows]
    path = text(tmp_path, newline.join(lines) + newline, encoding=encoding)
    choices = {} if header else {"time": "1[s]", "force": "2[N]", "sensors": ["3[bar]"]}
    recording = smartshoe.read(path, **choices)
    assert recording.time_s.tolist() == [row[0] for row in rows]
    assert recording.force_n.tolist() == [row[1] for row in rows]
    assert recording.sensor.values.tolist() == [row[2] for row in rows]
    assert (recording.sensor.name, recording.sensor.unit.symbol) == ("pressure", "bar")


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(count=st.integers(2, 30), at=st.data(), decimal=st.sampled_from([".", ","]))
def test_one_cell_with_the_other_decimal_mark_refuses_the_file(tmp_path: Path, count, at, decimal) -> None:
    row = at.draw(st.integers(0, count - 1))
    other = "," if decimal == "." else "."
    lines = [f"{index}{other if index == row else decimal}5;1" for index in range(count)]
    path = text(tmp_path, "Time (s);Load (N)\n" + "\n".join(lines))
    with pytest.raises(FormatError, match=rf"inconsistent.*\b(lines? [0-9, ]*)?{row + 2}\b"):
        smartshoe.read(path)


@pytest.mark.parametrize("header", ["t[s],F[N],P[bar],T,H", "t[s],F[N],P[bar],T,H,", ""])
@pytest.mark.parametrize("tail", [",,", ",,,", ",2,", ",2,3", ",2,3,"])
def test_empty_cells_at_the_end_of_rows_are_of_columns_that_the_first_row_has(
    tmp_path: Path, header: str, tail: str
) -> None:
    """As of sensors that are read now and then: neither the header nor a full row is taken for a remark."""
    lines = [header] if header else []
    lines += ["0,1,2,3,4", *(f"{k},{k + 1},{k + 2}{tail}" for k in range(1, 9))]
    choices = {} if header else {"time": "1[s]", "force": "2[N]", "sensors": ["3[bar]"]}
    found = smartshoe.read(text(tmp_path, "\n".join(lines)), **choices)
    assert found.time_s.tolist() == list(range(9))
    assert found.sensor.values.tolist() == list(range(2, 11))


@pytest.mark.parametrize("header", ["t[s];F[N];P[bar]", "t[s];F[N];P[bar];", ""])
def test_rows_that_end_with_a_delimiter_have_no_cell_more(tmp_path: Path, header: str) -> None:
    rows = [f"{k};{k + 1};{k + 2};" for k in range(5)]
    choices = {} if header else {"time": "1[s]", "force": "2[N]", "sensors": ["3[bar]"]}
    found = smartshoe.read(text(tmp_path, "\n".join([header, *rows])), **choices)
    assert found.sensor.values.tolist() == list(range(2, 7))
    assert sorted(found.channels) == ["force", "pressure"]


def test_points_as_thousands_and_decimal_mark(tmp_path: Path) -> None:
    rows = "999.000;3.658;7.315\r\n1.002.000;3.657;7.314\r\n1.102.000;3.657;7.313"
    recording = smartshoe.read(text(tmp_path, rows), time="1[ms]", sensors=["3[bar]"])
    assert recording.time_s.tolist() == [0.999, 1.002, 1.102]
    assert recording.sensor.values.tolist() == [7.315, 7.314, 7.313]
    assert any("1002.000" in note for note in recording.notes)


@pytest.mark.parametrize(
    "cell", ["1.00.000", "1.002.000,5", "0.998.000", "1..2", "12:30:01"], ids=["group", "both", "falls", "two", "clock"]
)
def test_other_readings_of_several_points_are_refused(tmp_path: Path, cell: str) -> None:
    path = text(tmp_path, f"999.000;3.6\n{cell};3.6\n1.102.000;3.6\n")
    with pytest.raises(FormatError, match=r"line 2\b|lines (1, )?2, 3\b"):
        smartshoe.read(path, time="1[ms]", sensors=["2[bar]"])


def test_lines_above_a_table_become_metadata(tmp_path: Path) -> None:
    forces = "[Force Data]\nNumberOfForcePlates=1\nSampleRate=450.0\n#Sample\tFX1\tFY1\n1\t0.0\t5.0\n2\t0.5\t6.0\n"
    recording = smartshoe.read(text(tmp_path, forces, "walk.forces"), time="#Sample[s]", force="FY1[N]")
    assert recording.metadata["SampleRate"] == "450.0"
    assert recording.force_n.tolist() == [5.0, 6.0]
    motion = "name C:\\run.mot\ndatacolumns 2\nendheader\n\n     time\t  vy\n  0.0\t  1.0\n  0.5\t  2.0\n"
    recording = smartshoe.read(text(tmp_path, motion, "run.mot"), time="time[s]", force="vy[N]")
    assert dict(recording.metadata) == {"name": "C:\\run.mot", "datacolumns": "2"}
    assert recording.force_n.tolist() == [1.0, 2.0]


def test_a_plain_table_with_semicolons_keeps_its_remarks(tmp_path: Path) -> None:
    content = "# unit: heel\n# continues: one\ntime_ms;force_n;pressure_mbar\n0;0,5;1\n10;0,5;1\n"
    recording = smartshoe.read(text(tmp_path, content))
    assert (recording.unit, dict(recording.metadata)) == ("heel", {"continues": "one"})
    assert recording.time_s.tolist() == [0.0, 0.01]


cells = st.text(max_size=4) | st.sampled_from(
    ["0", "1", "2.5", "3,5", "1.000.000", "", "(s)", "(N)", "Time", "time_s", '"', "#", ":", "nan"]
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(st.lists(cells, max_size=4), max_size=8),
    delimiter=st.sampled_from([",", ";", "\t", " "]),
    tail=st.binary(max_size=3),
)
def test_any_bytes_are_read_or_refused(tmp_path: Path, rows, delimiter, tail) -> None:
    path = tmp_path / "any.csv"
    path.write_bytes("\n".join(delimiter.join(row) for row in rows).encode() + tail)
    for choices in ({}, {"time": "1[s]", "force": "2[N]"}):
        refusal = None
        try:
            assert len(smartshoe.read(path, **choices)) > 0
        except InputError as error:
            refusal = str(error)
        assert refusal is None or "any.csv" in refusal


def test_text_columns_are_left_out_with_a_note(tmp_path: Path) -> None:
    recording = smartshoe.read(text(tmp_path, "Time[s],Load[N],Operator\n0,1,Ann\n1,2,Ann\n"))
    assert list(recording.channels) == ["force"]
    assert "Operator" in recording.notes[0]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("header", ["Time|Load|Sensor", "Time[s]|Load (N)|Sensor", "", "Time|Load|Sensor\ns|N|kPa"])
def test_units_in_the_cells_are_the_columns(tmp_path: Path, delimiter: str, header: str) -> None:
    rows = [f"{0.02 * row:.2f} s|{row * 12.5} N|" + (f"{row / 8}kPa" if row != 3 else "") for row in range(9)]
    content = "\n".join([*([header] if header else []), *rows]).replace("|", delimiter)
    recording = smartshoe.read(text(tmp_path, content))
    assert recording.sample_time_s == pytest.approx(0.02)
    assert recording.force_n.tolist() == [row * 12.5 for row in range(9)]
    assert recording.sensor.unit.symbol == "kPa"
    assert np.flatnonzero(np.isnan(recording.sensor.with_nan())).tolist() == [3]


def test_units_in_cells_with_a_decimal_comma(tmp_path: Path) -> None:
    recording = smartshoe.read(text(tmp_path, "Zeit;Kraft;Temp\n0,5 s;1,25 kN;20,5 °C\n1,5 s;2,5 kN;21 °C\n"))
    assert recording.time_s.tolist() == [0.5, 1.5]
    assert recording.force_n.tolist() == [1250.0, 2500.0]
    assert recording["Temp"].values.tolist() == [20.5, 21.0]


FAULTS = {
    "Time,Load\n0 s,900 mN\n1 s,1.1 N\n": "line 3: '1.1 N' in column Load is not in mN as the cells above",
    "Time,Load\n0 s,900 N\n1 s,901\n": "line 3: '901' in column Load is not in N as the cells above",
    "Time,Load[kN]\n0 s,900 N\n1 s,901 N\n": "line 2: '900 N' stands in column Load, which is in kN by its header",
    "row,P_bar\n0,1.5\n1,1.6\n": "no column that is time",
    "Time,Load[N]\n0,1.5\n1,1.6\n": r"gives column 'Time' no unit.*'Time\[s\]'",
    "1;2;3\n4;5;6\n": r"--time '1\[ms\]'",
    "Time[s];Load[N]\n": "no table|no data rows",
    "once upon a time\nthere was a shoe, with\nair in it\n": "no table",
    "Time[s];Load[N]\n0;1\n1;2\n2\n": "line 4 has 1 cells",
    "Time[s];Load[N]\n0;1\n;2\n": "line 3 has no time",
}


@pytest.mark.parametrize("content", FAULTS)
def test_faults_say_what_would_mend_them(tmp_path: Path, content: str) -> None:
    with pytest.raises(InputError, match=FAULTS[content]):
        smartshoe.read(text(tmp_path, content))


# -- the measured files --------------------------------------------------------------------------------------
@pytest.mark.real_data
@pytest.mark.parametrize("name", ["Circle_1bar", "Circle_3bar", "Circle_7bar", "KDN_5bar", "rerun_3_O-ring257_5bar"])
def test_friction_files(measured: Path, name: str) -> None:
    path = measured / "pneumatic_actuator_friction_leak" / "friction" / f"{name}.csv"
    recording = smartshoe.read(path, time="1[ms]", force="7[N]", sensors=["6[bar]"])
    raw = np.loadtxt(path)
    assert recording.time_s.tolist() == (raw[:, 0] / 1000.0).tolist()
    assert recording.force_n.tolist() == raw[:, 6].tolist()
    assert recording.sensor.values.tolist() == raw[:, 5].tolist()
    moved = smartshoe.read(path, time="1[ms]", force="7[N]", sensors=["5[mm]"])
    assert (moved.sensor.name, moved.sensor.unit.symbol) == ("sensor", "mm")


@pytest.mark.real_data
def test_leak_files(measured: Path) -> None:
    folder = measured / "pneumatic_actuator_friction_leak" / "leak"
    spans = {"Aluminium": 151.303, "Formlabs": 142.508, "Prusa": 143.696, "Ultimaker_015": 143.863}
    for name, last_s in spans.items():
        recording = smartshoe.read(folder / f"{name}.csv", time="1[ms]", sensors=["3[bar]"])
        assert (recording.time_s[0], recording.time_s[-1]) == (0.0, last_s)
        assert 0.09 < recording.sample_time_s < 0.11
    summary = smartshoe.read(folder / "Resultaten_opnieuwaanzetten.csv", sensors=["Test 2[mbar]"])
    assert (summary.time_s[-1], summary.sensor.values[-1], len(summary)) == (135.6, -24.0, 1356 + 1)


@pytest.mark.real_data
def test_damper_insole_and_force_plate_files(measured: Path) -> None:
    damper = smartshoe.read(measured / "mr_damper" / "ensaio.B.5.csv", force="force[N]", sensors=["position[mm]"])
    assert (damper.force_n[0], damper.sensor.values[0]) == (-28.003023792886566, -7.44)
    insole = smartshoe.read(
        measured / "insole_plenum" / "calibration_dataset_C.csv", sensors=["mean_active_taxels_counts"]
    )
    assert (insole.sensor.unit.symbol, len(insole)) == ("counts", 25435)
    forces = measured / "grf_walking_running"
    assert smartshoe.read(forces / "jump1.txt").force_n.max() > 1000.0
    run = smartshoe.read(forces / "grf_run.mot", time="time[s]", force="R_ground_force_vy[N]")
    assert (len(run), round(float(run.force_n.max()))) == (246, 1751)
    walk = smartshoe.read(forces / "walk1.forces", time="1[s]", force="FY3[N]")
    assert (walk.metadata["SampleRate"], round(float(walk.force_n.max()))) == ("450.000000", 836)
    with pytest.raises(InputError, match="line 4: time goes back"):
        smartshoe.read(measured / "formats" / "eplexor_xls" / "time_user_raw.csv")
