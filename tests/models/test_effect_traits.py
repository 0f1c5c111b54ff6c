"""What effects say of themselves and of one another, and effects that other packages bring."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from importlib.metadata import EntryPoint
from itertools import combinations
from pathlib import Path
from random import random
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest

from smartshoe.arrays import Array
from smartshoe.calibration import ExtendedCompensator
from smartshoe.errors import UsageError
from smartshoe.models.effects import (
    Conditions,
    CoreEffect,
    Effect,
    EffectParameter,
    Inverse,
    Memoryless,
    NoiseEffect,
    blocks,
    by,
    catalogue,
    effect,
    in_words,
    shift_of,
    told_apart_by,
)
from smartshoe.models.effects.exposure import CHANNELS, SAYS, WORDS
from smartshoe.models.effects.saturation import LOWEST
from smartshoe.models.extended import ExtendedModel

catalogue_module = import_module("smartshoe.models.effects.catalogue")  # the package has a function of this name
BASELINE = ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
EVERY = (*catalogue().values(), *(one for family in blocks().values() for one in family))
ROOT = Path(__file__).resolve().parents[2] / "smartshoe"
GUIDE = ROOT.parent / "docs" / "extending.md"


def typical(one: Effect) -> Array:
    """Strengths at their typical size."""
    return np.array([v if p.null is None else p.size for p, v in zip(one.parameters, one.start(), strict=True)])


ONE_WAY = r"\b(rises|falls|drops|creeps|grows|shrinks|gains|loses|higher|lower)\b"


@pytest.mark.parametrize("one", EVERY, ids=lambda one: one.name)
def test_an_effect_of_either_sign_says_nothing_that_holds_for_one_sign_only(one: Effect) -> None:
    for as_said in (one, one.of_any_sensor()):
        strengths = [p for p in as_said.parameters if p.null is not None]
        if any(p.lower < p.null < p.upper for p in strengths):  # type: ignore[operator]
            assert not re.search(ONE_WAY, as_said.says) or re.search(r"\bor\b", as_said.says), as_said.says


@pytest.mark.parametrize("bow", [0.01, 0.1, 0.25])
@pytest.mark.parametrize(
    ("name", "shapes", "steepest_at_rest"),
    [
        ("wall_hardening", (-0.3, 0.0, 1.0), True),  # "flattest at high loads"
        ("contact_area", (0.1, 0.6, 1.2), True),  # "steepest at low loads"
        ("gas_compression", (None,), False),  # "bent upwards, ever steeper"
    ],
)
def test_curves_bend_the_way_that_they_say(
    name: str, shapes: tuple[float | None, ...], steepest_at_rest: bool, bow: float
) -> None:
    load = np.linspace(0.0, 1.0, 201)
    for shape in shapes:
        values = np.array([bow] if shape is None else [bow, shape])
        conditions = Conditions(0.01 * np.arange(201), load, 0.01, relaxing=(1e-9, 1.0))
        slope = np.diff(effect(name).apply(load, conditions, values))
        assert np.all(np.diff(slope) < 1e-9) if steepest_at_rest else np.all(np.diff(slope) > -1e-9), shape


@pytest.mark.parametrize(("name", "strength"), [("flexible_softening", "gained"), ("flexible_set", "set")])
@pytest.mark.parametrize("by_stroke", [0.0, 0.5, 1.0])
def test_a_dose_of_loading_is_what_its_strength_says(name: str, strength: str, by_stroke: float) -> None:
    """A loading to full scale and 10 s there, of a unit that hardly slows down."""
    step_s = 0.01
    load = np.concatenate([[0.0, 0.5], np.ones(1001)])
    one, size = effect(name), 0.01
    assert "10 s there" in next(p.says for p in one.parameters if p.name == strength)
    values = one.begun()
    given = dict(zip([p.name for p in one.parameters], values, strict=True))
    given |= {strength: size, "by_stroke": by_stroke, "exponent": 1.0, "early": one.parameters[-1].upper}
    out = one.apply(load, Conditions(step_s * np.arange(load.size), load, step_s), np.array(list(given.values())))
    assert out[-1] - 1.0 == pytest.approx(size, rel=0.02)


def test_every_word_is_said_and_channels_are_among_them() -> None:
    assert set(SAYS) == WORDS
    assert CHANNELS < WORDS


@pytest.mark.parametrize("one", EVERY, ids=lambda one: one.name)
def test_traits_are_words_of_the_one_vocabulary(one: Effect) -> None:
    assert one.exposed_by | one.needs <= WORDS
    assert one.needs <= CHANNELS
    assert all(parameter.channel == "" or parameter.channel in CHANNELS for parameter in one.parameters)
    assert one.is_flexible or one.separated_by
    for name, words in one.separated_by.items():
        assert name in catalogue()
        assert words
        assert words <= WORDS


def test_neighbours_say_the_same_of_one_another() -> None:
    for one, other in combinations(catalogue().values(), 2):
        assert one.separated_by.get(other.name) == other.separated_by.get(one.name), (one.name, other.name)
        assert told_apart_by(one, other) == told_apart_by(other, one) == one.separated_by.get(other.name, frozenset())


def test_what_conditions_keep_is_made_once_for_its_numbers_and_the_oldest_is_forgotten() -> None:
    at, made = Conditions(np.arange(3.0), np.zeros(3), 1.0), []

    def asked(number: float) -> Array:
        return at.kept("one", (number,), lambda: made.append(number) or np.full(3, number))  # type: ignore[func-returns-value]

    for number in (0.0, 1.0, 0.0, 2.0, 3.0, 4.0, 5.0, 0.0, 6.0, 0.0, 1.0):
        np.testing.assert_array_equal(asked(number), np.full(3, number))
    assert made == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1.0]
    np.testing.assert_array_equal(at.kept("other", (0.0,), lambda: np.ones(1)), np.ones(1))
    later = replace(at, time_s=at.time_s + 1.0)  # other conditions keep their own
    np.testing.assert_array_equal(later.kept("one", (0.0,), lambda: np.ones(1)), np.ones(1))


@pytest.mark.parametrize("one", EVERY, ids=lambda one: one.name)
def test_a_block_gives_the_same_again_and_after_others_were_asked_for(one: Effect) -> None:
    time_s = 0.05 * np.arange(400)
    at = Conditions(time_s, 0.5 - 0.5 * np.cos(time_s), 0.05, 1e-3, np.sin(0.1 * time_s), np.sin(time_s))
    first = one.apply(at.load, at, typical(one))
    for size in (0.5, 2.0):
        one.apply(at.load, at, one.begun(sizes=size))
    for values in (1.01 * typical(one), typical(one)):
        fresh = replace(at, cache={})
        np.testing.assert_array_equal(one.apply(at.load, at, values), one.apply(at.load, fresh, values))
    np.testing.assert_array_equal(one.apply(at.load, at, typical(one)), first)


def test_noise_and_faults_of_data_are_the_effects_that_are_no_physical_cause() -> None:
    assert {one.family for one in EVERY if not one.is_physical} == {"noise", "data"}
    assert not any(one.family in ("noise", "data") for one in EVERY if one.is_physical)


def test_a_latency_moves_the_reading_in_time_and_changes_nothing_that_lasts() -> None:
    time_s = 0.02 * np.arange(4000)
    hold = np.interp(time_s, [0.0, 10.0, 11.0, 80.0], [0.0, 0.0, 1.0, 1.0])
    at = Conditions(time_s, hold, 0.02)
    for one in EVERY:
        values = np.array(
            [p.size if p.null is not None else v for p, v in zip(one.parameters, one.start(), strict=True)]
        )
        if one.is_latency:
            out = one.apply(hold, at, values)
            assert np.max(np.abs(out - hold)) > 1e-4, one.name
            assert out[[0, 3000]] == pytest.approx(hold[[0, 3000]], abs=1e-6), one.name


@pytest.mark.parametrize("one", [one for one in EVERY if not isinstance(one, CoreEffect)], ids=lambda one: one.name)
def test_what_bends_beside_the_arm_is_exactly_what_depends_on_it(one: Effect) -> None:
    time_s = 0.05 * np.arange(1200)
    load = np.interp(time_s, [0.0, 1.0, 2.0, 20.0, 22.0, 40.0, 60.0], [0.0, 0.0, 0.5, 0.5, 1.0, 0.2, 0.7])
    at = Conditions(time_s, load, 0.05, 1e-3, np.sin(0.1 * time_s), np.roll(load, 40))
    outside = one.apply(load, at, typical(one))
    beside = [one.apply(load, at.within(share, 0.5), typical(one)) for share in (0.1, 0.4)]
    moved = [float(np.max(np.abs(out - outside))) for out in beside]
    if one.bends_beside_arm:
        assert 1e-5 < moved[0] < moved[1]
    else:
        assert moved == [0.0, 0.0]


class Told(Effect):
    """An effect that keeps what it is told of the arm."""

    name, family, stage, place = "told", "static_curve", "wall", "wall"
    says = "nothing"
    parameters = ()

    def __init__(self, bends_beside_arm: bool) -> None:
        self.bends_beside_arm = bends_beside_arm  # type: ignore[misc]
        self.told: list[tuple[float, float] | None] = []

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        self.told.append(conditions.relaxing)
        return signal.copy()


def test_a_model_tells_its_arm_to_what_bends_beside_it_and_to_nothing_else() -> None:
    at = Conditions(0.05 * np.arange(40), np.linspace(0.0, 1.0, 40), 0.05)
    for bends in (True, False):
        one = Told(bends)
        model = BASELINE.with_part(one)
        model.sensitivities(at)
        share, rate = (model.theta[k] * 1.001 for k in (1, 2))
        arms = [(0.15, 0.3), (pytest.approx(share), 0.3), (0.15, pytest.approx(rate))]
        # What the arm does not move is not run anew for it.
        assert one.told == (arms if bends else [None])


def test_what_is_seen_at_rest_moves_the_reading_without_load() -> None:
    time_s = 0.02 * np.arange(4000)
    load = np.interp(time_s, [0.0, 10.0, 20.0, 30.0, 80.0], [0.0, 0.0, 1.0, 0.0, 0.0])
    at = Conditions(time_s, load, 0.02, neighbour=np.ones_like(load))
    for one in EVERY:
        if one.is_seen_at_rest:
            values = np.array(
                [v if p.null is None else p.size for p, v in zip(one.parameters, one.start(), strict=True)]
            )
            out = one.apply(load, at, values)
            assert abs(out[-1] - load[-1]) > 1e-5, one.name


def test_one_latency_is_the_lag_between_two_clocks_and_one_their_rate() -> None:
    of_clocks = [one for one in EVERY if one.between_clocks]
    assert {one.between_clocks for one in of_clocks} == {"lag", "rate"}
    assert len(of_clocks) == 2
    for one in of_clocks:
        assert one.is_latency
        assert len(one.parameters) == 1
        at_once, later = one.late_s(np.array([0.5]), 0.0), one.late_s(np.array([0.5]), 10.0)
        assert (at_once, later) == ((0.5, 0.5) if one.between_clocks == "lag" else (0.0, 5.0))


@pytest.mark.parametrize(
    ("name", "values", "at"),
    [
        ("saturation", (0.99, 0.4, 0.02, 0.0), []),  # a sensor that ends at two fifths of what it is to read
        ("saturation", (0.5, 0.4, 0.02, 0.0), ["level"]),
        ("saturation", (0.3, 0.6, 0.02, 0.0), []),
        ("saturation", (0.99, 0.55, 0.02, 0.0), ["level"]),  # where the search ends
        ("saturation", (0.99, 0.8, 0.08, 0.0), ["knee"]),
        ("dead_band", (0.6, 0.2, 0.0), []),  # a gap of three fifths
        ("dead_band", (0.6, 0.5, 0.0), ["lost_load"]),  # of the first newtons 12 % pass
        ("dead_band", (0.2, 2.0, 0.0), []),
        ("dead_band", (0.8, 0.2, 0.0), ["lost_load"]),
    ],
)
def test_what_clips_or_is_dead_is_no_curve_like_any_other_however_much_it_takes(
    name: str, values: tuple[float, ...], at: list[str]
) -> None:
    one = effect(name)
    if name == "saturation" and values[1] < LOWEST:
        one = one.widened_at(np.array([values[0], LOWEST, *values[2:]]))
    ends = one.kind_ends_at(np.array(values))
    assert [one.name for one, _ in ends] == at
    assert all(value in values for _, value in ends)


def test_a_shift_adds_its_one_value() -> None:
    at = Conditions(0.02 * np.arange(3), np.array([0.0, 0.5, 1.0]), 0.02)
    shifts = {one.name: one for one in EVERY if one.shifts}
    assert {name: one.shifts for name, one in shifts.items()} == {"zero_offset": "reading", "load_cell_tare": "load"}
    for one in shifts.values():
        np.testing.assert_allclose(one.apply(at.load, at, np.array([0.125])), at.load + 0.125, rtol=0, atol=0)


def _decisions(path: Path) -> Iterator[ast.expr]:
    """What an expression of a file compares, matches, or asks a catalogue, a model or an effect's module for."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Compare():
                yield from (node.left, *node.comparators)
            case ast.MatchValue():
                yield node.value
            case ast.Call(func=ast.Name(id="effect") | ast.Attribute(attr="with_part" | "without" | "part")):
                yield from node.args[:1]


