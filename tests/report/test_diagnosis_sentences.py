"""What is said of a diagnosis, alike on the page and on a terminal: numbers, shares, the comparison."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest
from diagnoses_made import BASELINE, LEAK, LEAK_CAUSE, PLAY_CAUSE, case
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.diagnosis import Gain, Rival, Thresholds
from smartshoe.diagnosis._causes import _how_sure
from smartshoe.diagnosis._result import Verdict
from smartshoe.display import sure
from smartshoe.models.effects import effect, listed, shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import Parameter
from smartshoe.report.diagnosis._sentences import (
    Row,
    comparison,
    gain_sentence,
    gain_text,
    heading,
    interval,
    less_likely,
    likelier,
    meanings,
    not_in_the_model,
    nothing_left,
    on_causes,
    parameter_text,
    percent_of_whole,
    shares,
    shares_text,
    two_numbers,
    what_is_left,
    what_was_gained,
    why_this_one,
)

percent = st.floats(-50.0, 150.0)


def test_a_cause_is_said_to_be_less_likely_otherwise_by_what_its_rivals_are_weighed_by() -> None:
    text = "no other effect of the catalogue does as well; the nearest, zero drift,"
    assert why_this_one(LEAK_CAUSE) == f"{text} is less likely by 88"
    assert why_this_one(replace(LEAK_CAUSE, rivals=(Rival("zero_drift", 88.0, "fit"),))) == f"{text} fits worse by 88"
    assert why_this_one(replace(LEAK_CAUSE, rivals=())) == "no other effect of the catalogue comes near"
    several = replace(PLAY_CAUSE, equivalents=("bouc_wen_hysteresis", "dead_band"))
    assert why_this_one(several) == (
        "bouc wen hysteresis and dead band cannot be ruled out, since no equation is exact: take the name as one of 3"
    )


def test_a_free_form_says_no_more_than_all_its_laws_do() -> None:
    """A curve that bends up and one that bends down cannot both be steepest at low loads."""
    alone = replace(LEAK_CAUSE, effect=effect("contact_area"), part="flexible_curve", equivalents=())
    assert alone.says == effect("contact_area").says
    assert replace(alone, equivalents=("gas_compression",)).says == effect("flexible_curve").says
    assert replace(alone, part="contact_area", equivalents=("gas_compression",)).says == alone.says


def test_a_parameter_means_what_it_does_in_its_own_equation() -> None:
    """The free form of a softening has a gain of that name, of another load cycle."""
    law, form = effect("cycle_conditioning"), effect("flexible_softening")
    cause = replace(LEAK_CAUSE, effect=law, part=form.name, parameters=dict.fromkeys(p.name for p in law.parameters))
    assert meanings(cause) == {one.name: one.says for one in law.parameters}


def test_a_rival_that_is_likelier_is_told_as_such_and_not_as_less_likely() -> None:
    """Also beside effects that cannot be ruled out; a difference below one half is none."""
    near = (Rival("clock_drift", -155.0), Rival("zero_drift", 0.4), Rival("delay", 0.6), Rival("dead_band", 45.0))
    cause = replace(LEAK_CAUSE, rivals=near)
    assert [(one.name, one.margin) for one in likelier(cause)] == [
        ("clock drift", "is likelier by 155"), ("zero drift", "is as likely"),
    ]  # fmt: skip
    assert [(one.name, one.margin) for one in less_likely(cause)] == [
        ("delay", "is less likely by only 0.6"), ("dead band", "is less likely by 45"),
    ]  # fmt: skip
    alone = "clock drift alone in its place is likelier by 155"
    assert why_this_one(cause) == alone
    assert why_this_one(replace(cause, equivalents=("zero_drift",))) == (
        f"zero drift cannot be ruled out, since no equation is exact: take the name as one of 2; {alone}"
    )
    untold = replace(cause, equivalents=("clock_drift", "zero_drift"))
    assert likelier(untold) == []
    assert "alone" not in why_this_one(untold)


@given(
    margins=st.dictionaries(
        st.sampled_from(["zero_drift", "delay", "dead_band", "orifice_leak"]), st.floats(-200.0, 200.0)
    ),
    equivalents=st.lists(st.sampled_from(["zero_drift", "orifice_leak", "gas_heat"]), unique=True),
    is_sure=st.booleans(),
    kind_only=st.booleans(),
    alone=st.sampled_from([None, "linear_leak", "delay"]),
)
def test_what_is_said_of_a_cause_does_not_contradict_itself(
    margins: dict[str, float], equivalents: list[str], is_sure: bool, kind_only: bool, alone: str | None
) -> None:
    rivals = tuple(sorted((Rival(*one) for one in margins.items()), key=lambda one: one.margin))
    name: Any = SimpleNamespace(
        effect=LEAK_CAUSE.effect, equivalents=tuple(equivalents), is_sure=is_sure, kind_only=kind_only,
        kind_probability=0.5, doubt="",
    )  # fmt: skip
    found: Any = SimpleNamespace(best_single=None if alone is None else effect(alone))
    evidence = tuple(_how_sure(name, None, rivals, found, Thresholds()))
    cause = replace(LEAK_CAUSE, rivals=rivals, equivalents=name.equivalents, evidence=evidence)
    this_one = why_this_one(cause)
    others_may_be = "cannot be ruled out" in this_one or "alone in its place" in this_one
    assert others_may_be is not this_one.startswith("no other effect of the catalogue")
    if not is_sure:
        assert ("other effects do as well" in cause.doubt) is others_may_be
    if is_sure and kind_only:
        assert ("rules the others out" in cause.doubt) is bool(equivalents)


@pytest.mark.parametrize(
    ("margin", "by", "said"),
    [
        (88.0, "evidence", "is less likely by 88"),
        (278533.0, "evidence", "is less likely by 278,533"),
        (9.96, "fit", "fits worse by 10"),
        (1.7, "fit", "fits worse by 1.7"),
        (0.4, "fit", "fits as well"),
        (-0.4, "evidence", "is as likely"),
        (-3.0, "fit", "fits better by 3"),
        (-432.0, "evidence", "is likelier by 432"),
    ],
)
def test_a_rival_is_told_by_what_its_margin_is(margin: float, by: Literal["fit", "evidence"], said: str) -> None:
    assert Rival("delay", margin, by).says == said
    assert Rival("delay", margin, by).may_be_likelier is (margin < 0.5)


def test_parameters_of_an_equation_that_is_not_in_the_model_are_told_as_such() -> None:
    lag = effect("sensor_lag")
    own = {one.name: Parameter.from_sd(0.3, 0.01, one.unit) for one in lag.parameters}
    law = replace(LEAK_CAUSE, effect=lag, parameters=own, part="flexible_lag")
    assert not_in_the_model(law) == (
        "these parameters are of the equation of sensor lag, which is not in the extended model: the model has lag"
        " of free form in its place, which has no equation and follows the data more closely"
    )
    assert "the model has delay in its place, which follows" in not_in_the_model(replace(law, part="delay"))
    block = {one.name: Parameter.from_sd(0.3, 0.01, one.unit) for one in effect("flexible_lag").parameters}
    for other in (
        replace(law, part="sensor_lag"), replace(law, part=None), replace(law, parameters={}),
        replace(law, parameters=block),
    ):  # fmt: skip
        assert not_in_the_model(other) == ""


def test_what_is_left_is_told_of_the_model_that_leaves_it() -> None:
    """Without a cause, but with effects that are not named as causes, it is what the baseline leaves."""
    made = case("unexplained")
    assert made.baseline is not None
    assert made.extended is not None
    less = what_is_left(made)
    assert less == f"what the baseline leaves: {made.leftover}; the extended model leaves nothing beyond noise"
    some = replace(made, extended=replace(made.extended, structure_rms=0.2))
    assert what_is_left(some).endswith("; the extended model leaves less")
    untested = replace(made, extended=replace(made.extended, structure_rms=math.nan))
    assert what_is_left(untested).endswith("; the extended model leaves less")
    own = f"what is left: {made.leftover}"
    as_before = replace(made, extended=replace(made.extended, structure_rms=made.baseline.structure_rms))
    for other in (as_before, replace(made, causes=(LEAK_CAUSE,)), replace(made, rejected=BASELINE)):
        assert what_is_left(other) == own
    assert what_is_left(replace(made, leftover=None)) == ""


def test_what_effects_without_a_name_follow_is_not_called_explained() -> None:
    made = replace(case("unexplained"), minor=("second_relaxation",), explained_percent=90.5)
    assert shares_text(made) == (
        "8 % of the error's variance is noise; of the rest 98 % is followed by effects that are not named as causes."
    )
    assert shares_text(replace(made, causes=(LEAK_CAUSE,))).endswith("98 % is explained.")
    assert shares_text(replace(made, explained_percent=0.3)).endswith("of the rest none is explained.")


def test_a_simulation_is_not_wrong_by_what_recordings_have_of_their_own() -> None:
    made = case("one cause")
    assert heading(made) == "The simulation is wrong, and it is known why"
    doubted = replace(made, causes=(*made.causes, replace(made.causes[0], confidence=0.74)))
    assert heading(doubted).endswith("it is known what follows it, though not each cause is sure")
    zero_limits = replace(made, extended=made.baseline)
    zero, late = (replace(made.causes[0], effect=effect(name)) for name in ("zero_offset", "delay"))
    for causes, own in (((zero,), "the zero"), ((late,), "the clock"), ((late, zero), "the zero and the clock")):
        told = replace(zero_limits, causes=causes)
        assert heading(told) == f"The simulation is good enough but for {own} of the recordings"
        assert f"allows for {own} of the recordings" in what_was_gained(told)
    assert heading(replace(zero_limits, verdict="partly_explained")).startswith("The simulation is wrong")


@pytest.mark.parametrize("verdict", ["explained", "partly_explained"])
def test_nothing_is_headed_as_explained_by_an_extension_that_is_rejected(verdict: Verdict) -> None:
    named = replace(LEAK_CAUSE, part="linear_leak")
    made = replace(case("one cause"), verdict=verdict, causes=(named,))
    assert "explained" in heading(made) or "it is known why" in heading(made)
    rejected = heading(replace(made, rejected=BASELINE))
    assert rejected == (
        "The simulation is wrong, and what would explain it is rejected: it is worse on data that was not fitted"
    )
    of_rest = replace(named, effect=shift_of("reading"), part=None)  # a rest shows it, whatever is rejected
    assert heading(replace(made, causes=(of_rest,), rejected=BASELINE)) != rejected


def test_how_numbers_of_causes_are_read_is_said_where_it_matters() -> None:
    """The error falls by an offset, and the table below it does not show that."""
    made = case("one cause")
    (said,) = on_causes(made)
    assert "interval is of the noise alone" in said
    shift = replace(made.causes[0], effect=shift_of("reading"))
    assert "gives all recordings one zero" in on_causes(replace(made, causes=(*made.causes, shift)))[-1]
    for reading, told in ((-140.0, True), (140.0, False)):
        falling = replace(made, model=ExtendedModel(1.1, 0.2, 0.3, 800.0, reading, "mbar"))
        assert on_causes(falling)[-1].startswith("The reading falls as the load rises") == told


def test_the_forces_error_is_said_to_be_of_samples_that_are_not_clipped() -> None:
    made = case("one cause")
    for clipped, added in ((0.0, ""), (0.264, " (26 % of samples, clipped, left out)")):
        names = [row.name for row in comparison(replace(made, clipped=clipped))]
        assert f"error of the compensated force, rms{added}" in names


def test_effects_without_a_name_are_told_and_free_forms_as_such() -> None:
    made = case("one cause")
    assert made.minor_in_words == ""
    assert replace(made, minor=("sensor_lag",)).minor_in_words == "sensor lag"
    assert replace(made, minor=("sensor_lag", "flexible_curve", "delay")).minor_in_words == (
        "curve of free form, delay and sensor lag"
    )


def test_a_force_that_the_extended_model_gives_back_worse_is_the_baselines() -> None:
    made = case("one cause")

    def row(by: ExtendedModel | None) -> Row:
        rows = comparison(replace(made, force_model=by))
        return next(one for one in rows if one.name.startswith("error of the compensated force"))

    own = row(None)
    assert own.after.endswith(" N")
    assert own.change.endswith(" %")
    with_zero = BASELINE.with_part(effect("zero_offset"), np.array([0.01]))  # so that it gives readings as logged
    for plain_model in (BASELINE, with_zero):
        assert row(plain_model).before == own.before
        assert (row(plain_model).after, row(plain_model).change) == (
            "by the baseline, see below",
            "",
        )
    # One effect is passed over and others are undone: it is no baseline, and its error is that of the result.
    assert row(with_zero.with_part(*LEAK)) == own


@pytest.mark.parametrize(
    ("explained", "explainable", "said"),
    [
        (0.2, 0.4, "Nearly all of the error's variance is noise, which no model explains."),
        (0.4, 3.0, "97 % of the error's variance is noise; of the rest 13 % is explained."),
        (0.0, 92.0, "8 % of the error's variance is noise; of the rest none is explained."),
        (0.4, 92.0, "8 % of the error's variance is noise; of the rest none is explained."),
        (0.5, 92.0, "8 % of the error's variance is noise; of the rest 1 % is explained."),
        (99.0, 99.5, "Under 1 % of the error's variance is noise; of the rest over 99 % is explained."),
        (92.0, 92.0, "8 % of the error's variance is noise; of the rest 100 % is explained."),
    ],
)
def test_shares_are_said_of_what_is_no_noise(explained: float, explainable: float, said: str) -> None:
    made = replace(case("refused"), explained_percent=explained, explainable_percent=explainable)
    assert shares_text(made) == said


@given(percent, percent)
def test_shares_are_a_whole_whatever_was_estimated(explained: float, explainable: float) -> None:
    part = shares(replace(case("refused"), explained_percent=explained, explainable_percent=explainable))
    assert min(part.explained, part.left, part.noise) >= 0.0
    assert part.explained + part.left + part.noise == pytest.approx(100.0)


@given(st.floats(-1e4, 1e4), st.floats(1e-6, 1e4))
def test_an_interval_keeps_value_and_bounds_to_a_tenth_of_its_half_width(value: float, half: float) -> None:
    said = interval(value, value - half, value + half).replace("−", "-")
    shown = [float(number) for number in re.findall(r"-?\d[\d.e+-]*", said)]
    # Two digits of the half width: half a unit of the second one is a twentieth at most.
    for number, true in zip(shown, (value, value - half, value + half), strict=True):
        assert number == pytest.approx(true, abs=0.06 * half, rel=1e-3)


def test_a_gain_that_is_none_is_not_called_one() -> None:
    assert "it rises by 0.84 % [−0.41, 2.2]." in gain_sentence(Gain(0.42, 0.4235, "mbar", -0.84, (-2.2, 0.41)))
    unknown = Gain(math.nan, math.nan, "mbar", math.nan, (math.nan, math.nan))
    assert gain_sentence(unknown) == "What it gains on data that was not fitted is not known."
    assert gain_text(unknown) == "–"
    assert parameter_text(Parameter(0.0, 0.0, (0.0, 0.0), "1/K")) == "held at 0 1/K"


def test_a_parameter_at_the_end_of_its_range_is_told_as_such() -> None:
    assert parameter_text(Parameter(50.0, 20.0, (0.5, 50.0), "s")) == "50 [0.5, 50] s, at its limit"
    assert parameter_text(Parameter(0.5, 20.0, (0.5, 50.0), "1")) == "0.5 [0.5, 50], at its limit"
    assert parameter_text(Parameter(20.0, 8.0, (4.3, 35.7), "s")) == "20 [4, 36] s"


@pytest.mark.parametrize(("value", "sd"), [(20.0, 20.0), (50.0, 40.0), (0.5, math.inf)])
def test_a_parameter_that_may_be_anything_within_its_range_is_told_as_no_result(value: float, sd: float) -> None:
    assert parameter_text(Parameter(value, sd, (0.5, 50.0), "s")) == "not determined"


def test_structure_that_no_test_could_have_shown_is_not_called_none() -> None:
    found = case("unexplained")
    assert found.baseline is not None
    assert found.extended is not None
    untested = replace(
        found,
        baseline=replace(found.baseline, structure_rms=math.nan),
        extended=replace(found.extended, structure_rms=math.nan),
    )
    row = comparison(untested)[-1]
    assert (row.before, row.after, row.change) == ("cannot be told", "cannot be told", "–")


def test_words_for_numbers() -> None:
    assert interval(50.0, 0.5, 50.0) == "50 [0.5, 50]"
    assert interval(2.0, math.nan, 3.0) == "2.000"
    assert interval(-0.5, -0.6, -0.4) == "−0.50 [−0.60, −0.40]"
    assert sure(0.9999) == "over 99 %"
    assert sure(0.62) == "62 %"
    assert two_numbers(0.17853, 0.17906) == ("0.1785", "0.1791")
    assert listed(["a_b", "c", "d"], "or") == "a b, c or d"
    part = shares(replace(case("refused"), explained_percent=120.0, explainable_percent=50.0))
    assert (part.explained, part.left, part.noise) == (100.0, 0.0, 0.0)


def test_not_all_is_not_said_to_be_all() -> None:
    """In large letters too, where 99.6 % was rounded to 100."""
    assert [percent_of_whole(one) for one in (100.0, 99.6, 99.0, 12.4)] == ["100 %", "over 99 %", "99 %", "12 %"]


def test_where_no_test_tells_structure_from_noise_no_share_is_called_noise() -> None:
    made = case("one cause")
    assert made.extended is not None
    untold = replace(made, extended=replace(made.extended, structure_rms=math.nan), explained_percent=85.0)
    assert shares(untold) is None
    said = "Of the error's variance 85 % is explained; how much of the rest is noise cannot be told."
    assert shares_text(untold) == said
    assert shares_text(replace(untold, explained_percent=0.2)) == said.replace("85 %", "none")
    assert nothing_left(untold) == "There is too little data to tell structure from noise in what is left."


def test_structure_that_is_left_is_said_where_the_table_beside_it_has_it() -> None:
    made = case("one cause")
    assert made.extended is not None
    none = "Over the whole record the extended model leaves no structure that matters."
    for rms, said in (
        (0.0, none),
        (0.0001, none),
        (0.0015, "(0.15 % of full scale, rms) is left over the whole record"),
    ):
        left = replace(made, extended=replace(made.extended, structure_rms=rms * made.full_scale_reading))
        assert said in nothing_left(left)


def test_what_was_gained_is_lower_higher_or_the_same() -> None:
    made = case("one cause")
    assert made.gain is not None
    added = "Added: linear leak."
    lower = re.fullmatch(
        rf"{added} It lowers the error on data that was not fitted by [\d.]+ % .*", what_was_gained(made)
    )
    assert lower
    worse = replace(made, gain=Gain(0.35, 0.43, "mbar", -22.0, (-41.0, 3.0)), minor=("delay", "sensor_lag"))
    assert what_was_gained(worse) == (
        "Added: linear leak; without a name: delay and sensor lag. Together they raise the error on data that was not"
        " fitted by 22.0 % (95 % interval −3.00 to 41.0 %)."
    )
    same = replace(made, extended=made.baseline)
    assert what_was_gained(same).endswith("so that the error stays as it is.")
    assert what_was_gained(replace(made, gain=None)) == added
    unnamed_rms = replace(made, causes=(), minor=("delay",))
    assert what_was_gained(unnamed_rms).startswith("Added: without a name: delay. It lowers")
    assert what_was_gained(replace(unnamed_rms, minor=())) == "Nothing was added."
