"""A diagnosis put together from what each of its parts answers, and recordings prepared for it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_procedure_by_hand import AFTER, BEFORE, LOAD, MODEL, SCALE, STANDARD, TIME_S, _left

from smartshoe import Recording
from smartshoe.diagnosis import _force, _procedure, _withheld
from smartshoe.diagnosis._force import Compensation, ForceError
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange
from smartshoe.diagnosis._held_out import Errors
from smartshoe.diagnosis._prepared import prepared
from smartshoe.diagnosis._procedure import diagnosed
from smartshoe.diagnosis._zero import Zero
from smartshoe.integrity import OneClock
from smartshoe.models.effects import effect, shift_of

Array = NDArray[np.float64]

FAULT: Any = SimpleNamespace(kind="gaps", recording=0, error=0.0)
SCREENED = ("delay", "flexible_lag", "linear_leak", "dead_band", "rate_gain", "warm_up")
SCREENING = tuple((name, float(k)) for k, name in enumerate(SCREENED))
FINE: Any = SimpleNamespace(conditions=SimpleNamespace(step_s=0.05))
PLAIN_N, EXTENDED_N = ForceError(8.0, 9.0), ForceError(6.0, 7.0)
FILTER: Any = SimpleNamespace(not_inverted=(), moved_in_an_hour={}, lags_left_s={})  # undoes all


def test_recordings_are_prepared_with_what_is_held_out_and_what_is_said_beforehand() -> None:
    def run(seed: int) -> Recording:
        noise = 0.1 * np.random.default_rng(seed).standard_normal(600)
        return Recording.from_arrays(
            time_s=TIME_S, force_n=800.0 * LOAD, pressure_mbar=140.0 * LOAD + noise, name=f"run_{seed}"
        )

    runs = [run(seed) for seed in range(3)]
    usable = tuple(np.ones(600, dtype=bool) for _ in runs)

    def integrity(lag_s: float) -> Any:
        lags_s, shared = (lag_s,) * 3, OneClock(lag_s, 0.0)
        return SimpleNamespace(
            clock_offset_s=lags_s, clock_rate=(0.0,) * 3, one_clock=shared, usable=usable, others=frozenset()
        )

    found = prepared(runs, 2, integrity(0.0), STANDARD)
    assert [bool(one.held_out.all()) for one in found.sessions] == [False, False, True]
    assert [one.thinned for one in found.fine] == [1, 1, 1]
    assert not found.is_no_unit
    assert found.start.parts == ()
    within = prepared(runs, 3, integrity(0.0), STANDARD)
    assert all(0.1 < float(one.held_out.mean()) < 0.6 for one in within.sessions)
    late = prepared(runs, 3, integrity(0.3), STANDARD)
    ((name, value),) = [(one.name, one.values) for one in late.start.parts]
    assert (name, value) == ("delay", pytest.approx([0.3]))
    assert (late.start.relaxing_share, late.start.relaxation_rate_per_s) == (0.08, 0.22)
    assert not late.is_moved
    # A reading that is moved by itself matters where it is fitted.
    for lags, count, is_moved in (((0.3, 0.0, 0.0), 2, True), ((0.0, 0.0, 0.3), 2, False), ((0.0, 0.0, 0.3), 3, True)):
        apart = SimpleNamespace(
            clock_offset_s=lags, clock_rate=(0.0,) * 3, one_clock=None, usable=usable, others=frozenset()
        )
        assert prepared(runs, count, apart, STANDARD).is_moved is is_moved  # type: ignore[arg-type]
    # Friction in each recording is no unit's; in one of them it is said.
    rubbed = [replace_reading(one, 5.0 * np.sign(np.gradient(LOAD))) for one in runs]
    assert prepared(rubbed, 3, integrity(0.0), STANDARD).is_no_unit
    mixed = prepared([runs[0], rubbed[1], runs[2]], 3, integrity(0.0), STANDARD)
    assert not mixed.is_no_unit
    assert sum("friction; Coulomb" in said for said in mixed.limits) == 1
    assert sum("friction; Coulomb" in said for said in prepared(runs, 3, integrity(0.0), STANDARD).limits) == 0


def replace_reading(one: Recording, reading: Array) -> Recording:
    return Recording.from_arrays(time_s=one.time_s, force_n=one.force_n, pressure_mbar=reading, name=one.name)


@dataclass(frozen=True)
class _Session:
    """Three samples, of which some may be fitted."""

    name: str
    index: int
    fitted: NDArray[np.bool_]
    usable: NDArray[np.bool_] = field(default_factory=lambda: np.ones(3, dtype=bool))

    @property
    def recording(self) -> Any:
        return SimpleNamespace(sensor=SimpleNamespace(unit=SCALE.unit))


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Every step of a diagnosis by what it is told to answer."""
    fitted, held = _Session("fitted", 0, np.array([True, True, False])), _Session("held", 1, np.zeros(3, dtype=bool))
    given = SimpleNamespace(
        sessions=[held, fitted], fine=[FINE], scale=SCALE, limits=["limit"], start="start",
        excitation=SimpleNamespace(goes_with_the_clock=False, shows=lambda _: True),
        is_no_unit=False, clocks=(), is_moved=False, thresholds=STANDARD,
    )  # fmt: skip
    extended = MODEL.with_part("linear_leak").with_part("delay", np.array([0.2]))
    core = SimpleNamespace(effect=effect("second_relaxation"), size=0.5, name="second_relaxation")
    other = SimpleNamespace(effect=effect("dead_band"), size=0.25, name="dead_band")
    found = SimpleNamespace(
        fit=SimpleNamespace(model=extended), baseline=SimpleNamespace(model=MODEL), members=(core, core, other),
        can_validate=True, refused=(), undone=(), alone=None, screening=SCREENING,
        likeness=np.eye(6), own_gains=(), zero_changes=(), nearest=None,
    )  # fmt: skip
    kinds = [_left(0.3), _left(0.02), _left(0.01)]  # before, after, and of what was learnt
    kinds[2].memory, kinds[2].size = "memory", 0.07
    made = SimpleNamespace(
        given=given,
        found=found,
        kinds=kinds,
        names=[],
        zeros=[],
        seen={},
        sizes={"linear_leak": 0.1, "delay": 0.3},
        not_undone=[],
        as_calibrated=[],
        unproven=0.0,
        beyond=0.0,
        judged=1.0,
        off=0.05,
        wall_ratio=None,
    )

    def structure(sessions: Any, residuals: Any, thresholds: Any, quick: Any = None) -> Any:
        made.seen.setdefault("structure", []).append((list(sessions), list(residuals)))
        made.seen.setdefault("quick", []).append(quick)
        return made.kinds[len(made.seen["structure"]) - 1]

    def answer(name: str, value: Any) -> None:
        def called(*args: Any, **named: Any) -> Any:
            made.seen[name] = (args, named)
            return value(*args) if callable(value) else value

        monkeypatch.setattr(_withheld if hasattr(_withheld, name) else _procedure, name, called)

    def cause(name: Any, *_: Any) -> Any:
        return SimpleNamespace(name=name.name, size=made.sizes[name.name], rivals=(f"rival of {name.name}",))

    answer("prepared", given)
    answer("infer", found)
    answer("residual_of", lambda session, model: f"{getattr(session, 'name', session)} {len(model.parts)}")
    monkeypatch.setattr(_procedure, "residual_structure", structure)
    answer("repeating", lambda fine, left, thresholds: (fine, left))
    answer("names_of", lambda *_: tuple(made.names))
    answer("other_kind_of", lambda name, *_: "it turned" if name.name == "turned" else None)
    answer("zeros_of", lambda *_: tuple(made.zeros))
    answer("errors", lambda fine, model: AFTER if len(model.parts) else BEFORE)
    answer("fitted_rms", lambda *_: made.off)
    answer("cause_of", cause)
    answer("zero_cause_of", lambda zero, *_: SimpleNamespace(name="zero", size=zero.size, rivals=("of zero",)))
    answer("_with_offset", "with offset")
    answer("noise_kinds", ["noise"])
    answer("joint_parameters", ({"p": 1}, ((1.0,),)))
    answer("wall_ratio_of", lambda *_: made.wall_ratio)
    answer("not_undone_of", lambda *_: list(made.not_undone))
    answer("own_zeros", None)
    answer("mean_offset", 0.02)
    monkeypatch.setattr(_force, "mean_offset", lambda *_: 0.02)
    answer("as_calibrated", lambda *_: list(made.as_calibrated))
    answer("compensation", lambda fine, model, *_: Compensation(fine, model, EXTENDED_N, PLAIN_N, EXTENDED_N, FILTER))
    answer("next_experiment", "next")
    answer("_trace", "trace")
    answer("sentence_of", "sentence")
    answer("names_in", "names")
    answer("not_explained_of", "left")
    answer("off_elsewhere", 0.0)
    answer("beyond_noise", lambda *_: made.beyond)
    answer("left_where_judged", lambda *_: made.judged)
    answer("not_shown_to_be_noise", lambda *_: made.unproven)
    answer("load_cycles", 9)
    return made


