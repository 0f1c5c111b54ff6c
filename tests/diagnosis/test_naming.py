"""From members to names: shared probability, growing confidence, what each number decides, effects of others."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe import Recording, diagnose, dynamic_protocol
from smartshoe.diagnosis import Diagnosis, Thresholds
from smartshoe.diagnosis._likelihood import Fit, Likelihood
from smartshoe.diagnosis._limits import limit_curve_range
from smartshoe.diagnosis._members import Alternative, Member
from smartshoe.diagnosis._naming import (
    BY_THE_CLOCK,
    Name,
    _other_laws_of_family,
    confidence_of,
    names_of,
    probability_of_kind,
    probability_of_law,
)
from smartshoe.errors import UsageError
from smartshoe.models.effects import Conditions, Effect, EffectParameter, blocks, by, catalogue, effect, in_words
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
NOWHERE = Fit(MODEL, 0.0, Likelihood((), 1.0, MODEL, Thresholds()))


def member(
    of: str | Effect = "linear_leak",
    size: float = 0.01,
    likelihood_ratio: float = 1000.0,
    departure_sds: float = 0.1,
    laws: tuple[tuple[str, float], ...] = (),
) -> Member:
    one = effect(of) if isinstance(of, str) else of
    return Member(
        one, size, departure_sds, (), NOWHERE, tuple(Alternative(name, by) for name, by in laws), likelihood_ratio
    )


def only(names: tuple[Name, ...]) -> Name:
    (name,) = names
    return name


# -- which law ------------------------------------------------------------------------------------------------
@given(st.floats(0.0, 1e6))
def test_two_laws_in_a_dead_heat_share_the_probability_and_name_each_other(likelihood_ratio: float) -> None:
    for one, other in (("linear_leak", "orifice_leak"), ("orifice_leak", "linear_leak")):
        share, equivalents = probability_of_law(
            member(one, likelihood_ratio=likelihood_ratio, laws=((other, 0.0),)), STANDARD
        )
        assert share == pytest.approx(0.5)
        assert equivalents == (other,)


@given(st.floats(0.0, 1e5), st.floats(0.0, 1e3), st.floats(0.0, 1e3))
def test_the_farther_the_rival_the_surer_the_law(likelihood_ratio: float, margin: float, further: float) -> None:
    near, far = (
        member(likelihood_ratio=likelihood_ratio, laws=(("orifice_leak", by),)) for by in (margin, margin + further)
    )
    assert probability_of_law(near, STANDARD)[0] <= probability_of_law(far, STANDARD)[0]
    assert set(probability_of_law(far, STANDARD)[1]) <= set(probability_of_law(near, STANDARD)[1])


def test_a_rival_that_leaves_as_much_as_laws_usually_depart_is_one_standard_deviation_away() -> None:
    likelihood_ratio = 1e9  # so that noise counts for nothing beside departures
    rival = member(
        likelihood_ratio=likelihood_ratio, laws=(("orifice_leak", STANDARD.departure**2 * likelihood_ratio),)
    )
    assert probability_of_law(rival, STANDARD)[0] == pytest.approx(1.0 / (1.0 + math.exp(-0.5)), rel=1e-6)


@given(st.floats(0.0, 1e4))
def test_a_name_is_as_sure_as_its_kind_and_its_law_shared_with_the_nearest_rival(margin: float) -> None:
    one = member(size=0.1, laws=(("orifice_leak", margin),))
    name = only(names_of([one], 0.0, STANDARD))
    assert name.kind_probability == probability_of_kind(one, 0.0, STANDARD)
    assert (name.law_probability, name.equivalents) == probability_of_law(one, STANDARD)
    assert 0.5 <= name.law_probability <= 1.0


def test_a_dead_heat_of_two_laws_is_one_half() -> None:
    name = only(names_of([member(size=0.1, laws=(("orifice_leak", 0.0),))], 0.0, STANDARD))
    assert (name.law_probability, name.equivalents) == (0.5, ("orifice_leak",))


def test_a_kind_of_one_law_is_told_by_its_kind_alone() -> None:
    assert probability_of_law(member("rate_gain"), STANDARD) == (1.0, ())


@given(st.floats(0.0, 1.0))
def test_a_kind_is_as_sure_as_its_odds_and_one_half_at_most_without_a_law(kind: float) -> None:
    one = Name(member(), effect("linear_leak"), kind, 1.0, ())
    assert confidence_of(one) == kind
    assert confidence_of(replace(one, kind_only=True)) == min(kind, 0.5)


# -- which kind -----------------------------------------------------------------------------------------------
@given(st.floats(3e-4, 0.1), st.floats(1.0, 30.0), st.floats(0.0, 0.01))
def test_confidence_in_a_kind_grows_with_its_size_over_what_is_left(size: float, times: float, left: float) -> None:
    small, large = member(size=size), member(size=size * times)
    assert probability_of_kind(small, left, STANDARD) <= probability_of_kind(large, left, STANDARD)


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05), st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_confidence_falls_with_what_is_left_and_with_departure(
    left: float, more: float, departure_sds: float, further: float
) -> None:
    sure = probability_of_kind(member(departure_sds=departure_sds), left, STANDARD)
    assert probability_of_kind(member(departure_sds=departure_sds), left + more, STANDARD) <= sure
    assert probability_of_kind(member(departure_sds=departure_sds + further), left, STANDARD) <= sure


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_confidence_falls_with_what_others_depart_by_and_with_likeness_to_them(
    departs: float, more: float, likeness: float, further: float
) -> None:
    """What is left and what others depart by are the same to it: what no equation follows."""
    one = replace(member(), others_departure_rms=departs, likeness=likeness)
    sure = probability_of_kind(one, 0.001, STANDARD)
    assert probability_of_kind(replace(one, others_departure_rms=departs + more), 0.001, STANDARD) <= sure
    assert probability_of_kind(replace(one, likeness=likeness + further), 0.001, STANDARD) <= sure
    swapped = replace(one, others_departure_rms=0.001)
    assert probability_of_kind(swapped, departs, STANDARD) == pytest.approx(sure)


def test_a_flexible_block_is_named_by_the_nearest_law_with_all_others_beside_it() -> None:
    """But for those that follow less than half of it."""
    (block, *_) = blocks()["static_curve"]
    margins = (("contact_area", 3.0), ("gas_compression", 900.0), ("wall_hardening", 40.0))
    name = only(names_of([member(block, laws=margins, likelihood_ratio=47.0)], 0.0, STANDARD))
    family = {one.name for one in catalogue().values() if one.kind == "static_curve"}
    assert name.kind_only
    assert name.effect.name == "contact_area"
    assert {name.effect.name, *name.equivalents} == family - {"gas_compression", "wall_hardening"}
    assert name.kind_probability == probability_of_kind(name.member, 0.0, STANDARD) > confidence_of(name)
    assert name.law_probability == pytest.approx(1.0 / (len(family) - 2))
    # Where all others follow less than half of it, no law is sure all the same: it may be none of the catalogue's.
    far = tuple((one, 900.0) for one in family - {"contact_area"})
    lone = only(names_of([member(block, laws=(("contact_area", 9.0), *far), likelihood_ratio=47.0)], 0.0, STANDARD))
    assert (lone.kind_only, lone.equivalents, lone.law_probability) == (True, (), 0.5)


@pytest.mark.parametrize(("of", "law"), [("static_curve", "dead_band"), ("zero", "permanent_set")])
def test_a_law_within_departures_gives_a_block_its_name_and_its_kin_are_weighed_against_it(of: str, law: str) -> None:
    """Of a curve any law that is one, of another family too."""
    (block, *_) = blocks()[of]
    least = STANDARD.departure**2 * 1000.0
    kin = "zero_drift" if of == "zero" else "saturation"
    rivals = ((kin, 80.0), ("wall_hardening", 90.0))
    for margin, is_law in ((0.999 * least, True), (1.001 * least, False)):
        one = member(block, laws=((law, margin), *((name, margin + by) for name, by in rivals)))
        name = only(names_of([one], 0.0, STANDARD))
        assert name.kind_only is not is_law
        if is_law:
            assert (name.effect.name, name.law_in_place, name.member) == (law, one.laws[0], one)
            assert name.kind_probability == probability_of_kind(one, 0.0, STANDARD)
            as_law = member(law, laws=rivals[:1] if of == "zero" else rivals, likelihood_ratio=1000.0 - margin)
            assert (name.law_probability, name.equivalents) == probability_of_law(as_law, STANDARD)
            assert name.equivalents == (("zero_drift",) if of == "zero" else ("saturation", "wall_hardening"))
        else:
            assert name.law_in_place is None


def test_a_curve_that_no_law_follows_is_named_by_the_nearest_of_all_curves() -> None:
    (block, *_) = blocks()["static_curve"]
    margins = (("dead_band", 90.0), ("contact_area", 95.0), ("saturation", 499.0), ("wall_hardening", 501.0))
    one = member(block, laws=margins, likelihood_ratio=1000.0)
    name = only(names_of([one], 0.0, STANDARD))
    assert (name.effect.name, name.equivalents, name.kind_only) == (
        "dead_band",
        ("contact_area", "saturation"),
        True,
    )
    assert name.law_probability == pytest.approx(1.0 / 3.0)


def test_where_nothing_else_is_named_that_is_which_does_most_alone_half_sure_at_most() -> None:
    """A block of that kind in the model, larger than all small imperfections of a good unit."""
    (block, *_) = blocks()["static_curve"]
    laws = (("contact_area", 1.0), ("dead_band", 90.0))
    curve, other = (
        member(block, size=0.01, departure_sds=3.0, laws=laws),
        member("play_hysteresis", size=0.012, departure_sds=3.0),
    )
    left = 0.02
    assert names_of([curve, other], left, STANDARD) == ()
    name = only(names_of([curve, other], left, STANDARD, best_single=effect("saturation")))
    assert name.effect.name == "contact_area"
    assert name.kind_probability < 0.5
    assert not name.is_sure
    assert names_of([curve, other], left, STANDARD, best_single=effect("linear_leak")) == ()
    small = replace(curve, size=STANDARD.tolerable)
    assert names_of([small, other], left, STANDARD, best_single=effect("contact_area")) == ()
    ruled_out = replace(curve, departure_sds=30.0)  # whose odds are those of no equivalent
    assert names_of([ruled_out, other], left, STANDARD, best_single=effect("saturation")) == ()


def test_a_block_beside_the_law_that_is_its_nearest_is_that_laws_departure_and_no_second_name() -> None:
    (block, *_) = blocks()["static_curve"]
    law = member("contact_area", size=0.01)
    beside = member(block, size=0.02, laws=(("contact_area", 1.0), ("dead_band", 90.0)))
    name = only(names_of([beside, law], 0.0, STANDARD))
    assert name.effect.name == "contact_area"
    assert name.member is beside  # the larger, of two that are sure


def test_a_curve_where_its_kind_ends_has_the_name_of_the_law_that_follows_as_well() -> None:
    """A dead band of a third of full scale is a curve like any other; one of its own kind is a dead band."""
    laws = (("sensor_nonlinearity", 20.0), ("gas_compression", 60.0))
    one = replace(member("dead_band", size=0.02, laws=laws, likelihood_ratio=1000.0), is_at_end_of_kind=True)
    name = only(names_of([one], 0.0, STANDARD))
    assert (name.effect.name, name.equivalents, name.kind_only) == ("sensor_nonlinearity", ("gas_compression",), False)
    assert name.law_in_place is one.laws[0]
    of_its_kind = replace(one, is_at_end_of_kind=False, laws=())
    name = only(names_of([of_its_kind], 0.0, STANDARD))
    assert (name.effect.name, name.law_in_place) == ("dead_band", None)
    # Where none follows as well the nearest gives its name to any curve.
    farther = tuple(Alternative(law.effect, law.margin + 1000.0 * STANDARD.departure**2) for law in one.laws)
    name = only(names_of([replace(one, laws=farther)], 0.0, STANDARD))
    assert (name.effect.name, name.kind_only, name.law_in_place) == ("sensor_nonlinearity", True, None)
    assert {"gas_compression", "saturation", "contact_area", "wall_hardening"} <= {*name.equivalents}


@pytest.mark.parametrize("of", ["static_curve", "gain_drift"])
def test_where_only_the_kind_is_known_the_name_is_half_sure_at_most_however_sure_its_kind(of: str) -> None:
    """Also where a family has one law: what that one does not follow may be of a kind that is not there."""
    (block, *_) = blocks()[of]
    margins = (("dead_band", 500.0), ("contact_area", 510.0)) if of == "static_curve" else ()
    sure = []
    for departure_sds in (0.3, 1.5, 2.9, 4.0):
        one = member(block, size=0.06, departure_sds=departure_sds, laws=margins)
        name = only(names_of([one], 0.03, STANDARD))
        assert name.kind_only
        kind = probability_of_kind(one, 0.03, STANDARD)
        assert confidence_of(name) == min(kind, 0.5)
        sure.append((name.is_sure, kind > 0.5))
    assert {*sure} == {(True, True), (False, True), (False, False)}


def test_a_block_is_named_by_a_law_of_its_own_stage() -> None:
    """A set grows with what the wall has borne: a drift by the clock may come near, and is none of a wall."""
    (block,) = blocks()["zero"]
    name = only(names_of([member(block, laws=(("zero_drift", 3.0), ("permanent_set", 90.0)))], 0.0, STANDARD))
    assert (name.effect.name, name.kind_only) == ("permanent_set", True)  # which departs too far to be the law
    assert "zero_drift" in name.equivalents


@pytest.mark.parametrize("of", ["gain_drift", "flexible_gain_drift"])
def test_a_law_of_another_kind_that_nothing_tells_from_it_is_equivalent_where_it_follows_as_its_own(
    of: str,
) -> None:
    drift, most = member(of, laws=()), STANDARD.departure**4 * 1000.0
    for margin, equivalents in ((most, ("cycle_conditioning",)), (1.01 * most, ())):
        told = replace(drift, confounded=(Alternative("cycle_conditioning", margin),))
        name = only(names_of([told], 0.0, STANDARD))
        assert (name.effect.name, name.equivalents) == ("gain_drift", equivalents)
    near = replace(drift, confounded=(Alternative("cycle_conditioning", 0.0),))
    assert only(names_of([near], 0.0, STANDARD)).law_probability == pytest.approx(0.5)
    both = [near, member("cycle_conditioning")]  # what is there itself stands for no other
    assert [one.equivalents for one in names_of(both, 0.0, STANDARD)] == [(), ()]


def test_beside_a_curve_that_would_bend_farther_than_it_can_what_is_no_curve_is_half_sure_at_most() -> None:
    """What its equation misses may stand in another's name."""
    curve, leak = member("sensor_nonlinearity", size=0.07), member("linear_leak")
    assert [one.is_sure for one in names_of([curve, leak], 0.0, STANDARD)] == [True, True]
    ended = replace(curve, bends_too_little=True)
    beside = [one for one in names_of([ended, leak], 0.0, STANDARD) if one.member is leak]
    assert all(one.kind_probability <= 0.5 and not one.is_sure for one in beside)
    assert names_of([ended, leak], 0.0, STANDARD)[0].is_sure


