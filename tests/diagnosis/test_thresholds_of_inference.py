"""Numbers of the record by which a model is judged: what each decides."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from deciding import STANDARD, decides
from numpy.typing import NDArray
from told_evidence import taken_for_exact

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._evidence import Evidence
from smartshoe.diagnosis._likelihood import Likelihood, fit
from smartshoe.diagnosis._scale import Scale, full_scale
from smartshoe.diagnosis._sensitivity import Linearised, linearised, nuisance_precision
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._validation import LeftOut, extrapolating_effect
from smartshoe.diagnosis._verdict import verdict_of
from smartshoe.diagnosis._zero import zeros_of
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

STEP_S = 0.04
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
CURVED = MODEL.with_part(effect("gas_compression"), np.array([0.05]))


def _recording(model: ExtendedModel = MODEL, seed: int = 0, peak: float = 1.0, offset: float = 0.0) -> Recording:
    """A rest and eight triangles to ``peak`` full scales; ``offset`` of the reading in full scales."""
    time_s = np.arange(0.0, 60.0, STEP_S)
    load = peak * np.clip(np.abs((time_s / 6.0 + 0.5) % 1.0 - 0.5) * 4.0 - 0.6, 0.0, 1.0) * (time_s > 5.0)
    share = model.simulate(Conditions(time_s, load, STEP_S)) + offset
    share = share + 0.001 * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * share, name=f"run_{seed}")


def _sessions(
    runs: list[Recording], held: list[bool], thresholds: Thresholds = STANDARD
) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in runs]
    scale = full_scale(runs, usable, thresholds)
    return prepare(runs, usable, held, scale, [1], thresholds), scale


@pytest.fixture(scope="module")
def curved() -> Linearised:
    sessions, scale = _sessions([_recording(CURVED, seed) for seed in range(3)], [False] * 3)
    return linearised(baseline_of(sessions, scale), sessions, STANDARD)


def _curve(given: Linearised) -> int:
    return next(k for k, one in enumerate(given.candidates) if one.name == "gas_compression")


def test_strength_sd_is_how_large_an_effect_may_be(curved: Linearised) -> None:
    def strength(thresholds: Thresholds) -> float:
        evidence = Evidence(replace(curved, thresholds=thresholds), 0.002)
        return float(np.abs(taken_for_exact(evidence, (_curve(curved),)).strengths[0]).max())

    small, usual = decides("strength_sd", 1e-5, 0.03, strength)
    assert small < 0.1 * usual


def test_validated_is_how_sure_a_gain_over_what_is_left_out_must_be(curved: Linearised) -> None:
    found = fit(Likelihood(curved.sessions, 0.002, CURVED, STANDARD), CURVED)

    def refused(thresholds: Thresholds) -> bool:
        return not LeftOut(curved.sessions, 0.002, found.model, thresholds).consistent(found).model.parts

    assert decides("validated", 0.5, 1e6, refused) == (False, True)


def test_foreseen_is_how_much_of_what_is_left_out_an_extension_must_do_away_with() -> None:
    curved = MODEL.with_part(effect("gas_compression"), np.array([0.3]))
    runs = [_recording(curved, seed) for seed in range(3)]

    def extended(thresholds: Thresholds) -> bool:
        return bool(diagnose(runs[:2], hold_out=runs[2], thresholds=thresholds).causes)

    assert decides("foreseen", 0.25, 1.0, extended) == (True, False)


def test_memory_is_how_else_a_law_may_follow(curved: Linearised) -> None:
    def departure_sds(thresholds: Thresholds) -> float:
        return Evidence(replace(curved, thresholds=thresholds), 0.002).posterior((_curve(curved),)).departure_sds[0]

    one, decades = decides("memory_s", (3.0,), (0.3, 3.0, 30.0), departure_sds)
    assert 0.0 < one != decades > 0.0


def test_unknown_past_is_what_an_arm_may_remember_of_before() -> None:
    def known(thresholds: Thresholds) -> float:
        (session,), _ = _sessions([_recording()], [False], thresholds)
        return float(nuisance_precision(session, MODEL)[1, 1])

    little, much = decides("unknown_past", 0.01, 0.1, known)
    assert little == pytest.approx(100.0 * much)


@pytest.mark.parametrize(
    ("field", "low", "high", "named"),
    [
        ("foreign_zero", 0.002, 0.3, (False, True)),  # of the reading's span
        ("zero_sd", 4e-4, 0.002, (True, False)),
        ("false_alarm", 1e-4, 1e-100, (True, False)),
    ],
)
def test_a_zero_is_named_by_its_size_and_how_well_it_is_known(
    field: str, low: float, high: float, named: tuple[bool, bool]
) -> None:
    sessions, scale = _sessions([_recording(seed=seed, offset=0.005) for seed in range(2)], [False] * 2)

    def is_named(thresholds: Thresholds) -> bool:
        return bool(zeros_of(sessions, MODEL, scale, 0.0, 0.0, thresholds))

    assert decides(field, low, high, is_named) == named


def test_false_name_is_what_lacks_of_the_confidence_in_an_offset_at_rest() -> None:
    runs = [_recording(seed=seed, offset=0.04) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=runs[2], thresholds=replace(STANDARD, false_name=0.17))
    assert {one.name: one.confidence for one in found.causes} == {"zero_offset": 0.83}


def test_tolerable_is_the_structure_that_a_good_unit_may_leave() -> None:
    left: Any = SimpleNamespace(rms=1e-3, significant=True)
    assert decides("tolerable", 5e-4, 2e-3, lambda t: verdict_of([], left, left, t)) == ("unexplained", "adequate")


def test_extrapolates_is_how_far_beyond_what_was_fitted_an_effect_is_believed() -> None:
    rated = MODEL.with_part(effect("rate_gain"), np.array([0.02, 0.4]))  # a tenth of the load, and of the rate
    sessions, _ = _sessions([_recording(rated, 0, peak=0.1), _recording(rated, 1)], [False, True])
    strict, lax = decides("extrapolates", 2.0, 1e4, lambda t: extrapolating_effect(sessions, rated, t))
    assert (strict, lax) == ("rate_gain", None)
