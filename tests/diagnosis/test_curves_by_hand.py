"""What is told without a model, and of the loads' range: by written-out sums, and at the very bounds that decide."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds, _characteristic
from smartshoe.diagnosis._characteristic import (
    Branches,
    _explained,
    _slope,
    branches_of,
    characteristic_of,
    friction_of,
)
from smartshoe.diagnosis._ranges import Ranges, _gain, _gain_between_files, ranges_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
FOLLOWS = STANDARD.follows


# -- branches ---------------------------------------------------------------------------------------------------------
def _slow_branches(x: Array, y: Array, step_s: float) -> dict[str, Any]:
    width = max(1, round(0.05 / step_s))
    before, after = (width - 1) // 2, width - 1 - (width - 1) // 2
    sums = []
    for k in range(x.size):  # NumPy's "same": of an even width one sample more behind than before
        sums.append(sum(x[j] for j in range(max(k - after, 0), min(k + before, x.size - 1) + 1)))
    rate = [
        sums[1] - sums[0],
        *(0.5 * (sums[k + 1] - sums[k - 1]) for k in range(1, x.size - 1)),
        sums[-1] - sums[-2],
    ]
    still = 0.02 * float(np.quantile(np.abs(rate), 0.95))
    low, high = np.percentile(x, [1, 99])
    bins = 2 * round((0.5 * x.size) ** (1.0 / 3.0))
    place, ups, downs = [], [], []
    for k in range(bins):
        left, right = low + (high - low) * k / bins, low + (high - low) * (k + 1) / bins
        inside = [j for j in range(x.size) if left <= x[j] < right]
        up = [y[j] for j in inside if rate[j] > still]
        down = [y[j] for j in inside if rate[j] < -still]
        if len(up) > 2 and len(down) > 2:
            place.append(0.5 * (left + right))
            ups.append(float(np.median(up)))
            downs.append(float(np.median(down)))
    mean = 0.5 * (np.array(ups) + np.array(downs))
    curve = y - np.interp(x, place, mean)
    moving = [j for j in range(x.size) if abs(rate[j]) > still]
    off = [y[j] - float(np.interp(x[j], place, ups if rate[j] > 0.0 else downs)) for j in moving]
    return {
        "place": place, "ups": ups, "downs": downs, "mean": mean, "bins": bins,
        "by_curve": 1.0 - np.var(curve) / np.var(y), "by_branch": 1.0 - np.var(off) / np.var(y[moving]),
    }  # fmt: skip


@pytest.mark.parametrize(("seed", "step_s", "size"), [(1, 0.01, 900), (2, 0.02, 400), (3, 0.0125, 1500), (4, 0.2, 250)])
def test_branches_are_medians_over_bins_of_each_direction(seed: int, step_s: float, size: int) -> None:
    """An uneven course with holds, of which some samples lack; a curve with a loop and noise."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0.0, 300.0, 14)
    corners[6] = corners[5]
    load = np.interp(np.arange(size), np.linspace(0, size, 14), corners)
    reading = 0.1 * load + 0.0005 * load**2 + 4.0 * np.sign(np.gradient(load)) + rng.standard_normal(size)
    reading[rng.integers(0, size, 8)] = np.nan
    present = np.isfinite(reading)
    run = Recording.from_arrays(time_s=step_s * np.arange(size), force_n=load, pressure_mbar=reading)
    found, twin = branches_of(run, STANDARD), _slow_branches(load[present], reading[present], step_s)
    assert found is not None
    assert len(twin["place"]) >= twin["bins"] // 2
    for name in ("place", "ups", "downs", "mean"):
        assert getattr(found, name) == pytest.approx(np.array(twin[name]), rel=1e-9)
    assert (found.by_curve, found.by_branch) == (pytest.approx(twin["by_curve"]), pytest.approx(twin["by_branch"]))
    assert found.recording is run