def test_no_other_room_decides_by_an_effects_name() -> None:
    """A fault of the data, or a parameter of a fit, may be called the same."""
    names = {one.name for one in EVERY}
    known = [
        f"{path.relative_to(ROOT)}:{one.lineno}: {one.value}"
        for path in sorted(ROOT.rglob("*.py"))
        if path.parent != ROOT / "models" / "effects"
        for decided in _decisions(path)
        for one in ast.walk(decided)
        if isinstance(one, ast.Constant) and one.value in names
    ]
    assert not known


class Crease(Effect):
    """An effect as another package writes it: a gain of the sensor below zero."""

    name, family, stage, place = "crease", "static_curve", "sensor", "sensor"
    says = "readings below zero have another gain"
    parameters = (EffectParameter("gained", "1", "gain below zero over that above, less one", 0.0, -0.5, 0.5, 0.1),)
    exposed_by = by("low_loads")
    separated_by: ClassVar = {"saturation": by("low_loads")}

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        return np.where(signal < 0.0, signal * (1.0 + values[0]), signal)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        gain = 1.0 + float(values[0])
        return Memoryless(
            lambda signal, time_s: np.where(signal < 0.0, signal / gain, signal), f"if (x < 0.0) x /= {gain!r};"
        )


@pytest.mark.parametrize("offer", [Crease, Crease()], ids=["class", "instance"])
def test_an_effect_of_another_package_is_as_good_as_any(installed: ModuleType, offer: object) -> None:
    installed.Crease = offer  # type: ignore[attr-defined]
    one = catalogue()["crease"]
    assert list(catalogue()) == sorted(catalogue())
    assert told_apart_by(one, effect("saturation")) == told_apart_by(effect("saturation"), one) == {"low_loads"}
    model = ExtendedModel.from_dict(BASELINE.with_part(one, np.array([0.3])).to_dict())
    load = np.array([0.0, 0.5, 1.0, 0.2, -0.3, -0.3, 0.0])
    at = Conditions(0.02 * np.arange(7), load, 0.02)
    assert np.any(model.reading(at) != BASELINE.reading(at))
    np.testing.assert_allclose(
        ExtendedCompensator(model, 50.0).apply(model.reading(at)) / 800.0, load, rtol=0, atol=1e-12
    )