@pytest.mark.parametrize(
    ("name", "values", "ends"),
    [
        ("sensor_nonlinearity", {"bow": 0.2}, True),
        ("sensor_nonlinearity", {"bow": 0.19}, False),
        ("sensor_nonlinearity", {"bow": 0.1, "wave": -0.08}, True),
        ("contact_area", {"bow": 0.26}, True),
        ("contact_area", {"bow": 0.0}, False),
        ("saturation", {"slope_lost": 1.0}, False),  # it holds at its level: no slope can be lost beyond all
        ("dead_band", {"lost_load": 0.3}, False),  # where its kind ends it is any curve
        ("flexible_curve", {"slope_5": -0.95}, False),  # as flat as a curve that rises may be
        ("gain_drift", {"drift_rate": 1e9}, False),  # no curve
    ],
)
def test_a_curve_at_the_end_of_its_range_bends_too_little(name: str, values: dict[str, float], ends: bool) -> None:
    one = effect(name)
    given = [values.get(parameter.name, value) for parameter, value in zip(one.parameters, one.start(), strict=True)]
    model = MODEL.with_part(one, given)
    assert model.part(name).bends_too_little is ends
    said = limit_curve_range(model)
    assert len(said) == ends
    if ends:
        assert said[0].startswith(f"{in_words(name)} is at the end of the range")
    # The same of a law that a free form in the model is named by.
    block = member("flexible_curve")
    told = Name(block, one, 0.9, 0.9, (), law_in_place=Alternative(name, 0.0, replace(block.without, model=model)))
    followed = limit_curve_range(MODEL.with_part("flexible_gain_drift"), [told, replace(told, law_in_place=None)])
    assert len(followed) == ends
    assert not ends or "its parameters are bounds" in followed[0]


