"""What a protocol can tell, and what to run next, by columns and fits whose answer is known; names at their bounds."""

from __future__ import annotations

import math
import weakref
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from courses import course, pressed, triangles
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds, _next_experiment
from smartshoe.diagnosis._contest import Contest, Predict
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._experiments import run_on
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange
from smartshoe.diagnosis._likelihood import Fit
from smartshoe.diagnosis._members import Alternative
from smartshoe.diagnosis._naming import names_of, probability_of_kind, probability_of_law
from smartshoe.diagnosis._next_experiment import _contest, _fastest_n_per_s, _in_place_of, _is_run_of, next_experiment
from smartshoe.diagnosis._result import NextExperiment
from smartshoe.diagnosis.design import Design, _compared, _not_followed, design
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.effects.exposure import SAYS
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol, Segment

design_module = import_module("smartshoe.diagnosis.design")  # the package has a function of this name
Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")


# -- designs ----------------------------------------------------------------------------------------------------------
SIGNED = {"grows", "grows_too"}  # effects of one sign


def _columns(matrix: Array, candidates: list[tuple[str, tuple[int, ...], bool]], own: int = 2) -> Any:
    """A linearisation of one session with a target and such columns."""
    wide = np.column_stack([np.zeros(matrix.shape[0]), matrix])
    made = [
        SimpleNamespace(
            name=name,
            columns=columns,
            effect=SimpleNamespace(is_flexible=flexible),
            allows_sign_of=lambda strengths, name=name: name not in SIGNED or strengths[0] >= 0.0,
        )
        for name, columns, flexible in candidates
    ]
    session = SimpleNamespace(fitted=np.ones(matrix.shape[0], dtype=bool))
    return SimpleNamespace(gram=wide.T @ wide, baseline_count=own, candidates=made, sessions=[session])


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
    # None knows which shape it has: the one that is followed best.
    followed = {k: _left(left[k], np.column_stack([left[4], left[6]])) for k in (2, 3)}
    expected = min(float(rest @ rest) / float(left[k] @ left[k]) for k, rest in followed.items())
    assert found.unlike[0, 1] == pytest.approx(expected)
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

    def missed(*columns: int, power: float = 4.0) -> float:
        rival: Any = SimpleNamespace(columns=columns, allows_sign_of=lambda strengths: True)
        target: Any = SimpleNamespace(columns=(1,), allows_sign_of=lambda strengths: True)
        return float(_not_followed(left, rival, [target], np.array([power]))[0])

    assert missed(2) == pytest.approx(0.5)
    assert missed(3) == pytest.approx(1.0)
    assert missed(1, 3) == pytest.approx(0.0, abs=1e-12)
    assert missed(2, power=1.0) == 0.0


def test_an_effect_is_followed_with_the_sign_that_physics_allows_only() -> None:
    rng = np.random.default_rng(3)
    x = rng.standard_normal((80, 3))
    x[:, 2] = -x[:, 1] + 0.01 * x[:, 2]
    x[:, 1:] = np.column_stack([_left(x[:, k], x[:, :1]) for k in (1, 2)])
    for one, other, is_told in (
        ("grows", "grows_too", True), ("grows", "either", False), ("either", "grows", False), ("either", "any", False),
    ):  # fmt: skip
        found = _compared(_columns(x, [(one, (2,), False), (other, (3,), False)], own=1), 0.01, 0.003, STANDARD)
        for share in (found.unlike[0, 1], found.unlike[1, 0]):
            assert share == 1.0 if is_told else share < 0.01


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

    def compared(columns: Any, sd: float, strength: float, limits: Any, hidden: frozenset[str]) -> Design:
        assert hidden == set()  # a load is held
        seen["compared"] = columns, sd, strength, limits
        return _design(7.0)

    monkeypatch.setattr(design_module, "linearised", columns)
    monkeypatch.setattr(design_module, "_compared", compared)
    answer: Any = design(protocols, noise_percent=0.2, strength_percent=0.5, sample_rate_hz=200.0, unit=MODEL)
    assert answer.evidence == 7.0
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
    run = run_on(MODEL, protocol, 800.0, 0.02)
    assert run.time_s == pytest.approx(0.02 * np.arange(150))
    load_n = np.minimum(200.0 * run.time_s, 400.0)
    assert run.force_n == pytest.approx(load_n)
    share = MODEL.simulate(Conditions(run.time_s, load_n / 800.0, 0.02))
    assert run.sensor.values == pytest.approx(140.0 * share)
    assert (run.name, run.sensor.unit.symbol) == ("ramp", "mbar")


