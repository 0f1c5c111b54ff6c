"""What stands on the disk and what is read back: names, content, an index, and every entry and event as an object."""

from __future__ import annotations

import hashlib
import json
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from lives import calibration, day

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore, HistoryEvent
from smartshoe.calibration.store import _files as files
from smartshoe.calibration.store._entry import Entry, Found
from smartshoe.calibration.store.dates import moment
from smartshoe.errors import InputError, UsageError
from smartshoe.files.atomic import json_text

NOON = datetime(2026, 3, 31, 12, 0, tzinfo=UTC)


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "store")


def entry_for(valid_for_days: float | None) -> Entry:
    return Entry("name", "S1", NOON, "left_toe", valid_for_days, "first", 3, "abc", Path("units/S1/name.json"))


def code_of(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def put_by_hand(folder: Path, content: object, name: str = "2025-01-06") -> Path:
    """A file that is whole by its name, whatever it holds."""
    text = content if isinstance(content, str) else json_text(content)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}_{code_of(text)}.json"
    path.write_text(text)
    return path


# -- entries and events --------------------------------------------------------------------------------------------
def test_an_entry_is_told_whole() -> None:
    about = {
        "name": "name", "serial_number": "S1", "date": "2026-03-31T12:00Z", "position": "left_toe",
        "valid_for_days": 1.5, "expires": "2026-04-02", "note": "first", "order": 3, "fingerprint": "abc",
        "path": str(Path("units/S1/name.json")),
    }  # fmt: skip
    assert entry_for(1.5).to_dict() == about
    assert entry_for(1.5).expires == NOON + timedelta(hours=36)
    assert entry_for(None).to_dict() == {**about, "valid_for_days": None, "expires": None}


def test_a_calibration_holds_to_the_end_of_its_last_day_and_as_long_before_its_date() -> None:
    entry, after = entry_for(1.5), timedelta(microseconds=1)
    for away in (timedelta(hours=36), timedelta(hours=-36)):
        assert not entry.is_expired(NOON + away)
        assert entry.is_expired(NOON + away + (after if away > timedelta() else -after))
    assert not entry_for(None).is_expired(NOON + timedelta(days=10000))


def test_what_was_found_knows_its_age_and_its_calibration(store: CalibrationStore) -> None:
    given = calibration()
    entry = store.add(given, valid_for_days=10.0)
    for days, is_expired in ((-10.5, True), (-9.5, False), (0.0, False), (10.0, False), (10.5, True)):
        found = Found(entry, entry.date + timedelta(days=days), "so")
        assert (found.age_days, found.is_expired) == (days, is_expired)
        assert found.to_dict() == {**entry.to_dict(), "age_days": days, "is_expired": is_expired, "says": "so"}
    assert found.calibration() == entry.calibration() == given


def test_an_event_is_told_whole_and_in_a_clause() -> None:
    placed = HistoryEvent("placed", "S1", NOON, "left_toe", "by hand", 4)
    assert placed.to_dict() == {
        "kind": "placed", "serial_number": "S1", "date": "2026-03-31T12:00Z", "position": "left_toe",
        "note": "by hand", "order": 4,
    }  # fmt: skip
    assert placed.says == "placed at left_toe on 2026-03-31T12:00Z (by hand)"
    bare = HistoryEvent("retired", "S1", moment("2026-03-31"))
    assert (bare.position, bare.note, bare.order) == ("", "", 0)
    assert (bare.happened, bare.says) == ("retired", "retired on 2026-03-31")


# -- names ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("serial", "folder"),
    [
        ("S-1_b.2", "S-1_b.2"), ("a/b", "a%2Fb"), ("..", "%2E."), (".x", "%2Ex"), ("x.", "x."), ("a b", "a%20b"),
        ("ü" * 80, "%C3%BC" * 80),
    ],
)  # fmt: skip
def test_a_units_folder_is_its_serial_number_with_what_leads_elsewhere_escaped(serial: str, folder: str) -> None:
    assert files.folder_name(serial) == folder


@pytest.mark.parametrize(
    ("serial", "says"),
    [("", "has no serial number"), (" \t", "has no serial number"), ("a\nb", "cannot be printed"), ("x" * 81, "80")],
)
def test_a_serial_number_that_names_no_folder_is_refused(serial: str, says: str) -> None:
    with pytest.raises(UsageError, match=says):
        files.folder_name(serial)
    with pytest.raises(UsageError, match=says):
        files.write_event(Path("nowhere"), HistoryEvent("retired", serial, NOON))