def test_in_less_than_half_of_the_bins_there_are_no_branches() -> None:
    """A load that goes to one and comes back to so much; of bins beyond there is no way back."""
    for foot, is_told in ((0.45, True), (0.62, False)):
        load = np.concatenate([np.linspace(0.0, 1.0, 400), np.linspace(1.0, foot, 400)])
        run = Recording.from_arrays(time_s=0.01 * np.arange(800), force_n=100.0 * load, pressure_mbar=load)
        assert (branches_of(run, STANDARD) is not None) is is_told


def test_of_too_little_and_of_what_never_moves_there_are_no_branches() -> None:
    load = np.abs(np.arange(400) % 40 - 20.0)

    def told(x: Array, y: Array, **more: Any) -> bool:
        time_s = 0.01 * np.arange(x.size)
        run = Recording.from_arrays(time_s=time_s, force_n=x, pressure_mbar=y, **more)
        return branches_of(run, STANDARD) is not None

    assert told(load[:100], load[:100])
    assert not told(load[:99], load[:99])
    assert not told(0.0 * load, load)
    assert not told(load, 0.0 * load)
    bare = Recording.from_arrays(time_s=0.01 * np.arange(400), pressure_mbar=load)
    assert branches_of(bare, STANDARD) is None
    unread = Recording.from_arrays(time_s=0.01 * np.arange(400), force_n=load)
    assert branches_of(unread, STANDARD) is None


def test_what_explains_is_a_share_of_the_variance() -> None:
    values = np.array([1.0, 2.0, 3.0, 6.0])
    assert _explained(values, np.array([1.0, 2.0, 3.0, 4.0])) == pytest.approx(1.0 - 0.75 / 3.5)
    assert _explained(values, values + 9.0) == 1.0
    assert _explained(np.ones(4), values) == 0.0
    among = np.array([True, True, False, True])
    assert _slope(np.array([0.0, 1.0, 5.0, 2.0]), np.array([1.0, 3.0, 99.0, 5.0]), among) == pytest.approx(2.0)


# -- what is said of them ---------------------------------------------------------------------------------------------
def _branches(place: Array, mean: Array, half: Any = 0.0, by_curve: float = 1.0, by_branch: float = 1.0) -> Branches:
    run = Recording.from_arrays(time_s=np.arange(3.0), force_n=np.ones(3), pressure_mbar=np.ones(3))
    return Branches(run, place, mean + half, mean - half, by_curve, by_branch)


def _said(monkeypatch: pytest.MonkeyPatch, found: Branches | None) -> str | None:
    monkeypatch.setattr(_characteristic, "branches_of", lambda recording, thresholds: found)
    run = Recording.from_arrays(time_s=np.arange(3.0), force_n=np.ones(3), pressure_mbar=np.ones(3))
    return characteristic_of(run, STANDARD)


@pytest.mark.parametrize(
    ("ends", "words"),
    [(0.495, "flattens"), (0.505, "nearly straight"), (1.99, "nearly straight"), (2.01, "steepens towards the ends")],
)
def test_a_curve_is_bent_where_its_ends_are_clear_of_its_middle(
    monkeypatch: pytest.MonkeyPatch, ends: float, words: str
) -> None:
    place = np.linspace(100.0, 500.0, 41)  # u = (place - 300) / 200
    bent = np.where(np.abs(place - 300.0) < 75.0, place - 300.0, 0.0)
    bent += np.where(np.abs(place - 300.0) >= 75.0, ends * (place - 300.0), 0.0)
    said = str(_said(monkeypatch, _branches(place, bent)))
    assert words in said
    assert f"by 1 mbar/N about the middle and by {ends:.3g} mbar/N at the ends" in said


