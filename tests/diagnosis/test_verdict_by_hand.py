"""What is said of clocks, pasts and known faults, and effects that undo each other: at the very bounds that decide."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_evidence import STANDARD, ToldEvidence, candidate, worth

from smartshoe.diagnosis import _inference, _validation, _zero
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange, changes_of
from smartshoe.diagnosis._gauss_markov import GaussMarkov, _lagged
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._inference import _validated
from smartshoe.diagnosis._limits import (
    limit_clocks_disagree,
    limit_curves_in_tare,
    limit_early,
    limit_held_out_excess,
    limit_own_gains,
    limit_rejected,
    limit_relaxation_range,
    limit_zero_drifted,
    limit_zero_extrapolated,
    limit_zero_jumps,
    reason_not_shown,
    reason_of_another_kind,
    reason_tare_creeps,
)
from smartshoe.diagnosis._residual_structure import ResidualStructure
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._validation import cancelling_effects
from smartshoe.diagnosis._verdict import fault_rms, verdict_of
from smartshoe.diagnosis._zero import Zero, _may_have_drifted, creeping_tare
from smartshoe.models.effects import effect, shift_of
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR, Unit, unit

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
SCALE = Scale(800.0, -140.0, MILLIBAR)
# Of 200 s in the mean; what is held out has no say.
LONG: Any = [
    SimpleNamespace(conditions=SimpleNamespace(time_s=np.array([0.0, end_s])), fitted=np.array([fitted]))
    for end_s, fitted in ((150.0, True), (250.0, True), (900.0, False))
]


# -- what is said -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("lag_s", "off_s"), [(1.0, 0.25), (0.2, 0.1)])
def test_a_lag_that_a_fit_sees_otherwise_is_said(sign: float, lag_s: float, off_s: float) -> None:
    """By more than a quarter of it, and than an echo's tenth of a second."""
    told, value = effect("delay"), np.array([sign * lag_s])
    for by, is_said in ((0.999, False), (1.001, True)):
        for side in (1.0, -1.0):
            fitted = sign * lag_s + side * by * off_s
            model = MODEL.with_part("dead_band").with_part(told, np.array([fitted]))
            said = limit_clocks_disagree([(told, value)], model, LONG, STANDARD)
            assert len(said) == is_said
            if is_said:
                way = "late" if sign > 0.0 else "early"
                assert (
                    f"is {lag_s:.3g} s {way}; fitted with the other effects, it is {abs(fitted):.3g} s {way}:"
                    in said[0]
                )
    # One that is no longer in the model is as it was.
    assert limit_clocks_disagree([(told, value)], MODEL, LONG, STANDARD) == []


def test_a_lag_is_that_of_all_that_is_late_in_the_middle_of_a_recording() -> None:
    delay, drift, lag = (effect(name) for name in ("delay", "clock_drift", "sensor_lag"))
    told = [(delay, np.array([0.2])), (drift, np.array([0.004]))]
    both = MODEL.with_part(delay, np.array([0.1])).with_part(drift, np.array([0.005]))
    assert limit_clocks_disagree(told, both, LONG, STANDARD) == []
    early = MODEL.with_part(delay, np.array([0.1])).with_part(drift, np.array([0.002]))
    (said,) = limit_clocks_disagree(told, early, LONG, STANDARD)
    assert "is 0.6 s late; fitted with the other effects, it is 0.3 s late:" in said
    beside = MODEL.with_part(delay, np.array([0.1])).with_part(lag, np.array([0.5, 0.1]))
    assert limit_clocks_disagree(told, beside, LONG, STANDARD) == []
    assert limit_clocks_disagree([(delay, np.array([0.2]))], beside, LONG, STANDARD) != []


