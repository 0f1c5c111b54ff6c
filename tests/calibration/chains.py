"""Extended models and loads to draw from, shared by the tests of the extended filter."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects import Conditions, Effect, blocks, catalogue, effect
from smartshoe.models.extended import ExtendedModel

BASELINE = ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
STEP_S = 0.01
LOOPED = ("wall_hardening", "mullins_softening", "gas_compression")
"""Springs that bend beside the relaxing arm: between samples the core takes their load for straight, they do not."""
NEARLY = frozenset({
    "sensor_lag", "flexible_lag", "rate_gain", "load_unload_asymmetry", "flexible_asymmetry", "cycle_conditioning",
    *LOOPED,
})  # fmt: skip
"""Effects whose inverse is not exact everywhere: each has a test of its own."""
DRIFTS = ["gain_drift", "zero_drift", "warm_up", "flexible_gain_drift"]


def invertible() -> list[str]:
    """Physical effects and flexible blocks that have an inverse at their typical size."""
    return [
        one.name
        for one in (*catalogue().values(), *(one for family in blocks().values() for one in family))
        if one.is_physical and (one.place == "core" or one.inverse(typical(one, 0), STEP_S) is not None)
    ]


def typical(one: Effect, seed: int) -> np.ndarray:
    """Values between 0.3 and 3 times the typical size, with one of the effect's shapes; no temperature."""
    rng = np.random.default_rng(seed)
    shape = one.shapes[int(rng.integers(len(one.shapes)))]
    found = []
    for parameter in one.parameters:
        if parameter.null is None:
            found.append(shape[parameter.name])
            continue
        strength = parameter.size * rng.uniform(0.3, 3.0) * (1.0 if parameter.lower >= 0.0 else rng.choice([-1.0, 1.0]))
        logged = not parameter.channel
        found.append(float(np.clip(parameter.null + strength * logged, parameter.lower, parameter.upper)))
    values = np.array(found)
    strengths = [k for k, parameter in enumerate(one.parameters) if parameter.null is not None]
    while one.place in ("contact", "wall") and not _follows_the_load(one, values):
        values[strengths] *= 0.5
    return values


def _follows_the_load(one: Effect, values: np.ndarray) -> bool:
    """Whether the output rises and falls with the load everywhere: else two loads give one output."""
    load = np.interp(np.arange(5000), [0, 1000, 2000, 3000, 4000, 5000], [0.0, 1.0, 0.2, 0.8, 0.5, 1.0])
    out = one.apply(load, Conditions(np.arange(5000) * STEP_S, load, STEP_S), values)
    slope = np.diff(out) / np.diff(load)
    return bool(np.mean(slope < 0.05) < 1e-3)  # but for single samples, where a cycle is counted


def chain_of(names: list[str], seed: int) -> ExtendedModel:
    """The baseline with the effects ``names`` at drawn strengths."""
    model = BASELINE
    for k, name in enumerate(names):
        model = model.with_part(effect(name), typical(effect(name), seed + k))
    return model


def some_conditions(seed: int, corners: int = 16, step_s: float = STEP_S) -> Conditions:
    """Ramps and holds between multiples of a fifth of full scale, each 0.5 to 3 s long, from rest."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.integers(0, 6, corners) / 5.0, 2)
    levels[:2] = 0.0
    at_s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 3.0, levels.size - 1))])
    time_s = np.arange(int(at_s[-1] / step_s)) * step_s
    return Conditions(time_s, np.interp(time_s, at_s, levels), step_s)


INVERTIBLE = invertible()
EXACT = sorted(set(INVERTIBLE) - NEARLY)
