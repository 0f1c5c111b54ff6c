"""A session on the simulated bench: the unit's truth comes out, the same again, and an interruption costs nothing."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from bench_sessions import SHORT, SHORT_TOML, bench_plan

from simulators.instruments.presets import TABLE_1
from smartshoe.calibration.store import CalibrationStore
from smartshoe.cli import run_command
from smartshoe.devices import Block
from smartshoe.errors import InputError, LimitError, UsageError
from smartshoe.files.journal import Journal, read_journal
from smartshoe.protocol import static_protocol
from smartshoe.runs.session import SessionFolder, SessionPlan, Unattended, analyse, conduct, protocols_named
from smartshoe.runs.session._folder import SAMPLES
from smartshoe.runs.session._publish import _write
from smartshoe.units import MILLIBAR

BENCH = ["--shoe", "sim:stand?seed=5", "--machine", "sim:instron?seed=6", "--unit", "left_toe", "--no-diagnose"]
NO_PORT = ["--shoe", "serial:///dev/no_such_port", *BENCH[2:]]


@pytest.fixture
def short_file(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(SHORT_TOML)
    return path


@pytest.mark.parametrize("unit", ["left_toe", "left_heel"])
def test_the_units_springs_come_out_of_a_session_within_their_intervals(unit: str, tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan(unit=unit)) as folder:
        conduct(folder)
        analysis = analyse(folder)
    found = analysis.identification
    # What the file says of each experiment is what was found of it, with its error bars, in s and ppm.
    for told in analysis.to_dict()["experiments"]:
        clocks, recording = analysis.clocks[told["name"]], analysis.recordings[told["name"]]
        assert (told["samples"], told["duration_s"]) == (len(recording), recording.duration_s)
        assert told["join"]["delay_s"] == {"value": clocks.delay_s, "sd": clocks.delay_sd_s}
        assert told["join"]["rate_ppm"] == pytest.approx({"value": 1e6 * clocks.rate, "sd": 1e6 * clocks.rate_sd})
    for name, true in zip(("k1", "k2"), TABLE_1[unit], strict=True):
        assert found.parameters[name].value == pytest.approx(true, abs=3.0 * found.parameters[name].sd)
    assert found.residual_tests["whiteness"].p_value > 1e-3


def test_a_session_by_the_command_line_is_stored_and_replays_bit_for_bit(tmp_path: Path, short_file: Path) -> None:
    out, again = tmp_path / "session", tmp_path / "again"
    store = tmp_path / "store"
    common = ["--protocol", str(short_file), "--serial-number", "T7", "--store", str(store), "--valid-for-days", "90"]
    assert run_command(["calibrate", *BENCH, *common, "--out", str(out)]) == 0
    assert run_command(["calibrate", "--replay", str(out), "--out", str(again)]) == 0
    assert (out / "result.json").read_bytes() == (again / "result.json").read_bytes()
    assert (out / "left_toe.json").read_bytes() == (again / "left_toe.json").read_bytes()
    assert {path.name for path in out.iterdir()} >= {"report.html", "raw", "recordings", "journal.smj", "session.json"}
    entry = CalibrationStore(store).latest("T7")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "not given" not in page
    card = page.split('id="session"')[1].split("</section>")[0]
    assert "serial number T7" in card
    assert "no fault found" in card
    assert str(entry.path) in card
    assert "until" in card
    assert entry.valid_for_days == 90.0
    assert entry.calibration().to_dict() == json.loads((out / "left_toe.json").read_text())
    # The stored calibration now says how far the reading will go, and a load that is too much for it is refused.
    heavy = tmp_path / "heavy.toml"
    heavy.write_text(SHORT_TOML.replace("short", "heavy") + "peak_n = 1000\n")
    asked = ["--protocol", str(heavy), *common[2:], "--out", str(tmp_path / "heavy")]
    assert run_command(["calibrate", *BENCH, *asked]) == 2


class _Interrupting(Unattended):
    """Counts the samples that were shown, and stops the session after so many."""

    def __init__(self, after: int) -> None:
        self.shown, self._after = 0, after
        self.told: list[str] = []

    def tell(self, sentence: str) -> None:
        self.told.append(sentence)

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        self.shown += len(block)
        if self.shown >= self._after:
            raise KeyboardInterrupt


def test_an_interrupted_session_keeps_what_was_shown_and_goes_on(tmp_path: Path) -> None:
    second = static_protocol((400.0,), hold_s=1.0, rest_s=1.0)
    operator = _Interrupting(after=4500)
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(SHORT, second))) as folder:
        with pytest.raises(KeyboardInterrupt):
            conduct(folder, operator)
        first = folder.attempts()
    kept = sum(len(r.payload) > 0 for r in read_journal(tmp_path / "journal.smj").records if r.kind == SAMPLES)
    assert kept * 20 >= operator.shown
    assert [(a.experiment, a.state) for a in first] == [("short", "accepted"), ("static", "open")]
    # What the unit remembers of a pressing is in no model: the next one waits for it.
    assert [text.split(":")[0] for text in operator.told if "come to rest" in text] == ["static"]
    with pytest.raises(InputError, match="static is not recorded yet"):
        analyse(SessionFolder.open(tmp_path))
    with SessionFolder.resume(tmp_path) as folder:
        conduct(folder)
        attempts = folder.attempts()
        result = analyse(folder)
    assert [(a.experiment, a.number, a.state) for a in attempts] == [
        ("short", 1, "accepted"),
        ("static", 1, "open"),
        ("static", 2, "accepted"),
    ]
    assert attempts[1].samples > 0
    assert list(result.recordings) == ["short", "static"]
    # What looks wrong may be looked into: the recordings lie where the page says.
    unit, _ = _write(result, tmp_path / "out")
    program, verb, *files = unit.diagnose.split()
    assert (program, verb) == ("smartshoe", "diagnose")
    assert [(tmp_path / "out" / file).is_file() for file in files] == [True, True]


def test_a_damaged_journal_says_so_also_where_it_is_only_read(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path / "s", bench_plan()) as folder:
        conduct(folder)
    with SessionFolder.open(tmp_path / "s") as folder:
        assert folder.notes == ()
    journal = tmp_path / "s" / "journal.smj"
    harmed = bytearray(journal.read_bytes())
    harmed[len(harmed) // 2] ^= 8
    journal.write_bytes(harmed)
    with SessionFolder.open(tmp_path / "s") as folder:
        assert "damaged and left out" in " ".join(folder.notes)


def test_a_raw_log_that_was_changed_since_is_refused(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        conduct(folder)
        (log,) = (tmp_path / "raw").iterdir()
        kept = log.read_bytes()
        at = kept.rindex(b"1")
        log.write_bytes(kept[:at] + b"2" + kept[at + 1 :])
        with pytest.raises(InputError, match="sha256 differs"):
            analyse(folder)
        log.write_bytes(kept)
        assert folder.accepted()["short"].log == log


@pytest.mark.parametrize("is_live", [True, False])
def test_a_live_shoes_block_is_on_disk_before_it_is_shown(
    is_live: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plug pulled behind `keep` costs no sample of a live shoe; those of a virtual clock wait for the next event."""
    on_disk = 0

    def synced(handle: int) -> None:
        nonlocal on_disk
        on_disk = os.fstat(handle).st_size

    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        folder.note("begin", experiment="short", attempt=1)
        for name in ("fsync", "fdatasync"):
            monkeypatch.setattr(os, name, synced)
        folder.note("shoe", says="so far")
        before, time_s = on_disk, np.arange(20.0)
        arrived = {"host_time_s": time_s, "arrival_s": time_s} if is_live else {}
        folder.keep(Block(time_s, np.ones((20, 1)), np.zeros((20, 1), dtype=bool), ("toe",), MILLIBAR, **arrived))
        written = (tmp_path / "journal.smj").stat().st_size
        assert written > before
        assert on_disk == (written if is_live else before)
        folder.note("accepted", findings=[])
        assert on_disk == (tmp_path / "journal.smj").stat().st_size


