"""What the store and its drift say in words and numbers, and laws that hold whatever the unit of a reading."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from lives import FIRST_DAY, LEFT_TOE, aged, calibration, day
from scipy.stats import t as student

from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.store import CalibrationStore, HistoryEvent, default_folder
from smartshoe.calibration.store import _files as files
from smartshoe.calibration.store.compare import ParameterDifference, compare
from smartshoe.calibration.store.dates import days_between, iso, moment
from smartshoe.calibration.store.drift import Trend, _trend, drift
from smartshoe.calibration.store.quantities import coefficient_covariance, quantities
from smartshoe.errors import UsageError
from smartshoe.models.effects import effect
from smartshoe.models.parameter import Parameter


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "store")


# -- the store ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("at", "says"),
    [
        ("2025-02-01T23:59", "of the same day"),
        ("2025-02-02", "1 day before that"),
        ("2025-01-31T23:59", "1 day after that"),
        ("2025-02-03T01:00", "2 days before that"),
        ("2024-02-01", "366 days after that"),
    ],
)
def test_how_far_away_a_calibration_is_is_said_in_days_of_the_calendar(
    store: CalibrationStore, at: str, says: str
) -> None:
    store.add(calibration(created="2025-02-01"))
    assert store.nearest("S1", at).says.endswith(f"of unit S1, {says}")


def test_what_was_found_is_told_with_its_age(store: CalibrationStore) -> None:
    entry = store.add(calibration(), valid_for_days=10)
    found = store.nearest("S1", day(12))
    assert found.to_dict() == {**entry.to_dict(), "age_days": 12.0, "is_expired": True, "says": found.says}
    assert found.says.endswith(", 12 days before that, has expired: it holds for 10 days")


def test_an_index_that_holds_spares_the_reading_of_the_files(
    store: CalibrationStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = store.add(calibration())
    event = store.repair("S1", day(3))
    assert store.entries() == (entry,)
    read: list[str] = []
    first = files.read_item

    def counted(root: Path, relative: str) -> object:
        read.append(relative)
        return first(root, relative)

    monkeypatch.setattr(files, "read_item", counted)
    assert (store.entries(), store.events()) == ((entry,), (event,))
    assert read == []
    second = store.add(calibration(created=day(9)))
    assert store.entries() == (entry, second)
    assert read == [second.path.relative_to(store.folder).as_posix()]


def test_an_index_of_another_kind_is_not_believed(store: CalibrationStore) -> None:
    entry = store.add(calibration(), note="first")
    assert store.entries() == (entry,)
    index = store.folder / "index.json"
    said = index.read_text().replace('"first"', '"other"')
    index.write_text(said)
    assert store.entries()[0].note == "other"  # of its own kind it is: that is what it is for
    index.write_text(said.replace("index/1", "index/2"))
    assert store.entries() == (entry,)


def test_a_file_that_is_being_written_is_none_of_the_stores_yet(store: CalibrationStore) -> None:
    entry = store.add(calibration())
    (entry.path.parent / f".{entry.path.name}").write_text("{")
    assert (store.entries(), store.faults) == ((entry,), ())


def test_a_calibration_is_named_by_the_beginning_of_its_name_or_code(store: CalibrationStore) -> None:
    first, second = store.add(calibration()), store.add(calibration(created=day(40)))
    assert store.entry(first.name) == store.entry(first.name.rpartition("_")[2][:12]) == first
    assert store.entry("2025-02") == second
    with pytest.raises(UsageError, match=r"'2025' names 2 calibrations in .*store: take a name"):
        store.entry("2025")
    with pytest.raises(UsageError, match=r"'2024' is no calibration in"):
        store.entry("2024")


@pytest.mark.parametrize(("units", "more"), [(1, False), (8, False), (9, True)])
def test_a_unit_that_is_not_there_is_told_beside_those_that_are(
    store: CalibrationStore, units: int, more: bool
) -> None:
    with pytest.raises(UsageError, match=r"unit 'X' in .* \(it is empty\)"):
        store.latest("X")
    for k in range(units):
        store.repair(f"U{k}", day(0))
    with pytest.raises(UsageError, match=r"no calibration of unit 'X'") as found:
        store.latest("X")
    listed = str(found.value).split("(it has ")[1].split(")")[0]
    assert listed == ", ".join(f"U{k}" for k in range(min(units, 8))) + ", ..." * more


def test_a_list_of_one_date_names_places_expiry_and_what_happened(store: CalibrationStore) -> None:
    old, new = store.add(calibration(), valid_for_days=20), store.add(calibration(created=day(30)), valid_for_days=20)
    store.add(calibration(serial_number="S2", unit="left_heel"))
    event = store.repair("S1", day(15), "new tube")
    whole = store.to_dict(day(35))
    assert [unit["serial_number"] for unit in whole["units"]] == ["S1", "S2"]
    assert (whole["schema"], whole["store"], whole["date"]) == ("smartshoe.calibrations/1", str(store), day(35))
    for asked in ("S1", "left_toe"):
        (unit,) = store.to_dict(day(35), asked)["units"]
        assert (unit["serial_number"], unit["position"]) == ("S1", "left_toe")
        assert unit["events"] == [event.to_dict()]
        assert unit["calibrations"] == [
            {**old.to_dict(), "is_expired": True},
            {**new.to_dict(), "is_expired": False},
        ]
    assert event.says == "repaired on 2025-01-21 (new tube)"
    assert store.place("S1", "right_toe", day(40)).says == "placed at right_toe on 2025-02-15"


def test_before_a_unit_was_ever_there_its_place_is_not_known(store: CalibrationStore) -> None:
    store.add(calibration(created=day(10)))
    assert [store.position_of("S1", day(at)) for at in (9, 10, 11)] == ["", "left_toe", "left_toe"]


def test_the_store_is_where_the_environment_says_or_in_the_users_data(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SMARTSHOE_STORE", str(tmp_path / "lab"))
    assert default_folder() == CalibrationStore().folder == tmp_path / "lab"
    monkeypatch.delenv("SMARTSHOE_STORE")
    assert default_folder().parts[-2:] == ("smartshoe", "calibrations")


def test_a_moment_is_of_utc_however_it_is_given() -> None:
    noon = datetime(2026, 3, 31, 12, 0, tzinfo=UTC)
    berlin = timezone(timedelta(hours=2))
    for given in ("2026-03-31T12:00", " 2026-03-31T14:00+02:00 ", noon.replace(tzinfo=None), noon.astimezone(berlin)):
        assert moment(given) == noon
    assert moment(date(2026, 3, 31)) == moment("2026-03-31") == noon - timedelta(hours=12)
    assert [iso(noon + timedelta(seconds=s)) for s in (-43200, 0, 1, 0.5)] == [
        "2026-03-31", "2026-03-31T12:00Z", "2026-03-31T12:00:01Z", "2026-03-31T12:00:00.500000Z",
    ]  # fmt: skip
    assert days_between(noon, noon - timedelta(hours=36)) == -1.5
    with pytest.raises(UsageError, match=r"^the end is 'soon': write it as"):
        moment("soon", "the end")


# -- comparison --------------------------------------------------------------------------------------------------
def test_what_is_fixed_in_both_differs_by_no_number_of_sd() -> None:
    fixed = Parameter.from_sd(1.0, 0.0, "")
    same = ParameterDifference("c", fixed, fixed, 0.0, 0.0)
    assert math.isnan(same.in_sd)
    assert same.to_dict()["in_sd"] is None
    from_zero = ParameterDifference("c", Parameter.from_sd(0.0, 1.0, ""), fixed, 1.0, 2.0)
    assert (from_zero.in_sd, from_zero.to_dict()["percent"]) == (0.5, None)
    fallen = ParameterDifference("c", Parameter.from_sd(-2.0, 0.0, ""), fixed, 3.0, 0.0)
    assert fallen.percent == 150.0


@pytest.mark.parametrize("offset", [5.0, -2.0])
@pytest.mark.parametrize("is_extended", [True, False])
def test_zeros_stand_apart_from_the_forces(offset: float, is_extended: bool) -> None:
    def with_zero(zero: float) -> Calibration:
        made = calibration(offset=zero)
        return extended_calibration(made.model(), load_range_n=(0.0, 800.0)) if is_extended else made

    found = compare(with_zero(0.0), with_zero(offset), (200.0,))
    assert max(abs(item.largest_n) for item in found.forces) < 0.5
    assert found.zero_difference_n == pytest.approx(offset * LEFT_TOE[2] / LEFT_TOE[0], rel=1e-6)


def test_an_effect_beside_the_same_coefficients_is_a_difference() -> None:
    plain = calibration()
    model = plain.model().with_part(effect("dead_band"), np.array([0.02, 0.03, 0.0]))
    other = extended_calibration(model, load_range_n=(0.0, 800.0))
    assert (other.a1, other.b0, other.b1) == pytest.approx((plain.a1, plain.b0, plain.b1))
    for pair, sign in (((plain, other), 1.0), ((other, plain), -1.0)):
        (found,) = compare(*pair, (200.0,)).forces
        assert sign * found.largest_n == pytest.approx(16.0, rel=1e-3)  # of 800 N
        assert math.isnan(found.sd_n)


@pytest.mark.parametrize("theta", [(0.2, 9.9, 0.0), (0.2, 9.9, -2.0)])
def test_coefficients_of_no_passive_solid_are_not_compared(theta: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match="no passive solid"):
        compare(calibration(theta), calibration())


def test_a_comparison_is_said_with_its_size_rate_and_chance() -> None:
    a1, b0, b1 = LEFT_TOE
    found = compare(calibration(), calibration((a1, 0.98 * b0, b1)))
    worst = min(found.forces, key=lambda item: item.largest_n)
    assert worst.rate_n_per_s == 800.0
    share = 100.0 * abs(worst.largest_n) / 800.0
    size = f"forces differ by up to {-worst.largest_n:.3g} N of 800 N ({share:.2g} %), most at 800 N/s"
    assert found.says == f"the unit has changed between the two (chance of errors alone: less than 1 in 10,000): {size}"
    slight = compare(calibration(), calibration((a1, 1.0001 * b0, b1)))
    assert slight.says.startswith(
        f"the two agree within their errors (chance of a larger difference: {100.0 * slight.p_value:.2g} %): forces"
    )
    assert slight.p_value > 0.5
    assert found.to_dict()["parameters"]["b0"]["percent"] == pytest.approx(-2.0)


@pytest.mark.parametrize("rates", [(), (0.0,), (-5.0,), (math.inf,), (math.nan,)])
def test_rates_that_are_none_are_refused(rates: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match="loading rate"):
        compare(calibration(), calibration(), rates)


def test_a_covariance_that_is_none_is_not_used() -> None:
    whole = calibration()
    assert coefficient_covariance(whole) is not None
    rows = [list(row) for row in whole.covariance]
    rows[1][1] = 0.0
    for broken in (
        replace(whole, covariance=whole.covariance[:2]),
        replace(whole, covariance=tuple(map(tuple, rows))),
        replace(whole, parameters={"a1": whole.parameters["a1"]}),
    ):
        assert coefficient_covariance(broken) is None
        assert math.isnan(quantities(broken)["static_gain"].sd)


# -- drift -------------------------------------------------------------------------------------------------------
def trend_of(values: np.ndarray, sds: np.ndarray, lives: list[int] | None = None, step_days: float = 30.0) -> Trend:
    days = step_days * np.arange(values.size)
    dates = [FIRST_DAY + timedelta(days=float(at)) for at in days]
    pieces = np.array(lives or [0] * values.size, dtype=np.intp)
    repairs = [HistoryEvent("repaired", "S1", FIRST_DAY)] * int(pieces[-1])
    return _trend("static_gain", "N/mbar", days, values, sds, pieces, dates, repairs)


@pytest.mark.parametrize("has_errors", [True, False])
@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_a_trend_is_the_same_in_any_unit(scale: float, has_errors: bool) -> None:
    rng = np.random.default_rng(3)
    sds = np.full(10, 0.02) if has_errors else np.full(10, np.nan)
    for values in (9.4 + rng.normal(0.0, 0.02, 10), 9.4 + 0.3 * (np.arange(10) > 5), np.linspace(9.0, 9.5, 10)):
        one, other = trend_of(values, sds), trend_of(scale * values, scale * sds)
        assert one.per_year is not None
        assert other.per_year is not None
        # What is exact is known to its digits: as sure in one unit as in the other.
        assert other.per_year.value == pytest.approx(scale * one.per_year.value, abs=1e-9 * scale)
        assert other.per_year.sd == pytest.approx(scale * one.per_year.sd, rel=1e-3)
        assert other.scatter == pytest.approx(one.scatter, abs=1e-9, nan_ok=True)
        assert (other.moves, len(other.jumps)) == (one.moves, len(one.jumps))


def test_values_with_a_fixed_error_are_weighted_as_those_without_one() -> None:
    values = 9.4 + np.random.default_rng(4).normal(0.0, 0.02, 8)
    assert trend_of(values, np.zeros(8)).per_year == trend_of(values, np.full(8, np.nan)).per_year


def chance_of_a_step(values: np.ndarray, at: int) -> float:
    """By the partial F test of a line with and without a step, times the gaps that are tried."""
    line = np.column_stack([np.ones(values.size), np.arange(values.size)])
    stepped = np.column_stack([line, np.arange(values.size) >= at])
    without, with_it = (float(np.linalg.lstsq(design, values, rcond=None)[1][0]) for design in (line, stepped))
    free = values.size - 3
    return float(2.0 * student.sf(math.sqrt((without / with_it - 1.0) * free), free) * (values.size - 1))


@pytest.mark.parametrize(("count", "at"), [(10, 5), (6, 2), (14, 12)])
def test_a_jump_is_told_where_chance_makes_one_less_than_once_in_a_hundred(count: int, at: int) -> None:
    noise = np.random.default_rng(count).normal(0.0, 0.02, count)

    def stepped(size: float) -> np.ndarray:
        return 9.4 + noise + size * (np.arange(count) >= at)

    sizes = np.linspace(0.0, 1.0, 2001)
    chances = np.array([chance_of_a_step(stepped(size), at) for size in sizes])
    for chance, is_told in ((0.0115, False), (0.0085, True)):
        size = sizes[np.flatnonzero(chances > chance)[-1]]
        found = trend_of(stepped(size), np.full(count, np.nan))
        assert [jump.date for jump in found.jumps] == [FIRST_DAY + timedelta(days=30.0 * at)] * is_told


@pytest.mark.parametrize(("count", "is_told"), [(4, False), (5, True)])
def test_a_jump_is_looked_for_among_five_calibrations_and_more(count: int, is_told: bool) -> None:
    values = 9.4 + 1e-4 * np.resize([1.0, -1.0], count) + 1.0 * (np.arange(count) >= 2)
    assert (len(trend_of(values, np.full(count, np.nan)).jumps) == 1) is is_told


def test_a_life_of_straight_pieces_is_fitted_exactly() -> None:
    lives = [0, 0, 0, 2, 2, 5, 5, 5]  # of two repairs with no calibration between, the last one counts
    days = 30.0 * np.arange(8)
    true = 9.4 + np.array([0.0, 0.0, 0.0, 0.5, 0.5, -0.2, -0.2, -0.2]) - 0.002 * days
    found = trend_of(true, np.full(8, 0.01), lives)
    assert found.pieces.tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    assert found.levels == pytest.approx([9.4, 9.9, 9.2])
    for piece, level in enumerate((9.4, 9.9, 9.2)):
        assert found.fitted(days, piece) == pytest.approx(level - 0.002 * days)
    assert found.per_year is not None
    assert found.per_year.value == pytest.approx(-0.002 * 365.25)
    assert found.per_year.unit == "N/mbar/year"


def test_a_trend_that_cannot_be_told_is_said_so() -> None:
    two, none = np.array([9.0, 9.1]), np.full(2, 0.01)
    assert trend_of(two, none).says == "static gain: 1.22 N/mbar/year, from too few calibrations for an interval"
    parted = trend_of(two, none, [0, 1])
    assert parted.says == "static gain: no trend can be distinguished from the repairs"
    assert parted.repairs[0].says.startswith("static gain changed by 0.1 N/mbar at the repair of")


@pytest.mark.parametrize(("per_year", "verb"), [(0.02, "rises"), (-0.02, "falls"), (0.0, "shows no trend")])
def test_a_drift_is_said_in_newtons_a_year_over_its_days(store: CalibrationStore, per_year: float, verb: str) -> None:
    rng = np.random.default_rng(21) if per_year else None
    for k in range(7):
        store.add(calibration(aged(50.0 * k, per_year), rng=rng, created=day(50.0 * k), sd_share=0.3))
    found = drift(store, "S1")
    gain = found.trends["static_gain"]
    assert gain.per_year is not None
    mean = float(gain.values.mean())
    share, low, high = (bound / mean for bound in (gain.per_year.value, *gain.per_year.ci95))
    verdict = "drifts" if per_year else "shows no drift beyond its errors"
    assert found.says == (
        f"unit S1, 7 calibrations over 300 days: the static gain {verdict}, {800 * share:.2g} N a year at 800 N"
        f" ({800 * low:.2g} to {800 * high:.2g})"
    )
    assert gain.says == (
        f"static gain {verb}: {gain.per_year.value:.3g} N/mbar/year (95 %: {gain.per_year.ci95[0]:.3g} to"
        f" {gain.per_year.ci95[1]:.3g}), {100 * share:.2g} % a year"
    )
    assert share == pytest.approx(per_year, abs=2e-3)


def test_what_one_calibration_lacks_or_all_have_fixed_is_not_followed(store: CalibrationStore) -> None:
    fixed = {"c": Parameter.from_sd(1.0, 0.0, "")}
    for k in range(3):
        made = calibration(created=day(30.0 * k))
        extra = {"tilt": Parameter.from_sd(2.0, 0.1, "")} if k else {}
        store.add(replace(made, parameters={**made.parameters, **fixed, **extra}, covariance=()))
    assert list(drift(store, "S1").trends) == ["static_gain", "a1", "b0", "b1"][1:]


def test_a_repair_that_changes_something_is_told_at_its_date(store: CalibrationStore) -> None:
    rng = np.random.default_rng(22)
    for k in range(8):
        store.add(calibration(aged(0.0, 0.0, 1.1 if k > 3 else 1.0), rng=rng, created=day(30.0 * k)))
    store.repair("S1", day(95)), store.repair("S1", day(100))
    gain = drift(store, "S1").trends["static_gain"]
    (step,) = gain.repairs
    assert step.is_significant
    assert step.date == moment(day(100))
    assert step.to_dict() == {"date": day(100), "change": step.change.to_dict(), "says": step.says}
    low, high = step.change.ci95
    said = f"static gain changed by {step.change.value:.3g} N/mbar (95 %: {low:.3g} to {high:.3g}) at the repair of"
    assert step.says == f"{said} {day(100)}"
    assert gain.says.endswith(f"; {step.says}")
    slight = drift(store, "S1").trends["a1"]
    assert not slight.repairs[0].is_significant
    assert "repair" not in slight.says
