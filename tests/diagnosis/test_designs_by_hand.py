"""What a protocol can tell, and what to run next, by columns and fits whose answer is known; names at their bounds."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds, _next_experiment
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange
from smartshoe.diagnosis._members import Alternative
from smartshoe.diagnosis._naming import names_of, probability_of_kind, probability_of_law
from smartshoe.diagnosis._next_experiment import _in_place_of, expected_margin, next_experiment
from smartshoe.diagnosis.design import Design, _commanded, _compared, _not_followed, design
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol, Segment

design_module = import_module("smartshoe.diagnosis.design")  # the package has a function of this name
Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")


# -- designs ----------------------------------------------------------------------------------------------------------
def _columns(matrix: Array, candidates: list[tuple[str, tuple[int, ...], bool]], own: int = 2) -> Any:
    """A linearisation of one session with a target and such columns."""
    wide = np.column_stack([np.zeros(matrix.shape[0]), matrix])
    made = [
        SimpleNamespace(name=name, columns=columns, effect=SimpleNamespace(is_flexible=flexible))
        for name, columns, flexible in candidates
    ]
    session = SimpleNamespace(fitted=np.ones(matrix.shape[0], dtype=bool))
    return SimpleNamespace(gram=wide.T @ wide, own=own, candidates=made, sessions=[session])


def _left(target: Array, beside: Array) -> Array:
    return np.asarray(target - beside @ np.linalg.lstsq(beside, target, rcond=None)[0])


def test_what_shows_and_what_is_alike_is_of_what_the_baseline_does_not_follow() -> None:
    """Two shapes of one effect, two columns of another, one that the baseline follows whole, and a flexible one."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((60, 7))
    x[:, 5] = x[:, 0] - 2.0 * x[:, 1]  # followed
    x[:, 3] *= 4.0  # the shape that shows best
    x[:, 4] += 2.0 * x[:, 3]
    told = [("one", (3,), False), ("one", (4,), False), ("two", (5, 7), False), ("whole", (6,), False),
            ("soft", (7,), True)]  # fmt: skip
    found = _compared(_columns(x, told), 0.01, 0.003, STANDARD)
    assert found.names == ("one", "two", "whole")
    own = x[:, :2]
    left = {k: _left(x[:, k], own) for k in range(7)}
    shown = 2.0 * math.log(3 / STANDARD.false_name)
    best = max((2, 3), key=lambda k: float(left[k] @ left[k]))
    for i, k in ((0, best), (1, 4)):
        power = float(left[k] @ left[k]) / 0.01**2
        material = STANDARD.material / (0.01 * math.sqrt(power / 60))
        assert found.least[i] == pytest.approx(max(math.sqrt(shown / power), material))
    assert math.isinf(found.least[2])
    followed = _left(left[best], np.column_stack([left[4], left[6]]))
    assert found.unlike[0, 1] == pytest.approx(float(followed @ followed) / float(left[best] @ left[best]))
    shares = []
    for k in (2, 3):
        rest = _left(left[4], left[k][:, None])
        shares.append(float(rest @ rest) / float(left[4] @ left[4]))
    assert found.unlike[1, 0] == pytest.approx(min(shares))
    assert list(found.unlike[2]) == [0.0, 0.0, 0.0]
    assert list(np.diag(found.unlike)) == [0.0, 0.0, 0.0]
    assert found.unlike[0, 2] == pytest.approx(1.0)  # what the baseline follows follows nothing beyond it
    assert (found.strength, found.evidence) == (0.003, pytest.approx(60 * 0.3**2))
    coarse = _compared(_columns(x, told), 0.01, 0.003, replace(STANDARD, material=0.5))
    one = math.sqrt(float(left[best] @ left[best]) / 60)
    assert coarse.least[0] == pytest.approx(0.5 / one)