# -- contests ---------------------------------------------------------------------------------------------------------
def _contested(cause: float, rival: float, without: float) -> Contest:
    likelihood: Any = SimpleNamespace(thresholds=STANDARD)
    fits: list[Any] = [SimpleNamespace(cost=cost, likelihood=likelihood) for cost in (cause, rival, without)]
    return Contest(*fits)


def test_a_contest_is_weighed_as_laws_are() -> None:
    """Margin over 2 (1 + departure^2 ratio), nothing where the rival follows better; never without an end."""
    one = _contested(100.0, 350.0, 1100.0)
    assert one.margin == 250.0
    assert one.log_odds == pytest.approx(250.0 / (2.0 * (1.0 + 0.0625 * 1000.0)))
    assert _contested(100.0, 50.0, 1100.0).log_odds == 0.0
    assert math.isfinite(_contested(0.0, 1e9, 1.0).log_odds)


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


class _Foretold:
    """A contest of this data, with what each protocol would make of it: log odds and margin."""

    def __init__(
        self,
        log_odds: float,
        margin: float,
        then: dict[str, tuple[float, float]] | None = None,
        fits: tuple[ExtendedModel, ExtendedModel] = (MODEL, MODEL),
    ) -> None:
        self.log_odds, self.margin, self._then = log_odds, margin, then or {}
        self.cause = SimpleNamespace(likelihood=SimpleNamespace(sessions=()), model=fits[0])
        self.rival = SimpleNamespace(model=fits[1])
        self.asked: list[str] = []

    def after_experiment(
        self, protocol: Any, sample_time_s: float, least: float, min_log_odds: float, predict: Predict
    ) -> _Foretold | None:
        predict(MODEL, protocol, sample_time_s, STANDARD)
        assert sample_time_s == pytest.approx(0.005)  # of the recording that was logged most quickly
        assert min_log_odds == min(2.0 * self.log_odds, ENDS)  # what comes to no more is never proposed
        self.asked.append(protocol.name)
        then = _Foretold(*self._then.get(protocol.name, (self.log_odds, self.margin)))
        return then if then.margin - self.margin > least else None


ENDS = -math.log(0.3)  # log odds from which on a rival is no equivalent


def _pressing(name: str, lasting_s: float, rate_n_per_s: float) -> Protocol:
    """To 790 N at that rate, and off again as slowly as it lasts."""
    up_s = 790.0 / rate_n_per_s
    return Protocol(name, (Segment("ramp", 790.0, up_s), Segment("ramp", 0.0, lasting_s - up_s)))


def _next(
    monkeypatch: pytest.MonkeyPatch,
    causes: list[Any],
    contests: dict[str, _Foretold],
    open_: bool = False,
    can_validate: bool = True,
    own_gains: tuple[OwnGain, ...] = (),
    zero_changes: tuple[ZeroChange, ...] = (),
    channel: str | None = None,
    rate_n_per_s: float = 320.0,
    present: frozenset[Any] = frozenset(),
    predicted: Any = lambda *given: None,
) -> Any:
    monkeypatch.setattr(_next_experiment, "_contest", lambda found, cause, rival: contests[cause.name])
    monkeypatch.setattr(_next_experiment, "_channel", lambda name, rival, sessions: channel)
    lasting = {"long_hold": 600.0, "steps": 50.0, "rates": 200.0}
    made = {name: (lambda peak_n, name=name: _pressing(name, lasting[name], rate_n_per_s)) for name in lasting}
    monkeypatch.setattr(_next_experiment, "EXPERIMENTS", made)
    monkeypatch.setattr(_next_experiment, "predicted_session", predicted)
    unseen = NextExperiment((), "unseen", None, "unseen", None, _pressing("unseen", 50.0, rate_n_per_s))
    monkeypatch.setattr(_next_experiment, "_protocol_for_missing_excitation", lambda *given: unseen)
    found: Any = SimpleNamespace(
        fit=SimpleNamespace(model=MODEL), can_validate=can_validate, own_gains=own_gains, zero_changes=zero_changes
    )
    excitation = Excitation((0.1,), (1.0,), present, STANDARD)
    sessions: list[Any] = [
        SimpleNamespace(recording=pressed(triangles(), step_s=step_s)) for step_s in (0.05, 0.005, 0.1)
    ]
    return next_experiment(found, causes, sessions, excitation, open_=open_)


