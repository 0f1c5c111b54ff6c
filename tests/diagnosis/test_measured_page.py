"""The commands of docs/measured_cases.md, run as they stand, against the page's tables and quoted sentences.

What the page tells is held whether it is right or wrong, so that the page cannot drift from the program. Figures agree
within what their last digits may hang on; of recordings whose causes do, no more is held than the page says of them.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import loadmat
from test_measured_cases import SENSORS, insole_of, plain_solid_percent, sensor_files

from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.diagnosis.decay import decay_of
from smartshoe.files.logs import read

Array = NDArray[np.float64]
Told = dict[str, Any]  # a diagnosis as `--json` writes it, and under "sentences" all that was printed, line by line

pytestmark = pytest.mark.real_data

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "measured_cases.md").read_text(encoding="utf-8")
NUMBER = r"[-−+]?\d+(?:\.\d+)?"
FIGURES = 0.03  # of a quoted figure
SURE = 0.06  # of a quoted confidence: nearer than its classes (0.4, half, 0.9) are to one another
PERCENT = 0.5
EARLIER_S = 0.1  # of a quoted delay
VESSELS = "pneumatic_actuator_friction_leak/leak"
HANGING = {"validation_dataset_3"}  # its causes hang on last digits
COMMANDS = [line for line in PAGE.splitlines() if line.startswith("smartshoe diagnose ")]
SLOW = ("air_", "microfluidic_", "vhb_0d01.csv vhb", "Circle_3", "ensaio1.1", "dataset_3", "17September")


def _few(cases: list[str]) -> list[Any]:
    """The cases, those that take long marked for the bank."""
    return [pytest.param(one, marks=pytest.mark.bank) if any(s in one for s in SLOW) else one for one in cases]


def _numbers(text: str) -> list[float]:
    return [float(one.replace("−", "-")) for one in re.findall(NUMBER, text)]


def _table(*header: str) -> dict[str, list[str]]:
    """The table whose header begins with these cells: its rows by their first cell."""
    lines = PAGE.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("| " + " | ".join(header)))
    rows: dict[str, list[str]] = {}
    for line in lines[at + 2 :]:
        if not line.startswith("|"):
            break
        first, *others = (cell.strip() for cell in line.strip("| ").split("|"))
        rows[first] = others
    return rows


def _causes(cell: str) -> dict[str, tuple[float, set[str]]]:
    """``name (confidence; equivalents)`` of a cell: confidence and equivalents by name."""
    return {
        name: (float(confidence), set(filter(None, (one.strip() for one in others.split(",")))))
        for name, confidence, others in re.findall(r"([a-z][a-z ]+) \(([\d.]+)(?:; )?([^)]*)\)", cell)
    }


def _is_named(cell: str, causes: list[Told], is_law_firm: bool = True) -> None:
    """Raise unless a cell of the page names these causes, as sure as they are, with these equivalents.

    Without the equivalents where the law is not firm, so that they hang on a processor's last digits.
    """
    named = {
        one["effect"].replace("_", " "): (one["confidence"], {e.replace("_", " ") for e in one["equivalents"]})
        for one in causes
    }
    told = _causes(cell)
    assert told or cell.startswith("nothing"), cell
    assert list(named) == list(told)
    for name, (confidence, equivalents) in told.items():
        assert named[name][0] == pytest.approx(confidence, abs=SURE), name
        assert named[name][1] == equivalents or not is_law_firm, name


def _only_as_told(causes: list[Told]) -> None:
    """What hangs on last digits: no name is as good as sure, as the page has it."""
    assert all(one["confidence"] < 0.85 for one in causes)


@cache
def _run(folder: Path, command: str) -> Told:
    """What a command of the page gives in the folder of its files: its JSON, and what it prints."""
    shell = f"{command.replace('smartshoe', f'{sys.executable} -m smartshoe', 1)} --json -"
    done = subprocess.run(["bash", "-c", shell], cwd=folder, capture_output=True, text=True)
    assert done.returncode in (0, 5), done.stderr
    begun = done.stdout.index("{")
    told, end = json.JSONDecoder().raw_decode(done.stdout[begun:])
    said = done.stdout[:begun] + done.stdout[begun + end :] + done.stderr
    return {**told, "sentences": [*told["limits"], *said.splitlines()]}


def _folder(measured: Path, command: str) -> Path:
    file = command.split()[2].replace("*", "[0-9s]*")
    found = sorted(measured.rglob(file))
    assert found, f"no {file} among the measured files"
    return found[0].parent


def _of(measured: Path, file: str, like: str) -> Told:
    """The run of the command that names the file ``like`` alone, with ``file`` in its place."""
    command = next(one for one in COMMANDS if like in one and one.count(".csv") <= 2)
    return _run(_folder(measured, command), command.replace(like, file))


@pytest.mark.parametrize("command", _few(COMMANDS))
def test_each_command_runs_as_it_stands(measured: Path, command: str) -> None:
    assert _run(_folder(measured, command), command)["verdict"] in (
        "unexplained", "partly_explained", "explained", "refused",
    )  # fmt: skip


def _quotes() -> list[str]:
    return [line[2:] for line in PAGE.splitlines() if line.startswith("> ")]


@pytest.mark.parametrize(
    "quote", [pytest.param(one, marks=pytest.mark.bank) if "between the files" in one else one for one in _quotes()]
)
def test_each_quoted_sentence_is_said(measured: Path, quote: str) -> None:
    """By one of the commands above it in its section; its figures within a few percent."""
    before = PAGE[: PAGE.index(quote)]
    block = before[before.rindex("```console") :]
    commands = [line for line in block.splitlines() if line.startswith("smartshoe ")]
    if "between the files" not in quote:
        commands = commands[:1]
    words = re.sub(NUMBER, "#", quote)
    for command in commands:
        for said in _run(_folder(measured, command), command)["sentences"]:
            said = said.removeprefix("note: ")
            if re.sub(NUMBER, "#", said) == words:
                assert _numbers(said) == pytest.approx(_numbers(quote), rel=FIGURES)
                return
    pytest.fail(f"nothing says {quote!r}")


class TestActuator:
    @pytest.mark.parametrize("file", ["Circle_1bar", *_few(["Circle_3bar"])])
    def test_the_gain_within_a_file_and_through_zero(self, measured: Path, file: str) -> None:
        within, through_zero, *_ = map(float, _table("file", "N/bar within the file")[file])
        found = _of(measured, file, "Circle_1bar")
        said = next(one for one in found["limits"] if "narrow range" in one)
        assert list(map(float, re.findall(r"\(([\d.]+) N/bar\)", said))) == pytest.approx(
            [within, through_zero], rel=FIGURES
        )

    def test_the_half_width_of_the_loop(self, measured: Path) -> None:
        command = next(one for one in COMMANDS if "'5[N]'" in one)
        for file, (told, check) in _table("file", "half width, as told").items():
            if file in ("Circle_1bar", "rerun_1_O-ring257_5bar"):
                found = _run(_folder(measured, command), command.replace("Circle_1bar", file))
                said = next(one for one in found["limits"] if "its direction" in one)
                assert float(re.findall(r"lies ([\d.]+) N above", said)[0]) == pytest.approx(
                    _numbers(told)[0], rel=FIGURES
                )
                assert _numbers(told)[0] == pytest.approx(_numbers(check)[0], rel=0.03)
                assert not found["causes"]


@pytest.mark.parametrize("vessel", list(_table("vessel", "lost")))
def test_how_vessels_empty(measured: Path, vessel: str) -> None:
    lost, onset, whole, order = _table("vessel", "lost")[vessel]
    decay = decay_of(read(measured / VESSELS / f"{vessel}.csv", time="1[ms]", sensors=["3[bar]"]))
    assert decay is not None
    assert decay.lost_percent == pytest.approx(_numbers(lost)[0], rel=0.02)
    assert decay.tau_s / (3600.0 if onset.endswith("h") else 1.0) == pytest.approx(_numbers(onset)[0], rel=FIGURES)
    if whole:
        assert decay.from_start_s == pytest.approx(_numbers(whole)[0], rel=FIGURES)
        assert decay.order == pytest.approx(_numbers(order)[0], abs=0.02)
    else:
        assert decay.order is None


class TestInsole:
    @pytest.mark.parametrize("name", _few(list(_table("session", "machine's clock behind"))))
    def test_what_the_joining_and_the_diagnosis_after_it_say(self, measured: Path, name: str) -> None:
        behind, slow, verdict, named, *_ = _table("session", "machine's clock behind")[name]
        command = next(one for one in COMMANDS if "calibration_dataset_P" in one)
        found = _run(_folder(measured, command), command.replace("calibration_dataset", name))
        note = next(one for one in found["sentences"] if "joined with" in one)
        delay_s, sd_s, way, ppm, ppm_sd, rate = re.findall(
            r"clock is ([\d.]+) ± ([\d.]+) s (behind|ahead) in the middle of the record,"
            r" ([\d.]+) ± ([\d.]+) ppm (slow|fast)",
            note,
        )[0]
        told_s, told_sd_s = _numbers(behind)
        told_ppm, told_ppm_sd = _numbers(slow)
        assert (1.0 if way == "behind" else -1.0) * float(delay_s) == pytest.approx(told_s, abs=0.05 + 0.5 * told_sd_s)
        assert float(sd_s) == pytest.approx(told_sd_s, rel=0.3, abs=0.01)
        assert (1.0 if rate == "slow" else -1.0) * float(ppm) == pytest.approx(told_ppm, abs=told_ppm_sd)
        assert float(ppm_sd) == pytest.approx(told_ppm_sd, rel=0.3)
        assert found["verdict"] == verdict.replace(" ", "_")
        _only_as_told(found["causes"]) if name in HANGING else _is_named(named, found["causes"])

    @pytest.mark.parametrize(
        "name",
        [one if one == "calibration_dataset" else pytest.param(one, marks=pytest.mark.bank)
         for one in _table("session", "the tool: the reading is late by")],
    )  # fmt: skip
    def test_the_clocks_of_a_session(self, measured: Path, name: str) -> None:
        told = _numbers(_table("session", "the tool: the reading is late by")[name][0])
        found = _session(measured, name)
        said = [fault.says for fault in found.data_faults if fault.kind == "two_clocks"]
        if not told:
            assert not said
            return
        if len(told) == 2:
            assert _numbers(re.findall(r"\(from (.*?) at the end\)", said[0])[0]) == pytest.approx(told, abs=0.15)
        else:
            assert "at the start" not in said[0]
            assert _numbers(re.findall(r"reading is (.*?) late", said[0])[0]) == pytest.approx(told, abs=EARLIER_S)

    @pytest.mark.bank
    @pytest.mark.parametrize(
        "name", [one for one in _table("recording", "verdict", "named") if not one.startswith("its ")]
    )
    def test_the_causes_of_a_session(self, measured: Path, name: str) -> None:
        verdict, named, beside = _table("recording", "verdict", "named")[name]
        found = _session(measured, name).to_dict()
        if name in HANGING:
            assert found["verdict"] in ("unexplained", "partly_explained")
            _only_as_told(found["causes"])
            return
        assert found["verdict"] == verdict.replace(" ", "_")
        _is_named(named, found["causes"])
        assert (found["rejected"] is not None) == beside.startswith("rejected")

    @pytest.mark.parametrize(
        ("taxel", "verdict", "kind"), [(188, "unexplained", "quantisation"), (251, "refused", "saturation"),
                                       (140, "refused", "held_samples")],
    )  # fmt: skip
    def test_single_taxels_name_nothing(self, measured: Path, taxel: int, verdict: str, kind: str) -> None:
        time_s, taxels, reference_bar = _experiment(measured, "calibration_dataset")
        found = diagnose(insole_of(time_s, taxels[:, taxel], reference_bar, 49.0))
        assert found.verdict == verdict
        assert not found.causes
        assert kind in {fault.kind for fault in found.data_faults}


def _experiment(measured: Path, name: str) -> tuple[Array, Array, Array]:
    """Times (m,), taxels (m, 280) and reference (n,) of a session."""
    experiment = loadmat(measured / "insole_plenum" / f"{name}.mat")["experiment"][0, 0]
    rows = experiment["C"].astype(float)
    return rows[:, 1], rows[:, 2:], experiment["P"].ravel().astype(float)


@cache
def _session(measured: Path, name: str) -> Diagnosis:
    """The page's snippet for a session: its table, or the mean of its taxels that are neither dead nor saturated."""
    if (table := measured / "insole_plenum" / f"{name}_C.csv").exists():
        code = re.findall(r"```py\n(.*?)```", PAGE, re.DOTALL)[0].replace("calibration_dataset", str(table)[:-6])
        found: dict[str, Any] = {}
        exec(code, found)
        return found["found"]  # type: ignore[no-any-return]
    time_s, taxels, reference_bar = _experiment(measured, name)
    is_active = np.all(taxels > 0.0, axis=0) & (np.ptp(taxels, axis=0) >= 5.0)
    return diagnose(insole_of(time_s, taxels[:, is_active].mean(axis=1), reference_bar, 49.0))