def _run_diagnosis(parts: Any) -> Any:
    said: list[str] = []
    integrity: Any = SimpleNamespace(faults=(FAULT,))
    result = diagnosed(["recordings"], 1, integrity, STANDARD, said.append)  # type: ignore[list-item]
    assert said == ["judging on held-out data"]
    return result


def _name(name: str, kind_only: bool = False, size: float = 0.1, is_sure: bool = True, kind: float = 0.9) -> Any:
    known, member = effect("delay" if name == "turned" else name), SimpleNamespace(size=size, name=name)
    return SimpleNamespace(
        name=name, kind_only=kind_only, is_sure=is_sure, effect=known, member=member, kind_probability=kind
    )


def test_a_diagnosis_is_put_together_from_its_parts(parts: Any) -> None:
    parts.names = [_name("linear_leak"), _name("turned", size=STANDARD.tolerable), _name("delay")]
    parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, 0.2), Zero(shift_of("reading"), 0.2, 0.1, 1e-4)]
    told = _run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["delay", "zero", "linear_leak"]  # the largest first, no immaterial one
    assert (told.unit, told.full_scale_load_n, told.full_scale_reading) == ("mbar", 800.0, 140.0)
    assert (told.verdict, told.says, told.minor) == ("explained", "sentence", ())
    assert told.data_faults == (FAULT, "noise")
    assert (told.baseline.rmse, told.extended.rmse) == (pytest.approx(28.0), pytest.approx(14.0))
    assert (told.baseline.force_rmse_n, told.extended.force_rmse_n) == (9.0, 7.0)
    assert (told.baseline.structure_rms, told.extended.structure_rms) == (pytest.approx(42.0), pytest.approx(2.8))
    assert told.gain.gain_percent == pytest.approx(50.0)
    # Of the error's variance 0.04 as much is noise as what was fitted holds beside its structure.
    assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.05**2 - 0.01**2) / 0.04))
    assert told.explained_percent == pytest.approx(75.0)
    assert (told.rivals, told.next_experiment) == (("rival of delay",), "next")
    assert told.likeness is parts.found.likeness
    assert (told.limits, told.leftover, told.screening) == (("limit", "it turned"), None, parts.found.screening)
    assert (told.model, told.rejected, told.parameters) == ("with offset", None, {"p": 1})
    assert told.baseline_model.to_dict() == replace(MODEL, noise=parts.off).to_dict()
    assert (told.covariance, told.traces, told.thresholds) == (((1.0,),), ("trace",), STANDARD)
    seen = parts.seen
    assert [residuals for _, residuals in seen["structure"]] == [
        ["held 0", "fitted 0"], ["held 2", "fitted 2"], ["fitted 2"],
    ]  # fmt: skip
    assert [[(one.name, list(one.usable)) for one in structure] for structure, _ in seen["structure"]] == [
        [("held", [True] * 3), ("fitted", [True] * 3)], [("held", [True] * 3), ("fitted", [True] * 3)],
        [("fitted", [True, True, False])],  # a cycle that is held out decides over no name
    ]  # fmt: skip
    assert seen["names_of"][0][1:] == (0.07, STANDARD)  # all beyond noise, of what was fitted
    assert seen["names_of"][1] == {
        "is_clocked": False, "is_unsteady": False, "alone": None,
    }  # fmt: skip
    assert seen["zeros_of"][0][3:5] == (0.07, 1.0)  # what effects of the core remember
    assert [one.size for one in seen["_with_offset"][0][1]] == [0.2]
    assert seen["noise_kinds"][0][3:] == (True, STANDARD.material, "memory")
    assert seen["next_experiment"][1] == {"open_": False, "worse": False}  # as little is left as is explained
    assert seen["infer"][0][4] is True


