"""What writes to disk, step by step: after each step a check that all that was acknowledged until then is there."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from smartshoe.calibration import Calibration
from smartshoe.calibration.export import export_files, write_files
from smartshoe.calibration.store import CalibrationStore
from smartshoe.devices import Block
from smartshoe.files.atomic import make_folder, write_text
from smartshoe.files.journal import AppendedFile, Journal, read_journal
from smartshoe.live._recorder import Layout, LiveRecording, interrupted_at, journal_path
from smartshoe.protocol import Protocol, Segment
from smartshoe.recording import Recording
from smartshoe.runs.session import SessionFolder, SessionPlan
from smartshoe.runs.session.streaming import StreamTable
from smartshoe.units import MILLIBAR

Check = Callable[[Path], None]
"""Given what is left of the folder, raises where something acknowledged is not in it."""
Writer = Callable[[Path], Iterator[Check]]
CALIBRATION = Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="left_toe", created="2026-01-01")


def _is(name: str, content: bytes, left: Path) -> None:
    assert (left / name).read_bytes() == content


def results(folder: Path) -> Iterator[Check]:
    """A result, and another one in its place, in a folder of a folder."""
    for text in ("as it was", "and as it is"):
        write_text(make_folder(folder / "out" / "results") / "result.json", text)
        yield partial(_is, "out/results/result.json", text.encode())


def journal(folder: Path) -> Iterator[Check]:
    """A journal that nothing else brings to disk; one record waits for the next."""

    def holds(payloads: list[bytes], left: Path) -> None:
        assert [record.payload for record in read_journal(left / "journal").records] == payloads

    with Journal(folder / "journal") as made:
        for number in range(3):
            made.append(1, bytes([number]) * 20)
            yield partial(holds, [bytes([k]) * 20 for k in range(number + 1)])
        made.append(1, b"waits", synced=False)
        made.append(1, b"does not")
        yield partial(holds, [*(bytes([k]) * 20 for k in range(3)), b"waits", b"does not"])


def table(folder: Path) -> Iterator[Check]:
    """A file that grows."""
    with AppendedFile(folder / "walk.csv", new=True) as made:
        for piece in (b"time_s,left_toe_mbar\n", b"0.0,1.5\n", b"0.01,1.25\n"):
            made.append(piece)
            yield partial(_is, "walk.csv", (folder / "walk.csv").read_bytes())


def stream(folder: Path) -> Iterator[Check]:
    """``stream --out``."""
    made = StreamTable(folder / "stream.csv", _block(0), (), {"shoe": "x"})
    for number in range(3):
        made.append(_block(number), {})
        yield partial(_is, "stream.csv", (folder / "stream.csv").read_bytes())
    made.close()


def recording(folder: Path) -> Iterator[Check]:
    """``live --record``: rows that were acknowledged, notes, and an end."""
    told = threading.Semaphore(0)

    def holds(rows: int, left: Path) -> None:
        found = interrupted_at(left / "walk.csv", [""])
        assert found is not None
        assert (left / "walk.csv").read_text().count("\n") == 2 + rows

    def has_ended(left: Path) -> None:
        assert [record.kind for record in read_journal(journal_path(left / "walk.csv")).records] == [1, 2]

    layout = Layout(folder / "walk.csv", ("left_toe_mbar",), {"shoe": "x"})
    made = LiveRecording(folder / "walk.csv", [layout], lambda shoe, count: told.release(), lambda says: None)
    for number in range(2):
        made.samples(0, _block(number))
        assert told.acquire(timeout=60)
        yield partial(holds, 4 * (number + 1))
    made.note({"mark": 1})
    made.close()
    yield has_ended


def store(folder: Path) -> Iterator[Check]:
    """A store where there was none: a calibration, a place, another unit."""

    def holds(units: list[str], events: int, left: Path) -> None:
        found = CalibrationStore(left / "store")
        assert [entry.serial_number for entry in found.entries()] == units
        assert len(found.events()) == events
        assert found.faults == ()

    made = CalibrationStore(folder / "store")
    made.add(CALIBRATION, serial_number="7")
    yield partial(holds, ["7"], 0)
    made.place("7", "left_toe", "2026-01-02")
    yield partial(holds, ["7"], 1)
    made.add(CALIBRATION, serial_number="8")
    yield partial(holds, ["7", "8"], 1)


def session(folder: Path) -> Iterator[Check]:
    """A session from its first event to a pressing that is accepted: plan, blocks of a live shoe, the machine's log."""

    def holds(samples: int, state: str, left: Path) -> None:
        (attempt,) = SessionFolder.open(left / "sessions" / "one").attempts()
        assert (attempt.samples, attempt.state) == (samples, state)

    def has_log(left: Path) -> None:
        (attempt,) = SessionFolder.open(left / "sessions" / "one").attempts()
        assert attempt.load().load.values.size == 5

    plan = SessionPlan(
        shoe="replay:T", machine="log:T", unit="left_toe", protocols=(Protocol("p", (Segment("ramp", 50.0, 1.0),)),)
    )
    with SessionFolder.begin(folder / "sessions" / "one", plan) as made:
        yield lambda left: SessionFolder.open(left / "sessions" / "one").close()
        channel = {"name": "left_toe", "unit": "mbar", "range": [0, 200], "resolution": 0.1, "rate_hz": 20.0}
        made.note("stream", shoe="x", channels=[channel], information=None)
        made.note("begin", experiment="p", attempt=1)
        yield partial(holds, 0, "open")
        for number in range(2):
            made.keep(_block(number))
            yield partial(holds, 4 * (number + 1), "open")
        time_s = np.arange(5) * 0.1
        made.keep_log(Recording.from_arrays(time_s=time_s, force_n=9 * time_s, pressure_mbar=time_s), "p_1", {})
        yield has_log
        made.note("accepted", experiment="p", attempt=1, findings=[])
        yield partial(holds, 8, "accepted")


def code(folder: Path) -> Iterator[Check]:
    """Exported C in a folder that was not there."""
    files = export_files(CALIBRATION, "c")
    write_files(files, folder / "firmware")

    def holds(left: Path) -> None:
        assert {path.name: path.read_text() for path in (left / "firmware").iterdir()} == files

    yield holds


def _block(number: int) -> Block:
    """Four samples of one unit, as a live shoe sends them."""
    time_s = 0.05 * (4 * number + np.arange(4))
    return Block(time_s, time_s[:, None] * 2.0, np.zeros((4, 1), dtype=bool), ("left_toe",), MILLIBAR, None, time_s)


WRITERS: dict[str, Writer] = {
    made.__name__: made for made in (results, journal, table, stream, recording, store, session, code)
}
