"""Two commands that write to one place at the same moment: both end whole, or one is told and loses the other nothing.

``pytest -m bank tests/hostile/test_two_writers.py -s``
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hosted_commands import Host, Tried, files_of

from smartshoe.calibration.store import CalibrationStore

pytestmark = [pytest.mark.bank, pytest.mark.skipif(not hasattr(os, "fork"), reason="forks the commands")]
ROUNDS = 20
SHARED = ("convert csv", "identify", "export c", "run", "sweep", "study", "gait")  # both write the same, whole
ONE_AT_A_TIME = ("calibrate", "stream")  # what is recorded belongs to the first


@pytest.fixture(scope="module")
def other_host() -> Iterator[Host]:
    found = Host()
    yield found
    found.close()


def _at_once(hosts: tuple[Host, Host], words: tuple[str, str], folder: Path) -> list[int]:
    with ThreadPoolExecutor(2) as both:
        asked = [both.submit(host.run, said, folder) for host, said in zip(hosts, words, strict=True)]
        return sorted(one.result().status for one in asked)


@pytest.mark.parametrize("name", [*SHARED, *ONE_AT_A_TIME])
def test_two_calls_of_one_command_in_one_folder(
    host: Host, other_host: Host, inputs: Path, tmp_path: Path, name: str
) -> None:
    tried = Tried(host, inputs, tmp_path, name)
    words = tried.about.words
    other_host.run(words, tried.fresh(), here=True)
    for _ in range(ROUNDS):
        folder = tried.fresh()
        statuses = _at_once((host, other_host), (words, words), folder)
        assert statuses == ([0, 0] if name in SHARED else [0, 2]), statuses
        assert files_of(folder) == tried.final
        shutil.rmtree(folder)
    print(f"\n{name}: {ROUNDS} times two at once")


def test_two_units_go_into_one_store(host: Host, other_host: Host, inputs: Path, tmp_path: Path) -> None:
    for number in range(ROUNDS):
        folder = tmp_path / str(number)
        shutil.copytree(inputs, folder)
        words = tuple(f"calibrations add C.json --serial-number {serial} --store s" for serial in "89")
        assert _at_once((host, other_host), (words[0], words[1]), folder) == [0, 0]
        store = CalibrationStore(folder / "s")
        assert store.serial_numbers == ("7", "8", "9")
        assert store.faults == ()
    print(f"\ncalibrations add: {ROUNDS} times two at once")