@pytest.mark.parametrize(
    ("name", "inside", "at_bound", "told"),
    [
        ("second_relaxation", [0.1, 119.9], [0.1, 120.0], "time constant at 120 s"),
        ("second_relaxation", [0.1, 0.051], [0.1, 0.05], "time constant at 0.05 s"),
        ("cycle_conditioning", [0.1, 49.9, 0, 1], [0.1, 50.0, 0, 1], "cycles at 50"),
        ("cycle_conditioning", [0.1, 0.51, 0, 1], [0.1, 0.5, 0, 1], "cycles at 0.5"),
        ("power_law_creep", [0.1, 0.79], [0.1, 0.8], "exponent at 0.8"),
        ("power_law_creep", [0.1, 0.02], [0.1, 0.8], "exponent at 0.8"),  # logarithmic creep is creep
        ("warm_up", [0.1, 300.0, 1.4], None, ""),  # ever slower, it drifts as any of its kind
    ],
)
def test_an_effect_is_not_named_where_it_turns_into_one_of_another_kind(
    name: str, inside: list[float], at_bound: list[float] | None, told: str
) -> None:
    def said(values: list[float]) -> str | None:
        return reason_of_another_kind(
            _named(name), MODEL.with_part("linear_leak", [0.001]).with_part(name, values), STANDARD
        )

    assert said(inside) is None
    if at_bound is not None:
        assert said(at_bound) == (
            f"{name.replace('_', ' ')} fits best with its {told}, the end of its range: beyond it, it acts like"
            " another effect, so that it is not named"
        )


@pytest.mark.parametrize(
    "arm", [{"relaxation_rate_per_s": 50.0}, {"relaxation_rate_per_s": 0.01}, {"relaxing_share": 5.0}]
)
def test_a_second_arm_is_not_named_beside_a_first_as_no_wall_has_one(arm: dict[str, float]) -> None:
    """Either may be the wall's own: what has no arm of its own, or a ladder of them, is none."""

    def said(name: str, model: ExtendedModel, early_s: float = -0.08) -> str | None:
        values = (
            [0.1, 0.3] if name in ("second_relaxation", "power_law_creep") else [early_s if name == "delay" else 0.001]
        )
        return reason_of_another_kind(_named(name), model.with_part(name, values), STANDARD)

    for name in ("second_relaxation", "power_law_creep", "linear_leak", "delay"):
        assert said(name, MODEL) is None
        is_open = name in ("second_relaxation", "delay")  # an arm of 5 at 33/s is 0.18 s late, which a delay undoes
        beside = said(name, replace(MODEL, **arm))
        assert (beside is not None) is is_open
        fits = f"{name.replace('_', ' ')} fits, but is not named: it fits only with the wall's relaxation"
        assert beside is None or beside.startswith(fits)
        assert said("delay", replace(MODEL, **arm), 0.08) is None  # late as well
    inside = {key: 0.99 * value + 0.01 * getattr(MODEL, key) for key, value in arm.items()}
    assert said("second_relaxation", replace(MODEL, **inside)) is None  # type: ignore[arg-type]


def test_an_arm_that_creeps_beside_a_baseline_that_falls_may_be_the_walls_own() -> None:
    """Of two exponentials the wall's is the one that creeps; what falls is air's."""
    falling = replace(MODEL, relaxing_share=-0.15)
    for name, values, is_told in (
        ("second_relaxation", [0.1, 0.3], True), ("second_relaxation", [-0.1, 0.3], False),
        ("linear_leak", [0.1], False),
    ):  # fmt: skip
        said = reason_of_another_kind(_named(name), falling.with_part(name, np.array(values)), STANDARD)
        assert (said is not None) is is_told
        assert reason_of_another_kind(_named(name), MODEL.with_part(name, np.array(values)), STANDARD) is None
        assert said is None or said.startswith(
            "second relaxation fits, but is not named: it fits only beside a baseline"
        )


def test_a_block_that_follows_what_no_law_does_is_said_and_not_named_however_near_a_law_comes() -> None:
    block: Any = SimpleNamespace(
        effect=effect("sensor_lag"), member=SimpleNamespace(name="flexible_lag"), law_in_place=None
    )

    def said(direction: float) -> str | None:
        return reason_of_another_kind(block, MODEL.with_part("flexible_lag", np.array([0.03, direction])), STANDARD)

    for sign in (-1.0, 1.0):
        assert "the reading comes later one way than the other" in str(said(sign * 1.01 * STANDARD.law_departure))
        assert said(sign * 0.99 * STANDARD.law_departure) is None  # a law departs as far
    block.law_in_place = "a law that misses little"
    assert said(0.9) is not None
    kind: Any = SimpleNamespace(
        effect=effect("permanent_set"), member=SimpleNamespace(name="flexible_set"), law_in_place=None
    )
    assert reason_of_another_kind(kind, MODEL.with_part("flexible_set"), STANDARD) is None