def _wrong(**traits: object) -> Effect:
    return type("Wrong", (Crease,), traits)()


def _noise(**traits: object) -> Effect:
    return type("Noisy", (NoiseEffect,), {**vars(effect("hum").__class__), "name": "rumble", **traits})()


def _number(**numbers: Any) -> Effect:
    return _wrong(parameters=(replace(Crease.parameters[0], **numbers),))


def _with_a_bug(self: Effect, *_: object) -> Any:
    raise KeyError("gauge")


def _on_long_signals(made: object) -> Any:
    """A method that fails, or gives ``made``, for as many samples as a recording has."""

    def apply(self: Effect, signal: Array, conditions: Conditions, values: Array) -> Any:
        if signal.size < 1000:
            return Crease.apply(Crease(), signal, conditions, values)
        return _with_a_bug(self) if made is None else made

    return apply


def _in_place(self: Effect, signal: Array, conditions: Conditions, values: Array) -> Array:
    signal *= 1.0 + values[0]
    return signal


def _undone_by(undo: Any) -> Effect:
    return _wrong(inverse=lambda self, values, step_s: Memoryless(undo, "x = x;"))


def _with_a_memory(self: Effect, values: Array, step_s: float) -> Any:
    loop = effect("play_hysteresis")
    return loop.inverse(loop.begun(), step_s)


