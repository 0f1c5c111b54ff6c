"""Every command line with hostile files and hostile words: the contract holds. ``pytest -m bank`` tries many more."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
from contract import ended
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration
from smartshoe.files.journal import Journal, read_journal
from smartshoe.protocol import Protocol, Segment
from smartshoe.runs.session import SessionFolder, SessionPlan
from smartshoe.units import MILLIBAR

EVERYDAY, BANK = 40, 3500
WORDS = ("nan", "-1", "0", "1e400", "", " ", "-", "[/red]", "../../x", "\x1b[31m", "x" * 300, "/dev/zero", "nosuch",
         "9" * 400, "sim:walk?x=1", "1[lightyear]", "rows[nanHz]", "99[N]", "left_toe", "a\nb", "=", "%s",
         "{0}")  # fmt: skip
VALUES = (None, True, -1, 0, 1e308, -1e-308, "", "x" * 5000, "[/red]", "../../x", "\x1b[31m", [], {}, [[]], 10**400)
# What each command is given: names of files in the folder, and where a hostile word may stand ("?").
COMMANDS = (
    "convert T o.csv --time ?", "convert T o.h5 --force ?", "convert T o.mat --sensor ? --unit ?", "convert T ?",
    "identify T --calibration o.json --unit ?", "identify T --json o.json --direction ?", "identify T --sensor ?",
    "compensate T --calibration C --out o.csv", "compensate T --calibration C --sensor ?", "validate T --calibration C",
    "validate T --calibration C --json o.json --force ?", "gait T --body-weight ?", "gait T --coverage ? --json o.json",
    "gait T --calibration C --out o", "export C --to c --out o --name ?", "export C --to ? --out o",
    "export C --to matlab --out o", "export C --to c --out o --fixed q15", "export C --to json --out o --name ?",
    "calibrations add C --serial-number ? --store s", "calibrations add C --serial-number 7 --position ? --store s",
    "calibrations show ? --store s", "calibrations list --store ?", "calibrations swap ? ? --store s --date ?",
    "study Y --out o", "study Y --json o.json --out o", "sweep S --out o --jobs ?", "run S --out o --seed ?",
    "simulate S --out o", "simulate S --out o --seed ?", "diagnose T --material ?", "diagnose T --hold-out T",
    "check --shoe ? --calibration C", "stream --shoe ? --duration 1", "stream --shoe sim:stand?side=? --duration ?",
    "calibrate --replay J", "calibrate --resume J --store ?", "? T", "convert T o.csv --limit ?",
)  # fmt: skip
SCENARIO = (
    '[protocol.p]\nkind = "segments"\ncorners = [[0, 0], [1, 50]]\n[[unit]]\nname = "left_toe"\nrecordings = ["T"]\n'
)
STUDY = 'title = "x"\ncalibrations = "C"\n[[trial]]\nfile = "T"\nsubject = "A"\ncondition = "a"\n'


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one small good file of each kind: table, calibration, scenario, study, session."""
    folder = tmp_path_factory.mktemp("whole")
    time_s = np.arange(40) * 0.05
    load_n = 100 * (1 - np.cos(3 * time_s))
    rows = "".join(f"{t:.2f},{f:.3f},{f / 8:.3f}\n" for t, f in zip(time_s, load_n, strict=True))
    (folder / "T").write_text("# name: x\n# unit: left_toe\ntime_s,force_n,left_toe_mbar\n" + rows)
    Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="left_toe").save(folder / "C")
    (folder / "S").write_text(SCENARIO)
    (folder / "Y").write_text(STUDY)
    protocol = Protocol("p", (Segment("ramp", 50.0, 1.0),))
    plan = SessionPlan(shoe="replay:T", machine="log:T", unit="left_toe", protocols=(protocol,), wait_s=0.0)
    with SessionFolder.begin(folder / "J", plan) as session:
        channel = {"name": "left_toe", "unit": "mbar", "range": [0, 200], "resolution": 0.1, "rate_hz": 20.0}
        session.note("stream", shoe="x", channels=[channel], information=None)
        session.note("begin", experiment="p", attempt=1)
    return folder


def _places(found: object) -> list[tuple[dict | list, str | int]]:
    places: list[tuple[dict | list, str | int]] = []
    waiting = [found]
    while waiting:
        each = waiting.pop()
        for key in each if isinstance(each, dict) else range(len(each)) if isinstance(each, list) else ():
            places.append((each, key))  # type: ignore[arg-type]
            waiting.append(each[key])  # type: ignore[index]
    return places


def _other_value(data: st.DataObject, text: str) -> str:
    found = json.loads(text)
    holder, key = data.draw(st.sampled_from(_places(found)))
    holder[key] = data.draw(st.sampled_from(VALUES))
    return json.dumps(found)


def _edited(data: st.DataObject, content: bytes) -> bytes:
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content)))
        new = data.draw(st.binary(max_size=6) | st.sampled_from([word.encode() for word in WORDS]))
        content = content[:at] + new + content[at + data.draw(st.integers(0, 12)) :]
    return content


def _spoil(data: st.DataObject, folder: Path) -> None:
    """One thing wrong with one file of the folder, or nothing."""
    name = data.draw(st.sampled_from(["T", "C", "S", "Y", "J/session.json", "J/journal.smj", "events", ""]))
    if name == "events":
        path = folder / "J" / "journal.smj"
        records = read_journal(path).records
        path.unlink()
        with Journal(path) as journal:
            for record in records:
                said = record.payload.decode()
                journal.append(
                    record.kind, _other_value(data, said).encode() if data.draw(st.booleans()) else record.payload
                )
    elif name in ("C", "J/session.json") and data.draw(st.booleans()):
        (folder / name).write_text(_other_value(data, (folder / name).read_text()))
    elif name:
        (folder / name).write_bytes(_edited(data, (folder / name).read_bytes()))


def _try(data: st.DataObject, whole: Path) -> None:
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "in"
        shutil.copytree(whole, folder)
        _spoil(data, folder)
        words = [word.replace("?", data.draw(st.sampled_from(WORDS))) if "?" in word else word
                 for word in data.draw(st.sampled_from(COMMANDS)).split(" ")]  # fmt: skip
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            patch.setenv("SMARTSHOE_STORE", str(folder / "s"))
            ended(words, Path(made), kept=("J", "s"))
        assert [path.name for path in Path(made).iterdir()] == ["in"]


@pytest.mark.filterwarnings("ignore")
@settings(max_examples=EVERYDAY)
@given(data=st.data())
def test_a_hostile_command_line_ends_as_the_contract_says(whole: Path, data: st.DataObject) -> None:
    _try(data, whole)


@pytest.mark.bank
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=BANK)
@given(data=st.data())
def test_many_hostile_command_lines_end_as_the_contract_says(whole: Path, data: st.DataObject) -> None:
    _try(data, whole)