def test_a_memory_of_which_single_load_cycles_show_nothing_is_said_with_what_would_show_it() -> None:
    once = Excitation((0.1, 0.5), (1.0,), frozenset({"rates"}), STANDARD, is_cycled=False)
    told = str(reason_not_shown(_named("permanent_set"), once))
    assert told.startswith(
        "permanent set fits, but is not named: recordings of one load cycle cannot show it; it needs loads"
        " held for some seconds, at several levels"
    )
    assert "; or rests without load" in told
    assert "pauses" not in told  # of which there are none before a second cycle
    for name in ("cycle_conditioning", "mullins_softening", "gain_drift"):  # shown by nothing but later cycles
        assert str(reason_not_shown(_named(name), once)).endswith("cannot show it; it needs more load cycles")
    assert reason_not_shown(_named("second_relaxation"), once) is None
    assert reason_not_shown(_named("permanent_set"), replace(once, is_cycled=True)) is None


@pytest.mark.parametrize(
    ("rates_per_s", "is_held", "is_shown"),
    [((), False, False), ((), True, False), ((0.1,), False, False), ((0.1,), True, True), ((0.1, 0.5), False, True)],
)
def test_a_gain_that_goes_with_the_rate_is_not_named_where_no_two_rates_and_no_ramp_beside_a_hold_show_it(
    rates_per_s: tuple[float, ...], is_held: bool, is_shown: bool
) -> None:
    data = Excitation(rates_per_s, (1.0,), frozenset(), STANDARD, is_held=is_held)
    said = reason_not_shown(_named("rate_gain"), data)
    assert said is None if is_shown else "cannot show it; it needs loads held" in str(said)
    assert reason_not_shown(_named("play_hysteresis"), data) is None  # a loop is seen at any one rate


def _named(name: str) -> Any:
    return SimpleNamespace(effect=effect(name), member=SimpleNamespace(name=name))


def test_what_faults_add_is_the_most_of_those_fitted_in_shares_of_the_reading() -> None:
    """Each in its own recording's unit: of 140 mbar, 1400 Pa are a tenth."""

    def session(index: int, unit: Unit, fitted: bool = True) -> Any:
        recording = SimpleNamespace(sensor=SimpleNamespace(unit=unit))
        return SimpleNamespace(index=index, recording=recording, fitted=np.full(3, fitted))

    sessions = [session(0, MILLIBAR), session(2, unit("Pa")), session(3, MILLIBAR, fitted=False)]

    def told(*errors: tuple[int, float]) -> float:
        faults: Any = [SimpleNamespace(recording=index, error=error) for index, error in errors]
        return fault_rms(faults, sessions, SCALE)

    assert told((0, 7.0), (2, 1400.0), (0, 1.4)) == pytest.approx(0.1)
    assert told((0, 7.0), (2, 140.0)) == pytest.approx(0.05)
    assert told((1, 7.0), (3, 7.0)) == 0.0  # left out, and held out
    assert told() == 0.0


def test_what_is_known_to_be_wrong_with_the_data_is_not_seen_below() -> None:
    def left(rms: float) -> Any:
        return SimpleNamespace(rms=rms, significant=True)

    causes: Any = [SimpleNamespace(name="delay")]
    for given, verdicts in ((causes, ("explained", "partly_explained")), ([], ("adequate", "unexplained"))):
        told = [verdict_of(given, left(0.01), left(by * 0.02), STANDARD, True, 0.02) for by in (1.0, 1.001)]
        assert tuple(told) == verdicts


def test_what_is_worse_on_held_out_data_explains_a_part_at_most() -> None:
    left: Any = SimpleNamespace(rms=1e-6, significant=True)
    causes: Any = [SimpleNamespace(name="delay")]
    for given, verdicts in ((causes, ("explained", "partly_explained")), ([], ("adequate", "adequate"))):
        told = (verdict_of(given, left, left, STANDARD, doubtful=doubtful) for doubtful in (False, True))
        assert tuple(told) == verdicts


