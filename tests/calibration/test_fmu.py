"""FMI 3.0 units: checked and simulated by FMPy, compiled without a warning, equal to the filter and to the twin."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_code import compiled, needs_compiler

from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.export import export_files, export_shoe, export_twins, write_files
from smartshoe.errors import UsageError
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (extra fmu)")
validate_fmu = pytest.importorskip("fmpy.validation").validate_fmu
pytestmark = needs_compiler

TOE = Calibration(0.215, 1.593, 0.3249, MILLIBAR, offset=1.5, unit="left_toe", load_range_n=(0.0, 800.0))
PLAY = extended_calibration(
    ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
    .with_part(effect("linear_leak"), np.array([0.004]))
    .with_part(effect("zero_offset"), np.array([0.02])),
    unit="left_heel",
)
STEP_S = 0.01


@contextmanager
def _instance(path: Path) -> Iterator[Any]:
    from fmpy.fmi3 import FMU3Slave

    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    unit = FMU3Slave(
        guid=description.guid, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier
    )
    unit.instantiate()
    unit.enterInitializationMode()
    yield unit
    unit.terminate()
    unit.freeInstance()


def _stepped(unit: Any, values: np.ndarray, first: int = 0) -> np.ndarray:
    """Outputs after steps of one sample each, the input set before each."""
    out = []
    for k, value in enumerate(values, start=first):
        unit.setFloat64([1], [float(value)])
        unit.doStep(currentCommunicationPoint=k * STEP_S, communicationStepSize=STEP_S)
        out.append(unit.getFloat64([2])[0])
    return np.array(out)


def _readings(n: int = 2000) -> np.ndarray:
    rng = np.random.default_rng(2)
    readings = 60.0 + 50.0 * np.sin(np.arange(n) / 70.0) + rng.normal(0.0, 0.3, n)
    readings[[5, 6, 900]] = np.nan
    return readings


@pytest.mark.parametrize("calibration", [TOE, PLAY], ids=["plain", "extended"])
def test_a_unit_is_valid_and_gives_the_filters_forces(calibration: Calibration, tmp_path: Path) -> None:
    (path,) = write_files(export_files(calibration, "fmu"), tmp_path)
    assert validate_fmu(str(path)) == []
    readings = _readings()
    expected_n = calibration.compensator().apply(readings)
    with _instance(path) as unit:
        unit.setFloat64([1], [readings[0]])
        assert unit.getFloat64([2])[0] == pytest.approx(expected_n[0], rel=1e-12)  # at the start, before any step
        unit.exitInitializationMode()
        forces_n = _stepped(unit, readings)
    assert np.max(np.abs(forces_n - expected_n)) <= 1e-12


def test_fmpy_simulates_it(tmp_path: Path) -> None:
    (path,) = write_files(export_files(TOE, "fmu"), tmp_path)
    time_s = np.arange(500) * STEP_S
    signal = np.array(list(zip(time_s, 50.0 + time_s**2, strict=True)), dtype=[("time", float), ("reading", float)])
    found = fmpy.simulate_fmu(
        str(path), input=signal, stop_time=5.0, output_interval=STEP_S, output=["reading", "force"]
    )  # fmt: skip
    # What FMPy records at a time is the step that ends there, with the input as it was at its beginning.
    expected_n = TOE.compensator().apply(found["reading"][1:])
    assert np.max(np.abs(found["force"][1:] - expected_n)) <= 1e-12
    assert found["force"][0] == expected_n[0]


def test_a_step_of_several_samples_holds_the_input_and_a_state_comes_back(tmp_path: Path) -> None:
    (path,) = write_files(export_files(TOE, "fmu"), tmp_path)
    expected_n = TOE.compensator().apply(np.repeat([10.0, 90.0], 7))
    with _instance(path) as unit:
        unit.exitInitializationMode()
        unit.setFloat64([1], [10.0])
        unit.doStep(0.0, 7 * STEP_S)
        assert unit.getFloat64([2])[0] == pytest.approx(expected_n[6], rel=1e-14)
        state = unit.getFMUState()
        later = []
        for _ in range(2):
            unit.setFloat64([1], [90.0])
            unit.doStep(7 * STEP_S, 6.5 * STEP_S)  # the seventh falls at half a sample before the end
            later.append(unit.getFloat64([2])[0])
            unit.setFMUState(state)
        unit.freeFMUState(state)
    assert later == [pytest.approx(expected_n[13], rel=1e-14)] * 2


@pytest.mark.parametrize("calibration", [TOE, PLAY], ids=["plain", "leak"])
def test_the_twin_is_the_unit_and_the_filter_undoes_it(calibration: Calibration, tmp_path: Path) -> None:
    (path,) = write_files(export_twins([calibration]), tmp_path)
    assert path.name == "smartshoe_twin.fmu"
    assert validate_fmu(str(path)) == []
    time_s = np.arange(3000) * STEP_S
    load_n = np.interp(time_s % 7.0, [0.0, 1.0, 3.0, 4.0, 5.0], [0.0, 800.0, 800.0, 100.0, 0.0])
    with _instance(path) as unit:
        unit.exitInitializationMode()
        readings = _stepped(unit, load_n)
    model = calibration.model()
    expected = model.reading(Conditions(time_s, load_n / model.full_scale_load_n, STEP_S))
    assert np.max(np.abs(readings - expected)) <= 1e-12 * np.max(expected)
    if calibration is PLAY:
        assert np.max(np.abs(calibration.compensator().apply(readings) - load_n)) < 1e-9


def test_a_twin_with_more_than_the_network_is_refused_by_name() -> None:
    bent = extended_calibration(PLAY.model().with_part(effect("orifice_leak"), np.array([0.001, 0.01])))
    with pytest.raises(UsageError, match="orifice_leak"):
        export_twins([bent])


def test_several_effects_that_no_twin_has_are_told_in_the_plural() -> None:
    bent = PLAY.model()
    for name, values in (("play_hysteresis", [0.02]), ("orifice_leak", [0.001, 0.01])):
        with pytest.raises(UsageError, match=f"{name}, which is not written"):
            export_twins([extended_calibration(PLAY.model().with_part(effect(name), np.array(values)))])
        bent = bent.with_part(effect(name), np.array(values))
    with pytest.raises(
        UsageError, match="has play_hysteresis, orifice_leak, which are not written forward in C: simul"
    ):
        export_twins([extended_calibration(bent)])


@pytest.mark.parametrize("make", [lambda: export_shoe([TOE, PLAY], "fmu"), lambda: export_twins([TOE, PLAY])])
def test_its_sources_compile_without_a_warning_and_hold_no_path(make: Any, tmp_path: Path) -> None:
    files = make()
    assert list(files) == ["left_toe.fmu", "left_heel.fmu"]
    assert make() == files
    for path in write_files(files, tmp_path):
        folder = tmp_path / path.stem
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        library = next(folder.glob("binaries/*/*"))
        assert str(Path.home()).encode() not in library.read_bytes()
        assert b"python" not in subprocess.run(["ldd", library], capture_output=True, check=True).stdout.lower()
        for source in folder.glob("sources/*.c"):
            compiled([source], folder / "out.o", "-c")


def test_another_units_token_is_refused(tmp_path: Path) -> None:
    from fmpy.fmi3 import FMU3Slave

    (path,) = write_files(export_files(TOE, "fmu"), tmp_path)
    unit = FMU3Slave(guid="another", unzipDirectory=fmpy.extract(str(path)), modelIdentifier="smartshoe_filter")
    with pytest.raises(Exception, match="Failed to instantiate"):
        unit.instantiate()


def test_it_says_where_it_comes_from(tmp_path: Path) -> None:
    (path,) = write_files(export_files(TOE, "fmu", sample_rate_hz=50.0), tmp_path)
    with zipfile.ZipFile(path) as archive:
        page = archive.read("documentation/index.html").decode()
        assert all(word in page for word in ("left_toe", "50.0 Hz", "a1 = 0.215 1/s", "mbar", "0 to 800 N"))
    assert fmpy.read_model_description(str(path)).coSimulation.fixedInternalStepSize == "0.02"


def test_without_a_compiler_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(UsageError, match=r"needs a C compiler.*--to c"):
        export_files(TOE, "fmu")