def test_what_columns_leave_of_a_square_is_a_share() -> None:
    left = np.array([[4.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    assert _not_followed(left, 0, [1], 4.0) == pytest.approx(0.5)
    assert _not_followed(left, 0, [2], 4.0) == pytest.approx(1.0)
    assert _not_followed(left, 0, [0, 2], 4.0) == pytest.approx(0.0, abs=1e-12)
    assert _not_followed(left, 0, [1], 1.0) == 0.0


def _design(evidence: float = 100.0) -> Design:
    unlike = np.array([[0.0, 0.5, 0.01, 0.01], [0.2, 0.0, 0.3, 0.4], [0.1, 0.1, 0.0, 0.1], [1.0, 1.0, 1.0, 0.0]])
    return Design(("a", "b", "c", "d"), np.array([1.0, 2.0, math.inf, 0.5]), unlike, 0.003, evidence, STANDARD)


def test_what_cannot_be_told_is_within_departures_and_one_look_at_noise() -> None:
    """exp(-u E / (2 (1 + 0.0625 E))) above 0.3, for the share u of the evidence E."""
    for evidence in (0.5, 5.0, 100.0, 1e6):
        bound = -math.log(0.3) * 2.0 * (1.0 + 0.0625 * evidence) / evidence
        for by, told in ((0.999, ("b",)), (1.001, ())):
            two = replace(_design(evidence), names=("a", "b"), unlike=np.array([[0.0, by * bound], [9e9, 0.0]]))
            assert two.cannot_be_told("a") == told
            assert two.cannot_be_told("b") == ()
    assert _design().cannot_be_told("a") == ("c", "d")  # the most alike first, in their order where they are so
    assert _design().cannot_be_told("b") == ("a", "c", "d")[: len(_design().cannot_be_told("b"))]
    told = _design().to_dict()
    assert told["schema"] == "smartshoe.design/1"
    assert told["strength_percent_of_full_scale"] == pytest.approx(0.3)
    assert [one["least_percent_of_full_scale"] for one in told["effects"]] == [100.0, 200.0, None, 50.0]
    assert told["effects"][0]["cannot_be_told_from"] == ["c", "d"]
    assert [one["effects"] for one in told["pairs"]][:4] == [["a", "b"], ["a", "c"], ["a", "d"], ["b", "a"]]
    assert told["pairs"][3]["unlike"] == 0.2


def test_a_design_is_of_commanded_loads_at_the_logs_rate_and_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    protocols = [
        Protocol("low", (Segment("ramp", 300.0, 3.0), Segment("ramp", 0.0, 3.0))),
        Protocol("high", (Segment("ramp", 600.0, 3.0), Segment("hold", 600.0, 30.0))),
    ]
    seen: dict[str, Any] = {}

    def columns(unit: Any, sessions: Any, limits: Any) -> str:
        seen["given"] = unit, sessions, limits
        return "columns"

    def compared(columns: Any, sd: float, strength: float, limits: Any) -> str:
        seen["compared"] = columns, sd, strength, limits
        return "found"

    monkeypatch.setattr(design_module, "linearised", columns)
    monkeypatch.setattr(design_module, "_compared", compared)
    answer: Any = design(protocols, noise_percent=0.2, strength_percent=0.5, sample_rate_hz=200.0, unit=MODEL)
    assert answer == "found"
    unit, sessions, limits = seen["given"]
    assert (unit, limits) == (MODEL, STANDARD)
    assert [one.fitted.all() for one in sessions] == [True, True]
    factor = sessions[0].thinned
    assert factor > 1
    assert sessions[0].conditions.step_s == pytest.approx(factor / 200.0)
    assert [float(one.conditions.load.max()) for one in sessions] == pytest.approx([0.5, 1.0], abs=0.02)
    assert sessions[1].reading[-1] == pytest.approx(1.1 * 1.0, rel=0.05)
    assert seen["compared"][1:3] == pytest.approx((0.002 / math.sqrt(factor), 0.005))


def test_a_commanded_reading_is_the_units_at_each_sample() -> None:
    protocol = Protocol("ramp", (Segment("ramp", 400.0, 2.0), Segment("hold", 400.0, 1.0)))
    run = _commanded(protocol, MODEL, 800.0, 50.0)
    assert run.time_s == pytest.approx(0.02 * np.arange(150))
    load_n = np.minimum(200.0 * run.time_s, 400.0)
    assert run.force_n == pytest.approx(load_n)
    share = MODEL.simulate(Conditions(run.time_s, load_n / 800.0, 0.02))
    assert run.sensor.values == pytest.approx(140.0 * share)
    assert (run.name, run.sensor.unit.symbol) == ("ramp", "mbar")


# -- expected margins -------------------------------------------------------------------------------------------------
class _Linear:
    """A model that is linear in two numbers, the second without any part in the reading."""

    full_scale_load_n = 400.0

    def __init__(self, gain: float) -> None:
        self.gain = gain

    def simulate(self, at: Conditions) -> Array:
        return np.asarray(self.gain * at.load + 0.1 * at.load**2 * (self.gain > 1.0))

    def sensitivities(self, at: Conditions) -> tuple[Array, Array]:
        return self.simulate(at), np.column_stack([at.load, 0.0 * at.load])


@pytest.mark.parametrize(("variance", "other"), [(1e-6, 0.0), (1e-2, 0.0), (0.0, 0.0), (1e-2, 1e-20)])
def test_a_margin_is_what_a_rival_cannot_make_up_within_what_it_was_fitted_to(variance: float, other: float) -> None:
    """A parameter that moves nothing, and of which nothing is known beside the others, has no part in it."""
    truth: Any = SimpleNamespace(model=_Linear(1.2))
    rival: Any = SimpleNamespace(model=_Linear(0.9), covariance=np.diag([variance, other]))
    protocol = Protocol("ramp", (Segment("ramp", 400.0, 2.0), Segment("ramp", 0.0, 1.0)))
    like: Any = SimpleNamespace(conditions=SimpleNamespace(step_s=0.1, load_noise=0.0))
    load = protocol.load_at(0.1 * np.arange(30)) / 400.0
    off = (0.3 * load + 0.1 * load**2) / 0.05
    column = load / 0.05
    if variance:
        moved = float(column @ off) / (float(column @ column) + 1.0 / variance)
        expected = float(np.sum((off - moved * column) ** 2)) + moved**2 / variance
    else:
        expected = float(off @ off)
    assert expected_margin(truth, rival, protocol, 0.05, like) == pytest.approx(expected, rel=1e-6)


def test_a_rival_begins_at_the_likeliest_of_its_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_next_experiment, "fit", lambda likelihood, model: (likelihood, model))
    sessions = [SimpleNamespace(conditions=SimpleNamespace(temperature_k=None, neighbour=None))]

    def cost(model: Any) -> float:
        return float(np.abs(np.log(model.parts[0].values[1] / 0.15)))

    likelihood: Any = SimpleNamespace(sessions=sessions, cost=cost)
    found: Any = SimpleNamespace(
        fit=SimpleNamespace(model=MODEL.with_part("delay", np.array([0.1])), likelihood=likelihood)
    )
    given, model = _in_place_of(found, "delay", "second_relaxation")  # type: ignore[misc]
    assert given is likelihood
    assert model.names == ("second_relaxation",)  # type: ignore[attr-defined]
    law = effect("second_relaxation")
    begun = [model.with_part(law, law.begun(shape)) for shape in law.shapes_with(set())]  # type: ignore[attr-defined]
    assert cost(model) == min(cost(one) for one in begun)


# -- what to run next -------------------------------------------------------------------------------------------------
def _cause(
    name: str,
    size: float,
    equivalents: tuple[str, ...],
    rivals: tuple[tuple[str, float], ...] = (),
    part: str | None = "itself",
    confidence: float = 0.9,
) -> Any:
    told = tuple(SimpleNamespace(effect=one, margin=by) for one, by in rivals)
    part = name if part == "itself" else part
    return SimpleNamespace(name=name, size=size, equivalents=equivalents, rivals=told, part=part, confidence=confidence)


def _next(
    monkeypatch: pytest.MonkeyPatch,
    causes: list[Any],
    margins: dict[str, float],
    open_: bool = False,
    can_validate: bool = True,
    own_gains: tuple[OwnGain, ...] = (),
    zero_changes: tuple[ZeroChange, ...] = (),
) -> Any:
    def margin(truth: Any, rival: Any, protocol: Any, noise_sd: float, like: Any) -> float:
        assert (truth.model.names, rival, noise_sd, like.name) == (("linear_leak", "dead_band"), "other", 0.01, "fine")
        return margins.get(protocol.name, 0.0)

    monkeypatch.setattr(_next_experiment, "_in_place_of", lambda found, name, rival: "other")
    monkeypatch.setattr(_next_experiment, "expected_margin", margin)
    monkeypatch.setattr(_next_experiment, "_channel", lambda name, rival, sessions: "temperature" if margins else None)
    lasting = {"long_hold": 600.0, "steps": 50.0}
    made = {name: (lambda peak_n, name=name: SimpleNamespace(name=name, duration_s=lasting[name])) for name in lasting}
    monkeypatch.setattr(_next_experiment, "EXPERIMENTS", made)
    monkeypatch.setattr(_next_experiment, "_unseen", lambda *given: "unseen")
    model = MODEL.with_part("linear_leak").with_part("dead_band")
    found: Any = SimpleNamespace(
        fit=SimpleNamespace(model=model, likelihood=SimpleNamespace(noise_sd=0.01)), can_validate=can_validate,
        own_gains=own_gains, zero_changes=zero_changes,
    )  # fmt: skip
    excitation = Excitation((0.1,), (1.0,), 1, frozenset(), STANDARD)
    sessions: list[Any] = [
        SimpleNamespace(name=name, conditions=SimpleNamespace(step_s=step_s))
        for name, step_s in (("coarse", 0.05), ("fine", 0.02), ("coarser", 0.1))
    ]
    return next_experiment(found, causes, sessions, excitation, open_=open_)


def test_the_largest_doubtful_cause_is_parted_by_what_parts_it_best(monkeypatch: pytest.MonkeyPatch) -> None:
    small = _cause("dead_band", 0.01, ("contact_area",))
    large = _cause("linear_leak", 0.02, ("orifice_leak", "zero_drift"), (("other", 3.0), ("orifice_leak", 5.0)))
    sure = _cause("dead_band", 0.09, ())
    told = _next(monkeypatch, [sure, small, large], {"steps": 20.0, "long_hold": 60.0})
    assert told.separates == ("linear_leak", "orifice_leak", "zero_drift")
    assert (told.protocol, told.channel, told.expected_margin, told.steps.name) == (
        "long_hold", "temperature", 60.0, "long_hold",
    )  # fmt: skip
    apart = "it should tell linear leak and orifice leak apart"
    assert told.says == f"run the protocol long hold: {apart}, which this data does not"
    better = replace_margin(large, -3.0)
    not_yet = f"run the protocol steps: {apart}, which this data does not"
    assert _next(monkeypatch, [better], {"steps": 40.0}).says == not_yet
    unknown = _cause("linear_leak", 0.02, ("orifice_leak",))
    assert _next(monkeypatch, [unknown], {"steps": 40.0}).says == not_yet
    # What tells more than the odds of a false name, -2 log of 0.02, does tell them apart, so many times less well.
    bound = -2.0 * math.log(0.02)
    for margin, by, said in (
        (0.999 * bound, 60.0, "which this data does not"),
        (1.001 * bound, 60.0, "7.7 times as well as this data does"),
        (8.0, 60.0, "7.5 times as well as this data does"),
        (8.0, 79.9, "10 times as well as this data does"),
        (8.0, 80.1, "far better than this data does"),
        (20.0, 2e7, "far better than this data does"),
    ):
        told = _next(monkeypatch, [replace_margin(large, margin)], {"long_hold": by})
        assert told.says == f"run the protocol long hold: {apart}, {said}"


def test_of_protocols_that_tell_about_as_much_the_shortest_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """At least half of what the best does, and more than this data."""
    doubtful = [_cause("linear_leak", 0.02, ("orifice_leak",), (("orifice_leak", 35.0),))]
    for by, protocol in ((40.1, "steps"), (39.9, "long_hold")):
        told = _next(monkeypatch, doubtful, {"steps": by, "long_hold": 80.0})
        assert (told.protocol, told.steps.name) == (protocol, protocol)
    assert _next(monkeypatch, doubtful, {"steps": 34.9, "long_hold": 60.0}).protocol == "long_hold"


def test_no_protocol_is_run_that_tells_no_more_than_this_data(monkeypatch: pytest.MonkeyPatch) -> None:
    doubtful = [_cause("linear_leak", 0.02, ("orifice_leak",), (("orifice_leak", 60.0),))]
    assert _next(monkeypatch, doubtful, {"long_hold": 60.1}).protocol == "long_hold"
    told = _next(monkeypatch, doubtful, {"steps": 40.0, "long_hold": 60.0})
    assert (told.protocol, told.channel, told.expected_margin, told.steps) == (None, "temperature", 60.0, None)
    assert told.says == (
        "none of the 2 protocols is expected to tell linear leak and orifice leak apart better than this data already"
        " does: log the temperature too"
    )


def replace_margin(cause: Any, margin: float) -> Any:
    return SimpleNamespace(**{**vars(cause), "rivals": (SimpleNamespace(effect="orifice_leak", margin=margin),)})


def test_what_no_load_history_parts_asks_for_a_channel_or_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Less than the odds of a false name, -2 log of 0.02."""
    doubtful = [_cause("linear_leak", 0.02, ("orifice_leak",))]
    bound = -2.0 * math.log(0.02)
    below = _next(monkeypatch, doubtful, {"steps": 0.999 * bound})
    assert (below.protocol, below.channel, below.steps) == (None, "temperature", None)
    assert below.says.endswith("tells linear leak and orifice leak apart: log the temperature too")
    assert _next(monkeypatch, doubtful, {"steps": 1.001 * bound}).protocol == "steps"
    assert _next(monkeypatch, doubtful, {}).says.endswith(": use either, both predict the same reading")


def test_where_nothing_is_doubtful_what_was_never_seen_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    sure, elsewhere = _cause("linear_leak", 0.02, ()), _cause("zero_offset", 0.02, ("load_cell_tare",), part=None)
    assert _next(monkeypatch, [sure], {}) is None
    assert _next(monkeypatch, [sure], {}, open_=True) == "unseen"
    assert _next(monkeypatch, [_cause("linear_leak", 0.02, (), confidence=0.74)], {}) == "unseen"  # it is not sure
    once = _next(monkeypatch, [], {}, can_validate=False)  # nothing can be told of a single load cycle
    assert (once.separates, once.protocol, once.steps) == ((), "repeat", None)
    assert once.says.startswith("repeat the load cycle")
    assert _next(monkeypatch, [sure, elsewhere], {}) == "unseen"  # a zero that is no part of the model
    assert _next(monkeypatch, [], {}) is None


def test_where_gains_differ_a_recording_is_made_again_with_the_unit_in_place_and_moved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sure, gains = _cause("linear_leak", 0.02, ()), (OwnGain("first", 0.0, 0.01), OwnGain("second", 0.0, -0.01))
    again = _next(monkeypatch, [sure], {}, own_gains=gains)
    assert (again.separates, again.protocol, again.channel) == ((), "repeat", None)
    near = _cause("dead_band", 0.01, (), (("saturation", 7.0), ("contact_area", 9.0)))
    assert _next(monkeypatch, [sure, near], {}, own_gains=gains).separates == ("dead_band", "saturation")
    alike = _cause("zero_offset", 0.01, ("load_cell_tare",), part=None)
    assert _next(monkeypatch, [near, alike], {}, own_gains=gains).separates == ("zero_offset", "load_cell_tare")
    assert "once without moving the unit and once after taking it out" in again.says
    slipped = _next(monkeypatch, [sure], {}, own_gains=(*gains, OwnGain("second", 83.21, 0.02, True)))
    assert slipped.says.startswith("record second again, and watch unit, cable and logger at 83.21 s")
    assert slipped.says.endswith("whether the gain changes there each time")
    slipped = _next(monkeypatch, [sure], {}, zero_changes=(ZeroChange("third", 12.3, 0.02),))
    assert slipped.says.startswith("record third again, and watch unit, cable and logger at 12.3 s")
    assert slipped.says.endswith("whether the zero changes there each time")
    doubtful = [_cause("linear_leak", 0.02, ("orifice_leak",), rivals=(("orifice_leak", 1.0),))]
    assert _next(monkeypatch, doubtful, {"steps": 1e3}, own_gains=gains).protocol == "steps"


def test_a_law_that_a_block_stands_for_is_parted_from_its_rival_in_the_blocks_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitted: list[tuple[str, str]] = []

    def in_place(found: Any, part: str, law: str) -> str:
        fitted.append((part, law))
        return law

    seen: list[tuple[Any, Any]] = []
    monkeypatch.setattr(_next_experiment, "_in_place_of", in_place)
    monkeypatch.setattr(_next_experiment, "expected_margin", lambda *given: seen.append(given[:2]) or 1e3)
    found: Any = SimpleNamespace(
        fit=SimpleNamespace(model=MODEL.with_part("flexible_curve"), likelihood=SimpleNamespace(noise_sd=0.01))
    )
    for law, rival in (("contact_area", "wall_hardening"), ("dead_band", "saturation")):
        fitted.clear()
        seen.clear()
        told = next_experiment(
            found, [_cause(law, 0.02, (rival,), part="flexible_curve")],
            [
                SimpleNamespace(
                    recording=SimpleNamespace(channels=()),
                    conditions=SimpleNamespace(step_s=0.1, temperature_k=None, neighbour=None),
                )
            ],
            Excitation((0.1,), (1.0,), 1, frozenset(), STANDARD), open_=False,
        )  # fmt: skip
        assert told is not None
        assert told.separates == (law, rival)
        assert {*fitted} == {("flexible_curve", law), ("flexible_curve", rival)}
        assert {*seen} == {(law, rival)}


# -- names ------------------------------------------------------------------------------------------------------------
def _member(
    size: float = 0.01,
    departed: float = 0.5,
    margin: float | None = 40.0,
    fall: float = 100.0,
    laws: tuple[tuple[str | None, float], ...] = (),
    others: float = 0.0,
    likeness: float = 0.0,
) -> Any:
    near = () if margin is None else (SimpleNamespace(effect="delay", margin=1.0), Alternative(None, margin))
    return SimpleNamespace(
        effect=effect("linear_leak"), size=size, departed=departed, alternatives=near, fall=fall,
        laws=tuple(Alternative(name, by) for name, by in laws), others_depart=others, likeness=likeness,
        is_any_curve=False, untold=(),
    )  # fmt: skip


def test_a_kind_is_as_sure_as_its_logistic_says() -> None:
    """2.77; -1.12 per log of what no equation follows over the size; -0.99 per deviation; -2.22 a likeness."""
    for size, departed, left, margin, others, likeness in (
        (0.01, 0.5, 0.002, 40.0, 0.003, 0.4), (0.001, 2.0, 0.01, 3.0, 0.0, 0.0), (0.05, 0.0, 0.0, 0.5, 0.01, 0.9),
    ):  # fmt: skip
        ratio = (math.hypot(left, others) + 2e-4) / (size + 2e-4)
        score = 2.77 - 1.12 * math.log(ratio) - 0.99 * departed - 2.22 * likeness
        expected = 1.0 / (1.0 + math.exp(-score)) / (1.0 + math.exp(-margin / 2.0))
        one = _member(size, departed, margin, others=others, likeness=likeness)
        assert probability_of_kind(one, left, STANDARD) == pytest.approx(expected)
    worse = probability_of_kind(_member(margin=-5.0), 0.002, STANDARD)
    assert worse == pytest.approx(0.5 * probability_of_kind(_member(margin=None), 0.002, STANDARD))


def test_a_law_is_as_sure_as_its_nearest_rivals_odds_say() -> None:
    """Margins in units of twice one and of the squared departure times the fall."""
    found = _member(fall=100.0, laws=((None, 0.0), ("orifice_leak", 12.0), ("zero_drift", 30.0)))
    law, equivalents = probability_of_law(found, STANDARD)
    assert law == pytest.approx(1.0 / (1.0 + math.exp(-12.0 / (2.0 * 7.25))))
    ruled = {name: math.exp(-by / (2.0 * 7.25)) for name, by in (("orifice_leak", 12.0), ("zero_drift", 30.0))}
    assert equivalents == tuple(name for name, odds in ruled.items() if odds > 0.3)
    bound = -math.log(0.3) * 14.5
    for by, told in ((0.999, ("orifice_leak",)), (1.001, ())):
        assert probability_of_law(_member(laws=(("orifice_leak", by * bound),)), STANDARD)[1] == told
    # What explains nothing departs by nothing; a rival that follows better is as good at the most.
    below = _member(fall=-50.0, laws=(("orifice_leak", 3.0),))
    assert probability_of_law(below, STANDARD)[0] == pytest.approx(1.0 / (1.0 + math.exp(-1.5)))
    better = _member(laws=(("orifice_leak", -9.0),))
    assert probability_of_law(better, STANDARD)[0] == 0.5


def test_a_member_is_named_from_what_is_material_and_sure_on() -> None:
    assert names_of([_member(size=STANDARD.material, departed=0.0)], 0.0, STANDARD) != ()
    assert names_of([_member(size=0.999 * STANDARD.material, departed=0.0)], 0.0, STANDARD) == ()
    sure = probability_of_kind(_member(), 0.002, STANDARD)
    for least, is_sure in ((sure, True), (sure + 1e-9, False)):
        (name,) = names_of([_member()], 0.002, replace(STANDARD, least_confidence=least))
        assert (name.is_sure, name.kind_probability) == (is_sure, sure if is_sure else 0.5)
