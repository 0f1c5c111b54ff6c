"""``smartshoe stream``: a line a second, every sample in the file, and an end without loss however it ends."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from bench_sessions import SHORT_TOML, bench_plan

from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine
from simulators.wire.serving import Emulator
from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.devices import open_shoe
from smartshoe.files.logs import read, write
from smartshoe.recording import Recording
from smartshoe.runs.session import SessionFolder, analyse, conduct
from smartshoe.units import MILLIBAR


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A calibration of left_heel in mbar."""
    path = tmp_path_factory.mktemp("calibrations") / "left_heel.json"
    Calibration(0.3, 5.0, 2.5, MILLIBAR, unit="left_heel").save(path)
    return path


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Recording]:
    """Six seconds of a walk as a file, its readings rounded by the shoe's converter."""
    path = tmp_path_factory.mktemp("walks") / "walk.csv"
    with open_shoe("sim:walk", duration_s=6.0) as shoe:
        recording = shoe.record()
    write(recording, path)
    return path, recording


def test_every_sample_is_in_the_file_with_the_force_that_compensate_gives(
    walk: tuple[Path, Recording], calibration: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, recording = walk
    out = tmp_path / "out.csv"
    words = ["stream", "--shoe", f"replay:{path}", "--calibration", str(calibration), "--out", str(out)]
    assert run_command(words) == 0
    written = read(out)
    np.testing.assert_array_equal(written.time_s, recording.time_s)
    for channel in recording.sensors:
        np.testing.assert_array_equal(written[channel.name].values, channel.values)
    filter_ = Calibration.load(calibration).compensator(recording.sample_rate_hz)
    force_n = filter_.apply(recording["left_heel"].values)
    np.testing.assert_allclose(written["left_heel_force_estimate"].values, force_n, rtol=1e-12, atol=1e-9)
    lines = capsys.readouterr().out.splitlines()
    seconds = [line for line in lines if " s " in line]
    assert len(seconds) == 6  # 0 to 5 s
    assert all(len(line) <= 80 and line.count(" to ") == 4 for line in seconds)
    # The second line is of the samples after the first block up to a second later: its least and most, not its last.
    heel = [line.split(" s ")[1].split("  ")[-1] for line in seconds]
    assert max(float(cell.split(" to ")[1]) for cell in heel) == pytest.approx(
        force_n[recording.time_s <= recording.time_s[0] + 5.1].max(), abs=0.06
    )


def test_lost_samples_do_not_shift_the_force_in_time(
    walk: tuple[Path, Recording], calibration: Path, tmp_path: Path
) -> None:
    _, recording = walk
    keep = np.ones(len(recording), dtype=bool)
    keep[300:340] = False
    write(recording.taken(keep), tmp_path / "gappy.csv")
    words = ["stream", "--shoe", f"replay:{tmp_path / 'gappy.csv'}", "--calibration", str(calibration)]
    assert run_command([*words, "--out", str(tmp_path / "out.csv")]) == 0
    held = np.where(keep, recording["left_heel"].values, np.nan)
    expected = Calibration.load(calibration).compensator(200.0).apply(held)[keep]
    written = read(tmp_path / "out.csv")["left_heel_force_estimate"].values
    np.testing.assert_allclose(written, expected, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["--shoe", "serial:///dev/no_such_port"], 4, "no_such_port"),
        (["--shoe", "nothing:here"], 2, "not installed"),
        (["--shoe", "replay:none.csv"], 3, "does not exist"),
        (["--shoe", "sim:walk", "--out", "here.csv"], 2, "not overwritten"),
        (["--shoe", "sim:walk?side=right", "--calibration", "CALIBRATION"], 2, "fits no unit"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(
    words: list[str], status: int, says: str, tmp_path: Path, calibration: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.csv").write_text("kept")
    assert run_command(["stream", *(str(calibration) if word == "CALIBRATION" else word for word in words)]) == status
    error = capsys.readouterr().err.strip().splitlines()
    assert len(error) == 1
    assert says in error[0]
    assert (tmp_path / "here.csv").read_text() == "kept"


def test_a_full_disk_ends_a_stream_with_whole_rows(walk: tuple[Path, Recording], tmp_path: Path) -> None:
    path, recording = walk
    out = tmp_path / "out.csv"
    done = subprocess.run(
        [sys.executable, "-m", "smartshoe", "stream", "--shoe", f"replay:{path}", "--out", str(out)],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000)),
    )
    assert done.returncode == 3
    assert "takes no more data" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr
    written = read(out)
    assert 400 < len(written) < len(recording)
    np.testing.assert_array_equal(written["left_heel"].values, recording["left_heel"].values[: len(written)])


def test_a_full_disk_ends_a_session_with_one_sentence_and_it_goes_on_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT_TOML)
    out = tmp_path / "session"
    words = ["calibrate", "--shoe", "sim:stand", "--machine", "sim:instron", "--unit", "left_toe", "--no-diagnose"]
    done = subprocess.run(
        [sys.executable, "-m", "smartshoe", *words, "--protocol", str(tmp_path / "short.toml"), "--out", str(out)],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, 120_000)),
    )
    assert done.returncode == 3
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("error: ")
    assert "takes no more data" in last
    with SessionFolder.resume(out) as folder:
        assert folder.notes == ()
        assert folder.attempts()[0].samples > 1000
        conduct(folder)
        assert analyse(folder).identification.converged


@pytest.mark.wire
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_a_live_stream_cleanly(how: signal.Signals, tmp_path: Path) -> None:
    out = tmp_path / "live.csv"
    with open_shoe("sim:walk", duration_s=5.0) as shoe:
        emulator = Emulator(Firmware(shoe), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url:
        running = subprocess.Popen(
            [sys.executable, "-m", "smartshoe", "stream", "--shoe", url, "--out", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        until_s = time.monotonic() + 30.0
        while (not out.exists() or out.stat().st_size < 40_000) and time.monotonic() < until_s:
            time.sleep(0.05)
        os.kill(running.pid, how)
        said, errors = running.communicate(timeout=20)
    assert running.returncode == 0, errors
    # Before it come rows of what streams, a second each, and on a busy machine a note that the stream paused.
    assert errors.splitlines()[-1] == "stopped"
    assert "error" not in errors
    assert "Traceback" not in errors
    written = read(out)
    assert f"{out}: {len(written)} samples" in said
    np.testing.assert_allclose(np.diff(written.time_s), 0.005, atol=1e-6)


def test_a_session_and_a_stream_share_no_folder_by_accident(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        conduct(folder)
    assert run_command(["stream", "--shoe", "sim:walk", "--out", str(tmp_path / "journal.smj")]) == 2