def test_a_loss_is_said_with_its_interval_and_the_loads_that_it_is_of() -> None:
    won = Gain(0.7, 1.1, "mbar", -57.0, (-80.0, -40.0), is_certain=True)
    worse = "on held-out data the extended model is worse than the baseline (error 1.1 instead of 0.7 mbar,"
    worse += " 40 to 80 % more)"
    assert limit_rejected(won, "the held-out loads reach 900 N")[0].startswith(
        f"{worse}: the held-out loads reach 900 N;"
    )
    alike = "the held-out loads are like the fitted ones, so that the session or the model is wrong"
    rejected = "it is rejected, so that model and calibration are the baseline's (fit"
    assert limit_rejected(won, None)[0].startswith(f"{worse}: {alike}; {rejected}")
    far = replace(won, ci95=(-1234.0, -40.0))
    assert "40 to 1234 % more" in limit_rejected(far, None)[0]
    assert (
        "(error 1.1 instead of 0.7 mbar, which may be chance)"
        in limit_rejected(replace(won, is_certain=False), None)[0]
    )
    assert limit_rejected(replace(won, rmse_after=0.7), None) == []


def test_what_is_off_elsewhere_is_said_beside_what_was_fitted_and_the_loads_that_it_is_of() -> None:
    off = "held-out recordings are off by 19 % of full scale, fitted ones by 1.5 %"
    higher = "the held-out loads reach 900 N"
    assert limit_held_out_excess(0.19, 0.015, higher) == [f"{off}: {higher}"]
    alike = (
        "their loads are no faster, higher or longer, so that they are of another unit or a changed one, or the model"
        " fits for a wrong reason"
    )
    assert limit_held_out_excess(0.19, 0.015, None) == [f"{off}: {alike}"]
    assert limit_held_out_excess(0.0, 0.015, higher) == []


def test_a_past_is_said_in_the_readings_unit() -> None:
    zero = Zero(shift_of("reading"), -0.05, 0.01, 0.05, may_have_drifted=True)
    (said,) = limit_zero_drifted([zero], replace(SCALE, reading=140.0))
    assert "the zero is at -7 mbar where the recordings begin" in said
    (falling,) = limit_zero_drifted([zero], SCALE)  # the reading falls as the load grows
    assert "the zero is at 7 mbar where" in falling
    assert limit_zero_drifted([replace(zero, may_have_drifted=False)], SCALE) == []


def test_of_a_curve_beside_a_tare_the_range_is_told_that_its_parameters_are_of() -> None:
    tare, offset = (Zero(shift_of(what), -0.375, 0.001, 0.4) for what in ("load", "reading"))
    curve, other = effect("sensor_nonlinearity"), effect("play_hysteresis")
    (said,) = limit_curves_in_tare([offset, tare], [other, curve], SCALE, STANDARD)
    assert "full scale is 800 N of the load as logged, 500 N without the tare" in said
    assert "parameters of the sensor nonlinearity are those of a curve over 800 N" in said
    small = replace(tare, value=0.999 * STANDARD.standing)
    for zeros, effects in (([offset], [curve]), ([tare], [other]), ([small], [curve]), ([tare], [])):
        assert limit_curves_in_tare(zeros, effects, SCALE, STANDARD) == []


