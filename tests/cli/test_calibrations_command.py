"""``smartshoe calibrations`` as a person runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.units import MILLIBAR


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SMARTSHOE_STORE", str(tmp_path / "store"))
    for k, gain in enumerate((1.0, 0.99, 0.98)):
        Calibration(
            0.2,
            9.9 * gain,
            2.0 * gain,
            MILLIBAR,
            unit="left_toe",
            created=f"2026-0{k + 1}-01",
            load_range_n=(0.0, 800.0),
        ).save(f"toe{k}.json")
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> str:
    assert run_command(["calibrations", *words]) == status, words
    said = capsys.readouterr()
    return said.out if status == 0 else said.err.strip().splitlines()[-1]


def test_a_units_life_from_add_to_drift(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "holds no calibration yet" in run(capsys, "list")
    for k, counted in enumerate(("1 calibration of 1 unit,", "2 calibrations of 1 unit,", "3 calibrations of 1 unit,")):
        run(capsys, "add", f"toe{k}.json", "--serial-number", "S1", "--valid-for-days", "20")
        assert counted in run(capsys, "list")
    run(capsys, "repair", "S1", "--date", "2026-02-15", "--note", "new tube")
    run(capsys, "swap", "left_toe", "S1", "--date", "2026-01-01")
    shown = run(capsys, "list", "--date", "2026-02-20")
    assert shown.count("EXPIRED") == 1
    assert "new tube" in shown
    listed = json.loads(run(capsys, "list", "--json", "-", "--date", "2026-02-20"))
    (unit,) = listed["units"]
    assert (unit["position"], len(unit["calibrations"]), len(unit["events"])) == ("left_toe", 3, 2)
    assert "11 days before" in run(capsys, "show", "left_toe", "--date", "2026-02-12", "--out", "c.json")
    assert Calibration.load("c.json").serial_number == "S1"
    compared = json.loads(run(capsys, "compare", "toe0.json", unit["calibrations"][2]["name"], "--json", "-"))
    assert compared["forces"][0]["largest_n"] == pytest.approx(-16.0)
    assert "static gain" in run(capsys, "drift", "S1", "--out", "drift", "--figures", "svg", "--figures", "png")
    assert sorted(path.suffix for path in Path("drift").glob("drift.*")) == [".html", ".json", ".png", ".svg"]
    run(capsys, "retire", "S1", "--date", "2026-03-05")
    assert "retired" in run(capsys, "show", "S1", "--date", "2026-03-06", status=5)


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["add", "toe0.json"], 2, "--serial-number"),
        (["add", "missing.json", "--serial-number", "S1"], 3, "missing.json"),
        (["add", "toe0.json", "toe1.json", "--serial-number", "S1"], 2, "one by one"),
        (["add", "toe0.json", "--serial-number", "S1", "--date", "soon"], 2, "soon"),
        (["show", "S1"], 2, "S1"),
        (["repair", "S1"], 2, "S1"),
        (["drift", "S1"], 2, "S1"),
        (["compare", "toe0.json", "nothing"], 2, "nothing"),
        (["list", "--store", "toe0.json"], 2, "is a file"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], status: int, says: str
) -> None:
    assert says in run(capsys, *words, status=status)


def test_expired_is_refused_when_asked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(capsys, "add", "toe0.json", "--serial-number", "S1", "--valid-for-days", "20")
    assert "has expired" in run(capsys, "show", "S1", "--date", "2026-02-12")
    assert "expired" in run(capsys, "show", "S1", "--date", "2026-02-12", "--refuse-expired", status=5)
