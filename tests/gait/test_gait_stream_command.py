"""``smartshoe gait --stream``: the same files as without, chosen by itself where a recording is large."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from trials import walked

from smartshoe.cli import _gait_stream as gait_stream
from smartshoe.cli import run_command
from smartshoe.files.logs import write


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gait_stream") / "walk.csv"
    write(walked(30.0).recording, path)
    return path


def test_tables_and_numbers_are_those_of_the_whole(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = {}
    for way in ("stream", "whole"):
        assert run_command(["gait", str(walk), "--coverage", "0.8", f"--{way}", "--out", str(tmp_path / way)]) == 0
        results[way] = json.loads((tmp_path / way / "gait.json").read_text(encoding="utf-8"))
    assert "strides" in capsys.readouterr().out
    for table in ("events.csv", "strides.csv"):
        assert (tmp_path / "stream" / table).read_bytes() == (tmp_path / "whole" / table).read_bytes()
    assert set(results["whole"]) < set(results["stream"])
    assert results["stream"]["events"] == results["whole"]["events"]


def test_a_large_recording_goes_through_as_a_stream(
    walk: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run_command(["gait", str(walk), "--json", "-"]) == 0
    said = capsys.readouterr()
    assert "stream" not in json.loads(said.out)
    monkeypatch.setattr(gait_stream, "LARGE_BYTES", 1000)
    assert run_command(["gait", str(walk), "--json", "-"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["stream"]["strides"] > 20
    assert "as a stream (--whole" in said.err


def test_what_needs_the_whole_is_refused(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["gait", str(walk), "--stream", "--c3d", str(tmp_path / "walk.c3d")]) == 2
    assert "--c3d needs the whole trial in memory" in capsys.readouterr().err


def test_a_fault_far_down_leaves_no_tables(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = walk.read_text(encoding="utf-8").splitlines()
    lines[5000] = lines[5000].replace(".", "x", 1)
    broken = tmp_path / "broken.csv"
    broken.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert run_command(["gait", str(broken), "--stream", "--out", str(tmp_path / "out")]) == 3
    assert "line 5001" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