LEAK = ("linear_leak", 0.02, ("orifice_leak", "zero_drift"))
BOTH = "linear leak and orifice leak"
LOADS = "it loads to 790 N at up to 320 N/s"
NO_USE = "if it is linear leak, no protocol is expected to rule out orifice leak"


def test_the_shortest_protocol_that_rules_the_nearest_equivalent_out_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    for odds, protocol, asked in (
        (1.001 * ENDS, "rates", ["steps", "rates"]), (0.999 * ENDS, "long_hold", ["steps", "rates", "long_hold"]),
    ):  # fmt: skip
        contest = _Foretold(0.1, 5.0, {"steps": (0.9, 90.0), "rates": (odds, 60.0), "long_hold": (9.0, 1e4)})
        told = _next(monkeypatch, [_cause(*LEAK)], {"linear_leak": contest}, channel="temperature")
        assert contest.asked == asked  # those after it are not asked
        assert told.separates == ("linear_leak", "orifice_leak", "zero_drift")
        assert (told.protocol, told.channel, told.steps.name) == (protocol, "temperature", protocol)
        name = protocol.replace("_", " ")
        apart = f"run the protocol {name}: it should tell {BOTH} apart, which this data does not"
        assert told.says == f"{apart}; {LOADS}"
    assert told.expected_margin == 1e4 - 5.0  # what it adds
    # What adds no more than noise does not count, however its odds come to be.
    bound = -2.0 * math.log(0.02)
    for by, protocol in ((0.999 * bound, "rates"), (1.001 * bound, "steps")):
        contest = _Foretold(1.1, 5.0, {"steps": (1.3, 5.0 + by), "rates": (1.3, 90.0)})
        assert _next(monkeypatch, [_cause(*LEAK)], {"linear_leak": contest}).protocol == protocol


def test_a_protocol_tells_how_fast_it_loads_and_where_no_recording_was_as_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """800 N in 2.5 s at a sample every 20 ms: four times as fast at one every 5 ms, the fastest of all."""
    ends = {"linear_leak": _Foretold(0.1, 5.0, {"steps": (9.0, 90.0)})}
    for rate_n_per_s, is_beyond in ((1580.0, False), (1620.0, True), (4990.0, True)):
        said = _next(monkeypatch, [_cause(*LEAK)], ends, rate_n_per_s=rate_n_per_s).says
        beyond = ", faster than anything recorded (up to 1,280 N/s): if the machine cannot, let its fast ramps take"
        assert f"it loads to 790 N at up to {rate_n_per_s:,.0f} N/s" in said
        assert (beyond in said) is is_beyond
    only_falls = np.concatenate([np.zeros(50), np.linspace(0.0, 1.0, 500), np.linspace(1.0, 0.0, 50), np.zeros(50)])
    stairs = course(*[corner for k in range(8) for corner in ((10, 0.1 * (k + 1)), (300, 0.1 * (k + 1)))])
    for load, recorded in ((only_falls, 816.3), (stairs, 400.0), (0.0 * stairs, 0.0)):
        assert _fastest_n_per_s(pressed(load)) == pytest.approx(recorded, rel=0.03)