def test_blocks_survive_the_journal_bit_for_bit(tmp_path: Path) -> None:
    from smartshoe.runs.session import _samples as samples

    rng = np.random.default_rng(0)
    names = ("toe", "heel")
    for live in (True, False):
        times = [np.cumsum(rng.random(5)) for _ in range(3)]
        block = Block(times[0], rng.normal(size=(5, 2)), rng.random((5, 2)) < 0.3, names, MILLIBAR,
                      *(times[1:] if live else (None, None)))  # fmt: skip
        again = samples.unpacked(samples.packed(block), names, MILLIBAR)
        for name in ("time_s", "readings", "missing", "host_time_s", "arrival_s"):
            first, second = getattr(block, name), getattr(again, name)
            assert (first is None) == (second is None)
            assert first is None or np.array_equal(first, second)


def test_a_plan_survives_its_file() -> None:
    plan = bench_plan(serial_number="T7", store="somewhere")
    assert SessionPlan.from_dict(json.loads(json.dumps(plan.to_dict())), "here") == plan


def test_limits_are_checked_before_anything_moves(tmp_path: Path) -> None:
    heavy = static_protocol((2500.0,))
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(SHORT, heavy))) as folder:
        with pytest.raises(LimitError, match="2500 N"):
            conduct(folder)
        assert folder.attempts() == []


