"""The filter as an object of scipy and of python-control: the same forces, the same transfer function."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from smartshoe.calibration import Calibration
from smartshoe.calibration.export.systems import control_system, scipy_system
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

TOE = Calibration(0.215, 1.593, 0.3249, MILLIBAR, offset=1.5, unit="left_toe")


def test_scipy_simulates_the_same_forces() -> None:
    readings = 1.5 + np.concatenate([np.zeros(1), np.random.default_rng(1).normal(50.0, 5.0, 300)])
    _, forces_n = signal.dlsim(scipy_system(TOE, sample_rate_hz=50.0), readings - 1.5)
    assert np.allclose(forces_n[:, 0], TOE.compensator(50.0).apply(readings), rtol=0, atol=1e-10)


def test_both_libraries_give_the_papers_transfer_function() -> None:
    rad_s = np.array([0.01, 0.2, 3.0])
    expected = (TOE.b0 * 1j * rad_s + TOE.b1) / (1j * rad_s + TOE.a1)
    _, found = signal.freqresp(scipy_system(TOE, continuous=True), rad_s)
    assert np.allclose(found, expected, rtol=1e-12)
    with pytest.raises(UsageError, match="sample_rate_hz"):
        scipy_system(TOE, sample_rate_hz=50.0, continuous=True)


def test_python_control_has_the_same() -> None:
    pytest.importorskip("control", reason="python-control is not installed")
    plant, filter_ = control_system(TOE, continuous=True), control_system(TOE, sample_rate_hz=50.0)
    assert plant.dcgain() == pytest.approx(TOE.b1 / TOE.a1)
    assert filter_.dcgain() == pytest.approx(TOE.b1 / TOE.a1)
    assert filter_.dt == 0.02
    assert (list(filter_.input_labels), list(filter_.output_labels)) == (["reading"], ["force"])
