"""How a diagnosis is put together from its parts: verdicts at their bounds, causes and traces in units, by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds, _causes
from smartshoe.diagnosis._causes import (
    _beside_kin,
    _evidence_against_nothing,
    _held_out_evidence,
    _nearest_rival,
    cause_of,
    zero_cause_of,
)
from smartshoe.diagnosis._diagnose import _pulled_reason, _refused
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._held_out import Errors, Gain
from smartshoe.diagnosis._limits import limit_nearest_law, limit_refusals
from smartshoe.diagnosis._naming import confidence_of
from smartshoe.diagnosis._own_terms import own_terms_of
from smartshoe.diagnosis._procedure import (
    _goodness,
    _percent_less,
    _trace,
    _with_offset,
)
from smartshoe.diagnosis._result import Rival
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import prepare
from smartshoe.diagnosis._verdict import names_in, sentence_of, unexplained_remark, verdict_of
from smartshoe.diagnosis._zero import Zero, offsets
from smartshoe.display import percent
from smartshoe.errors import UsageError
from smartshoe.models.effects import Conditions, effect, shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.2, 0.08, 0.22, 800.0, 140.0, "mbar")
BY_FIT = "(-2 log likelihood, equations taken as exact)"
SCALE = Scale(800.0, -140.0, MILLIBAR, 3.0)
BEFORE = Errors(np.array([4.0, 12.0]), np.array([100.0, 300.0]), 0.8)
AFTER = Errors(np.array([1.0, 3.0]), np.array([100.0, 300.0]), 0.8)


def _left(rms: float, significant: bool = True, how: str = "repeats", is_noise: bool = False) -> Any:
    """A structure: the rms is of what stands out, 0 where nothing does."""
    seen = rms if significant else 0.0
    return SimpleNamespace(
        rms=seen, significant=significant, how=how, is_noise=is_noise, is_tested=True, says="here", size=rms
    )


# -- refusals ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("low", "high", "is_out"),
    [(-24.9, 100.0, False), (-25.1, 100.0, True), (-100.0, 24.9, False), (-100.0, 25.1, True), (50.0, 100.0, False),
     (-100.0, -50.0, False), (0.0, 100.0, False)],
)  # fmt: skip
def test_a_load_of_both_signs_is_no_units(low: float, high: float, is_out: bool) -> None:
    """The smaller side more than a quarter of the larger, but for one in a hundred at either end."""
    load = np.repeat([low, high], 100)
    load[[0, 150]] = (-1e4, 1e4)
    one = Recording.from_arrays(time_s=0.1 * np.arange(200), force_n=load, pressure_mbar=load, name="pulled")
    said = _pulled_reason(one, STANDARD)
    assert (said is not None) is is_out
    if said is not None:
        assert f"pulled: the load runs from {low:.4g} to {high:.4g} N" in said
        # To take out a mean is what gives a load two signs.
        assert "where its mean was taken out, add in the file what makes all of it positive" in said


def test_a_refusal_says_why_and_what_is_known_without_a_model() -> None:
    time_s = 0.1 * np.arange(400)
    falling = Recording.from_arrays(time_s=time_s, pressure_mbar=100.0 * np.exp(-time_s / 8.0))
    constant = Recording.from_arrays(time_s=time_s, pressure_mbar=np.full(400, 5.0))
    load = 100.0 * np.abs(time_s % 4.0 - 2.0)
    pressed = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.5 * load)
    found = _refused([falling, constant, pressed], SimpleNamespace(faults=()), ("no load", "nor else"), STANDARD)  # type: ignore[arg-type]
    assert (found.verdict, found.says, found.unit) == ("refused", "no diagnosis: no load", "mbar")
    assert (found.full_scale_load_n, found.full_scale_reading) == (0.0, 0.0)
    assert (found.explainable_percent, found.explained_percent) == (0.0, 0.0)
    assert found.limits[:2] == ("no load", "nor else")
    decay, curve = found.limits[2:]
    assert "falls by" in decay
    assert "over this load" in curve
    bare = Recording.from_arrays(time_s=time_s, force_n=load)
    assert _refused([bare], SimpleNamespace(faults=()), ("no reading",), STANDARD).unit == ""  # type: ignore[arg-type]


def test_a_diagnosis_needs_a_recording_and_takes_what_is_material_from_either() -> None:
    with pytest.raises(UsageError, match="no recording"):
        diagnose([])
    bare = Recording.from_arrays(time_s=0.1 * np.arange(200), pressure_mbar=np.ones(200))
    other = replace(STANDARD, material=0.1, same=0.3)
    assert diagnose([bare]).thresholds == STANDARD
    assert diagnose([bare], thresholds=other).thresholds == other
    assert diagnose([bare], thresholds=other, material=0.2).thresholds == replace(other, material=0.2)
    pulled = np.resize([-100.0, 100.0], 400)
    drawn = Recording.from_arrays(time_s=0.1 * np.arange(400), force_n=pulled, pressure_mbar=pulled)
    assert diagnose([drawn]).verdict == "refused"


# -- verdicts ---------------------------------------------------------------------------------------------------------
CAUSES: Any = [SimpleNamespace(name="linear_leak", confidence=0.9)]


def test_what_is_left_is_held_against_what_laws_depart_by_and_what_a_good_unit_leaves() -> None:
    """A quarter of 0.04, where each cause has a law; what is tolerable else; what is material, where that is more."""
    wrong = _left(0.04)
    for bound, follows, thresholds in (
        (0.01, True, STANDARD),
        (STANDARD.tolerable, False, STANDARD),
        (0.03, True, replace(STANDARD, tolerable=0.03)),
        (0.05, True, replace(STANDARD, material=0.05)),
    ):
        told = [verdict_of(CAUSES, wrong, _left(by * bound), thresholds, follows) for by in (1.0, 1.0001)]
        assert told == ["explained", "partly_explained"]
    assert verdict_of(CAUSES, wrong, _left(0.5, significant=False), STANDARD) == "explained"
    hidden = _left(0.04, significant=False)
    assert verdict_of(CAUSES, hidden, _left(0.9 * STANDARD.tolerable), STANDARD) == "explained"
    assert verdict_of(CAUSES, hidden, _left(1.1 * STANDARD.tolerable), STANDARD) == "partly_explained"


def test_without_a_cause_it_is_adequate_up_to_what_is_tolerable_or_material() -> None:
    for thresholds in (STANDARD, replace(STANDARD, material=0.02)):
        bound = max(thresholds.tolerable, thresholds.material)
        for lesser in (_left(0.5 * bound), _left(9.0 * bound, significant=False)):
            told = [verdict_of([], lesser, _left(by * bound), thresholds) for by in (1.0, 1.0001)]
            assert told == ["adequate", "unexplained"]
            # What effects do away with that are too unsure to be named is not explained either.
            told = [verdict_of([], _left(by * bound), lesser, thresholds) for by in (1.0, 1.0001)]
            assert told == ["adequate", "unexplained"]
    nothing = _left(0.5, significant=False)
    assert verdict_of([], nothing, nothing, STANDARD) == "adequate"


def _named(*names: str, unnamed: int = 0, **sure: float) -> str:
    causes: Any = [SimpleNamespace(name=name, confidence=sure.get(name, 0.9)) for name in names]
    return names_in(causes, unnamed)


def _said(
    verdict: Any, *names: str, left: Any = None, elsewhere: float = 0.0, unproven: float = 0.0,
    baseline: Errors = BEFORE, best: Errors = AFTER, worse: bool = False, withheld: bool = False,
) -> str:  # fmt: skip
    rest = unexplained_remark(left or _left(0.034), elsewhere, unproven, STANDARD)
    return sentence_of(verdict, _named(*names), baseline, best, rest, STANDARD, worse=worse, withheld=withheld)


def test_effects_without_a_name_are_counted_behind_the_causes() -> None:
    assert _named() == ""
    assert _named("linear_leak") == "linear leak"
    assert _named("dead_band", "delay") == "dead band and delay"
    assert _named("dead_band", "delay", "rate_gain") == "dead band, delay and rate gain"
    assert _named("delay", "dead_band", dead_band=0.5, delay=0.49) == "dead band and perhaps delay"
    assert _named(unnamed=1) == "1 effect without a name"
    assert _named(unnamed=2) == "2 effects without a name"
    assert _named("linear_leak", unnamed=1) == "linear leak and 1 effect without a name"
    assert _named("dead_band", "delay", unnamed=2) == "dead band, delay and 2 effects without a name"


def test_what_is_not_explained_is_the_larger_of_what_is_left_and_what_is_off_elsewhere() -> None:
    for elsewhere in (0.0, 0.02, 0.034):
        for unproven in (0.0, 0.034):
            said = unexplained_remark(_left(0.034), elsewhere, unproven, STANDARD)
            assert said == "over all recordings 3.4 % repeats and is not explained"
    nothing = _left(0.5, significant=False)
    for left in (_left(0.034), nothing):
        for unproven in (0.0, 0.19):
            said = unexplained_remark(left, 0.19, unproven, STANDARD)
            assert said == "on held-out data 19 % is not explained"
        for elsewhere in (0.0, 0.19):
            said = unexplained_remark(left, elsewhere, 0.2, STANDARD)
            assert said == "20 % is left, and nothing shows that this is noise"
    slow = unexplained_remark(_left(0.034, how="changes slowly"), 0.0, 0.0, STANDARD)
    assert slow == "over all recordings 3.4 % changes slowly and is not explained"
    assert unexplained_remark(_left(STANDARD.material), 0.0, 0.0, STANDARD) is None
    assert unexplained_remark(_left(1.001 * STANDARD.material), 0.0, 0.0, STANDARD) is not None
    assert unexplained_remark(nothing, 0.0, 0.0, STANDARD) is None


def test_a_verdicts_sentence_has_its_numbers_in_percent() -> None:
    good = "the baseline simulation is good to 20 % of full scale on data it was not fitted to"
    assert _said("explained", "linear_leak") == f"{good}, and to 10 % with linear leak"
    assert _said("explained", "dead_band", "delay").endswith("to 10 % with dead band and delay")
    assert _said("explained", "dead_band", "delay", "rate_gain").endswith("to 10 % with dead band, delay and rate gain")
    rest = "over all recordings 3.4 % repeats and is not explained"
    assert _said("partly_explained", "delay") == f"{good}, and to 10 % with delay; {rest}"
    unsure = "the extended model is good to 10 %, with effects that are not named as causes"
    assert _said("unexplained") == f"{good}; {rest}: {unsure}"
    no_effect = "and no effect of the catalogue accounts for it"
    assert _said("unexplained", best=BEFORE) == f"{good}; {rest}, {no_effect}"
    elsewhere = "on held-out data 19 % is not explained"
    assert _said("unexplained", best=BEFORE, elsewhere=0.19) == f"{good}; {elsewhere}, {no_effect}"
    no_cause = "and no cause can be named from this data (see its limits)"
    unproven = "3.9 % is left, and nothing shows that this is noise"
    said = _said("unexplained", best=BEFORE, unproven=0.039, withheld=True)
    assert said == f"{good}; {unproven}, {no_cause}"
    assert _said("unexplained", best=BEFORE, withheld=True) == f"{good}; {rest}, {no_cause}"
    assert _said("unexplained", withheld=True) == f"{good}; {rest}: {unsure}"
    small = "no more than small imperfections of a good unit add up to"
    assert _said("adequate") == f"{good}; {rest}, {small}"
    for quiet in (_left(STANDARD.material), _left(0.5, significant=False)):
        assert _said("adequate", left=quiet) == good
        assert _said("unexplained", left=quiet) == f"{good}: {unsure}"
        assert _said("unexplained", left=quiet, best=BEFORE, withheld=True) == f"{good}, {no_cause}"
        assert _said("partly_explained", "delay", left=quiet) == f"{good}, and to 10 % with delay"


def test_a_verdicts_sentence_says_where_it_is_worse_and_where_nothing_is_judged() -> None:
    good = "the baseline simulation is good to 10 % of full scale on data it was not fitted to"
    rest = "over all recordings 3.4 % repeats and is not explained"
    worse = f"{good}; with delay it is worse there (20 %), so that the baseline is kept"
    assert _said("partly_explained", "delay", baseline=AFTER, best=BEFORE, worse=True) == f"{worse}; {rest}"
    chance = _said("partly_explained", "delay", baseline=AFTER, best=BEFORE)  # by no more than chance
    assert chance == f"{worse.replace('worse', 'no better')}; {rest}"
    nothing = Errors(np.zeros(0), np.zeros(0), math.nan)
    unknown = "no held-out data can be used, so that it is not known how good the baseline simulation is"
    explained = f"{unknown}; what is fitted is explained by delay"
    assert _said("explained", "delay", baseline=nothing, best=nothing) == explained
    assert _said("partly_explained", "delay", baseline=nothing, best=nothing) == f"{explained}; {rest}"
    small = "no more than small imperfections of a good unit add up to"
    assert _said("adequate", baseline=nothing, best=nothing) == f"{unknown}; {rest}, {small}"


def test_what_was_taken_out_again_is_said_once() -> None:
    found: Any = SimpleNamespace(can_validate=True, refused=(), cancelling_names=())
    assert limit_refusals(found) == []
    found.refused = ("linear_leak", "delay", "linear_leak")
    (said,) = limit_refusals(found)
    assert said == (
        "tried and not kept: linear leak, delay (of no help in predicting recordings or load cycles left out"
        " in turn, or too small there to be trusted at the held-out loads)"
    )
    found.cancelling_names = ("rate_gain", "delay")
    undone = "these effects largely cancel one another, so that none is named: rate gain, delay"
    assert limit_refusals(found) == [undone, said]
    found.cancelling_names, found.refused = (), ("flexible_lag", "linear_leak")
    (said,) = limit_refusals(found)
    assert said.startswith("tried and not kept: lag of free form, linear leak (of no help")
    # What has a name after all, as a tare that rests show, is not said to be none.
    (said,) = limit_refusals(found, ["linear_leak"])
    assert said.startswith("tried and not kept: lag of free form (of no help")
    found.cancelling_names = ("rate_gain",)
    assert limit_refusals(found, ["rate_gain", "flexible_lag", "linear_leak"]) == []
    found.can_validate = False
    (said,) = limit_refusals(found)
    assert "no cause can be told" in said


def test_a_fall_is_in_percent_and_never_below_nothing() -> None:
    assert _percent_less(1.0, 4.0) == 75.0
    assert _percent_less(5.0, 4.0) == 0.0
    assert _percent_less(1.0, 0.0) == 0.0


# -- causes -----------------------------------------------------------------------------------------------------------
def test_evidence_on_held_out_data_is_in_the_readings_unit() -> None:
    size, gained = _held_out_evidence(0.0123, Gain(2.5, 0.75, "mbar", 70.0, (60.0, 80.0)), 0.0002)
    assert (size.value, size.threshold) == (pytest.approx(1.23), 0.02)
    assert "by 1.23 % of full scale" in size.says
    assert (gained.value, gained.threshold) == (70.0, 0.0)
    assert "falls from 2.5 to 0.75 mbar" in gained.says
    _, lost = _held_out_evidence(0.0123, Gain(0.75, 2.5, "mbar", -233.0, (-300.0, -200.0)), 0.0002)
    assert "rises from 0.75 to 2.5 mbar" in lost.says


def _told(
    monkeypatch: pytest.MonkeyPatch,
    present: frozenset[str],
    kind_only: bool = False,
    laws: Any = (),
    is_sure: bool = True,
    by: Any = None,
    alone: Any = None,
    kind: float = 0.9,
    alternatives: Any = (),
    equivalents: tuple[str, ...] = ("orifice_leak",),
    channels: frozenset[str] = frozenset(),
    is_flexible: bool = True,
    doubt: str = "",
) -> Any:
    asked: list[Any] = []

    def after(fine: Any, model: Any) -> Errors:
        asked.append((fine, model))
        return BEFORE

    monkeypatch.setattr(_causes, "errors", after)
    monkeypatch.setattr(_causes, "parameters_of", lambda fit, name, scale: {"of": (fit, name, scale)})
    member = SimpleNamespace(
        kin=(),
        effect=SimpleNamespace(is_flexible=is_flexible),
        name="static_curve_block",
        size=0.0123,
        without=SimpleNamespace(model=SimpleNamespace(held_as=lambda whole: f"without, held as {whole}")),
        alternatives=(
            SimpleNamespace(effect=None, margin=55.0),
            SimpleNamespace(effect="delay", margin=90.0),
            *alternatives,
        ),
        laws=tuple(SimpleNamespace(effect=name, margin=margin, fit=f"{name}'s fit") for name, margin in laws),
        likelihood_ratio=400.0,
    )
    one = effect("linear_leak")
    name: Any = SimpleNamespace(
        member=member,
        effect=one,
        kind_probability=kind,
        law_probability=0.6,
        equivalents=equivalents,
        kind_only=kind_only,
        is_sure=is_sure,
        law_in_place=by,
        doubt=doubt,
    )
    excitation = Excitation((0.1,), (1.0,), present, STANDARD, channels=channels)
    whole = SimpleNamespace(model="the whole")
    found: Any = SimpleNamespace(fit=whole, best_single=alone)
    cause = cause_of(name, found, "fine", AFTER, SCALE, excitation, STANDARD)  # type: ignore[arg-type]
    assert asked == [("fine", "without, held as the whole")]
    fitted = (whole, "static_curve_block") if by is None else (by.fit, "linear_leak")
    if by is None and "linear_leak" in dict(laws):  # a law that the block is called by, near enough or not
        fitted = ("linear_leak's fit", "linear_leak")
    assert cause.parameters == {"of": (*fitted, SCALE)}
    assert (cause.effect, cause.confidence, cause.law_confidence) == (one, confidence_of(name), 0.6)
    assert (cause.equivalents, cause.size) == (equivalents, 0.0123)
    assert (cause.held_out.rmse_before, cause.held_out.rmse_after) == (pytest.approx(28.0), pytest.approx(14.0))
    return cause


@pytest.mark.parametrize(
    ("kin", "said"), [((), ""), (("clock_drift", "sensor_lag"), "clock drift and sensor lag, effects")]
)
def test_what_stands_beside_a_cause_and_is_of_its_kind_is_said(kin: tuple[str, ...], said: str) -> None:
    name: Any = SimpleNamespace(member=SimpleNamespace(kin=kin))
    told = _beside_kin(name)
    assert [one.value for one in told] == ([float(len(kin))] if kin else [])
    assert all(one.says.startswith(f"the extended model also has {said} of the same kind: ") for one in told)


def test_a_causes_evidence_is_what_it_brings_and_its_nearest_rivals_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    exposed = effect("linear_leak").exposed_by
    cause = _told(monkeypatch, exposed, laws=(("orifice_leak", 7.0), ("delay", 60.0)))
    assert cause.rivals == (Rival("orifice_leak", 7.0, "fit"), Rival("delay", 60.0, "fit"))
    fall, size, gained, rival = cause.evidence
    assert (fall.value, fall.threshold) == (55.0, 0.0)
    assert fall.says == (
        "without it, with all else fitted again, the data is less likely by 55 (-2 log likelihood, 10 is strong"
        " evidence), though other effects may take its place in part"
    )
    assert (size.value, gained.value) == (pytest.approx(1.23), pytest.approx(50.0))
    assert (rival.value, rival.threshold) == (7.0, 0.0)
    assert rival.says == f"orifice leak, the nearest rival, fits worse by 7 {BY_FIT}"
    cause = _told(monkeypatch, exposed, laws=(("orifice_leak", 95.0),))  # of another kind there is the evidence alone
    assert cause.rivals == (Rival("delay", 90.0, "evidence"), Rival("orifice_leak", 95.0, "fit"))
    rival_of = "the nearest rival that is not an equivalent"  # an orifice is, by its fit
    assert cause.evidence[-1].says == f"delay, {rival_of}, is less likely by 90 (-2 log likelihood)"


def test_a_cause_without_which_the_data_is_no_less_likely_is_said_to_be_so() -> None:
    name: Any = SimpleNamespace(member=SimpleNamespace(alternatives=(SimpleNamespace(effect=None, margin=-12.0),)))
    fall = _evidence_against_nothing(name)
    assert fall.value == -12.0
    assert fall.says == (
        "without it, with all else fitted again, the data is no less likely (-2 log likelihood falls by 12), since"
        " other effects take its place"
    )


def test_what_would_show_a_cause_best_is_said_where_it_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    exposed = effect("linear_leak").exposed_by
    assert exposed
    lacking = _told(monkeypatch, frozenset(), kind_only=True).evidence[-1]
    assert (lacking.value, lacking.threshold) == (len(exposed), 0.0)
    assert lacking.says == (
        "what would show it best is missing: loads held for some seconds, at several levels; rests without load"
        " between loads"
    )
    logged = _told(monkeypatch, frozenset(), kind_only=True, channels=exposed).evidence[-1]
    assert logged.statistic == "kind"  # what is logged is as good as what the load holds
    kind = _told(monkeypatch, exposed, kind_only=True).evidence[-1]
    assert (kind.statistic, kind.value, kind.threshold) == ("kind", 0.9, STANDARD.least_confidence)
    assert kind.says == (
        "what it does to the reading is sure, its law is not: no equation of its kind rules the others out, and it may"
        " be an effect that the catalogue does not have"
    )
    alone = _told(monkeypatch, exposed, kind_only=True, equivalents=()).evidence[-1]
    assert "its law is not: linear leak is by far the nearest, but misses more than" in alone.says
    # 200 of its 400 missed is half; beyond it a law follows nothing to speak of, at null at the worst.
    for missed, is_near in ((200.0, True), (201.0, False)):
        laws = (("linear_leak", missed),)
        said = _told(monkeypatch, exposed, kind_only=True, equivalents=(), laws=laws).evidence[-2].says
        assert ("linear leak is by far the nearest" in said) is is_near
        assert ("none of its kind follows half of it; linear leak comes nearest" in said) is not is_near
    doubt = _told(monkeypatch, exposed, kind_only=True, is_sure=False).evidence[-1]
    assert (doubt.statistic, doubt.value) == ("confidence of its kind", 0.9)
    named = "it is not sure, since other effects do as well; it is named because"
    size = (
        f"{named} it is larger than all that is left unexplained, or than small imperfections and errors of other laws"
    )
    assert doubt.says == size
    for alone, is_why in (("orifice_leak", True), ("delay", False)):  # one of its kind does most by itself, or another
        doubt = _told(monkeypatch, exposed, is_sure=False, alone=effect(alone)).evidence[-1]
        assert doubt.says == (f"{named} by itself it predicts left-out data best" if is_why else size)
    own = _told(monkeypatch, exposed, is_sure=False, doubt="the zero jumps").evidence[-1]
    assert own.says == size.replace("other effects do as well", "the zero jumps")


def test_a_law_that_a_block_carries_is_told_with_its_own_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    by = SimpleNamespace(fit="the law's", margin=10.0)
    cause = _told(monkeypatch, effect("linear_leak").exposed_by, laws=(("orifice_leak", 25.0),), by=by)
    assert cause.rivals == (Rival("orifice_leak", 15.0, "fit"), Rival("delay", 90.0, "evidence"))
    told = cause.evidence[-1]
    assert (told.value, told.threshold) == (2.5, 100.0 * STANDARD.departure**2)
    assert told.says == (
        "its equation misses 2.5 % of the effect, no more than equations usually do: the extended model keeps the free"
        " form, and the parameters are the equation's"
    )


@pytest.mark.parametrize(
    ("margin", "missed", "much"), [(10.0, "2.5", "no more"), (25.0, "6.2", "no more"), (26.0, "6.5", "more")]
)
def test_a_block_that_is_called_by_its_nearest_law_has_that_laws_parameters(
    monkeypatch: pytest.MonkeyPatch, margin: float, missed: str, much: str
) -> None:
    """Though it misses more of 400 than laws do, a sixteenth: then that is said."""
    laws = (("linear_leak", margin), ("orifice_leak", 40.0))
    cause = _told(monkeypatch, effect("linear_leak").exposed_by, kind_only=True, laws=laws)
    assert cause.parameters == {"of": ("linear_leak's fit", "linear_leak", SCALE)}
    (told,) = (one for one in cause.evidence if one.statistic.startswith("share of its kind"))
    assert (told.value, told.threshold) == (pytest.approx(margin / 4.0), 6.25)
    assert told.says == (
        f"its equation misses {missed} % of the effect, {much} than equations usually do: the extended model keeps the"
        " free form, and the parameters are the equation's"
    )
    assert "linear_leak" not in [one.effect for one in cause.rivals]
    # A curve at the end of its kind is another law's curve, and is what stays in the model.
    cause = _told(monkeypatch, effect("linear_leak").exposed_by, kind_only=True, laws=laws, is_flexible=False)
    assert "the extended model keeps static curve block, and" in str([one.says for one in cause.evidence])
    # Of one that no law was fitted for, the block's own are told, and of no equation what it misses.
    cause = _told(monkeypatch, effect("linear_leak").exposed_by, kind_only=True, laws=laws[1:])
    assert cause.parameters["of"][1:] == ("static_curve_block", SCALE)
    assert not any(one.statistic.startswith("share of its kind") for one in cause.evidence)


def test_no_rival_is_a_block_of_free_form(monkeypatch: pytest.MonkeyPatch) -> None:
    exposed = effect("linear_leak").exposed_by
    near = (SimpleNamespace(effect="flexible_lag", margin=3.0), SimpleNamespace(effect="dead_band", margin=70.0))
    cause = _told(monkeypatch, exposed, laws=(("flexible_leak", 1.0),), alternatives=near)
    assert cause.rivals == (Rival("dead_band", 70.0, "evidence"), Rival("delay", 90.0, "evidence"))
    rival_of = "the nearest rival that is not an equivalent"  # an orifice is, by its fit
    assert cause.evidence[-1].says == f"dead band, {rival_of}, is less likely by 70 (-2 log likelihood)"


@pytest.mark.parametrize(
    ("margin", "said"),
    [
        (0.6, f"fits worse by 0.6 {BY_FIT}"),
        (0.0, "fits as well"),
        (-0.4, "fits as well"),
        (-3.0, f"fits better by 3 {BY_FIT}"),
    ],
)
def test_a_rival_that_fits_as_well_is_as_likely_and_one_that_fits_better_likelier(
    monkeypatch: pytest.MonkeyPatch, margin: float, said: str
) -> None:
    cause = _told(monkeypatch, effect("linear_leak").exposed_by, laws=(("orifice_leak", margin),))
    (rival,) = (one for one in cause.evidence if one.statistic == "margin to the nearest rival")
    assert (rival.value, rival.says) == (margin, f"orifice leak, the nearest rival, {said}")
    assert _nearest_rival(()) == []
    (far,) = _nearest_rival([Rival("delay", 278533.0, "evidence")])
    assert far.says == "delay, the nearest rival, is less likely by 278,533 (-2 log likelihood)"
    (likelier,) = _nearest_rival([Rival("delay", -12.0, "evidence")])
    assert likelier.says == "delay, the nearest rival, is likelier by 12 (-2 log likelihood)"


@pytest.mark.parametrize(("signal", "factor", "unit"), [("reading", -140.0, "mbar"), ("load", 800.0, "N")])
@pytest.mark.parametrize(("alternatives", "is_seen"), [((), True), (("another",), True), (("another",), False)])
def test_a_zero_is_a_cause_by_which_every_reading_is_off(
    signal: str, factor: float, unit: str, alternatives: tuple[str, ...], is_seen: bool
) -> None:
    zero = Zero(shift_of(signal), -0.02, 0.004, 0.03, alternatives, is_seen=is_seen)
    cause = zero_cause_of(zero, AFTER, SCALE, STANDARD)
    ((name, parameter),) = cause.parameters.items()
    assert name == zero.effect.parameters[0].name
    assert (parameter.value, parameter.sd, parameter.unit) == (-0.02 * factor, 0.004 * abs(factor), unit)
    half = 1.959963984540054 * 0.004 * abs(factor)
    assert parameter.ci95 == pytest.approx((-0.02 * factor - half, -0.02 * factor + half))
    # Without it each of 400 samples would be off by it beside the errors that there are.
    worse = math.sqrt((4.0 + 400 * 0.03**2) / 400.0)
    assert cause.held_out.rmse_before == pytest.approx(140.0 * worse)
    assert cause.held_out.rmse_after == pytest.approx(14.0)
    seen, size, _ = cause.evidence
    assert (seen.value, seen.threshold) == (pytest.approx(5.0), pytest.approx(3.8906, abs=1e-4))
    assert "it is 5 standard deviations" in seen.says
    assert size.value == pytest.approx(3.0)
    assert cause.confidence == (1.0 - STANDARD.false_name if is_seen else STANDARD.least_confidence)
    assert cause.law_confidence == (0.5 if alternatives else 1.0)
    assert (cause.equivalents, cause.size) == (alternatives, 0.03)


def test_a_zero_of_some_recordings_gains_nothing_that_is_known_on_others() -> None:
    zero = Zero(shift_of("load"), -0.02, 0.004, 0.03)
    cause = zero_cause_of(zero, AFTER, SCALE, STANDARD, is_of_all=False)
    assert math.isnan(cause.held_out.gain_percent)
    assert [one.statistic for one in cause.evidence] == ["deviations from nothing", "size in percent of full scale"]


def test_goodness_is_in_the_readings_unit() -> None:
    found = _goodness(AFTER, 7.0, _left(0.02), SCALE)
    assert (found.rmse, found.unit, found.force_rmse_n) == (pytest.approx(14.0), "mbar", 7.0)
    assert found.structure_rms == pytest.approx(2.8)
    assert found.fit_percent == pytest.approx(87.5)
    assert found.variance_explained_percent == pytest.approx(100.0 * (1.0 - 1.0 / 64.0))


# -- traces and offsets -----------------------------------------------------------------------------------------------
TIME_S = 0.05 * np.arange(600)
LOAD = np.abs((TIME_S / 2.0) % 2.0 - 1.0)


def _prepared_run(offset_mbar: float = 0.0) -> Any:
    share = MODEL.simulate(Conditions(TIME_S, LOAD, 0.05))
    reading = offset_mbar + 3.0 - 140.0 * share
    run = Recording.from_arrays(time_s=TIME_S + 5.0, force_n=800.0 * LOAD, pressure_mbar=reading, name="run")
    (session,) = prepare([run], [np.ones(600, dtype=bool)], None, SCALE, [1], STANDARD)
    return session


def test_a_trace_is_as_it_was_logged() -> None:
    session = _prepared_run()
    other = replace(MODEL, gain=0.9)
    found = _trace(session, other, MODEL, SCALE)
    assert found.name == "run"
    assert found.time_s == pytest.approx(TIME_S + 5.0)
    assert found.load_n == pytest.approx(800.0 * session.conditions.load)
    assert found.reading == pytest.approx(3.0 - 140.0 * session.reading)
    for shown, model in ((found.baseline, other), (found.extended, MODEL)):
        plain = model.simulate(session.conditions)
        own = own_terms_of(session, model, session.reading - plain)[1]
        assert shown == pytest.approx(3.0 - 140.0 * (plain + own))
    assert found.extended == pytest.approx(found.reading, abs=1.0)
    assert (found.usable is session.usable, found.held_out is session.held_out) == (True, True)
    assert found.cycle is session.cycle


def test_a_model_gives_readings_as_they_are_logged() -> None:
    """A shift of the reading stands before the chain's end, which multiplies it."""
    session = _prepared_run(offset_mbar=14.0)
    mean = float(np.mean(offsets([session], MODEL)))
    assert mean == pytest.approx(-0.1, abs=0.01)
    ((name, part),) = [(one.name, one.values) for one in _with_offset(MODEL, [session], SCALE).parts]
    assert (name, part) == (shift_of("reading").name, pytest.approx([(mean + 3.0 / -140.0) / 1.2]))
    nothing = replace(SCALE, zero=-mean * SCALE.reading)
    assert _with_offset(MODEL, [session], nothing).parts == ()
    # What is not undone stays in the model, and its zero in that of what is.
    drifting = MODEL.with_part("zero_drift", np.array([1e-3, 0.0, 0.0, 1.0]))
    first, second = _with_offset(drifting, [session], SCALE, MODEL).parts
    assert (first.name, second.values) == ("zero_drift", pytest.approx(part))
    assert _with_offset(drifting, [session], SCALE).parts[1].values != pytest.approx(part)


@pytest.mark.parametrize(("left", "is_small"), [(0.002, True), (0.0029, True), (0.0031, False), (0.08, False)])
def test_small_imperfections_are_said_to_follow_no_more_than_they_add_up_to(left: float, is_small: bool) -> None:
    found: Any = SimpleNamespace(nearest_law=(effect("delay"), left, 0.3 * left), refused=())
    (said,) = limit_nearest_law(found, Thresholds())
    assert said.startswith(
        f"delay alone explains most of what the baseline misses on the fitted data ({percent(left)} of"
    )
    assert ("small imperfections" in said, "set `material`" in said) == (is_small, is_small)
    found.refused = ("delay",)
    (said,) = limit_nearest_law(found, Thresholds())
    assert "no other recording or load cycle of this data confirms it" in said
