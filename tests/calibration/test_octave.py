"""MATLAB's files opened by Octave: the filters check themselves, a recording becomes an iddata."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import smartshoe
from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.export import export_shoe, write_files
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

pytestmark = pytest.mark.skipif(shutil.which("octave") is None, reason="no octave on the path")

TOE = Calibration(0.215, 1.593, 0.3249, MILLIBAR, offset=1.5, unit="left_toe", load_range_n=(0.0, 800.0))
LEAKING = extended_calibration(
    ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
    .with_part(effect("linear_leak"), np.array([0.004]))
    .with_part(effect("load_cell_tare"), np.array([0.01])),
    unit="left_heel",
)
SCRIPT = """
left_toe_test; left_heel_test;
r = load('trial.mat');
fprintf('%.17g ', r.time_s(3), r.force_n(3), sum(isnan(r.pressure_mbar)));
fprintf('%.17g ', left_toe(r.pressure_mbar)(3), left_heel(r.pressure_mbar)(3));
try
  pkg load control
  z = iddata(r.force_n, r.pressure_mbar, r.time_s(2) - r.time_s(1));
  fprintf('iddata %.17g %.17g %.17g', z.y(3), z.u(3), z.tsam{1});
catch
  fprintf('no iddata');
end
"""


def test_octave_runs_the_filters_and_reads_a_recording(tmp_path: Path) -> None:
    write_files(export_shoe([TOE, LEAKING], "matlab"), tmp_path)
    time_s = np.arange(50) * 0.01
    readings = 40.0 + 7.0 * np.sin(time_s * 9.0)
    readings[10] = np.nan
    trial = Recording.from_arrays(time_s=time_s, force_n=np.sqrt(time_s) * 100.0, pressure_mbar=readings)
    smartshoe.write(trial, tmp_path / "trial.mat")
    done = subprocess.run(
        ["octave", "--no-gui", "--quiet", "--eval", SCRIPT], cwd=tmp_path, capture_output=True, text=True, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *checks, numbers = done.stdout.strip().splitlines()
    assert len(checks) == 2
    assert all(line.startswith("passed") for line in checks)
    words = numbers.split()
    at = words.index("iddata")
    values, made = [float(word) for word in words[:5]], words[at + 1 :]
    force_n = trial.force_n[2]
    assert values[:3] == [time_s[2], force_n, 1.0]
    expected_n = [one.compensator().apply(readings)[2] for one in (TOE, LEAKING)]
    assert values[3:] == pytest.approx(expected_n, rel=1e-12)
    if words[at - 1] != "no":  # Octave's package control is there
        assert [float(word) for word in made] == [force_n, readings[2], time_s[1]]