def test_protocols_come_by_name_and_from_files_with_line_and_key(tmp_path: Path, short_file: Path) -> None:
    assert [p.name for p in protocols_named(["static", "dynamic", str(short_file)])] == ["static", "dynamic", "short"]
    assert protocols_named([str(short_file)])[0].segments == SHORT.segments
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('[protocol.fast]\nkind = "dynamic"\nrates_n_per_s = [-5]\n')
    with pytest.raises(UsageError, match=r"line 3, key protocol\.fast\.rates_n_per_s"):
        protocols_named([str(wrong)])
    with pytest.raises(UsageError, match="'slow' is not known"):
        protocols_named(["slow"])


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["--shoe", "sim:stand"], 2, "--machine is missing"),
        ([*BENCH, "--out", "OUT"], 2, "needs a protocol"),
        ([*BENCH, "--protocol", "dynamic"], 2, "--out is missing"),
        ([*BENCH, "--unit", "nose", "--protocol", "dynamic", "--out", "OUT"], 2, "nose is no unit"),
        ([*BENCH, "--protocol", "dynamic", "--out", "OUT", "--store", "S"], 2, "--store needs --serial-number"),
        (["--resume", "nowhere"], 2, "holds no session"),
        (["--replay", "nowhere", "--unit", "left_toe"], 2, "leave --unit out"),
        (
            ["--shoe", "serial:///dev/no_such_port", *BENCH[2:], "--protocol", "dynamic", "--out", "OUT"],
            4,
            "no_such_port",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(
    words: list[str], status: int, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(tmp_path / "session") if word == "OUT" else word for word in words]
    assert run_command(["calibrate", *words]) == status
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert last.startswith("error: ")
    assert says in last


def test_a_command_that_recorded_nothing_can_be_given_again(tmp_path: Path, short_file: Path) -> None:
    words = ["calibrate", *BENCH, "--protocol", str(short_file), "--out", str(tmp_path / "session")]
    assert run_command([*words, "--unit", "nose"]) == 2
    assert run_command(words) == 0
    page = (tmp_path / "session" / "report.html").read_text(encoding="utf-8")
    # What was left out is said, and how it is done.
    assert "serial number not given" in page
    assert "only in this folder: with --serial-number it goes into the store" in page
    assert run_command(words) == 2


def test_a_second_session_in_the_same_folder_is_refused_and_loses_the_first_one_nothing(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as first:
        first.note("begin", experiment="short", attempt=1)
        with pytest.raises(UsageError, match="another session"):
            SessionFolder.begin(tmp_path, bench_plan(unit="left_heel"))
        first.note("accepted", findings=[])
    records = read_journal(tmp_path / "journal.smj").records
    assert [json.loads(record.payload)["event"] for record in records] == ["begin", "accepted"]
    assert SessionFolder.open(tmp_path).plan.unit == "left_toe"


def test_samples_without_a_plan_are_not_thrown_away(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal.smj") as journal:
        journal.append(SAMPLES, b"anything")
    with pytest.raises(UsageError, match="holds a session already") as refused:
        SessionFolder.begin(tmp_path, bench_plan())
    # Who was refused lets go of the journal, though the refusal is still being told.
    with Journal(tmp_path / "journal.smj") as journal:
        assert len(journal.recovered.records) == 1
    assert refused.type is UsageError


def test_a_session_in_which_nothing_was_recorded_is_begun_anew(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as first:
        first.note("begin", experiment="short", attempt=1)
    with SessionFolder.begin(tmp_path, bench_plan(unit="left_heel")) as second:
        second.note("begin", experiment="short", attempt=1)
    assert len(read_journal(tmp_path / "journal.smj").records) == 1
    assert SessionFolder.open(tmp_path).plan.unit == "left_heel"