def _needing_a_thermometer(self: Effect, signal: Array, conditions: Conditions, values: Array) -> Array:
    return signal + values[0] * conditions.temperature_k  # type: ignore[operator]


def _ends_the_program() -> Effect:
    raise SystemExit(3)


KNEE = EffectParameter("knee", "FS_load", "where it bends", None, 0.0, 1.0, 0.1)
STRENGTH = Crease.parameters[0]


@pytest.mark.parametrize(
    ("offer", "said"),
    [
        (_wrong(apply=_with_a_bug), r"'Wrong' fails \(KeyError: 'gauge'\): mend or uninstall the package"),
        (_wrong(apply=lambda self, signal, conditions, values: signal[:5]), r"of shape \(5,\) for a signal"),
        (_wrong(apply=lambda self, signal, conditions, values: 3.0), r"of shape \(\) for a signal"),
        (_wrong(apply=lambda self, signal, conditions, values: signal.tolist()), "apply gives list, no array of"),
        (_wrong(apply=lambda self, signal, conditions, values: signal + 0j), "apply gives complex128, no array of"),
        (_wrong(apply=lambda self, signal, conditions, values: signal.astype("f4")), "apply gives float32, no array"),
        (_wrong(apply=lambda self, signal, conditions, values: signal / 0.0), "apply gives values that are no finite"),
        (_wrong(apply=_on_long_signals(None)), "fails .KeyError: 'gauge'"),
        (_wrong(apply=_on_long_signals(np.zeros(7))), r"of shape \(7,\) for a signal"),
        (_wrong(apply=lambda self, signal, conditions, values: 0.9 * signal), "is not the identity, but 0.097 of full"),
        (_wrong(apply=lambda self, signal, conditions, values: signal + values[0] * random()), "other numbers"),
        (_wrong(apply=_needing_a_thermometer), "fails .TypeError"),
        (_wrong(apply=_in_place), "read-only"),
        (_wrong(inverse=_with_a_bug), "fails .*gauge"),
        (_wrong(inverse=lambda self, values, step_s: 5), "gives 5, which is neither an Inverse nor None"),
        (_wrong(is_drift=True, inverse=_with_a_memory), "is_drift needs a Memoryless inverse, which can be held"),
        (_undone_by(lambda signal, time_s: 1 / 0), "fails .ZeroDivisionError"),
        (_undone_by(lambda signal, time_s: signal[:-1]), r"inverse's push gives values of shape \(31,\)"),
        (_undone_by(lambda signal, time_s: signal.astype("f4")), "inverse's push gives float32"),
        (_undone_by(lambda signal, time_s: signal * np.inf), "inverse's push gives values that are no finite"),
        (_undone_by(lambda signal, time_s: signal - signal[0]), "inverse gives other numbers where the stream is cut"),
        (_noise(evidence=_with_a_bug), "gauge"),
        (_noise(evidence=lambda *_: "much"), "evidence gives 'much', which is neither"),
        (_wrong(parameters=()), "has no parameter with a null value"),
        (_wrong(parameters=[STRENGTH]), "no tuple of EffectParameter"),
        (_wrong(parameters=(STRENGTH, STRENGTH)), "has two parameters of the name 'gained'"),
        (_wrong(parameters=(KNEE,), shapes=({"knee": 0.5},)), "has no parameter with a null value"),
        (_wrong(parameters=(STRENGTH, KNEE)), "has a shape in which parameter knee has no value"),
        (_wrong(parameters=(STRENGTH, KNEE), shapes=({"knee": 2.0},)), "knee = 2.0, which is not within its bounds"),
        (_wrong(parameters=(STRENGTH, KNEE), shapes=({"knee": 0.5},), apply=_with_a_bug), "fails at knee = 0.5"),
        (_wrong(shapes=({"width": 0.5},)), "has a shape of 'width', which is no parameter"),
        (_wrong(shapes=()), "would never be tried"),
        (_number(name="per cent"), "'per cent' whose name is no word"),
        (_number(unit=None), "whose unit or says is no text"),
        (_number(lower=0.5, upper=-0.5), "lower bound 0.5 is not below its upper one, -0.5"),
        (_number(upper=np.inf), "not all finite numbers"),
        (_number(size=0.0), "of size 0, which must be above 0"),
        (_number(null=0.9), "null value 0.9 is not within its bounds"),
        (_number(channel="moon"), "of the channel 'moon', which is none of"),
        (_wrong(name="linear_leak"), "'Wrong' has the name 'linear_leak', which is taken"),
        (_wrong(name="flexible_loop"), "taken"),
        (_wrong(name="a crease"), "has the name 'a crease', which is no word"),
        (_wrong(family=7), "has the family 7, which is no text"),
        (_wrong(branch=None), "has branch = None, which is no str"),
        (_wrong(is_memoryless="yes"), "has is_memoryless = 'yes', which is no bool"),
        (_wrong(shifts="reading"), "has shifts = 'reading', which effects of smartshoe alone may say"),
        (_wrong(place="roof"), "has the place 'roof', which is none of machine"),
        (_wrong(place="core"), "but CoreEffects, and no others"),
        (_wrong(exposed_by=frozenset({"earthquakes"})), "is shown by earthquakes"),
        (_wrong(exposed_by="rates"), "has exposed_by = 'rates', which is no set of words"),
        (_wrong(needs=by("holds")), "is shown by holds, which is not known: needs may hold command"),
        (_wrong(separated_by=("delay",)), "has separated_by = .*, which is no mapping"),
        (_wrong(separated_by={"delay": "steps"}), r"has separated_by\['delay'\] = 'steps', which is no set of words"),
        (type("Unnamed", (Effect,), {"apply": Crease.apply}), "has no name, no family"),
        (3.0, "no smartshoe.models.effects.Effect"),
        (Effect, "cannot be loaded"),
        (type("Ends", (Crease,), {"__init__": lambda self: _ends_the_program()}), r"loaded \(SystemExit: 3\)"),
    ],
)
def test_what_cannot_take_part_is_refused_by_name(installed: ModuleType, offer: object, said: str) -> None:
    installed.Wrong = offer  # type: ignore[attr-defined]
    with pytest.raises(UsageError, match=said):
        catalogue()


