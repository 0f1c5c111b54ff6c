"""What is said of a calibration beside recordings: forces, rates and pasts that it has not seen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.cli import run_command


def test_a_calibration_of_a_unit_that_gives_less_is_noticed_by_its_forces(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.json"
    assert run_command(["identify", str(table), "--calibration", str(own)]) == 0
    capsys.readouterr()
    assert run_command(["validate", str(table), "--calibration", str(own)]) == 0
    assert run_command(["compensate", str(table), "--calibration", str(own)]) == 0
    told = capsys.readouterr()
    assert "makes it worse" not in told.out
    assert "warning" not in told.err

    header, *rows = table.read_text().splitlines()
    doubled = [",".join([*row.split(",")[:2], str(2.0 * float(row.split(",")[2]))]) for row in rows]
    other = tmp_path / "other.csv"
    other.write_text("\n".join([header, *doubled]))
    assert run_command(["validate", str(other), "--calibration", str(own)]) == 0
    assert "makes it worse" in capsys.readouterr().out
    assert run_command(["compensate", str(other), "--calibration", str(own)]) == 0
    assert "the calibration has seen" in capsys.readouterr().err


@pytest.mark.parametrize(("leak_per_s", "is_warned"), [(0.0, False), (0.01, True)])
def test_a_calibration_that_fits_by_a_past_which_no_later_use_has_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], leak_per_s: float, is_warned: bool
) -> None:
    """Of a leak a slow pole and a zero far off fit 98 %: used from rest it was off by more than half of the load."""
    time_s, step_s, knots_s, loads_n = 0.02 * np.arange(9000), 0.02, [0.0, 3.0], [0.0, 0.0]
    for ramp_s in (10.0, 10.0, 5.0, 5.0, 2.5, 2.5, 1.0, 1.0):
        knots_s += [knots_s[-1] + ramp_s, knots_s[-1] + 2 * ramp_s, knots_s[-1] + 2 * ramp_s + 3.0]
        loads_n += [400.0, 0.0, 0.0]
    knots_s += [knots_s[-1] + part_s for part_s in (5.0, 35.0, 40.0)]
    load_n = np.interp(time_s, knots_s, [*loads_n, 300.0, 300.0, 0.0])
    crept_n = lfilter([1.0 - math.exp(-step_s / 2.0)], [1.0, -math.exp(-step_s / 2.0)], load_n)
    reading = lfilter([1.0, -1.0], [1.0, -math.exp(-step_s * leak_per_s)], 0.185 * load_n + 0.015 * crept_n)
    noise = np.random.default_rng(3).normal(0.0, 0.05, (2, time_s.size))
    table, rows = tmp_path / "leaking.csv", np.column_stack([time_s, load_n + noise[0], reading + noise[1]])
    np.savetxt(table, rows, delimiter=",", header="time_s,force_n,pressure_mbar", comments="", fmt="%.6g")
    assert run_command(["identify", str(table), "--calibration", str(tmp_path / "c.json")]) == 0
    assert ("such as a leak or a drift" in capsys.readouterr().err) == is_warned


@pytest.mark.parametrize(("times", "is_warned"), [(1.5, False), (4.0, True)])
def test_a_load_that_rises_faster_than_any_in_the_calibration_is_noticed(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], times: float, is_warned: bool
) -> None:
    """A walk beside slow triangles: what the unit does so quickly, nobody has seen."""
    own, quick = tmp_path / "own.json", tmp_path / "quick.csv"
    assert run_command(["identify", str(table), "--calibration", str(own)]) == 0
    header, *rows = table.read_text().splitlines()
    split = [row.split(",", 1) for row in rows]
    quick.write_text("\n".join([header, *(f"{float(time_s) / times!r},{rest}" for time_s, rest in split)]))
    capsys.readouterr()
    assert run_command(["compensate", str(quick), "--calibration", str(own)]) == 0
    assert ("what the unit does at such rates is extrapolated" in capsys.readouterr().err) == is_warned