def test_where_loads_go_with_the_clock_what_goes_with_it_is_half_sure_at_most() -> None:
    """A leak or a drift may do what the other does, or a curve; a fast effect is none of these."""
    fast, slow, capped_at_half = (
        member("play_hysteresis"),
        member("zero_drift"),
        member("linear_leak", departure_sds=7.5),
    )
    assert [one.member for one in names_of([fast, slow], 0.0, STANDARD)] == [fast, slow]
    beside = names_of([fast, slow], 0.0, STANDARD, is_clocked=True)
    assert [(one.member, one.is_sure) for one in beside] == [(fast, True), (slow, False)]
    assert beside[1].kind_probability == 0.5
    told = names_of([slow, capped_at_half], 0.0, STANDARD, is_clocked=True)
    assert [(one.member, one.is_sure) for one in told] == [(slow, False), (capped_at_half, False)]
    assert told[0].kind_probability == 0.5
    assert told[1].kind_probability == probability_of_kind(capped_at_half, 0.0, STANDARD) < 0.5


def test_beside_zeros_that_change_at_moments_none_is_more_than_half_sure() -> None:
    sure = member("play_hysteresis", size=0.05)
    assert only(names_of([sure], 0.0, STANDARD)).kind_probability > 0.5
    (told,) = names_of([sure], 0.0, STANDARD, doubt="zeros jump")  # larger than what is left, and not to be ruled out
    assert (told.kind_probability, told.is_sure, told.doubt) == (0.5, False, "zeros jump")
    # Of several reasons the first is said.
    drift = member("zero_drift", size=0.05)
    for doubt in ("zeros jump", ""):
        (told,) = names_of([drift], 0.0, STANDARD, doubt=doubt, is_clocked=True)
        assert told.doubt == (doubt or BY_THE_CLOCK)
    assert not names_of([member(size=0.05, departure_sds=9.0)], 0.06, STANDARD, doubt="zeros jump")


