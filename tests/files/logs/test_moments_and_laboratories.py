"""Dates as time, C3D and pedar, loads whose sign or samples are off: what people have, and what is said of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import smartshoe
from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.errors import FormatError, InputError, MissingChannelError
from smartshoe.files.logs._moments import is_moment, midnights, seconds_of
from smartshoe.units import MILLIBAR


def table(path: Path, header: str, rows: list[str]) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@given(st.lists(st.integers(0, 10**12), min_size=2, max_size=20, unique=True))
def test_dates_are_seconds_since_the_first_to_a_nanosecond(nanoseconds: list[int]) -> None:
    start = np.datetime64("2026-05-01T10:00:00", "ns")
    cells = [f"{start + np.timedelta64(ns, 'ns')}Z" for ns in nanoseconds]
    assert all(is_moment(cell) for cell in cells)
    found, _ = seconds_of(Path("x.csv"), "t", cells, range(2, 2 + len(cells)))
    np.testing.assert_allclose(found, (np.array(nanoseconds) - nanoseconds[0]) / 1e9, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "cells",
    [
        ["2026-05-01T10:00:00.00", "2026-05-01T10:00:00.01", "2026-05-01T10:00:00.02"],
        ["2026-05-01 23:59:59.99+02:00", "2026-05-02 00:00:00.00+02:00", "2026-05-02 00:00:00.01+02:00"],
        ["9:59:59.990", "10:00:00.000", "10:00:00.010"],
    ],
)
@pytest.mark.parametrize("header", ["when,Load (N),P (mbar)", None])
def test_a_column_of_dates_is_the_time(tmp_path: Path, cells: list[str], header: str | None) -> None:
    rows = [f"{cell},{10 * k}.5,{k}.25" for k, cell in enumerate(cells)]
    path = tmp_path / "iso.csv"
    path.write_text("\n".join(([header] if header else []) + rows) + "\n", encoding="utf-8")
    found = smartshoe.read(
        path, force="2[N]" if header is None else None, sensors=["3[mbar]"] if header is None else ()
    )
    np.testing.assert_allclose(found.time_s, [0.0, 0.01, 0.02], atol=1e-9)
    np.testing.assert_array_equal(found.force_n, [0.5, 10.5, 20.5])
    assert cells[0] in found.metadata.values()


@given(st.integers(0, 86399), st.lists(st.integers(1, 1_700_000), min_size=1, max_size=120), st.data())
def test_times_of_day_go_on_past_every_midnight(first_s: int, steps_ms: list[int], data: st.DataObject) -> None:
    """Whatever lies between two rows, up to nearly an hour, and whichever cells are empty."""
    since_ms = np.cumsum([0, *steps_ms])
    of_day_s = ((1000 * first_s + since_ms) % 86_400_000 - 1000 * first_s) / 1e3
    odd = data.draw(st.sets(st.integers(0, since_ms.size // 2 - 1)))
    of_day_s[[2 * k + 1 for k in odd]] = np.nan
    for row in midnights(of_day_s):
        of_day_s[row:] += 86_400.0
    there = np.isfinite(of_day_s)
    np.testing.assert_allclose(of_day_s[there], since_ms[there] / 1e3, atol=1e-6)


def _of_day(tmp_path: Path, *cells: str) -> Path:
    return table(tmp_path / "night.csv", "Time,Load (N),P (mbar)", [f"{c},{k}.5,{k}.25" for k, c in enumerate(cells)])


def test_midnight_is_noted_with_its_line(tmp_path: Path) -> None:
    found = smartshoe.read(_of_day(tmp_path, "23:59:59.980", "23:59:59.990", "00:00:00.000", "00:00:00.010"))
    np.testing.assert_allclose(found.time_s, [0.0, 0.01, 0.02, 0.03], atol=1e-9)
    assert "Column Time passes midnight at line 4: what follows is the next day." in found.notes


@pytest.mark.parametrize(
    "cells",
    [
        ["23:59:58", "23:59:59", "22:00:00", "22:00:01"],  # set back by two hours
        ["23:59:57", "23:59:58", "00:00:00", "23:59:59"],  # one row is off
        ["12:00:00", "12:00:01", "12:00:00", "12:00:02"],
        ["2026-05-02 23:59:58", "2026-05-02 23:59:59", "2026-05-02 00:00:00", "2026-05-02 00:00:01"],  # has a date
    ],
)
def test_a_clock_that_really_goes_back_is_an_error(tmp_path: Path, cells: list[str]) -> None:
    with pytest.raises(InputError, match="time goes back"):
        smartshoe.read(_of_day(tmp_path, *cells))


def test_a_cell_of_another_kind_among_dates_is_told_with_its_line(tmp_path: Path) -> None:
    rows = [f"2026-05-01T10:00:0{k},{k},{k}" for k in range(4)]
    rows[2] = "2026-05-01T10:00:02Z,2,2"
    with pytest.raises(FormatError, match=r"line 4: .* is no time like"):
        smartshoe.read(table(tmp_path / "a.csv", "when,Load (N),P (mbar)", rows))


def test_errors_that_list_columns_list_ten(tmp_path: Path) -> None:
    path = table(tmp_path / "wide.csv", ",".join(f"chan {k}" for k in range(30)), [",".join(["1"] * 30)] * 3)
    with pytest.raises(MissingChannelError, match=r"chan 9 and 20 more"):
        smartshoe.read(path, time="rows[100Hz]", force="chan 99[N]")


def test_following_the_advice_on_rows_leads_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = table(tmp_path / "wide.csv", "a,b,c", ["1,2,3"] * 3)
    assert run_command(["convert", str(path), str(tmp_path / "x.csv"), "--time", "rows[100Hz]", "--force", "z[N]"]) == 3
    assert "no column 'z' for --force" in capsys.readouterr().err


def test_a_negated_load_is_named_and_a_minus_turns_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{0.01 * k:.2f},{-5.0 * k},{0.5 * k}" for k in range(20)]
    path = table(tmp_path / "negated.csv", "time_s,force_n,pressure_mbar", rows)
    out = tmp_path / "out.csv"
    assert run_command(["convert", str(path), str(out)]) == 0
    assert "compression is positive here" in capsys.readouterr().err
    assert run_command(["convert", str(path), str(out), "--force", "-force_n"]) == 0
    assert "compression" not in capsys.readouterr().err
    np.testing.assert_array_equal(smartshoe.read(out).force_n, 5.0 * np.arange(20))


def test_many_missing_samples_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{0.01 * k:.2f},{5.0 * k},{'' if k % 3 else 0.5 * k}" for k in range(30)]
    path = table(tmp_path / "holes.csv", "time_s,force_n,pressure_mbar", rows)
    assert run_command(["convert", str(path), str(tmp_path / "out.csv")]) == 0
    assert "lacks 67 % of the samples of pressure" in capsys.readouterr().err


def test_what_is_said_of_missing_readings_holds_for_compensate_as_well(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """There they are held at the last value; from fits they are left out."""
    rows = [f"{0.01 * k:.2f},{5.0 * k},{'' if k % 3 else 0.5 * k}" for k in range(30)]
    path = table(tmp_path / "holes.csv", "time_s,force_n,pressure_mbar", rows)
    Calibration(0.215, 1.593, 0.3249, MILLIBAR).save(tmp_path / "c.json")
    assert run_command(["compensate", str(path), "--calibration", str(tmp_path / "c.json")]) == 0
    said = capsys.readouterr().err
    assert "lacks 67 % of the samples of pressure: in fits they do not count" in said
    assert "20 missing readings of pressure were held at the last value" in said
    assert "left out" not in said


def test_convert_writes_the_contract_s_columns_and_keeps_every_line_above(tmp_path: Path) -> None:
    path = tmp_path / "kn.csv"
    above = "# operator: Anna\n# remark first\n# remark second\n"
    path.write_text(above + "Time (s),Load (kN),P (MPa)\n0.00,0.5,0.25\n0.01,0.75,0.5\n", encoding="utf-8")
    out = tmp_path / "out.csv"
    assert run_command(["convert", str(path), str(out)]) == 0
    text = out.read_text(encoding="utf-8")
    assert "time_s,force_n,pressure_mbar\n0.0,500.0,2500.0\n0.01,750.0,5000.0\n" in text
    assert all(word in text for word in ("operator: Anna", "first", "second"))


def test_a_pedar_export_gives_every_sensor_in_kpa(tmp_path: Path) -> None:
    above = ["file name:\twalk.sol", "insole: \tX - 1234", "total time [secs]: 2\ttime per pic [Hz]: 50", ""]
    names = "time[secs]\t" + "\t".join(str(k % 99 + 1) for k in range(198))
    rows = ["\t".join([f"{0.02 * k:.3f}", *(str(float(n + k)) for n in range(198))]) for k in range(5)]
    found = smartshoe.read(table(tmp_path / "walk.asc", "\n".join([*above, names]), rows))
    assert len(found.channels) == 198
    assert found["left_1"].unit.symbol == "kPa"
    assert found["right_99"].values[0] == 197.0
    assert found.sample_rate_hz == pytest.approx(50.0)
    with pytest.raises(FormatError, match="has 3 numbers"):
        smartshoe.read(table(tmp_path / "cut.asc", "\n".join([*above, names]), ["0.0\t1\t2"]))


def test_what_was_written_as_c3d_is_read_again(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    made["parameters"]["ANALOG"]["RATE"]["value"] = [100.0]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = ["left_heel", "Fz1"]
    made["parameters"]["ANALOG"]["UNITS"]["value"] = ["N", "N"]
    made["data"]["analogs"] = np.array([np.arange(50.0), 2.0 * np.arange(50.0)])[None]
    made["data"]["points"] = np.zeros((4, 0, 50))
    for side, label, time_s in (("Left", "Foot Strike", 0.1), ("Left", "Foot Strike", 0.4), ("Right", "Foot Off", 0.2)):
        made.add_event([0.0, time_s], context=side, label=label)
    path = tmp_path / "trial.c3d"
    made.write(str(path))
    found = smartshoe.read(path)
    np.testing.assert_allclose(found["left_heel"].values, np.arange(50.0), atol=1e-3)
    assert found["left_heel"].role == "sensor"
    assert found.sample_rate_hz == pytest.approx(100.0)
    assert found.metadata["events Left Foot Strike"] == "0.1 0.4"
    assert found.metadata["events Right Foot Off"] == "0.2"


def test_a_file_that_only_begins_like_c3d_is_refused_in_a_sentence(tmp_path: Path) -> None:
    pytest.importorskip("ezc3d")
    path = tmp_path / "cut.c3d"
    path.write_bytes(b"\x02\x50" + bytes(600))
    with pytest.raises(FormatError):
        smartshoe.read(path)
