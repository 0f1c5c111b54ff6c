"""``smartshoe gait``: the contract's object, its files, and how it fails."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simulators.people import Person, Run, Stand, Trial, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.files.logs import write
from smartshoe.gait import Coverage
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR


def _trial(activity: Any, seconds: float = 15.0) -> Trial:
    return trial(Person(), activity, seconds, np.random.default_rng(1), sensors=False, noise_n=1.0, name="trial")


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gait") / "walk.csv"
    write(_trial(Walk(1.3)).recording, path)
    return path


def _json(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run_command(["gait", *arguments, "--json", "-"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def _is(value: Any, kind: type, nullable: bool = False) -> bool:
    if value is None:
        return nullable
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, kind)


def _check_contract(found: dict[str, Any]) -> None:
    """Section 5 of the contract, key by key."""
    assert found["schema"] == "smartshoe.gait/1"
    assert found["activity"] in ("walking", "running", "standing", "mixed")
    for event in found["events"]:
        assert _is(event["time_s"], float)
        assert event["foot"] in ("left", "right")
        assert event["event"] in ("heel_strike", "toe_off", "foot_flat", "heel_off")
    for stride in found["strides"]:
        assert stride["foot"] in ("left", "right")
        assert all(_is(stride[key], float) for key in ("start_s", "end_s", "stance_percent"))
        assert all(_is(stride[key], float, nullable=True) for key in ("peak_n", "impulse_n_s"))
    summary = found["summary"]
    for key in ("cadence_steps_per_min", "double_support_percent", "asymmetry_percent"):
        assert _is(summary[key], float, nullable=True)
    for times in summary["stride_time_s"].values():
        assert set(times) == {"mean", "cv_percent"}
    assert all(_is(value, float, nullable=True) for value in summary["stance_percent"].values())
    assert set(summary["order_of_contact"]) <= {"heel", "meta4", "meta1", "toe"}
    forces = found["forces"]
    assert forces["body_weight_n"] is None or set(forces["body_weight_n"]) == {"value", "sd"}
    for key in ("mean_total_n", "standing_total_n", "rmse_estimate_n"):
        assert _is(forces[key], float, nullable=True)
    for flag in found["flags"]:
        assert set(flag) == {"kind", "foot", "unit", "where", "says"}
        assert _is(flag["kind"], str)
        assert _is(flag["says"], str)


def test_a_walk_as_json(walk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = _json(capsys, str(walk), "--coverage", "0.8")
    _check_contract(found)
    assert found["activity"] == "walking"
    assert found["summary"]["order_of_contact"] == ["heel", "meta4", "meta1", "toe"]
    assert found["summary"]["cadence_steps_per_min"] == pytest.approx(110, abs=3)
    assert found["forces"]["body_weight_n"]["value"] == pytest.approx(519.4, rel=0.02)
    assert set(found["summary"]["stance_percent"]) == {"left", "right"}


@pytest.mark.parametrize(("activity", "named"), [(Run(2.68), "running"), (Stand(), "standing")])
def test_other_activities_as_json(
    activity: Any, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(_trial(activity).recording, tmp_path / "trial.csv")
    found = _json(capsys, str(tmp_path / "trial.csv"), "--coverage", "0.8")
    _check_contract(found)
    assert found["activity"] == named


def test_readings_with_calibrations_from_two_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = _trial(Walk(1.3))
    files, calibrations = [], []
    for side in ("left", "right"):
        columns = {f"{unit}_mbar": load / 5.0 for unit, load in made.unit_n.items() if unit.startswith(side)}
        files.append(str(tmp_path / f"{side}.csv"))
        write(Recording.from_arrays(time_s=made.time_s, name=side, **columns), files[-1])
        for unit in made.unit_n:
            if unit.startswith(side):
                path = tmp_path / f"{unit}.json"
                Calibration(a1=0.2, b0=5.0, b1=1.0, reading_unit=MILLIBAR, unit=unit).save(path)
                calibrations += ["--calibration", str(path)]
    found = _json(capsys, *files, *calibrations, "--coverage", "0.8", "--body-weight", "519.4")
    _check_contract(found)
    assert found["flags"] == []
    assert found["forces"]["body_weight_n"] == {"value": 519.4, "sd": 0.0}
    assert found["forces"]["mean_total_n"] == pytest.approx(519.4, rel=0.02)
    # Without calibrations what can be told is told.
    found = _json(capsys, *files)
    _check_contract(found)
    assert {flag["kind"] for flag in found["flags"]} == {"uncalibrated"}
    assert found["forces"]["mean_total_n"] is None
    assert found["summary"]["cadence_steps_per_min"] == pytest.approx(110, abs=3)


def test_the_table_and_the_files(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    course = tmp_path / "course.csv"
    Coverage.midfoot(0.8).save(course)
    assert run_command(["gait", str(walk), "--coverage-course", str(course), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "trial: walking" in said
    assert "order of contact: heel, meta4, meta1, toe" in said
    assert said.splitlines()[-5].endswith("gait.html")
    page = (out / "gait.html").read_text(encoding="utf-8")
    assert page.count("data-chart=") == 11
    assert page.rstrip().endswith("</html>")
    _check_contract(json.loads((out / "gait.json").read_text(encoding="utf-8")))
    assert (out / "strides.csv").read_text().startswith("foot,start_s,end_s,")
    assert (out / "events.csv").read_text().startswith("time_s,foot,event\n")
    # What was written is a trial again: loads above their floors.
    again = _json(capsys, str(out / "forces.csv"), "--coverage", "0.8")
    first = _json(capsys, str(walk), "--coverage", "0.8")
    assert again["summary"]["stride_time_s"]["left"]["mean"] == pytest.approx(
        first["summary"]["stride_time_s"]["left"]["mean"], rel=1e-4
    )


@pytest.mark.parametrize("activity", [Run(2.68), Stand(), ((Stand(), 5.0), (Walk(1.2), 6.0), (Run(2.7), 6.0))])
def test_every_activity_has_a_page(activity: Any, tmp_path: Path) -> None:
    write(_trial(activity).recording, tmp_path / "trial.csv")
    assert run_command(["gait", str(tmp_path / "trial.csv"), "--out", str(tmp_path / "out")]) == 0
    assert "<svg" in (tmp_path / "out" / "gait.html").read_text(encoding="utf-8")


def test_one_shoe_without_a_calibration_has_a_page(tmp_path: Path) -> None:
    made = _trial(Walk(1.3))
    columns = {f"{unit}_v": load / 100.0 for unit, load in made.unit_n.items() if unit.startswith("left")}
    write(Recording.from_arrays(time_s=made.time_s, **columns), tmp_path / "left.csv")
    assert run_command(["gait", str(tmp_path / "left.csv"), "--out", str(tmp_path / "out")]) == 0
    assert "left" in (tmp_path / "out" / "gait.html").read_text(encoding="utf-8")


def test_a_reference_trial_gives_the_pattern(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(_trial(Run(2.68)).recording, tmp_path / "run.csv")
    own = _json(capsys, str(walk))
    against = _json(capsys, str(walk), "--reference", str(tmp_path / "run.csv"))
    assert against["indices"]["left"]["deviation_percent"] > 2 * own["indices"]["left"]["deviation_percent"]


def test_c3d_is_written(walk: Path, tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    assert run_command(["gait", str(walk), "--c3d", str(tmp_path / "walk.c3d")]) == 0
    assert ezc3d.c3d(str(tmp_path / "walk.c3d"))["parameters"]["EVENT"]["USED"]["value"][0] > 50


@pytest.mark.parametrize(
    ("columns", "arguments", "status", "says"),
    [
        ({"pressure_mbar": 1.0}, [], 3, "no column of a shoe's unit"),
        ({"left_heel_n": 0.0}, [], 5, "no stance is found"),
        ({"left_heel_m_per_s": 0.0}, [], 3, "left_heel is in m/s"),
        ({"left_heel_n": 0.0}, ["--coverage", "1.5"], 2, "coverage is 1.5"),
        ({"left_heel_n": 0.0}, ["--body-weight", "-3"], 2, "body_weight_n is -3"),
        ({"left_heel_n": 0.0}, ["--calibration", "missing.json"], 3, "missing.json does not exist"),
    ],
)
def test_a_fault_is_one_sentence_and_leaves_no_file(
    columns: dict[str, float],
    arguments: list[str],
    status: int,
    says: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    time_s = np.arange(2000) / 200.0
    made = {name: value + np.sin(time_s) * 1e-3 for name, value in columns.items()}
    write(Recording.from_arrays(time_s=time_s, **made), tmp_path / "trial.csv")
    result = tmp_path / "gait.json"
    assert run_command(["gait", str(tmp_path / "trial.csv"), *arguments, "--json", str(result)]) == status
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert says in last
    assert not result.exists()


def test_a_folder_of_calibrations_serves_with_the_extended_ones_before_the_plain(tmp_path: Path) -> None:
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.errors import InputError
    from smartshoe.units import MILLIBAR

    plain = Calibration(a1=0.2, b0=3.6, b1=0.85, reading_unit=MILLIBAR, unit="left_toe")
    extended = replace(plain, extended=plain.model())
    plain.save(tmp_path / "left_toe.json")
    extended.save(tmp_path / "left_toe_extended.json")
    replace(plain, unit="left_heel").save(tmp_path / "left_heel.json")
    found = load_calibrations([str(tmp_path)])
    assert [(each.unit, each.extended is not None) for each in found] == [("left_heel", False), ("left_toe", True)]
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no calibration"):
        load_calibrations([str(tmp_path / "empty")])


def test_columns_of_any_name_are_mapped_with_their_unit(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line for line in walk.read_text().splitlines() if not line.startswith("#")]
    header, path = lines[0].split(","), tmp_path / "foreign.csv"
    renamed = [f"part {k}" for k in range(len(header))]
    renamed[0] = header[0]
    path.write_text("\n".join([",".join(renamed), *lines[1:]]))
    mapped = [f"--sensor={name.removesuffix('_n')}={renamed[k]}[N]" for k, name in enumerate(header) if k]
    assert _json(capsys, str(path), *mapped)["strides"] == _json(capsys, str(walk))["strides"]
    assert run_command(["gait", str(path), f"--sensor=left_heel={renamed[1]}[quux]"]) == 3
    assert "'quux'" in capsys.readouterr().err
    assert run_command(["gait", str(path)]) == 3
    assert "--sensor left_heel=" in capsys.readouterr().err


def test_a_walk_that_lacks_every_third_sample_says_that_no_stride_counts(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line for line in walk.read_text().splitlines() if not line.startswith("#")]
    rng, path = np.random.default_rng(3), tmp_path / "gaps.csv"
    rows = [line.split(",") for line in lines[1:]]
    holes = rng.random((len(rows), len(rows[0]) - 1)) < 0.33
    kept = [",".join([row[0], *("" if hole else cell for cell, hole in zip(row[1:], own, strict=True))])
            for row, own in zip(rows, holes, strict=True)]  # fmt: skip
    path.write_text("\n".join([lines[0], *kept]))
    assert run_command(["gait", str(path)]) == 0
    told = capsys.readouterr()
    assert "no stride is whole enough" in told.out
    assert "of the samples of left_heel" in told.err