def test_where_none_is_sure_those_are_named_that_move_more_than_what_is_left_half_sure_at_most() -> None:
    likely, less, small = (
        member(size=0.05, departure_sds=2.5), member("rate_gain", size=0.04, departure_sds=2.5),
        member(size=0.05, departure_sds=4.8)
    )  # fmt: skip
    assert 0.5 < probability_of_kind(likely, 0.03, STANDARD) < STANDARD.least_confidence
    told = names_of([less, likely], 0.03, STANDARD)
    assert [(one.member, one.kind_probability, one.is_sure) for one in told] == [
        (less, 0.5, False), (likely, 0.5, False),
    ]  # fmt: skip
    open_ = replace(likely, departure_sds=3.5)
    assert only(names_of([open_], 0.03, STANDARD)).kind_probability == probability_of_kind(open_, 0.03, STANDARD) < 0.5
    assert probability_of_kind(small, 0.03, STANDARD) < STANDARD.equivalent_odds / (1.0 + STANDARD.equivalent_odds)
    assert only(names_of([small, less], 0.03, STANDARD)).member is less  # the largest can be ruled out
    assert only(names_of([likely, less], 0.041, STANDARD)).member is likely  # more is left than the less explains
    assert not names_of([likely], 0.051, STANDARD)


def test_beside_a_sure_name_one_less_sure_is_named_if_it_is_large_and_cannot_be_ruled_out() -> None:
    sure = member("rate_gain", size=0.04)
    likely, open_, less = (member(size=0.05, departure_sds=by) for by in (2.5, 3.5, 4.8))
    out = STANDARD.equivalent_odds / (1.0 + STANDARD.equivalent_odds)
    kinds = [probability_of_kind(one, 0.03, STANDARD) for one in (less, open_, likely)]
    assert kinds[0] < out < kinds[1] < 0.5 < kinds[2]
    # What cannot be ruled out is named where it is larger than what the other's law departs by.
    assert names_of([open_, sure], 0.03, STANDARD)[0].kind_probability == kinds[1]
    large = replace(sure, size=0.201)
    assert only(names_of([replace(open_, others_departure_rms=0.03), large], 0.0, STANDARD)).member is large
    assert len(names_of([replace(open_, others_departure_rms=0.03), replace(sure, size=0.199)], 0.0, STANDARD)) == 2
    told = names_of([likely, sure], 0.03, STANDARD)
    assert [(one.member, one.is_sure) for one in told] == [(likely, False), (sure, True)]
    assert told[0].kind_probability == probability_of_kind(likely, 0.03, STANDARD) < STANDARD.least_confidence
    assert only(names_of([less, sure], 0.03, STANDARD)).member is sure
    # One that moves no more than a good unit's imperfections do may be another's shadow.
    assert only(names_of([likely, sure], 0.03, replace(STANDARD, tolerable=0.051))).member is sure
    assert len(names_of([likely, sure], 0.03, replace(STANDARD, tolerable=0.049))) == 2