def test_where_none_ends_the_doubt_the_shortest_that_tells_about_as_much_as_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At least half of the best, twice what this data tells, and more than noise does."""
    bound = -2.0 * math.log(0.02)
    for now, steps, rates, protocol in (
        ((0.1, 5.0), (0.401, 90.0), (0.8, 90.0), "steps"),
        ((0.1, 5.0), (0.399, 90.0), (0.8, 90.0), "rates"),
        ((0.1, 5.0), (0.201, 90.0), (0.21, 90.0), "steps"),
        ((0.1, 5.0), (0.199, 90.0), (0.21, 90.0), "rates"),
        ((0.0, -90.0), (0.2, bound - 90.1), (0.21, bound - 89.9), "rates"),
    ):
        contest = _Foretold(*now, {"steps": steps, "rates": rates})
        told = _next(monkeypatch, [_cause(*LEAK)], {"linear_leak": contest})
        assert (told.protocol, told.steps.name) == (protocol, protocol)
        assert told.says.startswith(
            f"run the protocol {protocol}: it should tell more about {BOTH} than this data does"
        )
        assert told.says.endswith(f"though, {NO_USE}; {LOADS}")


def test_what_no_protocol_tells_better_asks_for_a_channel_or_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    contests = {"linear_leak": _Foretold(0.1, 5.0, {"steps": (0.199, 90.0), "rates": (0.1, 40.0)})}
    told = _next(monkeypatch, [_cause(*LEAK)], contests)
    assert (told.protocol, told.channel, told.expected_margin, told.steps) == (None, None, 85.0, None)
    # Nothing is said of what would be read if it were the other one, which nobody simulated.
    assert told.says == f"{NO_USE}: use either for loads like those recorded, under which they read too nearly alike"
    clip = _cause("sensor_nonlinearity", 0.3, ("saturation",), ())
    for slope_lost, stays in ((1.0, True), (0.1, False)):  # a bend is undone as another curve is
        fits = MODEL, MODEL.with_part("saturation", [slope_lost, 0.8, 0.01, 0.0])
        unlike = _Foretold(0.1, 5.0, {"steps": (0.199, 90.0), "rates": (0.1, 40.0)}, fits)
        said = _next(monkeypatch, [clip], {"sensor_nonlinearity": unlike}).says
        lost = "nearly alike, but the saturation stays in the force, since what was clipped is lost"
        assert said.endswith(lost if stays else "under which they read too nearly alike")
    told = _next(monkeypatch, [_cause(*LEAK)], contests, channel="pressure_reference")
    assert (told.protocol, told.channel) == (None, "pressure reference")
    assert told.says == f"{NO_USE}: what would is {SAYS['pressure_reference']}"
    # What tells a little more by no means rules out: a channel that the catalogue knows does.
    contests = {"linear_leak": _Foretold(0.1, 5.0, {"steps": (0.9, 90.0)})}
    assert _next(monkeypatch, [_cause(*LEAK)], contests).protocol == "steps"
    assert _next(monkeypatch, [_cause(*LEAK)], contests, channel="temperature").protocol is None


def test_what_a_unit_would_read_is_simulated_once_for_all_its_causes_and_kept_no_longer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []
    kept: weakref.WeakSet[Any] = weakref.WeakSet()

    def predicted(unit: Any, protocol: Any, *given: Any) -> Any:
        asked.append(protocol.name)
        session = type("Simulated", (), {})()
        kept.add(session)
        return session

    causes = [_cause(*LEAK), _cause("dead_band", 0.01, ("contact_area",))]
    contests = {"linear_leak": _Foretold(0.1, 5.0), "dead_band": _Foretold(0.1, 5.0)}
    for again in (1, 2):
        _next(monkeypatch, causes, contests, predicted=predicted)
        assert asked == ["steps", "rates", "long_hold"] * again
        assert not kept


def test_of_several_doubtful_causes_the_largest_that_a_protocol_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    small, large = _cause("dead_band", 0.01, ("contact_area",)), _cause(*LEAK)
    ends, no_use = {"steps": (9.0, 90.0)}, {"steps": (0.1, 9.0)}
    both = {"linear_leak": _Foretold(0.1, 5.0, ends), "dead_band": _Foretold(0.1, 5.0, ends)}
    assert _next(monkeypatch, [small, large], both).separates[0] == "linear_leak"
    both["linear_leak"] = _Foretold(0.1, 5.0, no_use)
    assert _next(monkeypatch, [small, large], both).separates[0] == "dead_band"
    assert _next(monkeypatch, [small, large], both, channel="temperature").separates[0] == "dead_band"
    both["dead_band"] = _Foretold(0.1, 5.0, no_use)
    assert _next(monkeypatch, [small, large], both).separates[0] == "linear_leak"
    # "Use either" is no advice where more is left than that, or a name is not sure.
    unsure = _cause("zero_drift", 0.001, (), confidence=0.74)
    assert _next(monkeypatch, [small, large, unsure], both).says == f"unseen; {LOADS}"
    assert _next(monkeypatch, [small, large], both, open_=True).says == f"unseen; {LOADS}"
    assert _next(monkeypatch, [small, large], both, open_=True, channel="temperature").channel == "temperature"


def test_a_protocol_that_the_data_holds_is_of_one_shape_and_length() -> None:
    protocol = Protocol("ramps", (Segment("ramp", 400.0, 4.0), Segment("ramp", 0.0, 4.0)) * 3)
    time_s = np.arange(0.0, protocol.duration_s, 0.1)

    def held(load: Array, upto_s: float = 24.0) -> bool:
        kept = time_s < upto_s
        session: Any = SimpleNamespace(conditions=SimpleNamespace(time_s=time_s[kept], load=load[kept]))
        return _is_run_of(protocol, session, 400.0, STANDARD.same)

    asked = protocol.load_at(time_s) / 400.0
    assert held(asked)
    assert held(0.9 * protocol.load_at(time_s - 0.2) / 400.0 + 0.05)  # late, with a tare, by a machine that falls short
    assert held(asked, 19.0)
    assert not held(asked, 17.0)
    assert not held(protocol.load_at(time_s + 2.0) / 400.0)
    assert not held(0.5 * asked)


def test_where_nothing_is_doubtful_what_was_never_seen_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    sure, elsewhere = _cause("linear_leak", 0.02, ()), _cause("zero_offset", 0.02, ("load_cell_tare",), part=None)
    assert _next(monkeypatch, [sure], {}) is None
    assert _next(monkeypatch, [sure], {}, open_=True).says == f"unseen; {LOADS}"
    assert _next(monkeypatch, [_cause("linear_leak", 0.02, (), confidence=0.74)], {}).says == f"unseen; {LOADS}"
    once = _next(monkeypatch, [], {}, can_validate=False)  # nothing can be told of a single load cycle
    assert (once.separates, once.protocol, once.steps) == ((), "repeat", None)
    assert once.says.startswith("repeat the load cycle")
    assert _next(monkeypatch, [sure, elsewhere], {}).says == f"unseen; {LOADS}"  # a zero that is no part of the model
    assert _next(monkeypatch, [], {}) is None


def test_a_zero_that_a_rest_shows_is_told_from_a_tare_by_a_known_pressure_and_by_no_protocol(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    zero, rests = _cause("zero_offset", 0.02, ("load_cell_tare",), part=None), frozenset({"rests"})
    told = _next(monkeypatch, [zero], {}, channel="pressure_reference", present=rests)
    assert (told.separates, told.protocol, told.channel) == (
        ("zero_offset", "load_cell_tare"), None, "pressure reference"
    )  # fmt: skip
    assert told.says.startswith("no load tells zero offset from load cell tare: what does is a pressure that is known")
    assert _next(monkeypatch, [zero], {}, present=rests) is None
    unsure = _cause("linear_leak", 0.02, (), confidence=0.74)
    assert _next(monkeypatch, [zero, unsure], {}, channel="pressure_reference", present=rests).protocol == "unseen"


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
    ends = {"linear_leak": _Foretold(0.1, 5.0, {"steps": (9.0, 90.0)})}
    assert _next(monkeypatch, [_cause(*LEAK)], ends, own_gains=gains).protocol == "steps"
    no_use = {"linear_leak": _Foretold(0.1, 5.0)}  # "use either" is less than that
    assert _next(monkeypatch, [_cause(*LEAK)], no_use, own_gains=gains).protocol == "repeat"
    assert _next(monkeypatch, [_cause(*LEAK)], no_use, own_gains=gains, channel="temperature").channel == "temperature"


def test_a_contest_is_of_what_was_fitted_and_of_what_is_fitted_in_a_blocks_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Drifts that are held beside the cause are held beside its rival: else a long protocol tells them apart by it."""

    def fitted(what: str) -> Any:
        return Fit(SimpleNamespace(held_as=lambda whole: f"{what}, held as {whole}"), 0.0, None)  # type: ignore[arg-type]

    monkeypatch.setattr(_next_experiment, "_in_place_of", lambda found, part, law: fitted(f"{law} for {part}"))
    monkeypatch.setattr(Contest, "refitted", lambda self: self)
    laws = (Alternative("contact_area", 3.0, fitted("contact")), Alternative("dead_band", 4.0, fitted("band")))
    confounded = (Alternative("zero_drift", 5.0, fitted("drift")),)
    members = [
        SimpleNamespace(name=name, laws=laws, confounded=confounded, without=f"without {name}")
        for name in ("other", "flexible_curve", "gas_compression")
    ]
    found: Any = SimpleNamespace(fit=SimpleNamespace(model="whole"), members=members)
    for name, part, rival, expected in (
        ("contact_area", "flexible_curve", "dead_band", ("contact", "band")),
        ("contact_area", "flexible_curve", "saturation", ("contact", "saturation for flexible_curve")),
        ("gas_compression", "gas_compression", "zero_drift", ("", "drift")),
    ):
        contest = _contest(found, _cause(name, 0.02, (rival,), part=part), rival)
        as_told = tuple(f"{one}, held as whole" if one else "whole" for one in expected)
        assert (contest.cause.model, contest.rival.model, contest.without) == (*as_told, f"without {part}")


