"""Mutated files through every reader: the contract holds, whatever was done to them.

``pytest tests/hostile -m bank`` tries many times as much as the everyday run.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from contract import ended
from hypothesis import given, settings
from hypothesis import strategies as st

import smartshoe
from smartshoe.calibration import Calibration
from smartshoe.errors import SmartShoeError
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

ENDINGS = ("csv", "lvm", "tdms", "mat", "h5")
OURS = ("csv", "lvm")  # read by our own code, which may not rely on the gate
EVERYDAY, BANK = 60, 1300
VALUES = (None, True, -1, 0, 1e308, -1e-308, "", "x" * 5000, "[/red]", "../../x", "\x1b[31m", [], {}, [[]], 10**400)

# An edit: where (share of the file), how many bytes, what takes their place.
edits = st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 24), st.binary(max_size=12)), min_size=1, max_size=6)


def mutated(content: bytes, changes: list[tuple[float, int, bytes]], kept: float) -> bytes:
    """``content`` with every change made, cut to the share ``kept``."""
    for share, length, new in changes:
        at = int(share * len(content))
        content = content[:at] + new + content[at + length :]
    return content[: int(kept * len(content))]


@pytest.fixture(scope="module")
def wholes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small recording in every format, and a calibration."""
    folder = tmp_path_factory.mktemp("wholes")
    time_s = np.arange(24) * 0.01
    recording = Recording.from_arrays(
        time_s=time_s, force_n=100 * time_s, pressure_mbar=10 * time_s, name="x", unit="left_toe"
    )
    found = {}
    for ending in ENDINGS:
        smartshoe.write(recording, folder / f"x.{ending}")
        found[ending] = (folder / f"x.{ending}").read_bytes()
    Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="left_toe").save(folder / "c.json")
    found["json"] = (folder / "c.json").read_bytes()
    return found


def read_or_refused(ending: str, content: bytes) -> None:
    """Convert ``content``; where it is refused, by a fault that our own readers foresaw."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = folder / f"x.{ending}"
        source.write_bytes(content)
        found = ended(["convert", source, folder / "o.csv"], folder)
        if found.status and ending in OURS:
            with pytest.raises(SmartShoeError) as refusal:
                smartshoe.read(source)
            cause = refusal.value.__cause__
            assert not isinstance(cause, LookupError | AttributeError | TypeError), cause


def _tried(examples: int):  # type: ignore[no-untyped-def]  # a decorator
    return lambda test: settings(max_examples=examples)(
        given(changes=edits, kept=st.sampled_from([1.0, 1.0, 1.0, 0.7, 0.2]))(test)
    )


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.filterwarnings("ignore")
@_tried(EVERYDAY)
def test_a_mutated_file_is_read_or_refused(ending: str, wholes: dict[str, bytes], changes, kept) -> None:
    read_or_refused(ending, mutated(wholes[ending], changes, kept))


@pytest.mark.bank
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.filterwarnings("ignore")
@_tried(BANK)
def test_many_mutated_files_are_read_or_refused(ending: str, wholes: dict[str, bytes], changes, kept) -> None:
    read_or_refused(ending, mutated(wholes[ending], changes, kept))


@pytest.mark.filterwarnings("ignore")
@settings(max_examples=EVERYDAY)
@given(data=st.data())
def test_a_calibration_with_another_value_anywhere_is_taken_or_refused(wholes: dict[str, bytes], data) -> None:
    found = json.loads(wholes["json"])
    places: list[tuple[dict | list, str | int]] = []
    waiting: list[dict | list] = [found]
    while waiting:
        each = waiting.pop()
        for key in each if isinstance(each, dict) else range(len(each)):
            places.append((each, key))
            if isinstance(each[key], dict | list):
                waiting.append(each[key])
    for _ in range(data.draw(st.integers(1, 2))):
        holder, key = data.draw(st.sampled_from(places))
        holder[key] = data.draw(st.sampled_from(VALUES))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "c.json").write_text(json.dumps(found))
        (folder / "x.csv").write_bytes(wholes["csv"])
        try:
            Calibration.load(folder / "c.json")
        except SmartShoeError:
            arguments = ["compensate", folder / "x.csv", "--calibration", folder / "c.json", "--out", folder / "o.csv"]
            assert ended(arguments, folder).status == 3


def test_names_of_every_kind_stay_inside(tmp_path: Path) -> None:
    from smartshoe.errors import InputError, UsageError
    from smartshoe.files.gate import inside, require_file_name

    outside = tmp_path / "outside"
    outside.mkdir()
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "link").symlink_to(outside)
    for name in ("../x", "/x", "a/../../x", "..", "", "C:\\x", "\\\\host\\x", "..\\x", "link/x", "a\0b"):
        with pytest.raises(InputError):
            inside(folder, name, "journal.smj")
    assert inside(folder, "raw/log.csv", "journal.smj") == folder / "raw" / "log.csv"
    for name in ("../x", "a/b", "", " ", ".x", "x.", "nul", "COM1.txt", "a\nb", "x" * 181, "a:b", "\x1b[31m"):
        with pytest.raises(UsageError):
            require_file_name(name, "unit")
    for name in ("left_toe", "linke Ferse", "左脚趾", "unit-7"):
        assert require_file_name(name, "unit") == name