def test_beside_a_kind_that_no_law_follows_nothing_is_named_for_its_size() -> None:
    (block, *_) = blocks()["static_curve"]
    curve = member(block, size=0.06, departure_sds=1.5, laws=(("dead_band", 500.0), ("contact_area", 510.0)))
    likely = member(size=0.05, departure_sds=2.5)
    assert 0.5 < probability_of_kind(likely, 0.03, STANDARD) < STANDARD.least_confidence
    named = only(names_of([curve, likely], 0.03, STANDARD))
    assert (named.is_sure, named.kind_only) == (True, True)
    law = member("sensor_lag", size=0.06, departure_sds=1.5)
    assert len(names_of([curve, law, likely], 0.03, STANDARD)) == 3


# -- what each number decides -----------------------------------------------------------------------------------
def test_material_is_the_size_from_which_on_a_member_is_named() -> None:
    small = [member(size=1e-3)]
    assert names_of(small, 0.0, replace(STANDARD, material=5e-4))
    assert not names_of(small, 0.0, replace(STANDARD, material=2e-3))


def test_least_confidence_is_of_the_kind_below_which_nothing_is_sure() -> None:
    sure = probability_of_kind(member(), 1e-3, STANDARD)
    assert only(names_of([member()], 1e-3, replace(STANDARD, least_confidence=sure - 0.01))).is_sure
    assert not only(names_of([member()], 1e-3, replace(STANDARD, least_confidence=sure + 0.01))).is_sure