@pytest.mark.parametrize("one", EVERY, ids=lambda one: one.name)
def test_ours_would_be_taken_from_another_package_too(one: Effect) -> None:
    if one.shifts or one.between_clocks:
        one = type("Without", (type(one),), {"shifts": None, "between_clocks": None})()
    catalogue_module.refuse_faulty(one, "ours")


def test_a_program_that_is_stopped_while_a_package_is_loaded_stops(installed: ModuleType) -> None:
    def stopped(self: Effect) -> None:
        raise KeyboardInterrupt

    installed.Slow = type("Slow", (Crease,), {"__init__": stopped})  # type: ignore[attr-defined]
    with pytest.raises(KeyboardInterrupt):
        catalogue()


def test_a_broken_package_keeps_no_other_effect_away(installed: ModuleType) -> None:
    installed.Crease, installed.Wrong = Crease, _wrong(name="wrong", apply=_with_a_bug)  # type: ignore[attr-defined]
    assert effect("linear_leak").name == "linear_leak"
    assert effect("crease").name == "crease"
    assert in_words("flexible_loop") == "loop of free form"
    assert shift_of("load").name == "load_cell_tare"
    with pytest.raises(UsageError, match="'Wrong' fails"):
        effect("wrong")


def _once_too_long(signal: Array, values: Array) -> Array:
    return signal[:4000] + 0.0 * values[0]


