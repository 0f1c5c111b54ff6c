"""`smartshoe study`: trials by subject and condition, whatever one of them holds."""

from __future__ import annotations

import datetime
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import smartshoe
from simulators.people import Person, Walk, trial
from smartshoe.cli import run_command
from smartshoe.errors import InputError
from smartshoe.files.logs import write
from smartshoe.recording import Recording
from smartshoe.runs.studies._norms import read_norms
from smartshoe.runs.studies._page import careful

SPEEDS = {"slow": 1.0, "fast": 1.5}
SUBJECTS = {"Anna": 540.0, "Ben": 700.0, "Carl": 620.0}


def _walk(subject: str, condition: str) -> Recording:
    number = 10 * list(SUBJECTS).index(subject) + list(SPEEDS).index(condition)
    person = Person(body_weight_n=SUBJECTS[subject])
    made = trial(
        person, Walk(SPEEDS[condition]), 10.0, np.random.default_rng(number), sensors=False, noise_n=1.0, outside="even"
    )
    return made.recording


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three subjects at two speeds, a file that is no trial and one that is not there."""
    folder = tmp_path_factory.mktemp("study")
    entries = ['title = "Slow and fast"\n']
    for subject in SUBJECTS:
        for condition in SPEEDS:
            name = f"{subject}_{condition}.csv"
            recording = _walk(subject, condition)
            write(recording, folder / name)
            reference = ""
            if condition == "slow":
                # As a reference: the same forces with a little noise of its own.
                write(_with_noise(recording), folder / f"plates_{name}")
                reference = f'reference = "plates_{name}"\n'
            entries.append(
                f'[[trial]]\nfile = "{name}"\nsubject = "{subject}"\ncondition = "{condition}"\n'
                f"coverage = 0.8\n{reference}"
            )
    (folder / "triangles.csv").write_text(
        "time_s,force_n,pressure_mbar\n" + "".join(f"{t / 100},{t},{t}\n" for t in range(99))
    )
    for name in ("triangles.csv", "nowhere.csv"):
        entries.append(f'[[trial]]\nfile = "{name}"\nsubject = "Anna"\ncondition = "slow"\n')
    (folder / "norms.csv").write_text(
        'figure,low,high,source,condition\ncadence_steps_per_min,60,115,"One, 2001",slow\n'
        "stance_percent,0,1,Two 2002,\nstep_count,1,2,Three 2003,\n"
    )
    entries.insert(1, 'norms = "norms.csv"\n')
    (folder / "study.toml").write_text("\n".join(entries))
    return folder


def _with_noise(recording: Recording) -> Recording:
    rng = np.random.default_rng(5)
    columns = {f"{c.name}_n": c.values / 0.8 + rng.normal(0.0, 1.0, len(recording)) for c in recording.sensors}
    return Recording.from_arrays(time_s=recording.time_s, name="plates", **columns)


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, object]:
    words = ["study", str(folder / "study.toml"), "--out", str(folder / "out"), "--jobs", "1"]
    assert run_command([*words, "--json", str(folder / "result.json")]) == 0
    return dict(json.loads((folder / "result.json").read_text()))


def test_each_trial_has_the_summary_that_gait_gives(folder: Path, result: dict[str, object]) -> None:
    assert result["schema"] == "smartshoe.study/1"
    trials = result["trials"]
    assert len(trials) == 6
    first = trials[0]
    assert (first["file"], first["subject"], first["condition"]) == ("Anna_slow.csv", "Anna", "slow")
    alone = smartshoe.gait.analyse(smartshoe.read(folder / "Anna_slow.csv"), coverage=0.8)
    assert first["summary"] == json.loads(json.dumps(alone.to_dict()["summary"]))


def test_conditions_are_means_over_subjects_and_differences_within_them(result: dict[str, object]) -> None:
    own = {(t["subject"], t["condition"]): t["figures"]["cadence_steps_per_min"] for t in result["trials"]}
    fast = np.array([own[subject, "fast"] for subject in SUBJECTS])
    slow = np.array([own[subject, "slow"] for subject in SUBJECTS])
    told = result["conditions"]["fast"]["cadence_steps_per_min"]
    assert told["mean"] == pytest.approx(fast.mean())
    assert told["sd"] == pytest.approx(fast.std(ddof=1))
    (difference,) = [d for d in result["differences"] if d["figure"] == "cadence_steps_per_min"]
    assert (difference["from"], difference["to"], difference["subjects"]) == ("slow", "fast", 3)
    assert difference["mean"] == pytest.approx((fast - slow).mean())
    # Cadence rises with speed, and each of these people walks by the same law: so does the interval say.
    assert difference["ci95"][0] > 0


def test_what_is_no_trial_is_left_out_with_its_reason(result: dict[str, object]) -> None:
    told = {each["file"]: each["says"] for each in result["left_out"]}
    assert set(told) == {"triangles.csv", "nowhere.csv"}
    assert told["nowhere.csv"].startswith("nowhere.csv does not exist")
    assert told["triangles.csv"].startswith("triangles")


def test_a_reference_is_agreed_with(result: dict[str, object]) -> None:
    peak = result["agreement"]["peak_n"]
    assert peak["trials"] == 3
    assert peak["strides"] >= 3 * 2 * 5
    assert abs(peak["bias"]) < 10.0
    assert peak["icc"]["value"] > 0.95
    assert peak["limits_of_agreement"][0] < peak["bias"] < peak["limits_of_agreement"][1]


def test_a_reference_of_another_trial_is_told_once_with_its_trials(tmp_path: Path) -> None:
    recording = _walk("Anna", "slow")
    late = Recording.from_arrays(
        time_s=recording.time_s + 500.0, name="late", **{f"{c.name}_n": c.values for c in recording.sensors}
    )
    write(recording, tmp_path / "a.csv")
    write(late, tmp_path / "late.csv")
    (tmp_path / "study.toml").write_text(
        '[[trial]]\nfile = "a.csv"\nsubject = "Anna"\ncondition = "slow"\nreference = "late.csv"\n'
    )
    found = smartshoe.study(tmp_path / "study.toml", jobs=1)
    assert not found.agreement
    ((files, says),) = [each for each in careful(found) if "late.csv" in each[1]]
    assert files == "a.csv"
    assert "check that both are the same trial" in says


def test_the_folder_holds_the_page_and_the_tables(folder: Path, result: dict[str, object]) -> None:
    out = folder / "out"
    assert json.loads((out / "study.json").read_text()) == result
    trials = pd.read_csv(out / "trials.csv")
    assert list(trials["file"])[:2] == ["Anna_slow.csv", "Anna_fast.csv"]
    assert len(trials) == 6
    assert len(pd.read_csv(out / "differences.csv")) == len(result["differences"])
    band = result["bands"]["slow"]
    assert band["source"] == "this study's 3 subjects: mean and 95 % prediction interval"
    assert all(low < high for low, high in zip(band["low"], band["high"], strict=True))
    page = (out / "study.html").read_text()
    for text in ("Slow and fast", "Left out", "triangles.csv", "Agreement with the reference", "Force of a foot"):
        assert text in page


def test_processes_give_the_same_result(folder: Path, result: dict[str, object]) -> None:
    again = smartshoe.study(folder / "study.toml", jobs=2)
    assert again.report is None
    assert json.loads(json.dumps(again.to_dict())) == result


@pytest.mark.parametrize(
    ("text", "status", "says"),
    [
        ('[[trial]]\nfile = "a.csv"\ncondition = "x"\n', 2, "line 1, key trial.0.subject: this key is needed"),
        ('[[trial]]\nfile = "a.csv"\nsubject = ""\ncondition = "x"\n', 2, "line 3, key trial.0.subject"),
        ('title = "no trials"\n', 2, "trial"),
        ('[[trial]]\nfile = "a.csv"\nsubject = "A"\ncondition = "x"\nweight = 3\n', 2, "line 5, key trial.0.weight"),
        ('[[trial]]\nfile = "a"\nsubject = "A"\ncondition = "x"\n' * 2, 2, "a is there twice"),
        ('[[trial]]\nfile = "a.csv"\nsubject = "A"\ncondition = "x"\n', 5, "none of 1 trials can be used"),
        ('calibrations = "c"\n[[trial]]\nfile = "a"\nsubject = "A"\ncondition = "x"\n', 2, "line 1, key calibrations"),
    ],
)
def test_a_study_that_cannot_be_is_told(
    text: str, status: int, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "study.toml").write_text(text)
    assert run_command(["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == status
    assert says in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out" / "study.json").exists()


def test_one_condition_has_figures_and_no_differences(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = (folder / "study.toml").read_text().split("[[trial]]")
    one = "[[trial]]".join([entries[0], *(each for each in entries[1:] if '"slow"' in each and "Anna_" in each)])
    (folder / "one.toml").write_text(one)
    assert run_command(["study", str(folder / "one.toml"), "--out", str(folder / "one"), "--jobs", "1"]) == 0
    out = capsys.readouterr().out
    assert "one condition only" in out
    told = json.loads((folder / "one" / "study.json").read_text())
    assert told["differences"] == []
    assert told["conditions"]["slow"]["cadence_steps_per_min"]["ci95"] is None


def test_calibrations_come_from_a_folder_or_a_store(tmp_path: Path) -> None:
    from smartshoe.runs.scenario import load, run
    from smartshoe.runs.studies._plan import TrialEntry
    from smartshoe.runs.studies._trials import calibrations_for

    text = '[protocol.dynamic]\nrates_n_per_s = [200.0, 800.0]\n[[unit]]\nname = "left_toe"\n'
    (tmp_path / "s.toml").write_text(text)
    made = run(*load(tmp_path / "s.toml")).units[0].calibration
    (tmp_path / "folder").mkdir()
    made.save(tmp_path / "folder" / "left_toe.json")
    store = smartshoe.CalibrationStore(tmp_path / "store")
    store.add(made, serial_number="T-1", date="2026-01-05", position="left_toe")
    recording = Recording.from_arrays(time_s=np.arange(3.0), left_toe_mbar=np.arange(3.0), name="walk")
    entry = TrialEntry(file="walk.csv", subject="A", condition="x")
    for place in ("folder", "store", "store"):  # a store that was read before has an index
        (found,) = calibrations_for(recording, tmp_path / place, entry)
        assert (found.unit, found.b1) == ("left_toe", made.b1)
    assert calibrations_for(recording, None, entry) == []
    store.add(replace(made, b1=2.0 * made.b1), serial_number="T-1", date="2026-03-05", position="left_toe")
    days = datetime.date(2026, 1, 10), datetime.date(2026, 3, 1), None
    for day, times in zip(days, (1.0, 2.0, 2.0), strict=True):
        (found,) = calibrations_for(recording, tmp_path / "store", entry.model_copy(update={"date": day}))
        assert found.b1 == times * made.b1
    (tmp_path / "empty" / "units").mkdir(parents=True)
    for place in ("empty", "empty/units"):
        with pytest.raises(InputError, match="holds no calibration"):
            calibrations_for(recording, tmp_path / place, entry)


def test_norms_stand_beside_the_subjects_with_their_source(folder: Path, result: dict[str, object]) -> None:
    cadence, *stance, nobody = result["norms"]
    assert (cadence["condition"], cadence["source"]) == ("slow", "One, 2001")
    assert (cadence["subjects"], cadence["within"], cadence["outside"]) == (3, 3, [])
    assert [(each["condition"], each["within"]) for each in stance] == [("slow", 0), ("fast", 0)]
    assert stance[0]["outside"] == ["Anna", "Ben", "Carl"]
    assert nobody["subjects"] == 0
    assert any("no trial has figure 'step_count'" in flag["says"] for flag in result["flags"])
    page = (folder / "out" / "study.html").read_text(encoding="utf-8")
    assert "Two 2002" in page
    assert "0 of 3" in page


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("figure,low,high\n", "lacks column source"),
        ("figure,low,high,source\na,1,x,S\n", "line 2: low and high are '1' and 'x'"),
        ("figure,low,high,source\na,2,1,S\n", "line 2: from 2 to 1 is no range"),
        ("figure,low,high,source\na,1,2,\n", "line 2: source is empty"),
        ("figure,low,high,source,condition\na,1,2,S,fasst\n", "no trial has condition 'fasst'; there are slow, fast"),
    ],
)
def test_norms_that_are_none_are_told_with_their_line(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "norms.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=says):
        read_norms(tmp_path / "norms.csv", ["slow", "fast"])
