"""A machine run by hand: its log is waited for while it grows, taken once it is whole, and never taken from before."""

from __future__ import annotations

import os
import time
from pathlib import Path
from threading import Thread

import pytest
from bench_sessions import SHORT, SHORT_TOML, bench_plan

from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine
from simulators.wire.serving import Emulator
from smartshoe.cli import run_command
from smartshoe.devices.replay import ReplayedShoe
from smartshoe.errors import DeviceTimeoutError, InputError, UsageError
from smartshoe.files.logs import write
from smartshoe.files.logs.formats.bluehill import write_bluehill
from smartshoe.protocol import Protocol, dynamic_protocol
from smartshoe.recording import Recording
from smartshoe.runs.session import SessionFolder, conduct
from smartshoe.runs.session import _machine_run as machine_run
from smartshoe.runs.session._machine_run import LogByHand


def _pressed(folder: Path, protocol: Protocol = SHORT) -> tuple[Recording, Recording]:
    """The shoe's stream and the machine's log of a simulated pressing."""
    with SessionFolder.begin(folder, bench_plan(protocols=(protocol,))) as session:
        conduct(session)
        attempt = session.attempts()[0]
        return attempt.stream(), attempt.load()


@pytest.fixture
def log(tmp_path: Path) -> Path:
    _, load = _pressed(tmp_path / "made")
    write_bluehill(load, tmp_path / "made" / "log.csv")
    return tmp_path / "made" / "log.csv"


def _machine(target: Path, monkeypatch: pytest.MonkeyPatch, settled_s: float = 0.05) -> LogByHand:
    monkeypatch.setattr(machine_run, "SETTLED_S", settled_s)
    monkeypatch.setattr(machine_run, "LOOK_EVERY_S", 0.0)
    return LogByHand(target, "*.csv", {})


def _waited(machine: LogByHand, seconds: float = 5.0) -> Path | None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        found = machine.log()
        if found is not None:
            return found
        time.sleep(0.01)
    return None


def test_a_log_counts_once_it_is_whole(tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = log.read_text().splitlines(keepends=True)
    target = tmp_path / "log.csv"
    machine = _machine(target, monkeypatch)
    machine.fresh_only = True
    machine.start(SHORT)
    assert machine.log() is None
    assert "is not there" in machine.reason
    half = len(lines) // 3
    target.write_text("".join(lines[:half]))
    assert _waited(machine, 0.3) is None
    assert "N so far" in machine.reason
    with target.open("a") as growing:
        for line in lines[half:]:
            growing.write(line)
    assert _waited(machine) == target


def test_a_log_from_before_the_test_is_not_taken_for_a_live_shoe(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = _machine(log, monkeypatch)
    os.utime(log, (time.time() - 100.0, time.time() - 100.0))
    machine.fresh_only = True
    machine.start(SHORT)
    assert _waited(machine, 0.2) is None
    assert "older than this test" in machine.reason
    machine.fresh_only = False  # a shoe's recording that is played back
    assert _waited(machine) == log


def test_each_test_takes_a_new_file_of_a_folder(tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "bluehill"
    folder.mkdir()
    machine = _machine(folder, monkeypatch)
    for name in ("Specimen_RawData_1.csv", "Specimen_RawData_2.csv"):
        machine.start(SHORT)
        assert _waited(machine, 0.2) is None
        (folder / name).write_bytes(log.read_bytes())
        assert _waited(machine) == folder / name


def test_a_wait_ends_with_what_was_missing(tmp_path: Path, log: Path) -> None:
    stream, _ = _pressed(tmp_path / "again")
    write(stream, tmp_path / "stream.csv")
    plan = bench_plan(shoe=f"replay:{tmp_path / 'stream.csv'}", machine=f"log:{tmp_path / 'none.csv'}", wait_s=0.3)
    with (
        SessionFolder.begin(tmp_path / "late", plan) as folder,
        pytest.raises(DeviceTimeoutError, match="is not there"),
    ):
        conduct(folder)
    (tmp_path / "none.csv").write_text("nothing of use\n")
    with SessionFolder.resume(tmp_path / "late") as folder, pytest.raises(InputError, match="did not come"):
        conduct(folder)
    os.utime(tmp_path / "none.csv", (1.0, 1.0))
    with SessionFolder.resume(tmp_path / "late") as folder, pytest.raises(InputError, match=r"log:.*\?force="):
        conduct(folder)
    (tmp_path / "none.csv").write_bytes(log.read_bytes())
    os.utime(tmp_path / "none.csv", (1.0, 1.0))
    with SessionFolder.resume(tmp_path / "late") as folder:
        conduct(folder)
        assert list(folder.accepted()) == ["short"]


def test_one_log_is_not_two_tests(tmp_path: Path) -> None:
    both = (SHORT, Protocol("again", SHORT.segments))
    with (
        SessionFolder.begin(tmp_path / "s", bench_plan(machine=f"log:{tmp_path / 'x.csv'}", protocols=both)) as folder,
        pytest.raises(UsageError, match="log:FOLDER"),
    ):
        conduct(folder)


@pytest.mark.wire
def test_a_real_port_and_a_log_that_grows_make_a_calibration(tmp_path: Path) -> None:
    """A lab's day in ten seconds: frames over a pseudo-terminal, Bluehill's file written while the machine runs."""
    quick = Protocol("short", dynamic_protocol((400.0, 800.0), rest_s=0.5).segments)
    stream, load = _pressed(tmp_path / "made", quick)
    write_bluehill(load, tmp_path / "made" / "log.csv")
    (tmp_path / "quick.toml").write_text(SHORT_TOML.replace("[200, 800]", "[400, 800]").replace("= 2", "= 0.5"))
    lines = (tmp_path / "made" / "log.csv").read_text().splitlines(keepends=True)
    target = tmp_path / "Specimen_RawData_1.csv"

    def grow() -> None:
        with target.open("w") as file:
            for begin in range(0, len(lines), 60):
                file.write("".join(lines[begin : begin + 60]))
                file.flush()
                time.sleep(0.4)

    emulator = Emulator(Firmware(ReplayedShoe(stream), clock_skew_ppm=50.0), PtyLine(tmp_path / "shoe0"))
    writer = Thread(target=grow)
    with emulator.serving() as url:
        writer.start()
        words = ["--shoe", url, "--machine", f"log:{target}", "--protocol", str(tmp_path / "quick.toml")]
        words += ["--unit", "left_toe", "--yes", "--no-diagnose", "--out", str(tmp_path / "out")]
        status = run_command(["calibrate", *words])
    writer.join()
    assert status == 0
    assert (tmp_path / "out" / "left_toe.json").exists()
