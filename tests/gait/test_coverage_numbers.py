"""How the load beside the units is allowed for, by a course that is published, learned, or read from its file."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from smartshoe.errors import InputError, UsageError
from smartshoe.gait import Contacts, Coverage
from smartshoe.gait._coverage import learn_coverage

NAN = float("nan")
TIME_S = np.arange(1000) / 100.0


def contacts(strike_s: Any = (), off_s: Any = ()) -> Contacts:
    once = np.full((len(strike_s), 1), NAN)
    return Contacts(("heel",), np.array(strike_s), np.array(off_s), once, once, np.zeros(0), np.zeros((0, 1)))


def trial(load: Any, strike_s: Any, off_s: Any) -> Any:
    """A trial of the left foot, of which its loads and contacts are asked."""
    return SimpleNamespace(feet={"left": SimpleNamespace(time_s=TIME_S, load=load, contacts=contacts(strike_s, off_s))})


# -- what passes beside the units ----------------------------------------------------------------------------------
def test_the_midfoot_bears_from_landmark_to_landmark_in_half_cosines() -> None:
    course = np.array(Coverage.midfoot(0.8).course)
    assert course.shape == (101,)
    assert course.mean() == pytest.approx(0.25)
    assert (course[:9] == 0.0).all()
    assert course[80:] == pytest.approx(0.0, abs=1e-15)
    # In body weights: 0.47 at 24 %, half of it half way up, 0.46 at 43 % and 0.05 at 72 %.
    landmarks = {
        16: 0.235,
        24: 0.47,
        43: 0.46,
        72: 0.05,
        76: 0.025,
        50: 0.05 + 0.41 * (0.5 + 0.5 * np.cos(np.pi * 7 / 29)),
    }
    for percent, weights in landmarks.items():
        assert course[percent] / course[24] == pytest.approx(weights / 0.47)
    assert np.max(np.abs(np.array(Coverage.midfoot(1.0).course))) == 0.0
    assert Coverage.midfoot(0.8).least_stance_s == 0.4
    with pytest.raises(UsageError, match="coverage is 0:"):
        Coverage.midfoot(0.0)


def test_a_coverage_says_how_it_is_taken_and_what_it_is_not() -> None:
    assert Coverage(0.8).says == "the same at each moment of a stance"
    assert Coverage(0.8, (0.0,) * 101).says == "by a course over the stance"
    assert (Coverage().share, Coverage().course, Coverage().least_stance_s) == (1.0, None, 0.0)
    assert Coverage(1e-9).share == 1e-9
    for share in (0.0, -1.0, 1.0 + 1e-9, NAN, np.inf):
        with pytest.raises(UsageError, match="above 0, at most 1"):
            Coverage(share)
    with pytest.raises(UsageError, match="102 points: give 101"):
        Coverage(0.8, (0.0,) * 102)


@pytest.mark.parametrize(
    ("strike_s", "off_s", "is_by_course"),
    [(1.0, 1.39, False), (1.0, 1.41, True), (1.0, 3.49, True), (1.0, 3.51, False)],
)
def test_a_course_is_for_stances_that_are_neither_short_nor_standing(
    strike_s: float, off_s: float, is_by_course: bool
) -> None:
    made = Coverage(0.8, tuple(np.linspace(0.0, 1.0, 101)), 0.4)
    borne = 100.0 + TIME_S
    found = made.whole(borne, TIME_S, contacts([strike_s], [off_s]))
    expected = borne / 0.8
    if is_by_course:
        first, last = round(100.0 * strike_s), round(100.0 * off_s)
        own = borne[first:last]
        expected[first:last] = own + own.mean() * (TIME_S[first:last] - strike_s) / (off_s - strike_s)
    assert found == pytest.approx(expected)
    assert Coverage(0.8).whole(borne, TIME_S, contacts([strike_s], [off_s])) == pytest.approx(borne / 0.8)


@pytest.mark.parametrize(
    ("strikes", "offs", "begins", "ends"),
    [
        # Three stances last 0.6, 0.8 and 1 s, and one 4 s: 0.8 s is usual. Cut ones last as long where they may.
        ([NAN], [0.5], [-0.3], [0.5]), ([NAN], [0.805], [], []),
        ([9.5], [NAN], [9.5], [10.3]), ([9.185], [NAN], [], []),
        ([NAN, 9.5], [0.5, NAN], [-0.3, 9.5], [0.5, 10.3]), ([NAN], [NAN], [], []),
    ],
)  # fmt: skip
def test_a_stance_that_is_cut_is_as_long_as_the_usual_one(
    strikes: list[float], offs: list[float], begins: list[float], ends: list[float]
) -> None:
    made, borne = Coverage(0.8, tuple(np.linspace(0.0, 1.0, 101))), np.full(1000, 100.0)
    whole = ([1.0, 2.0, 3.0, 4.0], [1.6, 2.8, 4.0, 8.0])
    starts = [*strikes[:1], *whole[0], *strikes[1:]] if np.isnan(strikes[0]) else [*whole[0], *strikes]
    stops = [*offs[:1], *whole[1], *offs[1:]] if np.isnan(strikes[0]) else [*whole[1], *offs]
    found = made.whole(borne, TIME_S, contacts(starts, stops))
    later = made.whole(borne, 500.0 + TIME_S, contacts(500.0 + np.array(starts), 500.0 + np.array(stops)))
    expected = np.full(1000, 125.0)
    for begin_s, end_s in zip([1.0, 2.0, 3.0, *begins], [1.6, 2.8, 4.0, *ends], strict=True):
        inside = (begin_s - 1e-9 <= TIME_S) & (end_s - 1e-9 > TIME_S)
        expected[inside] = 100.0 + 100.0 * (TIME_S[inside] - begin_s) / (end_s - begin_s)
    assert found == pytest.approx(expected)
    assert later == pytest.approx(expected, abs=3.0)  # a sample more or less


def test_a_whole_stance_beside_the_records_ends_lasts_as_long_as_it_does() -> None:
    made, borne = Coverage(0.8, tuple(np.linspace(0.0, 1.0, 101))), np.full(1000, 100.0)
    spans = ((0.1, 0.5), (3.0, 3.8), (5.0, 5.8), (9.4, 9.9))  # 0.8 s is more than the first and the last
    found = made.whole(borne, TIME_S, contacts(*zip(*spans, strict=True)))
    for strike_s, off_s in spans:
        first, last = round(100.0 * strike_s), round(100.0 * off_s)
        part = (TIME_S[first:last] - strike_s) / (off_s - strike_s)
        assert found[first:last] == pytest.approx(100.0 + 100.0 * part)
    assert found[[9, 55, 935, 995]] == pytest.approx([125.0] * 4)


def test_without_a_whole_stance_a_cut_one_has_the_even_share() -> None:
    made, borne = Coverage(0.5, tuple(np.linspace(0.0, 1.0, 101))), np.full(1000, 100.0)
    for cut in (contacts([NAN], [0.5]), contacts([9.5], [NAN]), contacts([1.001], [1.002]), contacts()):
        assert made.whole(borne, TIME_S, cut).tolist() == [200.0] * 1000


def test_an_even_share_is_kept_as_the_course_that_gives_the_same(tmp_path: Any) -> None:
    Coverage(0.8).save(tmp_path / "even.csv")
    lines = (tmp_path / "even.csv").read_text().splitlines()
    assert lines[:4] == ["# coverage: 0.8", "# least_stance_s: 0.0", "stance_percent,beside_share", "0,0.25"]
    assert (len(lines), lines[-1]) == (104, "100,0.25")
    assert Coverage.load(tmp_path / "even.csv") == Coverage(0.8, (0.25,) * 101)


def test_what_is_no_course_is_told(tmp_path: Any) -> None:
    path = tmp_path / "course.csv"
    Coverage.midfoot(0.8).save(path)
    whole = path.read_text().splitlines()
    plain = [line for line in whole if "least" not in line]
    path.write_text("\n".join(["# a remark", "# learned: on 2026-03-31T14:30", *plain]).replace("# c", "#c"))
    assert Coverage.load(path) == replace(Coverage.midfoot(0.8), least_stance_s=0.0)
    for lines, says in (
        (whole[1:], "give a '# coverage:' line"), (whole[:-1], "101 rows"), ([*whole, "101,0.0"], "101 rows"),
        ([], "101 rows"),
        ([*whole[:2], "percent,share", *whole[3:]], "the header stance_percent,beside_share"),
        ([*whole[:-1], "100,x"], "could not convert"), ([*whole[:-1], "100"], "index out of range"),
        (["# coverage: x", *whole[1:]], "could not convert"), ([*whole[:-1], "100,nan"], "not finite"),
        ([*whole[:-1], "100,inf"], "not finite"),
    ):  # fmt: skip
        path.write_text("\n".join(lines))
        with pytest.raises(InputError, match=says) as told:
            Coverage.load(path)
        assert str(path) in str(told.value)
    with pytest.raises(InputError, match=r"none\.csv does not exist: check its name and folder"):
        Coverage.load(tmp_path / "none.csv")


# -- a course that is learned --------------------------------------------------------------------------------------
def test_a_course_is_learned_from_what_the_plates_say_beyond_the_units() -> None:
    strikes = [0.005 + k for k in range(6)]
    part = (TIME_S - 0.005) % 1.0 / 0.5
    load = np.where(part < 1.0, 100.0, 0.0)[:, None] * np.array([1.0, 3.0])
    plate = load.sum(axis=1) * (1.0 + 0.6 * np.minimum(part, 1.0))
    # A seventh stance stands, and an eighth is cut by the end.
    steps = ([*strikes, 6.0, 9.5], [*(strike_s + 0.5 for strike_s in strikes), 9.0, NAN])
    found = trial(load, *steps)
    made = learn_coverage(found, {"left": plate})
    # The first sample lies at a hundredth, the last at 99: beyond them the course is held.
    assert made.course == pytest.approx(0.6 * np.clip(np.linspace(0.0, 1.0, 101), 0.01, 0.99), abs=1e-9)
    assert made.share == pytest.approx(1.0 / 1.3)
    assert made.least_stance_s == 0.0
    slight = learn_coverage(trial(1e-6 * load, *steps), {"left": 1e-6 * plate})
    assert (slight.share, slight.course) == (pytest.approx(made.share), pytest.approx(made.course))
    # One of the six may lack a sample of its plate, two not.
    plate[120] = np.nan
    assert learn_coverage(found, {"left": plate}).share == pytest.approx(1.0 / 1.3)
    plate[220] = np.inf
    with pytest.raises(InputError, match="known in 4 stances: a course of coverage needs 5 or more"):
        learn_coverage(found, {"left": plate})


def test_a_share_is_one_at_most_and_stances_of_few_samples_or_no_load_do_not_count() -> None:
    load = np.full((1000, 2), 100.0)
    load[700:] = 0.0  # the last one bears nothing
    strikes, plate = [0.995 + k for k in range(7)], np.full(1000, 150.0)
    for few, is_enough in ((0.04, True), (0.03, False)):  # four samples are enough, three are not
        lasts_s = [0.5, 0.5, 0.5, 0.5, few, 0.03, 0.5]
        found = trial(load, strikes, [start_s + last_s for start_s, last_s in zip(strikes, lasts_s, strict=True)])
        if is_enough:
            made = learn_coverage(found, {"left": plate})
            assert made.share == 1.0  # of plates that read less than the units
            assert made.course == pytest.approx([-0.25] * 101)
        else:
            with pytest.raises(InputError, match="known in 4 stances"):
                learn_coverage(found, {"left": plate})


def test_the_stances_of_both_feet_are_learned_from() -> None:
    strikes, load = [0.0, 1.0, 2.0], np.full((1000, 1), 100.0)
    one, other = trial(load, strikes, [0.5, 1.5, 2.5]), trial(3.0 * load, strikes, [0.5, 1.5, 2.5])
    one.feet["right"] = other.feet["left"]
    made = learn_coverage(one, {"left": np.full(1000, 150.0), "right": np.full(1000, 350.0)})
    # 400 of 500 N; of three stances each half and a sixth.
    assert made.share == pytest.approx(0.8)
    assert made.course == pytest.approx([(0.5 + 1.0 / 6.0) / 2.0] * 101)