def test_kind_odds_are_the_logistics_coefficients() -> None:
    for intercept in (-2.0, 0.0, 3.0):
        plain = replace(STANDARD, kind_odds=(intercept, 0.0, 0.0, -2.0))
        assert probability_of_kind(member(), 0.002, plain) == pytest.approx(1 / (1 + math.exp(-intercept)))
        alike = probability_of_kind(replace(member(), likeness=0.5), 0.002, plain)
        assert alike == pytest.approx(1 / (1 + math.exp(1.0 - intercept)))


@given(st.floats(0.0, 60.0))
def test_where_an_effect_brings_nothing_a_margin_is_evidence_as_it_stands(margin: float) -> None:
    rival = member(likelihood_ratio=0.0, laws=(("orifice_leak", margin),))
    assert probability_of_law(rival, STANDARD)[0] == pytest.approx(1.0 / (1.0 + math.exp(-margin / 2.0)))


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0))
def test_what_nothing_accounts_for_as_well_is_surer(margin: float, more: float) -> None:
    less, surer = (
        replace(member(), alternatives=(Alternative(None, by), Alternative("delay", by)))
        for by in (margin, margin + more)
    )
    assert probability_of_kind(less, 1e-3, STANDARD) <= probability_of_kind(surer, 1e-3, STANDARD)


