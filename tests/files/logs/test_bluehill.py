"""Bluehill logs in every dialect: delimiter, decimal mark, quotes, preamble, language, encoding, line ends."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import smartshoe
from smartshoe.errors import FormatError, InputError
from smartshoe.files.logs.formats.bluehill import write_bluehill
from smartshoe.recording import Recording

FILES = Path(__file__).parent / "files"
COMMITTED = {
    "bluehill_de.csv": {"Probe : Bezeichnung": "linke Zehe", "Probe : Durchmesser": "71,5 mm"},
    "bluehill_pl_cp1250.csv": {"Próbka : Średnica": "71,5 mm"},
    "bluehill_zh_gb18030.csv": {},
    "bluehill_en_utf16.csv": {"Specimen : Label": "left toe"},
}


@pytest.mark.parametrize("name", COMMITTED)
def test_committed_dialects_read_to_the_same_numbers(name: str) -> None:
    recording = smartshoe.read(FILES / name)
    assert recording.time_s.tolist() == [0.0, 0.013, 0.1, 0.2, 0.3]
    np.testing.assert_allclose(recording.force_n, [0.0, 1.25, 12.5, 101.75, 204.5], rtol=1e-15)
    assert recording["displacement"].values.tolist() == [0.0, -0.0021, -0.015, -0.031, -0.044]
    assert recording.load.name == "force"
    assert COMMITTED[name].items() <= dict(recording.metadata).items()
    assert any("second one at t = 0 s" in note for note in recording.notes)
    assert any("sign was turned" in note for note in recording.notes)
    encoding = name.removesuffix(".csv").rsplit("_", 1)[1]
    assert any(encoding in note for note in recording.notes) == (encoding in ("cp1250", "gb18030"))


LANGUAGES = {
    "utf-8": [("Time", "Extension", "Load"), ("Czas", "Wydłużenie", "Obciążenie"), ("时间", "位移", "载荷")],
    "utf-8-sig": [("Zeit", "Weg", "Kraft (gemessen)"), ("Время", "Перемещение", "Нагрузка")],
    "utf-16": [("Temps", "Déplacement", "Force"), ("時間", "変位", "荷重")],
    "cp1250": [
        ("Czas", "Przemieszczenie", "Siła ściskająca"),
        ("Prüfzeit", "Weg", "Prüfkraft"),
        ("Čas", "Dráha", "Síla"),
    ],
    "gb18030": [("时间", "位移", "载荷"), ("测试时间", "压缩位移", "压缩载荷")],
}
dialects = st.sampled_from([(code, names) for code, all_names in LANGUAGES.items() for names in all_names])


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    dialect=dialects,
    delimiter=st.sampled_from([",", ";", "\t"]),
    decimal=st.sampled_from([".", ","]),
    quoted=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    preamble=st.integers(0, 24),
    loads=st.lists(st.floats(0.0, 2000.0, allow_subnormal=False), min_size=2, max_size=20),
    first_step=st.floats(0.001, 0.009),
)
def test_every_dialect_reads_to_the_numbers_written(
    tmp_path: Path, dialect, delimiter, decimal, quoted, newline, preamble, loads, first_step
) -> None:
    encoding, names = dialect
    quoted = quoted or delimiter == decimal  # otherwise no reader could tell the cells apart
    time_s = np.array([0.0, *(first_step + 0.01 * np.arange(len(loads) - 1))])
    load_n = np.array(loads)
    original = Recording.from_arrays(time_s=time_s, displacement_mm=-load_n / 700.0, force_n=load_n)
    path = tmp_path / "Specimen_RawData_1.csv"
    entries = [(f"Section : entry {index}", f"value {index}", "mm") for index in range(preamble)]
    write_bluehill(
        original, path, delimiter=delimiter, decimal=decimal, encoding=encoding, quoted=quoted, newline=newline,
        preamble=entries, names=names,
    )  # fmt: skip
    again = smartshoe.read(path)
    assert again.time_s.tolist() == original.time_s.tolist()
    assert again.force_n.tolist() == load_n.tolist()
    assert again["displacement"].values.tolist() == original["displacement"].values.tolist()
    assert dict(again.metadata) == {key: f"{value} {unit}" for key, value, unit in entries}


HEADER = "Time;Extension;Load\n(s);(mm);(N)\n"


def log(tmp_path: Path, rows: str, header: str = HEADER) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(header + rows, encoding="utf-8")
    return path


FAULTS = {
    "0,0;0,0;1,5\n0,1;0,0;1.5\n0,2;0,0;1,5\n": r"a point in line 4, a comma in lines 3, 4, 5",
    "0.0;0.0;1.5\n0.1;0.0;1,5\n": r"a point in lines 3, 4, a comma in line 4",
    "0;0;1,234\n1;0;2,345\n": r"lines 3, 4 may mark thousands or decimals",
    "0,5;0;1.234,5\n1,5;0;1,234.5\n": r"thousands and decimal marks cannot be told apart",
    "0;0;1.5\n1;0;abc\n": r"line 4: 'abc' in column Load is no number",
    "0;0;1.5\n1;0;12:30\n": r"line 4: '12:30'",
    "0;0;1\n1;0\n": r"line 4 has 2 cells where 3",
    "0;0;1\n1;0;1;7\n": r"line 4 has 4 cells where 3",
    "0;0;1\n1;0;1\n1;0;2\n": r"line 5: time repeats \(1 s, then 1 s\)",
    "0;0;1\n0;0;1\n1;0;1\n0,5;0;2\n": r"line 6: time goes back",
    "": "no data rows",
}


@pytest.mark.parametrize("rows", FAULTS)
def test_contradictions_are_refused_with_their_lines(tmp_path: Path, rows: str) -> None:
    with pytest.raises(InputError, match=FAULTS[rows]):
        smartshoe.read(log(tmp_path, rows))


def test_thousands_marks_are_read_where_they_are_certain(tmp_path: Path) -> None:
    recording = smartshoe.read(log(tmp_path, "0,0;0;1.234,5\n0,1;0;1.734,25\n0,2;0;900,5\n"))
    assert recording.force_n.tolist() == [1234.5, 1734.25, 900.5]
    assert any("thousands" in note for note in recording.notes)


def test_tension_and_symmetric_loads_keep_their_sign(tmp_path: Path) -> None:
    recording = smartshoe.read(log(tmp_path, "0;0;-90\n1;0;100\n2;0;-80\n"))
    assert recording.force_n.tolist() == [-90.0, 100.0, -80.0]


def test_empty_cells_and_extra_columns(tmp_path: Path) -> None:
    header = "Time;Extension;Load;Strain 1;Cycle;\n(s);(mm);(kN);(%);;\n"
    recording = smartshoe.read(log(tmp_path, "0;0;1;0,5;1;\n1;;1;0,25;1;\n", header))
    assert recording["displacement"].present.tolist() == [True, False]
    assert recording["Strain 1"].unit.symbol == "%"
    assert recording["Cycle"].values.tolist() == [1.0, 1.0]
    assert recording.force_n.tolist() == [1000.0, 1000.0]


def test_binary_zeros_inside_text_are_refused(tmp_path: Path) -> None:
    path = log(tmp_path, "0;0;1\n" * 1)
    path.write_bytes(path.read_bytes() + b"1;0;1\n" * 20000 + b"\x00\x00")
    with pytest.raises(FormatError, match="binary zeros"):
        smartshoe.read(path)


def test_remarks_of_a_plain_table_above_an_export_say_what_they_say_there(tmp_path: Path) -> None:
    path = tmp_path / "second.csv"
    path.write_text("# continues: first: half\n# unit: heel\nProbe,17\nTime,Load\n(s),(kN)\n0,0.1\n1,0.2\n2,0.1\n")
    recording = smartshoe.read(path)
    assert recording.unit == "heel"
    assert dict(recording.metadata) == {"Probe": "17", "continues": "first: half"}