@pytest.mark.parametrize(("after", "is_rejected"), [(1.001, True), (1.0, False)])
def test_an_extension_that_is_worse_where_it_is_judged_is_not_adopted(
    parts: Any, monkeypatch: pytest.MonkeyPatch, after: float, is_rejected: bool
) -> None:
    """It is still told, with its causes and what it would do; what is offered is the plain model's."""
    parts.names = [_name("linear_leak")]
    best = replace(BEFORE, squares=after**2 * BEFORE.squares)
    monkeypatch.setattr(_procedure, "errors", lambda _, model: best if model.parts else BEFORE)
    monkeypatch.setattr(_procedure, "beyond", lambda *_: None)
    told = _run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["linear_leak"]
    assert told.gain.rmse_after == pytest.approx(after * told.gain.rmse_before)
    assert told.extended.rmse == pytest.approx(told.baseline.rmse)
    extended = parts.found.fit.model.names
    offered = () if is_rejected else extended
    assert parts.seen["_with_offset"][0][0].names == parts.seen["compensation"][0][1].names == offered
    assert (told.rejected.names if told.rejected else None) == (extended if is_rejected else None)
    assert parts.seen["joint_parameters"][0][0] is (parts.found.baseline if is_rejected else parts.found.fit)
    assert any("; it is rejected" in said for said in told.limits) is is_rejected
    assert told.explained_percent == 0.0
    assert told.extended.structure_rms == pytest.approx(42.0 if is_rejected else 2.8)