class TestDamper:
    @pytest.mark.parametrize("file", list(_table("file", "slope about the middle")))
    def test_the_curve_over_velocity(self, measured: Path, file: str) -> None:
        told = [float(cell) for cell in _table("file", "slope about the middle")[file][:3]]
        found = _of(measured, file, "ensaio.B.5")
        assert found["verdict"] == "refused"
        said = next(one for one in found["limits"] if "about the middle" in one)
        slopes, loop = re.findall(r"by ([\d.]+) N/N", said), re.findall(r"lie ([\d.]+) N to either", said)
        assert [float(one) for one in (*slopes, *loop)] == pytest.approx(told, rel=FIGURES)

    @pytest.mark.bank
    @pytest.mark.parametrize("reading", list(_table("reading", "baseline, extended")))
    def test_force_as_the_load(self, measured: Path, reading: str) -> None:
        shares, verdict, named = _table("reading", "baseline, extended")[reading]
        command = next(one for one in COMMANDS if f"'{reading}[N]'" in one and "--force 'force" in one)
        found = _run(_folder(measured, command), command)
        assert _shares(found) == pytest.approx(_numbers(shares), abs=PERCENT)
        assert found["verdict"] == verdict.replace(" ", "_")
        _is_named(named, found["causes"])
        for file in ("ensaio.A.1", "ensaio.B.5", "ensaio10.2"):
            assert _run(_folder(measured, command), command.replace("ensaio1.1", file))["verdict"] == "refused"


