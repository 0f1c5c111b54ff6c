"""Which effects and zeros become causes of a diagnosis, by what its parts answer of them."""

from __future__ import annotations

from typing import Any

import pytest
from test_procedure_by_hand import STANDARD
from told_diagnosis import name_of, run_diagnosis

from smartshoe.diagnosis import _withheld
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange
from smartshoe.diagnosis._withheld import AN_INTEGRAL, JUMPS, UNDONE
from smartshoe.diagnosis._zero import Zero
from smartshoe.models.effects import effect, shift_of


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
    parts.names = [name_of("turned")] if "turned" in why else []
    told = run_diagnosis(parts)
    assert (told.verdict, told.causes) == ("unexplained", ())
    assert (len(told.limits) > 1) is is_withheld or parts.given.is_no_unit  # of which more is said beforehand
    assert parts.seen["sentence_of"][1]["withheld"] is is_withheld


@pytest.mark.parametrize(("jumps", "is_integral"), [(False, False), (True, False), (False, True), (True, True)])
def test_names_know_what_makes_them_unsure(jumps: bool, is_integral: bool, parts: Any) -> None:
    for is_clocked in (True, False):
        parts.seen.clear()
        parts.given.excitation.goes_with_the_clock = is_clocked
        parts.given.is_integral = is_integral
        parts.found.zero_changes = (ZeroChange("a", 1.0, 0.02),) if jumps else ()
        run_diagnosis(parts)
        assert parts.seen["names_of"][1] == {
            "is_clocked": is_clocked,
            "doubt": JUMPS if jumps else AN_INTEGRAL if is_integral else "",
            "best_single": None,
            "together": [],
        }


def test_what_is_late_beside_readings_that_were_moved_is_said_and_no_cause(parts: Any) -> None:
    parts.names = [name_of("linear_leak"), name_of("delay")]
    parts.given.is_moved = True
    told = run_diagnosis(parts)
    assert ([one.name for one in told.causes], told.minor) == (["linear_leak"], ("delay",))
    (_, said) = told.limits
    assert said.startswith("delay fits, but is not named: each reading was shifted to the load's clock before")


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
            sized = {name: name_of(name, size=parts.sizes[name]) for name in ("play_hysteresis", "delay")}
            asymmetry = name_of("load_unload_asymmetry", size=parts.sizes["load_unload_asymmetry"], kind=sure)
            parts.names = [*sized.values(), asymmetry]
            parts.seen.clear()
            told = run_diagnosis(parts)
            assert {one.name for one in told.causes} == {*named, "delay"} | (set() if is_departure else {other})
            one, surest = (name.replace("_", " ") for name in (other, *named))
            said = (
                f"{one} fits, but is not named: it may be no more than the error of the equation of {surest} (both are"
                " friction)"
            )
            assert (said in told.limits) is is_departure


def test_so_many_load_cycles_show_so_many_causes(parts: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The surest of them; and one that is none for a reason of its own counts for nothing."""
    for cycles, sure, named in ((1, 0.8, ["linear_leak"]), (2, 0.8, ["delay", "linear_leak"]), (1, 0.95, ["delay"])):
        parts.names = [name_of("turned"), name_of("linear_leak"), name_of("delay", kind=sure)]
        parts.seen.clear()
        monkeypatch.setattr(_withheld, "load_cycles", lambda sessions, thresholds, cycles=cycles: cycles)
        told = run_diagnosis(parts)
        assert [one.name for one in told.causes] == named
        other = "linear leak" if sure > 0.9 else "delay"
        said = (
            f"{other} fits, but is not named: 1 load cycle cannot show more than 1 cause, and others are surer (repeat"
            " the cycles)"
        )
        assert (said in told.limits) is (cycles == 1)


def test_a_block_whose_kind_is_a_cause_is_not_listed_beside_it(parts: Any) -> None:
    parts.sizes["orifice_leak"] = 0.1
    parts.names = [name_of("orifice_leak", kind_only=True)]
    parts.names[0].member.name = "linear_leak"
    told = run_diagnosis(parts)
    assert ([one.name for one in told.causes], told.minor) == (["orifice_leak"], ("delay",))


def test_of_what_is_no_unit_or_one_cycle_no_zero_is_told(parts: Any) -> None:
    parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, 0.2)]
    parts.given.is_no_unit = True
    told = run_diagnosis(parts)
    assert (told.causes, told.verdict) == ((), "unexplained")
    assert parts.seen["infer_with_gas_check"][0][4] is False
    parts.seen.clear()
    parts.given.is_no_unit, parts.found.can_validate = False, False
    assert run_diagnosis(parts).causes == ()
    parts.seen.clear()
    parts.found.can_validate = True
    assert [one.name for one in run_diagnosis(parts).causes] == ["zero"]


def test_a_tares_own_creep_is_said_and_no_cause(parts: Any) -> None:
    parts.sizes["warm_up"] = 0.02
    parts.names = [name_of("warm_up", size=0.02), name_of("delay", size=0.3)]
    for tare, causes, said in ((0.2, ["delay", "zero"], 1), (0.199, ["delay", "zero", "warm_up"], 0)):
        parts.seen.clear()
        parts.zeros = [Zero(shift_of("load"), tare, 0.01, tare)]
        told = run_diagnosis(parts)
        assert [one.name for one in told.causes] == causes
        assert sum("warm up moves the reading by 2 %" in limit for limit in told.limits) == said


def test_what_is_material_at_the_least_is_a_zero(parts: Any) -> None:
    for size, count in ((STANDARD.material, 1), (0.999 * STANDARD.material, 0)):
        parts.seen.clear()
        parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, size)]
        assert len(run_diagnosis(parts).causes) == count


def test_what_effects_undo_is_offered_no_name(parts: Any) -> None:
    parts.found.cancelling_names = ("dead_band",)
    run_diagnosis(parts)
    assert [one.name for one in parts.seen["names_of"][0][0]] == ["second_relaxation", "second_relaxation"]


def test_what_does_most_by_itself_is_named_though_others_undo_it(parts: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half sure at most, as where others may do what it does."""
    asked: list[Any] = []

    def names_of(members: Any, left: float, thresholds: Any, **how: Any) -> Any:
        asked.append(([one.name for one in members], how))
        return tuple(parts.names) if len(asked) > 1 else ()

    monkeypatch.setattr(_withheld, "names_of", names_of)
    parts.names = [name_of("linear_leak")]
    parts.found.cancelling_names, parts.found.best_single = (
        ("second_relaxation", "dead_band"),
        effect("power_law_creep"),
    )
    told = run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["linear_leak"]
    (first, _), (second, how) = asked
    assert (first, second) == ([], ["second_relaxation", "second_relaxation"])  # of the kind of what does most alone
    assert (how["doubt"], how["best_single"]) == (UNDONE, parts.found.best_single)
