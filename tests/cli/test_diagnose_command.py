"""``smartshoe diagnose`` as its users' scripts see it: the contract's keys, what files it writes, exit statuses."""

from __future__ import annotations

import hashlib
import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import smartshoe
import smartshoe.diagnosis
from simulators.hidden.recordings import hide
from smartshoe.cli import run_command
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.signals.loading import rate_range

CONTRACT: dict[str, Any] = {
    "schema": None,
    "verdict": None,
    "causes": {
        "effect": None,
        "family": None,
        "stage": None,
        "confidence": None,
        "equivalents": None,
        "parameters": None,
        "evidence": {"statistic": None, "value": None, "threshold": None, "says": None},
        "held_out": {"rmse_before": None, "rmse_after": None, "unit": None, "gain_percent": None, "ci95": None},
    },
    "data_faults": {"kind": None, "where": None, "share": None, "says": None},
    "baseline": {"rmse": None, "fit_percent": None, "force_rmse_n": None},
    "extended": {"rmse": None, "fit_percent": None, "force_rmse_n": None},
    "explainable_percent": None,
    "explained_percent": None,
    "rivals": {"effect": None, "margin": None},
    "next_experiment": {"separates": None, "protocol": None, "channel": None, "says": None},
    "limits": None,
}


def holds(found: Any, wanted: Any) -> bool:
    """Whether every key of ``wanted`` is in ``found``; a list is held to it entry by entry, null is let pass."""
    if isinstance(found, list):
        return wanted is None or all(holds(one, wanted) for one in found)
    if wanted is None or found is None:
        return True
    return all(key in found and holds(found[key], below) for key, below in wanted.items())


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two experiments of a unit that leaks, as tables: one to fit, one to hold out."""
    triangles = dynamic_protocol((200.0, 800.0), repeats=3, rest_s=2.0).segments
    held = (Segment("ramp", 600.0, 3.0), Segment("hold", 600.0, 20.0), Segment("ramp", 0.0, 3.0))
    steps = Protocol("short", (*triangles, *held, Segment("rest", 0.0, 10.0)))
    case = hide(
        ["linear_leak"], strength_percent_fs=3.0, protocol=steps, seed=5, nuisances=0, recordings=1, sample_rate_hz=50.0
    )
    folder = tmp_path_factory.mktemp("leak")
    paths = folder / "first.csv", folder / "second.csv"
    for recording, path in zip((*case.recordings, *case.hold_out), paths, strict=True):
        smartshoe.write(recording, path)
    return paths


def test_one_command_writes_page_result_and_calibration(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, result, calibration = tmp_path / "out", tmp_path / "d.json", tmp_path / "c.json"
    words = ["diagnose", str(files[0]), "--hold-out", str(files[1]), "--unit", "toe <b>"]
    assert run_command([*words, "--json", str(result), "--out", str(out), "--calibration", str(calibration)]) == 0
    said = capsys.readouterr().out
    found = json.loads(result.read_text())
    assert found["schema"] == "smartshoe.diagnosis/1"
    assert holds(found, CONTRACT)
    assert found["causes"][0]["family"] == "leak"
    assert found["extended"]["rmse"]["value"] < found["baseline"]["rmse"]["value"]

    assert said.splitlines()[0].startswith("toe <b>: ")
    assert found["causes"][0]["effect"].replace("_", " ") in said
    assert "before and after" in said
    assert f"report: {out / 'diagnosis.html'}" in said

    assert json.loads((out / "diagnosis.json").read_text()) == found
    page = (out / "diagnosis.html").read_text()
    assert "Diagnosis of toe &lt;b&gt;" in page
    assert found["causes"][0]["says"][1:] in page
    for protocol in out.glob("*.toml"):
        table = tomllib.loads(protocol.read_text())["protocol"]
        assert next(iter(table.values()))["kind"] == "segments"

    saved = json.loads(calibration.read_text())
    assert saved["unit"] == "toe <b>"
    assert found["causes"][0]["effect"] in saved["extended"]["effects"]
    sha256 = hashlib.sha256(files[0].read_bytes()).hexdigest()
    assert saved["sources"] == [{"name": str(files[0]), "sha256": sha256}]
    fitted = smartshoe.read(files[0])
    assert saved["load_range_n"] == [fitted.force_n.min(), fitted.force_n.max()]
    assert saved["rate_range_n_per_s"] == list(rate_range([(fitted.time_s, fitted.force_n)]))
    assert saved["sample_rate_hz"] == round(fitted.sample_rate_hz, 6)
    estimate = tmp_path / "force.csv"
    assert run_command(["compensate", str(files[1]), "--calibration", str(calibration), "--out", str(estimate)]) == 0
    force_n = smartshoe.read(estimate).channels["force_estimate"].si
    assert float(np.sqrt(np.mean((force_n - smartshoe.read(files[1]).force_n) ** 2))) < 40.0


def test_a_dash_for_json_leaves_nothing_else_on_stdout(
    files: tuple[Path, Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from smartshoe.diagnosis import Diagnosis

    def quick(*_: Any, **options: Any) -> Diagnosis:
        assert options["material"] == pytest.approx(0.0005)
        assert len(options["hold_out"]) == 1
        options["progress"]("a step")
        return Diagnosis("adequate", "nothing matters", "mbar", 800.0, 70.0)

    monkeypatch.setattr(smartshoe.diagnosis, "diagnose", quick)
    words = ["diagnose", str(files[0]), "--hold-out", str(files[1]), "--material", "0.05", "--json", "-"]
    assert run_command(words) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "adequate"


def _dead(path: Path) -> Path:
    """A table whose reading never leaves zero."""
    time_s = np.arange(0.0, 40.0, 0.02)
    load_n = 400.0 * (1.0 - np.cos(time_s))
    rows = np.column_stack([time_s, load_n, np.zeros(time_s.size)])
    np.savetxt(path, rows, delimiter=",", header="time_s,force_n,pressure_mbar", comments="", fmt="%.6g")
    return path


def test_what_was_left_out_is_listed_neither_in_the_page_nor_in_the_calibration(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    out, calibration, dead = tmp_path / "out", tmp_path / "c.json", _dead(tmp_path / "dead.csv")
    words = ["diagnose", str(files[0]), str(dead), "--hold-out", str(files[1]), "--out", str(out)]
    assert run_command([*words, "--calibration", str(calibration)]) == 0
    assert any("dead" in limit for limit in json.loads((out / "diagnosis.json").read_text())["limits"])
    assert [source["name"] for source in json.loads(calibration.read_text())["sources"]] == [str(files[0])]
    first, second = (smartshoe.read(file).name for file in files)
    assert f"fitted: {first} · judged on: {second} ·" in (out / "diagnosis.html").read_text(encoding="utf-8")


def test_a_file_held_out_that_cannot_judge_is_warned_of(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short, copy, dead = tmp_path / "short.csv", tmp_path / "copy.csv", _dead(tmp_path / "dead.csv")
    short.write_text("time_s,force_n,pressure_mbar\n0,0,0\n0.02,1,1\n0.04,2,2\n")
    copy.write_bytes(files[0].read_bytes())
    unused = {
        short: "the recording holds 3 samples",
        copy: "holds the same samples as",
        dead: "the reading is constant",
    }
    for judge, instead in ((files[1], "the other files held out"), (None, "load cycles of the fitted files")):
        words = ["diagnose", str(files[0]), *(f"--hold-out={one}" for one in (*unused, *([judge] if judge else ())))]
        assert run_command(words) == 0
        warned = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]
        assert len(warned) == len(unused)
        for line, (file, why) in zip(warned, unused.items(), strict=True):
            assert line.startswith(f"warning: --hold-out {file} judges nothing, {instead} do: {why}")


def test_recordings_of_no_unit_are_headed_by_one_of_those_that_were_used_and_how_many_more(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dead, plain = _dead(tmp_path / "dead.csv"), []
    for file in files:
        recording = smartshoe.read(file)
        plain.append(str(tmp_path / f"plain_{file.name}"))
        columns = (recording.time_s, recording.force_n, recording.sensor.values)
        np.savetxt(
            plain[-1], np.column_stack(columns), delimiter=",", header="time_s,force_n,pressure_mbar", comments=""
        )
    for given, heading in (([str(dead), plain[0]], "plain_first"), (plain, "plain_first and 1 more")):
        assert run_command(["diagnose", *given]) == 0
        assert capsys.readouterr().out.startswith(f"{heading}: On data that was not fitted")


def test_a_file_given_twice_is_one_experiment_in_the_limits_the_page_and_the_calibration(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    out, calibration, copy = tmp_path / "out", tmp_path / "c.json", tmp_path / "copy.csv"
    copy.write_bytes(files[0].read_bytes())
    words = ["diagnose", str(files[0]), str(copy), "--hold-out", str(files[1]), "--out", str(out)]
    assert run_command([*words, "--calibration", str(calibration)]) == 0
    limits = json.loads((out / "diagnosis.json").read_text())["limits"]
    (said,) = (one for one in limits if "it is one experiment, given twice" in one)
    assert said.startswith(f"left out: {copy} holds the same samples as {files[0]}")
    assert [source["name"] for source in json.loads(calibration.read_text())["sources"]] == [str(files[0])]
    first, second = (smartshoe.read(file).name for file in files)
    assert f"fitted: {first} · judged on: {second} ·" in (out / "diagnosis.html").read_text(encoding="utf-8")


def test_files_of_several_units_end_in_status_2_and_name_them(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other, result = tmp_path / "other.csv", tmp_path / "d.json"
    for path, name in ((tmp_path / "one.csv", "left_toe"), (other, "right_heel")):
        smartshoe.write(replace(smartshoe.read(files[0]), unit=name), path)
    assert run_command(["diagnose", str(tmp_path / "one.csv"), "--hold-out", str(other), "--json", str(result)]) == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    where = f"left_toe in {tmp_path / 'one.csv'}, right_heel in {other}"
    assert last == f"error: recordings of different units ({where}): diagnose one unit at a time"
    assert not result.exists()


def test_hopeless_data_is_refused_in_one_sentence_and_the_json_says_so_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, result, out, calibration = _dead(tmp_path / "dead.csv"), *(tmp_path / n for n in ("d.json", "out", "c.json"))
    words = ["diagnose", str(table), "--json", str(result), "--out", str(out), "--calibration", str(calibration)]
    assert run_command(words) == 5
    heard = capsys.readouterr()
    last = heard.err.strip().splitlines()[-1]
    assert last.startswith("error: ")
    assert "dead.csv" in last
    assert heard.out == ""
    found = json.loads(result.read_text())
    assert found["verdict"] == "refused"
    assert holds(found, CONTRACT)
    assert last == f"error: {found['limits'][0]}"
    assert "earlier" not in heard.err
    page = (out / "diagnosis.html").read_text(encoding="utf-8")
    assert "No diagnosis" in page
    assert f'<p class="facts">given: {smartshoe.read(table).name} · smartshoe: ' in page
    assert not calibration.exists()


def test_what_a_refused_diagnosis_takes_away_and_leaves_in_a_used_folder_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, calibration = tmp_path / "out", tmp_path / "c.json"
    (out / "figures").mkdir(parents=True)
    (out / "figures" / "diagnosis_loops.svg").write_text("<svg/>")
    calibration.write_text("{}")
    words = ["diagnose", str(_dead(tmp_path / "dead.csv")), "--out", str(out), "--calibration", str(calibration)]
    assert run_command(words) == 5
    heard = capsys.readouterr().err
    assert f"note: {out}: diagnosis_loops.svg of an earlier diagnosis taken away\n" in heard
    assert f"warning: {calibration} is left as it was: this diagnosis gives no calibration\n" in heard
    assert sorted(path.name for path in out.iterdir()) == ["diagnosis.html", "diagnosis.json"]


def test_a_page_without_a_diagnosis_says_what_was_given_and_none_of_it_fitted(tmp_path: Path) -> None:
    first, second, out = _dead(tmp_path / "dead.csv"), _dead(tmp_path / "gone.csv"), tmp_path / "out"
    assert run_command(["diagnose", str(first), "--hold-out", str(second), "--out", str(out)]) == 5
    page = (out / "diagnosis.html").read_text(encoding="utf-8")
    given = ", ".join(smartshoe.read(one).name for one in (first, second))
    assert f'<p class="facts">given: {given} · smartshoe: ' in page
    assert "fitted: " not in page
    assert "judged on: " not in page


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["{0}", "--hold-out", "{0}"], 2, "to be fitted and held out at once"),
        (["{0}", "--material", "0"], 2, "--material"),
        (["{0}", "--material", "nan"], 2, "--material"),
        (["{0}", "--force", "no_such"], 3, "no_such"),
        (["no_such.csv"], 3, "no_such.csv"),
        (["{0}", "--hold-out", "no_such.csv"], 3, "no_such.csv"),
        ([], 2, "FILES"),
    ],
)
def test_errors_are_one_sentence_and_leave_no_file(
    words: list[str], status: int, says: str, files: tuple[Path, Path], tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    result = tmp_path / "d.json"
    spoken = [word.format(str(files[0])) for word in words]
    assert run_command(["diagnose", *spoken, "--json", str(result)]) == status
    heard = capsys.readouterr()
    assert says in heard.err.strip().splitlines()[-1]
    assert "Traceback" not in heard.err
    assert heard.out == ""
    assert not result.exists()


def test_a_file_of_many_columns_is_refused_with_what_mends_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [f"{side}_{place}" for side in ("left", "right") for place in ("toe", "meta1", "meta4", "heel")]
    others = [f"{side}_{axis}_of_the_gyroscope_v" for side in ("left", "right") for axis in "xyz"]
    table = tmp_path / "insoles.csv"
    rows = np.column_stack([np.arange(200.0), *np.random.default_rng(1).normal(size=(14, 200))])
    header = ",".join(["time_s", *(f"{name}_n" for name in names), *others])
    np.savetxt(table, rows, delimiter=",", header=header, comments="", fmt="%.6g")
    assert run_command(["diagnose", str(table)]) == 5
    last = capsys.readouterr().err.splitlines()[-1]
    assert str(table) in last
    assert "; name its column with --force (columns: " in last


def test_help_shows_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["diagnose", "--help"]) == 0
    said = capsys.readouterr().out
    assert "Example: smartshoe diagnose" in said
    assert "--hold-out" in said
    assert "(no FILE, and of the other options only --json)" in " ".join(said.split())


def test_of_many_refused_recordings_a_few_are_told_and_how_many_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [str(tmp_path / f"{k}.csv") for k in range(30)]
    for name in names:
        Path(name).write_text("time_s,force_n,pressure_mbar\n0,0,0\n1,1,1\n")
    out = tmp_path / "d.json"
    assert run_command(["diagnose", *names, "--json", str(out)]) == 5
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 12
    assert told[-2] == "note: and 19 more, which --json has under limits"
    assert told[-1].startswith("error: ")
    assert len(json.loads(out.read_text())["limits"]) == 30