def _shares(found: Told) -> list[float]:
    return [found[model]["variance_explained_percent"] for model in ("baseline", "extended")]


SETS = {  # of the page: its command begins with, its files in test_measured_cases, its case in the page's summary
    "air channel, sweeps": ("air_sweep", "air", "air channel, sweeps"),
    "velostat": ("velostat", "velostat", "velostat"),
    "VHB, two rates": ("vhb_0d01.csv vhb_0d03", "vhb_two_rates", "VHB strip, two rates"),
    "VHB, one rate": ("vhb_0d01.csv --hold", "vhb_one_rate", "VHB strip, one rate"),
    "microfluidic": ("microfluidic", "microfluidic", "microfluidic sensor"),
    "air channel, whole record": ("air_whole", "", "air channel, whole record"),
}


@pytest.mark.parametrize(
    "name", [one if one in ("velostat", "VHB, one rate") else pytest.param(one, marks=pytest.mark.bank) for one in SETS]
)
def test_sensors_of_other_laboratories(measured: Path, name: str) -> None:
    plain, shares, named, _ = _table("set", "held-out variance explained")[name]
    begins, files, case = SETS[name]
    command = next(one for one in COMMANDS if one.startswith(f"smartshoe diagnose {begins}"))
    found = _run(_folder(measured, command), command)
    assert found["verdict"] == _table("case", "verdict")[case][0].replace(" ", "_")
    assert _shares(found) == pytest.approx(_numbers(shares), abs=PERCENT)
    _is_named(named, found["causes"], is_law_firm=name != "VHB, two rates")
    if files:
        fit, hold, column = SENSORS[files]
        percent = plain_solid_percent(sensor_files(measured, fit, column), sensor_files(measured, hold, column))
        assert percent == pytest.approx(_numbers(plain)[0], abs=0.1)
