"""A law whose fit ends at a bound goes on beyond it where there is a farther one, and what stood beside it may go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.models.effects import catalogue, effect
from smartshoe.models.effects.effect import Conditions, EffectParameter
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

RATE_HZ, DURATION_S = 100.0, 130.0
NOISE_MBAR = 0.06
PLAIN = ExtendedModel(1.0, 0.08, 0.22, 500.0, 100.0, "mbar")
Array = NDArray[np.float64]

# Units that creep by what each newton has been there for: c (t/10 s)^alpha, and a wall with two relaxations.
CREEPS = {
    ("power_law_creep", alpha, share): lambda t_s, alpha=alpha, share=share: share * (t_s / 10.0) ** alpha
    for alpha, share in ((0.2, 0.2), (0.3, 0.2), (0.35, 0.1))
} | {
    ("second_relaxation", tau_s, share): lambda t_s, tau_s=tau_s, share=share: (
        0.08 * (1.0 - np.exp(-t_s / 1.5)) + share * (1.0 - np.exp(-t_s / tau_s))
    )
    for tau_s, share in ((150.0, 0.03), (250.0, 0.1))
}
DAILY = (("power_law_creep", 0.35, 0.1), ("second_relaxation", 250.0, 0.1))  # of each law one


def _corners(kind: str, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Times in s and loads, shares of the highest."""
    at, now = [(0.0, 0.0), (3.0, 0.0)], 3.0
    if kind == "triangles":
        k = 0
        while now < DURATION_S - 22.0:
            high, rise_s = (1.0, 0.5, 0.8)[k % 3], (2.0, 5.0, 1.0)[k // 3 % 3]
            at += [(now + rise_s, high), (now + 2 * rise_s, 0.0), (now + 2 * rise_s + (0.0, 1.0, 4.0)[k % 3], 0.0)]
            now, k = at[-1][0], k + 1
    elif kind == "holds":
        for high in (1.0, 0.4, 0.7):
            at += [(now + 1.0, high), (now + 20.0, high), (now + 21.0, 0.0), (now + 36.0, 0.0)]
            now += 36.0
    else:
        for high in rng.permutation(np.linspace(0.0, 1.0, 13)):
            at += [(now + 1.0, high), (now + 8.0, high)]
            now += 8.0
    return [*at, (now + 1.0, 0.0), (DURATION_S, 0.0)]


def _recording(seed: int, kind: str, creep: Array) -> Recording:
    """A unit of 0.2 mbar/N that creeps by the superposition of ``creep`` (n,) after each step of its load."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(creep.size) / RATE_HZ
    load = np.interp(time_s, *np.transpose(_corners(kind, rng)))
    reading = load + fftconvolve(np.diff(load, prepend=0.0), creep)[: load.size]
    noise = rng.standard_normal((2, load.size))
    return Recording.from_arrays(
        time_s=time_s,
        force_n=500.0 * load + 0.15 * noise[0],
        pressure_mbar=100.0 * reading + NOISE_MBAR * noise[1],
        name=kind,
        unit="x",
    )


def _diagnosed(creep: Array) -> Diagnosis:
    fitted = [_recording(seed, kind, creep) for seed, kind in enumerate(("triangles", "holds"), start=1)]
    return diagnose(fitted, hold_out=[_recording(3, "shuffled", creep)])


@pytest.mark.parametrize(
    "unit", [unit if unit in DAILY else pytest.param(unit, marks=pytest.mark.long) for unit in CREEPS], ids=str
)
def test_creep_beyond_the_usual_bounds_is_told_alone(unit: tuple[str, float, float]) -> None:
    """At its bound a law left a permanent set, 0.87 to 0.95 sure, or had no name."""
    found = _diagnosed(CREEPS[unit](np.arange(int(RATE_HZ * DURATION_S)) / RATE_HZ))
    assert found.verdict == "explained"
    assert [cause.name for cause in found.causes] == [unit[0]]
    assert found.to_dict()["extended"]["rmse"]["value"] < 1.25 * NOISE_MBAR
    assert found.model is not None
    again = ExtendedModel.from_dict(found.model.to_dict())
    load = np.linspace(0.0, 1.0, 500)
    conditions = Conditions(np.arange(500) / RATE_HZ, load, 1.0 / RATE_HZ, 0.0)
    assert np.array_equal(again.simulate(conditions), found.model.simulate(conditions))


@given(st.floats(0.0, 1.0), st.sampled_from(["lower", "upper"]), st.floats(0.1, 5.0))
def test_only_what_lies_at_a_bound_is_freed_and_only_there(within: float, side: str, beyond: float) -> None:
    plain = EffectParameter("x", "1", "", None, 1.0, 3.0, 1.0)
    one = replace(plain, farthest=1.0 - beyond if side == "lower" else 3.0 + beyond)
    assert plain.widened == plain
    assert (one.widened.lower, one.widened.upper) == ((1.0 - beyond, 3.0) if side == "lower" else (1.0, 3.0 + beyond))
    assert one.widened.widened == one.widened
    creep = effect("power_law_creep")
    strength, exponent = creep.parameters
    at = exponent.lower + within * (exponent.upper - exponent.lower)
    model = PLAIN.with_part(creep, [0.05, at])
    assert model.ended == ((creep.name,) if at == exponent.lower else ())
    freed = model.freed(creep.name)
    assert np.array_equal(freed.theta, model.theta)
    assert freed.part(creep.name).effect.parameters == (strength, exponent.widened if model.ended else exponent)
    assert freed.ended == PLAIN.with_part(creep, [0.05, exponent.upper]).ended == ()


def test_a_farther_bound_lies_beyond_the_usual_ones() -> None:
    for one in catalogue().values():
        for parameter in one.parameters:
            if parameter.farthest is not None:
                assert not parameter.lower <= parameter.farthest <= parameter.upper
                assert parameter.null is None