def test_a_fingerprint_is_of_the_calibration_whatever_the_store_says_of_it() -> None:
    bare = {"b": 1.0, "a": [2, 3]}
    said = hashlib.sha256(b'{"a": [2, 3], "b": 1.0}').hexdigest()
    assert files.fingerprint(bare) == files.fingerprint({"a": [2, 3], "store": {"order": 1}, "b": 1.0}) == said
    assert files.fingerprint({**bare, "b": 1.5}) != said


def test_a_file_is_named_by_its_moment_and_the_beginning_of_its_hash(store: CalibrationStore) -> None:
    entry = store.add(calibration(created="2026-03-31T14:30"), valid_for_days=20, note="first")
    text = entry.path.read_text(encoding="utf-8")
    assert entry.path == store.folder / "units" / "S1" / f"2026-03-31T1430Z_{code_of(text)}.json"
    assert entry.name == entry.path.stem
    kept = json.loads(text)
    assert kept["store"] == {
        "serial_number": "S1", "date": "2026-03-31T14:30Z", "position": "left_toe", "valid_for_days": 20.0,
        "note": "first", "order": 1,
    }  # fmt: skip
    bare = {key: value for key, value in kept.items() if key != "store"}
    assert bare == Calibration.load(entry.path).to_dict()
    assert entry.fingerprint == files.fingerprint(bare)
    event = store.place("S1", "left_heel", "2026-04-01", "swapped")
    (path,) = (store.folder / "events").iterdir()
    assert path.name == f"2026-04-01_{code_of(path.read_text(encoding='utf-8'))}.json"
    assert json.loads(path.read_text()) == {"schema": "smartshoe.store.event/1", **event.to_dict()}


def test_the_same_content_is_not_written_a_second_time(store: CalibrationStore) -> None:
    event = HistoryEvent("retired", "S1", NOON)
    path = files.write_event(store.folder, event)
    os.utime(path, ns=(1, 1))
    assert files.write_event(store.folder, event) == path
    assert path.stat().st_mtime_ns == 1


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (OSError(28, "No space left on device"), "No space left on device"),
        (OSError("odd"), "odd"),
        (UsageError("a folder is in the way"), "a folder is in the way"),
    ],
)
def test_what_cannot_be_written_says_why(
    store: CalibrationStore, monkeypatch: pytest.MonkeyPatch, error: Exception, says: str
) -> None:
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr(files, "write_text", fails)
    with pytest.raises(UsageError, match=rf"2026-03-31T1200Z_\w+\.json cannot be written \({says}\): give a folder"):
        files.write_event(store.folder, HistoryEvent("retired", "S1", NOON))


