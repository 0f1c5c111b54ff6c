"""What integrity says of measured files, each finding looked at by eye."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import smartshoe
from smartshoe.integrity import examine
from smartshoe.recording import Channel, Recording
from smartshoe.units import unit

pytestmark = pytest.mark.real_data


def insole(folder: Path, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (n,) of the insole, the plenum's pressure (n,) in bar row by row, the taxels (n, 280) in counts."""
    from scipy.io import loadmat

    session = loadmat(folder / "insole_plenum" / f"{name}.mat", squeeze_me=True, struct_as_record=False)["experiment"]
    pressure, log = np.asarray(session.P, float).ravel(), np.asarray(session.C, float)
    n = min(pressure.size, log.shape[0])
    return log[:n, 1] - log[0, 1], pressure[:n], log[:n, 2:]


def pressed(time_s: np.ndarray, pressure_bar: np.ndarray, counts: np.ndarray) -> Recording:
    """The plenum's pressure stands for the load: any scale does."""
    channels = {
        "force": Channel.from_values("force", 1000.0 * pressure_bar, unit("N"), "load"),
        "taxel": Channel.from_values("taxel", counts, unit("counts"), "sensor"),
    }
    return Recording(time_s, channels, "insole")


@pytest.mark.parametrize(
    ("name", "first_s", "last_s"),
    [
        ("calibration_dataset", 1.1, -1.9),
        ("experiment_Inf_15September_steps_1", 1.2, -1.5),
        ("validation_dataset_2", 2.7, -2.3),
    ],
)
def test_the_insole_and_its_plenum_run_on_two_clocks(measured: Path, name: str, first_s: float, last_s: float):
    time_s, pressure_bar, taxels = insole(measured, name)
    active = (taxels.std(axis=0) > 10) & ((taxels <= 0).mean(axis=0) < 0.001)
    found = examine([pressed(time_s, pressure_bar, taxels[:, active].mean(axis=1))])
    assert "two_clocks" in {fault.kind for fault in found.faults}
    half_s = 0.5 * time_s[-1]
    ends = found.clock_offset_s[0] + found.clock_rate[0] * half_s * np.array([-1.0, 1.0])
    assert ends == pytest.approx([first_s, last_s], abs=0.4)  # windows by eye: 0.2 s each
    assert found.refusals == ()


def test_taxels_that_saturate_repeat_frames_or_are_dead(measured: Path):
    time_s, pressure_bar, taxels = insole(measured, "experiment_3September_allTaxels_dynamic_pink_1_good")
    repeated = float((np.diff(taxels, axis=0) == 0.0).all(axis=1).mean())
    assert repeated > 0.3  # a third of the frames are the one before, whole
    dead = int(np.argmin(taxels.std(axis=0)))
    assert "constant" in examine([pressed(time_s, pressure_bar, taxels[:, dead])]).refusals[0]
    active = np.flatnonzero((taxels.std(axis=0) > 10) & ((taxels <= 0).mean(axis=0) < 0.001))
    kinds = {f.kind for f in examine([pressed(time_s, pressure_bar, taxels[:, int(active[active.size // 2])])]).faults}
    assert {"quantisation", "spikes"} <= kinds  # eight bits; spikes of the plenum's pressure
    time_s, pressure_bar, taxels = insole(measured, "validation_dataset_1")
    at_zero = (taxels <= 0).mean(axis=0)
    saturated = np.flatnonzero((at_zero > 0.05) & (at_zero < 0.9) & (taxels.std(axis=0) > 10))
    kinds = [{f.kind for f in examine([pressed(time_s, pressure_bar, taxels[:, int(k)])]).faults} for k in saturated]
    assert np.mean(["saturation" in k for k in kinds]) > 0.5


@pytest.mark.parametrize("name", ["Circle_1bar", "Circle_7bar", "KDN_5bar", "Stadium_3bar"])
@pytest.mark.parametrize("column", ["6[bar]", "5[mm]"])
def test_friction_is_no_fault_of_clocks(measured: Path, name: str, column: str):
    path = measured / "pneumatic_actuator_friction_leak" / "friction" / f"{name}.csv"
    found = examine([smartshoe.read(path, time="1[ms]", force="7[N]", sensors=[column])])
    assert {fault.kind for fault in found.faults} <= {"gaps", "spikes"}
    assert "gaps" in {fault.kind for fault in found.faults}
    assert found.usable[0].mean() > 0.99


def test_a_leak_without_a_load_is_refused(measured: Path):
    path = measured / "pneumatic_actuator_friction_leak" / "leak" / "Prusa.csv"
    found = examine([smartshoe.read(path, time="1[ms]", sensors=["3[bar]"])])
    assert "--force" in found.refusals[0]


@pytest.mark.parametrize("name", ["ensaio.A.1", "ensaio.B.5", "ensaio1.1", "ensaio10.2"])
def test_a_damper_has_no_faults(measured: Path, name: str):
    path = measured / "mr_damper" / f"{name}.csv"
    found = examine([smartshoe.read(path, force="force[N]", sensors=["velocity[mm/s]"])])
    assert (found.faults, found.refusals) == ((), ())