def test_the_sentence_is_told_what_is_in_the_model_and_what_is_left(parts: Any) -> None:
    parts.names = [_name("linear_leak")]
    told = _run_diagnosis(parts)
    (causes, unnamed), _ = parts.seen["names_in"]
    assert ([one.name for one in causes], unnamed, told.minor) == (["linear_leak"], 1, ("delay",))
    assert parts.seen["not_explained_of"][0] == (parts.kinds[1], 0.0, 0.0, STANDARD)
    assert "not_shown_to_be_noise" not in parts.seen
    given, named = parts.seen["sentence_of"]
    assert given == ("explained", "names", BEFORE, AFTER, "left", STANDARD)
    assert named == {"worse": False, "withheld": False}


def test_what_is_off_elsewhere_is_held_against_what_was_fitted_at_the_same_rate(parts: Any) -> None:
    """A hum stands in both; thinned, it stands in neither."""
    for parts.beyond, within in ((0.0, 0.07), (0.09, 0.09)):
        parts.seen.clear()
        _run_diagnosis(parts)
        assert parts.seen["off_elsewhere"][0] == ([FINE], [f"{FINE} 2"], within, STANDARD)


def test_where_nothing_can_be_tested_what_is_not_shown_to_be_noise_is_not_explained(parts: Any) -> None:
    """However little of it stands out: one load cycle repeats nothing."""
    parts.found.can_validate = False
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    for unproven, verdict in ((0.0, "adequate"), (0.004, "unexplained")):
        parts.seen.clear()
        parts.unproven = unproven
        assert _run_diagnosis(parts).verdict == verdict
        sessions, residuals, left, thresholds, known, before = parts.seen["not_shown_to_be_noise"][0]
        assert before is None
        assert (sessions, residuals) == ([FINE], [f"{FINE} 2"])  # at full rate
        assert (left is parts.kinds[1], thresholds, known) == (True, STANDARD, 0.0)
        assert parts.seen["not_explained_of"][0][1:3] == (0.0, unproven)


@pytest.mark.parametrize(
    ("cycles", "after", "material", "verdict"),
    [
        (30, 0.1, None, "unexplained"), (30, 0.1, 0.5, "adequate"),  # as much counts for nothing
        (30, 0.199998, None, "adequate"),  # hardly any
        (2, 0.1, None, "adequate"),  # by chance, as far as is known
    ],
)  # fmt: skip
def test_what_the_extended_model_does_away_with_for_certain_is_not_good_enough_without_it(
    parts: Any, monkeypatch: pytest.MonkeyPatch, cycles: int, after: float, material: float | None, verdict: str
) -> None:
    """Pieces of a few seconds repeat nothing, so that no test of what is left finds it."""
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    counts = np.full(cycles, 100.0)
    of = {False: Errors(0.2**2 * counts, counts, 0.4), True: Errors(after**2 * counts, counts, 0.4)}
    monkeypatch.setattr(_procedure, "errors", lambda fine, model: of[bool(model.parts)])
    said: list[str] = []
    given = parts.given.thresholds = STANDARD if material is None else replace(STANDARD, material=material)
    integrity: Any = SimpleNamespace(faults=(FAULT,))
    told = diagnosed(["recordings"], 1, integrity, given, said.append)  # type: ignore[list-item]
    assert told.verdict == verdict