def test_slopes_and_the_loop_are_told_over_their_parts_of_the_load(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the span about the middle, the outer halves, the inner half: those very places."""
    place = np.linspace(0.0, 160.0, 81)
    u = (place - 80.0) / 80.0
    mean = 50.0 * u + 30.0 * u**3 + 20.0 * u**4 + 5.0 * u**6
    half = np.where(np.abs(u) < 0.5, 2.0 + np.abs(u), 40.0) * np.where(u > 0, 1.0, -1.0)
    said = str(_said(monkeypatch, _branches(place, mean, half)))
    middle, ends = (float(one) for one in re.findall(r"by ([-\d.]+) mbar/N", said))

    def slope(among: Any) -> float:
        return float(np.polyfit(place[among], mean[among], 1)[0])

    assert middle == pytest.approx(slope(np.abs(u) < 0.25), rel=5e-3)
    assert ends == pytest.approx(0.5 * (slope(u > 0.5) + slope(u < -0.5)), rel=5e-3)
    apart = float(re.findall(r"lie ([\d.]+) mbar to either side", said)[0])
    assert apart == pytest.approx(float(np.median(2.0 + np.abs(u[np.abs(u) < 0.5]))), rel=5e-3)


@pytest.mark.parametrize("places", [7, 10, 11, 13, 14])
def test_of_fewer_than_three_places_in_a_part_no_shape_is_told(monkeypatch: pytest.MonkeyPatch, places: int) -> None:
    place = np.linspace(0.0, 6.0, places)
    u = place / 3.0 - 1.0
    said = str(_said(monkeypatch, _branches(place, 7.0 * place)))
    is_told = min(int(np.sum(part)) for part in (np.abs(u) < 0.25, u > 0.5, u < -0.5)) >= 3
    assert ("nearly straight" in said) is is_told
    assert ("rises by 7 mbar/N on the whole: too little was recorded to tell its shape" in said) is not is_told


@pytest.mark.parametrize(
    ("middle", "ends", "words"),
    [(1.0, -0.6, "turns back"), (-1.0, 3.0, "turns back"), (-1.0, -3.0, "steepens"), (1.0, 0.0, "flattens"),
     (0.0, 1.0, "steepens"), (-1.0, -0.4, "flattens"), (-1.0, -1.0, "nearly straight")],
)  # fmt: skip
def test_a_shape_is_told_of_slopes_of_either_sign(
    monkeypatch: pytest.MonkeyPatch, middle: float, ends: float, words: str
) -> None:
    place = np.linspace(-1.0, 1.0, 41)
    level = np.where(np.abs(place) < 0.4, middle * place, ends * place)
    said = str(_said(monkeypatch, _branches(place, level)))
    assert words in said
    # A reading that falls as the load rises is not said to rise by less than nothing.
    assert ("falls by" in said) is (middle < 0.0 and ends < 0.0)
    assert ("by -" in said) is (middle * ends < 0.0)


def test_what_follows_neither_load_nor_direction_has_no_course(monkeypatch: pytest.MonkeyPatch) -> None:
    place = np.linspace(0.0, 10.0, 20)
    run = Recording.from_arrays(time_s=np.arange(3.0), force_n=np.ones(3), pressure_mbar=np.ones(3))

    def told(by_curve: float, by_branch: float, half: float = 3.0) -> tuple[str | None, str | None]:
        found = _branches(place, 0.0 * place, half, by_curve, by_branch)
        return _said(monkeypatch, found), friction_of(run, STANDARD)

    assert told(0.29, 0.29) == (None, None)
    monkeypatch.setattr(_characteristic, "_is_reproducible", lambda recording, thresholds: True)
    for by_branch in (FOLLOWS, 0.9):
        curve, friction = told(0.29, by_branch)
        assert curve == friction
        assert "lies 3 mbar above its mean" in str(friction)
    assert "lies 3 mbar below its mean" in str(told(0.29, 0.9, half=-3.0)[1])
    curve, friction = told(FOLLOWS, 0.9)
    assert friction is None
    assert "over this load" in str(curve)
    assert "over this load" in str(told(FOLLOWS, 0.1)[0])
    assert _said(monkeypatch, None) is None
    assert friction_of(run, STANDARD) is None


# -- ranges -----------------------------------------------------------------------------------------------------------
SCALE = Scale(800.0, 160.0, MILLIBAR)  # 0.2 mbar/N


def _file(load: Array, reading: Array, fitted: Any = None, name: str = "file") -> Any:
    kept = np.ones(load.size, dtype=bool) if fitted is None else fitted
    return SimpleNamespace(
        conditions=SimpleNamespace(load=load, rate_per_s=np.gradient(load)), reading=reading, fitted=kept,
        usable=np.ones(load.size, dtype=bool), recording=SimpleNamespace(name=name),
    )  # fmt: skip


def _line(low: float, high: float, slope: float = 1.0, at: float | None = None) -> Any:
    """A file from ``low`` to ``high``, which reads ``slope`` within it and ``at`` in its middle."""
    load = np.linspace(low, high, 101)
    middle = load.mean() if at is None else at
    return _file(load, middle + slope * (load - load.mean()))


def _told(*files: Any) -> Ranges:
    at_once: Any = SimpleNamespace(simulate=lambda conditions: conditions.load)  # nothing relaxes
    return ranges_of(files, at_once, SCALE, STANDARD)


def test_a_range_is_narrow_where_its_least_is_more_than_half_of_its_largest() -> None:
    # The hundredth part is 0.51 of the way on.
    for low, is_narrow in ((0.494, False), (0.496, True)):
        assert bool(_told(_line(low, 1.0)).says) is is_narrow
    assert not _told(_line(0.9, 1.0), _line(0.0, 1.0)).says
    assert len(_told(_line(0.9, 1.0), _line(0.85, 1.0)).says) == 1


def test_of_a_load_that_stands_throughout_nothing_is_told() -> None:
    """As under one dead weight: a reading that creeps shows no gain. Files at two levels show one."""
    still = [_file(np.full(101, level), 0.5 + np.linspace(0.0, 0.1, 101)) for level in (0.6, 0.7, 1.3)]
    for files in (still[:1], still[:2]):
        found = _told(*files)
        assert found.is_trap
        assert found.says[0].startswith(f"the load stays at 480 to {560 if len(files) > 1 else 480} N throughout")
    assert not any("throughout" in one for one in _told(*still).says)
    assert not any("throughout" in one for one in _told(_line(0.6, 0.7)).says)


def test_files_without_a_load_in_common_are_no_alike() -> None:
    """One lies all above the other's largest load."""
    assert not any("as high" in one for one in _told(_line(0.90, 0.91), _line(0.92, 0.93)).says)


def test_a_narrow_range_is_told_with_its_numbers() -> None:
    flat, steep = _line(0.8, 1.0, slope=0.6), _line(0.6, 1.0, slope=0.9)
    for files, gain, low in (((flat,), 0.6, "640 to 800"), ((flat, steep), 0.75, "480 to 800")):
        (said,) = _told(*files).says
        assert f"({low} N in file)" in said  # of the one that goes lowest
        assert f"moves by {0.2 * gain:.3g} mbar/N ({5.0 / gain:.4g} N/mbar): what lies below is extrapolated" in said


@pytest.mark.parametrize(("slope", "is_trap"), [(0.501, False), (0.499, True), (1.999, False), (2.001, True)])
def test_a_gain_that_is_clear_of_reading_over_load_is_a_trap(slope: float, is_trap: bool) -> None:
    found = _told(_line(0.8, 1.0, slope, at=0.9))
    assert found.is_trap is is_trap
    assert ("reading over load is 0.2 mbar/N (5 N/mbar)" in found.says[0]) is is_trap
    assert ("none to calibrate by" in found.says[0]) is is_trap


def test_a_gain_within_files_is_held_against_that_between_them() -> None:
    """Between a quarter less and a quarter more: 0.8 to 1.25 of it."""
    for slope, is_told in ((0.81, False), (0.79, True), (1.24, False), (1.26, True), (-0.9, False), (-0.79, True)):
        wide = _told(_line(0.0, 0.4, slope), _line(0.3, 1.0, slope))
        assert bool(wide.says) is is_told
        assert not wide.is_trap
        if is_told:
            assert f"within a file the reading moves by {0.2 * slope:.3g} mbar/N" in wide.says[0]
            assert "between the files by 0.2 mbar/N" in wide.says[0]
    # In narrow files it is a trap; in a file that follows no load it is no gain.
    narrow = _told(_line(0.4, 0.5, 0.7), _line(0.8, 1.0, 0.7))
    assert (narrow.is_trap, len(narrow.says)) == (True, 2)
    assert not _told(_line(0.4, 0.5, 0.9), _line(0.8, 1.0, 0.9)).is_trap
    lost = _file(np.linspace(0.4, 0.5, 101), np.full(101, 0.45))
    assert _told(lost, _line(0.8, 1.0, 0.7)) == Ranges()


def test_a_gain_between_files_is_none_of_a_curve_where_it_is_beyond_all_within() -> None:
    """A chord is as steep as its curve somewhere: files on a parabola say nothing, their zeros moved they do."""
    parts = [np.linspace(low, low + 0.2, 101) for low in (0.0, 0.2, 0.8)]  # the median's slope is not the chord's
    assert _told(*(_file(load, load + load**2) for load in parts)) == Ranges()
    moved = _told(*(_file(load, load + load**2 - 1.5 * load.mean()) for load in parts))
    assert "the zero of reading or load is another in each file" in moved.says[-1]


def test_a_trap_stays_one_whatever_the_files_say() -> None:
    found = _told(_line(0.3, 0.4, 0.3, at=0.9), _line(0.9, 1.0, 0.3, at=1.08))
    assert found.is_trap


def test_of_ten_fitted_samples_nothing_is_said() -> None:
    one = _line(0.9, 1.0, 0.1)
    for count, is_told in ((10, False), (11, True)):
        fitted = np.arange(101) % (101 // count) == 0
        fitted[np.flatnonzero(fitted)[count:]] = False
        assert fitted.sum() == count
        assert bool(_told(_file(one.conditions.load, one.reading, fitted)).says) is is_told
    assert _told() == Ranges()


def test_a_gain_follows_where_the_load_explains_more_than_that_share() -> None:
    load = np.resize([-1.0, 1.0], 100)
    other = np.resize([1.0, 1.0, -1.0, -1.0], 100)
    for share, gain in ((0.29, None), (0.31, pytest.approx(3.0))):
        reading = 3.0 * load + 3.0 * np.sqrt(1.0 / share - 1.0) * other
        assert _gain(5.0 + load, 7.0 + reading, FOLLOWS) == gain
    assert _gain(load, -3.0 * load, FOLLOWS) == pytest.approx(-3.0)
    assert _gain(np.ones(5), np.arange(5.0), FOLLOWS) is None
    assert _gain(np.arange(5.0), np.ones(5), FOLLOWS) is None


def test_between_files_the_gain_is_of_their_means() -> None:
    kept = [(np.array([0.0, 0.2]), np.array([1.0, 3.0])), (np.array([0.4, 0.6]), np.array([4.0, 4.0])),
            (np.array([0.9, 0.9]), np.array([0.0, 1.0]))]  # fmt: skip
    loads, readings = [0.1, 0.5, 0.9], [2.0, 4.0, 0.5]
    assert _gain_between_files(kept, 0.25) == pytest.approx(np.polyfit(loads, readings, 1)[0])
    assert _gain_between_files(kept[:1], 0.25) is None
    assert _gain_between_files(kept[:2], 0.41) is None
    assert _gain_between_files(kept[:2], 0.39) == pytest.approx(5.0)
    level = [(load, np.ones(2)) for load, _ in kept]
    assert _gain_between_files(level, 0.25) is None