def test_a_zero_that_is_seen_later_on_is_led_back_from_no_load() -> None:
    """Of a unit that was unloaded between its loads nothing is unknown but what was before the recordings."""
    shift = shift_of("reading")
    for extrapolated_from, begins, asked in (
        (0.019, "without load the reading is 7 mbar (5 %", "before the first load"),
        (
            0.021,
            "extrapolated to no load from 2.1 % of full load, the reading is 7 mbar (5 %",
            "without load that the sensor can read",
        ),
    ):
        zero = Zero(shift, 0.05, 0.01, 0.05, ("load_cell_tare",), extrapolated_from=extrapolated_from)
        (said,) = limit_zero_extrapolated([zero], replace(SCALE, reading=140.0), STANDARD)
        assert said.startswith(begins)
        assert said.endswith(f"(record a rest {asked})")
        assert ("below such loads" in said) == (extrapolated_from > STANDARD.standing)
        for told in (replace(zero, extrapolated_from=0.0), replace(zero, may_have_drifted=True)):
            assert limit_zero_extrapolated([told], SCALE, STANDARD) == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_offset_that_a_drift_may_have_brought_is_of_its_past(monkeypatch: pytest.MonkeyPatch, sign: float) -> None:
    """The same way, and up to ten times what it drifts by in a recording, on the mean."""
    moves = {"a": (0.3, 0.31), "b": (0.1, 0.13), "unfitted": (0.0, 9.0)}

    def drifted(one: Any, model: Any) -> Any:
        first, last = moves[one.name]
        return sign * np.array([first, 7.0, last])

    monkeypatch.setattr(_zero, "_drift_at_rest", drifted)
    kept = {"a": [True, True], "b": [False, True], "unfitted": [False, False]}
    sessions: Any = [SimpleNamespace(name=name, fitted=np.array(mask)) for name, mask in kept.items()]
    for value, may_have_drifted in ((0.1999, True), (0.2001, False), (-0.1, False), (0.0, False)):
        assert _may_have_drifted(sign * value, sessions, MODEL, STANDARD) is may_have_drifted
    assert not _may_have_drifted(0.1, sessions[2:], MODEL, STANDARD)


def test_a_drift_of_a_tenth_of_a_tare_may_be_the_tares_own() -> None:
    """Of the reading's zero alone, and of a tare's alone."""
    tare, offset = (Zero(shift_of(signal), 0.05, 0.001, 0.04) for signal in ("load", "reading"))
    drift, gain = effect("warm_up"), effect("gain_drift")
    for size, told in ((0.004, tare), (0.004001, None)):
        assert creeping_tare([offset, tare], drift, size, STANDARD) is told
    assert creeping_tare([offset], drift, 0.001, STANDARD) is None
    assert creeping_tare([], drift, 0.001, STANDARD) is None
    assert creeping_tare([tare], gain, 0.001, STANDARD) is None
    assert creeping_tare([tare], drift, 0.004, replace(STANDARD, extrapolates=11.0)) is None
    said = reason_tare_creeps(SimpleNamespace(effect=drift, member=SimpleNamespace(size=0.0014)), tare)  # type: ignore[arg-type]
    assert (
        "warm up moves the reading by 0.14 % of full scale, but is not named: a tare of 4 % may creep by as much"
        in said
    )


# -- what remembers ---------------------------------------------------------------------------------------------------
def test_a_memory_counts_once_in_a_mean() -> None:
    noise = GaussMarkov(0.004, 0.375, 0.1, 0.1, 0.1, 0.0, STANDARD)
    assert noise.sd_of_mean(3.0) == pytest.approx(0.002)
    assert noise.sd_of_mean(0.75) == pytest.approx(0.004)
    assert noise.sd_of_mean(0.1) == pytest.approx(0.004)


def test_what_neighbours_share_is_the_sum_of_their_products() -> None:
    """A sum of products against the root of their squares' sum: 3.89 of it."""
    rng = np.random.default_rng(1)
    signals = [np.cumsum(rng.standard_normal(90)), rng.standard_normal(30)]
    blocks: Any = [SimpleNamespace(residual=one) for one in signals]
    for lag in (1, 2):
        products = [one[i + lag] * one[i] for one in signals for i in range(one.size - lag)]
        score = sum(products) / math.sqrt(sum(one**2 for one in products))
        assert score > 3.9
        assert _lagged(blocks, lag, STANDARD) == pytest.approx(sum(products))


def test_what_remembers_nothing_is_no_structure() -> None:
    nothing: Any = SimpleNamespace(significant=False, rms=0.0)
    memory: Any = SimpleNamespace(is_noise=False, beyond_noise=0.003)
    for rms, size, found in ((0.003, 0.002, 0.002), (0.0, 0.002, 0.0), (0.003, 0.0, 0.0)):
        memory.beyond_noise = rms
        left = ResidualStructure(nothing, nothing, nothing, memory, "", size)
        assert (left.rms, left.significant) == (found, found > 0.0)


# -- what undoes one another ------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Moving:
    """A model whose effects each add a wave, all of one shape."""

    parts: tuple[tuple[str, float], ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.parts)

    def without(self, *names: str) -> _Moving:
        return _Moving(tuple(part for part in self.parts if part[0] not in names))

    def simulate(self, conditions: None) -> Any:
        return 3.0 + sum(size for _, size in self.parts) * np.resize([1.0, -1.0], 40)


