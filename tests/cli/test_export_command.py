"""``smartshoe export`` as a user's script sees it."""

from __future__ import annotations

from pathlib import Path

import pytest

from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.units import MILLIBAR


@pytest.fixture
def calibration(tmp_path: Path) -> str:
    path = tmp_path / "left_toe.json"
    Calibration(0.215, 1.593, 0.3249, MILLIBAR, unit="left_toe").save(path)
    return str(path)


@pytest.mark.parametrize(
    ("target", "names"),
    [
        ("c", {"smartshoe_filter.h", "smartshoe_filter.c", "smartshoe_filter_test.c", "smartshoe_filter_test.csv"}),
        ("matlab", {"smartshoe_filter.m", "smartshoe_filter_test.m", "smartshoe_filter_test.csv"}),
        ("json", {"smartshoe_filter.json"}),
        ("fmu", {"smartshoe_filter.fmu"}),
    ],
)
def test_each_target_writes_its_files_and_lists_them(
    target: str, names: set[str], calibration: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "made" / "here"
    assert run_command(["export", calibration, "--to", target, "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == names
    table = capsys.readouterr().out
    assert "100 Hz" in table
    assert all(str(out / name) in table for name in names)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--to", "pascal"], "pascal"),
        (["--to", "c", "--sample-rate", "-5"], "-5"),
        (["--to", "c", "--sample-rate", "fast"], "fast"),
        (["--to", "c", "--precision", "half"], "half"),
        (["--to", "json", "--precision", "float"], "json"),
        (["--to", "json", "--fixed", "q15"], "q15"),
        (["--to", "c", "--twin"], "--twin"),
        (["--to", "c", "--fixed", "q7"], "q7"),
        (["--to", "c", "--precision", "q15"], "use double or float, or --fixed q15 for integers"),
        (["--to", "c", "--precision", "q31"], "use double or float, or --fixed q31 for integers"),
        (["--to", "c", "--name", "left toe"], "left toe"),
    ],
)
def test_a_wrong_option_is_one_sentence_and_status_2(
    options: list[str], said: str, calibration: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run_command(["export", calibration, *options, "--out", str(out)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert said in line
    assert not out.exists()


def test_a_damaged_calibration_is_status_3(
    calibration: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(calibration).write_text(Path(calibration).read_text()[:200])
    out = tmp_path / "out"
    assert run_command(["export", calibration, "--to", "c", "--out", str(out)]) == 3
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "left_toe.json" in line
    assert not out.exists()


def test_a_shoe_goes_into_one_folder_and_nothing_is_overwritten(
    calibration: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "left_heel.json"
    Calibration(0.316, 1.892, 0.5599, MILLIBAR, unit="left_heel").save(other)
    out = tmp_path / "out"
    words = ["export", calibration, str(other), "--to", "c", "--fixed", "q15", "--out", str(out)]
    assert run_command(words) == 0
    assert {path.name for path in out.glob("*.*")} == {
        "left_toe.h", "left_toe.c", "left_heel.h", "left_heel.c"
    }  # fmt: skip
    (out / "left_toe.h").write_text("mine")
    capsys.readouterr()
    assert run_command(words) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "left_toe.h" in line
    assert "--force" in line
    assert (out / "left_toe.h").read_text() == "mine"
    assert run_command([*words, "--force"]) == 0
    assert "LEFT_TOE_INPUT_LSB" in (out / "left_toe.h").read_text()
