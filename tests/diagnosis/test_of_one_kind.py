"""Members of one kind, each small since the other takes its part: what all of them do has one name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from test_diagnosis_parts import recording, sessions_of

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Diagnosis, Thresholds
from smartshoe.diagnosis._likelihood import Fit, Likelihood
from smartshoe.diagnosis._members import Member, taken_together
from smartshoe.diagnosis._naming import names_of
from smartshoe.diagnosis._validation import contributed_rms, do_cancel
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
NOWHERE = Fit(MODEL, 0.0, Likelihood((), 1.0, MODEL, Thresholds()))
LEFT, OTHERS = 1e-3, 2e-3  # what nothing explains, and what other equations depart by, shares of full scale


def _member(name: str, size: float) -> Member:
    return Member(effect(name), size, 0.5, (), NOWHERE, (), 1000.0, others_departure_rms=OTHERS)


SMALL = [_member("delay", 6e-4), _member("clock_drift", 4e-4)]
BOTH = replace(_member("delay", 0.012), kin=("clock_drift",))
LARGE = _member("rate_gain", 0.03)


def test_two_that_are_unsure_alone_and_sure_together_have_one_name() -> None:
    assert [one.effect.name for one in names_of([LARGE, *SMALL], LEFT, STANDARD)] == ["rate_gain"]
    named = names_of([LARGE, *SMALL], LEFT, STANDARD, together=[BOTH])
    assert [one.effect.name for one in named] == ["rate_gain", "delay"]
    assert named[1].equivalents == ("clock_drift",)
    assert named[1].law_probability == 0.5
    assert named[1].member is BOTH


def test_one_that_is_sure_alone_keeps_its_name_and_its_size() -> None:
    sure = _member("delay", 0.05)
    named = names_of([sure, _member("clock_drift", 4e-4)], LEFT, STANDARD, together=[replace(BOTH, size=0.06)])
    assert [(one.effect.name, one.member) for one in named] == [("delay", sure)]


def test_two_that_undo_each_other_have_no_name() -> None:
    named = names_of([LARGE, *SMALL], LEFT, STANDARD, together=[replace(BOTH, size=5e-4)])
    assert [one.member for one in named] == [LARGE]


@pytest.mark.parametrize(("delay_s", "cancels"), [(0.05, False), (-0.05, True)])
def test_those_that_undo_each_other_are_not_taken_together(delay_s: float, cancels: bool) -> None:
    """A reading that is late by a lag and early by a delay, as friction that goes with the velocity is followed."""
    model = MODEL.with_part("sensor_lag", [0.05, 0.0]).with_part("delay", [delay_s])
    sessions, _ = sessions_of(recording())
    sizes, together = contributed_rms(sessions, model, model.names)
    assert do_cancel(sizes, together, STANDARD) is cancels
    if cancels:
        extended = Fit(model, 0.0, Likelihood(sessions, 0.001, MODEL, STANDARD))
        unasked: Any = SimpleNamespace(thresholds=STANDARD)
        members = [_member("sensor_lag", 6e-4), _member("delay", 4e-4)]
        assert taken_together(members, unasked, unasked, extended) == ()


# -- a unit: a reading that falls behind, a contact that settles, friction ----------------------------------------
FINE_S, EVERY, FULL_N = 0.001, 10, 150.0
LOST_A_SECOND = 6e-4  # of its time, by the logger of the reading


def _load() -> tuple[Array, Array]:
    """Three triangles of each of four rates, to three heights, with rests of two seconds."""
    corners, at_s = [(0.0, 0.0), (2.0, 0.0)], 2.0
    for rate in (0.05, 0.1, 0.3, 1.0):
        for height in (1.0, 0.7, 0.9):
            ramp_s = height / rate
            corners += [(at_s + ramp_s, height), (at_s + 2.0 * ramp_s, 0.0), (at_s + 2.0 * ramp_s + 2.0, 0.0)]
            at_s += 2.0 * ramp_s + 2.0
    time_s = np.arange(0.0, at_s + 1.0, FINE_S)
    return time_s, np.interp(time_s, *zip(*corners, strict=True))


def _slipping(strain: Array) -> Array:
    """Springs that slip, each at its own load, beside the tube."""
    borne = np.zeros_like(strain)
    for stiffness, most in ((0.07, 0.0014), (0.05, 0.0028), (0.035, 0.0042), (0.022, 0.0056)):
        reach, end = most / stiffness, 0.0
        for k, at in enumerate(strain.tolist()):
            end = min(max(end, at - reach), at + reach)
            borne[k] += stiffness * (at - end)
    return borne


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    time_s, load = _load()
    contact = load + 0.19 * (load ** (2.0 / 3.0) - load)
    acting = contact - _slipping(contact)
    kept = np.exp(-FINE_S / 4.0)
    late = lfilter([1.0 - kept], [1.0, -kept], acting)
    read = 0.85 * acting + 0.15 * late
    read = np.interp(time_s * (1.0 - LOST_A_SECOND), time_s, read)
    read += 7e-4 * np.random.default_rng(2).standard_normal(read.size)
    taken = slice(None, None, EVERY)
    return diagnose(
        Recording.from_arrays(
            time_s=time_s[taken], force_n=FULL_N * load[taken], pressure_mbar=200.0 * read[taken], name="only"
        )
    )


@pytest.mark.long
def test_a_clock_that_falls_behind_is_told_beside_a_curve_and_friction(found: Diagnosis) -> None:
    timing = [cause for cause in found.causes if cause.effect.family == "timing"]
    assert [cause.confidence > 0.75 for cause in timing] == [True]
    assert {timing[0].name, *timing[0].equivalents} & {"clock_drift"}
    assert timing[0].size > 0.005
    assert {"hysteresis", "static_curve"} <= {cause.effect.family for cause in found.causes}
    assert not {"delay", "clock_drift"} & {*found.minor}
