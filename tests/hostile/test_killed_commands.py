"""A command killed at any step on disk leaves each result as it was or whole, and does its work when called again.

The long run: ``pytest -m bank tests/hostile/test_killed_commands.py -s`` (every step of every command).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.units import MILLIBAR

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks the commands")
OLD = b"as it was"
# Each with the results that stood there before; a store has no file that changes.
COMMANDS: dict[str, tuple[str, ...]] = {
    "convert T.csv o.csv": ("o.csv",),
    "convert T.csv o.h5": ("o.h5",),
    "convert T.csv o.mat": ("o.mat",),
    "convert T.csv o.tdms": ("o.tdms",),
    "convert T.csv o.lvm": ("o.lvm",),
    "compensate T.csv --calibration C.json --out o.csv": ("o.csv",),
    "export C.json --to c --out o --force": ("o/smartshoe_filter.c", "o/smartshoe_filter.h"),
    "calibrations add C.json --serial-number 8 --store s": (),
}
EVERYDAY = ("calibrations add C.json --serial-number 8 --store s",)


class Host:
    """The process that forks the commands."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("killed_commands.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        assert self._line() == "ready"

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def run(self, command: str, folder: Path, step: int) -> tuple[int, int]:
        """The status (-9: killed) of ``command`` in ``folder``, killed at ``step`` (0: never), and its steps."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([step, str(folder), command.split(" ")]) + "\n")
        self._process.stdin.flush()
        status, steps = json.loads(self._line())
        return status, steps

    def close(self) -> None:
        """End it."""
        self._process.communicate()


@pytest.fixture(scope="module")
def host() -> Iterator[Host]:
    found = Host()
    yield found
    found.close()


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What every command reads."""
    folder = tmp_path_factory.mktemp("inputs")
    time_s = np.arange(1500) * 0.02
    load_n = 100 * (1 - np.cos(1.3 * time_s)) + 40 * (1 - np.cos(3.1 * time_s))
    remembered_n = 0.02 * np.cumsum(load_n * np.exp(0.2 * (time_s - time_s[-1]))) * np.exp(0.2 * (time_s[-1] - time_s))
    readings = load_n / 8 + 0.02 * remembered_n + 0.02 * np.random.default_rng(1).standard_normal(time_s.size)
    rows = "".join(f"{t:.2f},{f:.3f},{p:.3f}\n" for t, f, p in zip(time_s, load_n, readings, strict=True))
    (folder / "T.csv").write_text("time_s,force_n,pressure_mbar\n" + rows)
    calibration = Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="left_toe", created="2026-01-01")
    calibration.save(folder / "C.json")
    CalibrationStore(folder / "s").add(calibration, serial_number="7")
    return folder


def _fresh(inputs: Path, folder: Path, command: str) -> Path:
    shutil.copytree(inputs, folder)
    for name in COMMANDS[command]:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(OLD)
    return folder


def _results(folder: Path) -> dict[str, bytes]:
    """Every file that is no temporary one, by its name in ``folder``; the index only saves time.

    A MAT-file begins with the time at which it was written.
    """
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()[124 if path.suffix == ".mat" else 0 :]
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith(".") and path.name != "index.json"
    }


def _killed(host: Host, inputs: Path, root: Path, command: str, chosen: Any) -> int:
    """Kill ``command`` at the steps ``chosen(steps)``; the number of kills."""
    whole = _fresh(inputs, root / "whole", command)
    status, steps = host.run(command, whole, 0)
    assert status == 0, command
    assert steps > 2, command
    final, kills = _results(whole), 0
    for number, step in enumerate(chosen(steps)):
        folder = _fresh(inputs, root / str(number), command)
        before = _results(folder)
        status, _ = host.run(command, folder, step)
        assert status == -9, (command, step)
        kills += 1
        for name, content in _results(folder).items():
            assert content in (before.get(name), final.get(name)), (command, step, name)
        assert before.keys() <= _results(folder).keys(), (command, step)
        assert host.run(command, folder, 0)[0] == 0, (command, step)
        assert _results(folder) == final, (command, step)
        shutil.rmtree(folder)
    return kills


@pytest.mark.parametrize("command", EVERYDAY)
def test_a_killed_command_leaves_results_whole(host: Host, inputs: Path, tmp_path: Path, command: str) -> None:
    assert _killed(host, inputs, tmp_path, command, lambda steps: (2, steps // 2, steps)) == 3


@pytest.mark.bank
@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_killed_at_every_step(host: Host, inputs: Path, tmp_path: Path, command: str) -> None:
    kills = _killed(host, inputs, tmp_path, command, lambda steps: range(1, steps + 1))
    print(f"\n{command}: killed at each of {kills} steps")