def test_what_gives_too_few_values_only_later_is_told_by_name(installed: ModuleType) -> None:
    installed.Short = short = _wrong(  # type: ignore[attr-defined]
        name="short",
        apply=lambda self, signal, conditions, values: _once_too_long(signal, values),
        inverse=lambda self, values, step_s: Memoryless(
            lambda signal, time_s: _once_too_long(signal, values), "x = x;"
        ),
    )
    model = BASELINE.with_part(effect("short"), np.array([0.1]))
    assert model.names == (short.name,)
    said = r"effect 'short' gives values of shape \(4000,\) for a signal of shape \(5000,\)"
    with pytest.raises(UsageError, match=said):
        model.reading(Conditions(0.02 * np.arange(5000), np.zeros(5000), 0.02))
    with pytest.raises(UsageError, match=said):
        ExtendedCompensator(model, 50.0).apply(np.zeros(5000))


def test_two_packages_cannot_bring_one_name(installed: ModuleType) -> None:
    installed.First, installed.Second = Crease, _wrong(name="crease")  # type: ignore[attr-defined]
    with pytest.raises(UsageError, match="'Second' has the name 'crease', which is taken"):
        catalogue()


def test_an_entry_point_to_nowhere_is_refused(installed: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = EntryPoint("gone", "no_such_package:Thing", "smartshoe.effects")
    monkeypatch.setattr(catalogue_module, "entry_points", lambda group: (gone,))
    with pytest.raises(UsageError, match="'gone' cannot be loaded"):
        catalogue()


def test_every_curve_says_that_it_is_one() -> None:
    """Else it is not weighed against the others; the guide's own effect, which others begin from, is among them."""
    found: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)[0], found)
    catalogue_module.refuse_faulty(found["CreasedTube"](), "the guide's")
    curves = {one.family for one in catalogue().values() if one.is_memoryless}
    shuffled = np.random.default_rng(1).permutation(200)
    for one in (*catalogue().values(), found["CreasedTube"]()):
        if one.family not in curves or not one.is_physical:
            continue
        load, values = np.linspace(0.0, 1.0, 200), one.begun()
        reading, other = (
            one.apply(of, Conditions(0.01 * np.arange(200), of, 0.01), values) for of in (load, load[shuffled])
        )
        assert one.is_memoryless == np.allclose(reading[shuffled], other, rtol=0.0, atol=1e-9), one.name


def test_a_drift_is_held_whatever_it_bends_beside() -> None:
    """A spring beside the arm, of another package, that gives way with the time."""

    def aged(self: Effect, signal: Array, conditions: Conditions, values: Array) -> Array:
        return np.asarray(signal * (1.0 + values[0] * conditions.time_s))

    ageing = _wrong(name="ageing", apply=aged, is_drift=True, bends_beside_arm=True)
    model = ExtendedModel(1.0, 0.1, 0.2, 800.0, 140.0, "mbar").with_part(ageing, [0.01]).held_after(4.0, ())
    conditions = Conditions(np.arange(50.0), np.full(50, 0.5), 1.0)
    apart = [
        model.simulate(replace(conditions, time_s=time_s))
        for time_s in (conditions.time_s, np.minimum(conditions.time_s, 4.0))
    ]
    np.testing.assert_array_equal(*apart)