def _session(fitted: bool = True) -> Any:
    return SimpleNamespace(conditions=None, fitted=np.full(40, fitted))


def test_effects_undo_each_other_where_their_powers_are_twice_that_of_all() -> None:
    """Of one shape their sum is that of their sizes."""

    def told(**sizes: float) -> list[str]:
        return cancelling_effects([_session(), _session(False)], _Moving(tuple(sizes.items())), STANDARD)  # type: ignore[arg-type]

    assert told(a=3.0, b=-2.0) == ["a", "b"]
    assert told(a=3.0, b=1.0) == []
    # 1 and -x: 1 + x^2 against 2 (1 - x)^2, beyond x = 2 - sqrt(3).
    bound = 2.0 - math.sqrt(3.0)
    assert told(a=1.0, b=-0.999 * bound) == []
    assert told(a=1.0, b=-1.001 * bound) == ["a"]
    # And of these such as move it by three quarters of all together: of 1 - x, from 3/7 on.
    assert told(a=1.0, b=-0.999 * 3.0 / 7.0) == ["a"]
    assert told(a=1.0, b=-1.001 * 3.0 / 7.0) == ["a", "b"]
    assert told() == []


@pytest.mark.parametrize(("error", "names"), [(math.sqrt(2.0) - 1e-9, ("a",)), (math.sqrt(2.0) + 1e-9, ("a", "b"))])
def test_of_effects_that_undo_each_other_the_idler_goes(
    monkeypatch: pytest.MonkeyPatch, error: float, names: tuple[str, ...]
) -> None:
    """That without which the fit is cheapest, unless it leaves twice the power."""
    candidates = [candidate("a"), candidate("b")]
    evidence: Any = ToldEvidence(candidates, worth(1.0, 1.0))
    evidence.noise_sd = 0.1

    def model(*own: str) -> Any:
        made = SimpleNamespace(names=own, parts=own)
        made.without = lambda name: model(*(one for one in own if one != name))
        return made

    left = {("a", "b"): 1.0, ("a",): error, ("b",): 0.1, (): 10.0}
    costs = {("a",): 5.0, ("b",): 7.0}

    class Left:
        def __init__(self, *given: Any) -> None: ...

        def consistent(self, found: Any) -> Any:
            return SimpleNamespace(model=model("a", "b"))

        def is_validated(self, one: Any, plain: Any) -> bool:
            return True

    monkeypatch.setattr(_inference, "error_of", lambda sessions, one: left[one.names])
    monkeypatch.setattr(_inference, "LeftOut", Left)
    monkeypatch.setattr(_inference, "fit_of_set", lambda *given: SimpleNamespace(model=model("a", "b")))
    monkeypatch.setattr(
        _inference, "fit", lambda _, one, *steps: SimpleNamespace(model=one, cost=costs.get(one.names, 9.0))
    )
    monkeypatch.setattr(
        _inference,
        "cancelling_effects",
        lambda sessions, one, thresholds: list(one.names) if len(one.names) > 1 else [],
    )
    monkeypatch.setattr(_inference, "extrapolating_effect", lambda *given: None)
    monkeypatch.setattr(_inference, "evidence_about", lambda one, other: (other, other.posterior((0,))))
    monkeypatch.setattr(_inference, "members_of", lambda evidence, best, fit: best.members)
    state: Any = SimpleNamespace(
        linearisation=evidence.linearisation, evidence=evidence, best=evidence.posterior((0, 1)),
        thresholds=replace(STANDARD),
        fit=SimpleNamespace(model=model("a", "b")), likelihood=lambda: "likelihood",
    )  # fmt: skip
    found: Any = _validated(state, SimpleNamespace(model=model()), [])  # type: ignore[arg-type]
    assert found.fit.model.names == names
    gone = () if len(names) > 1 else ("b",)
    assert (found.members(), found.refused) == (tuple(range(len(names))), gone)


