"""What is asked of a store, at and beside the moment from which the answer is another."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

import pytest
from lives import aged, calibration, day

from smartshoe.calibration.store import CalibrationStore, HistoryEvent, find
from smartshoe.calibration.store._calibration_store import segment
from smartshoe.calibration.store._entry import Entry
from smartshoe.calibration.store.dates import moment
from smartshoe.errors import RefusedError, UsageError


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "store")


def put(store: CalibrationStore, at: float, serial_number: str = "S1", unit: str = "left_toe") -> Entry:
    return store.add(calibration(aged(at, 0.01), created=day(at), serial_number=serial_number, unit=unit))


# -- what goes in --------------------------------------------------------------------------------------------------
def test_what_is_not_given_is_the_calibrations_own(store: CalibrationStore) -> None:
    own = store.add(calibration())
    assert (own.serial_number, own.position, own.date) == ("S1", "left_toe", moment("2025-01-06"))
    assert (own.valid_for_days, own.note, own.order) == (None, "", 1)
    said = store.add(calibration(), serial_number="S1", date=date(2025, 3, 1), position="", valid_for_days=7, note="n")
    assert (said.position, said.date, said.valid_for_days, said.note) == ("", moment("2025-03-01"), 7.0, "n")
    assert isinstance(said.valid_for_days, float)
    kept = said.calibration()
    assert (kept.unit, kept.created) == ("", "2025-01-06")  # when it was made is the calibration's to say
    assert store.entries() == (own, said)


def test_a_date_that_only_the_caller_knows_is_kept_in_the_calibration(store: CalibrationStore) -> None:
    entry = store.add(calibration(created=""), date=datetime(2025, 3, 1, 8, 30))
    assert entry.calibration().created == "2025-03-01T08:30Z"
    assert entry.name.startswith("2025-03-01T0830Z_")


@pytest.mark.parametrize("valid_for_days", [0.0, -1.0, math.inf, math.nan])
def test_a_validity_is_a_number_above_zero(store: CalibrationStore, valid_for_days: float) -> None:
    with pytest.raises(UsageError, match=rf"^valid for {valid_for_days:g} days: give a number above 0, or none$"):
        store.add(calibration(), valid_for_days=valid_for_days)
    assert store.add(calibration(), valid_for_days=1e-3).valid_for_days == 1e-3


def test_a_serial_number_may_be_said_twice_and_not_otherwise(store: CalibrationStore) -> None:
    with pytest.raises(UsageError, match="the calibration says serial number 'S1', not 'S2'"):
        store.add(calibration(), serial_number="S2")
    assert store.add(calibration(), serial_number="").serial_number == "S1"
    assert store.add(calibration(serial_number=""), serial_number="S2").calibration().serial_number == "S2"
    with pytest.raises(UsageError, match="has no serial number"):
        store.add(calibration(serial_number=""))


def test_a_date_that_is_none_is_said_with_its_unit(store: CalibrationStore) -> None:
    with pytest.raises(UsageError, match="the calibration of S1 has no date: give one with --date"):
        store.add(calibration(created=""))
    with pytest.raises(UsageError, match="the date of S1's calibration is 'soon'"):
        store.add(calibration(), date="soon")


@pytest.mark.parametrize("change", [{"date": "2025-01-07"}, {"valid_for_days": 3.0}, {"note": "other"}])
def test_one_calibration_is_kept_once_however_it_is_described(
    store: CalibrationStore, change: dict[str, object]
) -> None:
    about: dict[str, object] = {"date": "2025-01-06", "valid_for_days": 2.0, "note": "first"}
    other, entry = put(store, 30), store.add(calibration(), **about)  # type: ignore[arg-type]
    assert store.add(calibration(), **about) == entry  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=f"this calibration of S1 is in the store already, as {entry.name} with"):
        store.add(calibration(), **{**about, **change})  # type: ignore[arg-type]
    assert store.history("S1") == (entry, other)


def test_calibrations_of_a_unit_are_counted_as_they_come(store: CalibrationStore) -> None:
    assert [put(store, at).order for at in (60, 30, 90)] == [1, 2, 3]
    assert put(store, 10, "S2").order == 1
    assert [entry.order for entry in store.history("S1")] == [2, 1, 3]
    assert [entry.serial_number for entry in store.entries()] == ["S1", "S1", "S1", "S2"]


def test_events_are_counted_over_all_units_and_told_by_date(store: CalibrationStore) -> None:
    late, early = store.retire("S1", day(50)), store.place("S2", " left_toe ", day(10), "by hand")
    same = store.repair("S3", day(10))
    assert [late.order, early.order, same.order] == [1, 2, 3]
    assert early == HistoryEvent("placed", "S2", moment(day(10)), "left_toe", "by hand", 2)
    assert (late.kind, late.position, same.kind, same.position) == ("retired", "", "repaired", "")
    assert store.events() == (early, same, late)
    assert store.events("S2") == (early,)
    assert store.events("S4") == ()
    assert store.serial_numbers == ("S1", "S2", "S3")
    # Of another kind, unit, date or position it is another event.
    for other in (store.repair("S1", day(50)), store.retire("S2", day(50)), store.retire("S1", day(51))):
        assert other.order > 3
    assert store.place("S2", "left_heel", day(10), "by hand").order == 7
    assert store.retire("S1", day(50)) == late


@pytest.mark.parametrize(("position", "says"), [("", "no position"), (" ", "no position"), ("a\tb", "printed")])
def test_a_position_is_named_in_letters(store: CalibrationStore, position: str, says: str) -> None:
    with pytest.raises(UsageError, match=says):
        store.place("S1", position, day(0))
    assert store.events() == ()


# -- which calibration ---------------------------------------------------------------------------------------------
def test_of_two_calibrations_of_one_moment_the_one_added_last_is_used(store: CalibrationStore) -> None:
    first, second = store.add(calibration()), store.add(calibration((0.2, 9.0, 2.0)))
    for at in (-5, 0, 5):
        assert store.nearest("S1", day(at)).entry == second
    assert store.history("S1") == (first, second)
    assert store.latest("S1") == second


def test_a_unit_is_out_of_use_until_it_is_placed_again(store: CalibrationStore) -> None:
    put(store, 0), put(store, 0, "S2")
    store.place("S1", "left_toe", day(40)), store.place("S1", "left_toe", day(50))
    store.place("S2", "left_toe", day(60))
    retired = store.retire("S1", day(50))
    for at, is_refused in ((49, False), (50, True), (70, True), (79, True), (80, False), (90, False)):
        if at == 80:
            store.place("S1", "left_toe", day(80))
        if is_refused:
            with pytest.raises(RefusedError, match=f"^unit S1 was {retired.says}: use the unit that took its place$"):
                store.nearest("S1", day(at))
        else:
            assert store.nearest("S1", day(at)).entry.serial_number == "S1"
    with pytest.raises(RefusedError, match="was retired"):  # of a later placing it knows nothing yet
        store.nearest("S1", day(79))
    store.retire("S1", day(100))
    with pytest.raises(RefusedError, match=rf"was retired on {day(100)}"):
        store.nearest("S1", day(100))
    assert store.nearest("S2", day(100)).entry.serial_number == "S2"


def test_a_placing_at_the_moment_of_retirement_does_not_bring_a_unit_back(store: CalibrationStore) -> None:
    put(store, 0)
    store.retire("S1", day(50)), store.place("S1", "left_toe", day(50))
    with pytest.raises(RefusedError, match="was retired"):
        store.nearest("S1", day(60))
    store.place("S1", "left_toe", day(60))
    assert store.nearest("S1", day(60)).age_days == 60.0


def test_where_no_calibration_lies_between_the_same_repairs_is_said(store: CalibrationStore) -> None:
    put(store, 50)
    store.repair("S1", day(40)), store.repair("S1", day(60)), store.repair("S1", day(80))
    store.repair("S2", day(55))  # of another unit: nothing to it
    between = f"^unit S1 has no calibration since its repair on {day(60)} and before its repair on {day(80)}: calibrate"
    said = {
        79: between,
        39: f"^unit S1 has no calibration before its repair on {day(40)}: calibrate it$",
        60: between,
        80: f"^unit S1 has no calibration since its repair on {day(80)}: calibrate it$",
    }
    for at, says in said.items():
        with pytest.raises(RefusedError, match=says):
            store.nearest("S1", day(at))
    for at in (40, 45, 50, 59):
        assert store.nearest("S1", day(at)).age_days == at - 50
    with pytest.raises(UsageError, match="no calibration of unit 'S2'"):
        store.nearest("S2", day(50))


def test_a_calibration_of_the_moment_of_a_repair_is_of_the_life_after_it(store: CalibrationStore) -> None:
    entry = put(store, 40)
    store.repair("S1", day(40))
    assert store.nearest("S1", day(40)).entry == store.nearest("S1", day(90)).entry == entry
    with pytest.raises(RefusedError, match="before its repair"):
        store.nearest("S1", day(39.99))


def test_the_repairs_about_a_moment_are_those_nearest_to_it() -> None:
    days = [f"2026-01-{at}" for at in (10, 20, 30)]
    repairs = [HistoryEvent("repaired", "S1", moment(at)) for at in reversed(days)]
    placed = HistoryEvent("placed", "S1", moment("2026-01-15"), "left_toe")
    for at, expected in (("05", (None, "10")), ("10", ("10", "20")), ("25", ("20", "30")), ("30", ("30", None))):
        wanted = tuple(None if one is None else moment(f"2026-01-{one}") for one in expected)
        assert segment([*repairs, placed], moment(f"2026-01-{at}")) == wanted
    assert segment([placed], moment("2026-01-20")) == (None, None)


def test_what_has_expired_is_refused_with_its_words(store: CalibrationStore) -> None:
    entry = store.add(calibration(), valid_for_days=2.5)
    says = f"calibration {entry.name} of unit S1, 3 days before that, has expired: it holds for 2.5 days"
    assert store.nearest("S1", day(3)).says == find(store, "S1", day(3)).says == says
    for ask in (store.nearest, lambda *a, **k: find(store, *a, **k)):
        with pytest.raises(RefusedError, match=f"^{says}: calibrate the unit anew, or allow expired calibrations$"):
            ask("S1", day(3), refuse_expired=True)
        assert not ask("S1", "2025-01-08T12:00", refuse_expired=True).is_expired


# -- which place ---------------------------------------------------------------------------------------------------
def test_a_unit_sits_where_it_was_placed_last_until_another_takes_its_place(store: CalibrationStore) -> None:
    put(store, 0, "A", "left_toe"), put(store, 5, "B", "")
    store.place("A", "left_heel", day(10)), store.place("B", "left_toe", day(20))
    (
        store.place("A", "right_toe", day(30)),
        store.place("B", "right_toe", day(40)),
        store.place("A", "left_toe", day(50)),
    )
    where = {
        unit: [store.position_of(unit, day(at)) for at in (-1, 0, 9, 10, 20, 30, 39, 40, 50)] for unit in ("A", "B")
    }
    assert where["A"] == ["", "left_toe", "left_toe", "left_heel", "left_heel", *["right_toe"] * 2, "", "left_toe"]
    assert where["B"] == ["", "", "", "", *["left_toe"] * 3, "right_toe", "right_toe"]
    assert store.position_of("C", day(50)) == ""


def test_a_place_that_only_calibrations_name_is_the_last_ones_that_names_one(store: CalibrationStore) -> None:
    put(store, 0, "A", "left_toe"), put(store, 10, "A", "left_heel"), put(store, 20, "A", "")
    assert [store.position_of("A", day(at)) for at in (0, 9, 10, 25)] == ["left_toe", "left_toe", *["left_heel"] * 2]
    store.place("B", "left_toe", day(12))
    assert store.position_of("A", day(25)) == "left_heel"
    store.place("B", "left_heel", day(15))
    assert [store.position_of("A", day(at)) for at in (14, 15)] == ["left_heel", ""]


def test_who_sits_at_a_place_is_who_was_placed_there_last(store: CalibrationStore) -> None:
    put(store, 0, "A"), put(store, 0, "B", "right_toe")
    store.place("A", "left_toe", day(10)), store.place("B", "left_toe", day(20)), store.place("C", "left_toe", day(30))
    store.place("C", "left_heel", day(40))
    assert [store.unit_at("left_toe", day(at)) for at in (10, 19, 20, 29, 30, 39)] == ["A", "A", "B", "B", "C", "C"]
    left = f"^unit C left left_toe for left_heel on {day(40)} and none was entered in its place: enter one with"
    with pytest.raises(RefusedError, match=left):
        store.unit_at("left_toe", day(40))
    assert store.unit_at("left_heel", day(40)) == "C"
    with pytest.raises(UsageError, match=f"'left_heel' is neither a unit of .* sit on {day(39)}: see"):
        store.unit_at("left_heel", day(39))


def test_before_any_swap_who_claims_a_place_alone_sits_there(store: CalibrationStore) -> None:
    put(store, 0, "A"), put(store, 0, "B"), put(store, 0, "C", "left_heel")
    with pytest.raises(RefusedError, match=r"^2 units claim left_toe \(A, B\): say which"):
        store.unit_at("left_toe", day(5))
    assert store.unit_at("left_heel", day(-5)) == "C"
    store.place("B", "right_toe", day(50))  # who was placed anywhere, at any date, is known by that
    assert store.unit_at("left_toe", day(5)) == "A"
    store.place("C", "left_meta1", day(50))
    assert store.unit_at("left_heel", day(5)) == "C"  # the only one that ever claimed it
    store.place("A", "right_toe", day(60))
    with pytest.raises(UsageError, match="'left_toe' is neither a unit"):
        store.unit_at("left_toe", day(5))


def test_a_serial_number_goes_before_a_place_of_that_name(store: CalibrationStore) -> None:
    put(store, 0, "A", "B"), put(store, 3, "B", "A")
    for unit, at in (("A", 0), ("B", 3)):
        assert find(store, unit, day(5)).entry.serial_number == unit
        assert find(store, unit, day(5)).age_days == 5 - at
    (listed,) = store.to_dict(day(5), "A")["units"]
    assert listed["serial_number"] == "A"


# -- the list ------------------------------------------------------------------------------------------------------
def test_the_list_tells_each_unit_with_what_is_its_own(store: CalibrationStore) -> None:
    names = {"A": [put(store, 0, "A").name], "B": [put(store, 10, "B", "right_toe").name]}
    events = {"B": [store.place("B", "left_heel", day(20)).to_dict()], "C": [store.retire("C", day(5)).to_dict()]}
    found = store.to_dict(day(15))
    assert [(unit["serial_number"], unit["position"]) for unit in found["units"]] == [
        ("A", "left_toe"), ("B", "right_toe"), ("C", ""),
    ]  # fmt: skip
    for unit in found["units"]:
        serial = unit["serial_number"]
        assert [one["name"] for one in unit["calibrations"]] == names.get(serial, [])
        assert unit["events"] == events.get(serial, [])
    (alone,) = store.to_dict(day(25), "left_heel")["units"]
    assert (alone["serial_number"], alone["position"]) == ("B", "left_heel")
    with pytest.raises(UsageError, match="'right_heel' is neither a unit"):
        store.to_dict(day(25), "right_heel")
    with pytest.raises(UsageError, match=r"^--date is 'soon'"):
        store.to_dict("soon")


def test_a_calibrations_code_is_what_its_name_ends_in(store: CalibrationStore) -> None:
    first, second = put(store, 0), put(store, 30)
    for entry in (first, second):
        code = entry.name.split("_")[1]
        assert store.entry(code) == store.entry(code[:10]) == store.entry(entry.name[:14]) == entry
    with pytest.raises(UsageError, match=rf"^'' names 2 calibrations in {store}: take a name"):
        store.entry("")
    with pytest.raises(UsageError, match=rf"^'x' is no calibration in {store}: take a name"):
        store.entry("x")


def test_a_folder_that_is_a_file_is_no_store(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="file is a file: give a folder with --store"):
        CalibrationStore(tmp_path / "file")
    assert CalibrationStore(tmp_path).folder == CalibrationStore(str(tmp_path)).folder == tmp_path
    fresh = CalibrationStore(tmp_path / "new")
    assert (str(fresh), fresh.faults, fresh.entries()) == (str(tmp_path / "new"), (), ())


def test_entries_that_differ_in_nothing_but_their_name_come_in_its_order(store: CalibrationStore) -> None:
    first = store.add(calibration())
    other = CalibrationStore(store.folder.parent / "other")
    second = other.add(replace(calibration(), a1=0.3))  # in a store of its own it has the number 1 as well
    (first.path.parent / second.path.name).write_bytes(second.path.read_bytes())
    found = store.history("S1")
    assert [entry.name for entry in found] == sorted([first.name, second.name])
    assert {entry.order for entry in found} == {1}