# -- names ------------------------------------------------------------------------------------------------------------
def _member(
    size: float = 0.01,
    departure_sds: float = 0.5,
    margin: float | None = 40.0,
    likelihood_ratio: float = 100.0,
    laws: tuple[tuple[str | None, float], ...] = (),
    others: float = 0.0,
    likeness: float = 0.0,
) -> Any:
    near = () if margin is None else (SimpleNamespace(effect="delay", margin=1.0), Alternative(None, margin))
    return SimpleNamespace(
        effect=effect("linear_leak"), size=size, departure_sds=departure_sds, alternatives=near,
        likelihood_ratio=likelihood_ratio,
        laws=tuple(Alternative(name, by) for name, by in laws), others_departure_rms=others, likeness=likeness,
        is_any_curve=False, confounded=(), bends_too_little=False,
    )  # fmt: skip


def test_a_kind_is_as_sure_as_its_logistic_says() -> None:
    """2.77; -1.12 per log of what no equation follows over the size; -0.99 per deviation; -2.22 a likeness."""
    for size, departure_sds, left, margin, others, likeness in (
        (0.01, 0.5, 0.002, 40.0, 0.003, 0.4), (0.001, 2.0, 0.01, 3.0, 0.0, 0.0), (0.05, 0.0, 0.0, 0.5, 0.01, 0.9),
    ):  # fmt: skip
        ratio = (math.hypot(left, others) + 2e-4) / (size + 2e-4)
        score = 2.77 - 1.12 * math.log(ratio) - 0.99 * departure_sds - 2.22 * likeness
        expected = 1.0 / (1.0 + math.exp(-score)) / (1.0 + math.exp(-margin / 2.0))
        one = _member(size, departure_sds, margin, others=others, likeness=likeness)
        assert probability_of_kind(one, left, STANDARD) == pytest.approx(expected)
    worse = probability_of_kind(_member(margin=-5.0), 0.002, STANDARD)
    assert worse == pytest.approx(0.5 * probability_of_kind(_member(margin=None), 0.002, STANDARD))