def test_gains_of_their_own_are_said_with_the_recordings_that_lie_farthest_apart() -> None:
    gains = [OwnGain("b", 0.0, 0.0021), OwnGain("a", 0.0, -0.0134), OwnGain("c", 0.0, 0.0113)]
    (said,) = limit_own_gains(gains)
    assert said.startswith(
        "each recording has a gain of its own, from -1.3 % in a to +1.1 % in c relative to that of all,"
    )
    assert limit_own_gains([]) == []


def test_of_gains_that_change_the_largest_changes_are_said() -> None:
    shares = {"a": (0.01, -0.02), "b": (0.0, 0.005, 0.0), "c": (0.0,), "d": (0.0, 0.001, 0.003)}
    gains = [OwnGain(name, 7.5 * k, share, k > 0) for name, parts in shares.items() for k, share in enumerate(parts)]
    assert [(one.recording, one.begins_s) for one in changes_of(gains)] == [
        ("a", 7.5), ("b", 7.5), ("b", 15.0), ("d", 15.0), ("d", 7.5),
    ]  # fmt: skip
    (said,) = limit_own_gains(gains)
    assert said.startswith(
        "the gain changes by -3 % at 7.5 s in a, by +0.5 % at 7.5 s in b, by -0.5 % at 15 s in b, by +0.2 % at 15 s in"
        " d and 1 more, for example because the unit slips: causes are judged with this allowed for, what is left over"
        " is not; no model can predict the gain of another recording"
    )


def test_a_reading_that_is_early_is_the_loads_being_late() -> None:
    drift = effect("zero_drift").start({})
    model = MODEL.with_part("zero_drift", drift).with_part("delay", np.array([-0.0174]))
    (said,) = limit_early(model, [_named("zero_drift"), _named("delay")])
    assert said.startswith(
        "the reading comes 17.4 ms before the load (delay): no unit answers a load before it is there"
    )
    assert limit_early(model, [_named("zero_drift")]) == []  # in the model, and no cause
    assert limit_early(MODEL.with_part("delay", np.array([0.0174])), [_named("delay")]) == []


def test_of_zeros_that_change_the_largest_changes_are_said() -> None:
    changes = [ZeroChange("a", 7.5 * k, 0.03 / k) for k in range(1, 7)]
    (said,) = limit_zero_jumps(changes)
    assert said.startswith(
        "the zero jumps, in shares of full scale, by +3 % at 7.5 s in a, by +1.5 % at 15 s in a, by +1 % at 22.5 s in"
        " a, by +0.75 % at 30 s in a and 2 more, for example because the unit slips, water moves in a line, or the"
        " load cell jumps: jumps that are not seen may imitate any effect of the unit, so that none is more than half"
        " sure;"
    )
    (late,) = limit_zero_jumps([ZeroChange("a", 1_700_000_007.54, 0.03)])
    assert "by +3 % at 1700000007.5 s in a" in late
    assert limit_zero_jumps([]) == []


@pytest.mark.parametrize(
    ("rate_per_s", "share", "said"),
    [
        (0.2, 0.1, None),
        (0.01, 0.1, "100 s: a unit that relaxes more slowly"),
        (2550.0, 50.0, "0.000392 s: a unit that relaxes faster"),
    ],
)
def test_a_unit_beyond_the_range_that_can_be_followed_is_told(
    monkeypatch: pytest.MonkeyPatch, rate_per_s: float, share: float, said: str | None
) -> None:
    step_s = 0.05
    load = np.tile(np.repeat([0.0, 1.0], 5), 240)
    session: Any = SimpleNamespace(
        conditions=Conditions(step_s * np.arange(load.size), load, step_s), reading=load, fitted=load >= 0.0
    )
    model = replace(MODEL, relaxing_share=share, relaxation_rate_per_s=rate_per_s)
    with_own = {"residual_of": lambda one, model: one.reading - model.simulate(one.conditions)}
    for name, stand_in in with_own.items():
        monkeypatch.setattr(_validation, name, stand_in)
    found = limit_relaxation_range(model, [session], STANDARD, beside_names=True)
    assert (found == []) if said is None else said in found[0]
    alone = limit_relaxation_range(model, [session], STANDARD, beside_names=False)
    assert [one.partition(", and what is named may stand")[0] for one in found] == alone
    by_nothing = replace(model, relaxing_share=1e-4)
    assert limit_relaxation_range(by_nothing, [session], STANDARD, beside_names=True) == []