def test_a_simulation_is_not_good_enough_where_no_test_would_show_what_is_left(parts: Any) -> None:
    """Two cycles that can be left out in turn, and too few to tell noise; beside causes it is weighed by what was."""
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    parts.unproven = 0.004
    for is_tested, names, verdict in (
        (True, [], "adequate"), (False, [], "unexplained"), (True, [_name("linear_leak")], "explained"),
        (False, [_name("linear_leak")], "partly_explained"),
    ):  # fmt: skip
        parts.seen.clear()
        parts.kinds[1].is_tested, parts.names = is_tested, names
        assert _run_diagnosis(parts).verdict == verdict
        if not is_tested:
            before = parts.seen["not_shown_to_be_noise"][0][5]
            assert before == ([f"{FINE} 0"] if names else None)  # what the plain model leaves


@pytest.mark.parametrize(
    ("why", "is_withheld"),
    [
        ({}, False),
        ({"is_no_unit": True}, True),
        ({"can_validate": False}, True),
        ({"zero_changes": (ZeroChange("a", 1.0, 0.02),)}, True),
        ({"own_gains": (OwnGain("a", 0.0, 0.02), OwnGain("b", 0.0, -0.02))}, True),
        ({"turned": True}, True),
    ],
)
def test_a_cause_is_withheld_where_the_limits_say_why(parts: Any, why: dict[str, Any], is_withheld: bool) -> None:
    for name, value in why.items():
        setattr(parts.given if hasattr(parts.given, name) else parts.found, name, value)
    parts.names = [_name("turned")] if "turned" in why else []
    told = _run_diagnosis(parts)
    assert (told.verdict, told.causes) == ("unexplained", ())
    assert (len(told.limits) > 1) is is_withheld or parts.given.is_no_unit  # of which more is said beforehand
    assert parts.seen["sentence_of"][1]["withheld"] is is_withheld


def test_what_an_effect_without_a_name_moves_is_not_explained(parts: Any) -> None:
    for size, verdict in ((STANDARD.tolerable, "explained"), (1.01 * STANDARD.tolerable, "partly_explained")):
        parts.seen.clear()
        parts.names = [_name("linear_leak"), _name("turned", size=size)]
        assert _run_diagnosis(parts).verdict == verdict


def test_names_know_whether_loads_go_with_the_clock_and_zeros_change(parts: Any) -> None:
    for there in (True, False):
        parts.seen.clear()
        parts.given.excitation.goes_with_the_clock = there
        parts.found.zero_changes = (ZeroChange("a", 1.0, 0.02),) if there else ()
        _run_diagnosis(parts)
        assert parts.seen["names_of"][1] == {"is_clocked": there, "is_unsteady": there, "alone": None}


def test_what_is_late_beside_readings_that_were_moved_is_said_and_no_cause(parts: Any) -> None:
    parts.names = [_name("linear_leak"), _name("delay")]
    parts.given.is_moved = True
    told = _run_diagnosis(parts)
    assert ([one.name for one in told.causes], told.minor) == (["linear_leak"], ("delay",))
    (_, said) = told.limits
    assert said.startswith("delay fits, but readings were moved to the load's clock before")


def test_of_two_effects_of_one_mechanism_the_surer_is_named_unless_the_other_is_no_departure(parts: Any) -> None:
    """Friction that grows with the load and friction that does not are limits of one law."""
    most = STANDARD.law_departure * 0.1
    for other, sure, named in (
        ("load_unload_asymmetry", 0.8, ["play_hysteresis"]),
        ("play_hysteresis", 0.95, ["load_unload_asymmetry"]),
    ):
        sizes = {"play_hysteresis": 0.1, "load_unload_asymmetry": 0.1, other: most}
        for size, is_departure in ((most, True), (1.001 * most, False)):
            parts.sizes |= {**sizes, other: size}
            sized = {name: _name(name, size=parts.sizes[name]) for name in ("play_hysteresis", "delay")}
            asymmetry = _name("load_unload_asymmetry", size=parts.sizes["load_unload_asymmetry"], kind=sure)
            parts.names = [*sized.values(), asymmetry]
            parts.seen.clear()
            told = _run_diagnosis(parts)
            assert {one.name for one in told.causes} == {*named, "delay"} | (set() if is_departure else {other})
            one, surest = (name.replace("_", " ") for name in (other, *named))
            said = (
                f"{one} fits, but it may be no more than the error of the equation of {surest} (both are friction), so"
                " that it is not named"
            )
            assert (said in told.limits) is is_departure