def test_a_law_is_as_sure_as_its_nearest_rivals_odds_say() -> None:
    """Margins in units of twice one and of the squared departure times the likelihood ratio."""
    found = _member(likelihood_ratio=100.0, laws=((None, 0.0), ("orifice_leak", 12.0), ("zero_drift", 30.0)))
    law, equivalents = probability_of_law(found, STANDARD)
    assert law == pytest.approx(1.0 / (1.0 + math.exp(-12.0 / (2.0 * 7.25))))
    ruled = {name: math.exp(-by / (2.0 * 7.25)) for name, by in (("orifice_leak", 12.0), ("zero_drift", 30.0))}
    assert equivalents == tuple(name for name, odds in ruled.items() if odds > 0.3)
    bound = -math.log(0.3) * 14.5
    for by, told in ((0.999, ("orifice_leak",)), (1.001, ())):
        assert probability_of_law(_member(laws=(("orifice_leak", by * bound),)), STANDARD)[1] == told
    # What explains nothing departs by nothing; a rival that follows better is as good at the most.
    below = _member(likelihood_ratio=-50.0, laws=(("orifice_leak", 3.0),))
    assert probability_of_law(below, STANDARD)[0] == pytest.approx(1.0 / (1.0 + math.exp(-1.5)))
    better = _member(laws=(("orifice_leak", -9.0),))
    assert probability_of_law(better, STANDARD)[0] == 0.5


def test_a_member_is_named_from_what_is_material_and_sure_on() -> None:
    assert names_of([_member(size=STANDARD.material, departure_sds=0.0)], 0.0, STANDARD) != ()
    assert names_of([_member(size=0.999 * STANDARD.material, departure_sds=0.0)], 0.0, STANDARD) == ()
    sure = probability_of_kind(_member(), 0.002, STANDARD)
    for least, is_sure in ((sure, True), (sure + 1e-9, False)):
        (name,) = names_of([_member()], 0.002, replace(STANDARD, least_confidence=least))
        assert (name.is_sure, name.kind_probability) == (is_sure, sure if is_sure else 0.5)