def test_what_nothing_accounts_for_as_well_is_there_or_not_by_even_odds() -> None:
    sure, even = (replace(member(), alternatives=(Alternative(None, by),)) for by in (1e6, 0.0))
    assert probability_of_kind(even, 1e-3, STANDARD) == pytest.approx(0.5 * probability_of_kind(sure, 1e-3, STANDARD))
    # A worse fit than with nothing counts for no more than that.
    worse = replace(member(), alternatives=(Alternative(None, -40.0),))
    assert probability_of_kind(worse, 1e-3, STANDARD) == probability_of_kind(even, 1e-3, STANDARD)


def test_departure_counts_margins_where_an_effect_brings_much() -> None:
    rival = member(likelihood_ratio=10_000.0, laws=(("orifice_leak", 500.0),))
    exact, loose = (probability_of_law(rival, replace(STANDARD, departure=by))[0] for by in (0.02, 0.5))
    assert loose < 0.6 < 0.99 < exact


@pytest.mark.parametrize(("field", "few", "many"), [("departure", 0.02, 0.5), ("equivalent_odds", 0.9, 0.01)])
def test_laws_are_ruled_out_by_departure_and_equivalent_odds(field: str, few: float, many: float) -> None:
    rival = member(likelihood_ratio=10_000.0, laws=(("orifice_leak", 2_000.0),))
    assert probability_of_law(rival, replace(STANDARD, **{field: few}))[1] == ()
    assert probability_of_law(rival, replace(STANDARD, **{field: many}))[1] == ("orifice_leak",)


# -- whole diagnoses ---------------------------------------------------------------------------------------------
def recording(model: ExtendedModel, seed: int, noise: float = 0.001) -> Recording:
    """What a model itself would read under triangles at three rates; for arithmetic, not for hidden effects."""
    protocol = dynamic_protocol((100, 300, 800), repeats=3, rest_s=6.0)
    time_s = np.arange(0.0, protocol.duration_s, 0.04)
    load_n = protocol.load_at(time_s)
    share = model.simulate(Conditions(time_s, load_n / 800.0, 0.04))
    share = share + noise * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=140.0 * share, name=f"run_{seed}")


def diagnosed(model: ExtendedModel, thresholds: Thresholds = STANDARD) -> Diagnosis:
    runs = [recording(model, seed) for seed in range(3)]
    return diagnose(runs[:2], hold_out=runs[2:], thresholds=thresholds)