def test_so_many_load_cycles_show_so_many_causes(parts: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The surest of them; and one that is none for a reason of its own counts for nothing."""
    for cycles, sure, named in ((1, 0.8, ["linear_leak"]), (2, 0.8, ["delay", "linear_leak"]), (1, 0.95, ["delay"])):
        parts.names = [_name("turned"), _name("linear_leak"), _name("delay", kind=sure)]
        parts.seen.clear()
        monkeypatch.setattr(_withheld, "load_cycles", lambda sessions, thresholds, cycles=cycles: cycles)
        told = _run_diagnosis(parts)
        assert [one.name for one in told.causes] == named
        other = "linear leak" if sure > 0.9 else "delay"
        said = (
            f"{other} fits, but so few load cycles (1) show no more than as many causes, so that it is not named"
            " (repeat the cycles)"
        )
        assert (said in told.limits) is (cycles == 1)


def test_a_block_whose_kind_is_a_cause_is_not_listed_beside_it(parts: Any) -> None:
    parts.sizes["orifice_leak"] = 0.1
    parts.names = [_name("orifice_leak", kind_only=True)]
    parts.names[0].member.name = "linear_leak"
    told = _run_diagnosis(parts)
    assert ([one.name for one in told.causes], told.minor) == (["orifice_leak"], ("delay",))


def test_what_nothing_names_is_unexplained_and_says_where_it_lies(parts: Any) -> None:
    told = _run_diagnosis(parts)
    assert (told.verdict, told.leftover, told.causes) == ("unexplained", "here", ())
    assert [one.effect for one in told.rivals] == ["delay", "linear_leak", "dead_band", "rate_gain"]  # no block is one
    assert [one.margin for one in told.rivals] == [0.0, 2.0, 3.0, 4.0]
    assert told.minor == ("linear_leak", "delay")
    assert parts.seen["noise_kinds"][0][3] is False
    parts.seen.clear()
    parts.kinds[1].is_noise = True
    _run_diagnosis(parts)
    assert parts.seen["noise_kinds"][0][3] is True


def test_what_hides_in_noise_is_not_left(parts: Any) -> None:
    parts.kinds[1].significant, parts.kinds[1].rms = False, 0.0
    told = _run_diagnosis(parts)  # what effects without a name did away with is not explained
    assert (told.verdict, told.leftover) == ("unexplained", "here")
    assert parts.seen["next_experiment"][1] == {"open_": True, "worse": False}
    parts.seen.clear()
    parts.kinds[0].significant, parts.kinds[0].rms = False, 0.0
    told = _run_diagnosis(parts)
    assert (told.verdict, told.leftover) == ("adequate", None)
    assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.05**2 - 0.01**2) / 0.04))
    assert parts.seen["next_experiment"][1] == {"open_": False, "worse": False}
    assert parts.seen["noise_kinds"][0][3] is True


def test_where_a_kind_has_no_law_or_none_is_sure_no_more_than_what_is_tolerable_may_be_left(parts: Any) -> None:
    for kind_only, is_sure, other, verdict in (
        (False, True, True, "explained"),
        (False, False, True, "explained"),  # what is left is of the one that is sure
        (False, False, False, "partly_explained"),
        (True, True, True, "partly_explained"),
    ):
        parts.seen.clear()
        parts.names = [_name("linear_leak", is_sure=other), _name("delay", kind_only, is_sure=is_sure)]
        told = _run_diagnosis(parts)
        assert (told.verdict, told.leftover is None) == (verdict, verdict == "explained")


def test_of_what_is_no_unit_or_one_cycle_no_zero_is_told(parts: Any) -> None:
    parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, 0.2)]
    parts.given.is_no_unit = True
    told = _run_diagnosis(parts)
    assert (told.causes, told.verdict) == ((), "unexplained")
    assert parts.seen["infer"][0][4] is False
    parts.seen.clear()
    parts.given.is_no_unit, parts.found.can_validate = False, False
    assert _run_diagnosis(parts).causes == ()
    parts.seen.clear()
    parts.found.can_validate = True
    assert [one.name for one in _run_diagnosis(parts).causes] == ["zero"]


def test_a_tares_own_creep_is_said_and_no_cause(parts: Any) -> None:
    parts.sizes["warm_up"] = 0.02
    parts.names = [_name("warm_up", size=0.02), _name("delay", size=0.3)]
    for tare, causes, said in ((0.2, ["delay", "zero"], 1), (0.199, ["delay", "zero", "warm_up"], 0)):
        parts.seen.clear()
        parts.zeros = [Zero(shift_of("load"), tare, 0.01, tare)]
        told = _run_diagnosis(parts)
        assert [one.name for one in told.causes] == causes
        assert sum("warm up moves the reading by 2 %" in limit for limit in told.limits) == said


def test_what_is_material_at_the_least_is_a_zero(parts: Any) -> None:
    for size, count in ((STANDARD.material, 1), (0.999 * STANDARD.material, 0)):
        parts.seen.clear()
        parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, size)]
        assert len(_run_diagnosis(parts).causes) == count


def test_what_effects_undo_is_offered_no_name(parts: Any) -> None:
    parts.found.undone = ("dead_band",)
    _run_diagnosis(parts)
    assert [one.name for one in parts.seen["names_of"][0][0]] == ["second_relaxation", "second_relaxation"]


def test_there_is_no_less_noise_than_none_and_no_more_than_the_error(parts: Any) -> None:
    parts.kinds[2].rms = 0.5  # more structure than is left
    assert _run_diagnosis(parts).explainable_percent == 100.0
    parts.seen.clear()
    parts.kinds[2].rms, parts.off = 0.0, 0.5  # more than is judged, of which 0.02 is structure
    assert _run_diagnosis(parts).explainable_percent == pytest.approx(100.0 * (1.0 - (0.01 - 0.02**2) / 0.04))


def test_what_a_model_does_not_foresee_elsewhere_is_no_noise(parts: Any) -> None:
    """What was fitted is off by 0.02, what is held out by 0.1, of which tests without a model show but 0.03."""
    parts.kinds[1].rms, parts.kinds[2].rms, parts.off = 0.03, 0.0, 0.02
    assert _run_diagnosis(parts).explainable_percent == pytest.approx(100.0 * (1.0 - 0.02**2 / 0.04))


@pytest.mark.parametrize("judged", [0.0, 0.015])
def test_no_more_can_be_explained_than_is_left_beyond_noise_where_it_is_judged(parts: Any, judged: float) -> None:
    """What is white where it is judged is noise, whatever was fitted holds, and whether it is shown to be noise."""
    parts.judged = judged
    for can_validate, unproven in ((True, 0.0), (False, 0.05)):
        parts.seen.clear()
        parts.found.can_validate, parts.unproven = can_validate, unproven
        told = _run_diagnosis(parts)
        assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.01 - judged**2) / 0.04))
        sessions, residuals, thresholds = parts.seen["left_where_judged"][0]
        assert (sessions, residuals, thresholds) == ([FINE], [f"{FINE} 2"], STANDARD)  # at full rate
    parts.seen.clear()
    parts.judged = 1.0
    told = _run_diagnosis(parts)  # nothing shows that any of it is noise
    assert told.explainable_percent == 100.0


def test_a_calibration_compensates_by_the_model_that_gives_back_the_load_of_what_was_fitted(
    parts: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _run_diagnosis(parts).force_model is None
    parts.seen.clear()
    by_plain = Compensation(
        [FINE], MODEL, PLAIN_N, PLAIN_N, ForceError(8.2, 7.0), FILTER, ("linear_leak", "delay"), is_plain=True
    )
    monkeypatch.setattr(_procedure, "compensation", lambda *_: by_plain)
    told = _run_diagnosis(parts)
    assert told.force_model == "with offset"
    assert parts.seen["_with_offset"][0][0] is MODEL  # the plain one's
    assert told.extended.force_rmse_n == 9.0
    assert any("so the calibration compensates by the baseline, and its twin" in limit for limit in told.limits)


@pytest.mark.parametrize(("apart", "has_own"), [(0.9, False), (1.1, True), (-1.1, True)])
def test_a_calibration_takes_the_zero_of_what_its_filter_undoes(
    parts: Any, monkeypatch: pytest.MonkeyPatch, apart: float, has_own: bool
) -> None:
    """Of what it does not, as a zero that goes with the room, the mean is the zero's."""
    late: Any = SimpleNamespace(not_inverted=("delay",), moved_in_an_hour={}, lags_left_s={})
    in_part = Compensation([FINE], MODEL.with_part("delay"), EXTENDED_N, PLAIN_N, EXTENDED_N, late)
    undone = in_part.undone
    assert undone.names == MODEL.names
    monkeypatch.setattr(_procedure, "compensation", lambda *_: in_part)
    zero = 0.01 + apart * STANDARD.material
    for room in (_procedure, _force):
        monkeypatch.setattr(room, "mean_offset", lambda _, model: zero if model is undone else 0.01)
    told = _run_diagnosis(parts)
    assert told.force_model == ("with offset" if has_own else None)
    assert (parts.seen["_with_offset"][0][-1] is undone) == has_own
    assert parts.seen["as_calibrated"][0][0].zero == zero


def test_what_a_calibration_gives_of_the_same_recordings_is_said(parts: Any) -> None:
    parts.as_calibrated = ["by one zero"]
    assert _run_diagnosis(parts).limits == ("limit", "by one zero")
    (force, thresholds), _ = parts.seen["as_calibrated"]
    assert (force.fine, thresholds) == ([FINE], STANDARD)
    assert force.model.names == parts.found.fit.model.names


def test_a_wall_as_no_wall_is_is_said_of_the_extended_model(parts: Any) -> None:
    parts.wall_ratio = "no such wall"
    assert _run_diagnosis(parts).limits == ("limit", "no such wall")
    (model, sessions, thresholds), _ = parts.seen["wall_ratio_of"]
    assert (model.names, model.noise) == (parts.found.fit.model.names, parts.off)  # what is left of the reading
    assert ([one.name for one in sessions], thresholds) == (["held", "fitted"], STANDARD)


def test_what_no_compensator_takes_off_is_said_of_the_extended_model(
    parts: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts.not_undone, parts.wall_ratio = ["not undone"], "no such wall"
    told = _run_diagnosis(parts)
    assert told.limits == ("limit", "not undone", "no such wall")
    assert told.limits_of_the_force == ("not undone",)  # the wall is the model's
    parts.wall_ratio = None
    (model, step_s), _ = parts.seen["not_undone_of"]
    assert model.names == parts.found.fit.model.names
    assert step_s == 0.05
    parts.seen.clear()
    by_plain = Compensation(
        [FINE], MODEL, PLAIN_N, PLAIN_N, ForceError(8.2, 7.0), FILTER, ("linear_leak", "delay"), is_plain=True
    )
    monkeypatch.setattr(_procedure, "compensation", lambda *_: by_plain)
    (_, said, why) = _run_diagnosis(parts).limits
    assert "gives a worse force: on what was fitted it is off by 8.2 N, the baseline by 8 N" in said
    assert why == "not undone"  # and so is why: what a stream cannot undo is left in its force
    (model, _), _ = parts.seen["not_undone_of"]
    assert model.names == parts.found.fit.model.names


def test_what_does_most_by_itself_is_named_though_others_undo_it(parts: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half sure at most, as where others may do what it does."""
    asked: list[Any] = []

    def names_of(members: Any, left: float, thresholds: Any, **how: Any) -> Any:
        asked.append(([one.name for one in members], how))
        return tuple(parts.names) if len(asked) > 1 else ()

    monkeypatch.setattr(_withheld, "names_of", names_of)
    parts.names = [_name("linear_leak")]
    parts.found.undone, parts.found.alone = ("second_relaxation", "dead_band"), effect("power_law_creep")
    told = _run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["linear_leak"]
    (first, _), (second, how) = asked
    assert (first, second) == ([], ["second_relaxation", "second_relaxation"])  # of the kind of what does most alone
    assert (how["is_unsteady"], how["alone"]) == (True, parts.found.alone)
