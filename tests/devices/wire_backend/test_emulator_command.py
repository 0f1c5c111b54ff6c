"""`python -m simulators.wire.emulator`, as a person runs it; and that nothing of it is needed to import the program."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from puppet import STEP_S

from simulators.wire.emulator import command, load, main
from smartshoe.devices import open_shoe
from smartshoe.errors import ScenarioError

SLOW_START_S = 60.0


@pytest.mark.wire
def test_the_address_that_it_prints_can_be_opened(tmp_path: Path, root: Path) -> None:
    scenario = root / "scenarios" / "wire" / "walk_over_bluetooth.toml"
    emulator = subprocess.Popen(
        [sys.executable, "-m", "simulators.wire.emulator", str(scenario), "--link", "./shoe0", "--duration", "20"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert emulator.stdout is not None
        title, told = emulator.stdout.readline(), emulator.stdout.readline()
        assert "left_toe" in title
        assert told.strip() == "smartshoe stream --shoe serial://./shoe0"
        with open_shoe(f"serial://{tmp_path / 'shoe0'}?wait_s={STEP_S:g}") as shoe:
            assert len(shoe.record(0.5)) > 50
    finally:
        emulator.terminate()
        emulator.communicate(timeout=SLOW_START_S)


@pytest.mark.wire
def test_it_ends_by_itself_and_says_what_it_served(tmp_path: Path) -> None:
    begin_s = time.monotonic()
    link = str(tmp_path / "shoe0")
    result = CliRunner().invoke(command, ["sim:stand?duration_s=1", "--link", link, "--duration", "0.2"])
    assert result.exit_code == 0, result.output
    assert "served 0.2 s" in result.output
    assert not Path(link).is_symlink()
    assert time.monotonic() - begin_s < SLOW_START_S


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[shoe]\nbackend = 'sim:walk'\n[wire]\nloss_percent = 200\n", "line 4, key wire.loss_percent"),
        ("[shoe]\nbackend = 'sim:walk'\n[wire]\nlost = 2\n", "line 4, key wire.lost"),
        ("[wire]\nloss_percent = 2\n", "key shoe"),
        ("[shoe\n", "not valid TOML"),
    ],
)
def test_a_wrong_scenario_names_line_and_key(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "wrong.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match=says):
        load(str(tmp_path / "wrong.toml"))


def test_an_unknown_shoe_is_one_sentence_and_status_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["emulator", "sim:nobody"])
    assert main() == 2
    assert capsys.readouterr().err.strip().count("\n") == 0


def test_everything_imports_where_there_are_no_pseudo_terminals() -> None:
    """As on Windows: the modules that only POSIX has are taken away."""
    program = (
        "import sys\n"
        "for name in ('pty', 'tty', 'termios', 'fcntl'):\n"
        "    sys.modules[name] = None\n"
        "from smartshoe.devices.serial_link import _port, _reader, shoe\n"
        "import simulators.wire.emulator, simulators.wire.serving, simulators.wire.pty_line, simulators.wire.firmware\n"
        "from simulators.wire.pty_line import PtyLine\n"
        "from smartshoe.errors import DeviceError\n"
        "try:\n"
        "    PtyLine('shoe0').appear()\n"
        "except DeviceError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=SLOW_START_S)
    assert done.returncode == 0, done.stderr
    assert "no pseudo-terminals" in done.stdout
