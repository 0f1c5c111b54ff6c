"""The store keeps every calibration, finds the right one, and survives neighbours and damage."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lives import LEFT_TOE, aged, calibration, day

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore, HistoryEvent, default_folder, find
from smartshoe.calibration.store._calibration_store import segment
from smartshoe.calibration.store.dates import iso, moment
from smartshoe.errors import InputError, RefusedError, UsageError
from smartshoe.files.atomic import json_text


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "store")


def put(store: CalibrationStore, at: float, serial_number: str = "S1", **more: object) -> object:
    theta = aged(at, 0.01)
    unit = more.pop("unit", "left_toe")
    return store.add(
        calibration(theta, created=day(at), serial_number=serial_number, unit=str(unit)),
        **more,  # type: ignore[arg-type]
    )


def test_what_goes_in_comes_out(store: CalibrationStore) -> None:
    given_ = calibration()
    entry = store.add(given_, valid_for_days=365, note="first")
    assert entry.calibration() == given_
    assert store.history("S1") == (entry,)
    assert entry.position == "left_toe"
    assert iso(entry.expires) == "2026-01-06"
    # The file is a calibration like any other: every command reads it.
    assert Calibration.load(entry.path) == given_


def test_serial_number_and_date_may_be_given_beside_the_file(store: CalibrationStore) -> None:
    bare = calibration(serial_number="", created="")
    entry = store.add(bare, serial_number="S7", date="2026-03-31T14:30", position="right_heel")
    kept = entry.calibration()
    assert (kept.serial_number, kept.unit, kept.created) == ("S7", "right_heel", "2026-03-31T14:30Z")


@pytest.mark.parametrize(
    ("changes", "more", "says"),
    [
        ({"serial_number": ""}, {}, "serial number"),
        ({"serial_number": "", "created": ""}, {}, "serial number"),
        ({"created": ""}, {}, "--date"),
        ({}, {"serial_number": "S2"}, "S2"),
        ({}, {"valid_for_days": 0.0}, "above 0"),
        ({"created": "last spring"}, {}, "last spring"),
        ({"serial_number": "x" * 81}, {}, "longer"),
    ],
)
def test_what_cannot_be_kept_is_refused_in_a_sentence(
    store: CalibrationStore, changes: dict[str, str], more: dict[str, object], says: str
) -> None:
    with pytest.raises(UsageError, match=says):
        store.add(replace(calibration(), **changes), **more)  # type: ignore[arg-type]
    assert not store.folder.exists()


def test_the_same_calibration_twice_is_one(store: CalibrationStore) -> None:
    assert store.add(calibration()) == store.add(calibration())
    with pytest.raises(UsageError, match="already"):
        store.add(calibration(), valid_for_days=10)
    assert len(store.entries()) == 1


def test_nothing_is_ever_overwritten(store: CalibrationStore) -> None:
    first = put(store, 0)
    before = first.path.read_bytes()
    second = store.add(calibration((0.2, 9.0, 2.0)))
    assert first.path.read_bytes() == before
    assert store.history("S1") == (first, second)
    assert store.latest("S1") == second  # of one date, as they were added


@given(st.text(min_size=1, max_size=40).filter(lambda text: text.strip() and text.isprintable()))
def test_any_serial_number_stays_inside_the_store(tmp_path_factory: pytest.TempPathFactory, serial: str) -> None:
    root = tmp_path_factory.mktemp("any") / "store"
    store = CalibrationStore(root)
    entry = store.add(calibration(serial_number=serial))
    assert entry.path.resolve().parent.parent == (root / "units").resolve()
    assert CalibrationStore(root).history(serial) == (entry,)


def _add_many(folder: str, start: int) -> None:
    store = CalibrationStore(folder)
    for k in range(12):
        store.add(calibration(aged(start + k, 0.01), created=day(k), serial_number=f"S{k % 2}"))


def test_two_processes_add_at_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_add_many, args=(str(tmp_path / "store"), start)) for start in (0, 100)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
        assert worker.exitcode == 0
    store = CalibrationStore(tmp_path / "store")
    assert len(store.entries()) == 24
    assert store.faults == ()


def test_the_index_is_rebuilt_from_the_files(store: CalibrationStore) -> None:
    put(store, 0), put(store, 30)
    store.repair("S1", day(20), "new tube")
    entries, events = store.entries(), store.events()
    index = store.folder / "index.json"
    for damage in (
        b"",
        b"{",
        b"[]",
        b'{"schema": "smartshoe.store.index/1", "files": {"units/x.json": 3}}',
        # The files are as the index has them, and what it says of them is nothing that was ever added.
        *(index.read_bytes().replace(*change) for change in ((b'"order"', b'"ordre"'), (b'"left_toe"', b"12"))),
        index.read_bytes().replace(b'"item": {', b'"item": 0, "was": {'),
        index.read_bytes().replace(b'"item"', b'"was"'),
    ):
        index.write_bytes(damage)
        assert (store.entries(), store.events()) == (entries, events)
        assert store.faults == ()
    index.unlink()
    assert (store.entries(), store.events()) == (entries, events)
    assert len(json.loads(index.read_text())["files"]) == 3


def test_a_file_put_there_or_taken_away_by_hand_is_noticed(store: CalibrationStore, tmp_path: Path) -> None:
    other = CalibrationStore(tmp_path / "other")
    entry = other.add(calibration(serial_number="S9"))
    put(store, 0)
    target = store.folder / "units" / "S9" / entry.path.name
    target.parent.mkdir()
    target.write_bytes(entry.path.read_bytes())
    assert store.serial_numbers == ("S1", "S9")
    target.unlink()
    assert store.serial_numbers == ("S1",)


@pytest.mark.parametrize("change", [{"order": None}, {"serial_number": 7}, {"date": "in spring"}, {"date": None}])
def test_a_file_that_says_what_no_calibration_does_is_left_out_and_told(
    store: CalibrationStore, change: dict[str, object]
) -> None:
    good, bad = put(store, 0), put(store, 30)
    content = json.loads(bad.path.read_text())
    text = json_text({**content, "store": {**content["store"], **change}})
    bad.path.unlink()
    named = f"2025-02-05_{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"  # whole by its name
    (bad.path.parent / named).write_text(text)
    assert store.history("S1") == (good,)
    (fault,) = store.faults
    assert f"{named} is no file of a store" in fault


@pytest.mark.parametrize("damage", ["cut", "changed", "foreign"])
def test_a_damaged_file_is_left_out_and_told(store: CalibrationStore, damage: str) -> None:
    good, bad = put(store, 0), put(store, 30)
    content = bad.path.read_bytes()
    if damage == "cut":
        bad.path.write_bytes(content[: len(content) // 2])
    elif damage == "changed":
        bad.path.write_bytes(content.replace(b'"offset": 0.0', b'"offset": 5.0'))
    else:
        (bad.path.parent / "notes.json").write_text("{}")
    assert good in store.history("S1")
    assert (bad in store.history("S1")) == (damage == "foreign")
    assert len(store.faults) == 1
    assert str(bad.path.parent) in store.faults[0]


# -- what is found ---------------------------------------------------------------------------------------------
def test_nearest_looks_both_ways(store: CalibrationStore) -> None:
    entries = [put(store, at) for at in (0, 100, 300)]
    for at, expected in ((-50, 0), (49, 0), (51, 1), (100, 1), (199, 1), (201, 2), (900, 2)):
        assert store.nearest("S1", day(at)).entry == entries[expected]
    assert "51 days before" not in store.nearest("S1", day(51)).says
    assert store.nearest("S1", day(51)).says.endswith("49 days after that")


def test_of_two_calibrations_as_near_the_earlier_is_taken(store: CalibrationStore) -> None:
    first, second, third = (put(store, at) for at in (0, 100, 300))
    assert store.nearest("S1", day(50)).entry == first
    assert store.nearest("S1", day(200)).entry == second
    assert store.nearest("S1", day(201)).entry == third


@given(st.lists(st.integers(0, 900), min_size=1, max_size=6, unique=True), st.lists(st.integers(0, 900), max_size=3))
def test_no_repair_ever_lies_between_a_date_and_its_calibration(
    tmp_path_factory: pytest.TempPathFactory, calibrated: list[int], repaired: list[int]
) -> None:
    store = CalibrationStore(tmp_path_factory.mktemp("repairs"))
    for at in calibrated:
        put(store, at)
    for at in repaired:
        store.repair("S1", day(at))
    for asked in range(0, 901, 75):
        allowed = [at for at in calibrated if not any(min(at, asked) < r <= max(at, asked) for r in repaired)]
        if not allowed:
            with pytest.raises(RefusedError, match="calibrate it"):
                store.nearest("S1", day(asked))
            continue
        found = store.nearest("S1", day(asked))
        assert abs(found.age_days) == min(abs(at - asked) for at in allowed)


def test_a_calibration_on_the_day_of_the_repair_is_after_it() -> None:
    events = (HistoryEvent("repaired", "S1", moment("2026-01-10")),)
    assert segment(events, moment("2026-01-10")) == (moment("2026-01-10"), None)
    assert segment(events, moment("2026-01-09T23:59")) == (None, moment("2026-01-10"))


def test_expired_is_said_and_refused_only_when_asked(store: CalibrationStore) -> None:
    put(store, 0, valid_for_days=90)
    assert not store.nearest("S1", day(90), refuse_expired=True).is_expired
    found = store.nearest("S1", day(91))
    assert found.is_expired
    assert "has expired" in found.says
    with pytest.raises(RefusedError, match="expired"):
        store.nearest("S1", day(91), refuse_expired=True)


def test_a_retired_unit_is_refused_from_its_day_on(store: CalibrationStore) -> None:
    put(store, 0)
    store.retire("S1", day(50), "tube torn")
    assert store.nearest("S1", day(49)).age_days == 49
    with pytest.raises(RefusedError, match="tube torn"):
        store.nearest("S1", day(50))
    store.place("S1", "left_toe", day(80))
    assert store.nearest("S1", day(81)).entry.serial_number == "S1"


def test_units_that_swap_are_found_by_place_and_date(store: CalibrationStore) -> None:
    put(store, 0, "A"), put(store, 10, "B", unit="right_toe"), put(store, 90, "B", unit="right_toe")
    assert find(store, "left_toe", day(5)).entry.serial_number == "A"
    store.place("B", "left_toe", day(100))
    for at, serial in ((5, "A"), (99, "A"), (100, "B"), (400, "B")):
        assert find(store, "left_toe", day(at)).entry.serial_number == serial
    assert find(store, "B", day(12)).age_days == 2
    assert (store.position_of("A", day(99)), store.position_of("A", day(100))) == ("left_toe", "")
    assert store.position_of("B", day(101)) == "left_toe"
    # B left the right toe for the left one, and nobody was entered in its place.
    store.place("B", "right_toe", day(200))
    with pytest.raises(RefusedError, match="left left_toe for right_toe"):
        find(store, "left_toe", day(201))


def test_of_two_events_of_one_moment_the_one_entered_last_counts(store: CalibrationStore) -> None:
    for serial in ("A", "B", "C"):
        store.place(serial, "left_toe", day(10))
    assert [event.serial_number for event in store.events()] == ["A", "B", "C"]
    assert [event.order for event in store.events()] == [1, 2, 3]
    assert store.unit_at("left_toe", day(10)) == "C"
    assert store.position_of("A", day(10)) == store.position_of("B", day(10)) == ""


def test_an_event_that_is_entered_again_is_the_same_one(store: CalibrationStore) -> None:
    put(store, 0, "A")
    first, placed = store.repair("A", day(10), "new tube"), store.place("A", "left_toe", day(11))
    assert store.repair("A", day(10), "new tube") == first
    assert store.place("A", "left_toe", day(11)) == placed
    assert store.events("A") == (first, placed)
    other = store.repair("A", day(10), "another tube")
    assert (other.order, other.note) == (3, "another tube")


def test_an_event_of_no_unit_is_refused(store: CalibrationStore) -> None:
    with pytest.raises(UsageError, match="serial number"):
        store.repair(" ", day(10))
    assert store.events() == ()
    assert not store.folder.exists()


def test_two_units_that_claim_one_place_are_not_guessed_between(store: CalibrationStore) -> None:
    put(store, 0, "A"), put(store, 10, "B")
    with pytest.raises(RefusedError, match="A, B"):
        find(store, "left_toe", day(20))
    store.place("B", "left_toe", day(15))
    assert find(store, "left_toe", day(20)).entry.serial_number == "B"


@pytest.mark.parametrize("name", ["S2", "right_heel", ""])
def test_an_unknown_unit_is_said(store: CalibrationStore, name: str) -> None:
    put(store, 0)
    with pytest.raises(UsageError):
        find(store, name, day(0))
    with pytest.raises(UsageError, match="S1"):
        store.latest("S2")


def test_an_entry_goes_by_name_or_by_its_code(store: CalibrationStore) -> None:
    first, second = put(store, 0), put(store, 30)
    assert store.entry(first.name) == first
    assert store.entry(second.name.rpartition("_")[2][:8]) == second
    for name in ("2025", "nothing"):
        with pytest.raises(UsageError, match="smartshoe calibrations list"):
            store.entry(name)


def test_where_the_store_lies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SMARTSHOE_STORE", str(tmp_path))
    assert default_folder() == tmp_path
    monkeypatch.delenv("SMARTSHOE_STORE")
    assert default_folder().name == "calibrations"
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="is a file"):
        CalibrationStore(tmp_path / "file")


def test_an_empty_store_is_read_without_being_made(store: CalibrationStore) -> None:
    assert store.entries() == ()
    assert not store.folder.exists()


def test_a_store_that_can_only_be_read_is_read(store: CalibrationStore, monkeypatch: pytest.MonkeyPatch) -> None:
    put(store, 0)
    (store.folder / "index.json").unlink(missing_ok=True)
    # Who may look into a folder and not write there.
    monkeypatch.setattr("smartshoe.calibration.store._files.os.access", lambda _, mode: not mode & os.W_OK)
    assert len(store.entries()) == 1
    assert not (store.folder / "index.json").exists()


@given(st.datetimes(datetime(1990, 1, 1), datetime(2090, 1, 1)))
def test_dates_go_there_and_back(at: datetime) -> None:
    assert moment(iso(at.replace(tzinfo=UTC))) == at.replace(tzinfo=UTC)


def test_a_broken_calibration_is_said_with_its_path(store: CalibrationStore) -> None:
    entry = store.add(calibration(LEFT_TOE))
    entry.path.write_text("{}")
    with pytest.raises(InputError, match=entry.name):
        entry.calibration()


def test_a_full_disk_is_said_and_leaves_nothing_half_written(
    store: CalibrationStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(store, 0)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("smartshoe.calibration.store._files.write_text", full)
    with pytest.raises(UsageError, match="No space left"):
        put(store, 30)
    # What cannot be indexed is read all the same.
    assert len(store.history("S1")) == 1
    assert "index.json" in store.faults[0]
    assert not list(store.folder.rglob("*.partial*"))


def test_a_unit_that_was_placed_and_never_calibrated_is_said(store: CalibrationStore) -> None:
    put(store, 0)
    store.place("S2", "left_toe", day(10))
    with pytest.raises(UsageError, match="no calibration of unit 'S2'"):
        find(store, "left_toe", day(20))
    assert find(store, "left_toe", day(9)).entry.serial_number == "S1"