def test_the_cause_of_what_cannot_be_written_is_said_before_the_words_around_it(
    store: CalibrationStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise UsageError("it did not go") from OSError("disk on fire")

    monkeypatch.setattr(files, "write_text", fails)
    with pytest.raises(UsageError, match=r"\(disk on fire\)"):
        files.write_event(store.folder, HistoryEvent("retired", "S1", NOON))


# -- listing and reading -------------------------------------------------------------------------------------------
def test_the_listing_is_of_the_stores_own_files_with_size_and_time(store: CalibrationStore) -> None:
    first, second = store.add(calibration()), store.add(calibration(serial_number="S0"))
    store.retire("S1", day(3))
    (event,) = (store.folder / "events").iterdir()
    for path in (first.path.parent / ".x.json", first.path.parent / "x.txt", store.folder / "x.json"):
        path.write_text("{}")
    (first.path.parent / "gone.json").symlink_to(store.folder / "nowhere.json")
    found = files.listing(store.folder)
    assert list(found) == [path.relative_to(store.folder).as_posix() for path in (second.path, first.path, event)]
    for relative, state in found.items():
        stat = (store.folder / relative).stat()
        assert state == (stat.st_size, stat.st_mtime_ns)
    assert files.listing(store.folder / "nowhere") == {}


def test_what_is_read_of_a_file_is_what_the_store_said_of_it(store: CalibrationStore) -> None:
    entry, event = store.add(calibration(), valid_for_days=3), store.retire("S1", day(3), "torn")
    (path,) = (store.folder / "events").iterdir()
    relative = entry.path.relative_to(store.folder).as_posix()
    item = files.read_item(store.folder, relative)
    assert item == {
        "serial_number": "S1", "date": "2025-01-06", "position": "left_toe", "valid_for_days": 3.0, "note": "",
        "order": 1, "fingerprint": entry.fingerprint,
    }  # fmt: skip
    assert files.entry_of(store.folder, relative, item) == entry
    of_event = files.read_item(store.folder, f"events/{path.name}")
    assert of_event == event.to_dict()
    assert files.event_of(of_event) == event


@pytest.mark.parametrize("content", ["{", "[]", '"text"', "{}", {"store": 3}, {"store": None}])
@pytest.mark.parametrize("where", ["units/S1", "events"])
def test_a_file_that_is_whole_and_none_of_a_store_is_told(store: CalibrationStore, content: object, where: str) -> None:
    path = put_by_hand(store.folder / where, content)
    with pytest.raises(InputError, match=rf"{path.name} is no file of a store \(.*\): take it out"):
        files.read_item(store.folder, f"{where}/{path.name}")
    assert (store.entries(), store.events()) == ((), ())
    (fault,) = store.faults
    assert path.name in fault


def test_an_event_of_a_kind_to_come_is_left_out_and_told(store: CalibrationStore) -> None:
    kept = store.retire("S1", day(3))
    content = {"schema": "smartshoe.store.event/1", **kept.to_dict(), "kind": "washed"}
    put_by_hand(store.folder / "events", content)
    assert store.events() == (kept,)
    assert store.faults == ("event 'washed' is not known: use a newer smartshoe",)


@pytest.mark.parametrize("key", ["serial_number", "position", "note", "date"])
def test_an_event_whose_words_are_none_is_left_out_and_told(store: CalibrationStore, key: str) -> None:
    kept = store.retire("S1", day(3))
    path = put_by_hand(store.folder / "events", {**kept.to_dict(), key: 7})
    assert store.events() == (kept,)
    (fault,) = store.faults
    assert f"{path.name} is no file of a store (TypeError('{key} is 7, no text')" in fault


@pytest.mark.parametrize("state", [None, [1, 2], "whole"])
def test_an_item_is_believed_only_for_the_very_file_that_it_was_read_from(store: CalibrationStore, state: Any) -> None:
    entry = store.add(calibration(), note="first")
    relative = entry.path.relative_to(store.folder).as_posix()
    now = files.listing(store.folder)[relative]
    item = {**files.read_item(store.folder, relative), "note": "cached"}
    cached = {"state": list(now) if state == "whole" else state, "item": item}
    found, made = files.made_of(store.folder, relative, now, cached)
    assert found["note"] == ("cached" if state == "whole" else "first")
    assert isinstance(made, Entry)
    assert made.note == found["note"]
    assert files.made_of(store.folder, relative, now, None)[1] == entry


# -- the index -----------------------------------------------------------------------------------------------------
def test_the_index_says_what_the_files_do(store: CalibrationStore) -> None:
    store.add(calibration()), store.retire("S1", day(3))
    store.entries()
    index = json.loads((store.folder / "index.json").read_text())
    now = files.listing(store.folder)
    assert index == {
        "schema": "smartshoe.store.index/1",
        "files": {path: {"state": list(now[path]), "item": files.read_item(store.folder, path)} for path in now},
    }
    assert files.read_index(store.folder) == index["files"]


@pytest.mark.parametrize(
    "text", [None, "{", "[]", "{}", '{"schema": "smartshoe.store.index/1"}', '{"schema": "other", "files": {"a": 1}}',
             '{"schema": "smartshoe.store.index/1", "files": ["a"]}'],
)  # fmt: skip
def test_an_index_that_cannot_be_used_is_as_none(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "index.json").write_text(text)
    assert files.read_index(tmp_path) == {}


@pytest.mark.parametrize("lacking", [os.W_OK, os.X_OK])
def test_where_an_index_may_not_be_written_none_is_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lacking: int
) -> None:
    monkeypatch.setattr("smartshoe.calibration.store._files.os.access", lambda _, mode: not mode & lacking)
    assert not files.write_index(tmp_path, {})
    assert not (tmp_path / "index.json").exists()


def test_what_went_wrong_with_an_index_is_said(tmp_path: Path) -> None:
    assert files.write_index(tmp_path, {"a": 1}) == ""
    assert files.read_index(tmp_path) == {"a": 1}
    (tmp_path / "index.json").unlink()
    (tmp_path / "index.json").mkdir()
    (tmp_path / "index.json" / "full").write_text("")
    assert "index.json cannot be written" in files.write_index(tmp_path, {})


def test_an_index_that_says_it_all_is_left_as_it_is(store: CalibrationStore) -> None:
    store.add(calibration())
    store.entries()
    index = store.folder / "index.json"
    os.utime(index, ns=(1, 1))
    store.entries()
    assert index.stat().st_mtime_ns == 1
    store.retire("S1", day(3))
    store.entries()
    assert index.stat().st_mtime_ns != 1


def test_a_store_whose_files_are_gone_keeps_its_index_and_finds_nothing(store: CalibrationStore) -> None:
    entry = store.add(calibration())
    store.entries()
    entry.path.unlink()
    assert (store.entries(), store.faults) == ((), ())
