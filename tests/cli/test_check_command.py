"""``smartshoe check`` as a person runs it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from smartshoe.cli import run_command
from smartshoe.recording import REGIONS, Recording


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    from simulators.people import Person, Walk, trial
    from smartshoe.files.logs import write

    made = trial(Person(), Walk(), 30.0, np.random.default_rng(3), sensors=False, first_contact_s=3.0)
    write(made.recording, tmp_path / "walk.csv")
    dead = made.recording.channels | {}
    columns = {f"{name}_n": channel.values for name, channel in dead.items()}
    columns["left_heel_n"] = np.random.default_rng(0).standard_normal(len(made.recording))
    write(Recording.from_arrays(time_s=made.recording.time_s, **columns), tmp_path / "dead.csv")
    return tmp_path


def test_a_good_walk(walk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", str(walk / "walk.csv"), "--body-weight", "519.4", "--coverage", "0.8"]
    assert run_command([*words, "--strict"]) == 0
    assert "walk.csv: ok" in capsys.readouterr().out
    assert run_command([*words, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "smartshoe.check/1"
    assert found["verdict"] == "ok"
    units = {finding["unit"] for finding in found["recordings"][0]["findings"] if finding["kind"] == "zero"}
    assert units == {f"{side}_{region}" for side in ("left", "right") for region in REGIONS}


def test_a_dead_unit_is_told_and_refused_when_strict(walk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["check", str(walk / "walk.csv"), str(walk / "dead.csv")]) == 0
    assert "left_heel answers with" in capsys.readouterr().out
    assert run_command(["check", str(walk / "dead.csv"), "--strict"]) == 5
    assert capsys.readouterr().err.startswith("error: left_heel answers with")


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["missing.csv"], 3, "missing.csv"),
        (["walk.csv", "--body-weight", "-3"], 2, "--body-weight"),
        (["walk.csv", "--coverage", "2", "--body-weight", "500"], 2, "--coverage"),
        (["walk.csv", "--calibration", "walk.csv"], 3, "walk.csv"),
    ],
)
def test_what_is_wrong_is_said(
    walk: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    status: int,
    says: str,
) -> None:
    monkeypatch.chdir(walk)
    assert run_command(["check", *words]) == status
    assert says in capsys.readouterr().err.strip().splitlines()[-1]
