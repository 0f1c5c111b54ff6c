"""What insoles and motion laboratories export: loadsol, OpenGo, OpenSim."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import smartshoe
from smartshoe.cli import run_command
from smartshoe.errors import FormatError

LOADSOL = (
    "loadapp_2024.loadflux\ncomment walk\n"
    "\tA-L::heel\tA-L::medial\tA-L::lateral\tA-L\t\tB-R::heel\tB-R\t\n"
    "Time[secs]\tForce[N]\tForce[N]\tForce[N]\tForce[N]\tTime[secs]\tForce[N]\tForce[N]\t\n"
)


def loadsol(tmp_path: Path, rows: list[str]) -> Path:
    path = tmp_path / "walk.txt"
    path.write_text(LOADSOL + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def row(time_s: float, heel: float = 10.0, total: float = 30.0) -> str:
    return f"{time_s:.3f}\t{heel}\t10.0\t10.0\t{total}\t{time_s:.3f}\t20.0\t20.0\t"


def test_loadsol_gives_each_foot_s_zones_as_units(tmp_path: Path) -> None:
    found = smartshoe.read(loadsol(tmp_path, [row(0.005 * k) for k in range(10)]))
    assert [channel.name for channel in found.sensors] == ["left_heel", "left_meta1", "left_meta4", "right_heel"]
    assert found["left_total"].role == "auxiliary"
    assert found.sample_rate_hz == pytest.approx(200.0)
    assert found.metadata["comment"] == "walk"


def test_loadsol_s_lost_packets_are_missing_not_minus_one(tmp_path: Path) -> None:
    rows = [row(0.005 * k) for k in range(10)]
    rows[4] = "0.020\t-1.000\t-1.000\t-1.000\t0.000\t0.020\t20.0\t20.0\t"
    found = smartshoe.read(loadsol(tmp_path, rows))
    for name in ("left_heel", "left_meta4", "left_total"):
        assert found[name].present.tolist() == [k != 4 for k in range(10)]
    assert found["right_heel"].present.all()
    assert any("1 sample of the left insole did not arrive" in note for note in found.notes)


def test_loadsol_s_rounded_times_are_put_even_and_a_real_gap_is_told(tmp_path: Path) -> None:
    times = [0.005 * k for k in range(40)]
    times[20] = times[21]
    found = smartshoe.read(loadsol(tmp_path, [row(time_s) for time_s in times]))
    np.testing.assert_allclose(np.diff(found.time_s), 0.005, rtol=1e-9)
    times = [0.005 * k + (1.0 if k > 20 else 0.0) for k in range(40)]
    assert smartshoe.read(loadsol(tmp_path, [row(time_s) for time_s in times])).duration_s == pytest.approx(1.195)


def test_a_cell_that_is_no_number_is_told_with_its_line(tmp_path: Path) -> None:
    rows = [row(0.0), row(0.005).replace("10.0", "ten", 1)]
    with pytest.raises(FormatError, match=r"line 6: 'ten' is no number"):
        smartshoe.read(loadsol(tmp_path, rows))


def test_opengo_s_pressures_are_pascals_and_empty_cells_missing(tmp_path: Path) -> None:
    path = tmp_path / "walk.txt"
    path.write_text(
        "# Duration: 00:01\n# Sensor insoles: Left SN1, Right SN2\n"
        "# time\tleft pressure 1[N/cm²]\tleft total force[N]\tright total force[N]\tleft steps[]\n"
        "0.00\t2.5\t300.0\t\t\n0.01\t2.5\t310.0\t1.0\t11\n",
        encoding="utf-8",
    )
    found = smartshoe.read(path)
    np.testing.assert_allclose(found["left_pressure_1"].si, 25_000.0)
    assert found["left_total"].si.tolist() == [300.0, 310.0]
    assert found["right_total"].present.tolist() == [False, True]
    assert found.metadata["sensor_insoles"] == "Left SN1, Right SN2"


MOT = "name grf\ndatacolumns 3\ndatarows {rows}\nendheader\n\n\ttime\tR_ground_force_vy\tR_ground_force_px\n{body}"


def test_opensim_s_forces_have_units_and_none_is_a_load_unasked(tmp_path: Path) -> None:
    path = tmp_path / "grf.mot"
    path.write_text(MOT.format(rows=2, body="0.0 1.0 0.1\n0.01 2.0 0.1\n"), encoding="utf-8")
    found = smartshoe.read(path)
    assert found["R_ground_force_vy"].unit.symbol == "N"
    assert not found.of_role("load")
    assert smartshoe.read(path, force="R_ground_force_vy").force_n.tolist() == [1.0, 2.0]


def test_opensim_s_short_row_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "grf.mot"
    path.write_text(MOT.format(rows=2, body="0.0 1.0 0.1\n0.01 2.0\n"), encoding="utf-8")
    with pytest.raises(FormatError, match="line 8: 2 numbers stand under 3 names"):
        smartshoe.read(path)


def test_gait_is_told_which_column_is_which_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time_s = np.arange(0, 12, 0.01)
    step = np.clip(np.sin(2 * np.pi * time_s / 1.1), 0, None) * 500
    other = np.clip(np.sin(2 * np.pi * time_s / 1.1 + np.pi), 0, None) * 500
    path = tmp_path / "grf.mot"
    body = "".join(f"{t:.3f} {a:.3f} {b:.3f}\n" for t, a, b in zip(time_s, step, other, strict=True))
    text = MOT.format(rows=time_s.size, body=body).replace("R_ground_force_px", "L_ground_force_vy")
    path.write_text(text, encoding="utf-8")
    named = ["--sensor", "right_heel=R_ground_force_vy", "--sensor", "left_heel=L_ground_force_vy"]
    assert run_command(["gait", str(path), *named]) == 0
    assert "stride time (s)" in capsys.readouterr().out
    assert run_command(["gait", str(path), "--sensor", "right_heel=nothing"]) == 3
    assert "nothing" in capsys.readouterr().err
    assert run_command(["gait", str(path), "--sensor", "R_ground_force_vy"]) == 2
    assert "left_heel=" in capsys.readouterr().err


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("name", "samples", "rate_hz"),
    [
        ("insoles/loadsol_test_poids.txt", 1094, 200.0),
        ("insoles/loadsol_roll_test.txt", 7903, 200.0),
        ("insoles/loadsol_test_pointe_1_05_02.txt", 6836, 200.0),
        ("insoles/opengo_fast.txt", 1007, 100.0),
        ("grf_walking_running/grf_run.mot", 246, 300.0),
    ],
)
def test_files_of_the_makers_are_read(measured: Path, name: str, samples: int, rate_hz: float) -> None:
    path = measured / name
    if not path.is_file():
        pytest.skip(f"{name} is not there")
    found = smartshoe.read(path)
    assert len(found) == samples
    assert found.sample_rate_hz == pytest.approx(rate_hz, rel=1e-3)