class Breathing(Effect):
    """f (1 + s sin(2 pi t / T)): no law of the catalogue comes and goes with the clock."""

    name, family, stage, place = "breathing", "breathing", "contact", "contact"
    says = "the gain comes and goes with a period of its own"
    parameters = (
        EffectParameter("swing", "1", "share by which the gain swings", 0.0, -0.5, 0.5, 0.1),
        EffectParameter("period", "s", "period of the swing", None, 5.0, 60.0, 10.0),
    )
    shapes = ({"period": 10.0}, {"period": 20.0}, {"period": 40.0})
    exposed_by = by("repeats")
    why_not_undone = "its phase is known from the start of a recording on only"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        swing, period = values
        return np.asarray(signal * (1.0 + swing * np.sin(2 * np.pi * conditions.time_s / period)))

    def inverse(self, values: Array, step_s: float) -> None:
        return None


@pytest.fixture
def breathing(installed: ModuleType) -> Effect:
    """An effect of another package, as if that were installed."""
    installed.Breathing = Breathing  # type: ignore[attr-defined]
    return effect("breathing")


def test_an_effect_of_another_package_is_named(breathing: Effect) -> None:
    found = diagnosed(MODEL.with_part(breathing, np.array([0.06, 20.5])))
    assert found.causes
    assert found.causes[0].name == "breathing"
    assert found.causes[0].parameters["period"].value == pytest.approx(20.5, rel=0.02)
    assert found.causes[0].held_out.ci95[0] > 0


def test_without_that_package_another_name_is_given_or_none(
    breathing: Effect, installed: ModuleType, forget_effects: Callable[[], None]
) -> None:
    """The name above follows from the entry point, not from anything here."""
    model = MODEL.with_part(breathing, np.array([0.06, 20.5]))
    runs = [recording(model, seed) for seed in range(2)]
    del installed.Breathing
    forget_effects()
    assert "breathing" not in {cause.name for cause in diagnose(runs[:1], hold_out=runs[1:]).causes}


def test_an_effect_of_another_package_that_gives_no_numbers_is_told(
    breathing: Effect, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: Effect, signal: Array, conditions: Conditions, values: Array) -> Array:
        return np.where(signal > 0.9, np.nan, signal)

    monkeypatch.setattr(Breathing, "apply", broken)
    with pytest.raises(UsageError, match=r"'breathing' gives readings that are no finite numbers at period = 10"):
        diagnosed(MODEL)


CURVED = MODEL.with_part(effect("gas_compression"), np.array([0.15]))


def test_where_laws_stay_open_an_experiment_is_proposed_that_parts_them() -> None:
    found = diagnosed(CURVED)
    (cause,) = found.causes
    assert cause.equivalents
    assert found.next_experiment is not None
    assert found.next_experiment.separates == (cause.name, *cause.equivalents)
    assert found.next_experiment.expected_margin is not None
    assert found.next_experiment.expected_margin > cause.rivals[0].margin


def test_false_name_is_the_price_of_a_name_and_what_is_left_open_asks_for_an_experiment() -> None:
    found = diagnosed(CURVED, replace(STANDARD, false_name=1e-60))
    assert not found.causes
    assert found.verdict == "unexplained"
    assert found.next_experiment is not None
    assert found.next_experiment.says


@pytest.mark.parametrize("law", catalogue().values(), ids=lambda law: law.name)
def test_a_constant_shift_is_no_other_law_of_what_moves_within_a_recording(law: Effect) -> None:
    """Each recording has an offset of its own: a set of 3 % that grew within each had been said to be one."""
    others = [catalogue()[name] for name in _other_laws_of_family(law)]
    assert all(one.shifts is None and one.kind == law.kind and one is not law for one in others)
    family = [one for one in catalogue().values() if one.kind == law.kind and one is not law]
    assert len(others) == sum(one.shifts is None for one in family)
